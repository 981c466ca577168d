"""Steady glide: which ballast, place and turn of a moving mass, and attitude hold a speed, a depth rate and a turn.

    ν'(s, γ, V, φ, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')

s and γ are slide and turn of the first moving mass, V the volume of the first buoyancy engine: a glider that dives or
climbs, straight or in a spiral. The roll angle is unknown here: it turns a glider. The weight drives, so a
depth rate must be asked for.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import asin, pi, sin, tan

import numpy as np

from subzero.steady_motion.asked import Asked
from subzero.steady_motion.hull_state_space import (
    CHANNELS,
    PITCH,
    ROLL,
    VELOCITY,
    Demand,
    rate,
    resting_state,
)
from subzero.steady_motion.motion import Motion
from vehicle import Vehicle


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
