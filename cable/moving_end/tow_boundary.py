"""The two ends of the cable: tensions there, and how the tow force, and all the cable, answers to the tow point."""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.moving_end.block_solver import SIZE, spread
from cable.moving_end.newton import go_from_guess, save_guess
from cable.moving_end.state import LOWER, NEW, RESIDUAL, Line
from subzero.jit import inner


@inner
def ends(line: Line) -> tuple[float, float]:
    """Return the tensions T(0) at the tow point and T(S) at the drum, of the last solved step. [N].

    T(0) is the size of the force (12); T(S) is the tension that drives the drum (11), with the drag and the inertia
    of the last half segment; a slack end has none.
    """
    F = line.ends.tow_force
    return sqrt(F[0] * F[0] + F[1] * F[1] + F[2] * F[2]), max(line.ends.drum_pull, 0.0)


@inner
def fill_node_tensions(line: Line) -> None:
    """Fill line.node_tension (nodes,) after a step: T_j + ½ t_j·Q_j at the far end of segment j. [N]."""
    N, x = line.ends.count, line.position
    line.node_tension[0], line.node_tension[N] = ends(line)
    for j in range(1, N):
        along, square = 0.0, 0.0
        for i in range(3):
            d = x[NEW, j, i] - x[NEW, j - 1, i]
            along += d * line.load[j, i]
            square += d * d
        line.node_tension[j] = max(line.tension[NEW, j] + 0.5 * along / sqrt(max(square, 1e-30)), 0.0)


@inner
def impedance(line: Line, Z: np.ndarray) -> None:
    """Fill Z = ∂F/∂x (3, 3), the change of the tow force by a displacement of the tow point at the end of the step.

    Taken from the last Newton matrix, the answer of the whole cable included. [N/m].
    """
    for i in range(3):
        for k in range(3):
            Z[i, k] = line.ends.tow_by_tow[i, k]
            for m in range(4):
                Z[i, k] -= line.ends.tow_by_block[i, m] * line.ends.tow_answer[k, m]


@inner
def follow_tow(line: Line, tow: np.ndarray) -> bool:
    """Move the tow point of the answer on level NEW, and all that moves with it by the factors of the last matrix.

    False, and nothing has moved, if there are none.
    """
    step, at, L = line.rows[RESIDUAL], line.position[NEW, 0], line.blocks[LOWER]
    if not line.ends.factored:
        return False
    for j in range(1, line.ends.count + 1):
        for m in range(SIZE):
            step[j, m] = 0.0
    for m in range(SIZE):
        for i in range(3):
            step[1, m] += L[1, 1 + i, m] * (tow[i] - at[i])
    spread(L, line.ends.count, step)
    go_from_guess(line, save_guess(line), 1.0)
    for i in range(3):
        at[i] = tow[i]
    return True
