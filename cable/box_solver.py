"""Solve an almost block diagonal system of 6×6 blocks; time and memory grow with the number of nodes.

The box scheme couples two neighbouring nodes by six equations; three conditions hold at the vehicle and
three at the drum. Ordered from the vehicle to the drum the matrix is a staircase of blocks:

    ┌ 3 tow rows ┐
    │ six rows of box 1      │
                 │ six rows of box 2      │
                              …
                                          │ 3 drum rows │

A node arrives with three rows carried over from what lies before it; with the six rows of the next box
they form a window of 9 rows and 12 columns. Gauss elimination with row pivoting inside the window removes
the node's six columns and leaves three rows for the next node. Rows are scaled to a largest entry of one
first, so newtons and metres per second compete fairly.
"""

from __future__ import annotations

import numpy as np

from subzero.compiled import compiled

SIZE = 6
CARRIED = 3
WINDOW = 9
RIGHT = 12
"""Column of the right-hand side: 0-5 are the unknowns of the left node, 6-11 those of the right node."""


@compiled
def scale_row(window: np.ndarray, row: int) -> None:
    """Divide a row of the window by its largest coefficient."""
    largest = 0.0
    for column in range(RIGHT):
        largest = max(largest, abs(window[row, column]))
    if largest > 0.0:
        for column in range(RIGHT + 1):
            window[row, column] /= largest


@compiled
def eliminate(window: np.ndarray, rows: int, factor: np.ndarray) -> bool:
    """Remove the left node's six columns from the window, and keep its six pivot rows in `factor` (6,
    13).

    Args:
        window: (9, 13); rows beyond `rows` are not looked at. Overwritten; its last rows are left for
        `carry`. rows: 9 in a box, 6 at the drum. factor: filled with the pivot rows, upper triangular
        in the first six columns.

    Returns:
        False when no pivot is left: the equations do not determine the node.
    """
    for row in range(rows):
        scale_row(window, row)
    for k in range(SIZE):
        best = k
        for row in range(k + 1, rows):
            if abs(window[row, k]) > abs(window[best, k]):
                best = row
        if not abs(window[best, k]) > 0.0:
            return False
        for column in range(k, RIGHT + 1):
            factor[k, column] = window[best, column]
            window[best, column] = window[k, column]
        for row in range(k + 1, rows):
            ratio = window[row, k] / factor[k, k]
            if ratio != 0.0:
                for column in range(k + 1, RIGHT + 1):
                    window[row, column] -= ratio * factor[k, column]
    return True


@compiled
def carry(window: np.ndarray) -> None:
    """Move the three rows left by `eliminate` to the top, as rows of the next node; clear the others."""
    for row in range(CARRIED):
        for column in range(SIZE):
            window[row, column] = window[SIZE + row, SIZE + column]
            window[row, SIZE + column] = 0.0
        window[row, RIGHT] = window[SIZE + row, RIGHT]
    for row in range(CARRIED, WINDOW):
        for column in range(RIGHT + 1):
            window[row, column] = 0.0


@compiled
def back_substitute(factors: np.ndarray, count: int, out: np.ndarray) -> None:
    """Solve for all nodes from the drum to the vehicle, given the pivot rows of each; fills out (count,
    6).""" for j in range(count - 1, -1, -1):
        for k in range(SIZE - 1, -1, -1):
            value = factors[j, k, RIGHT]
            for column in range(k + 1, SIZE):
                value -= factors[j, k, column] * out[j, column]
            if j < count - 1:
                for column in range(SIZE):
                    value -= factors[j, k, SIZE + column] * out[j + 1, column]
            out[j, k] = value / factors[j, k, k]
