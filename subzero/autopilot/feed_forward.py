"""The cable's force on the vehicle as a controller can estimate it, for the feed-forward path.

There are two estimators; neither sees the true state. `FormulaCable` takes cable length, speed and yaw rate as
measured, and a reduced model of the cable in a turn (`CableInTurn`). `TwinCable` is a simulation of vehicle and cable
that runs in parallel with the controller under the same commands; its force is scaled with the length of cable that
the drum has really paid out.

The reduced model: a light cable without stretch slides along itself and is dragged sideways where it is curved. At the
tow point, with the speed V there split along and across the cable, V_t = V cos α and V_n = V sin α:

    T κ = ½ρdC_n V_n|V_n|,   θ' = V_t κ + V_n/S   the cable turns as it slides along its own curve, and about the drum
    dV_t/ds = −κ V_n                              the curve that is cut off is not paid out: the drum turns slower
    T = C_f/R_d + ½ρπdC_t ∫V_t² ds

(Next to V_t κ, ∂V_n/∂s is taken for a straight line to the drum: good enough where it is small.) Between the tow
point and the drum V_t falls from V cos α to the drum's S'; where on the way it does, is taken from where κ V_n was
lost when the tow point came by. Then the integral needs no memory of the way but the sums P = ∫dp, A = ∫κ|V_n| dp,
∫A dp and ∫A² dp along it:

    V_t(p) = S' + (V cos α − S') A(p)/A
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import atan2, ceil, cos, exp, hypot, pi, sin

import numpy as np

import scenarios
from cable.properties import CableProperties
from subzero.autopilot.sensors import UNKNOWN
from subzero.autopilot.tuning import Tuning
from subzero.channels import Observation
from subzero.errors import UserError
from subzero.model import Model
from subzero.simulation.stepper import RunStoppedError, Simulator

SHORTEST_STEP = 0.01
"""The angle is moved on in steps of at most this. [s]"""
LEAST_PULL = 0.02
"""With less tension than this a cable has no stiffness that the steps could follow. [N]"""
SHORTEST = 1.0
"""A cable shorter than this turns about the drum like this one. [m]"""
STRAIGHT = 1e-9
"""Below this A the way was straight. [1]"""


class CableInTurn:
    """A cable behind a tow point, in the plane of a turn.

    Args:
        cable: whose drags count.
        friction: C_f/R_d of the drum. [N]

    Attributes:
        angle: of the cable's end against the hull's axis, positive to starboard [rad]; it pulls back along that.
        tension: at the tow point. [N]
        length: of the cable in the water. [m]
    """

    def __init__(self, cable: CableProperties, friction: float) -> None:
        self._along, self._friction = cable.tangential_drag, friction
        self._across = 0.5 * cable.water_density * cable.diameter * cable.normal_drag_coefficient
        self.angle, self.tension, self.length = 0.0, friction, 0.0
        self._way, self._lost, self._sum, self._square = 0.0, 0.0, 0.0, 0.0

    def move(self, passed: float, forward: float, starboard: float, yaw_rate: float) -> None:
        """Move the tow point on.

        Args:
            passed: time. [s]
            forward: speed of the tow point through the water along the hull. [m/s]
            starboard: across it. [m/s]
            yaw_rate: of the hull. [rad/s]
        """
        count = max(1, ceil(passed / SHORTEST_STEP))
        step, speed, course = passed / count, hypot(forward, starboard), atan2(starboard, forward)
        for _ in range(count):
            along, across = speed * cos(course - self.angle), speed * sin(course - self.angle)
            curvature = self._across * across * abs(across) / max(self.tension, LEAST_PULL)
            self.angle += step * (along * curvature + across / max(self.length, SHORTEST) - yaw_rate)
            self.angle -= 2.0 * pi * round(self.angle / (2.0 * pi))
            self._lost += step * max(along, 0.0) * curvature * across
            self._way += step * speed
            self._sum += step * speed * self._lost
            self._square += step * speed * self._lost**2

    def pull(self, length: float, paid_out: float, forward: float, starboard: float) -> float:
        """Return the tension at the tow point [N].

        Args:
            length: of the cable in the water. [m]
            paid_out: S', the rate at which the drum gives cable. [m/s]
            forward: speed of the tow point through the water along the hull. [m/s]
            starboard: across it. [m/s]
        """
        self.length, square = length, paid_out**2
        if self._lost > STRAIGHT:
            along = forward * cos(self.angle) + starboard * sin(self.angle)
            mean, mean_square = self._sum / self._lost / self._way, self._square / self._lost**2 / self._way
            more = max(along, 0.0) - paid_out
            square += 2.0 * paid_out * more * mean + more**2 * mean_square
        self.tension = self._friction + self._along * length * square
        return self.tension


SHORT = 0.5
"""Cable shorter than this pulls with nothing worth cancelling. [m]"""
SLOW = 0.05
"""Below this speed of the tow point there is no way to lie along. [m/s]"""
SMOOTHED = 1.0
"""Time constant of the drum's speed: the length is counted in steps. [s]"""


class CableModel(ABC):
    """An estimator of the cable's force on the hull. To write one:

    1. `reset` begins again at the start of a run.
    2. `wrench` is called once a sample, in order, with the readings of the sensors and the previous command; it
       returns force and moment of the cable on the hull (6,), body axes, about the hull centre [N, N m].
    3. It never looks at anything else.
    """

    @abstractmethod
    def reset(self) -> None:
        """Begin again."""

    @abstractmethod
    def wrench(self, reading: Observation, last_command: np.ndarray | None) -> np.ndarray:
        """Return the cable's pull now; `last_command` is None at the first sample."""


def _refuse_unknown_length(reading: Observation) -> None:
    """Raise an error if no sensor measures the cable length: feed-forward would silently be 0."""
    if reading.cable_length != reading.cable_length:
        raise UserError(
            f"at t = {reading.time:g} s no sensor measures the cable's length (cable_length), which feed-forward needs."
        )


class NoCable(CableModel):
    """No feed-forward: feedback only."""

    def reset(self) -> None:
        """Nothing to forget."""

    def wrench(self, reading: Observation, last_command: np.ndarray | None) -> np.ndarray:
        """Return no pull."""
        return np.zeros(6)


class FormulaCable(CableModel):
    """½ρπdC_t ∫V_t² ds against the end of the cable, from drum length, speed and yaw rate.

    On a straight way the cable slides with the speed S' at which the drum lets it go, and pulls against the way of the
    tow point; in a turn it cuts the corner (`CableInTurn`). S' is the slope of the drum length, smoothed over
    `SMOOTHED`.

    Args:
        tuning: of the vehicle, for the sway that goes with a yaw rate.
        model: whose cable is believed in; the tuning's by default.
    """

    def __init__(self, tuning: Tuning, model: Model | None = None) -> None:
        self._tuning, self._model = tuning, model or tuning.model
        self._tow_point = self._model.vehicle.tow_point.position()
        self.reset()

    def reset(self) -> None:
        """Set the drum's speed and the cable's shape to those of the start."""
        drum = self._model.drum
        self._cable = CableInTurn(self._model.cable, drum.friction_torque / drum.radius)
        self._rate, self._before = 0.0, UNKNOWN

    def wrench(self, reading: Observation, last_command: np.ndarray | None) -> np.ndarray:
        """Return the pull of a cable that lies behind the tow point."""
        _refuse_unknown_length(reading)
        u, r = reading.surge_speed, reading.yaw_rate
        nu = np.array([u, float(self._tuning.sway_per_yaw.at(u)) * r, 0.0, 0.0, reading.pitch_rate, r])
        V = nu[:3] + np.cross(nu[3:], self._tow_point)
        self._follow(reading, V)
        speed = float(np.linalg.norm(V))
        if not reading.cable_length > SHORT or speed < SLOW or self._rate <= 0.0:
            return np.zeros(6)
        T = self._cable.pull(reading.cable_length, self._rate, float(V[0]), float(V[1]))
        angle = self._cable.angle
        F = -T * np.array([cos(angle), sin(angle), V[2] / speed])
        return np.concatenate([F, np.cross(self._tow_point, F)])

    def _follow(self, reading: Observation, V: np.ndarray) -> None:
        """Low-pass the rate of the cable length, and move the cable on by a sample."""
        passed = reading.time - self._before.time
        if passed > 0.0:
            slope = (reading.cable_length - self._before.cable_length) / passed
            self._rate += (1.0 - exp(-passed / SMOOTHED)) * (slope - self._rate)
            self._cable.move(passed, float(V[0]), float(V[1]), reading.yaw_rate)
        self._before = reading


class TwinCable(CableModel):
    """A simulation that runs in parallel with the controller under the same commands, corrected by the measured
    length.

    Args:
        trial: where the run starts, and its steps.
        sample_time: of the controller. [s]
        model: the assumed vehicle, cable and water; the trial's by default.
    """

    def __init__(self, trial: scenarios.Trial, sample_time: float, model: Model | None = None) -> None:
        self._twin = Simulator(trial, model=model, sample_time=sample_time)
        self._lost = False

    def reset(self) -> None:
        """Begin again at the start of the trial."""
        self._twin.reset()
        self._lost = False

    def wrench(self, reading: Observation, last_command: np.ndarray | None) -> np.ndarray:
        """Return the twin's pull, in proportion to the length that is out."""
        _refuse_unknown_length(reading)
        if last_command is not None and not self._lost:
            try:
                self._twin.step(last_command)
            except RunStoppedError:
                self._lost = True  # the last pull goes on with the length
        seen = self._twin.observation
        if not (reading.cable_length > SHORT and seen.cable_length > SHORT):
            return np.zeros(6)
        pull = seen[seen._fields.index("cable_force_forward") :]
        return np.array(pull) * (reading.cable_length / seen.cable_length)
