"""Frequencies of free vibrations from samples: sums of damped sinusoids, by the matrix pencil method.

Samples y_k = Σ c_i z_iᵏ with z_i = exp((−δ_i ± iω_i) Δt) fill a Hankel matrix [y_{k+l}]; its row space is spanned by
the vectors (1, z_i, z_i², …), and moving on by one sample multiplies each by its z_i. So the z_i are eigenvalues of
the map from one such basis to the next (Hua and Sarkar, 1990).
"""

from __future__ import annotations

import numpy as np

NOISE = 1e-3
"""Share of the largest singular value below which a direction is left out: noise, and modes that hardly sound."""


def frequencies(samples: np.ndarray, interval: float) -> np.ndarray:
    """Return the angular frequencies in a vibration, lowest first. [rad/s].

    Args:
        samples: (n,) or several records of the same vibration (n, records).
        interval: time between samples, less than half of the shortest period. [s]
    """
    y = samples.reshape(samples.shape[0], -1)
    width = y.shape[0] // 3
    hankel = np.concatenate([np.lib.stride_tricks.sliding_window_view(record, width) for record in y.T])
    _, sizes, basis = np.linalg.svd(hankel, full_matrices=False)
    basis = basis[sizes > NOISE * sizes[0]].T
    poles = np.linalg.eigvals(np.linalg.lstsq(basis[:-1], basis[1:], rcond=None)[0])
    return np.sort(np.angle(poles[np.imag(poles) > 0.0])) / interval


def nearest(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return those of the frequencies `found` that are nearest to those wanted."""
    return np.array([found[np.argmin(np.abs(found - w))] for w in wanted])
