"""Steady glide: which ballast, place and turn of a moving mass, and attitude hold a speed, a depth rate and a turn.

    ν'(s, γ, V, φ, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')

s and γ are slide and turn of the first moving mass, V the volume of the first buoyancy engine: a glider that dives or
climbs, straight or in a spiral. The roll angle is unknown here: it turns a glider. The weight drives, so a
depth rate must be asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asin, cos, pi, sin, tan

import numpy as np

from subzero.steady_motion.asked import Asked
from subzero.steady_motion.hull_state_space import (
    CHANNELS,
    DEPTH,
    PITCH,
    ROLL,
    VELOCITY,
    Demand,
    rate,
    resting_state,
)
from subzero.steady_motion.steady_pull import SteadyPull
from vehicle import Vehicle, VehicleNumbers


def is_glider(hull: Vehicle) -> bool:
    """Return whether a vehicle is driven by its weight: no propeller, no thrusters, a moving mass and an engine."""
    is_driven = bool(hull.thrusters) or hull.propeller.thrust_constant > 0.0
    return not is_driven and bool(hull.moving_masses) and bool(hull.buoyancy_engines)


def refusal(asked: Asked) -> str:
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


@dataclass(frozen=True, kw_only=True)
class GliderMotion:
    """The requested motion of a glider, with which pull beyond the formula's.

    Attributes:
        asked: which motion.
        hull: whose masses and engines.
        numbers: of the hull, its actuators without limits.
        places: of slide, turn and volume among the channels.
        pull: of the cable.
        extra: added to that pull.
    """

    asked: Asked
    hull: Vehicle
    numbers: VehicleNumbers
    places: tuple[int, int, int]
    pull: SteadyPull
    extra: np.ndarray

    @classmethod
    def of(cls, asked: Asked, hull: Vehicle, numbers: VehicleNumbers, pull: SteadyPull) -> GliderMotion:
        """Return the requested motion of a glider."""
        names = [channel.name for channel in hull.channels]
        slide = names.index(f"{hull.moving_masses[0][0]}_slide")
        places = (slide, slide + 1, names.index(hull.buoyancy_engines[0][0]))
        return cls(asked=asked, hull=hull, numbers=numbers, places=places, pull=pull, extra=np.zeros(6))

    def part(self, share: float) -> GliderMotion:
        """Return the same with a share of the turn."""
        turn_rate = share * self.asked.turn_rate
        return replace(self, asked=replace(self.asked, turn_rate=turn_rate), extra=share * self.extra)

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
        spin = (-sin(pitch), cos(pitch) * sin(roll), cos(pitch) * cos(roll))
        x[VELOCITY] = self.asked.speed, v, w, *(self.asked.turn_rate * part for part in spin)
        x[CHANNELS][list(self.places)] = slide, turn, 1e-3 * litres
        return x

    def left(self, y: np.ndarray) -> np.ndarray:
        """Return the residual of the seven equations."""
        x = self.state(y)
        rates = rate(x, x[12:], self.numbers, self.pull.wrench(x[VELOCITY]) + self.extra)
        return np.append(rates[VELOCITY], rates[DEPTH] - self.asked.depth_rate)

    def is_near(self, y: np.ndarray) -> bool:
        """Return whether unknowns are those of an upright hull, not of another balance."""
        return bool(np.max(np.abs(y[[1, 3, 4]])) < 0.5 * pi)
