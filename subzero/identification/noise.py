"""The noise of a channel: a white part with rounding, and a slow part; whitening with it.

    Σ_ij = (σ_w² + q²/12) δ_ij + σ_s² exp(−|t_i − t_j|/τ_s)

Of equal readings in a row the middle one is used: what rounds or holds a value errs by the same in all of them.

Σ is never formed: a Kalman filter with the slow part as its state turns a residual into its innovations, which are
white (Rasmussen & Williams 2006, app. B; Hartikainen & Särkkä 2010).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas, lapack
from scipy.optimize import minimize

from subzero.jit import compiled

OPEN_SPREAD = 1.0
"""Standard deviation of log σ_w about a level that was read off the record. [-]"""
BINDING = 5.0
"""A level binds: σ_w is no farther from it, in standard deviations of its logarithm. [-]"""
SLOW_SHARE, SLOW_SPREAD = 0.3, 0.7
"""Usual slow part of a sensor, over its level, and the standard deviation of its logarithm. [-]"""
SLOWEST_WHITE = 2.0
"""A part whose τ_s is less, in sampling intervals, is white. [-]"""
USUAL_TIME = 10.0
"""Usual τ_s. [sampling intervals]"""
MEAN_SPREAD, TIME_SPREADS = 1.0, (0.15, 0.3, 0.6)
"""Standard deviation of the mean of log τ_s of the channels of a logger; equally probable ones about this mean. [-]"""
FLOOR_SHARE = 1e-6
"""Least level of a sensor whose noise was neither declared nor is seen, over the spread of its readings. [-]"""

TIMES_TRIED = (3.0, 10.0, 50.0)
"""Correlation times that are tried first, in sampling intervals: a short and a long one are maxima of their own. [-]"""
SETTLED = 0.05
"""A search for the noise ends within so much of the highest density. [nats]"""
INVISIBLE = 1e-3
"""A direction that moves all readings of a channel together by less, in levels of its sensor, is none. [-]"""
MEDIAN_TO_SD = 1.4826
"""Standard deviation of normal noise, over its median absolute deviation. [-]"""


@dataclass(frozen=True)
class Noise:
    """σ_w, σ_s [unit of the channel] and τ_s [s]."""

    white: float
    slow: float
    time: float


@dataclass(frozen=True)
class NoisePrior:
    """What is known of a sensor before a fit.

    Attributes:
        level: usual σ_w. [unit of the channel]
        resolution: q. [unit of the channel]
        interval: of its samples. [s]
        spread: standard deviation of the logarithm of its level. [-]
    """

    level: float
    resolution: float
    interval: float
    spread: float

    @property
    def most(self) -> float:
        """The level at its upper end: a slow part that is larger is no noise of a sensor. [unit of the channel]"""
        return self.level * math.exp(self.spread)

    @property
    def least(self) -> float:
        """The level at its lower end. [unit of the channel]"""
        return self.level * math.exp(-self.spread)

    def usual(self) -> Noise:
        """Return the noise at its median."""
        return Noise(self.level, SLOW_SHARE * self.level, USUAL_TIME * self.interval)

    def log_density(self, noise: Noise) -> float:
        """Return the log prior density of σ_w and σ_s, up to a constant; that of τ_s is `log_times`."""
        white = math.log(noise.white / self.level) / self.spread
        if noise.slow > self.most or abs(white) > BINDING or noise.time < SLOWEST_WHITE * self.interval:
            return -math.inf
        slow = math.log(noise.slow / (SLOW_SHARE * self.level)) / SLOW_SPREAD
        return -0.5 * (white**2 + slow**2)


def log_times(noise: Sequence[Noise], intervals: Sequence[float]) -> float:
    """Return the log prior density of τ_s of the channels of one logger, up to a constant.

        log τ_k ~ N(log 10 Δ_k + μ, s²),   μ ~ N(0, MEAN_SPREAD²),   s any of TIME_SPREADS

    with μ and s integrated out: channels of one logger often have one filter. A channel counts as much as its slow
    part has of its variance, as the time of a part that is not there says nothing.

    Args:
        noise: of the channels.
        intervals: of their samples. [s]
    """
    off = np.log([each.time / (USUAL_TIME * step) for each, step in zip(noise, intervals, strict=True)])
    weight = np.array([each.slow**2 / (each.slow**2 + each.white**2) for each in noise])
    precision = 1.0 / np.square(TIME_SPREADS)
    shared = precision * weight.sum() + 1.0 / MEAN_SPREAD**2
    square = precision * float(weight @ off**2) - (precision * float(weight @ off)) ** 2 / shared
    log = 0.5 * weight.sum() * np.log(precision) - 0.5 * np.log(shared) - 0.5 * square
    return float(np.logaddexp.reduce(log))


def resolution_of(values: np.ndarray) -> float:
    """Return the step that readings (n,) are multiples of; 0 where there is none, or only one reading."""
    distinct = np.unique(values[np.isfinite(values)])
    if distinct.size < 3 or distinct.size > 0.9 * np.isfinite(values).sum():
        return 0.0
    step = float(np.min(np.diff(distinct)))
    ratio = (distinct - distinct[0]) / step
    return step if np.max(np.abs(ratio - np.rint(ratio))) < 0.05 else 0.0


def middle_of_equal(values: np.ndarray) -> np.ndarray:
    """Return which of some readings (m,) are the middle of equal ones in a row, or differ from both neighbours."""
    begins = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    found = np.zeros(values.size, dtype=bool)
    found[(begins + np.append(begins[1:], values.size)) // 2] = True
    return found


def level_of(values: np.ndarray, resolution: float) -> float:
    """Return the level of a sensor as its readings (n,) show it: from their second differences, which a slow signal
    hardly has; at least that of its rounding.

    The second difference of white noise has √6 times its standard deviation. Readings that are not rounded and yet
    equal in a row are those of a sensor that stands still, and show no noise.
    """
    seen = values[np.isfinite(values)]
    if resolution == 0.0 and seen.size > 4:
        moving = middle_of_equal(seen)
        seen = seen[moving] if moving.sum() > 4 else seen
    rough = MEDIAN_TO_SD * float(np.median(np.abs(np.diff(seen, 2)))) / np.sqrt(6.0) if seen.size > 4 else 0.0
    floor = FLOOR_SHARE * float(np.ptp(seen)) if seen.size else 0.0
    return max(rough, resolution / np.sqrt(12.0), floor, np.finfo(float).tiny ** 0.25)


@dataclass(frozen=True, eq=False)
class Filter:
    """The filter of a noise over some samples: decay to the next sample, gain, scale of the innovations (m,)."""

    decay: np.ndarray
    gain: np.ndarray
    scale: np.ndarray

    @classmethod
    def of(cls, noise: Noise, resolution: float, times: np.ndarray) -> Filter:
        """Return the filter at the times of the samples (m,); where they fall, a new record begins. [s]"""
        decay, gain, scale = np.empty(times.size), np.empty(times.size), np.empty(times.size)
        white = noise.white**2 + resolution**2 / 12.0
        gains(times, noise.time, white, noise.slow**2, decay, gain, scale)
        return cls(decay, gain, scale)

    @property
    def log_scale(self) -> float:
        """½ log det Σ."""
        return float(np.sum(np.log(self.scale)))

    def whiten(self, columns: np.ndarray) -> np.ndarray:
        """Return the innovations of columns (m, k), of level 1."""
        white = np.empty_like(columns)
        innovations(self.decay, self.gain, self.scale, np.ascontiguousarray(columns), white)
        return white


@compiled
def gains(
    times: np.ndarray,
    lasting: float,
    white: float,
    slow: float,
    decay: np.ndarray,
    gain: np.ndarray,
    scale: np.ndarray,
) -> None:
    """Fill decay to the next sample, Kalman gain and standard deviation of the innovation of every sample (m,)."""
    left = slow
    for i in range(decay.size):
        step = times[i + 1] - times[i] if i + 1 < decay.size else 0.0
        decay[i] = np.exp(-step / lasting) if step >= 0.0 else 0.0
        seen = left + white
        gain[i] = left / seen
        scale[i] = np.sqrt(seen)
        # What the sample leaves unknown decays to the next one, and the process adds to it.
        left = decay[i] * decay[i] * left * (1.0 - gain[i]) + slow * (1.0 - decay[i] * decay[i])


@compiled
def innovations(
    decay: np.ndarray, gain: np.ndarray, scale: np.ndarray, values: np.ndarray, white: np.ndarray
) -> None:
    """Fill the innovations of columns (m, k): each value less its prediction, over its standard deviation."""
    for i in range(values.shape[0]):
        before = max(i - 1, 0)
        passed, left = (decay[before], (1.0 - gain[before]) * scale[before]) if i else (0.0, 0.0)
        for j in range(values.shape[1]):
            expected = passed * (values[before, j] - left * white[before, j]) if i else 0.0
            white[i, j] = (values[i, j] - expected) / scale[i]


def log_marginal(given: Filter, columns: np.ndarray) -> float:
    """Return the log density of residuals e₀ − K w with w ~ N(0, I), up to a constant, from columns [K e₀] (m, r + 1).

    log p = −½ (e₀ᵀΣ⁻¹e₀ − bᵀH⁻¹b) − ½ log|H| − ½ log|Σ|,   H = I + KᵀΣ⁻¹K,   b = KᵀΣ⁻¹e₀
    """
    G = blas.dsyrk(1.0, given.whiten(columns).T, lower=1)
    count = G.shape[0] - 1
    G[np.arange(count), np.arange(count)] += 1.0
    # The last row of the Cholesky factor of [H b; bᵀ e₀ᵀΣ⁻¹e₀] leaves the square that w does not explain.
    diagonal = np.diag(lapack.dpotrf(G, lower=1, overwrite_a=1)[0])
    return -given.log_scale - float(np.sum(np.log(diagonal[:-1]))) - 0.5 * float(diagonal[-1]) ** 2


def most_probable(
    before: Noise,
    prior: NoisePrior,
    times: np.ndarray,
    columns: np.ndarray,
    log_more: Callable[[Noise], float],
) -> Noise:
    """Return the noise of a channel with the highest density, as far as the simplex of Nelder & Mead (1965) comes.

    Args:
        before: where the search begins; and, with other correlation times, again.
        prior: of the sensor.
        times: of its readings (m,). [s]
        columns: [K e] of `log_marginal` (m, r + 1).
        log_more: further log prior density, such as `log_times`.
    """

    def at(log: np.ndarray) -> Noise:
        white, slow, time = np.exp(log).tolist()
        return Noise(white * before.white, slow * before.slow, time * before.time)

    def negative(log: np.ndarray) -> float:
        noise = at(log)
        density = prior.log_density(noise)
        if density == -math.inf:
            return 1e300
        return -log_marginal(Filter.of(noise, prior.resolution, times), columns) - density - log_more(noise)

    lasting = [before.time, *(share * prior.interval for share in TIMES_TRIED)]
    begin = np.column_stack([np.zeros((len(lasting), 2)), np.log(np.array(lasting) / before.time)])
    tried = [negative(each) for each in begin]
    best = begin[int(np.argmin(tried))]
    simplex = best + np.vstack([np.zeros(3), np.diag([0.3, -0.5, 0.7])])
    options = {"initial_simplex": simplex, "maxfev": 60, "xatol": 0.2, "fatol": SETTLED}
    found = minimize(negative, best, method="Nelder-Mead", options=options)
    return at(found.x) if found.fun <= tried[0] else before


def visible(K: np.ndarray, level: float) -> np.ndarray:
    """Return columns (m, r) with the covariance K Kᵀ (m, k), but for directions that no reading shows."""
    squares, V = np.linalg.eigh(K.T @ K)
    return K @ V[:, squares > (INVISIBLE * level) ** 2]
