"""Sensitivity: how much each parameter moves each scalar, by the method that the design of the sweep allows.

morris        mu_star, the mean size of its elementary effects, and their deviation sigma (Morris 1991, Campolongo 2007)
saltelli      Sobol indices, its share of the variance alone (first order) and with all others (total)  (Saltelli 2010)
all others    Spearman's rank correlation of the scalar with the parameter

Elementary effects are those of the parameter's whole spread (the unit cube). Members that failed leave a gap: a
trajectory or a block of Saltelli's scheme with one is left out as a whole.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from subzero.sweeps.design import Points, salib, salib_problem
from subzero.sweeps.result import Gathered

LEAST_MEMBERS = 4
"""Of fewer members nothing is said. [-]"""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """How much a parameter moves a scalar.

    Attributes:
        scalar, parameter: their names.
        size: mu_star in the unit of the scalar; total index; or rank correlation, with its sign.
        other: sigma; first-order index; NaN for a correlation.
        error: half the 95 % interval of `size`; NaN where none is known.
    """

    scalar: str
    parameter: str
    size: float
    other: float
    error: float


METHODS = {
    "morris": ("elementary effects", "mean size, μ*", "spread, σ"),
    "saltelli": ("Sobol indices", "total", "first order"),
}
CORRELATION = ("Spearman's rank correlation", "correlation", "")


def description_of(design: str) -> tuple[str, str, str]:
    """Return the name of a design's sensitivity, and its two numbers."""
    return METHODS.get(design, CORRELATION)


def effects_of(points: Points, found: Gathered) -> list[Effect]:
    """Return the effect of every parameter that changes on every scalar, the greatest first."""
    work = {"morris": _morris, "saltelli": _saltelli}.get(points.design, _correlations)
    effects = []
    for name, values in zip(found.names, found.scalars.T, strict=True):
        if np.isfinite(values).sum() >= LEAST_MEMBERS and np.nanmax(values) > np.nanmin(values):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of divisions by a variance of nothing
                rows = work(points, name, values)
            effects += sorted(rows, key=lambda row: -abs(row.size) if row.size == row.size else 1.0)
    return effects


def _morris(points: Points, name: str, values: np.ndarray) -> list[Effect]:
    whole = _whole_blocks(values, len(points.names) + 1)
    if whole.sum() < 2 * (len(points.names) + 1):
        return []
    made = salib("analyze", "morris").analyze(
        salib_problem(points.spreads), points.unit[whole], values[whole], num_levels=4, seed=points.seed
    )
    return _effects(points, name, made["mu_star"], made["sigma"], made["mu_star_conf"])


def _saltelli(points: Points, name: str, values: np.ndarray) -> list[Effect]:
    whole = _whole_blocks(values, len(points.names) + 2)
    if whole.sum() < 2 * (len(points.names) + 2):
        return []
    made = salib("analyze", "sobol").analyze(
        salib_problem(points.spreads), values[whole], calc_second_order=False, seed=points.seed
    )
    return _effects(points, name, made["ST"], made["S1"], made["ST_conf"])


def _whole_blocks(values: np.ndarray, size: int) -> np.ndarray:
    """Return which members are in blocks of `size` without a gap (members,)."""
    return np.repeat(np.isfinite(values).reshape(-1, size).all(axis=1), size)


def _correlations(points: Points, name: str, values: np.ndarray) -> list[Effect]:
    known = np.isfinite(values)
    ranks = _ranks(values[known])
    sizes = [_correlation(_ranks(column[known]), ranks) for column in points.values.T]
    none = np.full(len(sizes), np.nan)
    return _effects(points, name, sizes, none, none)


def _ranks(values: np.ndarray) -> np.ndarray:
    """Return the rank of each value (n,) from 1, equal ones sharing the mean, as `scipy.stats.rankdata` does, whose
    import takes longer than everything else that is computed for a sweep here.
    """
    _, which, counts = np.unique(values, return_inverse=True, return_counts=True)
    shared: np.ndarray = (np.cumsum(counts) - 0.5 * (counts - 1.0))[which]
    return shared


def _correlation(first: np.ndarray, other: np.ndarray) -> float:
    """Return Pearson's correlation of two ranks; nothing of one that does not change."""
    return (
        float(np.corrcoef(first, other)[0, 1])
        if first.max() > first.min() and other.max() > other.min()
        else 0.0
    )


def _effects(points: Points, name: str, sizes: Any, others: Any, errors: Any) -> list[Effect]:
    return [
        Effect(scalar=name, parameter=each, size=float(size), other=float(other), error=float(error))
        for each, size, other, error in zip(points.names, sizes, others, errors, strict=True)
    ]
