"""Pull a cable off its drum with a tow point that moves as prescribed: the public entry point."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from .element import new_load
from .history import History, Outcome
from .line import lay_straight, new_line, set_momenta
from .newton import Solved
from .pay_out import Record, follow_path, write_row
from .properties import CableProperties, DrumProperties
from .winch import Brake, PayOutRate, Winch

TowVelocity = Callable[[float], Sequence[float] | np.ndarray]

START_LENGTH = 1e-6
"""A run "without cable" starts with this length in the water, so that there is a direction. [m]"""
REST = 1e-12
"""Slower than this is at rest. [m/s]"""
SCHEMES = ("moving_end", "paper", "paper_tangent", "paper_drum", "equation7")
GAUSS = ((-np.sqrt(0.15), 5.0 / 18.0), (0.0, 8.0 / 18.0), (np.sqrt(0.15), 5.0 / 18.0))
"""Offsets and weights of three-point Gauss quadrature on a step of length one."""
EQUATIONS = ("length", "northward balance", "eastward balance", "downward balance")


def pull_out(
    tow_velocity: TowVelocity,
    duration: float,
    step: float = 0.1,
    *,
    segment_length: float = 0.5,
    cable: CableProperties | None = None,
    drum: DrumProperties | Winch | None = None,
    current: Sequence[float] | None = None,
    scheme: str = "moving_end",
    wet_length: float = 0.0,
) -> History:
    """Pull a cable off a drum, starting with no cable in the water and the tow point at the drum.

        ∂(T t)/∂s = ∂p/∂t + D − w_c k,   ∂V/∂s = ∂((1 + eT) t)/∂t,   dS/dt = −V_t(S)   (7)-(19)

    The default scheme, "moving_end", is of second order in time and space (backward differences, segments between
    nodes, a last segment that grows); segment length and step are independent of one another. "paper_tangent" and
    "paper_drum" are the scheme of Feng & Allen (2004) as printed, (20)-(26), one new node a step, with the two
    readings of the new node ("paper" is the usable one, "paper_tangent"); there `segment_length` has no meaning.
    "equation7" is independent of both: the six unknowns of the paper in a scheme of second order with a moving end,
    for comparison; it has no slack law.

    Straight ahead at U the tension is ½ρπdC_t U² S, and the force points against the motion. A drum with no friction
    and no inertia gives T(S) = 0. The drum cannot take cable up: a vehicle that comes back makes the cable slack
    (tension tends to 0, it never pushes), and no node is made while the drum stands. What a slack bight looks like
    below one segment length is ill-posed for a cable without bending stiffness and not to be trusted.

    Args:
        tow_velocity: function of time [s] that gives the tow point's velocity north, east, down (3,). [m/s]
        duration: how long. [s]
        step: time between recorded results; a step that fails is retried in smaller pieces. [s]
        segment_length: Δs, length of a full segment. [m]
        cable: the cable; Table 1 of the source when not given.
        drum: a free drum, or a winch (`cable.winch`); the free drum of Table 1 when not given.
        current: velocity of the water north, east, down (3,); still water when not given. [m/s]
        scheme: one of `SCHEMES`.
        wet_length: cable in the water at the start, laid straight behind the tow point. [m]

    Returns:
        the history from t = 0 on. Look at `history.outcome`: a run that could not go on keeps what it has.

    Raises:
        ValueError: a duration, step or segment length that is not positive, an unknown scheme, a tow velocity or
            current that is not three finite numbers.

    Good values: step 0.1 s and segments of 0.5 m give the tension of a 60° dive at 1 m/s within 2e-4 and the direction
    of the tow force within 4e-4 (`python -m benchmarks.cable` measures both together).
    """
    cable, drum = cable or CableProperties(), drum or DrumProperties()
    _check(duration, step, segment_length, scheme)
    J = _three_numbers(np.zeros(3) if current is None else current, "current")
    if scheme != "moving_end":
        from .paper_history import pull_out_as_printed

        if not isinstance(drum, DrumProperties) or wet_length > 0.0:
            message = f"scheme {scheme!r} knows a free drum and no wet_length; use 'moving_end'."
            raise ValueError(message)
        return pull_out_as_printed(tow_velocity, duration, step, cable, drum, J, scheme, segment_length)
    times, tow, velocity = sample_path(tow_velocity, duration, step)
    direction, wet = first_direction(velocity), max(wet_length, START_LENGTH)
    tow += wet * direction
    path = float(np.linalg.norm(np.diff(tow, axis=0), axis=1).sum())
    free = isinstance(drum, DrumProperties)
    setpoints = np.zeros(times.size) if isinstance(drum, DrumProperties) else drum.setpoints(times, wet)
    longest = wet + 3.0 * path + 5.0 + float(np.linalg.norm(J)) * duration
    if not free and isinstance(drum, PayOutRate | Brake):
        longest = float(setpoints.max())
    capacity = int(longest / segment_length) + 8
    line, work = new_line(capacity), new_load()
    speed = float(np.linalg.norm(velocity[0]))
    lay_straight(line, wet, direction, speed, segment_length, cable.numbers())
    set_momenta(line, J, cable.numbers(), work)
    record = new_record(times.size, capacity)
    write_row(line, record, 0, 0)
    numbers = cable.numbers(), drum.numbers(), setpoints, segment_length, work, record
    rows, solved = follow_path(line, times, tow, velocity, J, *numbers)
    return as_history(times, tow, record, rows, solved)


def sample_path(
    tow_velocity: TowVelocity, duration: float, step: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times (n,) [s], positions (n, 3) [m] by Gauss quadrature of order six, and velocities (n, 3) [m/s]."""
    steps = max(1, round(duration / step))
    times = np.linspace(0.0, duration, steps + 1)
    velocity = np.array([_three_numbers(tow_velocity(t), f"tow_velocity({t:g})") for t in times])
    tow = np.zeros((steps + 1, 3))
    h = duration / steps
    for offset, weight in GAUSS:
        inner = [
            _three_numbers(tow_velocity(t), f"tow_velocity({t:g})") for t in times[:-1] + h * (0.5 + offset)
        ]
        tow[1:] += weight * h * np.array(inner)
    return times, np.cumsum(tow, axis=0), velocity


def first_direction(velocity: np.ndarray) -> np.ndarray:
    """Return the unit vector of the first motion in velocities (n, 3); north when there is none."""
    speeds = np.linalg.norm(velocity, axis=1)
    moving = np.flatnonzero(speeds > REST)
    if moving.size == 0:
        return np.array([1.0, 0.0, 0.0])
    return velocity[moving[0]] / speeds[moving[0]]


def describe_failure(solved: Solved, time: float) -> str:
    """Return what went wrong in a step that starts at `time`, where, and what to try."""
    return (
        f"The cable could not be solved beyond t = {time:g} s: after {solved.iterations} Newton iterations the "
        f"{EQUATIONS[solved.worst_equation]} at node {solved.worst_node} is off by {solved.residual:.1e} times its "
        "tolerance. Try a shorter step, other segments, or a smoother motion of the tow point."
    )


def as_history(times: np.ndarray, tow: np.ndarray, record: Record, rows: int, solved: Solved) -> History:
    """Return the record's filled rows as a history."""
    completed = rows == times.size
    message = "The run reached its end." if completed else describe_failure(solved, times[rows - 1])
    cuts = np.cumsum(record.segments[:rows] + 1)
    return History(
        time=times[:rows],
        tow_force=record.tow_force[:rows],
        tow_tension=record.tow_tension[:rows],
        drum_tension=record.drum_tension[:rows],
        length=record.length[:rows],
        tow_point=tow[:rows],
        shapes=tuple(np.split(record.position[: cuts[-1]], cuts[:-1])),
        tensions=tuple(np.split(record.tension[: cuts[-1]], cuts[:-1])),
        outcome=Outcome(
            completed=completed,
            message=message,
            iterations=int(record.iterations[:rows].sum()),
            worst_residual=float(solved.residual),
        ),
        scheme="moving_end",
    )


def new_record(rows: int, capacity: int) -> Record:
    """Return an empty record with room for `rows` rows and a line that grows to `capacity` segments."""
    nodes = rows * (capacity + 2)
    per_row = {name: np.zeros(rows) for name in ("tow_tension", "drum_tension", "length")}
    counts = {name: np.zeros(rows, np.int64) for name in ("segments", "iterations")}
    return Record(
        tow_force=np.zeros((rows, 3)),
        **per_row,
        **counts,
        position=np.zeros((nodes, 3)),
        tension=np.zeros(nodes),
    )


def _three_numbers(values: Sequence[float] | np.ndarray, name: str) -> np.ndarray:
    """Return three finite numbers as an array, or say what is wrong with them."""
    array = np.asarray(values, dtype=float)
    if array.shape != (3,) or not np.isfinite(array).all():
        message = f"{name} must be three finite numbers (north, east, down in m/s); got {values!r}."
        raise ValueError(message)
    return array


def _check(duration: float, step: float, segment_length: float, scheme: str) -> None:
    """Raise a ValueError that names the first setting that cannot be used."""
    for name, value in (("duration", duration), ("step", step), ("segment_length", segment_length)):
        if not (np.isfinite(value) and value > 0.0):
            message = f"{name} is {value!r}; it must be a positive number."
            raise ValueError(message)
    if scheme not in SCHEMES:
        message = f"scheme {scheme!r} is unknown; choose one of {', '.join(SCHEMES)}."
        raise ValueError(message)
