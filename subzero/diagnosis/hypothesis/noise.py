"""The noise of a channel: a white part, a slow part and rounding; whitening with it, and its prior.

    e_k = w_k + x(t_k) + rounding,   w ~ N(0, σ_w²),   x ~ Ornstein-Uhlenbeck(σ_s, τ_s),   rounding ~ N(0, q²/12)
    Σ_ij = (σ_w² + q²/12) δ_ij + σ_s² exp(−|t_i − t_j|/τ_s)

Σ is never formed. A Kalman filter with the state x turns e into its innovations, which are white, for any times of
the samples; AR(1) noise is the case σ_w = 0. The prior, before any fit, is

    log σ_w ~ N(log ν, 1.5²),   log σ_s ~ N(log(0.7 ν + q/√12), 1² or 0.5²),   log τ_s ~ N(log 1 s, 1.5²)

ν is the usual level of the sensor, or the known one; the standard deviation of log σ_s is 0.5 above its median and 1
below. q is read off the values: sensors round. Where n other channels of a record have a visible slow part, log τ_s
has a Student t distribution about the log of their median, with 2 + n degrees of freedom and the scale of their times
(as of a normal distribution with unknown variance): s² = (2 · 0.9² + Σ (log τ_i − log median)²) / (2 + n).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.identification.noise import gains as gains_of
from subzero.identification.noise import innovations
from subzero.jit import compiled, scratch


@dataclass(frozen=True, kw_only=True, eq=False)
class Noise:
    """The noise of a channel of a record.

    Attributes:
        white: σ_w, standard deviation of the part that is independent from sample to sample. [unit of the channel]
        slow: σ_s, standard deviation of the slow part. [unit of the channel]
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
        """Variance of the part that is independent of the samples before: σ_w² + q²/12."""
        return self.white**2 + self.resolution**2 / 12.0

    @property
    def lasting(self) -> float:
        """The spectral density at low frequencies: 2 σ_s² τ_s, and that of the white parts, σ_w² + q²/12 times the
        step.
        """
        step = float(np.median(np.diff(self.time))) if self.count > 1 else 1.0
        return 2.0 * self.slow**2 * self.correlation_time + self.unrelated * step

    @property
    def count(self) -> int:
        """How many samples are used, m."""
        return int(self.time.size)

    def sd_of_mean(self, samples: int, span: float) -> float:
        """Return the standard deviation of the mean of samples that are evenly spread over a span [s]."""
        x = max(span, 1e-9) / self.correlation_time
        # Variance of the mean of the slow part over the span, over σ_s²; its limit for x → 0, where the formula loses
        # its digits, is 1.
        lasting = 2.0 * (x - 1.0 + np.exp(-x)) / x**2 if x > 1e-3 else 1.0
        return float(np.sqrt(self.unrelated / max(samples, 1) + self.slow**2 * lasting))

    @cached_property
    def filter(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The decay of the slow part to the next sample, the Kalman gain, and the innovations' standard deviation
        (m,).
        """
        # The last step is 0: there is no next sample, and that decay is not used.
        kept = np.exp(-np.diff(self.time, append=self.time[-1:]) / self.correlation_time)
        gain, scale = np.empty(self.count), np.empty(self.count)
        gains_of(kept, self.unrelated, self.slow**2, gain, scale)
        return kept, gain, scale

    @property
    def log_scale(self) -> float:
        """½ log det Σ over the used samples."""
        return float(np.sum(np.log(self.filter[2])))

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """Return values with their noise whitened, of level 1: (n,) or (n, columns) → those of the used samples (m,
        …).
        """
        return self._innovations(values[self.used])

    def whiten_again(self, white: np.ndarray, before: Noise) -> np.ndarray:
        """Return values (m, …) that are whitened with another noise of the same samples, whitened with this one."""
        # Both are recursions of order m: no covariance is formed.
        return self._innovations(before.colour(white))

    def colour(self, white: np.ndarray) -> np.ndarray:
        """Undo `whiten`, but for samples that are not used: (m,) or (m, columns) → the same shape."""
        columns = _as_columns(white)
        found = np.empty_like(columns)
        coloured(*self.filter, columns, found)
        return found.reshape(white.shape)

    def _innovations(self, known: np.ndarray) -> np.ndarray:
        columns = _as_columns(known)
        white = np.empty_like(columns)
        innovations(*self.filter, columns, white)
        return white.reshape(known.shape)


def _as_columns(values: np.ndarray) -> np.ndarray:
    """Return values (m,) as one column, or columns (m, k) as they are; m may be 0."""
    values = np.ascontiguousarray(values, dtype=float)
    return values[:, None] if values.ndim == 1 else values


@compiled
def innovations_of_each(
    ends: np.ndarray,
    kept: np.ndarray,
    gain: np.ndarray,
    scale: np.ndarray,
    values: np.ndarray,
    white: np.ndarray,
) -> None:
    """Fill the same for the values of several channels, one after the other (m,): each ends where the next begins,
    and the first begins at the first of the ends (channels + 1,).
    """
    for k in range(ends.size - 1):
        expected = 0.0
        for i in range(ends[k], ends[k + 1]):
            new = values[i] - expected
            white[i] = new / scale[i]
            expected = kept[i] * (expected + gain[i] * new)


@compiled
def coloured(
    kept: np.ndarray, gain: np.ndarray, scale: np.ndarray, white: np.ndarray, values: np.ndarray
) -> None:
    """Fill the values with given innovations: (m, columns) → the same."""
    for j in range(white.shape[1]):
        expected = 0.0
        for i in range(white.shape[0]):
            new = white[i, j] * scale[i]
            values[i, j] = expected + new
            expected = kept[i] * (expected + gain[i] * new)


SLOW_SHARE = 0.7
"""Usual standard deviation of a sensor's slow part, in its usual noise levels. [-]"""
WHITE_SPREAD, SLOW_SPREAD, SLOW_SPREAD_ABOVE, TIME_SPREAD = 1.5, 1.0, 0.5, 1.5
"""Standard deviations of the logarithms of σ_w, σ_s and τ_s about the usual values, of σ_s below and above: a sensor
may wander by far less than usual, but a far larger wander is an effect to be found. [-]
"""
USUAL_TIME = 1.0
"""Usual correlation time of a sensor's slow part. [s]"""
TIME_SPREAD_OF_OTHERS, SPREAD_WEIGHT, FEWEST_CHANNELS, SEEN_SLOW = 0.9, 2, 2, 0.3
"""Prior standard deviation of log τ_s about the median of other channels; its weight, in channels; and the condition
for it: so many others have a slow part of at least this share of σ_w. Channels of a record share a logger, and often
a filter; how similar they are is estimated, too. [-]
"""
KNOWN_SPREAD = 0.1
"""Standard deviation of the logarithm of a level that the user knows. [-]"""
FEWEST = 8
"""From fewer different values than this no step of rounding is inferred."""
WHOLE, MOSTLY, FEW_WRONG = 0.02, 0.98, 0.25
"""A step between values counts as a multiple if it is whole within the first share; the second is the share of
multiples among rounded values; the last is the largest share of other steps from the most common value. [-]
"""
EXACT = 0.05
"""... and within this share of a usual level: else a value far from all others would be about one step from each of
them. [-]
"""
SAME, STEPS_TRIED = 1e-6, 3
"""Changes of less than this share of a usual level are rounding errors of 0 [-]; a jump by a fraction of a step makes
one or two differences smaller than the step of the sensor: so many are tried.
"""


class CorrelationTimes(NamedTuple):
    """Correlation times of the noise of the other channels: their median [s], the scale of a logarithm about that of
    the median [-], and the degrees of freedom of this scale.
    """

    median: float
    spread: float
    freedom: float


class SensorPrior(NamedTuple):
    """The prior of a sensor: level ν and resolution q, in the channel's unit, whether the level is known, and the
    correlation times of the other sensors, None if too few are known.
    """

    level: float
    resolution: float
    is_known: bool
    correlation_times_of: CorrelationTimes | None = None


NOT_KNOWN: Mapping[str, float] = MappingProxyType({})
"""Default for the steps of channels: all are read off the values."""


def level_of(channel: str, known: Mapping[str, float]) -> float:
    """Return the level ν of a channel's sensor, as known or usual, in the channel's unit."""
    return known.get(channel, SPECS[channel].noise)


def sensor_prior(
    channel: str, values: np.ndarray, known: Mapping[str, float], steps: Mapping[str, float] = NOT_KNOWN
) -> SensorPrior:
    """Return the prior of a channel's sensor, before any fit: its level as known or usual, its resolution as read off
    its values (n,), or off more of them before: channel → step.
    """
    level = level_of(channel, known)
    step = steps[channel] if channel in steps else resolution_of(values, level)
    return SensorPrior(level, step, channel in known)


def prior_noise(time: np.ndarray, used: np.ndarray, usual: SensorPrior) -> Noise:
    """Return the noise of a usual sensor, before any fit.

    Args:
        time: of the samples (n,). [s]
        used: which of them are used (n,).
        usual: the prior of the sensor.
    """
    # A known level is that of both parts together, in their usual ratio; the usual level is that of the white part.
    slow = usual.level if usual.is_known else slow_usual(usual)
    share = SLOW_SHARE / np.sqrt(1.0 + SLOW_SHARE**2) if usual.is_known else 1.0
    white = np.sqrt(max(1.0 - share**2, 0.0)) * usual.level if usual.is_known else usual.level
    return Noise(
        white=float(white),
        slow=float(share * slow),
        correlation_time=USUAL_TIME,
        resolution=usual.resolution,
        used=used,
        time=time[used],
    )


def resolution_of(values: np.ndarray, level: float) -> float:
    """Return the step that all values are multiples of, NaN left out; 0 where there is none.

    A sensor that rounds to 0.1 m shows 5.1, 5.2 and 5.4, and the steps between its different values are whole
    multiples of the smallest. So are its changes from sample to sample, even if it once jumps by a fraction of a
    step: of these two steps the coarser is that of the sensor. A channel that hardly ever leaves a value differs from
    it by whole steps, but for a few wrong samples. The step of a channel that shows one value throughout is unknown;
    it is assumed to be as coarse as the noise of a usual sensor, `level`.
    """
    known = values[np.isfinite(values)]
    ordered = np.sort(known)
    # The first of each run of equal values, as of `np.unique`; the slice is for a channel without any value.
    first = np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]])[: known.size])
    distinct, times = ordered[first], np.diff(first, append=known.size)
    # One value throughout: q/√12, the standard deviation of its rounding, is set to the level.
    if distinct.size == 1 and known.size >= FEWEST:
        return float(np.sqrt(12.0) * level)
    changes = np.abs(known[1:] - known[:-1])
    changes, exact = changes[changes > SAME * level], EXACT * level
    by_change = whole_step(changes, exact, _few_of(changes)) if changes.size >= FEWEST else 0.0
    # Few values, hardly any of them repeated, may be multiples of a step by chance.
    if distinct.size < 2 or (distinct.size < FEWEST and 2 * distinct.size > known.size):
        return by_change
    # A channel that hardly ever leaves a value: its steps from that value.
    away = np.abs(known - distinct[np.argmax(times)])
    away = away[away > SAME * level]
    few, between = min((1.0 - MOSTLY) * known.size, FEW_WRONG * away.size), distinct[1:] - distinct[:-1]
    return max(by_change, whole_step(between, exact, _few_of(between)), whole_step(away, exact, few))


def _few_of(steps: np.ndarray) -> float:
    """Return how many of some steps may be no multiples: a small share, at least one."""
    return max(1.0, (1.0 - MOSTLY) * steps.size)


@compiled
def whole_step(steps: np.ndarray, exact: float, most: float) -> float:
    """Return the smallest of the STEPS_TRIED least steps (n,) of which all steps but `most` are multiples, to within
    a share of it and `exact`; 0 if there is none. Steps that agree to six digits count as one.
    """
    least = np.inf
    for i in range(steps.size):
        least = min(least, steps[i])
    ratio = 0.0
    for _ in range(STEPS_TRIED):
        # The least step may be a fraction of the sensor's (a jump), so larger ones are tried, too.
        ratio = _next_ratio(steps, least, ratio)
        if ratio == np.inf:
            return 0.0
        if _are_multiples(steps, ratio * least, min(WHOLE * ratio * least, exact), most):
            return ratio * least
    return 0.0


@compiled
def _next_ratio(steps: np.ndarray, least: float, before: float) -> float:
    """Return the least ratio of steps (n,) to the least of them, to six digits, that exceeds `before`."""
    found = np.inf
    for i in range(steps.size):
        ratio = steps[i] / least
        if before < ratio < found:
            # Steps that differ only by errors of arithmetic become one ratio.
            ratio = np.rint(ratio * 1e6) / 1e6
            if before < ratio < found:
                found = ratio
    return found


@compiled
def _are_multiples(steps: np.ndarray, step: float, near: float, most: float) -> bool:
    """Say whether all but `most` steps (n,) are multiples of one step."""
    off = 0
    for i in range(steps.size):
        if abs(steps[i] - step * np.rint(steps[i] / step)) >= near:
            off += 1
            if off > most:
                return False
    return True


def slow_usual(usual: SensorPrior) -> float:
    """Return σ_s of a usual sensor, with the standard deviation of its rounding added."""
    return SLOW_SHARE * usual.level + usual.resolution / np.sqrt(12.0)


def correlation_times_of(noise: Mapping[str, Noise]) -> dict[str, CorrelationTimes]:
    """Return the distribution of the other channels' correlation times for each channel; channels for which too few
    others have a slow part are left out.
    """
    slow = {
        name: each.correlation_time
        for name, each in noise.items()
        if each.slow**2 >= SEEN_SLOW**2 * each.unrelated
    }
    # Without the channel itself: its own time must not be a part of its prior.
    others = {name: np.log([time for other, time in slow.items() if other != name]) for name in noise}
    return {name: _about_their_median(logs) for name, logs in others.items() if logs.size >= FEWEST_CHANNELS}


def _about_their_median(logs: np.ndarray) -> CorrelationTimes:
    """Return the distribution of a further correlation time, given logarithms of others (n,)."""
    median, freedom = float(np.median(logs)), SPREAD_WEIGHT + logs.size
    variance = (SPREAD_WEIGHT * TIME_SPREAD_OF_OTHERS**2 + float(np.sum((logs - median) ** 2))) / freedom
    return CorrelationTimes(float(np.exp(median)), float(np.sqrt(variance)), float(freedom))


class Prior(NamedTuple):
    """The prior of log σ_w, log σ_s, log τ_s: means, and standard deviations below and above (3,); the degrees of
    freedom of the last, infinite for a normal distribution; the mean of the logarithm of the level, NaN if the level
    is not known; and the log density at the means, up to a constant that all noises share.
    """

    mean: np.ndarray
    below: np.ndarray
    above: np.ndarray
    freedom: float
    level: float
    most: float


def prior_of(usual: SensorPrior) -> Prior:
    """Return the prior of a usual sensor's noise."""
    time, spread, freedom = usual.correlation_times_of or (USUAL_TIME, TIME_SPREAD, np.inf)
    mean = np.log([usual.level, slow_usual(usual), time])
    below, above = (np.array([WHITE_SPREAD, each, spread]) for each in (SLOW_SPREAD, SLOW_SPREAD_ABOVE))
    level = float(mean[0]) if usual.is_known else np.nan
    # Normalised, so that noises under priors with and without other channels can be compared.
    most = float(np.log(TIME_SPREAD / spread)) + _log_height(freedom)
    return Prior(mean, below, above, freedom, level, most)


def _log_height(freedom: float) -> float:
    """Return the log density of a Student t at its centre, over that of a normal distribution of the same scale."""
    if np.isinf(freedom):
        return 0.0
    half = 0.5 * freedom
    return float(gammaln(half + 0.5) - gammaln(half) - 0.5 * np.log(half))


@compiled
def log_density(log: np.ndarray, prior: Prior) -> float:
    """Return the log density of log σ_w, log σ_s, log τ_s (3,), up to a constant."""
    about = 0.0
    for i in range(3):
        apart = log[i] - prior.mean[i]
        # A split normal distribution: its spread differs below and above the mean.
        square = (apart / (prior.above[i] if apart > 0.0 else prior.below[i])) ** 2
        # Only log τ_s may have a Student t distribution, with heavier tails.
        far = i == 2 and prior.freedom < np.inf
        about += (prior.freedom + 1.0) * np.log1p(square / prior.freedom) if far else square
    # Not NaN: the level is known, and both parts together have to agree with it.
    if prior.level == prior.level:
        level = 0.5 * np.log(np.exp(2.0 * log[0]) + np.exp(2.0 * log[1]))
        about += ((level - prior.level) / KNOWN_SPREAD) ** 2
    return prior.most - 0.5 * about


SPIKE = 5.0
"""A sample this many noise levels off the median of its neighbours is an outlier. [-]"""


NORMAL_MIDDLE, TAIL, NORMAL_TAIL = 0.6745, 0.85, 1.4395
"""The level of noise is the larger of two estimates: the median of all deviations, and their quantile at this share,
each over that of a normal distribution: noise of a real sensor may have tails of a tenth of its samples, which are no
outliers. [-]
"""


def spikes(values: np.ndarray, spec: float) -> np.ndarray:
    """Say which samples are isolated, far from the median of seven around them; at the ends, of the first or last
    five.

    A record mirrored at its ends would show an outlier there twice, and two of them as a majority.

    Args:
        values: measured − simulated (m,), in the channel's unit.
        spec: the least plausible level of the sensor's noise.
    """
    if values.size < 7:
        return np.zeros(values.size, dtype=bool)
    around = np.empty(values.size)
    medians_around(values, around)
    off = np.sort(np.abs(values - around))
    middle = 0.5 * float(off[(off.size - 1) // 2] + off[off.size // 2])  # the median
    usual = max(middle / NORMAL_MIDDLE, float(off[int(TAIL * off.size)]) / NORMAL_TAIL)
    return np.abs(values - around) > SPIKE * max(1.2 * usual, 0.5 * spec)


@compiled
def medians_around(values: np.ndarray, around: np.ndarray) -> None:
    """Fill the median of the seven values around each; of the first and the last three that of five (m,)."""
    last = values.size - 3
    for i in range(3, last):
        around[i] = _median_of(values, i - 3, 7)
    for i in range(3):
        around[i] = _median_of(values, 0, 5)
        around[last + i] = _median_of(values, values.size - 5, 5)


@compiled
def _median_of(values: np.ndarray, first: int, count: int) -> float:
    """Return the median of `count` values, an odd number up to seven, from `first` on."""
    # Insertion sort in an array on the stack: there are seven values at most.
    row = scratch(1, 7)[0]
    for k in range(count):
        at = k
        while at > 0 and row[at - 1] > values[first + k]:
            row[at] = row[at - 1]
            at -= 1
        row[at] = values[first + k]
    return row[count // 2]
