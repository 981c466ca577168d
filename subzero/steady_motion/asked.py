"""Which steady motion is asked for, and the error that there is none."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import degrees, radians, sin

from subzero.errors import UserError, real, short

FASTEST = 50.0
"""A run that is faster is stopped as absurd, `subzero.engine.coupling.FASTEST`. [m/s]"""
STEEPEST = radians(80.0)
"""Pitch beyond which Euler angles are no use any more. [rad]"""


class NoTrimError(UserError):
    """There is no such steady motion; the message names the limit that is hit."""


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Which steady motion.

    Attributes:
        speed: u, forward speed through the water. [m/s]
        depth_rate: z', positive down. [m/s]
        turn_rate: ψ', positive to starboard. [rad/s]
        wet_length: cable in the water; its pull is taken as steady although it grows. [m]
        roll: φ, held by unlike stern-planes, or by thrusters. [rad]
        sway_speed: v, to starboard through the water, held by thrusters. [m/s]

    Raises:
        UserError: a number that means nothing here.
    """

    speed: float
    depth_rate: float = 0.0
    turn_rate: float = 0.0
    wet_length: float = 0.0
    roll: float = 0.0
    sway_speed: float = 0.0

    def __post_init__(self) -> None:
        """Raise an error for a request that is not valid."""
        for field in fields(self):
            number = real(value := getattr(self, field.name))
            if number is None:
                raise UserError(f"trim: {field.name} is {short(value)}; it must be a finite number.")
            object.__setattr__(self, field.name, number)
        if abs(self.speed) > FASTEST:
            raise UserError(
                f"trim: speed is {self.speed:g} m/s; it must be at most {FASTEST:g}, as runs are stopped beyond."
            )
        if self.wet_length < 0.0:
            raise UserError(f"trim: wet_length is {self.wet_length:g} m; it must be 0 or more.")

    def check_flow(self) -> None:
        """Raise an error for a motion that fins cannot hold at all.

        Raises:
            NoTrimError: a depth rate that is too steep at this speed.
            UserError: no flow, or a sway speed.
        """
        if self.speed <= 0.0:
            raise UserError(f"trim: speed is {self.speed:g} m/s; fins need a flow, so it must be above 0.")
        if self.sway_speed:
            raise UserError(f"trim: sway_speed is {self.sway_speed:g} m/s; only thrusters hold one.")
        most = self.speed * sin(STEEPEST)
        if abs(self.depth_rate) > most:
            raise NoTrimError(
                f"There is no steady motion at {self.speed:g} m/s with a depth rate of {self.depth_rate:g} m/s: the"
                f" pitch angle would pass {degrees(STEEPEST):.0f} degrees. At this speed ±{most:.2g} m/s is the most."
            )

    def part(self, share: float) -> Asked:
        """Return the same with a share of everything that is not straight and level."""
        names = ("depth_rate", "turn_rate", "roll", "sway_speed")
        asked = {name: share * getattr(self, name) for name in names}
        return replace(self, **asked)
