"""Bending: a cable with a bending stiffness EI resists curvature, also where it is slack.

The bending energy of a chain of straight segments with tangents t_j, and the shear force in segment j that follows:

    E_B = Σ ½ EI |t_{j+1} − t_j|²/ℓ̄_j,   M_j = EI (t_{j+1} − t_j)/ℓ̄_j,   q_j = P_j (M_j − M_{j−1})/|d_j|

with ℓ̄_j = ½(ℓ_j + ℓ_{j+1}), and no moment at the two ends unless they are clamped (`cable.clamps`): then
q = k P t_c/|d| more in the first or last segment. f_j of `assembly` becomes T_j t_j − q_j; for a gently bent cable q is
EI ∂³x/∂s³. It depends on four nodes, so a balance depends on five: the matrix gets two blocks more than its three
diagonals. ℓ̄ of the growing segment is taken from the step before. A cable without EI compiles nothing of this.

What it does not do: a cable cannot be pushed here (`slack_law`), stiff or not. Where a winch pays out more than is
taken, while less is in the water than the length (EI/w_c)^⅓ in which weight begins to bend it, a stiff cable would
push; such a run stops.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.moving_end.block_solver import factor_wide, solve, solve_wide
from cable.moving_end.state import (
    DIAGONAL,
    LOWER,
    LOWER2,
    NEW,
    NOW,
    RESIDUAL,
    UPPER,
    UPPER2,
    Line,
    held_node,
    length_at,
    no_change,
    no_energy,
)
from cable.properties import CableNumbers, ClampedCableNumbers, StiffCableNumbers
from subzero.jit import allocating, by_field, compiled, inner


@inner
def _add_bending(line: Line, c: StiffCableNumbers) -> None:
    """Add the shear forces to the balances and the tow force, and their derivatives to the matrix."""
    _bend(line, c.bending_stiffness)


@allocating
def _bend(line: Line, stiffness: float) -> None:
    """Add bending for all segments; the compiled part of `_add_bending`."""
    # `assemble` fills the three inner diagonals; the outer two are filled here only.
    for j in range(1, line.ends.count + 1):
        for i in range(4):
            for k in range(4):
                line.blocks[LOWER2, j, i, k] = 0.0
                line.blocks[UPPER2, j, i, k] = 0.0
    tangents, chords = np.empty((3, 3)), np.empty(3)
    for j in range(1, line.ends.count + 1):
        # Segments j−1, j and j+1; those beyond the ends get zero tangents, and no moment.
        for side in range(3):
            _tangent(line, j + side - 1, side, tangents, chords)
        _add_shear(line, j, stiffness, tangents, chords)


@compiled
def _tangent(line: Line, j: int, side: int, tangents: np.ndarray, chords: np.ndarray) -> None:
    """Fill tangent and chord length of segment j; zeros where there is none."""
    square, x = 0.0, line.position[NEW]
    inside = 1 <= j <= line.ends.count
    for i in range(3):
        tangents[side, i] = x[j, i] - x[j - 1, i] if inside else 0.0
        square += tangents[side, i] ** 2
    chords[side] = sqrt(max(square, 1e-30))
    for i in range(3):
        tangents[side, i] /= chords[side]


@compiled
def _spring(line: Line, j: int, stiffness: float) -> float:
    """Return EI/ℓ̄_j of the hinge at node j; none at the ends. [N m]."""
    N = line.ends.count
    if j < 1 or j >= N:
        return 0.0
    # The length of level NOW, since ℓ̄ of the growing segment is taken from the step before.
    return 2.0 * stiffness / (line.length[j] + length_at(line, NOW, j + 1))


@allocating
def _add_shear(line: Line, j: int, stiffness: float, t: np.ndarray, r: np.ndarray) -> None:
    """Add q_j to the nodes j and j−1; t and r are tangents and chords of segments j−1, j and j+1."""
    near, far = _spring(line, j - 1, stiffness), _spring(line, j, stiffness)
    m, q, along = np.empty(3), np.empty(3), 0.0
    for i in range(3):
        m[i] = far * (t[2, i] - t[1, i]) - near * (t[1, i] - t[0, i])
        along += t[1, i] * m[i]
    for i in range(3):
        # The part of m along the tangent is not a shear force.
        q[i] = (m[i] - along * t[1, i]) / r[1]
        _add_to_balances(line, j, i, q[i])
    before_after_0, before_after_2 = 0.0, 0.0
    for i in range(3):
        before_after_0 += t[1, i] * t[0, i]
        before_after_2 += t[1, i] * t[2, i]
    for i in range(3):
        for k in range(3):
            # P projects onto the plane across segment j; A, B and C are derivatives by the chords j−1, j and j+1.
            P = (1.0 if i == k else 0.0) - t[1, i] * t[1, k]
            to_0 = P - t[0, k] * (t[0, i] - t[1, i] * before_after_0)
            to_2 = P - t[2, k] * (t[2, i] - t[1, i] * before_after_2)
            A, C = near * to_0 / (r[1] * r[0]), far * to_2 / (r[1] * r[2])
            B = -((near + far) * P + along * P) / (r[1] * r[1]) - (t[1, i] * q[k] + q[i] * t[1, k]) / r[1]
            _add_to_matrix(line, j, i, k, A, B, C)


@compiled
def _add_to_balances(line: Line, j: int, i: int, q: float) -> None:
    """Add a component of q_j: −q to node j, +q to node j−1, −q to the forces at the ends."""
    # The place of the held node is known: it has no balance.
    if j < held_node(line):
        line.rows[RESIDUAL, j, 1 + i] -= q
    else:
        line.ends.drum_force[i] -= q
    if j > 1:
        line.rows[RESIDUAL, j - 1, 1 + i] += q
    else:
        line.ends.tow.force[i] -= q


@compiled
def _add_to_matrix(line: Line, j: int, i: int, k: int, A: float, B: float, C: float) -> None:
    """Add the derivatives of a component of q_j by the chords j−1 (A), j (B) and j+1 (C)."""
    held, row, column = held_node(line), 1 + i, 1 + k
    # A chord is the difference of two nodes, so a derivative by a chord enters the columns of both.
    if j < held:
        line.blocks[LOWER2, j, row, column] += A
        line.blocks[LOWER, j, row, column] += B - A
        line.blocks[DIAGONAL, j, row, column] += C - B
        if j + 1 < held:
            line.blocks[UPPER, j, row, column] -= C
    if j > 1:
        line.blocks[LOWER, j - 1, row, column] -= A
        line.blocks[DIAGONAL, j - 1, row, column] += A - B
        if j < held:
            line.blocks[UPPER, j - 1, row, column] += B - C
        if j + 1 < held:
            line.blocks[UPPER2, j - 1, row, column] += C
    else:
        line.ends.tow.by_tow[i, k] += B
        if j < held:
            line.ends.tow.by_block[i, column] -= B - C


@inner
def _end_spring(line: Line, c: ClampedCableNumbers, end: int) -> tuple[int, float]:
    """Return the segment at an end and k of its clamp. [N m]"""
    j = line.ends.count if end else 1
    return j, 2.0 * c.bending_stiffness / length_at(line, NOW, j)


@inner
def _add_clamps(line: Line, c: ClampedCableNumbers) -> None:
    """Add the clamps of both ends."""
    _clamp(line, c)


@allocating
def _clamp(line: Line, c: ClampedCableNumbers) -> None:
    """Add the shear forces q = k P t_c/|d| of clamped ends, and their derivatives by the chord."""
    t, r, q, clamp = np.empty((3, 3)), np.empty(3), np.empty(3), c.clamp
    for end in range(2):
        j, k = _end_spring(line, c, end)
        _tangent(line, j, 1, t, r)
        along = t[1, 0] * clamp[end, 0] + t[1, 1] * clamp[end, 1] + t[1, 2] * clamp[end, 2]
        for i in range(3):
            q[i] = k * (clamp[end, i] - along * t[1, i]) / r[1]
            _add_to_balances(line, j, i, q[i])
        for i in range(3):
            for m in range(3):
                P = (1.0 if i == m else 0.0) - t[1, i] * t[1, m]
                B = -k * along * P / (r[1] * r[1]) - (t[1, i] * q[m] + q[i] * t[1, m]) / r[1]
                _add_to_matrix(line, j, i, m, 0.0, B, 0.0)


@inner
def _clamp_energy(line: Line, c: ClampedCableNumbers) -> float:
    """Return E_c of both ends at level NOW. [J]."""
    total, x = 0.0, line.position[NOW]
    for end in range(2):
        j, k = _end_spring(line, c, end)
        size, square, along = 0.0, 0.0, 0.0
        for i in range(3):
            d = x[j, i] - x[j - 1, i]
            size += d * d
            square += c.clamp[end, i] ** 2
            along += d * c.clamp[end, i]
        total += k * (square - along / sqrt(max(size, 1e-30)))
    return total


@inner
def _energy(line: Line, c: StiffCableNumbers) -> float:
    """Return E_B at level NOW. [J]."""
    total, x = 0.0, line.position[NOW]
    for j in range(1, line.ends.count):
        near, far, along = 0.0, 0.0, 0.0
        for i in range(3):
            near += (x[j, i] - x[j - 1, i]) ** 2
            far += (x[j + 1, i] - x[j, i]) ** 2
            along += (x[j, i] - x[j - 1, i]) * (x[j + 1, i] - x[j, i])
        total += _spring(line, j, c.bending_stiffness) * (1.0 - along / sqrt(max(near * far, 1e-30)))
    return total


@inner
def _solve(line: Line, c: CableNumbers) -> bool:
    """Overwrite the residual with the Newton step, and the matrix with its factors; False where it is singular."""
    L, D, U = line.blocks[LOWER], line.blocks[DIAGONAL], line.blocks[UPPER]
    if solve(L, D, U, line.ends.count, line.rows[RESIDUAL]) > 0:
        return False
    keep_tow_answer(line)
    return True


@inner
def _stiff_solve(line: Line, c: StiffCableNumbers) -> bool:
    """Solve like `_solve`, with five diagonals of blocks."""
    if factor_wide(line.blocks, line.pivots, line.ends.count) > 0:
        return False
    solve_wide(line.blocks, line.pivots, line.ends.count, line.rows[RESIDUAL])
    keep_tow_answer(line)
    return True


@inner
def _has_residual(line: Line, c: CableNumbers) -> bool:
    """Return whether a residual can be computed without the matrix: not for a single segment, which has its own
    equations.
    """
    return line.ends.count > 1


@inner
def _no_residual(line: Line, c: StiffCableNumbers) -> bool:
    """Return False: bending fills residual and matrix at once."""
    return False


@inner
def keep_tow_answer(line: Line) -> None:
    """Keep W_1 of the elimination (`block_solver`), before the next assembly overwrites it."""
    for k in range(3):
        for m in range(4):
            line.ends.tow.answer[k, m] = line.blocks[LOWER, 1, m, 1 + k]


add_bending = by_field("bending_stiffness", _add_bending, no_change)
solve_for_step = by_field("bending_stiffness", _stiff_solve, _solve)
has_residual = by_field("bending_stiffness", _no_residual, _has_residual)
bending_energy = by_field("bending_stiffness", _energy, no_energy)
add_clamps = by_field("clamp", _add_clamps, no_change)
clamp_energy = by_field("clamp", _clamp_energy, no_energy)
