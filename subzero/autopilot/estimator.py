"""The LQG heading loop: full state feedback (LQR) on the estimate of a Kalman filter.

    δ = limited(δ_ff − k·(x̂ − x_w) + I),   x = (v, r, ψ, δ_r)
    x̂ ← A_d x̂ + B_d (δ − δ_ff) + L (y − C x̂),   y = (r, ψ)

Sway speed and rudder angle are not measured. The gains come from `control.lqr` with the matrices in `Gains`, the filter
from `control.dlqe` on the model sampled at the controller's rate. Both are scheduled on the speed. The force of the
cable is not in the filter's model: feed-forward cancels it, and the integral removes the remainder.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from scenarios.heading import shortest
from subzero.autopilot.design import WEIGHTS, Gains, Schedule, design_gains
from subzero.autopilot.linear import linearise, subsystem
from subzero.autopilot.loops import Law, Loop
from subzero.autopilot.tuning import Tuning
from subzero.channels import Observation
from subzero.steady_motion.trim import trim

STATES = ("sway_speed", "yaw_rate", "heading", "rudder_angle")
TRACKED = ("yaw_rate", "heading")
MEASURED = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
LARGEST, LARGEST_COMMAND = WEIGHTS["heading"].largest, WEIGHTS["heading"].largest_command
PROCESS_NOISE = np.diag([0.05, 0.05, 0.01, 0.02]) ** 2
"""Covariance of the process noise, per second: sway speed [m/s], yaw rate [rad/s], heading, rudder [rad]."""
MEASUREMENT_NOISE = np.diag([radians(0.5), radians(0.5)]) ** 2
"""Covariance of the measured yaw rate and heading [rad2/s2, rad2]."""
LARGEST_ERROR = radians(25.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimates:
    """The matrices of the heading loop, scheduled on the speed.

    Attributes:
        designs: the LQR design at each speed.
        feedback: k (4,), k_I and b over speed.
        model: A_d (4, 4) and B_d (4,), side by side (4, 5), over speed.
        filter: L (4, 2) over speed.
        turn: sway speed and rudder of a steady turn over its yaw rate (2,), over speed [m, s].
    """

    designs: tuple[Gains, ...]
    feedback: Schedule
    model: Schedule
    filter: Schedule
    turn: Schedule


def estimates(
    tuning: Tuning,
    sample_time: float,
    *,
    largest: dict[str, float] | None = None,
    largest_command: float = LARGEST_COMMAND,
) -> Estimates:
    """Return the matrices of the full-state heading loop at the speeds of a tuning.

    Args:
        tuning: the vehicle.
        sample_time: of the controller. [s]
        largest: weights that replace those of `LARGEST`.
        largest_command: weight of the rudder. [rad]
    """
    import control

    weights = {**LARGEST, **(largest or {})}
    parts = []
    for speed in tuning.speeds:
        line = linearise(tuning.model, trim(tuning.model, speed=speed))
        parts.append(subsystem(line, "yaw_sway"))
    designs = tuple(
        design_gains(part, tracked="heading", largest=weights, largest_command=largest_command)
        for part in parts
    )
    sampled = [control.c2d(part, sample_time) for part in parts]
    process = PROCESS_NOISE * sample_time
    filters = [
        np.asarray(control.dlqe(np.asarray(model.A), np.eye(4), MEASURED, process, MEASUREMENT_NOISE)[0])
        for model in sampled
    ]
    speeds = np.array(tuning.speeds)
    turn = np.stack([tuning.sway_per_yaw.values, tuning.rudder_per_yaw.values], axis=1)
    return Estimates(
        designs=designs,
        feedback=Schedule(speeds, np.array([design.numbers() for design in designs])),
        model=Schedule(speeds, np.array([np.hstack([model.A, model.B]) for model in sampled])),
        filter=Schedule(speeds, np.array(filters)),
        turn=Schedule(speeds, turn),
    )


class EstimatorLoop(Loop):
    """The LQG heading loop with its state.

    Args:
        matrices: from `estimates`, for the same sample time.
        sample_time: of the controller. [s]
    """

    measured = TRACKED

    def __init__(self, matrices: Estimates, sample_time: float) -> None:
        self.matrices = matrices
        law = Law(measured=STATES, gains=matrices.feedback, largest_error=LARGEST_ERROR)
        super().__init__(law, sample_time)

    def _begin(self, reading: Observation, command: float) -> None:
        """Begin to estimate sway speed and rudder, the rudder at its command."""
        self.estimate = np.array([0.0, reading.yaw_rate, reading.heading, command])

    def _now(self, reading: Observation) -> float:
        """Return the heading, as it is estimated."""
        return float(self.estimate[2])

    def _feedback(
        self, reading: Observation, wanted: float, speed: float, rate: float
    ) -> tuple[float, float]:
        """Return −k·(x̂ − x_w), and the increment of the integral."""
        *k, k_integral, _ = self.matrices.feedback.at(speed).tolist()
        sway, rudder = (self.matrices.turn.at(speed) * rate).tolist()
        error = self._error(wanted, self._now(reading))
        off = self.estimate - np.array([sway, rate, self.estimate[2] + error, rudder])
        return -float(np.dot(k, off)), self.sample_time * k_integral * error

    def _go_on(self, reading: Observation, speed: float, command: float, rate: float) -> None:
        """Move the estimate on by a sample: prediction, and correction by the innovation."""
        command += float(self.matrices.turn.at(speed)[1]) * rate
        model, gain = self.matrices.model.at(speed), self.matrices.filter.at(speed)
        innovation = np.array([reading.yaw_rate, reading.heading]) - MEASURED @ self.estimate
        innovation[1] = shortest(float(innovation[1]))
        self.estimate = model[:, :4] @ self.estimate + model[:, 4] * command + gain @ innovation
