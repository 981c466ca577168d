"""Which steady motions cannot be had, and how that is told: what is in the way, and how far one can go."""

from __future__ import annotations

from math import degrees, radians, sin
from typing import NoReturn

import numpy as np

from subzero.autopilot.actuators import demands
from subzero.errors import UserError, real, short
from vehicle import Vehicle

CABLES = ("formula", "model")
FASTEST = 50.0
"""A run that is faster is stopped as absurd, `subzero.coupling.FASTEST`. [m/s]"""
STEEPEST = radians(80.0)
"""Pitch beyond which Euler angles are no use any more. [rad]"""


class NoTrimError(UserError):
    """There is no such steady motion; the message names the limit that is hit."""


def check_request(
    speed: float, depth_rate: float, turn_rate: float, wet_length: float, roll: float, cable: str
) -> tuple[float, float, float, float, float]:
    """Return the numbers of a request as floats; refuse what cannot be asked for."""
    asked = {
        "speed": speed,
        "depth_rate": depth_rate,
        "turn_rate": turn_rate,
        "wet_length": wet_length,
        "roll": roll,
    }
    numbers = {name: real(value) for name, value in asked.items()}
    for name, number in numbers.items():
        if number is None:
            raise UserError(f"trim: {name} is {short(asked[name])}; it must be a finite number.")
    speed, depth_rate, turn_rate, wet_length, roll = (number or 0.0 for number in numbers.values())
    if speed <= 0.0:
        raise UserError(f"trim: speed is {speed:g} m/s; fins need a flow, so it must be above 0.")
    if speed > FASTEST:
        raise UserError(
            f"trim: speed is {speed:g} m/s; it must be at most {FASTEST:g}, as runs are stopped beyond."
        )
    if wet_length < 0.0:
        raise UserError(f"trim: wet_length is {wet_length:g} m; it must be 0 or more.")
    if not isinstance(cable, str) or cable not in CABLES:
        raise UserError(f"trim: cable is {short(cable)}; it must be one of {', '.join(CABLES)}.")
    if abs(depth_rate) > speed * sin(STEEPEST):
        raise NoTrimError(
            f"There is no steady motion at {speed:g} m/s with a depth rate of {depth_rate:g} m/s: the pitch angle would"
            f" pass {degrees(STEEPEST):.0f} degrees. At this speed ±{speed * sin(STEEPEST):.2g} m/s is the most."
        )
    return speed, depth_rate, turn_rate, wet_length, roll


def check_limits(hull: Vehicle, x: np.ndarray) -> None:
    """Refuse a steady motion that some actuator cannot hold."""
    beyond = [one for one in demands(hull, x) if one.value > one.limit]
    if beyond:
        said = "; ".join(
            f"the {one.name} would need {one.value:.3g} {one.unit}, its limit is {one.limit:.3g}"
            for one in beyond
        )
        raise NoTrimError(f"There is no such steady motion: {said}. Ask for less speed, turn or depth rate.")


def say_how_far(hull: Vehicle, x: np.ndarray, share: float) -> NoReturn:
    """Raise the error of a motion that has no balance."""
    check_limits(hull, x)
    most = max(demands(hull, x), key=lambda one: one.value / one.limit)
    raise NoTrimError(
        f"There is no such steady motion: there is no balance beyond {share:.0%} of the asked depth rate, turn rate and"
        f" roll, where the {most.name} stands at {most.value:.3g} {most.unit} (limit {most.limit:.3g}): they stall."
        " Ask for less, or for more speed."
    )
