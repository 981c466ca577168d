"""The standard autopilot: speed, heading, depth (through pitch) and roll loops, and feed-forward of the cable.

    n   = n(u, D(u_w) − X_c) + PI of the speed            δ_r = rudder against (Y_c, N_c) + loop of the heading
    θ_w = −(z_w − z)/(T_z u), limited                     δ_e = trim + planes against (Z_c, M_c) + PID of the pitch
    port = δ_e − δ_d, starboard = δ_e + δ_d               δ_d = trim + PID of the roll

n(u, F) is the propeller speed that gives the thrust F, δ_e the mean of the stern-planes (pitch) and δ_d half their
difference (roll). The feedback gains are those of the bare hull. Only the feed-forward path knows of the cable.
"""

from __future__ import annotations

from math import copysign, radians, sqrt
from typing import NamedTuple

import numpy as np

from subzero.autopilot.design import WEIGHTS
from subzero.autopilot.feed_forward import CableModel, NoCable
from subzero.autopilot.loops import Law, Loop
from subzero.autopilot.tuning import Tuning
from subzero.channels import Observation
from subzero.errors import UserError
from vehicle import Servo
from vehicle.propeller import PropellerNumbers

SLOWEST = 0.2
"""Below this speed the fins have no effect, and their loops do not integrate. [m/s]"""
STEEPEST = radians(30.0)
"""Largest pitch that the depth loop asks for. [rad]"""
DEPTH_TIME = 4.0
"""T_z, time constant of the depth loop: four times that of the pitch loop inside it. [s]"""
LARGEST_ERRORS = {"speed": 1.0, "heading": radians(25.0), "pitch": radians(25.0), "roll": radians(25.0)}
"""Errors are limited to these. [m/s, rad]"""


class Wanted(NamedTuple):
    """The set-point of an autopilot.

    Attributes:
        speed: forward, through the water as far as the speed log knows. [m/s]
        heading: clockwise from north, held by the shorter way. [rad]
        depth: NaN for level motion instead. [m]
        roll: [rad]
        turn_rate: rate of the wanted heading. [rad/s]
    """

    speed: float
    heading: float
    depth: float = float("nan")
    roll: float = 0.0
    turn_rate: float = 0.0


class StandardAutopilot:
    """The four loops together, with a heading loop of choice.

    Args:
        tuning: from `tune`.
        sample_time: of the controller. [s]
        cable: estimator of the cable's force, for feed-forward; none by default.
        heading: the heading loop; the tuning's PID by default.
        name: for tables and messages.
    """

    def __init__(
        self,
        tuning: Tuning,
        sample_time: float = 0.1,
        *,
        cable: CableModel | None = None,
        heading: Loop | None = None,
        name: str = "pid",
    ) -> None:
        self.tuning, self.sample_time, self.name = tuning, sample_time, name
        self.cable = cable or NoCable()
        laws = {
            loop: Law(
                measured=WEIGHTS[loop].measured, gains=tuning.gains[loop], largest_error=LARGEST_ERRORS[loop]
            )
            for loop in WEIGHTS
        }
        self.speed_loop, self.pitch_loop, self.roll_loop = (
            Loop(laws[loop], sample_time) for loop in ("speed", "pitch", "roll")
        )
        self.heading_loop = heading or Loop(laws["heading"], sample_time)
        hull = tuning.model.vehicle
        self._propeller = hull.propeller.numbers(hull.water.density)
        self._fastest = hull.motor.speed_per_volt * hull.battery.full_voltage
        self._rudder, self._plane = _limit(hull.rudder_servo), _limit(hull.stern_plane_port_servo)
        self._last: np.ndarray | None = None

    def reset(self) -> None:
        """Begin again."""
        for loop in (self.speed_loop, self.heading_loop, self.pitch_loop, self.roll_loop):
            loop.reset()
        self.cable.reset()
        self._last = None

    def engage(self, reading: Observation, wanted: Wanted, command: np.ndarray) -> None:
        """Take over from a command (4,), such as a pilot's, without a jump (bumpless transfer)."""
        ahead, u = self._feed_forward(reading, wanted), reading.surge_speed
        together, unlike = 0.5 * (command[3] + command[2]), 0.5 * (command[3] - command[2])
        self.speed_loop.engage(reading, wanted.speed, wanted.speed, ahead[0], command[0])
        self.heading_loop.engage(reading, wanted.heading, u, ahead[1], command[1], wanted.turn_rate)
        self.pitch_loop.engage(reading, self._wanted_pitch(reading, wanted), u, ahead[2], together)
        self.roll_loop.engage(reading, wanted.roll, u, ahead[3], unlike)
        self._last = None

    def update(self, reading: Observation, wanted: Wanted) -> tuple[float, float, float, float]:
        """Return propeller [rev/s], rudder, port and starboard plane [rad] for the next sample.

        Args:
            reading: measured surge_speed, heading, attitude, rates, depth and, for feed-forward, the cable_length at
                the drum.
            wanted: the set-point.
        """
        ahead, u = self._feed_forward(reading, wanted), reading.surge_speed
        flows = u > SLOWEST
        n = self.speed_loop.update(reading, wanted.speed, wanted.speed, ahead[0], (0.0, self._fastest))
        rudder = self.heading_loop.update(
            reading, wanted.heading, u, ahead[1], (-self._rudder, self._rudder), flows, wanted.turn_rate
        )
        half = 0.5 * self._plane
        unlike = self.roll_loop.update(reading, wanted.roll, u, ahead[3], (-half, half), flows)
        left = self._plane - abs(unlike)
        pitch = self._wanted_pitch(reading, wanted)
        together = self.pitch_loop.update(reading, pitch, u, ahead[2], (-left, left), flows)
        self._last = np.array([n, rudder, together - unlike, together + unlike])
        return n, rudder, together - unlike, together + unlike

    def _feed_forward(self, reading: Observation, wanted: Wanted) -> tuple[float, float, float, float]:
        """Return the feed-forward commands: propeller, rudder, mean and half difference of the planes."""
        pull, tuning, u = self.cable.wrench(reading, self._last), self.tuning, reading.surge_speed
        thrust = float(tuning.hull_drag.at(wanted.speed)) * _beyond(wanted.speed, tuning.speeds) - pull[0]
        together, unlike = tuning.planes.at(u).tolist()
        rudder = (
            float(tuning.rudder_for.at(u) @ pull[[1, 5]])
            + float(tuning.rudder_per_yaw.at(u)) * wanted.turn_rate
        )
        together += float(tuning.planes_for.at(u) @ pull[[2, 4]])
        return propeller_for(thrust, wanted.speed, self._propeller), rudder, together, unlike

    def _wanted_pitch(self, reading: Observation, wanted: Wanted) -> float:
        """Return the pitch that takes the hull to the wanted depth; 0 if none is wanted. [rad]"""
        if wanted.depth != wanted.depth:
            return 0.0
        if reading.depth != reading.depth:
            raise UserError(f"at t = {reading.time:g} s a depth is wanted, and no sensor measures it.")
        climb = -(wanted.depth - reading.depth) / (DEPTH_TIME * max(reading.surge_speed, SLOWEST))
        return max(-STEEPEST, min(STEEPEST, climb))


def propeller_for(force: float, u: float, numbers: PropellerNumbers) -> float:
    """Return n [rev/s] that gives a thrust [N] at a surge speed [m/s]: the root n of a n|n| − b |n| u − c u|u| = F."""
    a, b, c = numbers.thrust_nn, numbers.thrust_nu, numbers.thrust_uu
    if a == 0.0:
        return 0.0
    root = (b * u) ** 2 + 4.0 * a * (force + c * u * abs(u))
    return (b * u + copysign(sqrt(abs(root)), root)) / (2.0 * a) if root > 0.0 else 0.0


def _beyond(speed: float, speeds: tuple[float, ...]) -> float:
    """Return drag over drag at the nearest end of the schedule, for a speed outside it: drag goes with u²."""
    nearest = min(max(speed, speeds[0]), speeds[-1])
    return (speed / nearest) ** 2


def _limit(servo: Servo) -> float:
    """Return the command at which a servo reaches its stop. [rad]"""
    return servo.deflection_limit + servo.dead_band
