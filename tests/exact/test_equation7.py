"""Equation (7) derived once more with SymPy, and its slopes against differences.

Verifies: every entry of M, N and q, from the vector equations (T t)' = d/dt[m Vt t + m1 V⊥ − ρA J⊥] −
wc k + drag and V' = d/dt[(1 + eT) t] in the frame W(α, β). Configuration: random states, heavy
stretching cable, slanting current. Tolerance: rounding (1e-12 of the largest entry); differences: 1e-7,
their own truncation and rounding.
"""

from functools import cache

import numpy as np
import pytest
import sympy as sp

from cable import CableProperties
from cable.feng_allen.equation7 import (
    Equation7Numbers,
    angles_of,
    equation7_numbers,
    load,
    load_slope,
    space_matrix,
    space_slope,
    tangent,
    time_matrix,
    time_slope,
    to_local,
)

HEAVY = CableProperties(
    mass_per_length=0.02, compliance=0.07, tangential_drag_coefficient=0.02, normal_drag_coefficient=1.3
)
CURRENT = (0.3, -0.4, 0.15)
STATES = np.random.default_rng(7).normal(size=(6, 6)) + np.array([3.0, -1.0, 0.0, 0.0, 0.4, 3.4])


def frame(alpha, beta):
    """W(α, β) = [t n b], equation (4)."""
    ca, sa, cb, sb = sp.cos(alpha), sp.sin(alpha), sp.cos(beta), sp.sin(beta)
    return (
        sp.Matrix([ca * cb, -sa * cb, -sb]),
        sp.Matrix([-ca * sb, sa * sb, -cb]),
        sp.Matrix([sa, ca, 0]),
    )


@cache
def derived_matrices():
    """Return a function of (y, numbers, share of the stretch's momentum) giving M, N, q, derived from the vector
    equations.
    """
    s, t = sp.symbols("s t")
    y = [sp.Function(name)(s, t) for name in ("T", "Vt", "Vn", "Vb", "alpha", "beta")]
    T, Vt, Vn, Vb, alpha, beta = y
    names = "m rhoA wc e tangential normal north east down stretch_momentum"
    m, rhoA, wc, e, ct, cn, jn, je, jd, stretch_momentum = symbols = sp.symbols(names)
    tt, nn, bb = frame(alpha, beta)
    J, k = sp.Matrix([jn, je, jd]), sp.Matrix([0, 0, 1])
    V = Vt * tt + Vn * nn + Vb * bb
    U, stretched = V - J, 1 + e * T
    Ut, Un, Ub = U.dot(tt), U.dot(nn), U.dot(bb)
    drag = sp.sqrt(stretched) * (
        ct * Ut * sp.Abs(Ut) * tt + cn * sp.sqrt(Un**2 + Ub**2) * (Un * nn + Ub * bb)
    )
    # Momentum of the mass m Vt t + m1 V⊥ − ρA J⊥, as a vector that differentiates with its frame.
    momentum = m * Vt * tt + (m + rhoA) * (Vn * nn + Vb * bb) - rhoA * (J.dot(nn) * nn + J.dot(bb) * bb)
    rate = momentum.diff(t) - stretch_momentum * momentum * e * T.diff(t) / stretched
    forces = (T * tt).diff(s) - rate + wc * k - drag  # = 0
    together = V.diff(s) - (stretched * tt).diff(t)  # = 0
    rows = [forces.dot(tt), *(together.dot(a) for a in (tt, nn, bb)), forces.dot(bb), forces.dot(nn)]
    ys, yt = sp.symbols("s0:6"), sp.symbols("t0:6")
    values = sp.symbols("y0:6")

    def plain(row):
        row = row.subs({f.diff(s): a for f, a in zip(y, ys, strict=True)})
        row = row.subs({f.diff(t): a for f, a in zip(y, yt, strict=True)})
        return row.subs(dict(zip(y, values, strict=True)))

    flat = [plain(row) for row in rows]
    still = dict.fromkeys((*ys, *yt), 0)
    M = sp.Matrix(6, 6, lambda i, j: flat[i].diff(ys[j]))
    N = sp.Matrix(6, 6, lambda i, j: -flat[i].diff(yt[j]))
    q = sp.Matrix(6, 1, lambda i, _: -flat[i].subs(still))
    return sp.lambdify([*values, *symbols], [M, N, q], "numpy")


def coded_matrices(y, c: Equation7Numbers):
    M, N, q = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(6)
    space_matrix(y, M)
    time_matrix(y, c, N)
    load(y, c, q)
    return M, N, q


@pytest.mark.long
@pytest.mark.parametrize("stretch_momentum", [0.0, 1.0])
def test_every_entry_of_equation_7_follows_from_the_vector_equations(stretch_momentum):
    c = equation7_numbers(HEAVY, CURRENT, stretch_momentum=stretch_momentum)
    derived = derived_matrices()
    numbers = (c.m, c.rhoA, c.wc, c.e, c.tangential, c.normal, c.north, c.east, c.down, stretch_momentum)
    for y in STATES:
        expected = derived(*y, *numbers)
        for coded, exact in zip(coded_matrices(y, c), expected, strict=True):
            np.testing.assert_allclose(coded, np.asarray(exact).reshape(coded.shape), rtol=0, atol=1e-12)


@pytest.mark.parametrize("stretch_momentum", [0.0, 1.0])
def test_slopes_are_the_differences_of_the_matrices(stretch_momentum):
    c = equation7_numbers(HEAVY, CURRENT, stretch_momentum=stretch_momentum)
    x = np.array([0.3, -0.7, 0.2, 0.5, -0.4, 0.6])
    for y in STATES:
        Mx, Nx, qy = (np.zeros((6, 6)) for _ in range(3))
        space_slope(y, x, Mx)
        time_slope(y, x, c, Nx)
        load_slope(y, c, qy)
        for column in range(6):
            step = np.zeros(6)
            step[column] = 1e-6
            high, low = coded_matrices(y + step, c), coded_matrices(y - step, c)
            dM, dN, dq = ((a - b) / 2e-6 for a, b in zip(high, low, strict=True))
            np.testing.assert_allclose(Mx[:, column], dM @ x, atol=1e-7)
            np.testing.assert_allclose(Nx[:, column], dN @ x, atol=1e-7)
            np.testing.assert_allclose(qy[:, column], dq, atol=1e-7)


def test_straight_ahead_the_cable_points_backwards_and_its_tangential_speed_is_negative():
    alpha, beta = angles_of(-1.0, 0.0, 0.0)
    assert (alpha, beta) == (0.0, pytest.approx(np.pi))
    np.testing.assert_allclose(to_local(alpha, beta, 1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), atol=1e-15)


def test_angles_give_back_the_direction_they_came_from():
    rng = np.random.default_rng(3)
    for direction in rng.normal(size=(20, 3)):
        unit = direction / np.linalg.norm(direction)
        np.testing.assert_allclose(tangent(*angles_of(*direction)), unit, atol=1e-15)


def test_drag_along_the_cable_needs_more_tension_towards_the_vehicle():
    c = equation7_numbers(CableProperties())
    q = np.zeros(6)
    load(np.array([1.0, -1.0, 0.0, 0.0, 0.0, np.pi]), c, q)
    assert q[0] == pytest.approx(
        -0.0392699081698724
    )  # T falls by ½ρπdCt U² per metre towards the drum, eq. (32)


def test_only_without_the_printed_stretch_terms_does_a_rigid_drift_change_nothing():
    """Cable and water drifting together, however fast, must feel the same Ṫ: Galilean invariance."""
    drift = np.array([0.9, -0.2, 0.4])
    spread = {}
    for stretch_momentum in (0.0, 1.0):
        columns = []
        for extra in (np.zeros(3), drift):
            c = equation7_numbers(HEAVY, tuple(extra), stretch_momentum=stretch_momentum)
            y = np.array([3.0, -1.0, 0.2, 0.1, 0.4, 3.4])
            y[1:4] += to_local(y[4], y[5], *extra)
            columns.append(coded_matrices(y, c)[1][[0, 4, 5], 0])
        spread[stretch_momentum] = np.abs(columns[0] - columns[1]).max()
    assert spread[0.0] == 0.0
    assert spread[1.0] > 1e-4
