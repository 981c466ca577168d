"""Readings that repeat a value: a sensor that is stuck, or a logger that writes a value where it has no measurement.

Neighbours are equal by chance where a sensor rounds. In n readings of which a share q equal the one before,
n q^(L−1) runs of L equal ones are expected: longer ones are no chance, if the simulation moves meanwhile. Nor is, where
right readings may be equal for longer, a value that they jump to and back from.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from subzero.identification.explanation import Term, Terms
from subzero.identification.problem import Problem

CHANCE = 0.01
"""Runs of equal readings of which fewer are expected by chance are looked at. [-]"""
FAR = 5.0
"""Readings on both sides differ by less from a value at rest, in levels of the sensor; what moves by less, in standard
deviations of its rounding, may be rounded to equal readings. [-]"""


class Run(NamedTuple):
    """Equal readings: places of the first and the last one in the channel."""

    first: int
    last: int


def repeats(problem: Problem, name: str, terms: Terms, simulated: np.ndarray, odds: float) -> Iterator[Term]:
    """Yield the longest run of equal readings in each record, and all runs together.

    Args:
        problem: of the records.
        name: of the channel.
        terms: the explanation that has been simulated.
        simulated: readings of it (m,).
        odds: that a channel has an error in its data.
    """
    each = problem.readings_of(name, terms)
    for record in np.unique(each.record).tolist():
        at = np.flatnonzero(np.isfinite(each.values) & ~each.spikes & (each.record == record))
        usual = problem.prior(name, ())
        far = FAR * _noise(usual.level, usual.resolution)
        values = returns_of(each.values, at, far) if usual.resolution else []
        for found in (runs_of(each.values, at), *values):
            runs = [run for run in found if not _is_saturated(problem, name, each.values, run)]
            if runs and _moves(problem, name, terms, runs, at, simulated):
                yield from _terms(each.time, name, record, runs, odds / at.size)


def _terms(time: np.ndarray, name: str, record: int, runs: list[Run], odds: float) -> Iterator[Term]:
    spans = [(float(time[run.first]), float(time[run.last])) for run in runs]
    yield _stuck(name, record, max(spans, key=lambda span: span[1] - span[0]), odds)
    if len(spans) > 1:
        yield _lost(name, record, tuple(spans), odds)


def runs_of(values: np.ndarray, at: np.ndarray) -> list[Run]:
    """Return the runs of equal values (m,) at some places (n,) that are too long for chance."""
    starts = np.flatnonzero(np.diff(values[at], prepend=np.nan) != 0.0)
    lengths = np.diff(starts, append=at.size)
    for least in range(3, int(lengths.max(initial=0)) + 1):
        long = lengths >= least
        short = lengths[~long]
        equal = (float((short - 1).sum()) + 1.0) / (float(short.sum()) + 2.0)
        if at.size * equal ** (least - 1) < CHANCE:
            return [
                Run(int(at[i]), int(at[i + n - 1])) for i, n in zip(starts[long], lengths[long], strict=True)
            ]
    return []


def returns_of(values: np.ndarray, at: np.ndarray, far: float) -> list[list[Run]]:
    """Return, for each value to which readings (m,) at some places (n,) jump and from which they jump back, farther
    than they may by noise, its runs; of values that are read so three times or more.
    """
    starts = np.flatnonzero(np.diff(values[at], prepend=np.nan) != 0.0)
    lengths, own = np.diff(starts, append=at.size), values[at][starts]
    jumps = np.concatenate([[True], np.abs(np.diff(own)) > far, [own.size > 1]])
    alone = jumps[:-1] & jumps[1:]
    each = (np.flatnonzero(alone & (own == value)) for value in np.unique(own[alone]))
    return [
        [Run(int(at[starts[i]]), int(at[starts[i] + lengths[i] - 1])) for i in places]
        for places in each
        if lengths[places].sum() > 2
    ]


def _noise(level: float, resolution: float) -> float:
    """Return the standard deviation of a reading, with what rounding adds to it."""
    return float(np.hypot(level, FAR * resolution / np.sqrt(12.0)))


def _is_saturated(problem: Problem, name: str, values: np.ndarray, run: Run) -> bool:
    sensor = problem.model.channels[name]
    return bool(values[run.first] <= sensor.low or values[run.first] >= sensor.high)


def _moves(
    problem: Problem, name: str, terms: Terms, runs: list[Run], at: np.ndarray, simulated: np.ndarray
) -> bool:
    """Return whether the true value moves during runs of equal readings, together: the simulation does, or the line
    through the readings on both sides, of those at some places (n,), is away from the value.
    """
    values, prior = problem.recorded(name, terms), problem.prior(name, terms)
    inside = np.zeros(values.size, dtype=bool)
    for run in runs:
        inside[run.first : run.last + 1] = True
    rest = at[~inside[at]]
    lines = [np.interp(run, rest, values[rest]) if rest.size else values[[*run]] for run in runs]
    away = [np.abs(line - values[run.first]).max() for run, line in zip(runs, lines, strict=True)]
    moved = [np.ptp(simulated[run.first : run.last + 1]) for run in runs]
    noise = _noise(prior.level, prior.resolution)
    # A vehicle begins at rest, and sensors have dead bands.
    moved = [size / FAR if run.first == at[0] else size for run, size in zip(runs, moved, strict=True)]
    return bool(np.linalg.norm(moved) > noise or max(away) > FAR * noise)


def _stuck(name: str, record: int, span: tuple[float, float], odds: float) -> Term:
    sentence = f"{name} is stuck from {span[0]:.4g} to {span[1]:.4g} s"
    return Term(f"stuck:{name}@{record}", sentence, "stuck", name, odds, record=record, spans=(span,))


def _lost(name: str, record: int, spans: tuple[tuple[float, float], ...], odds: float) -> Term:
    sentence = (
        f"{name} repeats a value in place of measurements, {len(spans)} times from {spans[0][0]:.4g} to "
        f"{spans[-1][1]:.4g} s"
    )
    return Term(f"lost:{name}@{record}", sentence, "stuck", name, odds, record=record, spans=spans)
