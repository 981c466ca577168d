"""Evidence and posterior in the linear Gaussian problem: of parameters z, and of a Gaussian process f added to them.

    r = J z + e,   z ~ N(0, D),   e ~ N(0, I);      A = Jᵀ J,  b = Jᵀ r,  P = D⁻¹ + A
    log p = −½ (rᵀr − bᵀ P⁻¹ b) − ½ log det(D P)

A hypothesis frees some entries: their variance becomes s² instead of (κτ)². That changes P at a few places of its
diagonal only, so that all pairs cost a few products of 2 × 2 matrices each.

    r = J z + C f + e,   f ~ N(0, a² R(T));      M = Cᵀ Σ₀⁻¹ C,   q = Cᵀ Σ₀⁻¹ r,   Σ₀ = I + J D Jᵀ
    log p(r | f) − log p(r | f = 0) = −½ log |I + a² R M| + ½ qᵀ (a⁻² R⁻¹ + M)⁻¹ q

M and q are all the information of the data on f, whatever its prior; amplitudes a and correlation times T are
marginalised over.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

KAPPAS = {1.0: 0.6, 2.0: 0.3, 4.0: 0.1}
"""κ, the widening of the declared tolerances → its prior probability."""


class Scale(NamedTuple):
    """A κ, given a hypothesis and the data: its log probability, and the prior variances under it (k,)."""

    log_weight: float
    D: np.ndarray


Scales = Mapping[float, Scale]
"""κ → its log probability and prior variances."""


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


class Linear(NamedTuple):
    """A linear problem around a fit: the residual with all parameters at 0, r + J z (m,), and J (m, k), both whitened
    with the noise of a problem.
    """

    whole: np.ndarray
    J: np.ndarray

    @property
    def quadratic(self) -> Quadratic:
        """The same as products with Jᵀ, whose size is that of the parameters."""
        whole, J = self
        return Quadratic(A=J.T @ J, b=J.T @ whole, rr=float(whole @ whole))


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


def log_beyond(
    mean: np.ndarray, variance: np.ndarray, prior: np.ndarray, within: np.ndarray, sizes: Sequence[int]
) -> np.ndarray:
    """Return the correction of a log evidence (…) with normal priors if deviations within calibration are no cause:

        p(z) ∝ N(z; 0, s²) (1 − exp(−½ z²/w²)),
        log p(y) − log p_normal(y) = log (1 − E[exp(−½ z²/w²) | y]) − log (1 − E[exp(−½ z²/w²)]).

    So a cause that is surely close to 0 is none; one that the data do not constrain, or that is large, is unaffected:
    a non-local prior (Johnson & Rossell 2010) with the tails of the normal. Parameters are taken to be independent,
    given the data.

    Args:
        mean: of the causes' parameters under normal priors, one cause after the other (…, k).
        variance: of these parameters (…, k).
        prior: s² (…, k).
        within: w² (…, k).
        sizes: how many parameters each cause has.
    """
    if not sizes:
        return np.zeros(mean.shape[:-1])
    first = np.cumsum([0, *sizes[:-1]])

    def log_off_calibration(mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
        log = -0.5 * (np.log1p(variance / within) + mean**2 / (within + variance))
        inside = np.minimum(np.add.reduceat(log, first, axis=-1), -np.finfo(float).tiny)
        return np.sum(np.log(-np.expm1(inside)), axis=-1)

    return log_off_calibration(mean, variance) - log_off_calibration(np.zeros_like(mean), prior)


def freed(
    base: Posterior, D: np.ndarray, places: Sequence[int] | np.ndarray, variance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return log evidence (…), means (…, p) and covariance (…, p, p) of p entries when their prior variances are
    replaced.

    Args:
        base: under D.
        D: prior variances (k,).
        places: of the entries (…, p), of one or several hypotheses.
        variance: their new prior variances (…, p).
    """
    at = np.asarray(places)
    change, eye = 1.0 / variance - 1.0 / D[at], np.eye(at.shape[-1])
    M, z = base.M[at[..., :, None], at[..., None, :]], base.z[at]
    inner = eye + change[..., :, None] * M
    solved = np.linalg.solve(inner, change[..., :, None] * eye)
    gain = -0.5 * np.einsum("...i,...ij,...j", z, solved, z)
    log_det = np.linalg.slogdet(inner)[1] + np.sum(np.log(variance / D[at]), axis=-1)
    covariance = np.linalg.solve(eye + M * change[..., None, :], M)
    mean = z - (covariance @ (change * z)[..., None])[..., 0]
    return base.log_evidence + gain - 0.5 * log_det, mean, covariance


def each_freed(
    base: Posterior, D: np.ndarray, places: Sequence[Sequence[int]], wide: np.ndarray
) -> np.ndarray:
    """Return the log evidence (hypotheses,) when the entries of each hypothesis, any number of them, get the prior
    variances `wide` (k,).
    """
    found, sizes = np.empty(len(places)), np.array([len(place) for place in places])
    for size in set(sizes.tolist()):
        alike = np.flatnonzero(sizes == size)
        at = np.array([places[i] for i in alike.tolist()], dtype=int).reshape(-1, size)
        found[alike] = freed(base, D, at, wide[at])[0]
    return found


def discrimination(G: np.ndarray, step: np.ndarray, free: np.ndarray) -> float:
    """Return the squared distance of a step from the closest response of other entries.

    Args:
        G: information of all k entries, tolerances of all included as 1/D on its diagonal but for those in the step's
            own and the rival's places (k, k).
        step: deviations of the true cause (k,), 0 elsewhere.
        free: which entries may respond (k,).
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


CORRELATION_TIMES = (2.0, 6.0)
"""Correlation times T of the mixture: a force that changes within seconds, or lasts. [s]"""
DRIFT_TIMES = (10.0, 30.0)
"""The same for a sensor's drift, which is slow: one that follows every step of a force is no drift. [s]"""
AMPLITUDE_SHARES = (0.1, 0.3, 1.0)
"""Amplitudes of the mixture, in units of the axis' usual force: smaller ones are of no practical size."""
JITTER = 1e-6


class ForceInformation(NamedTuple):
    """Information of the data on the coefficients f of columns: M (n, n) and q (n,), tolerances marginalised."""

    M: np.ndarray
    q: np.ndarray


class Terms(NamedTuple):
    """Formulas of one term for a force: values at the knots (n, terms, 2), of size 1, and log prior. A wave has two
    columns, for its phase; of other terms the second is 0.
    """

    phi: np.ndarray
    log_prior: np.ndarray


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


def log_evidence_process(
    data: ForceInformation,
    times: np.ndarray,
    groups: np.ndarray,
    amplitudes: Sequence[float],
    *,
    drift: bool = False,
) -> float:
    """Return the log evidence of a process over that of f = 0, amplitudes and correlation times marginalised over."""
    lasting = DRIFT_TIMES if drift else CORRELATION_TIMES
    table = np.array(
        [log_gains(data, correlation(times, groups, T, smooth=drift), amplitudes) for T in lasting]
    )
    return log_sum(table.ravel()) - float(np.log(table.size))


def log_evidence_term(data: ForceInformation, terms: Terms, amplitudes: Sequence[float]) -> float:
    """Return the log evidence of f = φ c over that of f = 0, c ~ N(0, a² I); terms and amplitudes
    marginalised over.
    """
    first, second = terms.phi[:, :, 0], terms.phi[:, :, 1]
    M1, M2 = data.M @ first, data.M @ second
    m11, m12, m22 = np.sum(first * M1, axis=0), np.sum(first * M2, axis=0), np.sum(second * M2, axis=0)
    q1, q2, a2 = first.T @ data.q, second.T @ data.q, np.square(amplitudes)[:, None]
    det = (1.0 + a2 * m11) * (1.0 + a2 * m22) - (a2 * m12) ** 2  # of I + a² φᵀ M φ
    square = q1**2 * (1.0 + a2 * m22) - 2.0 * q1 * q2 * a2 * m12 + q2**2 * (1.0 + a2 * m11)
    table = 0.5 * a2 * square / det - 0.5 * np.log(det) + terms.log_prior
    return log_sum(table.ravel()) - float(np.log(len(amplitudes)))


def modes(times: np.ndarray, groups: np.ndarray, shape: ProcessShape) -> np.ndarray:
    """Return L (n, n) such that f = L x with x ~ N(0, I) is the process."""
    R = correlation(times, groups, shape.time)
    return shape.amplitude * np.linalg.cholesky(R + JITTER * np.eye(times.size))
