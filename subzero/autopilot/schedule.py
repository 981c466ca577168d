"""Numbers that change with the speed: designed at several speeds, read in between.

A rudder is worth u², so one set of gains is too weak at half the speed and too strong at twice. Arrays of any shape are
kept at a few speeds and read linearly in between; beyond the ends the last ones hold.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from subzero.errors import UserError


@dataclass(frozen=True, eq=False)
class Schedule:
    """Arrays over speed.

    Attributes:
        speeds: increasing (n,). [m/s]
        values: one array a speed (n, ...).
    """

    speeds: np.ndarray
    values: np.ndarray

    @classmethod
    def of(cls, speeds: np.ndarray, make: Callable[[float], np.ndarray | float]) -> Schedule:
        """Return the schedule that `make` gives, asked at each speed."""
        return cls(np.asarray(speeds, dtype=float), np.array([make(float(speed)) for speed in speeds]))

    def __post_init__(self) -> None:
        """Refuse what is no schedule."""
        if self.speeds.ndim != 1 or self.speeds.size == 0 or np.any(np.diff(self.speeds) <= 0.0):
            raise UserError(f"Schedule: the speeds are {self.speeds}. Allowed: numbers that increase.")
        if not np.all(np.isfinite(self.values)):
            raise UserError("Schedule: a value is not a finite number.")

    def at(self, speed: float) -> np.ndarray:
        """Return the array at a speed [m/s].

        Raises:
            UserError: the speed is not a number: nothing is wanted, or no sensor measures it.
        """
        if speed != speed:
            raise UserError("there are no gains for a speed that is not a number. Allowed: a speed in m/s.")
        place = float(np.interp(speed, self.speeds, np.arange(self.speeds.size)))
        low = min(int(place), self.speeds.size - 1)
        high = min(low + 1, self.speeds.size - 1)
        values = self.values[low] + (place - low) * (self.values[high] - self.values[low])
        return np.asarray(values)
