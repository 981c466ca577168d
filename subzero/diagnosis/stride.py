"""One step of a fit: the best for the linear model within bounds, or the part of it that gains; and what it teaches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from subzero.diagnosis.problem import Problem

ENOUGH = 0.1
"""A step that would gain less than this in the objective is not taken: no evidence hangs on it."""


class Stride(NamedTuple):
    """A step: what the linear model promised, and promises of what is left; the share of it that was gained; where it
    leads, the residual and the objective there.
    """

    promised: float
    left: float
    share: float
    z: np.ndarray
    r: np.ndarray
    now: float


def stride(
    problem: Problem, z: np.ndarray, r: np.ndarray, now: float, J: np.ndarray, D: np.ndarray
) -> Stride:
    """Return the step that is best for the linear model within bounds; if that gains nothing, the one that holds what
    has kinks; none where no more than ENOUGH is promised.
    """
    low, high = bounds(problem)
    promised = 0.0
    for bound in ((low, high), _held(z, low, high)):
        step = bounded_step(J, r, z, D, *bound)
        left = now - objective(r - J @ step, z + step, D)
        promised = max(promised, left)
        if left < ENOUGH:
            break
        share, there, r_there, then = _walk(problem, z, r, now, step, left, D)
        if share > 0.0:
            return Stride(promised, left, share, there, r_there, then)
    return Stride(promised, left, 0.0, z, r, now)


def _held(z: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds that hold where they are all entries that are possible on one side only: where a drum stops, a
    cable falls slack or a gear has play, runs have kinks, and a step across one spoils what the others would gain.
    """
    kinked = low == 0.0
    return np.where(kinked, z, low), np.where(kinked, z, high)


def secant(J: np.ndarray, step: np.ndarray, change: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Return sensitivities that explain the change of the residual along a step, otherwise as they were (Broyden
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
    promised: float,
    D: np.ndarray,
) -> tuple[float, np.ndarray, np.ndarray, float]:
    """Return the share of what was promised that a step, or a part of it, gains; and where it leads."""
    for part in (1.0, 0.4, 0.1):
        there = z + part * step
        r_there = problem.residual(there)
        then = objective(r_there, there, D)
        if then < now:
            return (now - then) / promised, there, r_there, then
    return 0.0, z, r, now


def objective(r: np.ndarray, z: np.ndarray, D: np.ndarray) -> float:
    """Return ½|r|² + ½ zᵀD⁻¹z, infinite for a run that could not go on."""
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
    """Return the step that is best for the linear model within bounds: entries that would leave are held there, and
    let go again when they want to come back.
    """
    P, g = J.T @ J + np.diag(1.0 / D), J.T @ r - z / D
    return quadratic_step(P, g, low - z, high - z)


def quadratic_step(P: np.ndarray, g: np.ndarray, least: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Return argmin ½ xᵀPx − gᵀx with least ≤ x ≤ most, by holding and letting go."""
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
