"""The best fit of a hypothesis with real runs: bounded Gauss-Newton on data and priors, and its evidence by Laplace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.diagnosis.evidence import Quadratic
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.stride import bounds, objective, secant, stride

NEARLY = 0.5
"""A fit that no step improves although the linear model promises less than this has converged, too."""
CLOSE = 1.0
"""Sensitivities are a fit's own if they were made so close to it, in tolerances."""
LOST = 2.0
"""A fit whose square is this many of its standard deviations above that of noise leaves more than noise."""
LEGS, AFAR = 3, 30.0
"""A fit goes on, so often, while the linear problem where it stopped promises so much more."""
MOST_STEPS = 8
POOR = 0.5
"""A step that gains less than this share of what the linear model promised has old sensitivities."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """The most probable parameters of a hypothesis.

    Attributes:
        z: deviations (k,).
        r: whitened residual there (m,).
        J: sensitivities there, or close by (m, k).
        D: prior variances (k,).
        objective: ½|r|² + ½ zᵀD⁻¹z.
        converged: no step would gain more.
        promise: what the linear model says that a further step would gain; of old sensitivities, little to rely on.
        fresh: how many times sensitivities were made.
        made_at: deviations that the sensitivities were made at, if that is known (k,).
    """

    z: np.ndarray
    r: np.ndarray
    J: np.ndarray
    D: np.ndarray
    objective: float
    converged: bool
    promise: float
    fresh: int
    made_at: np.ndarray | None = None

    @property
    def quadratic(self) -> Quadratic:
        """The linear problem around the fit."""
        return Quadratic.at(self.z, self.r, self.J)

    def moved(self, problem: Problem) -> float:
        """Return how far it is from where its sensitivities were made, in tolerances; infinite if that is not known."""
        if self.made_at is None:
            return np.inf
        tolerance = np.array([entry.parameter.tolerance for entry in problem.entries])
        return float(np.max(np.abs(self.z - self.made_at) / tolerance))


def is_lost(fit: Fit) -> bool:
    """Say whether a fit leaves more than noise."""
    count = fit.r.size
    return bool(fit.r @ fit.r > count + LOST * np.sqrt(2.0 * count))


def with_own_slopes(problem: Problem, fit: Fit) -> Fit:
    """Return a fit again with sensitivities of its own, if it has moved from where its sensitivities were made."""
    if fit.moved(problem) < CLOSE:
        return fit
    return refit(problem, fit.z, problem.jacobian(fit.z), fit.D, r=fit.r, most_fresh=0, made_at=fit.z)


def gone_on(problem: Problem, fit: Fit) -> Fit:
    """Return a fit that has gone on, with sensitivities of its own, while much is promised."""
    for _ in range(LEGS):
        if fit.promise < AFAR:
            break
        J = problem.jacobian(fit.z)
        fit = refit(problem, fit.z, J, fit.D, r=fit.r, most_fresh=2, made_at=fit.z)
    return fit


def refit(
    problem: Problem,
    z: np.ndarray,
    J: np.ndarray,
    D: np.ndarray,
    *,
    r: np.ndarray | None = None,
    most_fresh: int = 1,
    made_at: np.ndarray | None = None,
) -> Fit:
    """Return the best fit under prior variances D, from z and sensitivities J close by.

    Args:
        problem: records and parameters.
        z: where to begin (k,).
        J: sensitivities to begin with (m, k).
        D: prior variances (k,).
        r: the residual at z, if it is known.
        most_fresh: how many times sensitivities may be made again.
        made_at: where J was made (k,).
    """
    z, r = _runnable(problem, np.clip(z, *bounds(problem)), r)
    now, fresh, converged, left = objective(r, z, D), 0, False, 0.0
    for _ in range(MOST_STEPS):
        one = stride(problem, z, r, now, J, D)
        if one.share > 0.0:
            J = secant(J, one.z - z, one.r - r, D)
        z, r, now, left = one.z, one.r, one.now, one.left
        if one.share < POOR and one.promised > NEARLY and fresh < most_fresh:
            J, fresh, made_at = problem.jacobian(z), fresh + 1, z.copy()
        elif one.share <= 0.0:
            converged = left < NEARLY
            break
    return Fit(
        z=z,
        r=r,
        J=J,
        D=D,
        objective=now,
        converged=converged,
        promise=0.0 if converged else left,
        fresh=fresh,
        made_at=made_at,
    )


def _runnable(problem: Problem, z: np.ndarray, r: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return z, or what is nearer to the nominal model if that cannot be run, and the residual there."""
    r = problem.residual(z) if r is None else r
    for share in (0.5, 0.2, 0.0):
        if np.isfinite(r).all():
            break
        z = share * z
        r = problem.residual(z)
    return z, r
