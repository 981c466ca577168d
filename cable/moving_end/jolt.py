"""A tow point that changes its velocity at once: an impulse along the whole cable, separate from the time steps.

A cable that does not stretch has to follow at once. With ΔV the jump of the velocity of a node, τ the impulse of the
tension in a segment and ΔP = ℓ (m ΔV + ρA ΔV_⊥) that of its momentum,

    τ_j t_j − τ_{j+1} t_{j+1} + ½(ΔP_j + ΔP_{j+1}) = 0,     (ΔV_j − ΔV_{j−1})·t_j = 0

the equations of `assembly` in an infinitely short step: drag and weight have no part in it, positions do not
change. A time step that spreads this impulse over its length shows a peak, or a dip, of the tension that grows
without bound as the step gets shorter, and rings after it.

An impulse that pushes is a cable that gets slack for the time in which drag slows it down, −τ/T: 2 ms where the
turn of Fig. 5 ends. Up to `SLACK_FOR` it is taken at once too; where it is longer, as when a vehicle stops, nothing
is taken, and the cable gets slack step by step. A cable that stretches has no impulse: waves take it up.
"""

from __future__ import annotations

import numpy as np

from cable.drum import LENGTH, SPINNING, STANDING, TENSION, DrumNumbers
from cable.moving_end.block_solver import solve
from cable.moving_end.composition import add_body_masses
from cable.moving_end.segment_load import Load, segment_momentum
from cable.moving_end.slack_law import chord_length, squared_share
from cable.moving_end.state import (
    BEFORE,
    DIAGONAL,
    LOWER,
    NOW,
    RESIDUAL,
    UPPER,
    Line,
    length_at,
    select_section,
)
from cable.properties import CableNumbers
from subzero.jit import allocating, inlined, inner

FELT = 1e-6
"""A jump of the tow point's velocity smaller than this counts as zero. [m/s]"""
LOOSE = 1e-6
"""Loose cable shorter than this is rounding. [m]"""
SLACK_FOR = 0.01
"""A cable that would be slack for no longer is taken to follow at once. [s]"""


@allocating
def take_jolt(
    line: Line, change: np.ndarray, c: CableNumbers, drum: DrumNumbers, work: Load, out: np.ndarray
) -> bool:
    """Give a line, at level NOW, the velocities that it has just after a jolt; return whether it was taken.

    Args:
        line: the cable.
        change: jump of the tow point's velocity (3,). [m/s]
        c: cable.
        drum: drum or winch.
        work: work space.
        out: impulse on the vehicle (3,); zeros where none was taken. [N s]
    """
    for i in range(3):
        out[i] = 0.0
    size = max(abs(change[0]), abs(change[1]), abs(change[2]))
    # A cable that stretches takes a jolt up in waves; a free tail or a single segment is left to the time steps.
    if size < FELT or c.compliance > 0.0 or line.ends.count < 2 or line.ends.layout.free_end:
        return False
    tangents, masses = np.zeros((line.ends.count + 1, 3)), np.zeros((3, 3))
    _fill_tangents(line, tangents)
    _assemble(line, tangents, change, c, drum, masses)
    blocks, jump = line.blocks, line.rows[RESIDUAL]
    # The blocks of the time step are used as work space, so their factors are lost.
    line.ends.solver.factored = False
    if solve(blocks[LOWER], blocks[DIAGONAL], blocks[UPPER], line.ends.count, jump) > 0:
        return False
    # An impulse that pushes would make the cable slack: for longer than `SLACK_FOR`, it is left to the time steps.
    for j in range(1, line.ends.count + 1):
        if jump[j, 0] < -max(line.tension[NOW, j], 0.0) * SLACK_FOR:
            return False
    # Half of the mass of the first segment is at the tow point, and moves at the mean of two nodes: a quarter each.
    _mass(line, tangents, 1, c, masses)
    for i in range(3):
        out[i] = jump[1, 0] * tangents[1, i]
        for k in range(3):
            out[i] -= 0.25 * masses[i, k] * (change[k] + jump[1, 1 + k])
    _apply(line, tangents, change, c, work)
    return True


@inner
def _fill_tangents(line: Line, tangents: np.ndarray) -> None:
    """Fill the tangents of all segments (segments + 1, 3)."""
    for j in range(1, line.ends.count + 1):
        for i in range(3):
            tangents[j, i] = line.position[NOW, j, i] - line.position[NOW, j - 1, i]
        length = length_at(line, NOW, j)
        r = chord_length(squared_share(tangents[j], length), length)
        for i in range(3):
            tangents[j, i] /= r


@inner
def _mass(line: Line, tangents: np.ndarray, j: int, c: CableNumbers, out: np.ndarray) -> None:
    """Fill out (3, 3) with ∂P/∂V of segment j. [kg]."""
    length, t = length_at(line, NOW, j), tangents[j]
    select_section(line, c, j)
    for i in range(3):
        for k in range(3):
            out[i, k] = -length * c.added_mass * t[i] * t[k]
        out[i, i] += length * (c.mass + c.added_mass)


@inner
def _assemble(
    line: Line, tangents: np.ndarray, change: np.ndarray, c: CableNumbers, drum: DrumNumbers, M: np.ndarray
) -> None:
    """Fill matrix and right-hand side for the impulses and jumps of all blocks; ΔV_0 is `change`."""
    L, D, U = line.blocks[LOWER], line.blocks[DIAGONAL], line.blocks[UPPER]
    N, r = line.ends.count, line.rows[RESIDUAL]
    for j in range(1, N + 1):
        for i in range(4):
            r[j, i] = 0.0
            for k in range(4):
                L[j, i, k] = 0.0
                D[j, i, k] = 0.0
                U[j, i, k] = 0.0
    for j in range(1, N + 1):
        _mass(line, tangents, j, c, M)
        t = tangents[j]
        for i in range(3):
            # Row 0 of a block: the segment does not stretch, (ΔV_j − ΔV_{j−1})·t_j = 0.
            L[j, 0, 1 + i] = -t[i]
            if j < N:
                D[j, 0, 1 + i] = t[i]
                D[j, 1 + i, 0] += t[i]
            if j > 1:
                U[j - 1, 1 + i, 0] -= t[i]
            for k in range(3):
                # Half of a segment's mass at each node, times half of the velocity of each node.
                quarter = 0.25 * M[i, k]
                if j < N:
                    D[j, 1 + i, 1 + k] += quarter
                    L[j, 1 + i, 1 + k] += quarter
                if j > 1:
                    D[j - 1, 1 + i, 1 + k] += quarter
                    if j < N:
                        U[j - 1, 1 + i, 1 + k] += quarter
    _assemble_drum(line, tangents, M, drum)
    add_body_masses(line, c)
    # ΔV_0 is known: its column moves to the right-hand side.
    for m in range(4):
        for k in range(3):
            r[1, m] -= L[1, m, 1 + k] * change[k]


@inner
def _assemble_drum(line: Line, tangents: np.ndarray, M: np.ndarray, drum: DrumNumbers) -> None:
    """Fill the last block: ΔV_N = −ΔU t_N, and the drum's equation for τ_N and ΔU; `M` is that of the last segment."""
    N = line.ends.count
    t, D, L, U = tangents[N], line.blocks[DIAGONAL, N], line.blocks[LOWER, N], line.blocks[UPPER]
    mass = 0.0
    for i in range(3):
        Mt = 0.0
        for k in range(3):
            Mt += M[i, k] * t[k]
        mass += t[i] * Mt
        U[N - 1, 1 + i, 1] -= 0.25 * Mt
    # The last block has two unknowns, τ_N and ΔU; the other two rows are 0 = 0.
    D[0, 1], D[2, 2], D[3, 3] = -1.0, 1.0, 1.0
    if drum.control == LENGTH or line.ends.drum_mode == STANDING:
        D[1, 1] = 1.0
        return
    turned = drum.control != TENSION and not _is_ahead(line)
    D[1, 0], D[1, 1] = 1.0, -0.25 * mass - (drum.inertia if turned else 0.0)
    for i in range(3):
        for k in range(3):
            L[1, 1 + i] += 0.25 * t[k] * M[k, i]


@inlined
def _is_ahead(line: Line) -> bool:
    """Return whether loose cable keeps a jolt from the drum."""
    return line.ends.drum_mode == SPINNING and line.ends.loose[NOW] > LOOSE


@inner
def _apply(line: Line, tangents: np.ndarray, change: np.ndarray, c: CableNumbers, work: Load) -> None:
    """Add the jumps to the velocities of level NOW, and discard the levels before."""
    N, jump = line.ends.count, line.rows[RESIDUAL]
    for i in range(3):
        line.velocity[NOW, 0, i] += change[i]
        for j in range(1, N):
            line.velocity[NOW, j, i] += jump[j, 1 + i]
        line.velocity[NOW, N, i] -= jump[N, 1] * tangents[N, i]
    line.ends.payout[NOW] += jump[N, 1]
    line.ends.payout[BEFORE] = line.ends.payout[NOW]
    if _is_ahead(line):
        line.ends.ahead[NOW] -= jump[N, 1]
    line.ends.ahead[BEFORE] = line.ends.ahead[NOW]
    # Differences of second order across the jump would be wrong: the next step has no past.
    line.ends.previous_step = 0.0
    for j in range(1, N + 1):
        segment_momentum(line, NOW, j, c, work)
