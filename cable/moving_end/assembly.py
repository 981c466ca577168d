"""The equations of one step, and their analytic Jacobian, segment by segment.

Unknowns of block j: the tension T_j of segment j and the position x_j of its far node; of the last block: T_N and the
length ℓ_N of the growing segment (its far node sits at the drum). With f_j = T_j t_j and the segment's total load
Q_j = ∫(∂p/∂t + D − w_c k) ds, shared half and half by its two ends, the equations are

    balance of node j:      f_j − f_{j+1} + ½(Q_j + Q_{j+1}) = 0          (momentum of equation (7))
    length of segment j:    φ(T_j, ½(1 + eT_j)² − ½|x_j − x_{j−1}|²/ℓ_j²) = 0    (compatibility of (7), `slack_law`)
    drum:                   T_N + ½ t_N·Q_N = (I_d/R_d² dU/dt + C_f/R_d)  (11), U = dS/dt; see `cable.drum`

Nodes are where the velocity lives and segments where the tension lives, so neither can alternate from node to node.
The force on the vehicle (12) is f_1 − ½Q_1. What the last segment has of its own, at the drum or with a drogue, is in
`drum_boundary`; bending, which adds a shear force to f_j, in `bending`.

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

from cable.drum import FREE, STANDING
from cable.moving_end.bdf2 import Weights
from cable.moving_end.bending import add_bending
from cable.moving_end.drum_boundary import add_drogue, add_influx, differentiate_influx, drum_row
from cable.moving_end.segment_load import Load, differentiate_load, evaluate_load, fading_rate, turning_rate
from cable.moving_end.slack_law import slack_law
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
    take_segment,
)
from cable.properties import CableNumbers, DrumNumbers
from subzero.jit import compiled, inlined, inner


@inner
def node_velocities(line: Line, w: Weights) -> None:
    """Fill the velocities of all nodes and the pay-out rate at level NEW by backward differences."""
    x, V, N = line.position, line.velocity, line.ends.count
    for j in range(min(held_node(line), N + 1)):
        for i in range(3):
            V[NEW, j, i] = w.b0 * x[NEW, j, i] + w.b1 * x[NOW, j, i] + w.b2 * x[BEFORE, j, i]
            V[NEW, j, i] += w.b_now * V[NOW, j, i]
    last, U = line.ends.last_length, line.ends.payout
    U[NEW] = w.b0 * last[NEW] + w.b1 * last[NOW] + w.b2 * last[BEFORE] + w.b_now * U[NOW]
    if line.ends.drum_mode == STANDING:
        line.ends.payout[NEW] = 0.0
    if line.ends.free_end:
        return
    for i in range(3):
        chord = x[NEW, N, i] - x[NEW, N - 1, i]
        V[NEW, N, i] = line.ends.drum_velocity[i] - U[NEW] * chord / last[NEW]


@compiled
def assemble(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load) -> None:
    """Fill the residual and the block tridiagonal Jacobian at the present guess of level NEW."""
    _fill(line, w, c, drum, work, True)


@compiled
def assemble_residual(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load) -> None:
    """Fill the residual only; the matrix, or its factors, stay as they are."""
    _fill(line, w, c, drum, work, False)


@inlined
def _fill(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load, slopes: bool) -> None:
    """Fill the residual and, if `slopes`, the matrix: compiled once for each."""
    node_velocities(line, w)
    N, held = line.ends.count, held_node(line)
    _clear(line, slopes)
    for j in range(1, N + 1):
        length = line.ends.last_length[NEW] if j == N else line.length[j]
        T = line.tension[NEW, j]
        take_segment(line.position[NEW], line.velocity[NEW], line.water[NEW], j, work)
        evaluate_load(length, T, line.slip[j], line.normal_gain[j], w.a0, c, work)
        for i in range(3):
            work.q[i] -= line.forcing[j, i]
            line.momentum[NEW, j, i] = length * work.momentum[i]
            history = w.a1 * line.momentum[NOW, j, i] + w.a2 * line.momentum[BEFORE, j, i]
            line.load[j, i] = length * work.q[i] + history
        if slopes:
            differentiate_load(length, line.slip[j], w.a0, c, work)
        if j == held:
            add_influx(line, c, work)
        _add_balance(line, j, T, work)
        by_strain = _length_equation(line, j, T, length, c, work.chord, slopes)
        if slopes:
            if j < held:
                _differentiate_segment(length, w, T, c, work)
            else:
                differentiate_influx(line, length, w, T, c, work)
            _scatter_balance(line, j, T, length, work)
            _scatter_length(line, j, length, by_strain, work.chord)
    add_bending(line, c)
    if N > 1:
        _sharpen_tow_force(line)
    if line.ends.free_end:
        add_drogue(line, w, slopes)
    else:
        drum_row(line, w, drum, work, slopes)
    if N == 1 and drum.control == FREE and not line.ends.free_end:
        write_single_segment(line, work.chord)


@inlined
def _clear(line: Line, slopes: bool) -> None:
    """Set the residual to zero, and the matrix."""
    for j in range(1, line.ends.count + 1):
        for i in range(4):
            line.rows[RESIDUAL, j, i] = 0.0
            for k in range(4 if slopes else 0):
                line.blocks[LOWER, j, i, k] = 0.0
                line.blocks[DIAGONAL, j, i, k] = 0.0
                line.blocks[UPPER, j, i, k] = 0.0


@inlined
def _differentiate_segment(length: float, w: Weights, T: float, c: CableNumbers, work: Load) -> None:
    """Fill ∂Q/∂x of the near node (3, 3), and ∂Q/∂(T, x) of the far node (3, 4)."""
    by_near, by_far = work.by_near, work.by_far
    stretch = 0.5 * c.compliance / (1.0 + c.compliance * T)
    for i in range(3):
        by_far[i, 0] = length * stretch * work.drag[i]
        for k in range(3):
            mean = 0.5 * w.b0 * work.q_V[i, k]
            by_near[i, k] = length * (mean - work.q_d[i, k])
            by_far[i, 1 + k] = length * (mean + work.q_d[i, k])


@inlined
def _add_balance(line: Line, j: int, T: float, work: Load) -> None:
    """Add segment j to the balances of its two nodes: f + ½Q to the far one, −f + ½Q to the near one."""
    held, t, r = held_node(line), work.tangent, line.rows[RESIDUAL]
    for i in range(3):
        f, half = T * t[i], 0.5 * line.load[j, i]
        if j < held:
            r[j, 1 + i] += f + half
        if j > 1:
            r[j - 1, 1 + i] += half - f
        else:
            line.ends.tow_force[i] = f - half


@inlined
def _scatter_balance(line: Line, j: int, T: float, length: float, work: Load) -> None:
    """Add the derivatives of what `_add_balance` adds."""
    held, t, d = held_node(line), work.tangent, work.chord
    stiffness, g = T / work.chord_length, turning_rate(d, length)
    fading = fading_rate(d, length, work.chord_length) if j == held else 0.0
    by_near, by_far = work.by_near, work.by_far
    D, L, U = line.blocks[DIAGONAL], line.blocks[LOWER], line.blocks[UPPER]
    for i in range(3):
        if j < held:
            D[j, 1 + i, 0] += t[i]
        if j > 1:
            U[j - 1, 1 + i, 0] -= t[i]
        else:
            line.ends.tow_by_block[i, 0] = t[i]
        for k in range(4):
            far = 0.5 * by_far[i, k]
            pull = (
                stiffness * ((1.0 if i == k - 1 else 0.0) - g * t[i] * t[k - 1])
                if j < held and k > 0
                else 0.0
            )
            if j == held and k == 1:
                pull = -fading * T * t[i]
            if j < held:
                D[j, 1 + i, k] += far + pull
            if j > 1:
                U[j - 1, 1 + i, k] += far - pull
            else:
                line.ends.tow_by_block[i, k] = (t[i] if k == 0 else 0.0) + pull - far
        for k in range(3):
            near = 0.5 * by_near[i, k]
            pull = stiffness * ((1.0 if i == k else 0.0) - g * t[i] * t[k])
            if j < held:
                L[j, 1 + i, 1 + k] += near - pull
            if j > 1:
                D[j - 1, 1 + i, 1 + k] += near + pull
            else:
                line.ends.tow_by_tow[i, k] = -pull - near


@inlined
def _sharpen_tow_force(line: Line) -> None:
    """Take the load of the first half segment at its own middle, a quarter into the segment, by extrapolation."""
    first = line.length[1]
    second = line.ends.last_length[NEW] if line.ends.count == 2 else line.length[2]
    share = 0.25 * first * first / (first + second)
    for i in range(3):
        line.ends.tow_force[i] -= share * (line.load[1, i] / first - line.load[2, i] / second)


@inlined
def _length_equation(
    line: Line, j: int, T: float, length: float, c: CableNumbers, d: np.ndarray, slopes: bool
) -> float:
    """Write the length equation of segment j, the first row of its block; return ∂φ/∂σ."""
    square = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / (length * length)
    stretch = 1.0 + c.compliance * T
    phi, by_T, by_strain = slack_law(T, 0.5 * (stretch * stretch - square), line.ends.smoothing)
    line.rows[RESIDUAL, j, 0] = phi
    if slopes:
        line.blocks[DIAGONAL, j, 0, 0] = by_T + by_strain * stretch * c.compliance
    return by_strain


@inlined
def _scatter_length(line: Line, j: int, length: float, by_strain: float, d: np.ndarray) -> None:
    """Write the derivatives of the length equation by the ends of segment j, and by its length."""
    scale, held = 1.0 / (length * length), held_node(line)
    for i in range(3):
        slope = by_strain * d[i] * scale
        line.blocks[LOWER, j, 0, 1 + i] = slope
        if j < held:
            line.blocks[DIAGONAL, j, 0, 1 + i] = -slope
    if j == held:
        square = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * scale
        line.blocks[DIAGONAL, j, 0, 1] = by_strain * square / length


CORNER = 1e-9
"""Size of the rounding of both maxima. [m], [N]"""


@inner
def write_single_segment(line: Line, d: np.ndarray) -> None:
    """Replace both rows of the only block, whose second row holds the drum's equation (11)."""
    D, L = line.blocks[DIAGONAL, 1], line.blocks[LOWER, 1]
    r, T = line.rows[RESIDUAL, 1], line.tension[NEW, 1]
    chord = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + CORNER * CORNER)
    longer, by_chord = _maximum(chord, line.ends.last_length[NOW])
    r[0] = line.ends.last_length[NEW] - longer
    D[0, 0], D[0, 1] = 0.0, 1.0
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
