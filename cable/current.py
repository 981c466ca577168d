"""How the water moves: J(north, east, down, time), given on a grid and linear between its points.

    >>> steady = Current.uniform([0.2, 0.0, 0.0])
    >>> sheared = Current.profile(down=[0.0, 10.0, 40.0], velocity=[[0.6, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.1, 0.0]])
    >>> sampled = Current.sampled(lambda n, e, d, t: (0.1 * d, 0.0, 0.0), down=[0.0, 50.0])
    >>> sheared.at((0.0, 0.0, 5.0)).tolist()            # half way down to 10 m
    [0.4, 0.0, 0.0]

Beyond the grid the value at its edge holds. An axis with one point is an axis along which nothing changes.

The cable feels J at its nodes: as the water that drag and added mass are relative to, (7), and through its change in
time along the moving cable. The pressure gradient of an accelerating current (ρA dJ/dt on a neutral cable) is left out,
as in the source, whose J is a constant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from subzero.arguments import checked_arguments, numbers_in
from subzero.errors import BadValueError, short
from subzero.jit import allocating, inlined, inner

WaterVelocity = Callable[[float, float, float, float], Sequence[float]]
"""Function of north, east, down [m] and time [s] that gives the water's velocity (3,). [m/s]"""


class Water(NamedTuple):
    """A current as compiled code sees it: two arrays, for few arguments compile sooner.

    Attributes:
        points: where the cable's positions are zero on the grid's axes (3 numbers), how many points the axes time,
            north, east and down have (4), and these points, one axis after another. [m], [s]
        velocity: north, east, down at the grid points, down running fastest (points of the grid, 3). [m/s]
    """

    points: np.ndarray
    velocity: np.ndarray


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class Current:
    """Velocity of the water on a grid.

    Attributes:
        north, east, down: grid points, increasing; in `cable.pull_out` relative to the drum at the start. [m]
        time: grid points, increasing. [s]
        velocity: north, east, down at the grid points (time, north, east, down, 3). [m/s]

    Raises:
        subzero.UserError: grid points that do not increase, or velocities that are not finite or do not fit the grid.
    """

    velocity: np.ndarray
    north: np.ndarray = field(default_factory=lambda: np.zeros(1))
    east: np.ndarray = field(default_factory=lambda: np.zeros(1))
    down: np.ndarray = field(default_factory=lambda: np.zeros(1))
    time: np.ndarray = field(default_factory=lambda: np.zeros(1))

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a grid."""
        for name in ("time", "north", "east", "down"):
            points = np.atleast_1d(_numbers(name, getattr(self, name)))
            if points.ndim != 1 or points.size == 0 or not (np.diff(points) > 0.0).all():
                raise BadValueError(
                    f"Current: {name} must be numbers that increase; got {short(getattr(self, name))}."
                )
            object.__setattr__(self, name, points)
        velocity = np.ascontiguousarray(_numbers("velocity", self.velocity))
        shape = (self.time.size, self.north.size, self.east.size, self.down.size, 3)
        if velocity.shape != shape:
            raise BadValueError(
                f"Current: the shape of velocity is {velocity.shape}; it must be {shape} (time, north, east, down, 3)."
            )
        object.__setattr__(self, "velocity", velocity)

    @classmethod
    @checked_arguments
    def uniform(cls, velocity: Sequence[float] | np.ndarray) -> Current:
        """Return the same current everywhere and always: north, east, down (3,). [m/s]."""
        return cls(velocity=_three("current", velocity).reshape(1, 1, 1, 1, 3))

    @classmethod
    @checked_arguments
    def profile(cls, down: Sequence[float], velocity: Sequence[Sequence[float]]) -> Current:
        """Return a current that changes with depth: velocities (n, 3) [m/s] at n depths [m]."""
        return cls(down=_numbers("down", down), velocity=_numbers("velocity", velocity)[None, None, None])

    @classmethod
    @checked_arguments
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
        given = {"north": north, "east": east, "down": down, "time": time}
        grid = {name: np.atleast_1d(_numbers(name, points)) for name, points in given.items()}
        if any(points.ndim != 1 for points in grid.values()):
            raise BadValueError("Current.sampled: give grid points as plain sequences of numbers.")
        axes = [grid[name].tolist() for name in ("time", "north", "east", "down")]
        values = [
            [[[function(n, e, d, t) for d in axes[3]] for e in axes[2]] for n in axes[1]] for t in axes[0]
        ]
        return cls(velocity=_numbers("velocity", values), **grid)

    @property
    def fastest(self) -> float:
        """Largest speed on the grid. [m/s]."""
        return float(np.linalg.norm(self.velocity, axis=-1).max())

    @checked_arguments
    def at(self, place: Sequence[float] | np.ndarray, time: float = 0.0) -> np.ndarray:
        """Return the velocity (3,) at a place (north, east, down) [m] and time [s]. [m/s]."""
        values = self.velocity
        for points, x in zip(
            (self.time, self.north, self.east, self.down), (time, *_three("place", place)), strict=True
        ):
            k = int(np.clip(np.searchsorted(points, x) - 1, 0, max(points.size - 2, 0)))
            f = np.clip((x - points[k]) / (points[k + 1] - points[k]), 0.0, 1.0) if points.size > 1 else 0.0
            values = values[k] if f == 0.0 else (1.0 - f) * values[k] + f * values[k + 1]
        return values

    def numbers(self, origin: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0)) -> Water:
        """Return the arrays that compiled code takes, for a cable whose positions are zero at `origin`."""
        axes = (self.time, self.north, self.east, self.down)
        sizes = [float(axis.size) for axis in axes]
        points = np.concatenate([np.asarray(origin, dtype=float), sizes, *axes])
        return Water(points, self.velocity.reshape(-1, 3).copy())


def _numbers(name: str, values: Any) -> np.ndarray:
    """Return finite numbers as an array, or refuse them."""
    array = numbers_in(values)
    if array is None or not np.isfinite(array).all():
        raise BadValueError(f"Current: {name} must be finite numbers; got {short(values)}.")
    return array


def _three(name: str, values: Any) -> np.ndarray:
    """Return three finite numbers as an array; raise an error for anything else."""
    numbers = _numbers(name, values)
    if numbers.shape != (3,):
        raise BadValueError(f"{name} must be three finite numbers (north, east, down); got {short(values)}.")
    return numbers


@inlined
def water_velocity(
    water: Water, north: float, east: float, down: float, time: float
) -> tuple[float, float, float]:
    """Return the water's velocity at a place relative to the grid's origin [m] and a time [s]. [m/s]."""
    J = water.velocity
    if J.shape[0] == 1:
        return J[0, 0], J[0, 1], J[0, 2]
    return _between(water, north, east, down, time)


@allocating
def _between(water: Water, north: float, east: float, down: float, time: float) -> tuple[float, float, float]:
    """Return the velocity between the points of the grid, linear along each axis. [m/s]."""
    J = water.velocity
    place = (time, north + water.points[0], east + water.points[1], down + water.points[2])
    row, share, first = np.zeros(16, np.int64), np.ones(16), 7
    for axis in range(4):
        n = int(water.points[3 + axis])
        x = place[axis]
        k, along = _cell(water.points, first, n, x)
        for corner in range(16):
            far = (corner >> axis) & 1
            row[corner] = row[corner] * n + min(k + far, n - 1)
            share[corner] *= along if far else 1.0 - along
        first += n
    out = np.zeros(3)
    for corner in range(16):
        for i in range(3):
            out[i] += share[corner] * J[row[corner], i]
    return out[0], out[1], out[2]


@inner
def _cell(points: np.ndarray, first: int, n: int, x: float) -> tuple[int, float]:
    """Return the interval of n increasing points, from `first` on, that x lies in, and where in it (0 … 1)."""
    low, high = 0, n - 1
    if x <= points[first] or high == 0:
        return 0, 0.0
    if x >= points[first + high]:
        return high - 1, 1.0
    while high - low > 1:
        middle = (low + high) // 2
        if points[first + middle] <= x:
            low = middle
        else:
            high = middle
    return low, (x - points[first + low]) / (points[first + low + 1] - points[first + low])
