"""Solve a block tridiagonal system with 4×4 blocks, in time and memory proportional to the number of blocks.

    L_j z_{j−1} + D_j z_j + U_j z_{j+1} = r_j,   j = 1 … N

One block holds the four unknowns of a cable segment: its tension and the position of its far node. Block Gauss
elimination runs from the drum to the tow point, with partial pivoting inside a block; between blocks none is needed,
because the part eliminated first is the piece of cable between the drum and a held node, which is a well-posed
problem. The first column of every L_j is zero (a node depends on its neighbour's position, not on the tension beyond
it).

The elimination ends at the tow point, so W_1 = D_1⁻¹ L_1 is the response of the first block to a displacement of the
tow point, with all the cable between it and the drum: the coupling to a vehicle gets that derivative at no cost.

Bending makes the system pentadiagonal (`factor_wide`): a balance then depends on the places of five nodes.

    K_j z_{j−2} + L_j z_{j−1} + D_j z_j + U_j z_{j+1} + V_j z_{j+2} = r_j,   j = 1 … N

Elimination from the drum to the tow point leaves z_j = b_j − W_j z_{j−1} − X_j z_{j−2} with

    U' = U_j − V_j W_{j+2},   D' = D_j − V_j X_{j+2} − U' W_{j+1},   W_j = D'⁻¹ (L_j − U' X_{j+1}),   X_j = D'⁻¹ K_j

W replaces L and X replaces K, so W_1 is again the response of the first block to a displacement of the tow point.
"""

from __future__ import annotations

import numpy as np

from subzero.jit import compiled, inlined, inner

SIZE = 4


@inlined
def factor_block(D: np.ndarray, pivots: np.ndarray) -> bool:
    """Factor a 4×4 block in place, with partial pivoting by rows; return False when it is singular.

    Multipliers are not moved by later row exchanges, so `solve_block` exchanges and eliminates in the same order;
    the diagonal holds the inverses of the pivots.
    """
    for k in range(SIZE):
        best = k
        # The largest entry of a column is its pivot: this keeps rounding errors small.
        for i in range(k + 1, SIZE):
            if abs(D[i, k]) > abs(D[best, k]):
                best = i
        pivots[k] = best
        if not abs(D[best, k]) > 0.0:
            return False
        if best != k:  # columns before k hold multipliers, which are not exchanged
            for c in range(k, SIZE):
                D[k, c], D[best, c] = D[best, c], D[k, c]
        inverse = 1.0 / D[k, k]
        D[k, k] = inverse  # the factors are used many times, and a multiplication is cheaper than a division
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
        if p != k:  # the exchanges of `factor_block`, in its order
            b[k], b[p] = b[p], b[k]
        for i in range(k + 1, SIZE):
            b[i] -= D[i, k] * b[k]
    for k in range(SIZE - 1, -1, -1):  # back substitution; the diagonal holds inverses
        for c in range(k + 1, SIZE):
            b[k] -= D[k, c] * b[c]
        b[k] *= D[k, k]


@inlined
def solve_columns(D: np.ndarray, pivots: np.ndarray, B: np.ndarray) -> None:
    """Overwrite the four columns of B (4, 4) with D⁻¹B, given the factored block, row by row."""
    for k in range(SIZE):  # the innermost loops run along rows, which are contiguous in memory
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


Row = tuple[float, float, float, float, float, float, float, float]
"""A row of D_j, followed by that of r_j, and of L_j without the column that is zero. Scalars are kept in registers,
unlike elements of an array, which halves the time."""
Four = tuple[float, float, float, float]
Block = tuple[Four, Four, Four, Four]
"""The rows of z_j, each followed by that of W_j without the column that is zero."""


@compiled
def solve(L: np.ndarray, D: np.ndarray, U: np.ndarray, last: int, r: np.ndarray) -> int:
    """Overwrite r (blocks, 4) with the solution of blocks 1 … last, and L_j with W_j = D_j⁻¹ L_j.

    The right-hand side takes the place of the zero column of L_j during the elimination, and is kept there.

    Returns:
        0 when done, else the index of the singular block.
    """
    nothing = (0.0, 0.0, 0.0, 0.0)
    W = (nothing, nothing, nothing, nothing)
    # From the drum to the tow point: this order needs no pivoting between blocks.
    for j in range(last, 0, -1):
        a, b = _row(D[j], L[j], r[j], 0), _row(D[j], L[j], r[j], 1)
        c, d = _row(D[j], L[j], r[j], 2), _row(D[j], L[j], r[j], 3)
        if j < last:  # a length knows the ends of its own segment only: row 0 of U is zero
            b, c, d = _less_next(b, U[j, 1], W), _less_next(c, U[j, 2], W), _less_next(d, U[j, 3], W)
        a, b, c, d = _eliminated(a, b, c, d)
        # Written so that NaN fails, too.
        if not (abs(a[0]) > 0.0 and abs(b[1]) > 0.0 and abs(c[2]) > 0.0 and abs(d[3]) > 0.0):
            return j
        W = _substituted(a, b, c, d)
        _keep(W, L[j], r[j])
    spread(L, last, r)  # back substitution; until here z_j lacks the part −W_j z_{j−1}
    return 0


@inlined
def _row(D: np.ndarray, L: np.ndarray, r: np.ndarray, i: int) -> Row:
    """Return row i of a block: D_j, then r_j, then L_j without its first column."""
    return D[i, 0], D[i, 1], D[i, 2], D[i, 3], r[i], L[i, 1], L[i, 2], L[i, 3]


@inlined
def _less_next(a: Row, u: np.ndarray, W: Block) -> Row:
    """Return a row of D_j − U_j W_{j+1} and of r_j − U_j z_{j+1}, from that of D_j and r_j, and that of U_j (4,)."""
    k, m, n, o = W
    return (
        a[0],
        a[1] - (u[0] * k[1] + u[1] * m[1] + u[2] * n[1] + u[3] * o[1]),
        a[2] - (u[0] * k[2] + u[1] * m[2] + u[2] * n[2] + u[3] * o[2]),
        a[3] - (u[0] * k[3] + u[1] * m[3] + u[2] * n[3] + u[3] * o[3]),
        a[4] - u[0] * k[0] - u[1] * m[0] - u[2] * n[0] - u[3] * o[0],
        a[5],
        a[6],
        a[7],
    )


@inlined
def _eliminated(a: Row, b: Row, c: Row, d: Row) -> tuple[Row, Row, Row, Row]:
    """Return four rows after the elimination, exchanged for size; entries below the diagonal are not meaningful."""
    if abs(b[0]) > abs(a[0]):
        a, b = b, a
    if abs(c[0]) > abs(a[0]):
        a, c = c, a
    if abs(d[0]) > abs(a[0]):
        a, d = d, a
    inverse = 1.0 / a[0]
    b, c, d = _less(b, b[0] * inverse, a), _less(c, c[0] * inverse, a), _less(d, d[0] * inverse, a)
    if abs(c[1]) > abs(b[1]):
        b, c = c, b
    if abs(d[1]) > abs(b[1]):
        b, d = d, b
    inverse = 1.0 / b[1]
    c, d = _less(c, c[1] * inverse, b), _less(d, d[1] * inverse, b)
    if abs(d[2]) > abs(c[2]):
        c, d = d, c
    return a, b, c, _less(d, d[2] * (1.0 / c[2]), c)


@inlined
def _less(a: Row, f: float, b: Row) -> Row:
    """Return a − f b."""
    front = a[0] - f * b[0], a[1] - f * b[1], a[2] - f * b[2], a[3] - f * b[3]
    k, m, n, o = _less_four(_behind(a), f, _behind(b))
    return front[0], front[1], front[2], front[3], k, m, n, o


@inlined
def _less_four(a: Four, f: float, b: Four) -> Four:
    """Return a − f b."""
    return a[0] - f * b[0], a[1] - f * b[1], a[2] - f * b[2], a[3] - f * b[3]


@inlined
def _behind(a: Row) -> Four:
    """Return the part of a row after D_j: r_j, then L_j without its first column."""
    return a[4], a[5], a[6], a[7]


@inlined
def _substituted(a: Row, b: Row, c: Row, d: Row) -> Block:
    """Return the solution of rows after their elimination, from the last one up."""
    o = _times(_behind(d), 1.0 / d[3])
    n = _times(_less_four(_behind(c), c[3], o), 1.0 / c[2])
    m = _times(_less_four(_less_four(_behind(b), b[2], n), b[3], o), 1.0 / b[1])
    k = _less_four(_less_four(_less_four(_behind(a), a[1], m), a[2], n), a[3], o)
    return _times(k, 1.0 / a[0]), m, n, o


@inlined
def _times(a: Four, f: float) -> Four:
    """Return f a."""
    return a[0] * f, a[1] * f, a[2] * f, a[3] * f


@inlined
def _keep(W: Block, L: np.ndarray, r: np.ndarray) -> None:
    """Write a solution to r_j (4,), and L_j (4, 4) with it in the column that is zero."""
    for i in range(SIZE):
        L[0, i], L[1, i], L[2, i], L[3, i] = W[0][i], W[1][i], W[2][i], W[3][i]
    r[0], r[1], r[2], r[3] = W[0][0], W[1][0], W[2][0], W[3][0]


@inlined
def spread(L: np.ndarray, last: int, r: np.ndarray) -> None:
    """Subtract W_j z_{j−1} from r_j for all blocks (blocks, 4), from the tow point to the drum."""
    for j in range(2, last + 1):
        for column in range(1, SIZE):
            for row in range(SIZE):
                r[j, row] -= L[j, row, column] * r[j - 1, column]


@inner
def factor_wide(blocks: np.ndarray, pivots: np.ndarray, last: int) -> int:
    """Factor blocks 1 … last of L, D, U, K, V (5, blocks, 4, 4) in place; return 0, or the index of a singular one."""
    L, D, U, K, V = blocks[0], blocks[1], blocks[2], blocks[3], blocks[4]
    for j in range(last, 0, -1):
        if j + 2 <= last:  # V_j first: it changes U_j to U', which the products below need
            _take_off(V[j], L[j + 2], U[j])
            _take_off(V[j], K[j + 2], D[j])
        if j + 1 <= last:
            _take_off(U[j], L[j + 1], D[j])
            _take_off(U[j], K[j + 1], L[j])
        if not factor_block(D[j], pivots[j]):
            return j
        solve_columns(D[j], pivots[j], L[j])  # W_j takes the place of L_j
        solve_columns(D[j], pivots[j], K[j])  # X_j takes the place of K_j
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
    """Overwrite r (blocks, 4) with the solution, given the factors from `factor_wide`."""
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
