"""The ways of a cable's ends, sampled from their velocities, and whether there is memory to follow them.

Every scheme samples its paths here, so all of them run the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cable.memory import refuse_unless_it_fits
from cable.sections import AnyCable, SectionedCable
from subzero.arguments import numbers_in
from subzero.errors import BadValueError, real, short

Velocity = Callable[[float], Sequence[float] | np.ndarray]
"""Function of time [s] that gives a velocity north, east, down (3,). [m/s]"""

REST = 1e-12
"""Slower than this is at rest. [m/s]"""
GAUSS = ((-np.sqrt(0.15), 5.0 / 18.0), (0.0, 8.0 / 18.0), (np.sqrt(0.15), 5.0 / 18.0))
"""Offsets and weights of three-point Gauss quadrature on a step of length one: no time at which a motion may jump."""
MOMENT = 1e-9
"""Just before and just after, as a share of the step."""


class TowPath(NamedTuple):
    """How the tow point moves, relative to the drum at the start, earth axes; cubic between the times.

    Attributes:
        times: (n,). [s]
        place: (n, 3). [m]
        leaving, arriving: velocity just after and just before the times (n, 3). [m/s]
    """

    times: np.ndarray
    place: np.ndarray
    leaving: np.ndarray
    arriving: np.ndarray


def sample_path(velocity: Velocity, duration: float, step: float, name: str = "tow_velocity") -> TowPath:
    """Return the way of a point that moves at `velocity`, from 0: places by Gauss quadrature of order six.

    Velocities are taken just after and just before the times: the motion may change abruptly at a recorded time.
    """
    steps = max(1, round(duration / step))
    check_memory(steps + 1, 1)
    times, h = np.linspace(0.0, duration, steps + 1), duration / steps

    def at(moments: np.ndarray) -> np.ndarray:
        return three_numbers([velocity(t) for t in moments.tolist()], name, moments)

    place = np.zeros((steps + 1, 3))
    for offset, weight in GAUSS:
        place[1:] += weight * h * at(times[:-1] + h * (0.5 + offset))
    leaving, arriving = at(times[:-1] + MOMENT * h), at(times[1:] - MOMENT * h)
    leaving, arriving = np.vstack([leaving, arriving[-1:]]), np.vstack([leaving[:1], arriving])
    return TowPath(times, np.cumsum(place, axis=0), leaving, arriving)


def first_direction(velocity: np.ndarray) -> np.ndarray:
    """Return the unit vector of the first motion in velocities (n, 3); north when there is none."""
    speeds = np.linalg.norm(velocity, axis=1)
    moving = np.flatnonzero(speeds > REST)
    if moving.size == 0:
        return np.array([1.0, 0.0, 0.0])
    direction: np.ndarray = velocity[moving[0]] / speeds[moving[0]]
    return direction


def steady_direction(U: np.ndarray, cable: AnyCable, tail_drag: float) -> np.ndarray:
    """Return the direction from the tail to the tow point in a steady tow, a unit vector (3,).

    Args:
        U: velocity of the tow point through the water, from the start on (n, 3). [m/s]
        cable: the cable.
        tail_drag: ½ρC_dA of a drogue. [kg/m]
    """
    speed, weight, ahead = float(np.linalg.norm(U[0])), cable.weight_in_water, first_direction(U)
    # A cable at rest in the water hangs straight down, or up if it is buoyant.
    if speed == 0.0 and weight != 0.0:
        return np.array([0.0, 0.0, -np.sign(weight)])
    trails = weight == 0.0 or tail_drag > 0.0 or speed == 0.0 or abs(ahead[2]) > 1e-9
    if trails or isinstance(cable, SectionedCable):
        return ahead
    phi = cable.critical_angle(speed)
    direction: np.ndarray = np.cos(phi) * ahead + np.array([0.0, 0.0, -np.sign(weight) * np.sin(phi)])
    return direction


def length_of_way(place: np.ndarray) -> float:
    """Return the length of the way through places (n, 3). [m]."""
    return float(np.linalg.norm(np.diff(place, axis=0), axis=1).sum())


MOST_SEGMENTS = 10_000_000
"""More segments than this are a slip of the pen: they need 14 gigabytes, and minutes a step."""


def segments_needed(length: float, segment_length: float, grading: float) -> int:
    """Return how many segments a cable of some length [m] takes at most."""
    count = _segments_needed(length, segment_length, grading)
    if not count <= MOST_SEGMENTS:
        raise BadValueError(
            f"segment_length is {segment_length:g} m; a cable of up to {length:.3g} m would have more than"
            f" {MOST_SEGMENTS} segments. Take longer ones, or grading."
        )
    return int(count)


def _segments_needed(length: float, segment_length: float, grading: float) -> float:
    if grading * length < segment_length:
        return length // segment_length + 8
    return float(np.log1p(grading * length / segment_length) // np.log1p(grading) + 12)


BYTES_A_NODE = 32.0
"""Of a shape that is kept: a place and a tension. [bytes]"""
BYTES_A_SEGMENT = 1400.0
"""Of a cable that is solved: three levels of time, and the blocks of the matrix. [bytes]"""
SHORTEN = "Record less often (a longer step), or take longer segments (segment_length, grading)."


def check_memory(rows: int, segments: int) -> None:
    """Raise an error if a run of so many results with shapes of so many segments does not fit into memory."""
    size = rows * (segments + 2.0) * BYTES_A_NODE + segments * BYTES_A_SEGMENT
    what = f"A run of {rows} results with up to {segments} segments each"
    refuse_unless_it_fits(size, what, SHORTEN)


def three_numbers(
    values: Sequence[Sequence[float] | np.ndarray], name: str, moments: np.ndarray
) -> np.ndarray:
    """Return velocities as an array (times, 3); report the first that is not three finite numbers in an error."""
    array = numbers_in(values)
    if array is not None and array.shape == (moments.size, 3) and np.isfinite(array).all():
        return array
    for t, value in zip(moments.tolist(), values, strict=True):
        if np.shape(value) != (3,) or any(real(x) is None for x in value):
            raise BadValueError(
                f"{name}({t:g}) must be three finite numbers (north, east, down in m/s); got {short(value)}."
            )
    raise BadValueError(f"{name} must give three finite numbers (north, east, down in m/s) at every time.")
