"""Solve a block tridiagonal system with 4×4 blocks, in time and memory proportional to the number of blocks.

    L_j z_{j−1} + D_j z_j + U_j z_{j+1} = r_j,   j = 1 … N

One block holds the four unknowns of a cable segment: its tension and the position of its far node. Block Gauss
elimination runs from the drum to the tow point, with partial pivoting inside a block; between blocks none is needed,
because what is eliminated first is the piece of cable between the drum and a held node, a well-posed problem by
itself. The first column of every L_j is zero (a node knows its neighbour's position, not the tension beyond it).

The elimination ends at the tow point, so W_1 = D_1⁻¹ L_1 tells how the first block answers to a displacement of
the tow point, all cable behind it included: the coupling to a vehicle gets that derivative for nothing.

Bending makes it pentadiagonal (`factor_wide`): a balance then knows the places of five nodes.

    K_j z_{j−2} + L_j z_{j−1} + D_j z_j + U_j z_{j+1} + V_j z_{j+2} = r_j,   j = 1 … N

Elimination from the drum to the tow point leaves z_j = b_j − W_j z_{j−1} − X_j z_{j−2} with

    U' = U_j − V_j W_{j+2},   D' = D_j − V_j X_{j+2} − U' W_{j+1},   W_j = D'⁻¹ (L_j − U' X_{j+1}),   X_j = D'⁻¹ K_j

W replaces L and X replaces K, so W_1 still tells how the first block answers to the tow
point.
"""

from __future__ import annotations

import numpy as np

from subzero.jit import compiled, inlined, inner

SIZE = 4


@inlined
def factor_block(D: np.ndarray, pivots: np.ndarray) -> bool:
    """Factor a 4×4 block in place by rows exchanged for size; return False when it is singular.

    Multipliers stay in the row they were made in, so `solve_block` exchanges and eliminates in the same order;
    the diagonal keeps the inverses of the pivots.
    """
    for k in range(SIZE):
        best = k
        for i in range(k + 1, SIZE):
            if abs(D[i, k]) > abs(D[best, k]):
                best = i
        pivots[k] = best
        if not abs(D[best, k]) > 0.0:
            return False
        if best != k:
            for c in range(k, SIZE):
                D[k, c], D[best, c] = D[best, c], D[k, c]
        inverse = 1.0 / D[k, k]
        D[k, k] = inverse  # what solves with it, many times, multiplies
        for i in range(k + 1, SIZE):
            D[i, k] *= inverse
            for c in range(k + 1, SIZE):
                D[i, c] -= D[i, k] * D[k, c]
    return True


@inlined
def solve_block(D: np.ndarray, pivots: np.ndarray, b: np.ndarray) -> None:
    """Overwrite the right-hand side b (4,) with the solution of the factored block."""
    for k in range(SIZE):
        p = pivots[k]
        if p != k:
            b[k], b[p] = b[p], b[k]
        for i in range(k + 1, SIZE):
            b[i] -= D[i, k] * b[k]
    for k in range(SIZE - 1, -1, -1):
        for c in range(k + 1, SIZE):
            b[k] -= D[k, c] * b[c]
        b[k] *= D[k, k]


@inlined
def solve_columns(D: np.ndarray, pivots: np.ndarray, B: np.ndarray) -> None:
    """Do that with all four columns of B (4, 4), row by row."""
    for k in range(SIZE):
        p = pivots[k]
        if p != k:
            for m in range(SIZE):
                B[k, m], B[p, m] = B[p, m], B[k, m]
        for i in range(k + 1, SIZE):
            for m in range(SIZE):
                B[i, m] -= D[i, k] * B[k, m]
    for k in range(SIZE - 1, -1, -1):
        for c in range(k + 1, SIZE):
            for m in range(SIZE):
                B[k, m] -= D[k, c] * B[c, m]
        for m in range(SIZE):
            B[k, m] *= D[k, k]


@compiled
def solve(L: np.ndarray, D: np.ndarray, U: np.ndarray, pivots: np.ndarray, last: int, r: np.ndarray) -> int:
    """Overwrite r (blocks, 4) with the solution of blocks 1 … last, and L_j with W_j = D_j⁻¹ L_j, D_j factored.

    The right-hand side goes through the elimination as the column of L_j that is zero, and stays there.

    Returns:
        0 when done, else the index of the singular block.
    """
    for j in range(last, 0, -1):
        for row in range(SIZE):
            L[j, row, 0] = r[j, row]
        # D_j − U_j W_{j+1}, without what is zero: a length knows the ends of its own segment only (row 0 of U).
        for row in range(1 if j < last else SIZE, SIZE):
            for k in range(SIZE):
                L[j, row, 0] -= U[j, row, k] * L[j + 1, k, 0]
            for column in range(1, SIZE):
                total = 0.0
                for k in range(SIZE):
                    total += U[j, row, k] * L[j + 1, k, column]
                D[j, row, column] -= total
        if not factor_block(D[j], pivots[j]):
            return j
        solve_columns(D[j], pivots[j], L[j])
        for row in range(SIZE):
            r[j, row] = L[j, row, 0]
    spread(L, last, r)
    return 0


@inlined
def spread(L: np.ndarray, last: int, r: np.ndarray) -> None:
    """Take what each block does to the next off r (blocks, 4), from the tow point to the drum: z_j −= W_j z_{j−1}."""
    for j in range(2, last + 1):
        for column in range(1, SIZE):
            for row in range(SIZE):
                r[j, row] -= L[j, row, column] * r[j - 1, column]


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
        solve_columns(D[j], pivots[j], L[j])
        solve_columns(D[j], pivots[j], K[j])
    return 0


@compiled
def _take_off(A: np.ndarray, B: np.ndarray, out: np.ndarray) -> None:
    """Take A·B off `out`."""
    for row in range(SIZE):
        for column in range(SIZE):
            total = 0.0
            for k in range(SIZE):
                total += A[row, k] * B[k, column]
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
                r[j, row] -= L[j, row, column] * r[j - 1, column]
                if j > 2:
                    r[j, row] -= K[j, row, column] * r[j - 2, column]
