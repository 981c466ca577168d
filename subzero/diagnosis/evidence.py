"""How probable the data are under a hypothesis, while all tolerances are free: linear algebra on k parameters.

    r = J z + e,   z ~ N(0, D),   e ~ N(0, I);      A = Jᵀ J,  b = Jᵀ r,  P = D⁻¹ + A
    log p = −½ (rᵀr − bᵀ P⁻¹ b) − ½ log det(D P)

A hypothesis frees some entries: their variance becomes s² in the place of (κτ)². That changes P on a few places of
its diagonal only, so that all pairs cost a few products of 2 × 2 matrices each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

KAPPAS = {1.0: 0.6, 2.0: 0.3, 4.0: 0.1}
"""κ, how much wider than declared the tolerances are → its prior probability."""


class Scale(NamedTuple):
    """A κ, given a hypothesis and the data: its log probability, and the prior variances under it (k,)."""

    log_weight: float
    D: np.ndarray


Scales = Mapping[float, Scale]
"""κ → what is made of it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Quadratic:
    """A linear least-squares problem in the neighbourhood of a point.

    Attributes:
        A: JᵀJ (k, k).
        b: Jᵀ(r + J z) (k,).
        rr: |r + J z|².
    """

    A: np.ndarray
    b: np.ndarray
    rr: float

    @classmethod
    def at(cls, z: np.ndarray, r: np.ndarray, J: np.ndarray) -> Quadratic:
        """Return the problem that has residual r and sensitivities J at z."""
        whole = r + J @ z
        return cls(A=J.T @ J, b=J.T @ whole, rr=float(whole @ whole))


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Under prior variances D: mean and covariance of z, the log evidence, and log det(D P)."""

    z: np.ndarray
    M: np.ndarray
    log_evidence: float
    log_det: float


def posterior(q: Quadratic, D: np.ndarray) -> Posterior:
    """Return what the data say under prior variances D (k,)."""
    root = np.sqrt(D)
    scaled = np.eye(D.size) + root[:, None] * q.A * root
    factor = np.linalg.cholesky(scaled)
    half = np.linalg.solve(factor, np.diag(root))
    M = half.T @ half
    z = M @ q.b
    log_det = 2.0 * float(np.sum(np.log(np.diag(factor))))
    return Posterior(z=z, M=M, log_evidence=-0.5 * (q.rr - float(q.b @ z)) - 0.5 * log_det, log_det=log_det)


def freed(
    base: Posterior, D: np.ndarray, places: Sequence[int], variance: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Return log evidence, means and covariance of some entries when their prior variance is another.

    Args:
        base: under D.
        D: prior variances (k,).
        places: of the entries.
        variance: theirs, instead (places,).
    """
    at = list(places)
    change = 1.0 / variance - 1.0 / D[at]
    M, z = base.M[np.ix_(at, at)], base.z[at]
    inner = np.eye(len(at)) + change[:, None] * M
    solved = np.linalg.solve(inner, change[:, None] * np.eye(len(at)))
    gain = -0.5 * float(z @ solved @ z)
    log_det = float(np.linalg.slogdet(inner)[1]) + float(np.sum(np.log(variance / D[at])))
    covariance = np.linalg.solve(np.eye(len(at)) + M * change, M)
    mean = z - covariance @ (change * z)
    return base.log_evidence + gain - 0.5 * log_det, mean, covariance


def discrimination(G: np.ndarray, step: np.ndarray, free: np.ndarray) -> float:
    """Return the squared distance of a step from what other entries could do instead.

    Args:
        G: information of all k entries, tolerances of all included as 1/D on its diagonal but for those in the step's
            own and the rival's places (k, k).
        step: deviations of the true cause (k,), 0 elsewhere.
        free: which entries may answer (k,).
    """
    own = G @ step
    answer = np.linalg.solve(G[np.ix_(free, free)], own[free])
    return float(step @ own - own[free] @ answer)


def mixed(scales: Scales, gains: Mapping[float, float]) -> tuple[float, float]:
    """Return a log gain mixed over κ, from those under every κ, and the κ that is most probable with it."""
    log = {kappa: scales[kappa].log_weight + gain for kappa, gain in gains.items()}
    return log_sum(list(log.values())), max(log, key=lambda kappa: log[kappa])


def log_sum(values: Sequence[float] | np.ndarray) -> float:
    """Return log Σ exp(values)."""
    top = np.max(values)
    return float(top + np.log(np.sum(np.exp(np.asarray(values) - top))))
