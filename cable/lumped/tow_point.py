"""The near end of the lumped cable: the force on the vehicle.

    F = T_1 t_1 + B_0 − ½ℓ_1 q(¼ℓ_1),      q = ∂p/∂t + f

The half spring at the tow point carries its load q a quarter into the spring, between that at the tow point and that
at the next node. B_0 is what bending does there.
"""

from __future__ import annotations

import numpy as np

from cable.lumped.balance import arm, load_node, neighbours
from cable.lumped.rope import DIRECTION, NEW, PULL, REST, START_MOMENTUM, Rope
from cable.properties import CableNumbers
from subzero.jit import allocating, compiled


@allocating
def tow_force(rope: Rope, g: float, c: CableNumbers) -> None:
    """Fill the force on the vehicle, and the momentum of the half spring at the tow point."""
    half, s, load = 0.5 * rope.spring[REST, 1], np.zeros(3), np.zeros(3)
    share = 0.0 if rope.ends.count == 1 else 0.25
    if share > 0.0:
        _, _, width = neighbours(rope, 1, s)
        load_node(rope, 1, s, 0.0, c)
        _metre_load(rope, 1, width, g, load)
    next_load = share * load
    first_tangent(rope, s)
    load_node(rope, 0, s, 0.0, c)
    for i in range(3):
        rope.momentum[NEW, 0, i] = half * rope.node.momentum[i]
    _metre_load(rope, 0, half, g, load)
    for i in range(3):
        pull = rope.spring[PULL, 1] * rope.vector[DIRECTION, 1, i]
        rope.ends.tow_force[i] = pull - half * ((1.0 - share) * load[i] + next_load[i])
    if rope.ends.count > 1 and rope.ends.bending > 0.0:
        _add_bending(rope)


@compiled
def _metre_load(rope: Rope, j: int, width: float, g: float, out: np.ndarray) -> None:
    """Fill out (3,) with q at node j, whose lump is `width` long; rope.node holds its load. [N/m]."""
    held = j == rope.ends.count - 1 and not rope.ends.free_end
    for i in range(3):
        rate = (rope.momentum[NEW, j, i] - rope.vector[START_MOMENTUM, j, i]) / g
        if held:
            rate -= 0.5 * rope.ends.payout[NEW] * rope.middle.momentum[i]
        out[i] = rate / width + rope.node.force[i]


@compiled
def first_tangent(rope: Rope, s: np.ndarray) -> None:
    """Fill the mean chord at the tow point (3,), on the circle through the first three nodes."""
    near, x, share = rope.spring[REST, 1], rope.position, 0.0
    if rope.ends.count > 1:
        share = near / (near + rope.spring[REST, 2])
    for i in range(3):
        s[i] = (x[NEW, 1, i] - x[NEW, 0, i]) / near
        if share > 0.0:
            s[i] += share * (s[i] - (x[NEW, 2, i] - x[NEW, 1, i]) / rope.spring[REST, 2])


@compiled
def _add_bending(rope: Rope) -> None:
    """Add what bending does at the tow point, from the bend at the next node."""
    near, far, x = rope.spring[REST, 1], rope.spring[REST, 2], rope.position
    for i in range(3):
        bend = (x[NEW, 2, i] - x[NEW, 1, i]) / far - (x[NEW, 1, i] - x[NEW, 0, i]) / near
        rope.ends.tow_force[i] -= rope.ends.bending / (0.5 * (near + far)) * bend * arm(near, far, -1)
