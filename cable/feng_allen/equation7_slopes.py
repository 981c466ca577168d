"""How M, N and q of equation (7) change with y: what Newton's method needs beside the matrices
themselves.

For a fixed vector x the functions fill ∂(M(y) x)/∂y and ∂(N(y) x)/∂y, shape (6, 6), row = equation,
column = unknown, and ∂q/∂y. Only entries that can differ from zero are set, so the caller hands in
arrays that were zero once. Checked against differences in ``tests/exact/test_equation7.py``.

The current's local components follow the frame: ∂Jt/∂α = −Jb cosβ, ∂Jn/∂α = Jb sinβ,
∂Jb/∂α = Jt cosβ − Jn sinβ, ∂Jt/∂β = Jn, ∂Jn/∂β = −Jt, ∂Jb/∂β = 0.
"""

from __future__ import annotations

import math

import numpy as np

from cable.feng_allen.equation7 import Equation7Numbers, to_local
from subzero.jit import compiled


@compiled
def space_slope(y: np.ndarray, x: np.ndarray, out: np.ndarray) -> None:
    """Fill ∂(M(y) x)/∂y for a fixed x (6,), the difference of y over a segment."""
    T, Vt, Vn, Vb = y[0], y[1], y[2], y[3]
    sb, cb = math.sin(y[5]), math.cos(y[5])
    da, db = x[4], x[5]
    out[1, 2] = -db
    out[1, 3] = cb * da
    out[1, 5] = -Vb * sb * da
    out[2, 1] = db
    out[2, 3] = -sb * da
    out[2, 5] = -Vb * cb * da
    out[3, 1] = -cb * da
    out[3, 2] = sb * da
    out[3, 5] = (Vn * cb + Vt * sb) * da
    out[4, 0] = -cb * da
    out[4, 5] = T * sb * da
    out[5, 0] = db


@compiled
def time_slope(y: np.ndarray, x: np.ndarray, c: Equation7Numbers, out: np.ndarray) -> None:
    """Fill ∂(N(y) x)/∂y for a fixed x (6,), the change of y over a time step."""
    sb, cb = math.sin(y[5]), math.cos(y[5])
    dT, da, db = x[0], x[4], x[5]
    Jt, Jn, Jb = to_local(y[4], y[5], c.north, c.east, c.down)
    pn, pb = c.m1 * y[2] - c.rhoA * Jn, c.m1 * y[3] - c.rhoA * Jb
    pn_a, pb_a = -c.rhoA * Jb * sb, -c.rhoA * (Jt * cb - Jn * sb)
    pn_b = c.rhoA * Jt
    loss = -c.stretch_momentum * c.e / (1.0 + c.e * y[0])
    loss_T = -loss * c.e / (1.0 + c.e * y[0])
    out[0, 0] = loss_T * c.m * y[1] * dT
    out[0, 1] = loss * c.m * dT
    out[0, 2] = -c.m1 * db
    out[0, 3] = c.m1 * cb * da
    out[0, 4] = pb_a * cb * da - pn_a * db
    out[0, 5] = -pb * sb * da - pn_b * db
    out[2, 0] = c.e * db
    out[3, 0] = -c.e * cb * da
    out[3, 5] = (1.0 + c.e * y[0]) * sb * da
    out[4, 0] = loss_T * pb * dT
    out[4, 1] = -c.m * cb * da
    out[4, 2] = c.m1 * sb * da
    out[4, 3] = loss * c.m1 * dT
    out[4, 4] = loss * pb_a * dT + c.rhoA * Jb * cb * cb * da
    out[4, 5] = (c.m1 * y[2] * cb + (c.m * y[1] + c.rhoA * Jt) * sb - c.rhoA * Jn * cb) * da
    out[5, 0] = loss_T * pn * dT
    out[5, 1] = c.m * db
    out[5, 2] = loss * c.m1 * dT
    out[5, 3] = -c.m1 * sb * da
    out[5, 4] = loss * pn_a * dT - c.rhoA * Jb * cb * db
    out[5, 5] = loss * pn_b * dT - c.m1 * y[3] * cb * da + c.rhoA * Jn * db


@compiled
def load_slope(y: np.ndarray, c: Equation7Numbers, out: np.ndarray) -> None:
    """Fill ∂q/∂y [N/m per unit of y]."""
    Jt, Jn, Jb = to_local(y[4], y[5], c.north, c.east, c.down)
    sb, cb = math.sin(y[5]), math.cos(y[5])
    Ut, Un, Ub = y[1] - Jt, y[2] - Jn, y[3] - Jb
    thick = math.sqrt(1.0 + c.e * y[0])
    thick_T = 0.5 * c.e / thick
    speed = math.sqrt(Un * Un + Ub * Ub)
    safe = speed if speed > 0.0 else 1.0
    along = 2.0 * c.tangential * thick * abs(Ut)
    nn, nb = c.normal * thick * (speed + Un * Un / safe), c.normal * thick * Un * Ub / safe
    bb = c.normal * thick * (speed + Ub * Ub / safe)
    Un_a, Ub_a, Un_b = -Jb * sb, -(Jt * cb - Jn * sb), Jt
    out[0, 0] = c.tangential * thick_T * Ut * abs(Ut)
    out[0, 1] = along
    out[0, 4] = along * Jb * cb
    out[0, 5] = c.wc * cb - along * Jn
    out[4, 0] = c.normal * thick_T * speed * Ub
    out[4, 2] = nb
    out[4, 3] = bb
    out[4, 4] = nb * Un_a + bb * Ub_a
    out[4, 5] = nb * Un_b
    out[5, 0] = c.normal * thick_T * speed * Un
    out[5, 2] = nn
    out[5, 3] = nb
    out[5, 4] = nn * Un_a + nb * Ub_a
    out[5, 5] = -c.wc * sb + nn * Un_b
