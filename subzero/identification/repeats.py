"""Readings that repeat a value: a sensor that is stuck, or a logger that writes a value where it has no measurement.

Neighbours are equal by chance where a sensor rounds. In n readings of which a share q equal the one before,
n q^(L−1) runs of L equal ones are expected: longer ones are no chance, if the simulation moves meanwhile.
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
        found = [
            run for run in runs_of(each.values, at) if not _is_saturated(problem, name, each.values, run)
        ]
        if not found or not _moves(problem, name, terms, found, at, simulated):
            continue
        spans = [(float(each.time[run.first]), float(each.time[run.last])) for run in found]
        longest = max(spans, key=lambda span: span[1] - span[0])
        yield _stuck(name, record, longest, odds / at.size)
        if len(spans) > 1:
            yield _lost(name, record, tuple(spans), odds / at.size)


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
    rounding = FAR * prior.resolution / np.sqrt(12.0)
    # A vehicle begins at rest, and sensors have dead bands.
    moved = [size / FAR if run.first == at[0] else size for run, size in zip(runs, moved, strict=True)]
    return bool(
        np.linalg.norm(moved) > np.hypot(prior.level, rounding)
        or max(away) > FAR * np.hypot(prior.level, rounding)
    )


def _stuck(name: str, record: int, span: tuple[float, float], odds: float) -> Term:
    sentence = f"{name} is stuck from {span[0]:.4g} to {span[1]:.4g} s"
    return Term(f"stuck:{name}@{record}", sentence, "stuck", name, odds, record=record, spans=(span,))


def _lost(name: str, record: int, spans: tuple[tuple[float, float], ...], odds: float) -> Term:
    sentence = (
        f"{name} repeats a value in place of measurements, {len(spans)} times from {spans[0][0]:.4g} to "
        f"{spans[-1][1]:.4g} s"
    )
    return Term(f"lost:{name}@{record}", sentence, "stuck", name, odds, record=record, spans=spans)
