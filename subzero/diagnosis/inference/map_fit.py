"""The MAP fit of an explanation with real simulations: Levenberg's and Marquardt's method within bounds (Nielsen 1999).

    objective = ½ |r(z)|² + ½ zᵀ D⁻¹ z,   low ≤ z ≤ high

Where numbers trade against each other the best fit lies at the end of a curved valley, and a whole step of Gauss and
Newton, or a part of it, leaves it. `broyden_update` updates J after a step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.inference.linear_gaussian import Quadratic

if TYPE_CHECKING:
    from subzero.diagnosis.inference.problem import Problem

FIRST_STEPS, MAX_STEPS = 10, 25
"""Steps of a fit that only leads to the next, or is reported as it is; and of a precise one."""
OWN_WITHIN = 0.3
"""Sensitivities will do, but for a precise fit, if they were made so close to it, in tolerances."""
SETTLED_GAIN = 0.3
"""A fit has settled when the linear problem predicts a gain of less than this. [nat]"""
LEAST_SHARE, FRESH_SHARE = 0.05, 0.5
"""A step that gains less than the first share of the predicted gain is not taken; after one that gains less than the
second, sensitivities are computed again. [-]"""
FIRST_DAMPING, LEAST_DAMPING = 1.0, 0.1
"""Damping of a step that failed, in inverse prior variances, and the damping that counts as zero. [-]"""


def broyden_update(J: np.ndarray, step: np.ndarray, change: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Return sensitivities that explain the change of the residual along a step, and are otherwise unchanged (Broyden
    1965), with steps measured in prior deviations: J + (−Δr − J s) (D⁻¹s)ᵀ/(sᵀD⁻¹s).
    """
    weighted = step / D
    return J + np.outer(-change - J @ step, weighted / (step @ weighted))


def objective(r: np.ndarray, z: np.ndarray, D: np.ndarray) -> float:
    """Return ½|r|² + ½ zᵀD⁻¹z, infinite for a simulation that failed."""
    value = 0.5 * float(r @ r) + 0.5 * float(np.sum(z * z / D))
    return value if np.isfinite(value) else np.inf


def bounds(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest deviations (k,) each."""
    pairs = [(entry.parameter.low, entry.parameter.high) for entry in problem.entries]
    low, high = np.array(pairs).T
    return low, high


def bounded_step(
    J: np.ndarray, r: np.ndarray, z: np.ndarray, D: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the optimal step of the linear model within bounds (active set): entries that would leave are held at
    their bound, and released when their gradient points inwards.
    """
    P, g = J.T @ J + np.diag(1.0 / D), J.T @ r - z / D
    return quadratic_step(P, g, low - z, high - z)


def quadratic_step(P: np.ndarray, g: np.ndarray, least: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Return argmin ½ xᵀPx − gᵀx with least ≤ x ≤ most, by holding entries at bounds and releasing them
    (active set).
    """
    x, held = np.zeros_like(g), np.zeros(g.size, dtype=bool)
    for _ in range(20):
        free = ~held
        right = g[free] - P[np.ix_(free, held)] @ x[held]
        x[free] = np.linalg.solve(P[np.ix_(free, free)], right)
        out = free & ((x < least - 1e-12) | (x > most + 1e-12))
        slope = g - P @ x
        back = held & (((x <= least) & (slope > 1e-9)) | ((x >= most) & (slope < -1e-9)))
        if not out.any() and not back.any():
            break
        x = np.clip(x, least, most)
        held = (held | out) & ~back
    return np.clip(x, least, most)


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """The most probable parameters of a hypothesis.

    Attributes:
        z: deviations (k,).
        r: whitened residual at z (m,).
        J: sensitivities at z, or close by (m, k).
        D: prior variances (k,).
        objective: ½|r|² + ½ zᵀD⁻¹z.
        converged: no step would gain more.
    """

    z: np.ndarray
    r: np.ndarray
    J: np.ndarray
    D: np.ndarray
    objective: float
    converged: bool

    @property
    def quadratic(self) -> Quadratic:
        """The linear problem around the fit."""
        return Quadratic.at(self.z, self.r, self.J)


EXCESS_SIGMAS = 6.0
"""A whitened residual whose sum of squares is so many standard deviations above that of noise is no noise. [-]"""


def is_noise(r: np.ndarray) -> bool:
    """Say whether a whitened residual (m,) is no larger than noise."""
    return bool(r @ r <= r.size + EXCESS_SIGMAS * np.sqrt(2.0 * r.size))


def refit(
    problem: Problem, z: np.ndarray, D: np.ndarray, *, J: np.ndarray | None = None, precise: bool = False
) -> Fit:
    """Return the best fit under prior variances D (k,), with sensitivities of its own.

    Args:
        problem: records and parameters.
        z: the start (k,).
        D: prior variances (k,).
        J: sensitivities near the start (m, k), if they are known.
        precise: to the end, with central sensitivities at it; else one-sided ones close by will do.
    """
    slopes, within, most = (
        (problem.central_jacobian, 0.0, MAX_STEPS) if precise else (problem.jacobian, OWN_WITHIN, FIRST_STEPS)
    )
    low, high = bounds(problem)
    z, r = runnable(problem, np.clip(z, low, high), None)
    made_at = z if J is None else None
    J = slopes(z) if J is None else J
    now, damping, harder, left = objective(r, z, D), 0.0, 2.0, 0.0
    for _ in range(most):
        P, g = J.T @ J + np.diag((1.0 + damping) / D), J.T @ r - z / D
        step = quadratic_step(P, g, low - z, high - z)
        left = now - objective(r - J @ step, z + step, D)
        fresh = made_at is z
        if left < SETTLED_GAIN and damping < 1.0:
            if fresh or _apart(problem, z, made_at) < within:
                break
            J, made_at = slopes(z), z
            continue
        r_there = problem.residual(z + step)
        then = objective(r_there, z + step, D)
        if fresh and damping == 0.0 and then >= now:
            step, r_there, then = _with_one_sided_held(problem, z, D, P, g, (step, r_there, then))
        share = (now - then) / left if left > 0.0 else 0.0
        if share > LEAST_SHARE:
            J = broyden_update(J, step, r_there - r, D)
            z, r, now = z + step, r_there, then
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * share - 1.0) ** 3)
            damping, harder = (damping if damping > LEAST_DAMPING else 0.0), 2.0
        elif fresh:
            damping, harder = max(damping, FIRST_DAMPING) * harder, 2.0 * harder
        if share < FRESH_SHARE and not fresh:
            J, made_at = slopes(z), z
    return Fit(z=z, r=r, J=J, D=D, objective=now, converged=left < SETTLED_GAIN)


Tried = tuple[np.ndarray, np.ndarray, float]
"""A step (k,), the residual there (m,), and the objective."""


def _with_one_sided_held(
    problem: Problem, z: np.ndarray, D: np.ndarray, P: np.ndarray, g: np.ndarray, failed: Tried
) -> Tried:
    """Return the step with all one-sided entries held, where it is better than one that failed: where a drum stops, a
    cable falls slack or a gear has play, simulations have non-smooth points, and a step across one spoils the gain of
    the other entries.
    """
    low, high = bounds(problem)
    held = low == 0.0
    step = quadratic_step(P, g, np.where(held, 0.0, low - z), np.where(held, 0.0, high - z))
    r = problem.residual(z + step)
    return min(failed, (step, r, objective(r, z + step, D)), key=lambda tried: tried[2])


def _apart(problem: Problem, z: np.ndarray, other: np.ndarray | None) -> float:
    """Return how far two points are apart, in tolerances; infinite if the other one is not known."""
    if other is None:
        return np.inf
    tolerance = np.array([entry.parameter.tolerance for entry in problem.entries])
    return float(np.max(np.abs(z - other) / tolerance))


def runnable(problem: Problem, z: np.ndarray, r: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return z, or a point nearer to the nominal model if the simulation at z fails, and the residual there."""
    r = problem.residual(z) if r is None else r
    for share in (0.5, 0.2, 0.0):
        if np.isfinite(r).all():
            break
        z = share * z
        r = problem.residual(z)
    return z, r
