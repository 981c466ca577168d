"""The free surface in the balances: above it a cable has its weight in air, and neither drag nor added mass.

A segment's water acts by its wetted share σ: the record of a floating cable always describes one segment at one level
of time (`state.select_section`, `wet_at_new`), with added mass, drag and the mass that is carried along it times σ. Its
weight is that in water; what its dry part is heavier, ρAg δ, is added here to the balances of both ends as each carries
it (`wetting`): the gradient of an energy. Of a body, a sphere of its volume, likewise. With the momentum σρA U of the
water, that which is wetted comes in and goes out (a slam as that of von Kármán); `wetted_power` is its part in the
ledger. What a cable in water everywhere compiles of this is nothing.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.moving_end.bdf2 import Weights
from cable.moving_end.state import (
    BEFORE,
    DIAGONAL,
    LOWER,
    NEW,
    NOW,
    RESIDUAL,
    UPPER,
    Line,
    depth_in_radii,
    find_whole,
    held_node,
    length_at,
    no_change_in_step,
    no_energy,
)
from cable.moving_end.wetting import dry_energy, dry_segment
from cable.properties import FloatingCableNumbers
from subzero.jit import by_field, by_field_in_step, compiled, inner, scratch


@inner
def _float(line: Line, c: FloatingCableNumbers, w: Weights, slopes: bool) -> None:
    """Add what the dry parts of segments are heavier, and how their water grows with their depth."""
    N, held, tow, per_share = line.ends.count, held_node(line), line.ends.tow, scratch(1, 3)[0]
    for j in range(1, N + 1):
        find_whole(line, c, j)
        r = c.softness * 0.5 * c.whole[6]
        a, b = depth_in_radii(line, c, NEW, j - 1), depth_in_radii(line, c, NEW, j)
        near, far, by_near, across, by_far = dry_segment(a, b)
        buoyancy = c.whole[5] * length_at(line, NEW, j)
        if j > 1:
            line.rows[RESIDUAL, j - 1, 3] -= buoyancy * near
        else:
            tow.force[2] += buoyancy * near
        if j < held:
            line.rows[RESIDUAL, j, 3] -= buoyancy * far
        else:
            line.ends.drum_force[2] -= buoyancy * far
        if not slopes or by_near + across + by_far == 0.0:
            continue
        _water_per_share(line, c, w, j, per_share)
        for i in range(3):
            # ∂σ/∂z is −∂δ/∂z; each end has half of the segment's water
            wet = -0.5 * per_share[i] / r
            weight = -buoyancy / r if i == 2 else 0.0
            by_a, by_b = wet * (by_near + across), wet * (across + by_far)
            if j > 1:
                line.blocks[DIAGONAL, j - 1, 1 + i, 3] += weight * by_near + by_a
            if 1 < j < held:
                line.blocks[UPPER, j - 1, 1 + i, 3] += weight * across + by_b
            if j < held:
                line.blocks[LOWER, j, 1 + i, 3] += weight * across + by_a
                line.blocks[DIAGONAL, j, 1 + i, 3] += weight * by_far + by_b


@compiled
def _water_per_share(line: Line, c: FloatingCableNumbers, w: Weights, j: int, out: np.ndarray) -> None:
    """Fill ∂Q/∂σ of segment j (3,): drag, and a₀ times the momentum of its water. [N]"""
    along, size, square = 0.0, 0.0, 0.0
    for i in range(3):
        d = line.position[NEW, j, i] - line.position[NEW, j - 1, i]
        out[i] = 0.5 * (line.velocity[NEW, j, i] + line.velocity[NEW, j - 1, i])
        out[i] -= 0.5 * (line.water[NEW, j, i] + line.water[NEW, j - 1, i])
        along, size, square = along + d * out[i], size + d * d, square + out[i] * out[i]
    size = sqrt(max(size, 1e-30))
    along /= size
    side = sqrt(max(square - along * along, 0.0))
    length, stretch = length_at(line, NEW, j), sqrt(1.0 + c.compliance * line.tension[NEW, j])
    across = w.a0 * (c.whole[1] + c.whole[2]) + stretch * c.whole[4] * side
    on_axis = w.a0 * c.whole[2] + stretch * c.whole[3] * abs(along)
    for i in range(3):
        U_t = along * (line.position[NEW, j, i] - line.position[NEW, j - 1, i]) / size
        out[i] = length * (across * (out[i] - U_t) + on_axis * U_t)


@inner
def _dry_energy(line: Line, c: FloatingCableNumbers) -> float:
    """Return the energy of all segments by being dry, at level NOW. [J]."""
    total = 0.0
    for j in range(1, line.ends.count + 1):
        find_whole(line, c, j)
        r = c.softness * 0.5 * c.whole[6]
        a, b = depth_in_radii(line, c, NOW, j - 1), depth_in_radii(line, c, NOW, j)
        total += c.whole[5] * length_at(line, NOW, j) * r * dry_energy(a, b)
    return total


@inner
def _wetted_power(line: Line, c: FloatingCableNumbers) -> float:
    """Return ½ dσ/dt (ρA C_a U_⊥² + ρA C_at U_t²) of all segments, over the last step. [W]."""
    if line.ends.previous_step <= 0.0:
        return 0.0
    power = 0.0
    for j in range(1, line.ends.count + 1):
        find_whole(line, c, j)
        near, far, _, _, _ = dry_segment(depth_in_radii(line, c, NOW, j - 1), depth_in_radii(line, c, NOW, j))
        change = near + far
        near, far, _, _, _ = dry_segment(
            depth_in_radii(line, c, BEFORE, j - 1), depth_in_radii(line, c, BEFORE, j)
        )
        change -= near + far
        square, along, size = 0.0, 0.0, 0.0
        for i in range(3):
            U = 0.0
            for level in (NOW, BEFORE):
                U += 0.25 * (line.velocity[level, j, i] + line.velocity[level, j - 1, i])
                U -= 0.25 * (line.water[level, j, i] + line.water[level, j - 1, i])
            d = line.position[NOW, j, i] - line.position[NOW, j - 1, i]
            square, along, size = square + U * U, along + d * U, size + d * d
        along = along * along / max(size, 1e-30)
        inertia = c.whole[1] * (square - along) + c.whole[2] * square
        power -= 0.5 * change * inertia * length_at(line, NOW, j) / line.ends.previous_step
    return power


add_surface = by_field_in_step("surface_level", _float, no_change_in_step)
surface_energy = by_field("surface_level", _dry_energy, no_energy)
wetted_power = by_field("surface_level", _wetted_power, no_energy)
