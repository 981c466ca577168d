"""Solve an almost block diagonal system of 6×6 blocks; time and memory grow with the number of nodes.

The box scheme couples two neighbouring nodes by six equations; three conditions hold at the vehicle and
three at the drum. Ordered from the vehicle to the drum the matrix is a staircase of blocks:

    ┌ 3 tow rows ┐
    │ six rows of box 1      │
                 │ six rows of box 2      │
                              …
                                          │ 3 drum rows │

A node arrives with three rows carried over from what lies before it. They are eliminated first, exchanging
*columns* for size: they fix three of the node's unknowns. The six rows of the next box, exchanging *rows*,
fix the other three, and leave three rows for the next node (the alternate row and column elimination of
Varah, 1976). That order matters: rows of the box alone could fix all six as well, but then the solution is
marched backwards along the cable and the modes that decay towards the drum explode; pivoting by size over
the nine rows did exactly that on 150 nodes 0.1 m apart (errors of 1e3 in the first node).

Rows are scaled to a largest entry of one first, so newtons and metres per second compete fairly.
"""

from __future__ import annotations

import numpy as np

from subzero.jit import compiled

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
def exchange_columns(window: np.ndarray, rows: int, order: np.ndarray, k: int, best: int) -> None:
    """Exchange two unknowns of the left node and note it in `order` (6,)."""
    order[k], order[best] = order[best], order[k]
    for row in range(rows):
        window[row, k], window[row, best] = window[row, best], window[row, k]


@compiled
def exchange_rows(window: np.ndarray, k: int, best: int) -> None:
    """Exchange two rows of the window."""
    for column in range(RIGHT + 1):
        window[k, column], window[best, column] = window[best, column], window[k, column]


@compiled
def remove_column(window: np.ndarray, rows: int, k: int) -> bool:
    """Eliminate unknown k from the rows below row k; False when its pivot is zero or not a number."""
    pivot = window[k, k]
    if not abs(pivot) > 0.0:
        return False
    for row in range(k + 1, rows):
        ratio = window[row, k] / pivot
        if ratio != 0.0:
            for column in range(k + 1, RIGHT + 1):
                window[row, column] -= ratio * window[k, column]
    return True


@compiled
def eliminate(window: np.ndarray, rows: int, factor: np.ndarray, order: np.ndarray) -> bool:
    """Remove the left node's six columns from the window; keep its six pivot rows.

    Args:
        window: (9, 13); rows beyond `rows` are not looked at. Overwritten; the last rows wait for `carry`.
        rows: 9 in a box, 6 at the drum.
        factor: filled with the pivot rows, upper triangular in the first six columns. (6, 13)
        order: filled with the order in which the node's unknowns were eliminated. (6,)

    Returns:
        False when no pivot is left: the equations do not determine the node.
    """
    for row in range(rows):
        scale_row(window, row)
    for k in range(SIZE):
        order[k] = k
    for k in range(SIZE):
        best = k
        if k < CARRIED:
            for column in range(k + 1, SIZE):
                best = column if abs(window[k, column]) > abs(window[k, best]) else best
            exchange_columns(window, rows, order, k, best)
        else:
            for row in range(k + 1, rows):
                best = row if abs(window[row, k]) > abs(window[best, k]) else best
            exchange_rows(window, k, best)
        if not remove_column(window, rows, k):
            return False
    for k in range(SIZE):
        for column in range(RIGHT + 1):
            factor[k, column] = window[k, column]
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
def back_substitute(factors: np.ndarray, orders: np.ndarray, count: int, out: np.ndarray) -> None:
    """Solve for all nodes from the drum to the vehicle, given what `eliminate` kept; fill out (count, 6)."""
    for j in range(count - 1, -1, -1):
        for k in range(SIZE - 1, -1, -1):
            value = factors[j, k, RIGHT]
            for column in range(k + 1, SIZE):
                value -= factors[j, k, column] * out[j, orders[j, column]]
            if j < count - 1:
                for column in range(SIZE):
                    value -= factors[j, k, SIZE + column] * out[j + 1, column]
            out[j, orders[j, k]] = value / factors[j, k, k]
