"""The ends of the lumped cable: the force on the vehicle, and the drum with the half spring before it, or a drogue.

At the far end, the last half spring, between the middle M of spring N and the drum, holds ½ℓ p(S); material enters it
at the drum and leaves it at M, at half the rate, into the lump of node N − 1:

    Q = d(½ℓ p(S))/dt − U p(S) + ½U p(M) + ½ℓ f(S),        T(S) = T_N + t_N·Q
    V(S) = V_drum − U t_N,                                   V(M) = ½ (V_{N−1} + V(S))

    free drum    (I_d/R_d²) dU/dt + C_f/R_d = T(S), or it stands: U ≥ 0 (whichever is the smaller of the two sides);
                 with inertia it may overrun the cable, which lies loose before it then, T(S) = 0 (`turning`)
    winch        U or T(S) as asked for

At the near end, the force on the vehicle is

    F = T_1 t_1 + B_0 − ½ℓ_1 q(¼ℓ_1),      q = ∂p/∂t + f

The half spring at the tow point carries its load q a quarter into the spring, between that at the tow point and that
at the next node. B_0 is what bending does there.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.drum import LENGTH, TENSION, DrumNumbers
from cable.lumped.balance import arm, first_tangent, load_node, neighbours
from cable.lumped.band_solver import add
from cable.lumped.load import evaluate_node
from cable.lumped.rope import (
    ANSWER,
    DIRECTION,
    GAIN,
    GAP,
    MIDDLE,
    NEW,
    OLD,
    PULL,
    REST,
    SIZE,
    SMOOTH_STEPS,
    START_MOMENTUM,
    WATER,
    Rope,
)
from cable.lumped.springs import drum_friction, unit_length
from cable.properties import CableNumbers
from subzero.jit import allocating, compiled, inner


@allocating
def hold_end(rope: Rope, g: float, c: CableNumbers, drum: DrumNumbers) -> None:
    """Write the equations of the far end."""
    if rope.ends.free_end:
        _add_drogue(rope)
        return
    _load_ends(rope, g, c)
    flow, flow_by_U = np.zeros((3, 3)), np.zeros(3)
    _flow_slopes(rope, g, flow, flow_by_U)
    _cross_middle(rope, flow, flow_by_U)
    _drum_row(rope, g, c, drum, flow, flow_by_U)


@allocating
def _add_drogue(rope: Rope) -> None:
    """Add ½ρC_dA |U| U to the balance of the free end."""
    N, square = rope.ends.count, 0.0
    U = np.zeros(3)
    for i in range(3):
        U[i] = rope.velocity[NEW, N, i] - rope.vector[WATER, N, i]
        square += U[i] * U[i]
    size = sqrt(square)
    rope.ends.drum_pull = rope.ends.tail_drag * square
    for i in range(3):
        rope.right[3 * (N - 1) + i] += rope.ends.tail_drag * size * U[i]
        for k in range(3):
            slope = (size if i == k else 0.0) + U[i] * U[k] / max(size, 1e-12)
            add(rope.band, 3 * (N - 1) + i, 3 * (N - 1) + k, rope.ends.tail_drag * slope)


@compiled
def _load_ends(rope: Rope, g: float, c: CableNumbers) -> None:
    """Fill the loads at the drum and in the middle of the last spring; ∂h is for h = a p + f, a = 1/g − 2U/ℓ."""
    N, U, end, middle = rope.ends.count, rope.ends.payout[NEW], rope.drum, rope.middle
    thin = sqrt(1.0 + rope.ends.stretch * rope.spring[PULL, N])
    for i in range(3):
        t = rope.vector[DIRECTION, N, i]
        end.tangent[i], middle.tangent[i] = t, t
        end.velocity[i] = rope.ends.drum_velocity[i] - U * t
        end.water[i] = rope.vector[WATER, N, i]
        middle.velocity[i] = 0.5 * (rope.velocity[NEW, N - 1, i] + end.velocity[i])
        middle.water[i] = 0.5 * (rope.vector[WATER, N - 1, i] + rope.vector[WATER, N, i])
    a = 1.0 / g - 2.0 * U / rope.spring[REST, N]
    evaluate_node(c.mass, c.added_mass, c.weight, thin * c.tangential_drag, thin * c.normal_drag, a, end)
    evaluate_node(c.mass, c.added_mass, 0.0, 0.0, 0.0, 1.0, middle)


@inner
def turn(rope: Rope, g: float, i: int, k: int) -> float:
    """Return ∂t_N/∂V_{N−1}, an entry of −g (I − t tᵀ)/|d|. [s/m]."""
    N, t = rope.ends.count, rope.vector[DIRECTION]
    return -g * ((1.0 if i == k else 0.0) - t[N, i] * t[N, k]) / rope.spring[SIZE, N]


@compiled
def _flow_slopes(rope: Rope, g: float, flow: np.ndarray, flow_by_U: np.ndarray) -> None:
    """Fill ∂(½U p(M))/∂V_{N−1} (3, 3) and ∂(½U p(M))/∂U (3,)."""
    U, middle, t = rope.ends.payout[NEW], rope.middle, rope.vector[DIRECTION, rope.ends.count]
    for i in range(3):
        flow_by_U[i] = 0.5 * middle.momentum[i]
        for k in range(3):
            flow_by_U[i] -= 0.25 * U * middle.by_velocity[i, k] * t[k]
            flow[i, k] = 0.25 * U * middle.by_velocity[i, k]
            for m in range(3):
                by_t = middle.by_tangent[i, m] - 0.5 * U * middle.by_velocity[i, m]
                flow[i, k] += 0.5 * U * by_t * turn(rope, g, m, k)


@compiled
def _cross_middle(rope: Rope, flow: np.ndarray, flow_by_U: np.ndarray) -> None:
    """Give the node before the drum the momentum that crosses the middle of the last spring."""
    N, U = rope.ends.count, rope.ends.payout[NEW]
    if N < 2:
        return
    for i in range(3):
        row = 3 * (N - 2) + i
        rope.right[row] -= 0.5 * U * rope.middle.momentum[i]
        add(rope.band, row, 3 * (N - 1), -flow_by_U[i])
        for k in range(3):
            add(rope.band, row, 3 * (N - 2) + k, -flow[i, k])


@allocating
def _drum_row(
    rope: Rope, g: float, c: CableNumbers, drum: DrumNumbers, flow: np.ndarray, flow_by_U: np.ndarray
) -> None:
    """Write the drum's equation, the last row."""
    N, U, end = rope.ends.count, rope.ends.payout[NEW], rope.drum
    half = 0.5 * rope.spring[REST, N]
    row, by_V, Q = 3 * (N - 1), np.zeros(3), np.zeros(3)
    unit = unit_length(rope, N) * rope.ends.by_payout
    thinner = 0.5 * half * rope.ends.stretch / (1.0 + rope.ends.stretch * rope.spring[PULL, N])
    gain = rope.spring[GAIN, N] * (1.0 + thinner * _along(rope.vector[DIRECTION, N], end.drag))
    along, by_U = rope.spring[PULL, N], -gain * unit
    for i in range(3):
        t = rope.vector[DIRECTION, N, i]
        rope.momentum[NEW, N, i] = half * end.momentum[i]
        Q[i] = (rope.momentum[NEW, N, i] - rope.vector[START_MOMENTUM, N, i]) / g + half * end.force[i]
        Q[i] += U * (0.5 * rope.middle.momentum[i] - end.momentum[i])
        along += t * Q[i]
        grown = 0.5 * rope.ends.by_payout * (end.momentum[i] / g + end.force[i])
        by_U += t * (grown - end.momentum[i] + flow_by_U[i])
        by_V[i] -= gain * rope.vector[ANSWER, N, i]
        for k in range(3):
            by_U -= t * half * end.by_velocity[i, k] * rope.vector[DIRECTION, N, k]
            by_V[k] += t * flow[i, k] + Q[i] * turn(rope, g, i, k)
            for m in range(3):
                by_t = half * (end.by_tangent[i, m] - U * end.by_velocity[i, m])
                by_V[k] += t * by_t * turn(rope, g, m, k)
    rope.ends.drum_pull = along
    excess, by_excess, spins = _drum_law(rope, g, drum, along)
    if spins < 1.0:
        by_V *= 0.0
    rope.right[row] = excess - spins * gain * rope.spring[GAP, N]
    add(rope.band, row, row, by_excess - spins * by_U)
    if N > 1:
        for k in range(3):
            add(rope.band, row, row - 3 + k, -spins * by_V[k])


@inner
def _along(t: np.ndarray, vector: np.ndarray) -> float:
    """Return t·vector."""
    return t[0] * vector[0] + t[1] * vector[1] + t[2] * vector[2]


@compiled
def _drum_law(rope: Rope, g: float, drum: DrumNumbers, pull: float) -> tuple[float, float, float]:
    """Return the residual of the drum's equation, its slope by U, and how much of the pull it feels (0 or 1)."""
    U = rope.ends.payout[NEW]
    if drum.control == LENGTH:
        return 0.0, 1.0, 0.0
    if drum.control == TENSION:
        return rope.ends.wanted - pull, 0.0, 1.0
    own, by_own = turning(rope, g, drum)
    if own - pull > (1.0 + by_own) * U:  # a step of Newton's method from here would end below U = 0
        return U, 1.0, 0.0
    return own - pull, by_own, 1.0


@inner
def turning(rope: Rope, g: float, drum: DrumNumbers) -> tuple[float, float]:
    """Return what it takes to turn the drum with the cable, (I_d/R_d²) dU_d/dt + C_f/R_d, and its slope by U; nothing
    where that would have to hold the drum back: it runs ahead.
    """
    speed, before, span, by_U = _speed_with_cable(rope, g)
    held, slope = drum_friction(drum.friction, speed)
    own = drum.inertia * (speed - before) / span + held
    runs_ahead = own < 0.0 < before and drum.inertia > 0.0
    return (0.0, 0.0) if runs_ahead else (own, by_U * (drum.inertia / span + slope))


@inner
def is_first_order(rope: Rope) -> bool:
    """Return whether cable is loose, or was so lately: then the drum is advanced to first order, over the whole step,
    so that its force is the mean of what it takes.
    """
    return rope.ends.since_loose < SMOOTH_STEPS or rope.ends.loose[MIDDLE] > 0.0


@compiled
def _speed_with_cable(rope: Rope, g: float) -> tuple[float, float, float, float]:
    """Return how fast the drum turns if no cable is loose at the end of the stage, what its acceleration is differenced
    with, [m/s], over which time [s], and ∂(its speed)/∂U.
    """
    ends = rope.ends
    if not is_first_order(rope):
        return ends.payout[NEW], ends.start_payout, g, 1.0
    grown = ends.last[NEW] - ends.last[OLD] - ends.loose[OLD]
    return grown / ends.stage_end, ends.spin[OLD], ends.stage_end, g / ends.stage_end


@inner
def wind_off(rope: Rope, g: float, drum: DrumNumbers) -> None:
    """Fill how fast the drum turns at the end of a stage, and how much cable is loose then: none if the cable turns it;
    else it coasts, (I_d/R_d²) dU_d/dt + C_f/R_d = 0.
    """
    ends = rope.ends
    speed, before, span, _ = _speed_with_cable(rope, g)
    ends.spin[NEW], ends.loose[NEW] = speed, 0.0
    if drum.inertia <= 0.0:
        return
    low, high = 0.0, max(before, 0.0)
    for _ in range(60):  # friction and inertia grow with the speed: halved until it is known to rounding
        middle = 0.5 * (low + high)
        held, _ = drum_friction(drum.friction, middle)
        if drum.inertia * (middle - before) / span + held > 0.0:
            high = middle
        else:
            low = middle
    if high > speed:
        ends.spin[NEW], ends.loose[NEW] = high, span * (high - speed)


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
def _add_bending(rope: Rope) -> None:
    """Add the bending force at the tow point, from the bend at the next node."""
    near, far, x = rope.spring[REST, 1], rope.spring[REST, 2], rope.position
    for i in range(3):
        bend = (x[NEW, 2, i] - x[NEW, 1, i]) / far - (x[NEW, 1, i] - x[NEW, 0, i]) / near
        rope.ends.tow_force[i] -= rope.ends.bending / (0.5 * (near + far)) * bend * arm(near, far, -1)
