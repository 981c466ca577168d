"""The load on one cable segment: momentum, drag and weight as vectors, with their derivatives.

A segment is straight, with the chord vector d (towards growing s), the tangent t = d/|d| and the velocity V of its
middle. With U = V − J, U_t = U·t, U_⊥ = U − U_t t and the projection P = I − t tᵀ, equation (7) is the vector balance

    ∂(T t)/∂s = ∂p/∂t + D − w_c k,     p = m V + ρA P (V − J)
    D = √(1+eT) (½ρπdC_t |U_t| U_t t + ½ρdC_n |U_⊥| U_⊥)

whose components along t, n, b are the six scalar equations of Feng & Allen (2004) as re-derived in
`docs/theory.md`. No angle appears, so no direction is singular, and a turned motion gives turned forces.

`evaluate_load` fills q = a₀ p + D − w_c k, where a₀ is the weight of the newest value in the time derivative
(`cable.differences`), and ∂q/∂V, ∂q/∂d: all that Newton's method needs from the physics.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from subzero.compiled import compiled

from .properties import CableNumbers

SMALLEST_CHORD = 1e-6
"""A chord shorter than this fraction of its segment (cable heaped up) no longer defines a direction: t fades to 0."""


class Load(NamedTuple):
    """Work space for one segment: what is known of it, its load q, and derivatives.

    Attributes:
        tangent, momentum, drag, q, across, velocity, chord: t, p, D, q, U_⊥, V and d (3,).
        q_V, q_d: ∂q/∂V and ∂q/∂d (3, 3).
        by_near, by_far: derivatives of the segment's total load Q by the position of its near node (3, 3) and by the
            unknowns of its own block (3, 4), see `cable.assembly`.
    """

    tangent: np.ndarray
    momentum: np.ndarray
    drag: np.ndarray
    q: np.ndarray
    q_V: np.ndarray
    q_d: np.ndarray
    across: np.ndarray
    velocity: np.ndarray
    chord: np.ndarray
    by_near: np.ndarray
    by_far: np.ndarray


def new_load() -> Load:
    """Return empty work space for one segment."""
    vectors = {name: np.zeros(3) for name in Load._fields}
    matrices = {"q_V": np.zeros((3, 3)), "q_d": np.zeros((3, 3))}
    return Load(**vectors | matrices | {"by_near": np.zeros((3, 3)), "by_far": np.zeros((3, 4))})


@compiled
def chord_length(d: np.ndarray, length: float) -> float:
    """Return |d|, rounded off below `SMALLEST_CHORD` of the segment's length. [m]."""
    floor = SMALLEST_CHORD * length
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + floor * floor)


@compiled
def evaluate_momentum(V: np.ndarray, J: np.ndarray, t: np.ndarray, c: CableNumbers, p: np.ndarray) -> None:
    """Fill p = m V + ρA P (V − J), the momentum per length. [kg/s]."""
    along = (V[0] - J[0]) * t[0] + (V[1] - J[1]) * t[1] + (V[2] - J[2]) * t[2]
    for i in range(3):
        p[i] = c.mass * V[i] + c.added_mass * (V[i] - J[i] - along * t[i])


@compiled
def evaluate_load(
    V: np.ndarray,
    J: np.ndarray,
    d: np.ndarray,
    length: float,
    T: float,
    a0: float,
    c: CableNumbers,
    out: Load,
) -> None:
    """Fill tangent, momentum, drag, q = a₀p + D − w_c k, and the derivatives of q by velocity V and chord d.

    Args:
        V: velocity of the segment's middle, earth axes (3,). [m/s]
        J: velocity of the water there (3,). [m/s]
        d: chord vector (3,). [m]
        length: unstretched length of the segment. [m]
        T: tension (only √(1+eT) is taken from it). [N]
        a0: weight of the newest value in the backward difference. [1/s]
        c: the cable.
        out: filled. Loads in [N/m].
    """
    r = chord_length(d, length)
    t, across = out.tangent, out.across
    for i in range(3):
        t[i] = d[i] / r
    evaluate_momentum(V, J, t, c, out.momentum)
    Ut = (V[0] - J[0]) * t[0] + (V[1] - J[1]) * t[1] + (V[2] - J[2]) * t[2]
    for i in range(3):
        across[i] = V[i] - J[i] - Ut * t[i]
    normal = sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2])
    stretch = sqrt(1.0 + c.compliance * T)
    kt, kn = stretch * c.tangential_drag, stretch * c.normal_drag
    for i in range(3):
        out.drag[i] = kt * abs(Ut) * Ut * t[i] + kn * normal * across[i]
        out.q[i] = a0 * out.momentum[i] + out.drag[i]
    out.q[2] -= c.weight
    _differentiate_load(t, across, Ut, normal, r, a0, kt, kn, c, out)


@compiled
def _differentiate_load(
    t: np.ndarray,
    across: np.ndarray,
    Ut: float,
    normal: float,
    r: float,
    a0: float,
    kt: float,
    kn: float,
    c: CableNumbers,
    out: Load,
) -> None:
    """Fill ∂q/∂V and ∂q/∂d from ∂t/∂d = P/r, ∂U_⊥/∂V = P, ∂U_⊥/∂t = −(U_t I + t Uᵀ)."""
    added = a0 * c.added_mass
    inverse = 1.0 / normal if normal > 1e-12 else 0.0
    for i in range(3):
        for k in range(3):
            P = (1.0 if i == k else 0.0) - t[i] * t[k]
            turn = t[i] * across[k]
            spread = normal * P + across[i] * across[k] * inverse
            out.q_V[i, k] = added * P + 2.0 * kt * abs(Ut) * t[i] * t[k] + kn * spread
            along = kt * abs(Ut) * (Ut * P + 2.0 * turn)
            out.q_d[i, k] = (along - kn * (Ut * spread + normal * turn) - added * (Ut * P + turn)) / r
        out.q_V[i, i] += a0 * c.mass
