"""Equation (7) of Feng and Allen (2004): M ∂y/∂s = N ∂y/∂t + q with y = [T Vt Vn Vb α β].

The paper's text layer lost its signs, so the matrices are derived again from the two vector equations

    (T t)' = d/dt[m Vt t + m1 V⊥ − ρA J⊥] − wc k + drag            momentum per unstretched length
    V'     = d/dt[(1 + ε) t]                                        the cable hangs together

with ε = e T and the local frame W(α, β) = [t n b] of (4); ``tests/exact/test_equation7.py`` repeats the
derivation with SymPy and compares every entry. Rows: t-momentum, t-, n-, b-compatibility, b-momentum,
n-momentum.

The current J is steady and uniform, given in earth axes; its local components turn with the frame, so the
J̇ of the printed q is linear in α̇ and β̇, and stands in N here.

**Departs from source:** the printed N carries −e p/(1 + ε) in the column of Ṫ, p being the momentum of a
row. Such terms come out only if the mass of a *stretched* metre is held fixed, and they break Galilean
invariance: a rigid drift of cable and water would change the tension. ``stretch_momentum`` = 1 keeps them
as printed, 0 leaves them out (mass belongs to the unstretched metre); both are the same for Table 1, where
e = 0.

Leaves out: bending stiffness, shear in the current, boundary conditions.

**Slopes** are needed by Newton's method in addition to the matrices. For a fixed vector x the functions fill
∂(M(y) x)/∂y and ∂(N(y) x)/∂y, shape (6, 6), row = equation, column = unknown, and ∂q/∂y. Only entries that can differ
from zero are set, so the caller hands in arrays that were zero once. Checked against differences in
``tests/exact/test_equation7.py``.

The current's local components follow the frame: ∂Jt/∂α = −Jb cosβ, ∂Jn/∂α = Jb sinβ,
∂Jb/∂α = Jt cosβ − Jn sinβ, ∂Jt/∂β = Jn, ∂Jn/∂β = −Jt, ∂Jb/∂β = 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cable.properties import CableProperties
from subzero.jit import compiled

EQUATIONS = (
    "tangential momentum",
    "tangential compatibility",
    "normal compatibility",
    "binormal compatibility",
    "binormal momentum",
    "normal momentum",
)


class Equation7Numbers(NamedTuple):
    """The constants of (7), as floats."""

    m: float
    """Mass of an unstretched metre [kg/m]."""
    m1: float
    """m + ρA, virtual mass of a metre moving sideways [kg/m]."""
    rhoA: float
    """Water displaced by a metre [kg/m]."""
    wc: float
    """(m − ρA) g, weight in water [N/m]."""
    e: float
    """1/EA, strain per tension [1/N]."""
    tangential: float
    """½ρπdCt, tangential drag of a metre per speed squared [N s²/m³]."""
    normal: float
    """½ρdCn, normal drag of a metre per speed squared [N s²/m³]."""
    north: float
    """Current, earth axes [m/s]."""
    east: float
    down: float
    stretch_momentum: float
    """1: the e-terms of the momentum rows as printed; 0: left out (see the module's first words)."""


def equation7_numbers(
    cable: CableProperties,
    current: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    stretch_momentum: float = 1.0,
) -> Equation7Numbers:
    """Return the constants of (7) for a cable in a uniform current given in earth axes. [m/s]."""
    numbers = cable.numbers()
    return Equation7Numbers(
        m=numbers.mass,
        m1=numbers.mass + numbers.added_mass,
        rhoA=numbers.added_mass,
        wc=numbers.weight,
        e=numbers.compliance,
        tangential=numbers.tangential_drag,
        normal=numbers.normal_drag,
        north=float(current[0]),
        east=float(current[1]),
        down=float(current[2]),
        stretch_momentum=float(stretch_momentum),
    )


@compiled
def to_local(alpha: float, beta: float, north: float, east: float, down: float) -> tuple[float, float, float]:
    """Return the components along t, n, b of a vector given in earth axes: Wᵀ(α, β) x, eq. (3)-(4)."""
    sa, ca, sb, cb = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
    ahead = ca * north - sa * east
    return ahead * cb - down * sb, -ahead * sb - down * cb, sa * north + ca * east


@compiled
def tangent(alpha: float, beta: float) -> tuple[float, float, float]:
    """Return the unit tangent t in earth axes, towards growing s (from the vehicle to the drum), eq. (4)."""
    cb = math.cos(beta)
    return math.cos(alpha) * cb, -math.sin(alpha) * cb, -math.sin(beta)


@compiled
def angles_of(north: float, east: float, down: float) -> tuple[float, float]:
    """Return (α, β) of a tangent given in earth axes; β lies in (π/2, 3π/2), so α is 0 straight ahead."""
    level = math.sqrt(north * north + east * east)
    alpha = math.atan2(east, -north) if level > 0.0 else 0.0
    return alpha, math.pi + math.atan2(down, level)


@compiled
def space_matrix(y: np.ndarray, M: np.ndarray) -> None:
    """Fill M(y), the factor of ∂y/∂s in (7); `M` (6, 6) must have been zero outside the entries set here."""
    T, Vt, Vn, Vb = y[0], y[1], y[2], y[3]
    sb, cb = math.sin(y[5]), math.cos(y[5])
    M[0, 0] = 1.0
    M[1, 1] = 1.0
    M[1, 4] = Vb * cb
    M[1, 5] = -Vn
    M[2, 2] = 1.0
    M[2, 4] = -Vb * sb
    M[2, 5] = Vt
    M[3, 3] = 1.0
    M[3, 4] = Vn * sb - Vt * cb
    M[4, 4] = -T * cb
    M[5, 5] = T


@compiled
def time_matrix(y: np.ndarray, c: Equation7Numbers, N: np.ndarray) -> None:
    """Fill N(y), the factor of ∂y/∂t in (7), with the J̇ of a turning frame; `N` as for `space_matrix`."""
    Vt, Vn, Vb = y[1], y[2], y[3]
    sb, cb = math.sin(y[5]), math.cos(y[5])
    Jt, Jn, Jb = to_local(y[4], y[5], c.north, c.east, c.down)
    stretched = 1.0 + c.e * y[0]
    loss = -c.stretch_momentum * c.e / stretched
    pn, pb = c.m1 * Vn - c.rhoA * Jn, c.m1 * Vb - c.rhoA * Jb
    N[0, 0] = loss * c.m * Vt
    N[0, 1] = c.m
    N[0, 4] = pb * cb
    N[0, 5] = -pn
    N[1, 0] = c.e
    N[2, 5] = stretched
    N[3, 4] = -stretched * cb
    N[4, 0] = loss * pb
    N[4, 3] = c.m1
    N[4, 4] = c.m1 * Vn * sb - (c.m * Vt + c.rhoA * Jt) * cb  # −ρA J̇b = −ρA (Jt cosβ − Jn sinβ) α̇ is in it
    N[5, 0] = loss * pn
    N[5, 2] = c.m1
    N[5, 4] = -c.m1 * Vb * sb  # −ρA J̇n = ρA (Jt β̇ − Jb sinβ α̇) is in this line and the next
    N[5, 5] = c.m * Vt + c.rhoA * Jt


@compiled
def load(y: np.ndarray, c: Equation7Numbers, q: np.ndarray) -> None:
    """Fill q(y) of (7): weight in water and drag of a metre [N/m]; the compatibility rows have none."""
    Jt, Jn, Jb = to_local(y[4], y[5], c.north, c.east, c.down)
    Ut, Un, Ub = y[1] - Jt, y[2] - Jn, y[3] - Jb
    thick = math.sqrt(1.0 + c.e * y[0])
    across = c.normal * thick * math.sqrt(Un * Un + Ub * Ub)
    q[0] = c.wc * math.sin(y[5]) + c.tangential * thick * Ut * abs(Ut)
    q[1] = 0.0
    q[2] = 0.0
    q[3] = 0.0
    q[4] = across * Ub
    q[5] = c.wc * math.cos(y[5]) + across * Un


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
