"""Solve a block pentadiagonal system with 4×4 blocks: what bending makes of the tridiagonal one of `cable.blocks`.

    K_j z_{j−2} + L_j z_{j−1} + D_j z_j + U_j z_{j+1} + V_j z_{j+2} = r_j,   j = 1 … N

Elimination from the drum to the tow point leaves z_j = b_j − W_j z_{j−1} − X_j z_{j−2} with

    U' = U_j − V_j W_{j+2},   D' = D_j − V_j X_{j+2} − U' W_{j+1},   W_j = D'⁻¹ (L_j − U' X_{j+1}),   X_j = D'⁻¹ K_j

W replaces L and X replaces K, both transposed as in `cable.blocks`, so W_1 still tells how the first block answers to
the tow point.
"""

from __future__ import annotations

import numpy as np

from cable.blocks import SIZE, factor_block, solve_block, transpose
from subzero.jit import compiled, inner


@inner
def factor_wide(blocks: np.ndarray, pivots: np.ndarray, last: int) -> int:
    """Factor blocks 1 … last of L, D, U, K, V (5, blocks, 4, 4) in place; return 0, or the index of a singular one."""
    L, D, U, K, V = blocks[0], blocks[1], blocks[2], blocks[3], blocks[4]
    for j in range(last, 0, -1):
        if j + 2 <= last:
            _take_off(V[j], L[j + 2], U[j])
            _take_off(V[j], K[j + 2], D[j])
        if j + 1 <= last:
            _take_off(U[j], L[j + 1], D[j])
            _take_off(U[j], K[j + 1], L[j])
        if not factor_block(D[j], pivots[j]):
            return j
        transpose(L[j])
        transpose(K[j])
        for column in range(SIZE):
            solve_block(D[j], pivots[j], L[j, column])
            solve_block(D[j], pivots[j], K[j, column])
    return 0


@compiled
def _take_off(A: np.ndarray, transposed: np.ndarray, out: np.ndarray) -> None:
    """Take A·B off `out`, given Bᵀ."""
    for row in range(SIZE):
        for column in range(SIZE):
            total = 0.0
            for k in range(SIZE):
                total += A[row, k] * transposed[column, k]
            out[row, column] -= total


@inner
def solve_wide(blocks: np.ndarray, pivots: np.ndarray, last: int, r: np.ndarray) -> None:
    """Overwrite r (blocks, 4) with the solution, given what `factor_wide` left."""
    L, D, U, K, V = blocks[0], blocks[1], blocks[2], blocks[3], blocks[4]
    for j in range(last, 0, -1):
        for row in range(SIZE):
            for k in range(SIZE):
                if j + 1 <= last:
                    r[j, row] -= U[j, row, k] * r[j + 1, k]
                if j + 2 <= last:
                    r[j, row] -= V[j, row, k] * r[j + 2, k]
        solve_block(D[j], pivots[j], r[j])
    for j in range(2, last + 1):
        for column in range(SIZE):
            for row in range(SIZE):
                r[j, row] -= L[j, column, row] * r[j - 1, column]
                if j > 2:
                    r[j, row] -= K[j, column, row] * r[j - 2, column]
