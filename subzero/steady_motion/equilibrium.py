"""The seven equations of steady motion, and their solution by Newton's method from a guess.

ν'(n, δ_r, δ_e, δ_d, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, sin, sqrt

import numpy as np

from subzero.steady_motion.hull_state_space import DEPTH, PITCH, ROLL, VELOCITY, rate
from subzero.steady_motion.steady_cable_force import SteadyPull
from vehicle import VehicleNumbers

RESIDUAL = 1e-9
"""What may be left of accelerations and depth rate. [m/s2, rad/s2, m/s]"""
FARTHEST = 1.2
"""Fin and pitch angles beyond this are another balance than the one that is looked for. [rad]"""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What is asked for, of which hull (its numbers without limits), with which pull beyond the formula's."""

    numbers: VehicleNumbers
    pull: SteadyPull
    speed: float
    depth_rate: float
    turn_rate: float
    roll: float
    extra: np.ndarray

    def part(self, share: float) -> Motion:
        """Return the same with a share of everything that is not straight and level."""
        asked = {name: share * getattr(self, name) for name in ("depth_rate", "turn_rate", "roll", "extra")}
        return replace(self, **asked)

    def state(self, y: np.ndarray) -> np.ndarray:
        """Return x (16,) for the unknowns n, δ_r, δ_e, δ_d, θ, v, w."""
        n, rudder, together, unlike, pitch, v, w = y
        x = np.zeros(16)
        x[ROLL], x[PITCH] = self.roll, pitch
        spin = (-sin(pitch), cos(pitch) * sin(self.roll), cos(pitch) * cos(self.roll))
        x[VELOCITY] = self.speed, v, w, *(self.turn_rate * part for part in spin)
        x[12:] = n, rudder, together - unlike, together + unlike
        return x

    def left(self, y: np.ndarray) -> np.ndarray:
        """Return what is left of the seven equations."""
        x = self.state(y)
        rates = rate(x, x[12:], self.numbers, self.pull.wrench(x[VELOCITY]) + self.extra)
        return np.append(rates[VELOCITY], rates[DEPTH] - self.depth_rate)

    def solved(self, y: np.ndarray) -> np.ndarray | None:
        """Return the unknowns from a guess; None if they are not found."""
        from scipy.optimize import root

        found = root(self.left, y, tol=1e-13).x
        near = np.max(np.abs(found[1:5])) < FARTHEST
        return found if near and np.max(np.abs(self.left(found))) < RESIDUAL else None


def level_propeller(motion: Motion) -> float:
    """Return n at which thrust balances drag and pull straight ahead with central fins, a n² − b n u − c u² = R."""
    p, u = motion.numbers.propeller, motion.speed
    x = motion.part(0.0).state(np.zeros(7))
    rates = rate(x, x[12:], motion.numbers, motion.pull.wrench(x[VELOCITY]))
    brake = -float(motion.numbers.mass_matrix[0] @ rates[VELOCITY])  # with the propeller standing still
    if p.thrust_nn == 0.0:
        return 0.0
    return (p.thrust_nu * u + sqrt((p.thrust_nu * u) ** 2 + 4.0 * p.thrust_nn * brake)) / (2.0 * p.thrust_nn)
