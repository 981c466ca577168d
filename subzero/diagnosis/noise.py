"""The noise of a channel: white, slow, and rounded; and whitening with it.

    e_k = w_k + x(t_k) + rounding,   w ~ N(0, σ_w²),   x ~ Ornstein-Uhlenbeck(σ_s, τ_s),   rounding ~ N(0, q²/12)
    Σ_ij = (σ_w² + q²/12) δ_ij + σ_s² exp(−|t_i − t_j|/τ_s)

Σ is never made. A Kalman filter whose state is x turns e into its innovations, which are white, for any times of the
samples; AR(1) noise is the case σ_w = 0. How the five numbers are found: `noise_estimate`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

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
        columns = np.ascontiguousarray(white, dtype=float).reshape(self.count, -1)
        found = np.empty_like(columns)
        coloured(*self._filter, columns, found)
        return found.reshape(white.shape)

    def _innovations(self, known: np.ndarray) -> np.ndarray:
        columns = np.ascontiguousarray(known, dtype=float).reshape(self.count, -1)
        white = np.empty_like(columns)
        innovations(*self._filter, columns, white)
        return white.reshape(known.shape)


@compiled
def gains_of(kept, white, slow, gain, scale):
    """Fill the gain of the filter, and the standard deviation of its innovations, at every sample (m,)."""
    left = slow  # variance of the slow part before the sample is seen
    for i in range(kept.size):
        seen = left + white
        gain[i] = left / seen
        scale[i] = np.sqrt(seen)
        left = kept[i] * kept[i] * left * (1.0 - gain[i]) + slow * (1.0 - kept[i] * kept[i])


@compiled
def innovations(kept, gain, scale, values, white):
    """Fill what the values before do not tell of each value, over its standard deviation: (m, columns) → the same."""
    for j in range(values.shape[1]):
        expected = 0.0
        for i in range(values.shape[0]):
            new = values[i, j] - expected
            white[i, j] = new / scale[i]
            expected = kept[i] * (expected + gain[i] * new)


@compiled
def coloured(kept, gain, scale, white, values):
    """Fill the values that have innovations: (m, columns) → the same."""
    for j in range(white.shape[1]):
        expected = 0.0
        for i in range(white.shape[0]):
            new = white[i, j] * scale[i]
            values[i, j] = expected + new
            expected = kept[i] * (expected + gain[i] * new)
