"""Latent forces and sensor drifts over time, with their bands.

    w ~ Gaussian process(a, T) on one axis;   a and T are those that make the record most probable

`estimate_force` fits the history with simulations, all tolerances free, and gives its band.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.inference.latent_force import (
    FINE_SPACING_S,
    Knots,
    drift_columns,
    force_columns,
    history,
    knots_of,
    typical_force,
    with_force,
)
from subzero.diagnosis.inference.linear_gaussian import (
    ForceInformation,
    Posterior,
    ProcessShape,
    Quadratic,
    correlation,
    log_gains,
    modes,
    posterior,
    seen,
)
from subzero.diagnosis.inference.map_fit import Fit, refit
from subzero.diagnosis.results import Unknown

if TYPE_CHECKING:
    from subzero.diagnosis.inference.problem import Problem
    from subzero.external_force import MissingForce


CORRELATION_TIMES_S = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Correlation times that are tried. [s]"""
AMPLITUDES_TRIED = tuple(0.01 * 1.6**i for i in range(12))
"""Amplitudes that are tried, in units of the axis' usual force."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EstimatedForce:
    """A latent force, fitted.

    Attributes:
        unknown: its history with a band, of the record where it is largest.
        record: the number of that record.
        missing: the same as a part of a model.
        problem: with the force's modes appended to its entries; unchanged for a drift.
        fit: of that problem.
        knots: of the history, all records.
        force: at the knots (n,). [N, N m]
        covariance: of these (n, n).
        columns: sensitivities to the force at the knots, around the fit (m, n).
        data: the information of the data alone on it there.
    """

    unknown: Unknown
    record: int
    missing: MissingForce | None
    problem: Problem
    fit: Fit
    knots: Knots
    force: np.ndarray
    covariance: np.ndarray
    columns: np.ndarray
    data: ForceInformation


def estimate_force(
    problem: Problem,
    fit: Fit,
    axis: str,
    D: np.ndarray | None = None,
    *,
    spacing: float = FINE_SPACING_S,
) -> EstimatedForce:
    """Return the history of a force on an axis.

    Args:
        problem: records and parameters.
        fit: the start: of "nothing is wrong" within wide tolerances, or of named causes.
        axis: X, Y, Z, K, M or N.
        D: prior variances of the problem's entries (k,); those of the fit if None.
        spacing: of the knots. [s]
    """
    D = fit.D if D is None else D
    knots = knots_of(problem, spacing)
    C = force_columns(problem, fit.z, (axis,), knots)[axis]
    L = _best_modes(_seen(fit, D, C), knots, typical_force(problem.records[0].setting, axis))
    more = with_force(problem, axis, knots, L, 1.0)
    whole, J = np.concatenate([D, np.ones(L.shape[1])]), np.hstack([fit.J, C @ L])
    start = _linear(fit, J, whole)
    done = refit(more, start.z, whole, J=J)
    found = posterior(done.quadratic, whole)
    k = D.size
    force, covariance = L @ done.z[k:], L @ found.M[k:, k:] @ L.T
    at_knots = np.linalg.solve(L.T, done.J[:, k:].T).T
    return _estimated(axis, more, done, D, History(knots, force, covariance, at_knots))


def estimate_drift(
    problem: Problem, fit: Fit, channel: str, scale: float, D: np.ndarray | None = None
) -> EstimatedForce:
    """Return the drift of a channel, in its unit, as the history of an unknown "force"; `scale` is a usual drift."""
    D = fit.D if D is None else D
    knots = knots_of(problem)
    C = drift_columns(problem, channel, knots)
    L = _best_modes(_seen(fit, D, C), knots, scale)
    whole, J = np.concatenate([D, np.ones(L.shape[1])]), np.hstack([fit.J, C @ L])
    found, k = _linear(fit, J, whole), D.size
    force, covariance = L @ found.z[k:], L @ found.M[k:, k:] @ L.T
    return _estimated(channel, problem, fit, D, History(knots, force, covariance, C))


def _seen(fit: Fit, D: np.ndarray, columns: np.ndarray) -> ForceInformation:
    """Return the information of the data on columns around a fit of the entries before them, or of those and the
    columns' modes.
    """
    J, whole = fit.J[:, : D.size], fit.r + fit.J @ fit.z
    return seen(J.T @ J, J.T @ whole, D, J, columns, whole)


def _linear(fit: Fit, J: np.ndarray, D: np.ndarray) -> Posterior:
    """Return the posterior with columns added to a fit's."""
    whole = fit.r + fit.J @ fit.z
    return posterior(Quadratic(A=J.T @ J, b=J.T @ whole, rr=float(whole @ whole)), D)


def _best_modes(data: ForceInformation, knots: Knots, size: float) -> np.ndarray:
    """Return the modes of the process that makes the record most probable."""
    amplitudes = [share * size for share in AMPLITUDES_TRIED]
    table = np.array(
        [log_gains(data, correlation(knots.time, knots.record, T), amplitudes) for T in CORRELATION_TIMES_S]
    )
    i, j = divmod(int(np.argmax(table)), table.shape[1])
    return modes(knots.time, knots.record, ProcessShape(amplitudes[j], CORRELATION_TIMES_S[i]))


class History(NamedTuple):
    """A history at knots: force or drift (n,), its covariance (n, n), and sensitivities to it (m, n)."""

    knots: Knots
    force: np.ndarray
    covariance: np.ndarray
    columns: np.ndarray


def _estimated(axis: str, problem: Problem, fit: Fit, D: np.ndarray, found: History) -> EstimatedForce:
    """Return a force or a drift, reported for the record in which it is largest."""
    knots, force, covariance, columns = found
    size = [float(np.sqrt(np.mean(force[knots.record == i] ** 2))) for i in range(len(problem.records))]
    record = int(np.argmax(size))
    own = knots.record == record
    band = np.sqrt(np.maximum(np.diag(covariance)[own], 0.0))
    unknown = Unknown(axis=axis, time=knots.time[own], force=force[own], band=band)
    missing = None if axis in BY_NAME else history(axis, knots.time[own], force[own])
    return EstimatedForce(
        unknown=unknown,
        record=record,
        missing=missing,
        problem=problem,
        fit=fit,
        knots=knots,
        force=force,
        covariance=covariance,
        columns=columns,
        data=_seen(fit, D, columns),
    )


def fit_with_drift(problem: Problem, found: EstimatedForce, D: np.ndarray) -> Fit:
    """Return the fit of the records without a drift, under prior variances D (k,)."""
    start, channel, records = found.fit, found.unknown.axis, []
    for i, record in enumerate(problem.records):
        own = found.knots.record == i
        drift = np.interp(record.time, found.knots.time[own], found.force[own])
        records.append(record.corrected({channel: drift}))
    cleared = replace(problem, records=tuple(records))
    J, left = start.J, start.r + start.J @ start.z - found.columns @ found.force
    there = posterior(Quadratic(A=J.T @ J, b=J.T @ left, rr=float(left @ left)), D).z
    return refit(cleared, there, D, J=J)
