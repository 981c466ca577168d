"""The history of a force that no cause explains, with its band: fitted with real runs, all tolerances free.

The prior of the history (amplitude, correlation time) is the one that makes the record most probable. What is left out:
forces on two axes at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.evidence import Posterior, Quadratic, posterior
from subzero.diagnosis.latent import Seen, Shape, correlation, log_gains, modes, seen
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit, refit, with_own_slopes
from subzero.diagnosis.unknown import (
    FINE,
    Knots,
    drift_columns,
    force_columns,
    history,
    knots_of,
    usual,
    with_force,
)
from subzero.diagnosis.verdict import Unknown
from subzero.external_force import MissingForce

TIMES = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Correlation times that are tried. [s]"""
AMPLITUDES = tuple(0.01 * 1.6**i for i in range(12))
"""Amplitudes that are tried, in units of the axis' usual force."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Recovered:
    """A force that no cause explains, fitted.

    Attributes:
        unknown: its history with a band, of the record where it is largest.
        record: which one that is.
        missing: the same as a part of a model.
        problem: with the force's modes behind its entries; as it was for a drift.
        fit: of that problem.
        knots: of the history, all records.
        force: at the knots (n,). [N, N m]
        covariance: of these (n, n).
        columns: sensitivities to the force at the knots, around the fit (m, n).
        data: what the data alone say of it there.
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
    data: Seen


def recover(
    problem: Problem,
    fit: Fit,
    axis: str,
    D: np.ndarray | None = None,
    *,
    spacing: float = FINE,
    most_fresh: int = 2,
) -> Recovered:
    """Return the history of a force on an axis.

    Args:
        problem: records and parameters.
        fit: to begin with: of "nothing is wrong" within wide tolerances, or of named causes.
        axis: X, Y, Z, K, M or N.
        D: prior variances of the problem's entries (k,); those of the fit if None.
        spacing: of the knots. [s]
        most_fresh: how many times sensitivities may be made again on the way.
    """
    D = fit.D if D is None else D
    knots = knots_of(problem, spacing)
    C = force_columns(problem, fit.z, (axis,), knots)[axis]
    L = _best_modes(_seen(fit, D, C), knots, usual(problem.records[0].setting, axis))
    more = with_force(problem, axis, knots, L, 1.0)
    whole, J = np.concatenate([D, np.ones(L.shape[1])]), np.hstack([fit.J, C @ L])
    start = _linear(fit, J, whole)
    made_at = None if fit.made_at is None else np.concatenate([fit.made_at, np.zeros(L.shape[1])])
    done = with_own_slopes(more, refit(more, start.z, J, whole, most_fresh=most_fresh, made_at=made_at))
    found = posterior(done.quadratic, whole)
    k = D.size
    force, covariance = L @ done.z[k:], L @ found.M[k:, k:] @ L.T
    at_knots = np.linalg.solve(L.T, done.J[:, k:].T).T
    return _recovered(axis, more, done, knots, force, covariance, at_knots, D)


def drifted(problem: Problem, fit: Fit, channel: str, scale: float, D: np.ndarray | None = None) -> Recovered:
    """Return the drift of a channel, in its unit, as the history of an unknown "force"; `scale` is a usual drift."""
    D = fit.D if D is None else D
    knots = knots_of(problem)
    C = drift_columns(problem, channel, knots)
    L = _best_modes(_seen(fit, D, C), knots, scale)
    whole, J = np.concatenate([D, np.ones(L.shape[1])]), np.hstack([fit.J, C @ L])
    found, k = _linear(fit, J, whole), D.size
    force, covariance = L @ found.z[k:], L @ found.M[k:, k:] @ L.T
    return _recovered(channel, problem, fit, knots, force, covariance, C, D)


def _seen(fit: Fit, D: np.ndarray, columns: np.ndarray) -> Seen:
    """Return what data say of columns around a fit of the entries before them, or of those and the columns' modes."""
    J, whole = fit.J[:, : D.size], fit.r + fit.J @ fit.z
    return seen(J.T @ J, J.T @ whole, D, J, columns, whole)


def _linear(fit: Fit, J: np.ndarray, D: np.ndarray) -> Posterior:
    """Return the posterior with columns added to a fit's."""
    whole = fit.r + fit.J @ fit.z
    return posterior(Quadratic(A=J.T @ J, b=J.T @ whole, rr=float(whole @ whole)), D)


def _best_modes(data: Seen, knots: Knots, size: float) -> np.ndarray:
    """Return the modes of the process that makes the record most probable."""
    amplitudes = [share * size for share in AMPLITUDES]
    table = np.array([log_gains(data, correlation(knots.time, knots.record, T), amplitudes) for T in TIMES])
    i, j = divmod(int(np.argmax(table)), table.shape[1])
    return modes(knots.time, knots.record, Shape(amplitudes[j], TIMES[i]))


def _recovered(
    axis: str,
    problem: Problem,
    fit: Fit,
    knots: Knots,
    force: np.ndarray,
    covariance: np.ndarray,
    columns: np.ndarray,
    D: np.ndarray,
) -> Recovered:
    """Return it all, told for the record where the force is largest."""
    size = [float(np.sqrt(np.mean(force[knots.record == i] ** 2))) for i in range(len(problem.records))]
    record = int(np.argmax(size))
    own = knots.record == record
    band = np.sqrt(np.maximum(np.diag(covariance)[own], 0.0))
    unknown = Unknown(axis=axis, time=knots.time[own], force=force[own], band=band)
    missing = None if axis in BY_NAME else history(axis, knots.time[own], force[own])
    return Recovered(unknown=unknown, record=record, missing=missing, problem=problem, fit=fit, knots=knots,
                     force=force, covariance=covariance, columns=columns, data=_seen(fit, D, columns))  # fmt: skip
