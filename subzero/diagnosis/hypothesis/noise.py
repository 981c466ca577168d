"""The noise of a channel: a white part, a slow part and rounding; whitening with it, and its prior.

    e_k = w_k + x(t_k) + rounding,   w ~ N(0, σ_w²),   x ~ Ornstein-Uhlenbeck(σ_s, τ_s),   rounding ~ N(0, q²/12)
    Σ_ij = (σ_w² + q²/12) δ_ij + σ_s² exp(−|t_i − t_j|/τ_s)

Σ is never formed. A Kalman filter with the state x turns e into its innovations, which are white, for any times of
the samples; AR(1) noise is the case σ_w = 0. The prior, before any fit, and the estimate behind a fit are those of
`subzero.identification.noise`; q is read off the values: sensors round.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.identification import noise as general
from subzero.identification.noise import NoisePrior, innovations
from subzero.identification.noise import gains as gains_of
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
        kept, gain, scale = np.empty(self.count), np.empty(self.count), np.empty(self.count)
        gains_of(self.time, self.correlation_time, self.unrelated, self.slow**2, kept, gain, scale)
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


KNOWN_SPREAD, USUAL_SPREAD = 0.1, 0.7
"""Standard deviation of the logarithm of a level that the user knows, and of that of a usual sensor. [-]"""
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


NOT_KNOWN: Mapping[str, float] = MappingProxyType({})
"""Default for the steps of channels: all are read off the values."""


def level_of(channel: str, known: Mapping[str, float]) -> float:
    """Return the level ν of a channel's sensor, as known or usual, in the channel's unit."""
    return known.get(channel, SPECS[channel].noise)


def sensor_prior(
    channel: str,
    time: np.ndarray,
    values: np.ndarray,
    known: Mapping[str, float],
    steps: Mapping[str, float] = NOT_KNOWN,
) -> NoisePrior:
    """Return the prior of a channel's sensor, before any fit: its level as known or usual, its resolution as read off
    its values (n,), or off more of them before: channel → step.
    """
    step = step_of(channel, values, known, steps)
    return prior_of(level_of(channel, known), step, time, is_known=channel in known)


def step_of(
    channel: str, values: np.ndarray, known: Mapping[str, float], steps: Mapping[str, float]
) -> float:
    """Return the step between values of a channel (n,), as known or as they show it."""
    return steps[channel] if channel in steps else resolution_of(values, level_of(channel, known))


def prior_of(level: float, resolution: float, time: np.ndarray, *, is_known: bool) -> NoisePrior:
    """Return the prior of a sensor of some level and resolution that is sampled at times (n,). [s]"""
    interval = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    return NoisePrior(level, resolution, interval, KNOWN_SPREAD if is_known else USUAL_SPREAD)


def as_noise(noise: general.Noise, prior: NoisePrior, time: np.ndarray, used: np.ndarray) -> Noise:
    """Return a noise of samples at times (n,) [s], of which some are used (n,)."""
    return Noise(
        white=noise.white,
        slow=noise.slow,
        correlation_time=noise.time,
        resolution=prior.resolution,
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
