"""Momentum, drag and weight of a metre of cable at a node, and how they change with its velocity and tangent.

    p = m V + ρA P (V − J),      f = √(1+eT)(k_t |u| u t + k_n |W| W) − w_c k
    u = (V − J)·t,               W = P (V − J) = V − J − u t

With P = I − t tᵀ, C = ∂(u t)/∂t = u I + t (V − J)ᵀ and G = ∂(|W| W)/∂W = |W| I + W Wᵀ/|W|, for h = a p + f:

    ∂h/∂V = a (m I + ρA P) + 2 k_t |u| t tᵀ + k_n G P
    ∂h/∂t = −a ρA C + k_t |u| (u I + 2 t (V − J)ᵀ) − k_n G C

A node that is folded has a tangent shorter than one (`shorten`): its drag becomes the same in all directions.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from subzero.jit import Record, inner

FOLD = 0.3
"""δ in `shorten`."""
STILL = 1e-12
"""A lower speed counts as zero. [m/s]"""


class NodeLoad(Record):
    """Work space: p and f (3,), the drag in f (3,), ∂h/∂V and ∂h/∂t (3, 3), and the tangent with its slope."""

    momentum: np.ndarray = np.zeros(3)
    force: np.ndarray = np.zeros(3)
    drag: np.ndarray = np.zeros(3)
    by_velocity: np.ndarray = np.zeros((3, 3))
    by_tangent: np.ndarray = np.zeros((3, 3))
    velocity: np.ndarray = np.zeros(3)
    water: np.ndarray = np.zeros(3)
    tangent: np.ndarray = np.zeros(3)
    across: np.ndarray = np.zeros(3)
    turning: np.ndarray = np.zeros((3, 3))


@inner
def shorten(s: np.ndarray, out: NodeLoad) -> None:
    """Fill the tangent t = s/n and its slope ∂t/∂s, n² = |s|² + δ²(1 − |s|²)² where |s| < 1, else |s|².

    s is the mean of the chords per unstretched length on both sides: one for a straight taut cable, zero for a fold.
    """
    square = s[0] * s[0] + s[1] * s[1] + s[2] * s[2]
    missing = max(1.0 - square, 0.0)
    n = sqrt(square + (FOLD * missing) ** 2)
    g = 1.0 - 2.0 * FOLD * FOLD * missing
    for i in range(3):
        out.tangent[i] = s[i] / n
    for i in range(3):
        for k in range(3):
            out.turning[i, k] = ((1.0 if i == k else 0.0) - g * out.tangent[i] * out.tangent[k]) / n


@inner
def evaluate_node(
    m: float, added: float, weight: float, kt: float, kn: float, a: float, out: NodeLoad
) -> None:
    """Fill p, f, ∂h/∂V and ∂h/∂t from out.velocity, out.water and out.tangent.

    Args:
        m: mass. [kg/m]
        added: ρA. [kg/m]
        weight: w_c. [N/m]
        kt: drag constant along the cable, with √(1+eT). [N s²/m³]
        kn: and across it. [N s²/m³]
        a: weight of p in h. [1/s]
        out: filled.
    """
    t, V, J, W = out.tangent, out.velocity, out.water, out.across
    u = (V[0] - J[0]) * t[0] + (V[1] - J[1]) * t[1] + (V[2] - J[2]) * t[2]
    for i in range(3):
        W[i] = V[i] - J[i] - u * t[i]
    size = sqrt(W[0] * W[0] + W[1] * W[1] + W[2] * W[2])
    bend = kn / size if size > STILL else 0.0
    Wt = W[0] * t[0] + W[1] * t[1] + W[2] * t[2]
    for i in range(3):
        out.momentum[i] = m * V[i] + added * W[i]
        out.drag[i] = kt * abs(u) * u * t[i] + kn * size * W[i]
        out.force[i] = out.drag[i] - (weight if i == 2 else 0.0)
        Gt = kn * size * t[i] + bend * W[i] * Wt
        for k in range(3):
            same = 1.0 if i == k else 0.0
            U = V[k] - J[k]
            G = kn * size * same + bend * W[i] * W[k]
            C = u * same + t[i] * U
            P = same - t[i] * t[k]
            out.by_velocity[i, k] = (
                a * (m * same + added * P) + 2.0 * kt * abs(u) * t[i] * t[k] + G - Gt * t[k]
            )
            out.by_tangent[i, k] = kt * abs(u) * (C + t[i] * U) - a * added * C - u * G - Gt * U
