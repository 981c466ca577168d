"""Readings of a channel, and those that stand alone: outliers, and the jumps of an angle that its logger wraps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from subzero.identification.model import Sensor
from subzero.identification.noise import OPEN_SPREAD, NoisePrior, level_of, middle_of_equal, resolution_of

SPIKE = 5.0
"""A reading so many levels off the middle of those next to it, which agree with one another, is set aside. [-]"""
SAME_JUMP, ALONE = 0.25, 4.0
"""Steps of an angle within this share of a turn are turns of its logger; one stands alone if its neighbours are so
many times smaller. [-]"""
BY_ONE_SIDE = 2.0
"""A reading that has neighbours on one side alone is an outlier if it is so many times as far from them. [-]"""


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings of a channel in all records, one after the other.

    Attributes:
        time: of each (m,). [s]
        values: as recorded (m,).
        record: which each belongs to (m,).
        spikes: which are alone far from their neighbours, or outside the record's time (m,).
        used: which are finite, no spikes, and the middle of equal ones in a row (m,).
        prior: of the sensor.
    """

    time: np.ndarray
    values: np.ndarray
    record: np.ndarray
    spikes: np.ndarray
    used: np.ndarray
    prior: NoisePrior

    @classmethod
    def of(
        cls,
        sensor: Sensor,
        time: np.ndarray,
        values: np.ndarray,
        record: np.ndarray,
        inside: np.ndarray,
        away: np.ndarray,
    ) -> Readings:
        """Return readings with their spikes and the noise of their sensor.

        Args:
            sensor: what is declared of it.
            time: of each (m,). [s]
            values: as recorded (m,), NaN in gaps.
            record: which each belongs to (m,).
            inside: which are within the time of their record (m,).
            away: their differences from the nominal model (m,).
        """
        step = sensor.resolution if sensor.resolution is not None else resolution_of(values)
        level = sensor.noise if sensor.noise is not None else level_of(values, step)
        steps = np.diff(time)
        spread = OPEN_SPREAD if sensor.noise is None else sensor.spread
        prior = NoisePrior(level, step, float(np.median(steps[steps > 0.0])), spread)
        # In a wrong unit readings are rougher than the sensor says. What is read off them has their rounding in it.
        least = float(np.hypot(level, step / np.sqrt(12.0)))
        far, far_away = (SPIKE * max(least, level_of(rows, step)) for rows in (values, away))
        alone = by_record(record, lambda at: spikes(values[at], far, sensor.turn))
        alone |= by_record(record, lambda at: spikes_at_ends(away[at], min(far, far_away)))
        aside = np.isfinite(values) & (~inside | alone)
        used = np.isfinite(values) & inside & ~aside
        for k in np.unique(record).tolist():
            at = np.flatnonzero(used & (record == k))
            used[at] = middle_of_equal(values[at])
        return cls(time, values, record, aside, used, prior)


def by_record(record: np.ndarray, found_in: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return what is found in each record (m,), from which readings of a channel belong to which record (m,): one has
    no neighbours in another.
    """
    return np.concatenate([found_in(record == k) for k in np.unique(record).tolist()])


def outliers_of(left: np.ndarray, simulated: np.ndarray, record: np.ndarray, far: float) -> np.ndarray:
    """Return which residuals are alone far from those next to them (m,).

    At the end of a record, where neighbours are on one side alone, a reading that is late at a jump of the simulation
    looks the same, and is none.

    Args:
        left: residuals, NaN where a reading is not used (m,).
        simulated: the simulation (m,).
        record: which each belongs to (m,).
        far: from which on they are far.
    """
    steps = np.abs(np.diff(simulated, prepend=np.nan, append=np.nan))
    still = np.abs(left) > np.fmax(steps[:-1], steps[1:])
    ends = by_record(record, lambda at: spikes_at_ends(left[at], BY_ONE_SIDE * far))
    return by_record(record, lambda at: spikes(left[at], far, 0.0)) | (ends & still)


def jumps(values: np.ndarray) -> np.ndarray:
    """Return the sizes of steps between readings (m,) that stand alone among the largest."""
    steps = np.abs(np.diff(values))
    neighbours = np.maximum(np.append(steps[1:], 0.0), np.append(0.0, steps[:-1]))
    return steps[(steps > 0.5 * steps.max(initial=0.0)) & (steps > ALONE * neighbours)]


def are_turns(alone: np.ndarray, turn: float) -> bool:
    """Return whether steps that stand alone (n,) are those of an angle that is wrapped at a turn."""
    return bool(alone.size and (np.abs(alone / turn - 1.0) < SAME_JUMP).all())


def spikes(values: np.ndarray, far: float, turn: float) -> np.ndarray:
    """Return which readings (m,) are alone far from a line, and from a cubic, through those next to them, where these
    agree: a curve that is sampled coarsely has no spikes, nor has the neighbour of one. Of two in a row
    each is twice as far from six neighbours, most of which agree.
    """
    found, at = np.zeros(values.size, dtype=bool), np.flatnonzero(np.isfinite(values))
    if at.size < 5:
        return found
    at, each = at[2:-2], at[np.arange(at.size - 4)[:, None] + [0, 1, 3, 4]]
    away = values[each] - values[at][:, None]
    if turn:
        away -= turn * np.rint(away / turn)
    line, cubic = away @ [0.0, 0.5, 0.5, 0.0], away @ [-1.0 / 6.0, 4.0 / 6.0, 4.0 / 6.0, -1.0 / 6.0]
    off = np.minimum(np.abs(line), np.abs(cubic))
    apart = np.maximum(2.0 * np.abs(line - cubic), np.abs(away[:, 1] - away[:, 2]))
    found[at] = (off > far) & (apart < off)
    return found | _pairs(values, BY_ONE_SIDE * far, turn)


def _pairs(values: np.ndarray, far: float, turn: float) -> np.ndarray:
    """Return which readings (m,) are far from the median of the six next to them, the middle four of which agree."""
    found, at = np.zeros(values.size, dtype=bool), np.flatnonzero(np.isfinite(values))
    if at.size < 7:
        return found
    each, at = at[np.arange(at.size - 6)[:, None] + [0, 1, 2, 4, 5, 6]], at[3:-3]
    away = values[each] - values[at][:, None]
    if turn:
        away -= turn * np.rint(away / turn)
    ordered = np.sort(away, axis=1)
    off = np.abs(np.median(ordered, axis=1))
    found[at] = (off > far) & (ordered[:, 4] - ordered[:, 1] < 0.25 * off)
    return found


def spikes_at_ends(away: np.ndarray, far: float) -> np.ndarray:
    """Return which of the first and last two of residuals (m,) are far from the four next to them, which agree."""
    found, at = np.zeros(away.size, dtype=bool), np.flatnonzero(np.isfinite(away))
    for ends in (at, at[::-1]) if at.size > 5 else ():
        neighbours = away[ends[2:6]]
        off = np.abs(away[ends[:2]] - np.median(neighbours))
        found[ends[:2]] |= (off > far) & (np.ptp(neighbours) < 0.5 * off)
    return found
