"""Evidence and posterior in the linear Gaussian problem: of parameters z, and of a Gaussian process f added to them.

    r = J z + e,   z ~ N(0, D),   e ~ N(0, I);      A = Jᵀ J,  b = Jᵀ r,  P = D⁻¹ + A
    log p = −½ (rᵀr − bᵀ P⁻¹ b) − ½ log det(D P)

    r = J z + C f + e,   f ~ N(0, a² R(T));      M = Cᵀ Σ₀⁻¹ C,   q = Cᵀ Σ₀⁻¹ r,   Σ₀ = I + J D Jᵀ
    log p(r | f) − log p(r | f = 0) = −½ log |I + a² R M| + ½ qᵀ (a⁻² R⁻¹ + M)⁻¹ q

M and q are all the information of the data on f, whatever its prior; amplitudes a and correlation times T are
marginalised over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


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


def precision(A: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Return I + √D A √D (k, k), given A = JᵀJ (k, k) and √D (k,), with its rounding error added to the diagonal:
    with sensitivities of a million levels of the noise, the 1 of the prior is lost to rounding.
    """
    scaled = root[:, None] * A * root
    scaled.ravel()[:: root.size + 1] += 1.0 + root.size * np.finfo(float).eps * np.trace(scaled)
    return scaled


def posterior(q: Quadratic, D: np.ndarray) -> Posterior:
    """Return the posterior under prior variances D (k,)."""
    root = np.sqrt(D)
    factor = np.linalg.cholesky(precision(q.A, root))
    half = np.linalg.solve(factor, np.diag(root))
    M = half.T @ half
    z = M @ q.b
    log_det = 2.0 * float(np.sum(np.log(np.diag(factor))))
    return Posterior(z=z, M=M, log_evidence=-0.5 * (q.rr - float(q.b @ z)) - 0.5 * log_det, log_det=log_det)


def log_sum(values: Sequence[float] | np.ndarray) -> float:
    """Return log Σ exp(values)."""
    top = np.max(values)
    return float(top + np.log(np.sum(np.exp(np.asarray(values) - top))))


AMPLITUDE_SHARES = (0.1, 0.3, 1.0)
"""Amplitudes of the mixture, in units of the axis' usual force: smaller ones are of no practical size."""
JITTER = 1e-6


class ForceInformation(NamedTuple):
    """Information of the data on the coefficients f of columns: M (n, n) and q (n,), tolerances marginalised."""

    M: np.ndarray
    q: np.ndarray


class ProcessShape(NamedTuple):
    """Prior of a process: amplitude [unit of f] and correlation time [s]."""

    amplitude: float
    time: float


def seen(
    A: np.ndarray, b: np.ndarray, D: np.ndarray, J: np.ndarray, columns: np.ndarray, r: np.ndarray
) -> ForceInformation:
    """Return the information of the data on columns, all other entries marginalised under D.

    Args:
        A: JᵀJ (k, k).
        b: Jᵀr (k,).
        D: prior variances (k,).
        J: sensitivities (m, k).
        columns: C (m, n).
        r: residual with z = 0 and f = 0 in the linear problem (m,).
    """
    root = np.sqrt(D)
    inner = np.eye(D.size) + root[:, None] * A * root
    cross = root[:, None] * (J.T @ columns)
    answer = np.linalg.solve(inner, np.column_stack([cross, root * b]))
    M = columns.T @ columns - cross.T @ answer[:, :-1]
    return ForceInformation(M=0.5 * (M + M.T), q=columns.T @ r - cross.T @ answer[:, -1])


def correlation(times: np.ndarray, groups: np.ndarray, time: float, *, smooth: bool = False) -> np.ndarray:
    """Return R (n, n) between knots: exp(−|Δt|/T), or Matérn's with two derivatives for a history that never jumps.

    Knots of different groups (records) have nothing in common.
    """
    d = np.abs(np.subtract.outer(times, times)) / time
    root = np.sqrt(5.0) * d
    R = (1.0 + root + root**2 / 3.0) * np.exp(-root) if smooth else np.exp(-d)
    return np.where(np.equal.outer(groups, groups), R, 0.0)


def log_gains(data: ForceInformation, R: np.ndarray, amplitudes: Sequence[float]) -> np.ndarray:
    """Return the log evidence over that of f = 0 for every amplitude (amplitudes,)."""
    half = np.linalg.cholesky(R + JITTER * np.eye(R.shape[0]))
    values, vectors = np.linalg.eigh(half.T @ data.M @ half)
    values, y = np.maximum(values, 0.0), vectors.T @ (half.T @ data.q)
    a2 = np.square(amplitudes)[:, None]
    return np.sum(-0.5 * np.log1p(a2 * values) + 0.5 * a2 * y**2 / (1.0 + a2 * values), axis=1)


def modes(times: np.ndarray, groups: np.ndarray, shape: ProcessShape) -> np.ndarray:
    """Return L (n, n) such that f = L x with x ~ N(0, I) is the process."""
    R = correlation(times, groups, shape.time)
    return shape.amplitude * np.linalg.cholesky(R + JITTER * np.eye(times.size))
