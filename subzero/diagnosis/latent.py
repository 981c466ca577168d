"""Gaussian processes over time in a linear problem: how probable, how large, while all tolerances are free.

    r = J z + C f + e,   z ~ N(0, D),   f ~ N(0, a² R(T)),   e ~ N(0, I)
    M = Cᵀ Σ₀⁻¹ C,   q = Cᵀ Σ₀⁻¹ r,   Σ₀ = I + J D Jᵀ
    log p(r | f) − log p(r | f = 0) = −½ log |I + a² R M| + ½ qᵀ (a⁻² R⁻¹ + M)⁻¹ q

M and q are all that the data say of f, whatever its prior; amplitudes a and correlation times T are mixed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.evidence import log_sum

CORRELATION_TIMES = (2.0, 6.0)
"""T of the mixture: a force that changes within seconds, or lasts. [s]"""
DRIFT_TIMES = (10.0, 30.0)
"""The same of a sensor's drift, which is slow: one that follows every step of a force is no drift. [s]"""
SHARES = (0.1, 0.3, 1.0)
"""Amplitudes of the mixture, in units of the axis' usual force: smaller ones are of no practical size."""
JITTER = 1e-6


class Seen(NamedTuple):
    """What data say of the coefficients f of columns: information M (n, n) and q (n,), tolerances free."""

    M: np.ndarray
    q: np.ndarray


class Terms(NamedTuple):
    """What a force may look like, as formulas of one term: values at the knots (n, terms), of size 1, and log prior."""

    phi: np.ndarray
    log_prior: np.ndarray


class Shape(NamedTuple):
    """Prior of a process: amplitude [unit of f] and correlation time [s]."""

    amplitude: float
    time: float


def seen(
    A: np.ndarray, b: np.ndarray, D: np.ndarray, J: np.ndarray, columns: np.ndarray, r: np.ndarray
) -> Seen:
    """Return what the data say of columns, all other entries free under D.

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
    return Seen(M=0.5 * (M + M.T), q=columns.T @ r - cross.T @ answer[:, -1])


def correlation(times: np.ndarray, groups: np.ndarray, time: float, *, smooth: bool = False) -> np.ndarray:
    """Return R (n, n) between knots: exp(−|Δt|/T), or Matérn's with two derivatives for what never jumps.

    Knots of different groups (records) have nothing in common.
    """
    d = np.abs(np.subtract.outer(times, times)) / time
    root = np.sqrt(5.0) * d
    R = (1.0 + root + root**2 / 3.0) * np.exp(-root) if smooth else np.exp(-d)
    return np.where(np.equal.outer(groups, groups), R, 0.0)


def log_gains(data: Seen, R: np.ndarray, amplitudes: Sequence[float]) -> np.ndarray:
    """Return the log evidence over that of f = 0 for every amplitude (amplitudes,)."""
    half = np.linalg.cholesky(R + JITTER * np.eye(R.shape[0]))
    values, vectors = np.linalg.eigh(half.T @ data.M @ half)
    values, y = np.maximum(values, 0.0), vectors.T @ (half.T @ data.q)
    a2 = np.square(amplitudes)[:, None]
    return np.sum(-0.5 * np.log1p(a2 * values) + 0.5 * a2 * y**2 / (1.0 + a2 * values), axis=1)


def log_evidence_process(
    data: Seen,
    times: np.ndarray,
    groups: np.ndarray,
    amplitudes: Sequence[float],
    *,
    drift: bool = False,
) -> float:
    """Return the log evidence of a process over that of f = 0, amplitudes and correlation times mixed."""
    lasting = DRIFT_TIMES if drift else CORRELATION_TIMES
    table = np.array(
        [log_gains(data, correlation(times, groups, T, smooth=drift), amplitudes) for T in lasting]
    )
    return log_sum(table.ravel()) - float(np.log(table.size))


def log_evidence_term(data: Seen, terms: Terms, amplitudes: Sequence[float]) -> float:
    """Return the log evidence of f = c φ over that of f = 0, c ~ N(0, a²); terms and amplitudes mixed."""
    M = np.sum(terms.phi * (data.M @ terms.phi), axis=0)
    q, a2 = terms.phi.T @ data.q, np.square(amplitudes)[:, None]
    table = 0.5 * a2 * q**2 / (1.0 + a2 * M) - 0.5 * np.log1p(a2 * M) + terms.log_prior
    return log_sum(table.ravel()) - float(np.log(len(amplitudes)))


def modes(times: np.ndarray, groups: np.ndarray, shape: Shape) -> np.ndarray:
    """Return L (n, n) such that f = L x with x ~ N(0, I) is the process."""
    R = correlation(times, groups, shape.time)
    return shape.amplitude * np.linalg.cholesky(R + JITTER * np.eye(times.size))
