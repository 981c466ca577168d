"""Transverse modes of a straight cable under steady pay-out: a Galerkin model of low order.

Equation (7) for a cable that lies straight behind a vehicle of speed U, to first order in its transverse displacement
y(s, t), s from the tow point, S the length in the water, k_t = ½ρπdC_t, T_d the drum's friction:

    T ∂²y/∂s² = m₁ ∂²y/∂t² + ρA U ∂²y/∂s∂t + c (∂y/∂t + U ∂y/∂s),   T = k_t U² (S − s) + T_d,   y(S, t) = 0

The normal drag ½ρdC_n |V_n| V_n is of second order: on a straight cable in small motion c = 0, and nothing but its
tension holds the cable in its place. Already a cross-flow of a few millimetres a second, W, damps it as much as its
inertia does; a motion that swings with ±W loses as much energy as with c = 8/(3π) ½ρdC_n W (harmonic linearisation).

S grows with U, so y is written on the cable as it lengthens,

    y = S η(σ, t),   σ = s/S,   η = b (1 − σ) + Σ q_k(t) φ_k(σ),   φ_k = σ (1 − σ) P_{k−1}(2σ − 1)

in which a cable that points from the drum in another direction, b, is at rest. Galerkin's method with the same
functions gives M η'' + C η' + K η = −F e_0: the bends q_k, and the force F across the cable on the vehicle. Only then
S and U are frozen. Both sideways directions obey the same equations.

Where the tension has fallen so low that waves are slower than the drum runs away from them, a quarter of a metre before
it, they pile up and get shorter without end. In the simulation segments and time steps take them; here a little
viscosity does, m₁ U `LOST_OVER`, and a tension of m₁ U² within `NEAR_DRUM` of the drum, below which the viscosity would
feed them. Neither is felt at the tow point: with half or twice of both, and with 6, 8 or 12 bends, heading and pitch
answer a sine of up to 4 rad/s with a gain within 9.5 % and a phase within 8.8° of the simulation's.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from subzero.model import Model

BENDS = 6
"""Number of shape functions in addition to the straight line."""
LOST_OVER = 1.0
"""Waves shorter than about this are damped within their own length. [m]"""
NEAR_DRUM = 0.5
"""The cable is kept taut over about this length before the drum, a segment of the simulation. [m]"""
HARMONIC = 8.0 / (3.0 * pi)
"""Harmonic linearisation: |v| v of a sine of amplitude W is equivalent to this times W v. [-]"""


@dataclass(frozen=True, kw_only=True, eq=False)
class CableModes:
    """One transverse direction of a cable, z = (b, q_1 … q_K, q_1' … q_K') [rad, rad/s].

    With the tow point's velocity V [m/s] and acceleration a [m/s²] in that direction,

        z' = A z + B (V, a),   F = G z + H (V, a)

    Attributes:
        A, B: (2K + 1, 2K + 1), (2K + 1, 2).
        G, H: (2K + 1,), (2,). [N], [N s/m, kg]
    """

    A: np.ndarray
    B: np.ndarray
    G: np.ndarray
    H: np.ndarray

    @classmethod
    def of(cls, model: Model, speed: float, length: float, *, cross_flow: float = 0.0) -> CableModes:
        """Return the cable of a model with `length` [m] of it in the water, pulled at `speed` [m/s].

        Args:
            model: whose cable and drum.
            speed: U, of the tow point through the water. [m/s]
            length: S. [m]
            cross_flow: W, the amplitude of the water's speed across the cable that the drag is linear for. [m/s]
        """
        M, C, K = _matrices(model, speed, length, cross_flow)
        return _state_space(M, C, K, speed, length)


def _matrices(model: Model, U: float, S: float, W: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return M, C and K of M η'' + C η' + K η = −F e_0 (BENDS + 1, BENDS + 1) [N s², N s, N].

    With y on the lengthening cable, ∂y/∂t = S η' + U (η − σ η_σ), ∂²y/∂s∂t = η_σ' − (U/S) σ η_σσ and
    ∂²y/∂t² = S η'' + 2U (η' − σ η_σ') + (U²/S) σ² η_σσ.
    """
    cable, friction = model.cable, model.drum.friction_torque / model.drum.radius
    m1, drag, c = cable.virtual_mass_per_length, cable.tangential_drag, HARMONIC * cable.normal_drag * W
    added = cable.water_density * cable.cross_section_area
    node, weight = np.polynomial.legendre.leggauss(BENDS + 30)  # the last decimetres are steep
    sigma, weight = 0.5 * (node + 1.0), 0.5 * weight
    f, g, h = (np.array([shape.deriv(n)(sigma) for shape in _shapes()]) for n in (0, 1, 2))

    def integral(left: np.ndarray, right: np.ndarray, by: np.ndarray | float = 1.0) -> np.ndarray:
        rates: np.ndarray = (left * (weight * by)) @ right.T
        return rates

    M = S * S * m1 * integral(f, f)
    C = S * U * (2.0 * m1 * (integral(f, f) - integral(f, g, sigma)) + added * integral(f, g))
    C += S * S * c * integral(f, f)
    C[:, 1:] += m1 * U * LOST_OVER * integral(g, g)[:, 1:]
    K = integral(g, g, drag * U * U * S * (1.0 - sigma) + friction) - drag * U * U * S * integral(f, g)
    K += U * U * (m1 * integral(f, h, sigma * sigma) - added * integral(f, h, sigma))
    K[:, 1:] += integral(g, g, m1 * U * U * np.exp((sigma - 1.0) * S / NEAR_DRUM))[:, 1:]
    K += S * U * c * (integral(f, f) + integral(f, g, 1.0 - sigma))
    return M, C, K


def _shapes() -> list[Polynomial]:
    """Return 1 − σ and the φ_k as polynomials of σ on [0, 1]."""
    straight, sigma = Polynomial([1.0, -1.0]), Polynomial([0.0, 1.0])
    legendre = [Legendre.basis(k, domain=[0.0, 1.0]).convert(kind=Polynomial) for k in range(BENDS)]
    return [straight, *(sigma * straight * each for each in legendre)]


def _state_space(M: np.ndarray, C: np.ndarray, K: np.ndarray, U: float, S: float) -> CableModes:
    """Return the equations of the bends and of the force; b' = (V − U b)/S, and its rate, put in for b' and b''."""
    n = M.shape[0] - 1
    size = 2 * n + 1
    turning, faster = np.zeros(size + 2), np.zeros(size + 2)  # b' and b'' as rows over z, V, a
    turning[0], turning[-2] = -U / S, 1.0 / S
    faster[:] = -2.0 * U / S * turning
    faster[-1] += 1.0 / S
    rest = np.outer(M[:, 0], faster) + np.outer(C[:, 0], turning)  # all but M_·q q''
    rest[:, : n + 1] += K
    rest[:, n + 1 : size] += C[:, 1:]
    bending = -np.linalg.solve(M[1:, 1:], rest[1:])
    force = -(rest[0] + M[0, 1:] @ bending)
    rates = np.vstack([turning, np.hstack([np.zeros((n, n + 1)), np.eye(n), np.zeros((n, 2))]), bending])
    return CableModes(A=rates[:, :-2], B=rates[:, -2:], G=force[:-2], H=force[-2:])
