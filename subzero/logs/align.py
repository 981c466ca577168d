"""Several logs of one trial as one record: their clocks aligned by the channels that they share.

Both logs are put on one grid, and for every lag τ at which they overlap by half of the shorter one

    ρ(τ) = Σ cov(x, y; τ) / √(Σ var(x; τ) · Σ var(y; τ)),   sums over the channels, each in units of its deviation

so that no bias of a sensor counts. The offset of the clocks is where ρ is largest, by a parabola through nearby
values, with the Cramér-Rao bound of a delay, σ² = (1 − ρ²) / (N · |ρ″|). Left out: clocks that drift.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import correlate

from subzero.channels import HEADING, TIME
from subzero.errors import UserError
from subzero.logs.table import Sample, side_by_side
from subzero.records.record import Record

UNEXPLAINED, NOISES = 0.02, 4.0
"""At the offset 1 − ρ² is at most this, or so many times what the noise of both makes: other motions match worse."""
RIVALS = 4.0, 0.01
"""Lags where 1 − ρ² is at most so many times that of the offset, and this, may be it: they have to be in one piece, of
less than a quarter of the shorter log."""
FEWEST_POINTS = 20


def merged(records: Sequence[Record]) -> Record:
    """Return one record of the logs of a trial, on the clock of the first; a channel is that of the first that has it.

    Raises:
        UserError: they share no channel, or it does not say how their clocks differ.
    """
    first, notes, samples, taken = records[0], list[str](), list[Sample](), set[str]()
    for record in records:
        shift = 0.0
        if record is not first:
            shift, error, shared = offset(first, record)
            notes.append(
                f"{record.source}: its clock is {shift:+.4g} ± {2.0 * error:.2g} s (95 %) from that of "
                f"{first.source}, by {', '.join(shared)}."
            )
        new = [name for name in record.values if name not in taken]
        samples += [sample for name in new for sample in _samples(record, name, shift)]
        taken.update(new)
        notes += record.notes
    columns = side_by_side(samples)
    time = columns.pop(TIME.column).values
    values = {name: column.values[time >= 0.0] for name, column in columns.items()}
    return replace(first, time=time[time >= 0.0], values=values, notes=tuple(notes))


def _samples(record: Record, name: str, shift: float) -> Iterator[Sample]:
    known = np.isfinite(record.values[name])
    for at, value in zip(record.time[known], record.values[name][known], strict=True):
        yield Sample(name, "", round(float(at) + shift, 6), float(value))


def offset(first: Record, second: Record) -> tuple[float, float, list[str]]:
    """Return the offset to add to the second log's times, its standard deviation [s], and the channels that determine
    it.
    """
    shared = [name for name in first.values if name in second.values]
    step = max(float(np.median(np.diff(record.time))) for record in (first, second))
    pairs = [pair for name in shared if (pair := _on_grid(name, first, second, step))]
    if not pairs:
        raise _unclear(first, second, "they share no channel that changes")
    lags, rho, points = _correlation(pairs)
    best = int(np.argmax(rho))
    unexplained = np.where(rho > 0.0, 1.0 - rho**2, 1.0)
    near = np.flatnonzero(unexplained <= RIVALS[0] * max(unexplained[best], 0.0) + RIVALS[1])
    shorter = min(len(values) for pair in pairs for values in pair)
    is_one = near[-1] - near[0] == near.size - 1 and near.size <= shorter / 4
    noise = np.mean([np.mean(np.diff(values, 2) ** 2) / 6.0 for pair in pairs for values in pair])  # white
    is_same = unexplained[best] <= max(UNEXPLAINED, NOISES * 2.0 * noise)
    if not is_same or not is_one or not 0 < best < rho.size - 1:
        raise _unclear(first, second, f"{', '.join(shared)} match equally well or badly at several offsets")
    around = np.arange(min(near[0], best - 1), max(near[-1], best + 1) + 1)
    bend, slope, _ = np.polyfit(lags[around] - lags[best], rho[around], 2)  # noise bends three points alone
    error = step * math.sqrt(max(unexplained[best], 0.0) / (2.0 * abs(bend) * points[best]))
    return step * float(lags[best] - 0.5 * slope / bend), max(error, 0.05 * step), shared


def _unclear(first: Record, second: Record, why: str) -> UserError:
    return UserError(
        f"The clocks of {first.source} and {second.source} cannot be aligned: {why}. Import each alone."
    )


def _on_grid(name: str, first: Record, second: Record, step: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Return a channel of both logs on grids of one step from t = 0 on, in its deviation; None if it is still."""
    found = []
    for record in (first, second):
        known = np.isfinite(record.values[name])
        time, values = record.time[known], record.values[name][known]
        if np.unique(values).size < FEWEST_POINTS:
            return None
        values = np.unwrap(values, period=360.0) if name == HEADING else values
        found.append(np.interp(np.arange(0.0, time[-1], step), time, values))
    scale = float(np.std(found[0]))
    return found[0] / scale, found[1] / scale


def _correlation(pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return lags of the second after the first [steps], the correlation there, and the points that overlap."""
    n, m = (max(len(pair[k]) for pair in pairs) for k in (0, 1))
    lags = np.arange(-(m - 1), n)
    cov = np.zeros((3, lags.size))
    for pair in pairs:
        x, y = (
            np.pad(values, (0, size - len(values)), "edge") for values, size in zip(pair, (n, m), strict=True)
        )
        x, y, one_x, one_y = x - x.mean(), y - y.mean(), np.ones(n), np.ones(m)
        sums = [correlate(a, b) for a, b in ((x, y), (x * x, one_y), (one_x, y * y), (x, one_y), (one_x, y))]
        count = np.round(correlate(one_x, one_y))
        cov += [
            sums[0] - sums[3] * sums[4] / count,
            sums[1] - sums[3] ** 2 / count,
            sums[2] - sums[4] ** 2 / count,
        ]
    rho = cov[0] / np.sqrt(np.maximum(cov[1] * cov[2], 1e-12))
    kept = count >= max(0.5 * min(n, m), FEWEST_POINTS)
    return lags[kept], rho[kept], count[kept]
