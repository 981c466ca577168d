"""One loop of an autopilot, in discrete time: state feedback with integral action.

    δ = limited(δ_ff + k_y (y_w − y) + k_r (y_w' − r) + I),   I ← I + T k_I (y_w − y), not further into a limit
    and when what is wanted jumps by Δ, more than it was said to move on:  I ← I − (1 − b) k_y Δ

y is what is measured: the speed for the propeller (a PI), an angle y and its rate r for a fin (a PID). The integral is
kept in units of the command, so gains that change with the speed change nothing by themselves, and the loop can take
over from any command without a jump (`engage`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

from subzero.autopilot.design import Schedule
from subzero.errors import UserError
from subzero.simulator import Observation


@dataclass(frozen=True, kw_only=True, eq=False)
class Law:
    """What a loop does; frozen, to be shared.

    Attributes:
        measured: channels that are fed back: the tracked one alone, or its rate and it.
        gains: (k of each, k_I, b) over speed, (n + 2,) at a speed, from `Gains.numbers`.
        largest_error: errors beyond this count as this, so that a far goal asks for no more than the fins can do
            [unit of the tracked channel].
    """

    measured: tuple[str, ...]
    gains: Schedule
    largest_error: float

    def __post_init__(self) -> None:
        """Refuse gains that do not fit."""
        if self.gains.values.shape[1:] != (len(self.measured) + 2,):
            raise UserError(
                f"Law: gains of shape {self.gains.values.shape[1:]} for {', '.join(self.measured)}."
                f" Allowed: ({len(self.measured) + 2},), one for each, the integral's and the share of a step."
            )


def refuse_unknown(reading: Observation, measured: tuple[str, ...], **given: float) -> None:
    """Refuse what is not a finite number: the limits of a command would make a full deflection of it, unseen.

    Args:
        reading: what the sensors tell.
        measured: channels that the loop feeds back, the tracked one last.
        given: what else it takes, by name.

    Raises:
        UserError: names what is no number.
    """
    values = {name: getattr(reading, name) for name in measured} | given
    unknown = [name for name, value in values.items() if not isfinite(value)]
    if unknown:
        raise UserError(
            f"at t = {reading.time:g} s the loop of the {measured[-1]} has no number for {', '.join(unknown)}: no"
            " sensor measures it, or nothing is wanted."
        )


class Loop:
    """A law at work.

    Args:
        law: what to do.
        sample_time: T. [s]
    """

    def __init__(self, law: Law, sample_time: float) -> None:
        self.law, self.sample_time = law, sample_time
        self.reset()

    def reset(self) -> None:
        """Forget what was integrated."""
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
        """Take over from a command without a jump: the next command, unlimited, is this one."""
        refuse_unknown(reading, self.law.measured, wanted=wanted, command=command, feed_forward=feed_forward)
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
            reading: what is measured.
            wanted: y_w, of the tracked channel, the last of `Law.measured`.
            speed: that the gains belong to. [m/s]
            feed_forward: δ_ff, added before the limits.
            limits: of the command; the integral does not wind up beyond them.
            integrate: whether to; a fin without flow has nothing to learn from its error.
            rate: y_w', how fast what is wanted moves on.

        Raises:
            UserError: something of this is not a finite number.
        """
        refuse_unknown(reading, self.law.measured, wanted=wanted, rate=rate, feed_forward=feed_forward)
        self.integral -= self._jump(reading, wanted, speed, rate)
        feedback, growth = self._feedback(reading, wanted, speed, rate)
        low, high = limits
        command = feed_forward + feedback + self.integral + growth
        if not integrate or (command > high and growth > 0.0) or (command < low and growth < 0.0):
            growth = 0.0
        self.integral += growth
        return min(high, max(low, feed_forward + feedback + self.integral))

    def _jump(self, reading: Observation, wanted: float, speed: float, rate: float) -> float:
        """Return what a jump of what is wanted takes off the integral, (1 − b) k_y Δ."""
        before = wanted if self._wanted is None else self._wanted + rate * self.sample_time
        self._wanted = wanted
        *_, k, _, b = self.law.gains.at(speed).tolist()
        measured = getattr(reading, self.law.measured[-1])
        return float((1.0 - b) * k * (self._limited(wanted - measured) - self._limited(before - measured)))

    def _limited(self, error: float) -> float:
        """Return an error, no larger than counts."""
        return max(-self.law.largest_error, min(self.law.largest_error, error))

    def _feedback(
        self, reading: Observation, wanted: float, speed: float, rate: float
    ) -> tuple[float, float]:
        """Return k·(what is wanted − what is measured) and how the integral grows in this sample."""
        *gains, k_integral, _ = self.law.gains.at(speed).tolist()
        *others, tracked = self.law.measured
        error = self._limited(wanted - getattr(reading, tracked))
        total = gains[-1] * error
        for gain, name in zip(gains, others, strict=False):
            total += gain * (rate - getattr(reading, name))
        return total, self.sample_time * k_integral * error
