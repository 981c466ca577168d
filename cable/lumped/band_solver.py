"""A banded linear system, solved by elimination with row exchanges.

Row i of `band` holds the entries of columns i − REACH … i + REACH, and space for the fill-in of row exchanges. REACH
is eight: a node (three unknowns) feels its neighbours' neighbours through bending stiffness. Cost and memory grow
with the number of unknowns.
"""

from __future__ import annotations

import numpy as np

from subzero.jit import compiled, inner

REACH = 8
WIDTH = 3 * REACH + 1


@inner
def add(band: np.ndarray, row: int, column: int, value: float) -> None:
    """Add a value to one entry."""
    band[row, column - row + REACH] += value


@compiled
def solve_band(band: np.ndarray, right: np.ndarray, size: int) -> bool:
    """Solve the first `size` equations; `band` (rows, WIDTH) is used up, `right` (rows,) becomes the answer.

    Returns:
        whether there is one: False for a singular matrix.
    """
    for k in range(size):
        best, low = k, min(k + REACH, size - 1)
        for i in range(k + 1, low + 1):
            if abs(band[i, k - i + REACH]) > abs(band[best, k - best + REACH]):
                best = i
        if not abs(band[best, k - best + REACH]) > 0.0:
            return False
        last = min(k + 2 * REACH, size - 1)
        if best != k:
            _exchange(band, right, k, best, last)
        for i in range(k + 1, low + 1):
            factor = band[i, k - i + REACH] / band[k, REACH]
            if factor != 0.0:
                for j in range(k + 1, last + 1):
                    band[i, j - i + REACH] -= factor * band[k, j - k + REACH]
                right[i] -= factor * right[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, min(k + 2 * REACH, size - 1) + 1):
            right[k] -= band[k, j - k + REACH] * right[j]
        right[k] /= band[k, REACH]
    return True


@compiled
def _exchange(band: np.ndarray, right: np.ndarray, k: int, other: int, last: int) -> None:
    """Exchange rows k and `other` from column k to column `last`."""
    for j in range(k, last + 1):
        here, there = j - k + REACH, j - other + REACH
        band[k, here], band[other, there] = band[other, there], band[k, here]
    right[k], right[other] = right[other], right[k]
