"""The load on one cable segment: momentum, drag and weight as vectors, with their derivatives.

A segment is straight, with the chord vector d (towards growing s), the tangent t = d/|d| and the velocity V of its
middle. With U = V − J, U_t = U·t, U_⊥ = U − U_t t and the projection P = I − t tᵀ, equation (7) is the vector balance

    ∂(T t)/∂s = ∂p/∂t + D − w_c k,     p = m V + ρA P (V − J)
    D = √(1+eT) (½ρπdC_t |U_t| U_t t + ½ρdC_n |U_⊥| U_⊥)

whose components along t, n, b are the six scalar equations of Feng & Allen (2004) as re-derived in
`docs/theory.md`. With added mass along the cable, too, p = m V + ρA (C_a U_⊥ + C_at U_t t), which is computed as
(m + ρA C_at) V + ρA (C_a − C_at) U_⊥ − ρA C_at J: the first two have the form above. No angle appears, so no direction
is singular, and a turned motion gives turned forces.

`evaluate_load` fills q = a₀ p + D − w_c k, where a₀ is the weight of the newest value in the time derivative
(`bdf2`), and `differentiate_load` ∂q/∂V and ∂q/∂d: all that Newton's method needs from the physics.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.moving_end.slack_law import chord_length, squared_share, turning_rate
from cable.moving_end.state import NOW, Line, length_at, select_section
from cable.properties import AlongCableNumbers, CableNumbers
from subzero.jit import Record, by_field, inlined, inner, made_once


class Load(Record):
    """Work space for one segment: its geometry, its load q, and derivatives.

    Attributes:
        velocity, water, chord: V of the segment's middle, J there, and d (3,).
        tangent, momentum, drag, q, across: t, p, D, q and U_⊥ (3,).
        along, side: U_t and |U_⊥|.
        square, chord_length, shorter: |d|²/ℓ², r and 1/r, see `measured_chord`.
        kt, kn: drag constants with stretch and correction.
        q_V, q_d: ∂q/∂V and ∂q/∂d (3, 3).
        q_tt: (∂q/∂t) t (3,), see `differentiate_load`.
        by_near, by_far: derivatives of the last segment's total load Q by the position of its near node (3, 3) and by
            the unknowns of its own block (3, 4), see `assembly`.
    """

    velocity: np.ndarray = np.zeros(3)
    water: np.ndarray = np.zeros(3)
    chord: np.ndarray = np.zeros(3)
    tangent: np.ndarray = np.zeros(3)
    momentum: np.ndarray = np.zeros(3)
    drag: np.ndarray = np.zeros(3)
    q: np.ndarray = np.zeros(3)
    across: np.ndarray = np.zeros(3)
    along: float = 0.0
    side: float = 0.0
    square: float = 0.0
    chord_length: float = 0.0
    shorter: float = 0.0
    kt: float = 0.0
    kn: float = 0.0
    q_V: np.ndarray = np.zeros((3, 3))
    q_d: np.ndarray = np.zeros((3, 3))
    q_tt: np.ndarray = np.zeros(3)
    by_near: np.ndarray = np.zeros((3, 3))
    by_far: np.ndarray = np.zeros((3, 4))


new_load = made_once(Load)
"""Return empty work space for one segment."""


@inlined
def _along(line: Line | Load, c: AlongCableNumbers) -> float:
    """Return ρA C_at. [kg/m]"""
    return c.mass_along


@inlined
def _none_along(line: Line | Load, c: CableNumbers) -> float:
    """Return none. [kg/m]"""
    return 0.0


mass_along = by_field("mass_along", _along, _none_along)


@inlined
def evaluate_momentum(c: CableNumbers, work: Load) -> None:
    """Fill U_t, U_⊥ and p = m V + ρA U_⊥, the momentum per length, from velocity, water and tangent. [kg/s]."""
    V, J, t, across = work.velocity, work.water, work.tangent, work.across
    carried = mass_along(work, c)
    along = (V[0] - J[0]) * t[0] + (V[1] - J[1]) * t[1] + (V[2] - J[2]) * t[2]
    for i in range(3):
        across[i] = V[i] - J[i] - along * t[i]
        work.momentum[i] = c.mass * V[i] + c.added_mass * across[i]
        if carried > 0.0:
            work.momentum[i] -= carried * J[i]
    work.along = along


@inlined
def measured_chord(x: np.ndarray, j: int, length: float) -> tuple[float, float, float]:
    """Return |d|²/ℓ² [-], r [m] and 1/r [1/m] of segment j, given the nodes at one level (nodes, 3), see `slack_law`.

    A loop along the cable measures the next chord before it works on the present one: the processor then computes the
    root and the quotients, which depend on one another, in parallel with that work.
    """
    a, b, d = x[j, 0] - x[j - 1, 0], x[j, 1] - x[j - 1, 1], x[j, 2] - x[j - 1, 2]
    square = (a * a + b * b + d * d) / (length * length)
    r = chord_length(square, length)
    return square, r, 1.0 / r


@inlined
def evaluate_load(T: float, slip: float, gain: float, a0: float, c: CableNumbers, work: Load) -> None:
    """Fill tangent, momentum, drag and q = a₀p + D − w_c k from velocity, water and chord, which was measured. [N/m].

    Args:
        T: tension (only √(1+eT) is taken from it). [N]
        slip: added to the speed along the chord, see `chord_correction`. [m/s]
        gain: on the normal drag, see `chord_correction`. [-]
        a0: weight of the newest value in the backward difference. [1/s]
        c: the cable.
        work: filled.
    """
    t, across = work.tangent, work.across
    for i in range(3):
        # 1/r is known: a multiplication instead of a division.
        t[i] = work.chord[i] * work.shorter
    evaluate_momentum(c, work)
    Ut = work.along
    normal = sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2])
    # A stretched segment is longer and thinner: its surface is √(1+eT) times as large.
    stretch = sqrt(1.0 + c.compliance * T)
    kt, kn = stretch * c.tangential_drag, gain * stretch * c.normal_drag
    for i in range(3):
        work.drag[i] = kt * abs(Ut + slip) * (Ut + slip) * t[i] + kn * normal * across[i]
        work.q[i] = a0 * work.momentum[i] + work.drag[i]
    # −w_c k: k points down, along the third axis.
    work.q[2] -= c.weight
    work.side, work.kt, work.kn = normal, kt, kn


@inner
def differentiate_load(slip: float, a0: float, c: CableNumbers, work: Load) -> None:
    """Fill ∂q/∂V and ∂q/∂d of the load filled by `evaluate_load`.

    With W = U_t + slip, the drag across k_n (|U_⊥| I + U_⊥ U_⊥ᵀ/|U_⊥|) by U_⊥, ∂U_⊥/∂V = P = I − t tᵀ,
    ∂U_⊥/∂t = −(t Uᵀ + U_t I) and ∂t/∂d = (I − g t tᵀ)/r:

        α     = (2 k_t|W| − a₀ρA) t − k_n (|U_⊥| t + U_⊥ (U_⊥·t)/|U_⊥|)
        ∂q/∂V = (a₀ (m + ρA) + k_n|U_⊥|) I + α tᵀ + k_n U_⊥ U_⊥ᵀ/|U_⊥|
        ∂q/∂t = (k_t|W| W − (a₀ρA + k_n|U_⊥|) U_t) I + α Uᵀ − U_t k_n U_⊥ U_⊥ᵀ/|U_⊥|
    """
    t, across, Ut, normal = work.tangent, work.across, work.along, work.side
    g, pulled = turning_rate(work.square), work.kt * abs(Ut + slip)
    # U_⊥ U_⊥ᵀ/|U_⊥| tends to 0 with U_⊥.
    turned = work.kn / normal if normal > 1e-12 else 0.0
    inert, side = a0 * c.added_mass, work.kn * normal
    At = turned * (across[0] * t[0] + across[1] * t[1] + across[2] * t[2])
    by_V, by_t = a0 * c.mass + inert + side, pulled * (Ut + slip) - (inert + side) * Ut
    for i in range(3):
        alpha, bent = (2.0 * pulled - inert - side) * t[i] - At * across[i], turned * across[i]
        for k in range(3):
            work.q_V[i, k] = alpha * t[k] + bent * across[k]
        work.q_V[i, i] += by_V
        _differentiate_by_chord(i, alpha, Ut * bent, by_t, g, work)


@inlined
def _differentiate_by_chord(i: int, alpha: float, bent: float, by_t: float, g: float, work: Load) -> None:
    """Fill row i of ∂q/∂d and of (∂q/∂t) t, of α, U_t k_n U_⊥/|U_⊥| and the factor of I in ∂q/∂t."""
    V, J, t, across = work.velocity, work.water, work.tangent, work.across
    x, y, z = t[0], t[1], t[2]
    a = alpha * (V[0] - J[0]) - bent * across[0] + (by_t if i == 0 else 0.0)
    b = alpha * (V[1] - J[1]) - bent * across[1] + (by_t if i == 1 else 0.0)
    d = alpha * (V[2] - J[2]) - bent * across[2] + (by_t if i == 2 else 0.0)
    along = a * x + b * y + d * z
    work.q_tt[i] = along
    work.q_d[i, 0] = (a - g * along * x) * work.shorter
    work.q_d[i, 1] = (b - g * along * y) * work.shorter
    work.q_d[i, 2] = (d - g * along * z) * work.shorter


@inlined
def take_segment(x: np.ndarray, V: np.ndarray, J: np.ndarray, j: int, work: Load) -> None:
    """Fill chord, velocity and water of segment j, given those of the nodes at one level (nodes, 3)."""
    for i in range(3):
        work.chord[i] = x[j, i] - x[j - 1, i]
        # The middle of a segment moves at the mean velocity of its nodes.
        work.velocity[i] = 0.5 * (V[j - 1, i] + V[j, i])
        work.water[i] = 0.5 * (J[j - 1, i] + J[j, i])


@inner
def segment_momentum(line: Line, level: int, j: int, c: CableNumbers, work: Load) -> None:
    """Fill ∫p ds of segment j at a level; the tangent is the one of level NOW, where the segment has a length."""
    # At an earlier level the growing segment may have had no length, and so no tangent.
    take_segment(line.position[NOW], line.velocity[level], line.water[level], j, work)
    select_section(line, c, j)
    whole, length = length_at(line, NOW, j), length_at(line, level, j)
    r = chord_length(squared_share(work.chord, whole), whole)
    for i in range(3):
        work.tangent[i] = work.chord[i] / r
    evaluate_momentum(c, work)
    for i in range(3):
        line.momentum[level, j, i] = length * work.momentum[i]
