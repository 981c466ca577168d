"""How the water moves: J(north, east, down, time), given on a grid and linear between its points.

    >>> Current.uniform([0.2, 0.0, 0.0])
    >>> Current.profile(down=[0.0, 10.0, 40.0], velocity=[[0.6, 0.0, 0.0], [0.2, 0.1, 0.0], [0.0, 0.1, 0.0]])
    >>> Current.sampled(lambda n, e, d, t: (0.1 * d, 0.0, 0.0), down=[0.0, 50.0])

Beyond the grid the value at its edge holds. An axis with one point is an axis along which nothing changes.

The cable feels J at its nodes: as the water that drag and added mass are relative to, (7), and through its change in
time along the moving cable. The pressure gradient of an accelerating current (ρA dJ/dt on a neutral cable) is left out,
as in the source, whose J is a constant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from subzero.compiled import inner

WaterVelocity = Callable[[float, float, float, float], Sequence[float]]
"""Function of north, east, down [m] and time [s] that gives the water's velocity (3,). [m/s]"""


class Water(NamedTuple):
    """A current as compiled code sees it.

    Attributes:
        north, east, down, time: grid points, increasing; at least one each. [m], [s]
        velocity: north, east, down at the grid points (time, north, east, down, 3). [m/s]
        origin: where the cable's positions are zero, on the grid's axes (3,). [m]
    """

    north: np.ndarray
    east: np.ndarray
    down: np.ndarray
    time: np.ndarray
    velocity: np.ndarray
    origin: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Current:
    """Velocity of the water on a grid.

    Attributes:
        north, east, down: grid points, increasing; in `cable.pull_out` relative to the drum at the start. [m]
        time: grid points, increasing. [s]
        velocity: north, east, down at the grid points (time, north, east, down, 3). [m/s]

    Raises:
        ValueError: grid points that do not increase, or velocities that are not finite or do not fit the grid.
    """

    velocity: np.ndarray
    north: np.ndarray = field(default_factory=lambda: np.zeros(1))
    east: np.ndarray = field(default_factory=lambda: np.zeros(1))
    down: np.ndarray = field(default_factory=lambda: np.zeros(1))
    time: np.ndarray = field(default_factory=lambda: np.zeros(1))

    def __post_init__(self) -> None:
        """Refuse what is no grid."""
        for name in ("time", "north", "east", "down"):
            points = np.atleast_1d(np.asarray(getattr(self, name), dtype=float))
            if points.ndim != 1 or not np.isfinite(points).all() or not (np.diff(points) > 0.0).all():
                message = f"Current: {name} must be finite and increase; got {getattr(self, name)!r}."
                raise ValueError(message)
            object.__setattr__(self, name, points)
        velocity = np.ascontiguousarray(self.velocity, dtype=float)
        shape = (self.time.size, self.north.size, self.east.size, self.down.size, 3)
        if velocity.shape != shape or not np.isfinite(velocity).all():
            message = (
                f"Current: velocity must be finite numbers of shape {shape} (time, north, east, down, 3)."
            )
            raise ValueError(message)
        object.__setattr__(self, "velocity", velocity)

    @classmethod
    def uniform(cls, velocity: Sequence[float] | np.ndarray) -> Current:
        """Return the same current everywhere and always: north, east, down (3,). [m/s]."""
        numbers = np.asarray(velocity, dtype=float)
        if numbers.shape != (3,) or not np.isfinite(numbers).all():
            message = f"current must be three finite numbers (north, east, down in m/s); got {velocity!r}."
            raise ValueError(message)
        return cls(velocity=numbers.reshape(1, 1, 1, 1, 3))

    @classmethod
    def profile(cls, down: Sequence[float], velocity: Sequence[Sequence[float]]) -> Current:
        """Return a current that changes with depth: velocities (n, 3) [m/s] at n depths [m]."""
        return cls(down=np.asarray(down, dtype=float), velocity=np.asarray(velocity)[None, None, None])

    @classmethod
    def sampled(
        cls,
        function: WaterVelocity,
        *,
        north: Sequence[float] = (0.0,),
        east: Sequence[float] = (0.0,),
        down: Sequence[float] = (0.0,),
        time: Sequence[float] = (0.0,),
    ) -> Current:
        """Return the current that a function of (north, east, down, time) describes, sampled on a grid."""
        values = [[[[function(n, e, d, t) for d in down] for e in east] for n in north] for t in time]
        return cls(
            north=np.asarray(north),
            east=np.asarray(east),
            down=np.asarray(down),
            time=np.asarray(time),
            velocity=np.asarray(values, dtype=float),
        )

    @property
    def fastest(self) -> float:
        """Largest speed on the grid. [m/s]."""
        return float(np.linalg.norm(self.velocity, axis=-1).max())

    def at(self, place: Sequence[float] | np.ndarray, time: float = 0.0) -> np.ndarray:
        """Return the velocity (3,) at a place (north, east, down) [m] and time [s]. [m/s]."""
        values = self.velocity
        for points, x in zip((self.time, self.north, self.east, self.down), (time, *place), strict=True):
            k = int(np.clip(np.searchsorted(points, x) - 1, 0, max(points.size - 2, 0)))
            f = np.clip((x - points[k]) / (points[k + 1] - points[k]), 0.0, 1.0) if points.size > 1 else 0.0
            values = values[k] if f == 0.0 else (1.0 - f) * values[k] + f * values[k + 1]
        return values

    def numbers(self, origin: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0)) -> Water:
        """Return the arrays that compiled code takes, for a cable whose positions are zero at `origin`."""
        place = np.array(origin, dtype=float)
        return Water(self.north, self.east, self.down, self.time, self.velocity, place)


@inner
def water_velocity(water: Water, place: np.ndarray, time: float, out: np.ndarray) -> None:
    """Fill out (3,) with the water's velocity at a place relative to `water.origin` (3,) [m] and time [s]. [m/s]."""
    i, a = _cell(water.time, time)
    j, b = _cell(water.north, place[0] + water.origin[0])
    k, c = _cell(water.east, place[1] + water.origin[1])
    m, d = _cell(water.down, place[2] + water.origin[2])
    for n in range(3):
        out[n] = 0.0
    for corner in range(16):
        p, q, r, s = corner & 1, (corner >> 1) & 1, (corner >> 2) & 1, corner >> 3
        share = (a if p else 1.0 - a) * (b if q else 1.0 - b) * (c if r else 1.0 - c) * (d if s else 1.0 - d)
        if share > 0.0:
            for n in range(3):
                out[n] += share * water.velocity[i + p, j + q, k + r, m + s, n]


@inner
def _cell(points: np.ndarray, x: float) -> tuple[int, float]:
    """Return the interval of increasing `points` that x lies in, and where in it (0 … 1; cut off beyond the ends)."""
    low, high = 0, points.size - 1
    if x <= points[0] or high == 0:
        return 0, 0.0
    if x >= points[high]:
        return high - 1, 1.0
    while high - low > 1:
        middle = (low + high) // 2
        if points[middle] <= x:
            low = middle
        else:
            high = middle
    return low, (x - points[low]) / (points[low + 1] - points[low])
