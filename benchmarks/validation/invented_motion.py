"""A motion that we choose, and the force that would cause it: x(s, t) = X(σ, t), σ = S(t) − s from the drum.

    X = ( a σ,  A (sin(kσ + ωt) − sin ωt),  cσ + B (cos(kσ − νt) − cos νt) ),     S = S₀ + U₀t + (U₁/ω)(1 − cos ωt)

X(0, t) = 0 is the drum; |∂X/∂σ| > 1, so the tension is T = (|∂X/∂σ| − 1)/e. Put into the momentum balance (7), with
weight, drag and a current J that is sheared and grows in time, it leaves

    f = ∂p/∂t + D − w_c k − ∂(T t)/∂s,       ∂/∂t at fixed s = ∂/∂t + S′ ∂/∂σ,   ∂/∂s = −∂/∂σ

SymPy writes f; the compatibility equations hold of themselves. `Motion` gives all as functions of σ and t.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import sympy as sp

from cable import CableProperties

CABLE = CableProperties(
    mass_per_length=0.02, compliance=0.05, tangential_drag_coefficient=0.05, normal_drag_coefficient=1.2
)
START = 8.0
"""S₀. [m]"""
SHEAR = ((0.3, -0.2, 0.1), (0.03, 0.02, 0.0), (0.02, 0.0, -0.02))
"""J at the drum at t = 0 [m/s]; its growth per metre of depth [1/s] and per second [m/s²]; it grows with both together
like the product."""
sigma, time = sp.symbols("sigma t", real=True)


def length() -> sp.Expr:
    """Return S(t). [m]."""
    return START + sp.Rational(7, 10) * time + sp.Rational(3, 10) * (1 - sp.cos(time))


def place() -> sp.Matrix:
    """Return X(σ, t) (3,). [m]."""
    k, along, east = sp.Rational(1, 2), sp.Rational(11, 10), sp.Rational(4, 5)
    return sp.Matrix(
        [
            along * sigma,
            east * (sp.sin(k * sigma + time) - sp.sin(time)),
            sp.Rational(3, 10) * sigma
            + sp.Rational(1, 2) * (sp.cos(k * sigma - 2 * time) - sp.cos(2 * time)),
        ]
    )


def water(down: sp.Expr) -> sp.Matrix:
    """Return J at a depth (3,). [m/s]."""
    at_drum, by_depth, by_time = (sp.Matrix(row) for row in SHEAR)
    return at_drum + by_depth * down + by_time * time + by_depth * down * time / 10


def along(vector: sp.Matrix) -> sp.Matrix:
    """Return the derivative in time of what stays with the cable, at fixed s."""
    return vector.diff(time) + length().diff(time) * vector.diff(sigma)


def forcing(c: CableProperties) -> sp.Matrix:
    """Return f(σ, t) (3,). [N/m]."""
    X, k = place(), sp.Matrix([0, 0, 1])
    stretch = sp.sqrt(X.diff(sigma).dot(X.diff(sigma)))
    tension, t = (stretch - 1) / c.compliance, -X.diff(sigma) / stretch
    V, J = along(X), water(X[2])
    U = V - J
    across = U - U.dot(t) * t
    rho_A = c.virtual_mass_per_length - c.mass_per_length
    p = c.mass_per_length * V + rho_A * across
    drag = c.tangential_drag * sp.Abs(U.dot(t)) * U.dot(t) * t
    drag += c.normal_drag * sp.sqrt(across.dot(across)) * across
    pull = tension * t
    return along(p) + sp.sqrt(stretch) * drag - c.weight_in_water * k + pull.diff(sigma)


@cache
def motion() -> dict[str, Callable[..., np.ndarray]]:
    """Return functions of (σ, t): place [m], velocity [m/s], tension [N], pull T t [N], forcing [N/m]: (3, n) or (n,).

    And `length` [m] and `payout` [m/s], which do not look at σ.
    """
    X = place()
    stretch = sp.sqrt(X.diff(sigma).dot(X.diff(sigma)))
    tension = (stretch - 1) / CABLE.compliance
    expressions = {
        "place": list(X),
        "velocity": list(along(X)),
        "tension": tension,
        "pull": list(-tension * X.diff(sigma) / stretch),
        "forcing": list(forcing(CABLE)),
        "length": length(),
        "payout": length().diff(time),
    }
    return {name: sp.lambdify([sigma, time], value, "numpy", cse=True) for name, value in expressions.items()}
