"""What the cable does to the vehicle, as a controller can know it: for the feed-forward path.

Both need no look at the true state. The formula takes drum length, speed and yaw rate as measured, and knows how a
cable cuts a corner (`cable_in_turn`). The twin is a simulation of vehicle and cable that runs beside the
controller under the commands that were sent; its pull is taken in proportion to the length of cable that the drum has
really let go.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import cos, exp, sin

import numpy as np

import scenarios
from subzero.autopilot.cable_in_turn import Behind
from subzero.autopilot.sensors import UNKNOWN
from subzero.autopilot.tuning import Tuning
from subzero.errors import UserError
from subzero.model import Model
from subzero.simulator import Observation, RunStoppedError, Simulator

SHORT = 0.5
"""Cable shorter than this pulls with nothing worth cancelling. [m]"""
SLOW = 0.05
"""Below this speed of the tow point there is no way to lie along. [m/s]"""
SMOOTHED = 1.0
"""Time constant of the drum's speed: the length is counted in steps. [s]"""


class CableModel(ABC):
    """What estimates the cable's pull; to write one:

    1. `reset` begins again at the start of a run.
    2. `wrench` is called once a sample, in order, with what the sensors tell and the command of the sample before; it
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
    """Refuse a length that no sensor measures: nothing would be fed forward, unseen."""
    if reading.cable_length != reading.cable_length:
        raise UserError(
            f"at t = {reading.time:g} s no sensor measures the cable's length (cable_length), which feed-forward needs."
        )


class NoCable(CableModel):
    """Feedback alone."""

    def reset(self) -> None:
        """Nothing to forget."""

    def wrench(self, reading: Observation, last_command: np.ndarray | None) -> np.ndarray:
        """Return no pull."""
        return np.zeros(6)


class FormulaCable(CableModel):
    """½ρπdC_t ∫V_t² ds against the end of the cable, from drum length, speed and yaw rate.

    On a straight way the cable slides with the speed S' at which the drum lets it go, and pulls against the way of the
    tow point; in a turn it cuts the corner (`cable_in_turn`). S' is the slope of the drum length, smoothed over
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
        """Forget how fast the drum turns, and how the cable lies."""
        drum = self._model.drum
        self._behind = Behind(self._model.cable, drum.friction_torque / drum.radius)
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
        T = self._behind.pull(reading.cable_length, self._rate, float(V[0]), float(V[1]))
        angle = self._behind.angle
        F = -T * np.array([cos(angle), sin(angle), V[2] / speed])
        return np.concatenate([F, np.cross(self._tow_point, F)])

    def _follow(self, reading: Observation, V: np.ndarray) -> None:
        """Smooth the slope of the drum length, and move the cable on."""
        passed = reading.time - self._before.time
        if passed > 0.0:
            slope = (reading.cable_length - self._before.cable_length) / passed
            self._rate += (1.0 - exp(-passed / SMOOTHED)) * (slope - self._rate)
            self._behind.move(passed, float(V[0]), float(V[1]), reading.yaw_rate)
        self._before = reading


class TwinCable(CableModel):
    """A simulation beside the controller, told the same commands, corrected by the drum's length.

    Args:
        trial: where the run starts, and its steps.
        sample_time: of the controller. [s]
        model: what is believed of vehicle, cable and water; the trial's by default.
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
        pull = (
            seen.cable_force_forward, seen.cable_force_starboard, seen.cable_force_down,
            seen.cable_moment_roll, seen.cable_moment_pitch, seen.cable_moment_yaw,
        )  # fmt: skip
        return np.array(pull) * (reading.cable_length / seen.cable_length)
