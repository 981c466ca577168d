"""The sea bed in the balances: what presses on a node from below, and what holds it there (`cable.sea_bed`).

A node carries the bed's force on half of each segment next to it, ℓ̄ = ½(ℓ_j + ℓ_{j+1}), taken from the step before.
With the displacement u of a step, friction f = N s is an elastic and ideally plastic spring along the plane,

    s = s_now − κ P u,    |s_axial| ≤ μ_axial,    |s_lateral| ≤ μ_lateral

so a cable that is pulled less hard than friction allows does not creep, and holds its force at rest. What is along or
across the cable is that of the step before. Held nodes feel no bed. In a search for rest (`cable.hold`) s is
given, as nothing says how the cable came there.

What a cable without bed compiles of this is nothing.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.moving_end.bdf2 import Weights
from cable.moving_end.state import (
    DIAGONAL,
    NEW,
    NOW,
    RESIDUAL,
    Line,
    held_node,
    length_at,
    no_change,
    no_change_in_step,
    no_energy,
    select_section,
)
from cable.properties import LaidCableNumbers
from subzero.jit import by_field, by_field_in_step, compiled, inlined, inner, scratch

LEFT = 0.01
"""Tension that friction at rest leaves, as a share of what a node can hold: a cable without any could lie anywhere."""
SHORT = 1e-12
"""A chord along the bed that is shorter has no direction. [m]"""


@inlined
def carried_length(line: Line, j: int) -> float:
    """Return ℓ̄ of node j at level NOW. [m]."""
    far = length_at(line, NOW, j + 1) if j < line.ends.count else 0.0
    return 0.5 * (length_at(line, NOW, j) + far)


@inlined
def sunk_by(line: Line, level: int, j: int, c: LaidCableNumbers) -> float:
    """Return p of node j at a level. [m]."""
    p, n = -c.bed_level, c.bed_normal
    for i in range(3):
        p += n[i] * (line.position[level, j, i] + line.ends.origin[i])
    return p


@inlined
def pressure_law(p: float, soft: float) -> tuple[float, float, float]:
    """Return R(p) [m], R′ [-] and R″ [1/m], for p above 0."""
    if p < soft:
        return 0.5 * p * p / soft, p / soft, 1.0 / soft
    return p - 0.5 * soft, 1.0, 0.0


@inner
def _press(line: Line, c: LaidCableNumbers, w: Weights, slopes: bool) -> None:
    """Add the bed's forces to the balances, and if `slopes` their derivatives to the matrix."""
    last, n = min(held_node(line), line.ends.count + 1), c.bed_normal
    for j in range(1, last):
        p = sunk_by(line, NEW, j, c)
        select_section(line, c, j)
        for i in range(3):
            line.friction[NEW, j, i] = 0.0
        if p <= 0.0:
            continue
        rate, length = 0.0, carried_length(line, j)
        for i in range(3):
            rate += n[i] * line.velocity[NEW, j, i]
        R, by_p, by_pp = pressure_law(p, c.bed_rounding)
        N = length * (c.bed_stiffness * R + c.bed_damping * by_p * rate)
        if N <= 0.0:
            continue
        slope = length * (c.bed_stiffness * by_p + c.bed_damping * (by_pp * rate + by_p * w.b0))
        for i in range(3):
            line.rows[RESIDUAL, j, 1 + i] += N * n[i]
            for k in range(3 if slopes else 0):
                line.blocks[DIAGONAL, j, 1 + i, 1 + k] += slope * n[i] * n[k]
        if c.is_at_rest:
            _rub(line, j, N, slope, c, slopes)
        else:
            _stick_or_slide(line, j, N, slope, c, slopes)


@compiled
def direction_on_bed(line: Line, j: int, c: LaidCableNumbers, out: np.ndarray) -> None:
    """Fill the direction of the cable at node j along the bed, at level NOW (3,); that of north where it has none."""
    far, square, across, n = min(j + 1, line.ends.count), 0.0, 0.0, c.bed_normal
    for i in range(3):
        out[i] = line.position[NOW, far, i] - line.position[NOW, j - 1, i]
        across += n[i] * out[i]
        square += out[i] * out[i]
    for i in range(3):
        out[i] -= across * n[i]
    if square - across * across < SHORT * SHORT:
        out[0], out[1], out[2], square, across = n[2], 0.0, -n[0], n[0] * n[0] + n[2] * n[2], 0.0
    for i in range(3):
        out[i] /= sqrt(square - across * across)


@compiled
def _rub(line: Line, j: int, N: float, slope: float, c: LaidCableNumbers, slopes: bool) -> None:
    """Add friction whose share of the pressure is known, that of level NOW."""
    for i in range(3):
        share = line.friction[NEW, j, i] = line.friction[NOW, j, i]
        line.rows[RESIDUAL, j, 1 + i] -= N * share
        for k in range(3 if slopes else 0):
            line.blocks[DIAGONAL, j, 1 + i, 1 + k] -= share * slope * c.bed_normal[k]


@compiled
def _stick_or_slide(line: Line, j: int, N: float, slope: float, c: LaidCableNumbers, slopes: bool) -> None:
    """Add the friction of a moving cable: s as if it stuck, and no more of it than there can be."""
    ways, n, s, rates = scratch(2, 3), c.bed_normal, line.friction[NEW, j], scratch(1, 2)[0]
    direction_on_bed(line, j, c, ways[0])
    for i in range(3):
        ways[1, i] = n[(i + 1) % 3] * ways[0, (i + 2) % 3] - n[(i + 2) % 3] * ways[0, (i + 1) % 3]
        s[i] = 0.0
    for way in range(2):
        part, limit = 0.0, c.axial_friction if way == 0 else c.lateral_friction
        for i in range(3):
            u = line.position[NEW, j, i] - line.position[NOW, j, i]
            part += ways[way, i] * (line.friction[NOW, j, i] - c.friction_rate * u)
        rates[way] = c.friction_rate if abs(part) < limit else 0.0
        part = min(max(part, -limit), limit)
        for i in range(3):
            s[i] += part * ways[way, i]
    for i in range(3):
        line.rows[RESIDUAL, j, 1 + i] -= N * s[i]
        for k in range(3 if slopes else 0):
            # ∂(N s)/∂x = s (∂N/∂x)ᵀ − N κ (t tᵀ + b bᵀ), without what slides
            stuck = rates[0] * ways[0, i] * ways[0, k] + rates[1] * ways[1, i] * ways[1, k]
            line.blocks[DIAGONAL, j, 1 + i, 1 + k] += N * stuck - s[i] * slope * n[k]


@inner
def _keep_friction(line: Line, c: LaidCableNumbers) -> None:
    """Make the friction at level NEW that of level NOW."""
    for j in range(line.ends.count + 1):
        for i in range(3):
            line.friction[NOW, j, i] = line.friction[NEW, j, i]


@inner
def _power_to_bed(line: Line, c: LaidCableNumbers) -> float:
    """Return −Σ F·(V − J), what the bed takes of the cable at level NOW. [W]."""
    power, last, n = 0.0, min(held_node(line), line.ends.count + 1), c.bed_normal
    for j in range(1, last):
        p, length, rate = sunk_by(line, NOW, j, c), carried_length(line, j), 0.0
        select_section(line, c, j)
        if p <= 0.0:
            continue
        for i in range(3):
            rate += n[i] * line.velocity[NOW, j, i]
        R, by_p, _ = pressure_law(p, c.bed_rounding)
        N = max(length * (c.bed_stiffness * R + c.bed_damping * by_p * rate), 0.0)
        for i in range(3):
            U = line.velocity[NOW, j, i] - line.water[NOW, j, i]
            power += N * (n[i] - line.friction[NOW, j, i]) * U
    return power


add_contact = by_field_in_step("bed_stiffness", _press, no_change_in_step)
keep_friction = by_field("bed_stiffness", _keep_friction, no_change)
power_to_bed = by_field("bed_stiffness", _power_to_bed, no_energy)


def friction_at_rest(line: Line, c: LaidCableNumbers, friction: float) -> np.ndarray:
    """Return s of the nodes (nodes, 3) of a cable that was laid from its second end and tightened.

    From where it touches on, friction takes off the tension what it can, until hardly any is left (`LEFT`).
    """
    N, along, left = int(line.ends.count), np.zeros(3), 0.0
    shares, lengths = np.zeros((N + 1, 3)), np.append(line.length[1:N], line.ends.last_length[NOW])
    depths = (line.position[NOW] + np.asarray(line.ends.origin)) @ np.asarray(c.bed_normal) - c.bed_level
    soft = float(c.bed_rounding)
    for j in range(1, N):
        p, length = float(depths[j]), 0.5 * float(lengths[j - 1] + lengths[j])
        if p <= 0.0:
            left = float(line.tension[NOW, j + 1])
            continue
        pressure = length * c.bed_stiffness * (0.5 * p * p / soft if p < soft else p - 0.5 * soft)
        direction_on_bed(line, j, c, along)
        took = min(friction * pressure, max(left - LEFT * friction * pressure, 0.0))
        left -= took
        shares[j] = took / pressure * along
    return shares
