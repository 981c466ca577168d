"""The noise of a channel: white, slow and rounded; whitening with it, and its estimate behind a fit (REML).

    e_k = w_k + x(t_k) + rounding,   w ~ N(0, σ_w²),   x ~ Ornstein-Uhlenbeck(σ_s, τ_s),   rounding ~ N(0, q²/12)
    Σ_ij = (σ_w² + q²/12) δ_ij + σ_s² exp(−|t_i − t_j|/τ_s)

Σ is never made. A Kalman filter whose state is x turns e into its innovations, which are white, for any times of the
samples; AR(1) noise is the case σ_w = 0. The parameters are the most probable ones behind a fit z*, Jacobian J:

    y − h(z*) + J z*  ~  N(0, J D Jᵀ + Σ(σ_w, σ_s, τ_s, q)),        z ~ N(0, D)
    log σ_w ~ N(log ν, 1.5²),   log σ_s ~ N(log(0.7 ν + q/√12), 1²) below `MOST_SLOW`,   log τ_s ~ N(log 1 s, 1.5²)

What the parameters can do is marginalised, so that a smooth misfit that the model can follow is no noise. A slow part
has a prior: a usual sensor wanders by about its usual noise, and a wander many times as large is something to find. ν
is the usual level of the sensor, or the known one. q is read off the values: sensors round.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.jit import compiled


@dataclass(frozen=True, kw_only=True, eq=False)
class Noise:
    """The noise of a channel of a record.

    Attributes:
        white: σ_w, standard deviation of what changes from sample to sample. [unit of the channel]
        slow: σ_s, standard deviation of what lasts. [unit of the channel]
        correlation_time: τ_s of the slow part. [s]
        resolution: q, the step that values are rounded to; 0 for none. [unit of the channel]
        used: which samples are used: measured, and no outliers (n,).
        time: of the used samples (m,). [s]
    """

    white: float
    slow: float = 0.0
    correlation_time: float = 1.0
    resolution: float = 0.0
    used: np.ndarray
    time: np.ndarray

    @property
    def sd(self) -> float:
        """The level: standard deviation of the noise of a sample, in the channel's unit."""
        return float(np.sqrt(self.unrelated + self.slow**2))

    @property
    def unrelated(self) -> float:
        """Variance of what has nothing to do with the samples before: σ_w² + q²/12."""
        return self.white**2 + self.resolution**2 / 12.0

    @property
    def lasting(self) -> float:
        """The spectral density at low frequencies: σ_s² 2 τ_s and what the others have from sample to sample."""
        step = float(np.median(np.diff(self.time))) if self.count > 1 else 1.0
        return 2.0 * self.slow**2 * self.correlation_time + self.unrelated * step

    @property
    def count(self) -> int:
        """How many samples are used, m."""
        return int(self.time.size)

    def sd_of_mean(self, samples: int, span: float) -> float:
        """Return the standard deviation of the mean of samples that are evenly spread over a span [s]."""
        x = max(span, 1e-9) / self.correlation_time
        lasting = 2.0 * (x - 1.0 + np.exp(-x)) / x**2 if x > 1e-3 else 1.0
        return float(np.sqrt(self.unrelated / max(samples, 1) + self.slow**2 * lasting))

    @cached_property
    def _filter(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What of the slow part is left at the next sample, the gain, and the innovations' standard deviation (m,)."""
        kept = np.exp(-np.diff(self.time, append=self.time[-1:]) / self.correlation_time)
        gain, scale = np.empty(self.count), np.empty(self.count)
        gains_of(kept, self.unrelated, self.slow**2, gain, scale)
        return kept, gain, scale

    @property
    def log_scale(self) -> float:
        """½ log det Σ over the used samples."""
        return float(np.sum(np.log(self._filter[2])))

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """Return what makes the noise white, of level 1: values (n,) or (n, columns) → of the used samples (m, …)."""
        return self._innovations(values[self.used])

    def whiten_again(self, white: np.ndarray, before: Noise) -> np.ndarray:
        """Return what another noise, of the same samples, has made white (m, …), made white by this one."""
        return self._innovations(before.colour(white))

    def colour(self, white: np.ndarray) -> np.ndarray:
        """Undo `whiten`, but for samples that are not used: (m,) or (m, columns) → the same shape."""
        columns = _as_columns(white)
        found = np.empty_like(columns)
        coloured(*self._filter, columns, found)
        return found.reshape(white.shape)

    def _innovations(self, known: np.ndarray) -> np.ndarray:
        columns = _as_columns(known)
        white = np.empty_like(columns)
        innovations(*self._filter, columns, white)
        return white.reshape(known.shape)


def _as_columns(values: np.ndarray) -> np.ndarray:
    """Return values (m,) as one column, or columns (m, k) as they are; m may be 0."""
    values = np.ascontiguousarray(values, dtype=float)
    return values[:, None] if values.ndim == 1 else values


@compiled
def gains_of(kept: np.ndarray, white: float, slow: float, gain: np.ndarray, scale: np.ndarray) -> None:
    """Fill the gain of the filter, and the standard deviation of its innovations, at every sample (m,)."""
    left = slow  # variance of the slow part before the sample is seen
    for i in range(kept.size):
        seen = left + white
        gain[i] = left / seen
        scale[i] = np.sqrt(seen)
        left = kept[i] * kept[i] * left * (1.0 - gain[i]) + slow * (1.0 - kept[i] * kept[i])


@compiled
def innovations(
    kept: np.ndarray, gain: np.ndarray, scale: np.ndarray, values: np.ndarray, white: np.ndarray
) -> None:
    """Fill what the values before do not tell of each value, over its standard deviation: (m, columns) → the same."""
    for j in range(values.shape[1]):
        expected = 0.0
        for i in range(values.shape[0]):
            new = values[i, j] - expected
            white[i, j] = new / scale[i]
            expected = kept[i] * (expected + gain[i] * new)


@compiled
def coloured(
    kept: np.ndarray, gain: np.ndarray, scale: np.ndarray, white: np.ndarray, values: np.ndarray
) -> None:
    """Fill the values that have innovations: (m, columns) → the same."""
    for j in range(white.shape[1]):
        expected = 0.0
        for i in range(white.shape[0]):
            new = white[i, j] * scale[i]
            values[i, j] = expected + new
            expected = kept[i] * (expected + gain[i] * new)


@compiled
def log_marginal(
    steps: np.ndarray, unrelated: float, slow: float, lasts: float, both: np.ndarray, room: np.ndarray
) -> float:
    """Return log N(r; 0, F Fᵀ + Σ), but for a constant: −½ (xᵀx − |L⁻¹ Gᵀx|²) − log det L − ½ log det Σ, with x and G
    what Σ makes white of r and F, and L Lᵀ = I + Gᵀ G.

    Args:
        steps: times to the next sample (m,). [s]
        unrelated: σ_w² + q²/12.
        slow: σ_s².
        lasts: τ_s. [s]
        both: F and, in the last column, r (m, n + 1).
        room: to work in (n + 3, n + 1).
    """
    many = both.shape[1]
    expected, white, inner = room[many], room[many + 1], room[:many]
    expected[:] = 0.0
    inner[:] = 0.0
    left, log_scale = slow, 0.0
    for i in range(both.shape[0]):
        seen, kept = left + unrelated, np.exp(-steps[i] / lasts)
        gain = left / seen
        log_scale += 0.5 * np.log(seen)
        left = kept * kept * left * (1.0 - gain) + slow * (1.0 - kept * kept)
        for j in range(many):
            new = both[i, j] - expected[j]
            white[j] = new / np.sqrt(seen)
            expected[j] = kept * (expected[j] + gain * new)
            for k in range(j + 1):
                inner[j, k] += white[j] * white[k]
    return -log_scale + _log_of_square(inner)


@compiled
def _log_of_square(inner: np.ndarray) -> float:
    """Return −½ (xᵀx − |L⁻¹ Gᵀx|²) − log det L, given Gᵀ G, below it xᵀ G, and xᵀx (n + 1, n + 1), where L is left."""
    last, log_det = inner.shape[0] - 1, 0.0
    for j in range(last + 1):
        for k in range(j + 1):
            value = inner[j, k] + (1.0 if j == k and j < last else 0.0)
            for i in range(k):
                value -= inner[j, i] * inner[k, i]
            if k < j:
                inner[j, k] = value / inner[k, k]
            elif j < last:
                inner[j, j] = np.sqrt(value)
                log_det += np.log(inner[j, j])
            else:
                inner[j, j] = value
    return -0.5 * inner[last, last] - log_det


SLOW_SHARE = 0.7
"""Usual standard deviation of a sensor's slow part, in its usual noise levels. [-]"""
WHITE_SPREAD, SLOW_SPREAD, TIME_SPREAD = 1.5, 1.0, 1.5
"""Standard deviations of the logarithms of σ_w, σ_s and τ_s about what is usual. [-]"""
USUAL_TIME = 1.0
"""Usual correlation time of a sensor's slow part. [s]"""
KNOWN_SPREAD = 0.1
"""Standard deviation of the logarithm of a level that the user knows. [-]"""
LEAST_SLOW, MOST_SLOW = 0.05, 4.0
"""A slow part of more usual sizes than the last is no noise of the sensor; of less than the first is no sensor, and the
steps of a simulation err by as much. [-]"""
SHORTEST, LONGEST = 0.25, 1.0 / 3.0
"""Correlation times lie between this share of a sample and that of the record. [-]"""
FELT = 0.03
"""A direction of the parameters that moves the samples by less than this, in usual levels, is left out. [-]"""
MOST_WHITE, SEEN_WHITE = 3.0, 1.5
"""σ_w is at most so many usual levels, or so many times what second differences of the samples show. [-]"""
RATIOS, TIMES, LEVELS = (0.1, 0.5, 1.0, 3.0), 6, (0.4, 1.0, 2.5)
"""Where the search for the best begins: σ_s/σ_w, how many τ_s, and level in the level of what is left. [-]"""
FEWEST = 8
"""Fewer different values than this say nothing of the step that they are rounded to."""
WHOLE, MOSTLY, FEW_WRONG = 0.02, 0.98, 0.25
"""Steps between values that are whole within the first share are multiples; of rounded values so many are, and of those
away from the most common one all but the last share. [-]"""
EXACT = 0.05
"""... and within this share of a usual level: what is far from the others is one step from each of them, about. [-]"""
SAME, STEPS_TRIED = 1e-6, 3
"""Changes of less than this share of a usual level are what arithmetic leaves of none [-]; a jump by no whole step
makes one or two steps smaller than that of the sensor: so many are tried."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Behind:
    """What a fit leaves of a channel, for its noise to be found in.

    Attributes:
        residual: y − h(z*) + J z* (m,): what is left if the parameters did nothing.
        J: sensitivities to the parameters (m, k), in the channel's unit.
        D: prior variances of the parameters (k,).
    """

    residual: np.ndarray
    J: np.ndarray
    D: np.ndarray


class Usual(NamedTuple):
    """What a sensor is like: level ν and resolution q, in the channel's unit, and whether the level is known."""

    level: float
    resolution: float
    is_known: bool


def usual_of(channel: str, values: np.ndarray, known: Mapping[str, float]) -> Usual:
    """Return what a channel's sensor is like, before anything is fitted: its level as known or usual, its resolution as
    its values (n,) show it.
    """
    level = known.get(channel, SPECS[channel].noise)
    return Usual(level, resolution_of(values, level), channel in known)


def usual_noise(time: np.ndarray, used: np.ndarray, usual: Usual) -> Noise:
    """Return the noise of a usual sensor, before anything is fitted.

    Args:
        time: of the samples (n,). [s]
        used: which of them are used (n,).
        usual: of its kind.
    """
    slow = usual.level if usual.is_known else _slow_usual(usual)
    share = SLOW_SHARE / np.sqrt(1.0 + SLOW_SHARE**2) if usual.is_known else 1.0
    white = np.sqrt(max(1.0 - share**2, 0.0)) * usual.level if usual.is_known else usual.level
    return Noise(white=float(white), slow=float(share * slow), correlation_time=USUAL_TIME,
                 resolution=usual.resolution, used=used, time=time[used])  # fmt: skip


def estimate(time: np.ndarray, behind: Behind, usual: Usual) -> Noise:
    """Return the most probable noise of a channel behind a fit.

    Args:
        time: of the samples that are used (m,). [s]
        behind: what the fit leaves.
        usual: of the sensor's kind.

    Returns:
        noise of which all these samples are used.
    """
    from scipy.optimize import minimize

    if time.size < FEWEST:
        return usual_noise(time, np.ones(time.size, dtype=bool), usual)
    r, F = behind.residual, _felt_directions(behind.J * np.sqrt(behind.D), usual.level)
    low, high = _bounds(time, r, usual)
    steps, both = np.diff(time, append=time[-1:]), np.column_stack([F, r])
    room = np.empty((both.shape[1] + 2, both.shape[1]))

    def cost(log: np.ndarray) -> float:
        white, slow, lasts = np.exp(log).tolist()
        unrelated = white**2 + usual.resolution**2 / 12.0
        return -log_marginal(steps, unrelated, slow**2, lasts, both, room) - _log_prior(log, usual)

    starts = sorted((np.clip(one, low, high) for one in _starts(time, r, F, usual)), key=cost)[:2]
    found = [minimize(cost, one, method="Nelder-Mead", bounds=list(zip(low, high, strict=True)),
                      options={"xatol": 0.02, "fatol": 0.02, "maxfev": 200}) for one in starts]  # fmt: skip
    return _noise_of(min(found, key=lambda one: one.fun).x, time, usual)


def resolution_of(values: np.ndarray, level: float) -> float:
    """Return the step that all values are multiples of, NaN left out; 0 where there is none.

    A sensor that rounds to 0.1 m shows 5.1, 5.2 and 5.4, and the steps between its different values are whole multiples
    of the smallest. So are its changes from sample to sample, also where it jumps by no whole step and goes on: of two
    such steps the coarser is that of the sensor. One that hardly ever leaves a value is whole steps off it, but for a
    few samples that are wrong. One that shows the same value all along rounds to a step that nobody knows, which is
    then taken to be as coarse as the noise of a usual sensor, `level`.
    """
    known = values[np.isfinite(values)]
    distinct, times = np.unique(known, return_counts=True)
    if distinct.size == 1 and known.size >= FEWEST:
        return float(np.sqrt(12.0) * level)
    changes = np.abs(np.diff(known))
    changes, exact = changes[changes > SAME * level], EXACT * level
    by_change = _whole_step(changes, exact) if changes.size >= FEWEST else 0.0
    if distinct.size < 2 or (distinct.size < FEWEST and 2 * distinct.size > known.size):
        return by_change
    away = np.abs(known - distinct[np.argmax(times)])
    away = away[away > SAME * level]
    few = min((1.0 - MOSTLY) * known.size, FEW_WRONG * away.size)
    return max(by_change, _whole_step(np.diff(distinct), exact), _whole_step(away, exact, few))


def _whole_step(steps: np.ndarray, exact: float, most: float | None = None) -> float:
    """Return the one of a few least steps (n,) that nearly all, or all but one, or but `most`, are multiples of, to
    within a share of it and `exact`; 0 if none is.
    """
    most = max(1.0, (1.0 - MOSTLY) * steps.size) if most is None else most
    least = np.unique(np.round(steps / np.min(steps), 6))[:STEPS_TRIED] * np.min(steps)
    for step in least.tolist():
        beside = np.abs(steps - step * np.round(steps / step))
        if np.count_nonzero(beside >= min(WHOLE * step, exact)) <= most:
            return float(step)
    return 0.0


def _slow_usual(usual: Usual) -> float:
    return SLOW_SHARE * usual.level + usual.resolution / np.sqrt(12.0)


def _noise_of(log: np.ndarray, time: np.ndarray, usual: Usual) -> Noise:
    white, slow, lasts = np.exp(log).tolist()
    every = np.ones(time.size, dtype=bool)
    return Noise(
        white=white, slow=slow, correlation_time=lasts, resolution=usual.resolution, used=every, time=time
    )


def _felt_directions(scaled: np.ndarray, level: float) -> np.ndarray:
    """Return F (m, few) with F Fᵀ = J D Jᵀ but for what nobody feels."""
    U, s, _ = np.linalg.svd(scaled, full_matrices=False)
    felt = s > FELT * level * np.sqrt(scaled.shape[0])
    return U[:, felt] * s[felt]


def log_prior_of(noise: Noise, usual: Usual) -> float:
    """Return the log density of a noise before the data speak, but for a constant of all noises."""
    return _log_prior(np.log([noise.white, noise.slow, noise.correlation_time]), usual)


def _log_prior(log: np.ndarray, usual: Usual) -> float:
    """Return the log density of log σ_w, log σ_s, log τ_s, but for a constant."""
    white, slow, time = log
    about = ((white - np.log(usual.level)) / WHITE_SPREAD) ** 2
    about += ((slow - np.log(_slow_usual(usual))) / SLOW_SPREAD) ** 2
    about += ((time - np.log(USUAL_TIME)) / TIME_SPREAD) ** 2
    if usual.is_known:
        level = 0.5 * np.log(np.exp(2.0 * white) + np.exp(2.0 * slow))
        about += ((level - np.log(usual.level)) / KNOWN_SPREAD) ** 2
    return -0.5 * float(about)


def _bounds(at: np.ndarray, r: np.ndarray, usual: Usual) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest log σ_w, log σ_s, log τ_s (3,) each.

    A fit that is far from the record leaves much that is no noise, and smooth: second differences hardly see it.
    """
    seen = 1.4826 * float(np.median(np.abs(np.diff(r, 2)))) / np.sqrt(6.0)
    step, span = float(np.median(np.diff(at))), float(at[-1] - at[0])
    shortest = SHORTEST * step
    low = [1e-3 * usual.level, LEAST_SLOW * _slow_usual(usual), shortest]
    most_white = max(MOST_WHITE * usual.level, SEEN_WHITE * seen)
    high = [most_white, MOST_SLOW * _slow_usual(usual), max(LONGEST * span, 2.0 * shortest)]
    return np.log(low), np.log(high)


def _starts(at: np.ndarray, r: np.ndarray, F: np.ndarray, usual: Usual) -> list[np.ndarray]:
    """Return points all over the plausible (3,): what is left behind the parameters, divided in many ways."""
    ridge = np.eye(F.shape[1]) * usual.level**2
    left = r - F @ np.linalg.solve(F.T @ F + ridge, F.T @ r)
    level = max(1.4826 * float(np.median(np.abs(left))), 0.1 * usual.level)
    low, high = _bounds(at, r, usual)
    times = np.linspace(low[2], high[2], TIMES + 2)[1:-1]
    found = []
    for ratio in RATIOS:
        for share in LEVELS:
            white = share * level / np.sqrt(1.0 + ratio**2)
            found += [np.array([np.log(white), np.log(ratio * white), time]) for time in times]
    return found
