"""The load on one cable segment: momentum, drag and weight as vectors, with their derivatives.

A segment is straight, with the chord vector d (towards growing s), the tangent t = d/|d| and the velocity V of its
middle. With U = V − J, U_t = U·t, U_⊥ = U − U_t t and the projection P = I − t tᵀ, equation (7) is the vector balance

    ∂(T t)/∂s = ∂p/∂t + D − w_c k,     p = m V + ρA P (V − J)
    D = √(1+eT) (½ρπdC_t |U_t| U_t t + ½ρdC_n |U_⊥| U_⊥)

whose components along t, n, b are the six scalar equations of Feng & Allen (2004) as re-derived in
`docs/theory.md`. No angle appears, so no direction is singular, and a turned motion gives turned forces.

`evaluate_load` fills q = a₀ p + D − w_c k, where a₀ is the weight of the newest value in the time derivative
(`bdf2`), and `differentiate_load` ∂q/∂V and ∂q/∂d: all that Newton's method needs from the physics.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from cable.moving_end.slack_law import chord_length, turning_rate
from cable.moving_end.state import NOW, Line
from cable.properties import CableNumbers
from subzero.jit import Record, inlined, inner


class Load(Record):
    """Work space for one segment: what is known of it, its load q, and derivatives.

    Attributes:
        velocity, water, chord: V of the segment's middle, J there, and d (3,).
        tangent, momentum, drag, q, across: t, p, D, q and U_⊥ (3,).
        along, side, chord_length: U_t, |U_⊥| and r.
        kt, kn: drag constants with stretch and correction.
        q_V, q_d: ∂q/∂V and ∂q/∂d (3, 3).
        q_tt, G: (∂q/∂t) t (3,) and G (3, 3), see `differentiate_load`.
        by_near, by_far: derivatives of the segment's total load Q by the position of its near node (3, 3) and by the
            unknowns of its own block (3, 4), see `assembly`.
    """

    velocity: np.ndarray
    water: np.ndarray
    chord: np.ndarray
    tangent: np.ndarray
    momentum: np.ndarray
    drag: np.ndarray
    q: np.ndarray
    across: np.ndarray
    along: float
    side: float
    chord_length: float
    kt: float
    kn: float
    q_V: np.ndarray
    q_d: np.ndarray
    q_tt: np.ndarray
    G: np.ndarray
    by_near: np.ndarray
    by_far: np.ndarray


def new_load() -> Load:
    """Return empty work space for one segment."""
    parts: dict[str, Any] = {name: np.zeros(3) for name in Load.names}
    parts |= {name: np.zeros((3, 3)) for name in ("q_V", "q_d", "G", "by_near")}
    parts |= dict.fromkeys(("along", "side", "chord_length", "kt", "kn"), 0.0)
    return Load(**parts | {"by_far": np.zeros((3, 4))})


@inlined
def evaluate_momentum(c: CableNumbers, work: Load) -> None:
    """Fill p = m V + ρA P (V − J), the momentum per length, from velocity, water and tangent. [kg/s]."""
    V, J, t = work.velocity, work.water, work.tangent
    along = (V[0] - J[0]) * t[0] + (V[1] - J[1]) * t[1] + (V[2] - J[2]) * t[2]
    for i in range(3):
        work.momentum[i] = c.mass * V[i] + c.added_mass * (V[i] - J[i] - along * t[i])


@inlined
def evaluate_load(
    length: float, T: float, slip: float, gain: float, a0: float, c: CableNumbers, work: Load
) -> None:
    """Fill tangent, momentum, drag and q = a₀p + D − w_c k from velocity, water and chord. [N/m].

    Args:
        length: unstretched length of the segment. [m]
        T: tension (only √(1+eT) is taken from it). [N]
        slip: added to the speed along the chord, see `chord_correction`. [m/s]
        gain: on the normal drag, see `chord_correction`. [-]
        a0: weight of the newest value in the backward difference. [1/s]
        c: the cable.
        work: filled.
    """
    V, J, t, across = work.velocity, work.water, work.tangent, work.across
    r = chord_length(work.chord, length)
    work.chord_length, shorter = r, 1.0 / r
    for i in range(3):
        t[i] = work.chord[i] * shorter
    evaluate_momentum(c, work)
    Ut = (V[0] - J[0]) * t[0] + (V[1] - J[1]) * t[1] + (V[2] - J[2]) * t[2]
    for i in range(3):
        across[i] = V[i] - J[i] - Ut * t[i]
    normal = sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2])
    stretch = sqrt(1.0 + c.compliance * T)
    kt, kn = stretch * c.tangential_drag, gain * stretch * c.normal_drag
    for i in range(3):
        work.drag[i] = kt * abs(Ut + slip) * (Ut + slip) * t[i] + kn * normal * across[i]
        work.q[i] = a0 * work.momentum[i] + work.drag[i]
    work.q[2] -= c.weight
    work.along, work.side, work.kt, work.kn = Ut, normal, kt, kn


@inner
def differentiate_load(length: float, slip: float, a0: float, c: CableNumbers, work: Load) -> None:
    """Fill ∂q/∂V and ∂q/∂d of what `evaluate_load` has filled.

    With C = ∂(U_t t)/∂t = t Uᵀ + U_t I = −∂U_⊥/∂t, G = |U_⊥| I + U_⊥ U_⊥ᵀ/|U_⊥| and ∂t/∂d = (I − g t tᵀ)/r:

        ∂q/∂V = a₀(m I + ρA P) + 2 k_t |W| t tᵀ + k_n G P
        ∂q/∂t = −a₀ρA C + k_t |W| (W I + 2 t Uᵀ) − k_n G C,     W = U_t + slip
    """
    V, J, t, across, G = work.velocity, work.water, work.tangent, work.across, work.G
    Ut, normal, r, kt, kn = work.along, work.side, work.chord_length, work.kt, work.kn
    g = turning_rate(work.chord, length)
    inverse = 1.0 / normal if normal > 1e-12 else 0.0
    along, shorter = abs(Ut + slip), 1.0 / r
    for i in range(3):
        for k in range(3):
            G[i, k] = across[i] * across[k] * inverse
        G[i, i] += normal
    for i in range(3):
        Gt = G[i, 0] * t[0] + G[i, 1] * t[1] + G[i, 2] * t[2]
        work.q_tt[i] = 0.0
        for k in range(3):
            P = (1.0 if i == k else 0.0) - t[i] * t[k]
            outer = t[i] * (V[k] - J[k])
            C = outer + (Ut if i == k else 0.0)
            GC = Gt * (V[k] - J[k]) + Ut * G[i, k]
            work.q_V[i, k] = a0 * c.added_mass * P + 2.0 * kt * along * t[i] * t[k]
            work.q_V[i, k] += kn * (G[i, k] - Gt * t[k])
            pull = 2.0 * outer + (Ut + slip if i == k else 0.0)
            work.q_d[i, k] = kt * along * pull - kn * GC - a0 * c.added_mass * C
            work.q_tt[i] += work.q_d[i, k] * t[k]
        for k in range(3):
            work.q_d[i, k] = (work.q_d[i, k] - g * work.q_tt[i] * t[k]) * shorter
        work.q_V[i, i] += a0 * c.mass


@inlined
def take_segment(x: np.ndarray, V: np.ndarray, J: np.ndarray, j: int, work: Load) -> None:
    """Fill chord, velocity and water of segment j, given those of the nodes at one level (nodes, 3)."""
    for i in range(3):
        work.chord[i] = x[j, i] - x[j - 1, i]
        work.velocity[i] = 0.5 * (V[j - 1, i] + V[j, i])
        work.water[i] = 0.5 * (J[j - 1, i] + J[j, i])


@inner
def segment_momentum(line: Line, level: int, j: int, length: float, c: CableNumbers, work: Load) -> None:
    """Fill ∫p ds of segment j at a level; the tangent is the one of level NOW, where the segment has a length."""
    take_segment(line.position[NOW], line.velocity[level], line.water[level], j, work)
    r = chord_length(work.chord, line.ends.last_length[NOW] if j == line.ends.count else line.length[j])
    for i in range(3):
        work.tangent[i] = work.chord[i] / r
    evaluate_momentum(c, work)
    for i in range(3):
        line.momentum[level, j, i] = length * work.momentum[i]
