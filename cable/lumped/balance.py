"""The balance of momentum of the free nodes, with its slopes: required minus available force of a node.

    R_j = (w_j p_j − P*_j)/g + w_j f_j + T_j t_j − T_{j+1} t_{j+1} − B_j,      w_j = ½(ℓ_j + ℓ_{j+1})

p_j and f_j are the momentum and the load of a metre (`load`) with the node's own velocity, water and
tangent; the tangent is that of the circle through the node and its neighbours. B_j comes from the bending energy
½EI Σ |e_{j+1} − e_j|²/w_j with e_j = d_j/ℓ_j: no moment at the ends.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.lumped.band_solver import add
from cable.lumped.load import evaluate_node, shorten
from cable.lumped.rope import NEW, PULL, REST, START_MOMENTUM, THINNING, WATER, Rope, unknowns
from cable.properties import CableNumbers
from subzero.jit import allocating, compiled, inner


@allocating
def balance_nodes(rope: Rope, g: float, c: CableNumbers) -> None:
    """Add momentum and loads of all free nodes to their balances."""
    s = np.zeros(3)
    for j in range(1, unknowns(rope) + 1):
        before, after, width = neighbours(rope, j, s)
        thin = load_node(rope, j, s, 1.0 / g, c)
        for i in range(3):
            rope.momentum[NEW, j, i] = width * rope.node.momentum[i]
            rate = (rope.momentum[NEW, j, i] - rope.vector[START_MOMENTUM, j, i]) / g
            rope.right[3 * (j - 1) + i] += rate + width * rope.node.force[i]
            thinner = (0.5 if j == rope.ends.count else 0.25) * rope.ends.stretch / (thin * thin)
            rope.vector[THINNING, j, i] = width * rope.node.drag[i] * thinner
        _slopes(rope, j, g, before, after, width)
        if j == rope.ends.count - 1 and not rope.ends.free_end:
            _lengthen(rope, j, g, s)


@inner
def neighbours(rope: Rope, j: int, s: np.ndarray) -> tuple[float, float, float]:
    """Fill s (3,), the mean of d/ℓ on both sides of node j; return ∂s/∂d_j, ∂s/∂d_{j+1} [1/m] and w_j [m].

    The shorter side counts more: then s is parallel to the tangent of the circle through the three nodes. A free tail
    has one side only.
    """
    near = rope.spring[REST, j]
    if j == rope.ends.count:
        before, after, width = 1.0 / near, 0.0, 0.5 * near
    else:
        far = rope.spring[REST, j + 1]
        before, after, width = far / (near * (near + far)), near / (far * (near + far)), 0.5 * (near + far)
    for i in range(3):
        s[i] = before * (rope.position[NEW, j, i] - rope.position[NEW, j - 1, i])
        if after > 0.0:
            s[i] += after * (rope.position[NEW, j + 1, i] - rope.position[NEW, j, i])
    return before, after, width


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


@inner
def load_node(rope: Rope, j: int, s: np.ndarray, a: float, c: CableNumbers) -> float:
    """Fill rope.node with the load of a metre of cable at node j, its tangent along s (3,); return √(1 + eT)."""
    here, N = rope.node, rope.ends.count
    shorten(s, here)
    for i in range(3):
        here.velocity[i] = rope.velocity[NEW, j, i]
        here.water[i] = rope.vector[WATER, j, i]
    tension = 0.5 * (rope.spring[PULL, max(j, 1)] + rope.spring[PULL, min(j + 1, N)])
    thin = sqrt(1.0 + rope.ends.stretch * tension)
    evaluate_node(c.mass, c.added_mass, c.weight, thin * c.tangential_drag, thin * c.normal_drag, a, here)
    return thin


@compiled
def _slopes(rope: Rope, j: int, g: float, before: float, after: float, width: float) -> None:
    """Add ∂R_j/∂V of node j and its neighbours; they move the tangent."""
    held, here = unknowns(rope), rope.node
    for i in range(3):
        row = 3 * (j - 1) + i
        for k in range(3):
            turned = 0.0
            for m in range(3):
                turned += here.by_tangent[i, m] * here.turning[m, k]
            turned *= width * g
            add(rope.band, row, 3 * (j - 1) + k, width * here.by_velocity[i, k] + turned * (before - after))
            if j > 1:
                add(rope.band, row, 3 * (j - 2) + k, -turned * before)
            if j < held:
                add(rope.band, row, 3 * j + k, turned * after)


@compiled
def _lengthen(rope: Rope, j: int, g: float, s: np.ndarray) -> None:
    """Add ∂R/∂U of the node before the drum: its lump grows, and its tangent turns to the longer side."""
    near, far = rope.spring[REST, j], rope.spring[REST, j + 1]
    by_payout, here = rope.ends.by_payout, rope.node
    for i in range(3):
        value = 0.5 * (here.momentum[i] / g + here.force[i])
        for m in range(3):
            turn = 0.0
            for n in range(3):
                turn += here.by_tangent[i, n] * here.turning[n, m]
            e_near = (rope.position[NEW, j, m] - rope.position[NEW, j - 1, m]) / near
            e_far = (rope.position[NEW, j + 1, m] - rope.position[NEW, j, m]) / far
            value += 0.5 * (near + far) * turn * (e_near - near / far * e_far - s[m]) / (near + far)
        add(rope.band, 3 * (j - 1) + i, 3 * j, by_payout * value)


@compiled
def bend_nodes(rope: Rope, g: float) -> None:
    """Add the bending stiffness to the balances; linear in the positions."""
    N, EI = rope.ends.count, rope.ends.bending
    for j in range(1, N):
        near, far = rope.spring[REST, j], rope.spring[REST, j + 1]
        factor = EI / (0.5 * (near + far))
        for k in range(3):
            e_near = (rope.position[NEW, j, k] - rope.position[NEW, j - 1, k]) / near
            e_far = (rope.position[NEW, j + 1, k] - rope.position[NEW, j, k]) / far
            moment = factor * (e_far - e_near)
            by_length = -factor * e_far / far - moment / (near + far) if j == N - 1 else 0.0
            for p in range(-1, 2):
                _bend(rope, g, j, k, p, factor, moment, by_length)


@inner
def arm(near: float, far: float, p: int) -> float:
    """Return ∂(e_far − e_near)/∂x of the node before (p = −1), at (0) and after (1) a bend. [1/m]."""
    if p == 0:
        return -1.0 / far - 1.0 / near
    return 1.0 / near if p < 0 else 1.0 / far


@compiled
def _bend(
    rope: Rope, g: float, j: int, k: int, p: int, factor: float, moment: float, by_length: float
) -> None:
    """Add to node j + p the force of the bend at node j along axis k."""
    near, far, held = rope.spring[REST, j], rope.spring[REST, j + 1], unknowns(rope)
    if j + p < 1 or j + p > held:
        return
    row, here = 3 * (j + p - 1) + k, arm(near, far, p)
    rope.right[row] += here * moment
    for q in range(-1, 2):
        if 1 <= j + q <= held:
            add(rope.band, row, 3 * (j + q - 1) + k, g * factor * here * arm(near, far, q))
    if j == rope.ends.count - 1 and not rope.ends.free_end:
        grown = here * by_length
        if p == 0:
            grown += moment / (far * far)
        add(rope.band, row, 3 * (rope.ends.count - 1), rope.ends.by_payout * grown)
