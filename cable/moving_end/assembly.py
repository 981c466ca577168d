"""The equations of one step, and their analytic Jacobian, segment by segment.

Unknowns of block j: the tension T_j of segment j and the position x_j of its far node; of the last block: T_N and the
length ℓ_N of the growing segment (its far node sits at the drum). With f_j = T_j t_j and the segment's total load
Q_j = ∫(∂p/∂t + D − w_c k) ds, shared half and half by its two ends, the equations are

    balance of node j:      f_j − f_{j+1} + ½(Q_j + Q_{j+1}) = 0          (momentum of equation (7))
    length of segment j:    φ(T_j, ½(1 + eT_j)² − ½|x_j − x_{j−1}|²/ℓ_j²) = 0    (compatibility of (7), `slack_law`)
    drum:                   T_N + ½ t_N·Q_N = (I_d/R_d² dU/dt + C_f/R_d)  (11), see `drum_end`

Nodes are where the velocity lives and segments where the tension lives, so neither can alternate from node to node.
The force on the vehicle (12) is f_1 − ½Q_1. Bending, which adds a shear force to f_j, is in `bending`.

What enters at the drum carries momentum p(S) per length into the last segment, which ends at a fixed place where
material passes:

    Q_N = d/dt(ℓ_N p_N) − U p(S) + ℓ_N (D − w_c k),   velocity of the material at the drum V_d − U d_N/ℓ_N

A free end has a drogue instead, or nothing.

The start of a run: while there is one segment only, it is a straight line between tow point and drum.

Its shape leaves nothing to solve for, and a slack one cannot lie anywhere. So the drum gives what the chord asks
for and takes nothing back, and the segment pulls or does not:

    ℓ = max(|d|, ℓ_now),     T = max(T(S) − ½ t·Q, 0)

both rounded off (`CORNER`) so that Newton's method passes. A current that is faster than the vehicle would drag cable
off a frictionless drum by its own; with one segment, it does not.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.drum import FREE, STANDING, DrumNumbers
from cable.moving_end.bdf2 import Weights
from cable.moving_end.bending import add_bending, add_clamps
from cable.moving_end.composition import add_bodies
from cable.moving_end.contact import add_contact
from cable.moving_end.drum_end import drum_row
from cable.moving_end.segment_load import (
    Load,
    differentiate_load,
    evaluate_load,
    mass_along,
    measured_chord,
    take_segment,
)
from cable.moving_end.slack_law import damped_share, fading_rate, slack_law, turning_rate
from cable.moving_end.state import (
    BEFORE,
    DIAGONAL,
    LOWER,
    NEW,
    NOW,
    RESIDUAL,
    UPPER,
    Line,
    held_node,
    length_at,
    select_section,
    wet_at_new,
)
from cable.moving_end.surface import add_surface
from cable.properties import CableNumbers
from subzero.jit import compiled, inlined, inner


@inner
def node_velocities(line: Line, w: Weights) -> None:
    """Fill the velocities of all nodes and the pay-out rate at level NEW by backward differences."""
    x, V, N = line.position, line.velocity, line.ends.count
    # Nodes before the drum are material points: the rate of their place is the velocity of the cable there.
    for j in range(min(held_node(line), N + 1)):
        for i in range(3):
            V[NEW, j, i] = w.b0 * x[NEW, j, i] + w.b1 * x[NOW, j, i] + w.b2 * x[BEFORE, j, i]
            V[NEW, j, i] += w.b_now * V[NOW, j, i]
    # So is the rate of the last segment's length the pay-out rate, dℓ_N/dt = dS/dt = U (14)-(19).
    last, U = line.ends.last_length, line.ends.payout
    U[NEW] = w.b0 * last[NEW] + w.b1 * last[NOW] + w.b2 * last[BEFORE] + w.b_now * U[NOW]
    if line.ends.drum_mode == STANDING:
        line.ends.payout[NEW] = 0.0
    if line.ends.layout.free_end:
        return
    # The end at the drum is a place, not a point of the cable: what passes it moves along the cable (9)-(10), towards
    # the tow point. d/ℓ and not t: a stretched cable is (1 + ε) longer than what left the drum.
    for i in range(3):
        chord = x[NEW, N, i] - x[NEW, N - 1, i]
        V[NEW, N, i] = line.ends.drum_velocity[i] - U[NEW] * chord / last[NEW]


@compiled
def assemble(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load) -> None:
    """Fill the residual and the block tridiagonal Jacobian at the present guess of level NEW."""
    _fill(line, w, c, drum, work, True)


@compiled
def assemble_residual(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load) -> None:
    """Fill the residual only; the matrix, or its factors, are not changed."""
    _fill(line, w, c, drum, work, False)


@inlined
def _fill(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load, slopes: bool) -> None:
    """Fill the residual and, if `slopes`, the matrix: compiled once for each."""
    node_velocities(line, w)
    N, held = line.ends.count, held_node(line)
    _clear(line, slopes)
    ahead = measured_chord(line.position[NEW], 1, length_at(line, NEW, 1))
    for j in range(1, N + 1):
        length, T = length_at(line, NEW, j), line.tension[NEW, j]
        select_section(line, c, j)
        wet_at_new(line, c, j)
        work.square, work.chord_length, work.shorter = ahead
        by_strain = _length_equation(line, j, T, w, c, work.square, slopes)
        take_segment(line.position[NEW], line.velocity[NEW], line.water[NEW], j, work)
        beyond = min(j + 1, N)
        ahead = measured_chord(line.position[NEW], beyond, length_at(line, NEW, beyond))
        evaluate_load(T, line.slip[j], line.normal_gain[j], w.a0, c, work)
        for i in range(3):
            work.q[i] -= line.forcing[j, i]
            # d(ℓp)/dt of the whole segment, and not ℓ dp/dt: only so does the one that grows keep its momentum. q has
            # the newest of the three levels, a₀p, already.
            line.momentum[NEW, j, i] = length * work.momentum[i]
            history = w.a1 * line.momentum[NOW, j, i] + w.a2 * line.momentum[BEFORE, j, i]
            line.load[j, i] = length * work.q[i] + history
        if slopes:
            differentiate_load(line.slip[j], w.a0, c, work)
        if j == held:
            add_influx(line, c, work)
        _add_balance(line, j, T, work)
        if slopes:
            if j < held:
                _scatter_balance(line, j, length, T, w.b0, c, work)
            else:
                differentiate_influx(line, length, w, T, c, work)
                _scatter_influx(line, T, length, work)
            _scatter_length(line, j, length, by_strain, work)
    _keep_tow_force(line, slopes)
    add_contact(line, c, w, slopes)
    add_bodies(line, c, w, slopes)
    if N > 1:
        _sharpen_tow_force(line)
    if line.ends.layout.free_end:
        add_drogue(line, w, slopes)
    else:
        drum_row(line, w, drum, work, slopes)
    add_bending(line, c)
    add_clamps(line, c)
    add_surface(line, c, w, slopes)
    if N == 1 and drum.control == FREE and not line.ends.layout.free_end:
        write_single_segment(line, work.chord)


@inlined
def _clear(line: Line, slopes: bool) -> None:
    """Set the residual to zero, and those blocks that are summed up."""
    for j in range(line.ends.count + 1):
        for i in range(4):
            line.rows[RESIDUAL, j, i] = 0.0
            for k in range(4 if slopes and j in (0, line.ends.count) else 0):
                line.blocks[LOWER, j, i, k] = 0.0
                line.blocks[DIAGONAL, j, i, k] = 0.0
                line.blocks[UPPER, j, i, k] = 0.0


@inlined
def _add_balance(line: Line, j: int, T: float, work: Load) -> None:
    """Add segment j to the balances of its two nodes: f + ½Q to the far one, −f + ½Q to the near one."""
    held, t, r = held_node(line), work.tangent, line.rows[RESIDUAL]
    # t points to the drum: T t pulls the near node on, and the far node back. The last segment has no far node to
    # balance where a drum is. Row 0 is what the vehicle has to balance, see `_keep_tow_force`.
    for i in range(3):
        f, half = T * t[i], 0.5 * line.load[j, i]
        if j < held:
            r[j, 1 + i] += f + half
        r[j - 1, 1 + i] += half - f


@inlined
def _scatter_balance(
    line: Line, j: int, length: float, T: float, b0: float, c: CableNumbers, work: Load
) -> None:
    """Write the derivatives of what `_add_balance` adds; segment j is the first that writes to D_j, L_j and U_{j−1}.

    ½Q changes with the tension by `stretched`, with the place of the near node by `near` and of the far one by `far`.
    """
    t, q_V, q_d, g = work.tangent, work.q_V, work.q_d, turning_rate(work.square)
    stiffness, stretch = T / work.chord_length, 0.5 * c.compliance / (1.0 + c.compliance * T)
    D, L, U = line.blocks[DIAGONAL, j], line.blocks[LOWER, j], line.blocks[UPPER, j - 1]
    before = line.blocks[DIAGONAL, j - 1]
    for i in range(3):
        stretched = 0.5 * (length * stretch * work.drag[i])
        D[1 + i, 0], U[1 + i, 0] = t[i] + stretched, stretched - t[i]
        for k in range(3):
            # ∂f/∂x = T ∂t/∂x: a taut chord can only turn, T (I − t tᵀ)/|d|; of a folded one t gets longer, too (g < 1).
            pull = stiffness * ((1.0 if i == k else 0.0) - g * t[i] * t[k])
            mean = 0.5 * b0 * q_V[i, k]
            near, far = 0.5 * (length * (mean - q_d[i, k])), 0.5 * (length * (mean + q_d[i, k]))
            D[1 + i, 1 + k], L[1 + i, 1 + k] = far + pull, near - pull
            U[1 + i, 1 + k] = far - pull
            before[1 + i, 1 + k] += near + pull


@inlined
def _scatter_influx(line: Line, T: float, length: float, work: Load) -> None:
    """Do the same for the last segment at a drum: its far node is fixed, and its second unknown is the length ℓ."""
    N, t, by_near, by_far = line.ends.count, work.tangent, work.by_near, work.by_far
    stiffness, g = T / work.chord_length, turning_rate(work.square)
    fading = fading_rate(work.square, length, work.chord_length)
    U, before = line.blocks[UPPER, N - 1], line.blocks[DIAGONAL, N - 1]
    for i in range(3):
        for k in range(4):
            pull = t[i] if k == 0 else -fading * T * t[i] if k == 1 else 0.0
            U[1 + i, k] = 0.5 * by_far[i, k] - pull
        for k in range(3):
            pull = stiffness * ((1.0 if i == k else 0.0) - g * t[i] * t[k])
            before[1 + i, 1 + k] += 0.5 * by_near[i, k] + pull


@inlined
def _keep_tow_force(line: Line, slopes: bool) -> None:
    """Take the force on the vehicle (12), and if `slopes` its derivatives, from row 0: it keeps the tow point there."""
    tow = line.ends.tow
    for i in range(3):
        tow.force[i] = -line.rows[RESIDUAL, 0, 1 + i]
        if slopes:
            for k in range(4):
                tow.by_block[i, k] = -line.blocks[UPPER, 0, 1 + i, k]
            for k in range(3):
                tow.by_tow[i, k] = -line.blocks[DIAGONAL, 0, 1 + i, 1 + k]


@inlined
def _sharpen_tow_force(line: Line) -> None:
    """Take the load of the first half segment at its own middle, a quarter into the segment, by extrapolation."""
    first, second = line.length[1], length_at(line, NEW, 2)
    # q(ℓ₁/4) on the line through q(ℓ₁/2) and q(ℓ₁ + ℓ₂/2), times ℓ₁/2, less what `_add_balance` took. Its slopes are
    # left out of `by_tow` and `by_block`: hull and cable agree on the force itself, those only say where to look.
    share = 0.25 * first * first / (first + second)
    for i in range(3):
        line.ends.tow.force[i] -= share * (line.load[1, i] / first - line.load[2, i] / second)


@inlined
def _length_equation(
    line: Line, j: int, T: float, w: Weights, c: CableNumbers, square: float, slopes: bool
) -> float:
    """Write the length equation of segment j, whose |d|²/ℓ² is `square`; return −2 ∂φ/∂(|d|²/ℓ²), which is ∂φ/∂σ."""
    stretch, damping = 1.0 + c.compliance * T, 1.0
    if c.retardation > 0.0:
        past, weight = _past_stretch(line, j, w)
        square, damping = damped_share(square, past, weight, c.retardation)
    phi, by_T, by_strain = slack_law(T, 0.5 * (stretch * stretch - square), line.ends.solver.smoothing)
    line.rows[RESIDUAL, j, 0] = phi
    if slopes:
        line.blocks[DIAGONAL, j, 0, 0] = by_T + by_strain * stretch * c.compliance
    return by_strain * damping if c.retardation > 0.0 else by_strain


@inlined
def _past_stretch(line: Line, j: int, w: Weights) -> tuple[float, float]:
    """Return what the stretch of segment j before adds to its rate, and the weight of the new one in it. [1/s].

    To first order where it was slack before: a difference of second order overshoots at that corner.
    """
    now, before = _stretch_at(line, NOW, j), _stretch_at(line, BEFORE, j)
    if w.a2 > 0.0 and now > 0.0 and before > 0.0:
        return w.a1 * now + w.a2 * before, w.a0
    return -w.first * now, w.first


@inlined
def _stretch_at(line: Line, level: int, j: int) -> float:
    """Return ε⁺ of segment j at a level; none of a last one that was not out of the drum then. [-]."""
    length = length_at(line, level, j)
    if length <= 0.0:
        return 0.0
    square, _, _ = measured_chord(line.position[level], j, length)
    return max(sqrt(square) - 1.0, 0.0)


@inlined
def _scatter_length(line: Line, j: int, length: float, by_strain: float, work: Load) -> None:
    """Write the derivatives of the length equation by the ends of segment j, and by its length."""
    scale, held = 1.0 / (length * length), held_node(line)
    for i in range(3):
        slope = by_strain * work.chord[i] * scale
        line.blocks[LOWER, j, 0, 1 + i] = slope
        if j < held:
            line.blocks[DIAGONAL, j, 0, 1 + i] = -slope
    if j == held:
        line.blocks[DIAGONAL, j, 0, 1] = by_strain * work.square / length


CORNER = 1e-9
"""Size of the rounding of both maxima. [m], [N]"""


@inner
def write_single_segment(line: Line, d: np.ndarray) -> None:
    """Replace both rows of the only block, whose second row holds the drum's equation (11)."""
    D, L = line.blocks[DIAGONAL, 1], line.blocks[LOWER, 1]
    r, T = line.rows[RESIDUAL, 1], line.tension[NEW, 1]
    # ℓ = max(|d|, ℓ_now): as long as the way to the drum, or slack and as long as it was.
    chord = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + CORNER * CORNER)
    longer, by_chord = _maximum(chord, line.ends.last_length[NOW])
    r[0] = line.ends.last_length[NEW] - longer
    D[0, 0], D[0, 1] = 0.0, 1.0
    # The drum's residual is T less what turns the drum: T − r is what (11) asks the segment for, and it cannot push.
    pull, by_pull = _maximum(T - r[1], 0.0)
    r[1] = T - pull
    D[1, 0] = 1.0 - by_pull * (1.0 - D[1, 0])
    D[1, 1] *= by_pull
    for i in range(3):
        L[0, 1 + i] = by_chord * d[i] / chord
        L[1, 1 + i] *= by_pull


@compiled
def _maximum(a: float, b: float) -> tuple[float, float]:
    """Return max(a, b), rounded off over `CORNER`, and its derivative by a."""
    s = sqrt((a - b) * (a - b) + CORNER * CORNER)
    return 0.5 * (a + b + s), 0.5 * (1.0 + (a - b) / s)


@inner
def add_drogue(line: Line, w: Weights, slopes: bool) -> None:
    """Add the drag of a drogue, ½ρC_dA |U| U, to the balance of the free end."""
    N, k, square = line.ends.count, line.ends.layout.tail_drag, 0.0
    J = line.water[NEW, N]
    for i in range(3):
        square += (line.velocity[NEW, N, i] - J[i]) ** 2
    size = np.sqrt(square)
    line.ends.drum_pull = k * square
    for i in range(3):
        U = line.velocity[NEW, N, i] - J[i]
        line.rows[RESIDUAL, N, 1 + i] += k * size * U
        if not slopes:
            continue
        line.blocks[DIAGONAL, N, 1 + i, 1 + i] += k * size * w.b0
        for m in range(3):
            slope = U * (line.velocity[NEW, N, m] - J[m]) / max(size, 1e-12)
            line.blocks[DIAGONAL, N, 1 + i, 1 + m] += k * slope * w.b0


@inner
def add_influx(line: Line, c: CableNumbers, work: Load) -> None:
    """Complete Q of the last segment by the momentum that enters at the drum, where `work.water` is from here on."""
    N, U, t, J = line.ends.count, line.ends.payout[NEW], work.tangent, work.water
    for i in range(3):  # the water at the drum, as the drum sees it
        J[i] = line.water[NEW, N, i] - line.ends.drum_velocity[i]
    Jt = J[0] * t[0] + J[1] * t[1] + J[2] * t[2]
    # p(S) = mV + ρA P (V − J). What enters moves along t but for the drum's own motion, and P leaves nothing that is
    # along t: of the added mass only the water that passes the drum is left.
    for i in range(3):
        entering = c.mass * line.velocity[NEW, N, i] - c.added_mass * (J[i] - Jt * t[i])
        entering -= mass_along(line, c) * line.water[NEW, N, i]
        line.load[N, i] -= U * entering


@inner
def differentiate_influx(
    line: Line, length: float, w: Weights, T: float, c: CableNumbers, work: Load
) -> None:
    """Fill ∂Q/∂x_{N−1} and ∂Q/∂(T, ℓ) of the last segment."""
    N, U, t, d = line.ends.count, line.ends.payout[NEW], work.tangent, work.chord
    by_near, by_far, J, r = work.by_near, work.by_far, work.water, work.chord_length
    g, fading = turning_rate(work.square), fading_rate(work.square, length, r)
    Jt = J[0] * t[0] + J[1] * t[1] + J[2] * t[2]
    dU = 0.0 if line.ends.drum_mode == STANDING else w.b0
    stretch = 0.5 * c.compliance / (1.0 + c.compliance * T)
    for i in range(3):
        entering = c.mass * line.velocity[NEW, N, i] - c.added_mass * (J[i] - Jt * t[i])
        entering -= mass_along(line, c) * line.water[NEW, N, i]
        by_far[i, 0] = length * stretch * work.drag[i]
        by_far[i, 1] = work.q[i] - dU * entering - U * c.mass * (U / length - dU) * d[i] / length
        by_far[i, 1] -= fading * (length * work.q_tt[i] - 2.0 * U * c.added_mass * Jt * t[i])
        by_far[i, 2] = 0.0
        by_far[i, 3] = 0.0
        for k in range(3):
            B = ((1.0 if i == k else 0.0) - g * t[i] * t[k]) / r
            across_k = J[k] - g * Jt * t[k]
            by_far[i, 1] += 0.5 * work.q_V[i, k] * (U / length - dU) * d[k]
            by_near[i, k] = length * (0.5 * (w.b0 + U / length) * work.q_V[i, k] - work.q_d[i, k])
            by_near[i, k] += U * c.added_mass * (Jt * B + t[i] * across_k / r)
        by_near[i, i] -= U * c.mass * U / length
