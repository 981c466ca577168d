"""What a run of the cable is given: the ways of its ends, sampled from velocities, and its numbers, checked.

`cable.pull_out` and `cable.tow` share it, and every scheme samples its paths here, so all of them run the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cable.current import Current
from cable.memory import refuse_unless_it_fits
from subzero.errors import BadValueError, checked, real, short

TowVelocity = Callable[[float], Sequence[float] | np.ndarray]

REST = 1e-12
"""Slower than this is at rest. [m/s]"""
GAUSS = ((-np.sqrt(0.15), 5.0 / 18.0), (0.0, 8.0 / 18.0), (np.sqrt(0.15), 5.0 / 18.0))
"""Offsets and weights of three-point Gauss quadrature on a step of length one: no time at which a motion may jump."""
MOMENT = 1e-9
"""Just before and just after, as a share of the step."""
FINEST, COARSEST = 1e-12, 1e-3
"""Between these a tolerance makes sense: rounding is below, and the error of a step above."""


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


def sample_path(velocity: TowVelocity, duration: float, step: float, name: str = "tow_velocity") -> TowPath:
    """Return the way of a point that moves at `velocity`, from 0: places by Gauss quadrature of order six.

    Velocities are taken just after and just before the times: the motion may change abruptly at a recorded time.
    """
    steps = max(1, round(duration / step))
    check_memory(steps + 1, 1)
    times, h = np.linspace(0.0, duration, steps + 1), duration / steps

    def at(moments: np.ndarray) -> np.ndarray:
        return _three_numbers([velocity(t) for t in moments.tolist()], name, moments)

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
    return velocity[moving[0]] / speeds[moving[0]]


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
    return np.log1p(grading * length / segment_length) // np.log1p(grading) + 12


BYTES_A_NODE = 32.0
"""Of a shape that is kept: a place and a tension. [bytes]"""
BYTES_A_SEGMENT = 1400.0
"""Of a cable that is solved: three levels of time, and the blocks of the matrix. [bytes]"""
SHORTEN = "Record less often (a longer step), or take longer segments (segment_length, grading)."


def check_memory(rows: int, segments: int) -> None:
    """Refuse a run of so many results with shapes of so many segments if it does not fit into memory."""
    size = rows * (segments + 2.0) * BYTES_A_NODE + segments * BYTES_A_SEGMENT
    what = f"A run of {rows} results with up to {segments} segments each"
    refuse_unless_it_fits(size, what, SHORTEN)


def check_kinds(**wanted: tuple[object, tuple[type, ...]]) -> None:
    """Refuse an argument, name → (value, kinds), that is of none of its kinds."""
    for name, (value, kinds) in wanted.items():
        if not isinstance(value, kinds):
            words = " or ".join(kind.__name__ for kind in kinds)
            raise BadValueError(
                f"{name} is {short(value)}, of type {type(value).__name__}; it must be {words}."
            )


def check_motion(name: str, velocity: object) -> None:
    """Refuse a motion that is no function of time."""
    if not callable(velocity):
        raise BadValueError(
            f"{name} is {short(velocity)}; it must be a function of time that gives a velocity."
        )


SHORTEST_S = 1e-9
"""A run or a step that is shorter cannot be halved where it is difficult: what it is halved to is rounded away. [s]"""


def checked_time(name: str, value: float) -> float:
    """Return a duration or a step as a float; refuse one that is too short to be halved."""
    return checked("", name, value, least=SHORTEST_S, unit="s")


def check_tolerance(tolerance: float) -> float:
    """Return a tolerance as a float; refuse one that a step cannot be solved to."""
    return checked("", "tolerance", tolerance, least=FINEST, most=COARSEST)


def current_of(current: Sequence[float] | np.ndarray | Current | None) -> Current:
    """Return a current from what users give: nothing, three numbers, or a current."""
    if isinstance(current, Current):
        return current
    return Current.uniform(np.zeros(3) if current is None else current)


def _three_numbers(
    values: Sequence[Sequence[float] | np.ndarray], name: str, moments: np.ndarray
) -> np.ndarray:
    """Return velocities as an array (times, 3) of finite numbers, or say what is wrong with the first that is none."""
    try:
        array = np.array(values)
        if array.shape == (moments.size, 3) and array.dtype.kind in "iuf" and np.isfinite(array).all():
            return array.astype(float)
    except (ValueError, TypeError, OverflowError):
        pass
    for t, value in zip(moments.tolist(), values, strict=True):
        if np.shape(value) != (3,) or any(real(x) is None for x in value):
            raise BadValueError(
                f"{name}({t:g}) must be three finite numbers (north, east, down in m/s); got {short(value)}."
            )
    raise BadValueError(f"{name} must give three finite numbers (north, east, down in m/s) at every time.")
