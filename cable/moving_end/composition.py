"""Sections and bodies in the balances (`cable.sections`); a uniform cable compiles nothing of this.

The record of a sectioned cable always describes one of its sections: a loop over segments selects that of each
(`state.select_section`). A body adds its inertia, drag, weight and lift to the balance of its node:
the one that is nearest to its place.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from cable.moving_end.bdf2 import Weights
from cable.moving_end.state import (
    BEFORE,
    DIAGONAL,
    NEW,
    NOW,
    RESIDUAL,
    Line,
    find_section,
    held_node,
    length_at,
    no_change,
    no_change_in_step,
)
from cable.moving_end.wetting import dry_sphere
from cable.properties import CableNumbers, SectionedCableNumbers
from subzero.jit import by_field, by_field_at, by_field_in_step, compiled, inner


@compiled
def body_node(line: Line, c: SectionedCableNumbers, b: int) -> int:
    """Return the node that body b is at."""
    along = 0.0
    for j in range(1, line.ends.count + 1):
        along += length_at(line, NOW, j)
        if along + 0.5 * length_at(line, NOW, min(j + 1, line.ends.count)) > c.body_place[b]:
            return j
    return line.ends.count


@inner
def _dry_body(line: Line, c: Any, j: int) -> tuple[float, float, float]:
    """Return the dry share of body j at level NEW, a sphere, its derivative by depth [1/m] and its energy [m]."""
    r = c.softness * c.body_radius[j]
    if r <= 0.0:
        return 0.0, 0.0, 0.0
    depth = line.position[NEW, body_node(line, c, j), 2] + line.ends.origin[2] - c.surface_level
    share, by_depth, energy = dry_sphere(depth / r)
    return share, by_depth / r, energy * r


@inner
def _wet_body(line: Line, c: SectionedCableNumbers, j: int) -> tuple[float, float, float]:
    """Return that it is in water."""
    return 0.0, 0.0, 0.0


dry_body = by_field_at("surface_level", _dry_body, _wet_body)


@inner
def _load_nodes(line: Line, c: SectionedCableNumbers, w: Weights, slopes: bool) -> None:
    """Add the bodies to the balances of their nodes."""
    for b in range(c.body_count):
        j = body_node(line, c, b)
        if j >= held_node(line):
            continue
        dry, by_depth, _ = dry_body(line, c, b)
        m, added = c.body[b, 0], (1.0 - dry) * c.body[b, 1]
        drag, lift = (1.0 - dry) * c.body[b, 3], (1.0 - dry) * c.body[b, 4]
        V, J, square = line.velocity, line.water, 0.0
        for i in range(3):
            square += (V[NEW, j, i] - J[NEW, j, i]) ** 2
        speed, down = sqrt(square), V[NEW, j, 2] - J[NEW, j, 2]
        r, D = line.rows[RESIDUAL, j], line.blocks[DIAGONAL, j]
        for i in range(3):
            U = V[NEW, j, i] - J[NEW, j, i]
            rate = w.a0 * V[NEW, j, i] + w.a1 * V[NOW, j, i] + w.a2 * V[BEFORE, j, i]
            water = w.a0 * J[NEW, j, i] + w.a1 * J[NOW, j, i] + w.a2 * J[BEFORE, j, i]
            r[1 + i] += m * rate + added * (rate - water) + drag * speed * U + lift * down * U
            for k in range(3 if slopes else 0):
                by_U = drag * U * (V[NEW, j, k] - J[NEW, j, k]) / max(speed, 1e-12)
                by_U += lift * U if k == 2 else 0.0
                by_U -= 2.0 * lift * (V[NEW, j, k] - J[NEW, j, k]) if i == 2 else 0.0
                by_U += (m + added) * w.a0 + drag * speed + lift * down if i == k else 0.0
                D[1 + i, 1 + k] += by_U * w.b0
        r[3] -= c.body[b, 2] + lift * square + dry * c.body[b, 5]
        if slopes:
            D[3, 3] -= by_depth * c.body[b, 5]


@inner
def _add_mass(line: Line, c: SectionedCableNumbers) -> None:
    """Add the bodies to the masses that a jolt moves."""
    for b in range(c.body_count):
        j = body_node(line, c, b)
        for i in range(3 if j < held_node(line) else 0):
            line.blocks[DIAGONAL, j, 1 + i, 1 + i] += (
                c.body[b, 0] + (1.0 - dry_body(line, c, b)[0]) * c.body[b, 1]
            )


@inner
def _flow(line: Line, c: SectionedCableNumbers) -> tuple[float, float, float]:
    """Return loss to drag [W], energy in the water [J] and work of gravity [W] of the bodies at level NOW."""
    loss, energy, sunk = 0.0, 0.0, 0.0
    for b in range(c.body_count):
        j, square = body_node(line, c, b), 0.0
        if j >= held_node(line):
            continue
        for i in range(3):
            square += (line.velocity[NOW, j, i] - line.water[NOW, j, i]) ** 2
        dry, _, above = dry_body(line, c, b)
        loss += (1.0 - dry) * c.body[b, 3] * square * sqrt(square)
        energy += 0.5 * (c.body[b, 0] + (1.0 - dry) * c.body[b, 1]) * square + above * c.body[b, 5]
        sunk += c.body[b, 2] * (line.velocity[NOW, j, 2] - line.water[NOW, j, 2])
    return loss, energy, sunk


@inner
def _no_flow(line: Line, c: CableNumbers) -> tuple[float, float, float]:
    """Return none."""
    return 0.0, 0.0, 0.0


@inner
def _carried(line: Line, c: SectionedCableNumbers, j: int) -> float:
    """Return half of the weight of the bodies at both ends of segment j; all of it at a free end. [N]."""
    weight = 0.0
    for b in range(c.body_count):
        node = body_node(line, c, b)
        if node in (j - 1, j):
            weight += (1.0 if node == line.ends.count else 0.5) * c.body[b, 2]
    return weight


@inner
def _none_carried(line: Line, c: CableNumbers, j: int) -> float:
    """Return none. [N]."""
    return 0.0


carried_weight = by_field_at("section_end", _carried, _none_carried)
add_bodies = by_field_in_step("section_end", _load_nodes, no_change_in_step)
add_body_masses = by_field("section_end", _add_mass, no_change)
body_flow = by_field("section_end", _flow, _no_flow)


def steady_tow(line: Line, c: SectionedCableNumbers, U: np.ndarray, tail_drag: float) -> None:
    """Lay a line of sections and bodies in a steady tow at U through the water (3,), segment by segment from its tail.

    The force at the far node of a segment and half of its load give its tangent, and that its load: a fixed point.
    """
    N, x = int(line.ends.count), line.position[NOW]
    speed, down = float(np.linalg.norm(U)), np.array([0.0, 0.0, 1.0])
    nodes = [body_node(line, c, b) for b in range(int(c.body_count))]
    force, x[N] = -tail_drag * speed * U, 0.0
    t = -U / speed if speed > 0.0 else down
    for j in range(N, 0, -1):
        for b in (b for b, node in enumerate(nodes) if node == j):
            _, _, weight, drag, lift, _ = c.body[b]
            force = force - drag * speed * U + weight * down + lift * (speed * speed * down - U[2] * U)
        find_section(line, c, j)
        length = float(line.length[j])
        for _ in range(100):
            along = float(U @ t)
            across = U - along * t
            drag = (
                c.tangential_drag * abs(along) * along * t
                + c.normal_drag * float(np.linalg.norm(across)) * across
            )
            load = length * (c.weight * down - drag)
            middle = force + 0.5 * load
            pulled = middle / max(float(np.linalg.norm(middle)), 1e-30)
            t = t + 0.5 * (pulled - t)
            t = t / np.linalg.norm(t) if t.any() else pulled  # none: it points against the pull
        T = float(np.linalg.norm(middle))
        line.tension[:, j], line.node_tension[j] = T, float(np.linalg.norm(force))
        x[j - 1] = x[j] - length * (1.0 + c.compliance * T) * t
        force = force + load
    line.position[:, : N + 1] = x[: N + 1]
    line.node_tension[0], line.ends.tow.force[:] = float(np.linalg.norm(force)), force
