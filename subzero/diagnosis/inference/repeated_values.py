"""Values that a record repeats in place of measurements: read off the record itself.

A sensor's noise changes its value from sample to sample. So a run of L equal values among samples of which a share p
repeat the one before has the probability p^(L−1), at each place. A run up to the end of the record is a frozen channel;
others are drop-outs; and so is a value that comes again and again far from its neighbours, such as 0 or −999.

A channel that is rounded and stands still repeats itself, too (`is_rounded`): there it is for the prediction to say,
and for how often the channel flickers (`rounded_values`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.data_error import DataError
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.noise import resolution_of
from subzero.diagnosis.inference.posing import usual_of

CLEAR_LOG_ODDS = 6.0
"""Runs whose log probability by chance is less than minus this are no chance."""
FAR_LEVELS, FEWEST_FAR, NEIGHBOURS, NEAREST = 8.0, 4, 5, 2
"""A value is no measurement if it comes at least so often, once in three samples in a row, so many noise levels from
what is measured around it: from each of the nearest on both sides, of which one may be an outlier. Outliers that are
rounded may be equal, but not in a row."""
MOSTLY_FAR = 0.5
"""... and in so large a share of its places: a vehicle at rest has a speed of 0, too. [-]"""
SHORT, FEWEST_FROZEN = 3, 6
"""Runs as short as this say how often values repeat by chance; a channel is frozen if it repeats so many to the end."""


class Repeats(NamedTuple):
    """Runs of equal values: where each begins among the measured samples, and how long it is."""

    first: np.ndarray
    length: np.ndarray


def repeated_values(logged: Logged, trusted: frozenset[str] = frozenset()) -> list[DataError]:
    """Return the frozen values and drop-outs of a record's channels."""
    found = []
    for name, values in logged.record.values.items():
        if name not in trusted:
            usual = usual_of(name, values, logged.noise)
            level = float(np.hypot(usual.level, usual.resolution / np.sqrt(12.0)))
            found += _of(name, logged.record.time, values, level)
    return found


def is_rounded(error: DataError, logged: Logged) -> bool:
    """Say whether a channel may repeat values because it is rounded and stands still."""
    (channel,) = error.channels
    left = error.corrected(logged).record.values[channel]
    level = usual_of(channel, left, logged.noise).level
    return not error.how and resolution_of(left, level) > 0.0


def _of(name: str, time: np.ndarray, values: np.ndarray, level: float) -> list[DataError]:
    found = []
    for value, at in _far_values(values, level).items():
        found.append(
            DataError(kind="dropout", channels=(name,), how=f"{value + 0.0:.9g}", at=tuple(time[at].tolist()))
        )
        values = np.where(at, np.nan, values)
    known = np.flatnonzero(np.isfinite(values))
    if known.size <= FEWEST_FROZEN:
        return found
    runs = _runs(values[known])
    unlikely = _unlikely(runs, known.size)
    lost = [known[a + 1 : a + n] for a, n in zip(runs.first[unlikely], runs.length[unlikely], strict=True)]
    if lost and lost[-1][-1] == known[-1] and lost[-1].size >= FEWEST_FROZEN:
        end = lost.pop()
        found.append(
            DataError(
                kind="frozen", channels=(name,), since=float(time[end[0]]), at=tuple(time[end].tolist())
            )
        )
    if lost:
        found.append(
            DataError(kind="dropout", channels=(name,), at=tuple(time[np.concatenate(lost)].tolist()))
        )
    return found


def _far_values(values: np.ndarray, level: float) -> Mapping[float, np.ndarray]:
    """Return value → where it stands for nothing (n,), of those that are no measurements there: elsewhere, as where a
    vehicle is at rest, it may be measured. The farthest first: what lies between two of its stretches is far from it.
    """
    distinct, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    often, found = distinct[counts >= FEWEST_FAR], {}
    for value in sorted(often.tolist(), key=lambda one: -abs(one - np.nanmedian(values))):
        at, others = values == value, np.flatnonzero(np.isfinite(values) & (values != value))
        if others.size < FEWEST_FAR:
            continue
        places = np.flatnonzero(at[: others[-1]])  # what only lasts to the end is frozen
        far = at.copy()
        far[places] = [_is_far(value, i, values, others, level) for i in places.tolist()]
        enough = np.count_nonzero(far[: others[-1]]) >= max(FEWEST_FAR, MOSTLY_FAR * places.size)
        if enough and np.any(far[2:] & far[1:-1] & far[:-2]):
            found[value], values = far, np.where(far, np.nan, values)
    return found


def _is_far(value: float, at: int, values: np.ndarray, others: np.ndarray, level: float) -> bool:
    """Say whether a value stands far from what is measured before and after it: no peak, but a jump there and back."""
    i = int(np.searchsorted(others, at))
    around = values[others[max(i - NEIGHBOURS, 0) : i + NEIGHBOURS]]
    spread = float(np.median(np.abs(np.diff(around)))) if around.size > 1 else 0.0
    beside = values[others[max(i - NEAREST, 0) : i + NEAREST]]
    return bool(np.min(np.abs(value - beside)) > FAR_LEVELS * max(level, spread))


def _runs(values: np.ndarray) -> Repeats:
    """Return all runs of equal values of measured samples (m,), also of one."""
    first = np.flatnonzero(np.r_[True, np.diff(values) != 0.0])
    return Repeats(first, np.diff(np.r_[first, values.size]))


def _unlikely(runs: Repeats, count: int) -> np.ndarray:
    """Say which runs no chance makes, as often as the others repeat."""
    usual = runs.length <= SHORT
    for _ in range(3):
        repeats, pairs = np.sum(runs.length[usual] - 1), np.sum(runs.length[usual])
        share = (repeats + 0.5) / (pairs + 1.0)
        usual = -(runs.length - 1) * np.log(share) < CLEAR_LOG_ODDS + np.log(count)
    return ~usual
