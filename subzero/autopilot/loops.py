"""One control loop in discrete time: state feedback with integral action, anti-windup and set-point weighting.

    δ = limited(δ_ff + k_y (y_w − y) + k_r (y_w' − r) + I),   I ← I + T k_I (y_w − y), but not further into a limit
    when the set-point y_w jumps by Δ (beyond y_w' T):   I ← I − (1 − b) k_y Δ

y is measured: the speed for the propeller (PI), or an angle y and its rate r for a fin (PID). b is the set-point weight
(`Gains.share`): only b Δ of a step acts at once, the integral brings the rest. I is kept in units of the command, so a
change of the scheduled gains does not make it jump, and the loop can take over from any command (`engage`, bumpless
transfer).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

from scenarios.heading import shortest
from subzero.autopilot.design import Schedule
from subzero.channels import HEADING, Observation
from subzero.errors import UserError


@dataclass(frozen=True, kw_only=True, eq=False)
class Law:
    """The control law of a loop: the states it feeds back, and the gains. Frozen, so that loops can share it.

    Attributes:
        measured: channels that are fed back: the tracked one alone, or its rate and it.
        gains: (k of each, k_I, b) over speed, (n + 2,) at a speed, from `Gains.numbers`.
        largest_error: the error is limited to this, so that a far set-point does not saturate the fins.
            [unit of the tracked channel]
    """

    measured: tuple[str, ...]
    gains: Schedule
    largest_error: float

    def __post_init__(self) -> None:
        """Raise an error if the gains do not fit."""
        if self.gains.values.shape[1:] != (len(self.measured) + 2,):
            raise UserError(
                f"Law: gains of shape {self.gains.values.shape[1:]} for {', '.join(self.measured)}."
                f" Allowed: ({len(self.measured) + 2},), one for each, the integral's and the share of a step."
            )


def refuse_unknown(reading: Observation, measured: tuple[str, ...], **given: float) -> None:
    """Raise an error for NaN and infinity: the command limits would turn them silently into full deflection.

    Args:
        reading: the measurements.
        measured: channels that the loop feeds back, the tracked one last.
        given: other inputs of the loop, by name.

    Raises:
        UserError: one of them is not finite; the message names it.
    """
    values = {name: getattr(reading, name) for name in measured} | given
    unknown = [name for name, value in values.items() if not isfinite(value)]
    if unknown:
        raise UserError(
            f"at t = {reading.time:g} s the loop of the {measured[-1]} has no number for {', '.join(unknown)}: no"
            " sensor measures it, or nothing is wanted."
        )


class Loop:
    """A control law with its state: the integral and the last set-point.

    Args:
        law: of the loop.
        sample_time: T. [s]
    """

    def __init__(self, law: Law, sample_time: float) -> None:
        self.law, self.sample_time = law, sample_time
        self.reset()

    @property
    def measured(self) -> tuple[str, ...]:
        """Channels that a sensor has to measure, the tracked one last."""
        return self.law.measured

    def reset(self) -> None:
        """Set the integral to 0."""
        self.integral = 0.0
        self._wanted: float | None = None

    def engage(
        self,
        reading: Observation,
        wanted: float,
        speed: float,
        feed_forward: float,
        command: float,
        rate: float = 0.0,
    ) -> None:
        """Set the integral so that the next command, before limits, is this one (bumpless transfer)."""
        refuse_unknown(reading, self.measured, wanted=wanted, command=command, feed_forward=feed_forward)
        self._begin(reading, command - feed_forward)
        feedback, _ = self._feedback(reading, wanted, speed, rate)
        self.integral = command - feed_forward - feedback
        self._wanted = wanted

    def update(
        self,
        reading: Observation,
        wanted: float,
        speed: float,
        feed_forward: float = 0.0,
        limits: tuple[float, float] = (-inf, inf),
        integrate: bool = True,
        rate: float = 0.0,
    ) -> float:
        """Return the command for the next sample.

        Args:
            reading: the measurements.
            wanted: y_w, set-point of the tracked channel, which is the last of `measured`.
            speed: at which the scheduled gains are taken. [m/s]
            feed_forward: δ_ff, added before the limits.
            limits: of the command; the integral does not wind up beyond them.
            integrate: False holds the integral, as for a fin without flow.
            rate: y_w', rate of the set-point.

        Raises:
            UserError: an input is not a finite number.
        """
        refuse_unknown(reading, self.measured, wanted=wanted, rate=rate, feed_forward=feed_forward)
        if self._wanted is None:
            self._begin(reading, 0.0)
        self.integral -= self._jump(reading, wanted, speed, rate)
        feedback, growth = self._feedback(reading, wanted, speed, rate)
        low, high = limits
        command = feed_forward + feedback + self.integral + growth
        if not integrate or (command > high and growth > 0.0) or (command < low and growth < 0.0):
            growth = 0.0
        self.integral += growth
        command = min(high, max(low, feed_forward + feedback + self.integral))
        self._go_on(reading, speed, command - feed_forward, rate)
        return command

    def _begin(self, reading: Observation, command: float) -> None:
        """Begin to estimate states that no sensor measures, under a command; nothing here."""

    def _go_on(self, reading: Observation, speed: float, command: float, rate: float) -> None:
        """Go on with that by a sample; nothing here."""

    def _jump(self, reading: Observation, wanted: float, speed: float, rate: float) -> float:
        """Return the change of the integral at a jump of the set-point, (1 − b) k_y Δ."""
        before = wanted if self._wanted is None else self._wanted + rate * self.sample_time
        self._wanted = wanted
        gains, now = self.law.gains.at(speed).tolist(), self._now(reading)
        k, b = gains[self.law.measured.index(self.measured[-1])], gains[-1]
        return float((1.0 - b) * k * (self._error(wanted, now) - self._error(before, now)))

    def _now(self, reading: Observation) -> float:
        """Return the tracked channel, as it is measured."""
        return float(getattr(reading, self.measured[-1]))

    def _error(self, wanted: float, measured: float) -> float:
        """Return how far it is to a set-point, within ±`largest_error`; of a heading by the shorter way."""
        apart = wanted - measured
        error = shortest(apart) if self.measured[-1] == HEADING else apart
        return max(-self.law.largest_error, min(self.law.largest_error, error))

    def _feedback(
        self, reading: Observation, wanted: float, speed: float, rate: float
    ) -> tuple[float, float]:
        """Return the proportional and rate feedback, and the increment of the integral."""
        *gains, k_integral, _ = self.law.gains.at(speed).tolist()
        *others, tracked = self.law.measured
        error = self._error(wanted, getattr(reading, tracked))
        total = gains[-1] * error
        for gain, name in zip(gains, others, strict=False):
            total += gain * (rate - getattr(reading, name))
        return total, self.sample_time * k_integral * error
