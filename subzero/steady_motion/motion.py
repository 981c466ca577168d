"""Steady motion of a vehicle: its seven equations, and the unknowns of one on propeller and fins, and of a glider.

    ν'(n, δ_r, δ_e, δ_d, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')
    ν'(s, γ, V, φ, θ, v, w) = 0          of a glider

On propeller and fins the roll angle is asked for, and held by unlike stern-planes. Listed actuators rest.

s and γ are slide and turn of the first moving mass, V the volume of the first buoyancy engine: a glider that dives or
climbs, straight or in a spiral. The roll angle is unknown here: it turns a glider. The weight drives, so a
depth rate must be asked for.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import asin, cos, pi, sin, sqrt, tan
from typing import TYPE_CHECKING, Self

import numpy as np

from subzero.steady_motion.asked import Asked
from subzero.steady_motion.hull_state_space import (
    ACTUATORS,
    CHANNELS,
    DEPTH,
    PITCH,
    ROLL,
    VELOCITY,
    Demand,
    rate,
    resting_state,
)
from vehicle import Vehicle, VehicleNumbers

if TYPE_CHECKING:
    from subzero.steady_motion.steady_pull import SteadyPull

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


def is_glider(hull: Vehicle) -> bool:
    """Return whether a vehicle is driven by its weight: no propeller, no thrusters, a moving mass and an engine."""
    is_driven = bool(hull.thrusters) or hull.propeller.thrust_constant > 0.0
    return not is_driven and bool(hull.moving_masses) and bool(hull.buoyancy_engines)


def glider_refusal(asked: Asked) -> str:
    """Return why a motion cannot be asked of a glider; empty if it can."""
    if not 0.0 < abs(asked.depth_rate) < asked.speed:
        return "its weight drives it, so a depth_rate is needed that is not 0 and less than the speed"
    if asked.roll or asked.sway_speed:
        return "its roll and sway follow from the turn, so none can be asked for"
    return ""


def channel_demands(hull: Vehicle, x: np.ndarray) -> list[Demand]:
    """Return the demands of a state (16 and one for each channel,) on the listed actuators."""
    return [
        Demand(channel.name, abs(float(value)), channel.high if value > 0.0 else -channel.low, channel.unit)
        for channel, value in zip(hull.channels, x[CHANNELS], strict=True)
    ]


class GliderMotion(Motion):
    """The requested motion of a glider."""

    @cached_property
    def places(self) -> list[int]:
        """Places of slide, turn and volume among the channels."""
        names = [channel.name for channel in self.hull.channels]
        slide = names.index(f"{self.hull.moving_masses[0][0]}_slide")
        return [slide, slide + 1, names.index(self.hull.buoyancy_engines[0][0])]

    def asked_part(self, share: float) -> Asked:
        """Return a share of the turn."""
        return replace(self.asked, turn_rate=share * self.asked.turn_rate)

    def guess(self) -> np.ndarray:
        """Return the unknowns (7,) to begin with: straight along the path, weight against drag, level mass balanced."""
        asked, hull = self.asked, self.hull
        pitch = -asin(asked.depth_rate / asked.speed)
        x = self.state(np.array([0.0, 0.0, 0.0, 0.0, pitch, 0.0, 0.0]))
        drag = -float((self.numbers.mass_matrix @ rate(x, x[12:], self.numbers)[VELOCITY])[0])
        volume = drag / (hull.water.density * hull.water.gravity * sin(pitch))
        mass = hull.moving_masses[0][1].mass
        slide = hull.rigid_body.mass * hull.rigid_body.centre_of_gravity_z * tan(-pitch) / mass
        return np.array([slide, 0.0, 1e3 * volume, 0.0, pitch, 0.0, 0.0])

    def state(self, y: np.ndarray) -> np.ndarray:
        """Return x for the unknowns s [m], γ [rad], V [L], φ, θ [rad], v, w [m/s]."""
        slide, turn, litres, roll, pitch, v, w = y
        x = resting_state(self.hull)
        x[ROLL], x[PITCH] = roll, pitch
        x[VELOCITY] = self.velocity(roll, pitch, v, w)
        x[CHANNELS][self.places] = slide, turn, 1e-3 * litres
        return x

    def is_near(self, y: np.ndarray) -> bool:
        """Return whether unknowns are those of an upright hull, not of another balance."""
        return bool(np.max(np.abs(y[[1, 3, 4]])) < 0.5 * pi)
