"""Servos: from a command to the angle of a fin.

    k      = (1 − c) position feedback
    target = (1 − k) clip((1 − c) dead zone(command) + offset, ± deflection limit) + k clip(command, ± deflection limit)
    seen   = (1 − k) δ + k fin
    δ'     = clip((target − seen)/lag, ± rate limit)
    fin    = δ, dragged behind by half the backlash of the linkage

The servo turns until it sees the commanded angle. Without position feedback, k = 0, it sees its own shaft, and
dead band, offset and play stand between the command and the fin. With k = 1 it sees the fin itself, which ends where it
was commanded: "feeding back the actual positions of the control fins to their servo's" (Feng and Allen, section 4.2,
their remedy for what Fig. 6 (d) leaves unexplained). Between the two, k is the share of the error that is taken at the
fin, and 1 − k of dead band, offset and play remains. The fin's own sensor is taken as perfect, and as fast as the
servo.

c is the share of the command that is lost on the way: a coupling that slips. With c = 1 the fin is jammed at its
offset, and no feedback moves it.

Each stage has a neutral value that switches it off exactly: dead band 0, offset 0, lag 0 with an infinite
rate limit (the fin then *is* at its target and the state merely follows), rate and deflection limit infinite,
backlash 0, position feedback 0, lost command 0. With a finite rate limit a servo still has to stop somewhere: lags
shorter than `vehicle.state.QUICKEST` count as `QUICKEST`.

Backlash is a play between servo and fin: the linkage does not move until the servo has taken up the
slack. Inside a step the fin is the linkage clipped into the play around the servo; `settle` moves the linkage
at the end of each step. For a servo that turns one way during a step this is the exact play operator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from subzero.jit import Record, compiled, gated_inlined, inlined
from vehicle.parameters import Section, parameter
from vehicle.state import LINKAGE, QUICKEST, SERVO


class ServoNumbers(Record):
    """The parameters of one servo, as the compiled functions take them."""

    dead_band: float
    offset: float
    lag: float
    rate_limit: float
    deflection_limit: float
    half_backlash: float
    position_feedback: float
    lost_command: float


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
    position_feedback: float = parameter("share of the error taken at the fin, k", "1", low=0.0, high=1.0)
    lost_command: float = parameter("share of the command that is lost, c; 1: jammed", "1", low=0.0, high=1.0)

    def numbers(self) -> ServoNumbers:
        """Return the numbers that the compiled servo needs."""
        return ServoNumbers(*self.values())


@inlined
def _feedback(servo: ServoNumbers) -> float:
    """Return k, the share of the error that is taken at the fin, as far as the fin follows at all."""
    return (1.0 - servo.lost_command) * servo.position_feedback


@gated_inlined
def servo_target(command: float, servo: ServoNumbers) -> float:
    """Return the angle that a commanded angle leads to in the end, but for the play [rad]."""
    moved = max(0.0, command - servo.dead_band) + min(0.0, command + servo.dead_band)
    most, k = servo.deflection_limit, _feedback(servo)
    own = max(-most, min(most, (1.0 - servo.lost_command) * moved + servo.offset))
    return (1.0 - k) * own + k * max(-most, min(most, command))


@inlined
def servo_rate(angle: float, linkage: float, command: float, servo: ServoNumbers) -> float:
    """Return how fast a servo at `angle`, with its linkage at `linkage`, turns under a commanded angle [rad/s]."""
    k = _feedback(servo)
    seen = (1.0 - k) * angle + k * _dragged(linkage, angle, servo.half_backlash)
    rate = (servo_target(command, servo) - seen) / max(servo.lag, QUICKEST)
    return max(-servo.rate_limit, min(servo.rate_limit, rate))


@inlined
def fin_angle(angle: float, linkage: float, command: float, servo: ServoNumbers) -> float:
    """Return the angle of a fin in the water, from the angles of servo, linkage and command [rad].

    A servo without any lag or rate limit is where it comes to rest: what it sees is its target, so of the play, too,
    the share 1 − k remains.
    """
    if servo.lag == 0.0 and math.isinf(servo.rate_limit):
        play = (1.0 - _feedback(servo)) * servo.half_backlash
        return _dragged(linkage, servo_target(command, servo), play)
    return _dragged(linkage, angle, servo.half_backlash)


@inlined
def _dragged(linkage: float, servo: float, half_backlash: float) -> float:
    """Return the angle of a linkage whose servo has turned within, or beyond, its play [rad]."""
    return max(servo - half_backlash, min(servo + half_backlash, linkage))


@compiled
def settle(state: np.ndarray, command: np.ndarray, servos: Servos) -> None:
    """Move the linkages of a state to where their servos have taken them, at the end of a step."""
    for i in range(3):
        state[LINKAGE + i] = fin_angle(state[SERVO + i], state[LINKAGE + i], command[1 + i], servos[i])
