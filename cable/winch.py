"""Winches: they turn the drum when it is not turned by the cable alone.

    PayOutRate       the length in the water follows a rate, S(t) = S(0) + ∫ rate dt; negative reels in, down to nothing
    Brake            the drum stands: the length is constant
    ConstantTension  the drum pays out and reels in so that T(S) equals the commanded tension

A free drum is `cable.DrumProperties`. Each has two methods: `numbers` for compiled code, and `setpoints`, the
commanded values at given times. The length is a state of the cable that the winch controls; nothing along the cable
is rescaled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cable.drum import LENGTH, TENSION, DrumNumbers
from subzero.errors import BadValueError, checked, real, short

Schedule = float | Callable[[float], float]
"""A number, or a function of time [s]."""

SHORTEST = 1e-6
"""A cable that is reeled in completely keeps this length in the water. [m]"""


@dataclass(frozen=True, kw_only=True)
class PayOutRate:
    """A winch that pays out at a given rate.

    Attributes:
        rate: dS/dt, negative to reel in; a number or a function of time. [m/s]
    """

    rate: Schedule

    def __post_init__(self) -> None:
        """Raise an error if the rate is not valid."""
        _check_schedule(self, "rate", self.rate)

    def numbers(self) -> DrumNumbers:
        """Return the plain numbers that compiled code takes."""
        return DrumNumbers(control=LENGTH)

    def setpoints(self, times: np.ndarray, start: float) -> np.ndarray:
        """Return the length asked for at `times` (n,), from `start` on; Simpson's rule within a step. [m]."""
        rate = _sampled(self.rate, times)
        middle = _sampled(self.rate, 0.5 * (times[1:] + times[:-1]))
        growth = np.diff(times) * (rate[:-1] + 4.0 * middle + rate[1:]) / 6.0
        lengths = np.concatenate([[start], growth])
        for k in range(1, lengths.size):
            lengths[k] = max(lengths[k - 1] + lengths[k], SHORTEST)
        return lengths


@dataclass(frozen=True, kw_only=True)
class Brake:
    """A drum that is held."""

    def numbers(self) -> DrumNumbers:
        """Return the plain numbers that compiled code takes."""
        return DrumNumbers(control=LENGTH)

    def setpoints(self, times: np.ndarray, start: float) -> np.ndarray:
        """Return the length at `times` (n,): always `start`. [m]."""
        return np.full(times.size, start)


@dataclass(frozen=True, kw_only=True)
class ConstantTension:
    """A winch that keeps the tension at the drum.

    Attributes:
        tension: T(S), positive; a number or a function of time. [N]
    """

    tension: Schedule

    def __post_init__(self) -> None:
        """Raise an error if the tension is not valid."""
        _check_schedule(self, "tension", self.tension, above=0.0)

    def numbers(self) -> DrumNumbers:
        """Return the plain numbers that compiled code takes."""
        return DrumNumbers(control=TENSION)

    def setpoints(self, times: np.ndarray, start: float) -> np.ndarray:
        """Return the tension asked for at `times` (n,). [N].

        Raises:
            subzero.UserError: a tension that is not positive: a winch cannot push.
        """
        wanted = _sampled(self.tension, times)
        if not (wanted > 0.0).all():
            raise BadValueError(
                f"ConstantTension: the tension must be positive at all times; it falls to {wanted.min():g} N."
            )
        return wanted


Winch = PayOutRate | Brake | ConstantTension


def _check_schedule(winch: Winch, name: str, schedule: object, above: float | None = None) -> None:
    """Raise an error if a schedule is neither a function nor a number."""
    if not callable(schedule):
        checked(type(winch).__name__, name, schedule, above=above)


def _sampled(schedule: Schedule, times: np.ndarray) -> np.ndarray:
    """Return a schedule at times, as finite numbers."""
    values = [schedule(float(t)) if callable(schedule) else schedule for t in times]
    numbers = [real(value) for value in values]
    if None in numbers:
        at = numbers.index(None)
        raise BadValueError(
            f"A winch was asked for {short(values[at])} at {times[at]:g} s; it needs finite numbers."
        )
    return np.array(numbers, dtype=float)
