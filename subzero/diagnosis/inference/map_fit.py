"""The MAP fit of an explanation with real simulations, by bounded, damped Gauss-Newton with Broyden updates.

    objective = ½ |r(z)|² + ½ zᵀ D⁻¹ z,   low ≤ z ≤ high

A step is the optimum of the linear model within bounds, or the part of it that gains; `broyden_update` updates J
after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.diagnosis.inference.linear_gaussian import Quadratic

if TYPE_CHECKING:
    from subzero.diagnosis.inference.problem import Problem

MAX_STEPS = 8
"""Most steps of a fit."""
NEGLIGIBLE_GAIN_NATS, CONVERGED_GAIN_NATS = 0.1, 0.5
"""A step that is predicted to gain less is not tried; a fit whose next step would gain less has converged."""
STALE_GAIN_SHARE = 0.5
"""A step that gains less than this share of its predicted gain asks for a new Jacobian. [-]"""
OWN_JACOBIAN_TOLERANCES = 1.0
"""A Jacobian made this close to a fit is its own. [τ]"""


class Step(NamedTuple):
    """A step: the largest gain that the linear model predicted; the gain that it predicted for the last step tried;
    the share of that which was achieved; the new point, with its residual and objective.
    """

    predicted: float
    left: float
    share: float
    z: np.ndarray
    r: np.ndarray
    now: float


def damped_step(
    problem: Problem, z: np.ndarray, r: np.ndarray, now: float, J: np.ndarray, D: np.ndarray
) -> Step:
    """Return the optimal step of the linear model within bounds; if that gains nothing, the one with the non-smooth
    entries held; none where no more than NEGLIGIBLE_GAIN_NATS is predicted.
    """
    low, high = bounds(problem)
    predicted = 0.0
    for bound in ((low, high), _held(z, low, high)):
        step = bounded_step(J, r, z, D, *bound)
        left = now - objective(r - J @ step, z + step, D)
        predicted = max(predicted, left)
        if left < NEGLIGIBLE_GAIN_NATS:
            break
        share, there, r_there, then = _walk(problem, z, r, now, step, left, D)
        if share > 0.0:
            return Step(predicted, left, share, there, r_there, then)
    return Step(predicted, left, 0.0, z, r, now)


def _held(z: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds that hold all one-sided entries at their present values: where a drum stops, a cable falls slack
    or a gear has play, simulations have non-smooth points, and a step across one spoils the gain of the other
    entries.
    """
    one_sided = low == 0.0
    return np.where(one_sided, z, low), np.where(one_sided, z, high)


def broyden_update(J: np.ndarray, step: np.ndarray, change: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Return sensitivities that explain the change of the residual along a step, and are otherwise unchanged (Broyden
    1965), with steps measured in prior deviations: J + (−Δr − J s) (D⁻¹s)ᵀ/(sᵀD⁻¹s).
    """
    weighted = step / D
    return J + np.outer(-change - J @ step, weighted / (step @ weighted))


def _walk(
    problem: Problem,
    z: np.ndarray,
    r: np.ndarray,
    now: float,
    step: np.ndarray,
    predicted: float,
    D: np.ndarray,
) -> tuple[float, np.ndarray, np.ndarray, float]:
    """Return the share of the predicted gain that a step, or a part of it, achieves; and the new point."""
    for part in (1.0, 0.4, 0.1):
        there = z + part * step
        r_there = problem.residual(there)
        then = objective(r_there, there, D)
        if then < now:
            return (now - then) / predicted, there, r_there, then
    return 0.0, z, r, now


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
        predicted_gain: of a further step by the linear model; unreliable with old sensitivities.
        fresh: how many times sensitivities were computed.
        made_at: linearisation point of the sensitivities, if that is known (k,).
    """

    z: np.ndarray
    r: np.ndarray
    J: np.ndarray
    D: np.ndarray
    objective: float
    converged: bool
    predicted_gain: float
    fresh: int
    made_at: np.ndarray | None = None

    @property
    def quadratic(self) -> Quadratic:
        """The linear problem around the fit."""
        return Quadratic.at(self.z, self.r, self.J)

    def moved(self, problem: Problem) -> float:
        """Return the distance from the linearisation point of its sensitivities, in tolerances; infinite if that is
        not known.
        """
        if self.made_at is None:
            return np.inf
        tolerance = np.array([entry.parameter.tolerance for entry in problem.entries])
        return float(np.max(np.abs(self.z - self.made_at) / tolerance))


EXCESS_SIGMAS = 6.0
"""A whitened residual whose sum of squares is so many standard deviations above that of noise is no noise. [-]"""


def is_noise(r: np.ndarray) -> bool:
    """Say whether a whitened residual (m,) is no larger than noise."""
    return bool(r @ r <= r.size + EXCESS_SIGMAS * np.sqrt(2.0 * r.size))


def with_own_jacobian(problem: Problem, fit: Fit) -> Fit:
    """Return a fit repeated with sensitivities of its own, if it has moved from the linearisation point of its
    sensitivities.
    """
    if fit.moved(problem) < OWN_JACOBIAN_TOLERANCES:
        return fit
    return refit(problem, fit.z, problem.jacobian(fit.z), fit.D, r=fit.r, most_fresh=0, made_at=fit.z)


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
        z: the start (k,).
        J: sensitivities at the start (m, k).
        D: prior variances (k,).
        r: the residual at z, if it is known.
        most_fresh: how many times sensitivities may be computed again.
        made_at: linearisation point of J (k,).
    """
    z, r = runnable(problem, np.clip(z, *bounds(problem)), r)
    now, fresh, converged, left = objective(r, z, D), 0, False, 0.0
    for _ in range(MAX_STEPS):
        step = damped_step(problem, z, r, now, J, D)
        if step.share > 0.0:
            J = broyden_update(J, step.z - z, step.r - r, D)
        z, r, now, left = step.z, step.r, step.now, step.left
        if step.share < STALE_GAIN_SHARE and step.predicted > CONVERGED_GAIN_NATS and fresh < most_fresh:
            J, fresh, made_at = problem.jacobian(z), fresh + 1, z.copy()
        elif step.share <= 0.0:
            converged = left < CONVERGED_GAIN_NATS
            break
    return Fit(
        z=z,
        r=r,
        J=J,
        D=D,
        objective=now,
        converged=converged,
        predicted_gain=0.0 if converged else left,
        fresh=fresh,
        made_at=made_at,
    )


def runnable(problem: Problem, z: np.ndarray, r: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return z, or a point nearer to the nominal model if the simulation at z fails, and the residual there."""
    r = problem.residual(z) if r is None else r
    for share in (0.5, 0.2, 0.0):
        if np.isfinite(r).all():
            break
        z = share * z
        r = problem.residual(z)
    return z, r
