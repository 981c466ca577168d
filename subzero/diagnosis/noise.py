"""The noise of a channel, from the data alone: level, colour, outliers, gaps; and whitening with it.

What is left of (measured − simulated) behind a smooth curve is noise. The curve takes part of the noise with it: the
moments that it leaves of AR(1) noise are known exactly, so level and colour are those whose moments are met. A noise
level from the fit of a physical model would be inflated by what that model gets wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

KNOTS = 1.2
"""Spacing of the smooth curve's knots. [s]"""
SPIKE = 5.0
"""A sample this many noise levels off the median of its neighbours is an outlier."""
RHO = np.linspace(0.0, 0.97, 50)
LEAST = 20
"""With fewer samples the noise is taken from the sensor's specification."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Noise:
    """The noise of a channel of a record: e_k = ρ^Δ e_{k−1} + …, Δ in samples.

    Attributes:
        sd: level, in the channel's unit.
        rho: correlation from sample to sample.
        used: which samples are used: measured, and no outliers (n,).
        gap: samples between a used one and the used one before it (m,).
    """

    sd: float
    rho: float
    used: np.ndarray
    gap: np.ndarray

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """Return what makes the noise white, of level 1: values (n,) or (n, columns) → of the used samples (m, …)."""
        known = values[self.used]
        kept = self.rho**self.gap
        kept[0] = 0.0
        shape = (-1,) + (1,) * (known.ndim - 1)
        before = np.concatenate([known[:1], known[:-1]])
        scale = self.sd * np.sqrt(1.0 - kept**2)
        return (known - kept.reshape(shape) * before) / scale.reshape(shape)


def estimate(time: np.ndarray, difference: np.ndarray, spec: float, known: float | None = None) -> Noise:
    """Return the noise of a channel.

    Args:
        time: of the samples (n,). [s]
        difference: measured − simulated (n,), NaN in gaps.
        spec: the level of a usual sensor of this kind, for short records.
        known: the level, if the user knows it.
    """
    measured = np.isfinite(difference)
    used = measured.copy()
    used[measured] = ~spikes(difference[measured], spec)
    at = np.flatnonzero(used)
    step = float(np.median(np.diff(time)))
    gap = np.diff(time[at], prepend=time[at[0]] - step) / step
    sd, rho = (spec, 0.5) if at.size < LEAST else _moments(time[at], difference[at], step)
    return Noise(sd=known or max(sd, 1e-3 * spec), rho=rho, used=used, gap=gap)


def spikes(values: np.ndarray, spec: float) -> np.ndarray:
    """Say which samples stand alone, far from the median of seven around them; at the ends, of the first or last five.

    A record mirrored at its ends would show an outlier there twice, and two of them as a majority.
    """
    if values.size < 7:
        return np.zeros(values.size, dtype=bool)
    inside = np.median(np.lib.stride_tricks.sliding_window_view(values, 7), axis=1)
    first, last = np.median(values[:5]), np.median(values[-5:])
    around = np.concatenate([np.full(3, first), inside, np.full(3, last)])
    off = np.abs(values - around)
    level = max(1.4826 * float(np.median(off)) * 1.2, 0.5 * spec)
    return off > SPIKE * level


def _moments(time: np.ndarray, values: np.ndarray, step: float) -> tuple[float, float]:
    """Return level and colour from the mean square and the lag-one product behind the smooth curve, without the
    samples where the curve itself does not follow.
    """
    rest, expected_square, expected_product = _behind(
        tuple(np.round(time / step * 16).astype(int).tolist()), step / 16.0
    )
    left = rest @ values
    level = 1.4826 * np.median(np.abs(left))
    calm = np.abs(left) < 3.5 * level
    both = calm[1:] & calm[:-1]
    square, product = np.mean(left[calm] ** 2), np.mean(left[1:][both] * left[:-1][both])
    ratio = expected_product / expected_square
    rho = float(np.interp(product / square, ratio, RHO))
    return float(np.sqrt(square / np.interp(rho, RHO, expected_square))), rho


@lru_cache(maxsize=64)
def _behind(ticks: tuple[int, ...], tick: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what leaves a smooth curve's rest (m, m), and what it leaves of AR(1) noise of level 1, for RHO.

    With Q the curve's basis, orthonormal, C the noise's covariance and T = C Q:
    (I − QQᵀ) C (I − QQᵀ) = C − Q Tᵀ − T Qᵀ + Q (Qᵀ T) Qᵀ, of which only two diagonals are needed.
    """
    time = np.array(ticks) * tick
    Q = np.linalg.qr(_splines(time))[0]
    gap = np.diff(time) / np.median(np.diff(time))
    kept = RHO ** gap[:, None]
    T = _coloured(Q, kept)
    flat = Q.T @ T.reshape(Q.shape[0], -1)
    S = flat.reshape(Q.shape[1], RHO.size, Q.shape[1]).transpose(1, 0, 2)
    own = T @ Q[:, :, None]
    twice = (Q @ S).transpose(1, 0, 2)
    square = np.mean(1.0 - 2.0 * own[..., 0] + (twice @ Q[:, :, None])[..., 0], axis=0)
    across = (T[1:] @ Q[:-1, :, None] + T[:-1] @ Q[1:, :, None] - twice[:-1] @ Q[1:, :, None])[..., 0]
    product = np.mean(kept - across, axis=0)
    return np.eye(time.size) - Q @ Q.T, square, product


def _coloured(Q: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return C Q (m, levels of colour, functions) for C_ij = Π kept between i and j, by one pass each way."""
    ahead = np.repeat(Q[:, None, :], kept.shape[1], axis=1)
    behind = ahead.copy()
    for i in range(1, Q.shape[0]):
        ahead[i] += kept[i - 1, :, None] * ahead[i - 1]
        behind[-1 - i] += kept[-i, :, None] * behind[-i]
    return ahead + behind - Q[:, None, :]


def _splines(time: np.ndarray) -> np.ndarray:
    """Return cubic B-splines with knots every KNOTS seconds at times (m, functions)."""
    from scipy.interpolate import BSpline

    inner = np.linspace(time[0], time[-1], max(2, round((time[-1] - time[0]) / KNOTS)) + 1)
    knots = np.concatenate([np.repeat(inner[0], 3), inner, np.repeat(inner[-1], 3)])
    basis = BSpline.design_matrix(np.clip(time, inner[0], inner[-1] - 1e-9), knots, 3).toarray()
    return basis[:, np.any(basis != 0.0, axis=0)]
