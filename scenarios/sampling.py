"""Which values of a channel were measured: a log that is faster than a sensor fills in what lies between.

The sampling model of a channel, decided from its values alone, is one of

    fresh          every value is a measurement
    held           y_k = y_(k−1), but for every m-th row
    interpolated   y_k = ½ (y_(k−1) + y_(k+1)), but for every m-th row, to the digits that are written

with one m for the whole channel, at least half of whose m-th rows are new. Means over the same rows look like the one
or the other; a diagnosis leaves open when in its interval a value was measured. Running means, and sensors whose rows
are not evenly spread, are taken for fresh. So is a rounded sensor that stands still, whose values change at any row.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

WRITTEN = 2e-5
"""Numbers that differ by less than this share are the same: a log has five digits or more. [-]"""
FEWEST = 6
"""Fewer measurements do not show how they were sampled. [-]"""
NEW_SHARE = 0.5
"""At least this share of the m-th rows has to be new: commands that step now and then are not held measurements. [-]"""


class Sampling(NamedTuple):
    """How a channel was sampled: "held" or "interpolated", from `first` on every `every`-th of its known values."""

    kind: str
    first: int
    every: int


def sampling_of(values: np.ndarray) -> Sampling | None:
    """Return how the known values of a channel (m,) were sampled; None if all are measurements."""
    steps = np.abs(np.diff(values))
    size = np.abs(values)
    is_new = steps > WRITTEN * np.maximum(size[1:], size[:-1])
    off_line = np.abs(np.diff(values, 2)) > 2.0 * WRITTEN * np.maximum(size[2:], size[:-2])
    for kind, new in (("held", is_new), ("interpolated", off_line)):
        rows = np.flatnonzero(new) + 1
        every = int(np.gcd.reduce(np.diff(rows))) if rows.size > 1 else 1
        if every > 1 and rows.size >= max(FEWEST, NEW_SHARE * values.size / every):
            return Sampling(kind, int(rows[0] % every), every)
    return None


def measurements_alone(
    time: np.ndarray, values: Mapping[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """Return the channels (n,) with gaps in place of what was not measured, and the time between two measurements of
    those that have such gaps. [s]

    Args:
        time: of the rows (n,). [s]
        values: channel → values, NaN in gaps (n,).
    """
    found, intervals = dict(values), dict[str, float]()
    for name, column in values.items():
        known = np.flatnonzero(np.isfinite(column))
        sampling = sampling_of(column[known])
        if sampling is None:
            continue
        kept = known[sampling.first :: sampling.every]
        found[name] = np.full(column.size, np.nan)
        found[name][kept] = column[kept]
        intervals[name] = float(np.median(np.diff(time[kept])))
    return found, intervals
