"""Steady motion of a vehicle: its seven equations, and its unknowns where a propeller drives and fins steer.

    ν'(n, δ_r, δ_e, δ_d, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')

The roll angle is asked for, and held by unlike stern-planes. Listed actuators rest.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from math import cos, sin, sqrt
from typing import Self

import numpy as np

from subzero.steady_motion.asked import Asked
from subzero.steady_motion.hull_state_space import (
    ACTUATORS,
    DEPTH,
    PITCH,
    ROLL,
    VELOCITY,
    rate,
    resting_state,
)
from subzero.steady_motion.steady_pull import SteadyPull
from vehicle import Vehicle, VehicleNumbers

FARTHEST = 1.2
"""Fin and pitch angles beyond this are another balance than the one that is looked for. [rad]"""


@dataclass(frozen=True, kw_only=True)
class Motion(ABC):
    """The requested motion of a vehicle, with which pull beyond the formula's.

    Attributes:
        asked: which motion.
        hull: of which vehicle.
        numbers: of the hull, its actuators without limits.
        pull: of the cable.
        extra: added to that pull.
    """

    asked: Asked
    hull: Vehicle
    numbers: VehicleNumbers
    pull: SteadyPull
    extra: np.ndarray = field(default_factory=lambda: np.zeros(6))

    def part(self, share: float) -> Self:
        """Return the same with a share of what is asked beyond the easiest motion."""
        return replace(self, asked=self.asked_part(share), extra=share * self.extra)

    def asked_part(self, share: float) -> Asked:
        """Return a share of everything that is not straight and level."""
        return self.asked.part(share)

    @abstractmethod
    def guess(self) -> np.ndarray:
        """Return the unknowns (7,) to begin with."""

    @abstractmethod
    def state(self, y: np.ndarray) -> np.ndarray:
        """Return x (16 and one for each channel,) for the unknowns."""

    @abstractmethod
    def is_near(self, y: np.ndarray) -> bool:
        """Return whether unknowns are those of the balance that is looked for, not of another."""

    def velocity(self, roll: float, pitch: float, sway: float, heave: float) -> tuple[float, ...]:
        """Return u, v, w [m/s], p, q, r [rad/s] of the asked speed and turn at an attitude."""
        spin = (-sin(pitch), cos(pitch) * sin(roll), cos(pitch) * cos(roll))
        return self.asked.speed, sway, heave, *(self.asked.turn_rate * part for part in spin)

    def left(self, y: np.ndarray) -> np.ndarray:
        """Return the residual of the seven equations."""
        x = self.state(y)
        rates = rate(x, x[12:], self.numbers, self.pull.wrench(x[VELOCITY]) + self.extra)
        return np.append(rates[VELOCITY], rates[DEPTH] - self.asked.depth_rate)


class PropellerMotion(Motion):
    """The requested motion of a vehicle that a propeller drives and fins steer."""

    def guess(self) -> np.ndarray:
        """Return the unknowns to begin with: straight and level."""
        return np.array([level_propeller(self), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])

    def state(self, y: np.ndarray) -> np.ndarray:
        """Return x for the unknowns n, δ_r, δ_e, δ_d, θ, v, w."""
        n, rudder, together, unlike, pitch, v, w = y
        x, roll = resting_state(self.hull), self.asked.roll
        x[ROLL], x[PITCH] = roll, pitch
        x[VELOCITY] = self.velocity(roll, pitch, v, w)
        x[ACTUATORS] = n, rudder, together - unlike, together + unlike
        return x

    def is_near(self, y: np.ndarray) -> bool:
        """Return whether angles are no larger than of the balance that is looked for."""
        return bool(np.max(np.abs(y[1:5])) < FARTHEST)


def level_propeller(motion: PropellerMotion) -> float:
    """Return n at which thrust balances drag and pull straight ahead with central fins, a n² − b n u − c u² = R."""
    p, u = motion.numbers.propeller, motion.asked.speed
    x = motion.part(0.0).state(np.zeros(7))
    rates = rate(x, x[12:], motion.numbers, motion.pull.wrench(x[VELOCITY]))
    brake = -float(motion.numbers.mass_matrix[0] @ rates[VELOCITY])  # with the propeller standing still
    if p.thrust_nn == 0.0:
        return 0.0
    return (p.thrust_nu * u + sqrt((p.thrust_nu * u) ** 2 + 4.0 * p.thrust_nn * brake)) / (2.0 * p.thrust_nn)
