"""Servos: from a command to the angle of a fin.

    target = clip(dead zone(command) + offset, ± deflection limit)
    δ'     = clip((target − δ)/lag, ± rate limit)
    fin    = δ, dragged behind by half the backlash of the linkage

Each stage has a neutral value that switches it off exactly: dead band 0, offset 0, lag 0 with an infinite
rate limit (the fin then *is* at its target and the state merely follows), rate and deflection limit infinite,
backlash 0. With a finite rate limit a servo still has to stop somewhere: lags shorter than `QUICKEST` count
as `QUICKEST`.

Backlash is a play between servo and fin: the linkage stays where it is until the servo has taken up the
slack. Inside a step the fin is the linkage clipped into the play around the servo; `settle` moves the linkage
at the end of each step. For a servo that turns one way during a step this is the exact play operator.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import NamedTuple

import numpy as np

from subzero.compiled import compiled
from vehicle.parameters import Section, parameter
from vehicle.state import LINKAGE, SERVO

QUICKEST = 0.01
"""Shortest lag of a state [s]: an explicit Runge-Kutta step of 0.02 s is stable down to a lag of 0.0072 s."""


class ServoNumbers(NamedTuple):
    """The parameters of one servo, as the compiled functions take them."""

    dead_band: float
    offset: float
    lag: float
    rate_limit: float
    deflection_limit: float
    half_backlash: float


Servos = tuple[ServoNumbers, ServoNumbers, ServoNumbers]
"""Those of rudder, port plane and starboard plane."""


@dataclass(frozen=True, kw_only=True)
class Servo(Section):
    """One servo with its linkage."""

    dead_band: float = parameter("half-width of commands that do nothing", "rad", low=0.0)
    offset: float = parameter("fin angle at zero command", "rad")
    lag: float = parameter("time constant", "s", low=0.0)
    rate_limit: float = parameter("fastest turn of the servo", "rad/s", above=0.0, unlimited=True)
    deflection_limit: float = parameter("largest angle either way", "rad", low=0.0, unlimited=True)
    half_backlash: float = parameter("half the play of the linkage", "rad", low=0.0)

    def numbers(self) -> ServoNumbers:
        """Return what the compiled servo needs."""
        return ServoNumbers(*astuple(self))


@compiled
def servo_target(command: float, servo: ServoNumbers) -> float:
    """Return the angle that a commanded angle leads to in the end [rad]."""
    moved = max(0.0, command - servo.dead_band) + min(0.0, command + servo.dead_band)
    return max(-servo.deflection_limit, min(servo.deflection_limit, moved + servo.offset))


@compiled
def servo_rate(angle: float, command: float, servo: ServoNumbers) -> float:
    """Return how fast a servo at `angle` turns under a commanded angle [rad/s]."""
    rate = (servo_target(command, servo) - angle) / max(servo.lag, QUICKEST)
    return max(-servo.rate_limit, min(servo.rate_limit, rate))


@compiled
def servo_angle(angle: float, command: float, servo: ServoNumbers) -> float:
    """Return where the servo is [rad]: at its state, or at its target without any lag or rate limit."""
    if servo.lag == 0.0 and math.isinf(servo.rate_limit):
        return servo_target(command, servo)
    return angle


@compiled
def fin_angle(angle: float, linkage: float, command: float, servo: ServoNumbers) -> float:
    """Return the angle of a fin in the water, from the angles of servo, linkage and command [rad]."""
    where = servo_angle(angle, command, servo)
    return max(where - servo.half_backlash, min(where + servo.half_backlash, linkage))


@compiled
def settle(state: np.ndarray, command: np.ndarray, servos: Servos) -> None:
    """Move the linkages of a state to where their servos have taken them, at the end of a step."""
    for i in range(3):
        state[LINKAGE + i] = fin_angle(state[SERVO + i], state[LINKAGE + i], command[1 + i], servos[i])
