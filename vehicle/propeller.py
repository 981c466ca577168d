"""The propeller in all four quadrants, without dividing by its speed.

    T = ρ D² [ k_T0 n|n| D² − k_T1 |n| D u_a − k_T2 u_a|u_a| ],   u_a = (1 − w) u
    Q = ρ D³ [ k_Q0 n|n| D² − k_Q1 |n| D u_a − k_Q2 u_a|u_a| ]

Ahead (n, u_a > 0) this is K_T = k_T0 − k_T1 J − k_T2 J² with J = u_a/(n D), the usual open-water curve; past
the J of zero thrust the propeller windmills and brakes; stopped, it drags with k_T2; turned astern it pushes
back. Written in n and u_a it is continuous everywhere, J = ±∞ included, and odd: T(−n, −u) = −T(n, u). Real
propellers are weaker astern than ahead and stall between the quadrants; that asymmetry is left out, as is all
swirl on the fins. Thrust on the hull is (1 − t) T; the motor's reaction rolls the hull by −Q (a right-handed
propeller, seen turning clockwise from astern, rolls it to port).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.jit import Record, gated_inlined
from vehicle.parameters import Section, parameter


class PropellerNumbers(Record):
    """Coefficients of n|n|, |n|u and u|u| in the thrust on the hull and in the shaft torque."""

    thrust_nn: float
    thrust_nu: float
    thrust_uu: float
    torque_nn: float
    torque_nu: float
    torque_uu: float
    reaction: float


@dataclass(frozen=True, kw_only=True)
class Propeller(Section):
    """Diameter, open-water curves and the interaction with the hull."""

    diameter: float = parameter("diameter, D", "m", above=0.0)
    thrust_constant: float = parameter("thrust coefficient at rest, k_T0", "1", low=0.0)
    thrust_slope: float = parameter("fall of K_T with J, k_T1", "1", low=0.0)
    thrust_curvature: float = parameter("fall of K_T with J squared, k_T2", "1", low=0.0)
    torque_constant: float = parameter("torque coefficient at rest, k_Q0", "1", low=0.0)
    torque_slope: float = parameter("fall of K_Q with J, k_Q1", "1", low=0.0)
    torque_curvature: float = parameter("fall of K_Q with J squared, k_Q2", "1", low=0.0)
    wake_fraction: float = parameter("wake fraction, w", "1", low=-0.5, high=0.9)
    thrust_deduction: float = parameter("thrust deduction, t", "1", low=-0.5, high=0.9)
    reaction_torque_factor: float = parameter(
        "share of the torque that rolls the hull, negative for a left-handed propeller",
        "1",
        low=-2.0,
        high=2.0,
    )

    def numbers(self, density: float) -> PropellerNumbers:
        """Return the dimensional coefficients, wake and thrust deduction included."""
        D, advance = self.diameter, 1.0 - self.wake_fraction
        thrust = density * D**2 * (1.0 - self.thrust_deduction)
        torque = density * D**3
        return PropellerNumbers(
            thrust * D**2 * self.thrust_constant,
            thrust * D * advance * self.thrust_slope,
            thrust * advance * abs(advance) * self.thrust_curvature,
            torque * D**2 * self.torque_constant,
            torque * D * advance * self.torque_slope,
            torque * advance * abs(advance) * self.torque_curvature,
            self.reaction_torque_factor,
        )


@gated_inlined
def thrust(n: float, u: float, numbers: PropellerNumbers) -> float:
    """Return the thrust on the hull, (1 − t) T [N], at n [rev/s] and surge speed u [m/s]."""
    return numbers.thrust_nn * n * abs(n) - numbers.thrust_nu * abs(n) * u - numbers.thrust_uu * u * abs(u)


@gated_inlined
def torque(n: float, u: float, numbers: PropellerNumbers) -> float:
    """Return the torque of the shaft on the propeller, Q [N m], at n [rev/s] and surge speed u [m/s]."""
    return numbers.torque_nn * n * abs(n) - numbers.torque_nu * abs(n) * u - numbers.torque_uu * u * abs(u)


@gated_inlined
def propeller(nu_r: np.ndarray, n: float, numbers: PropellerNumbers, out: np.ndarray) -> None:
    """Fill out (6,) with thrust and reaction torque on the hull [N, N m]; nu_r relative to the water."""
    for i in range(6):
        out[i] = 0.0
    out[0] = thrust(n, nu_r[0], numbers)
    out[3] = -numbers.reaction * torque(n, nu_r[0], numbers)
