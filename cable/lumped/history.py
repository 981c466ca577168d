"""Runs of the lumped cable with the meaning of `cable.pull_out` and `cable.tow`: an independent second opinion.

Masses at nodes and springs between them, velocities as unknowns, TR-BDF2 in time (`rope`, `step`):
no part of the solver is shared with the scheme "moving_end". Paths of both ends are followed and recorded; steps that
fail are retried smaller.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.current import Current, Water
from cable.drum import DrumNumbers, DrumProperties
from cable.history import History, Outcome
from cable.lumped.rope import OLD, PULL, REST, STATE, Rope, new_rope, unknowns
from cable.lumped.start import held_at_drum, lay, steady_direction, steady_tensions, winch_rows
from cable.lumped.step import GAMMA, START_OF_LEG, StageSolved, begin, take_step
from cable.properties import CableNumbers, CableProperties
from cable.tow_path import TowVelocity, first_direction, sample_path
from cable.winch import Brake, PayOutRate, Winch

AXES = ("northward", "eastward", "downward")
START_LENGTH = 1e-6
"""A run "without cable" starts with this length in the water. [m]"""


def pull_out_lumped(
    tow_velocity: TowVelocity,
    duration: float,
    step: float,
    *,
    segment_length: float,
    cable: CableProperties,
    drum: DrumProperties | Winch,
    current: Current,
    wet_length: float,
    drum_velocity: TowVelocity | None = None,
) -> History:
    """Pull a cable off a drum, as `cable.pull_out` does.

    An inextensible cable stretches by 1e-6 of its length at one newton (`springs.LEAST_COMPLIANCE`).

    Args:
        tow_velocity: function of time [s] that gives the tow point's velocity north, east, down (3,). [m/s]
        duration: how long. [s]
        step: time between recorded results; a step that fails is retried in smaller pieces. [s]
        segment_length: Δs. [m]
        cable: the cable.
        drum: a free drum or a winch.
        current: the water's velocity, at places relative to the drum at the start.
        wet_length: cable in the water at the start, straight behind the tow point. [m]
        drum_velocity: like tow_velocity, of the drum; it stands when not given.

    Returns:
        the history; positions are relative to where the drum is at the start.
    """
    times, tow, velocity, _ = sample_path(tow_velocity, duration, step)
    still = np.zeros_like(tow)
    place, speed = still, still
    if drum_velocity is not None:
        _, place, speed, _ = sample_path(drum_velocity, duration, step, "drum_velocity")
    ahead, wet = first_direction(velocity - speed), max(wet_length, START_LENGTH)
    tow += wet * ahead
    setpoint, rate = winch_rows(drum, times, wet)
    course = Course(times, np.c_[tow, place, setpoint], np.c_[velocity, speed, rate])
    rope = rope_off_drum(course, segment_length, cable, drum, current.fastest, wet, ahead)
    return _run(rope, course, cable, drum, current.numbers(), segment_length)


def rope_off_drum(
    course: Course,
    segment_length: float,
    cable: CableProperties,
    drum: DrumProperties | Winch,
    fastest: float,
    wet: float,
    ahead: np.ndarray,
) -> Rope:
    """Return a rope laid straight from the drum to where a course begins, with room for all that comes off on its way.

    Args:
        course: of the tow point, which begins `wet` ahead of the drum.
        segment_length: Δs. [m]
        cable: the cable.
        drum: a free drum or a winch.
        fastest: of the water. [m/s]
        wet: cable in the water at the start. [m]
        ahead: from the drum to the tow point, a unit vector (3,).
    """
    duration, tow, velocity = float(course.times[-1]), course.values[:, :3], course.rates[:, :3]
    place, speed = course.values[:, 3:6], course.rates[:, 3:6]
    setpoint, rate = course.values[:, 6], course.rates[:, 6]
    led = isinstance(drum, PayOutRate | Brake)
    way = sum(float(np.linalg.norm(np.diff(x, axis=0), axis=1).sum()) for x in (tow, place))
    longest = float(setpoint.max()) if led else 5.0 + 3.0 * (wet + way + fastest * duration)
    count = max(1, int(np.floor(wet / segment_length + 0.5)))
    lengths = np.full(count, segment_length)
    lengths[-1] = wet - segment_length * (count - 1)
    rope = new_rope(max(int(longest / segment_length) + 8, count + 2))
    U = float((velocity[0] - speed[0]) @ ahead)
    along = wet - np.append(0.0, np.cumsum(lengths))
    k = cable.tangential_drag * U * abs(U)
    held = held_at_drum(drum, float(setpoint[0]), U)
    lay(rope, cable, lengths, held + k * 0.5 * (along[1:] + along[:-1]), tow[0], ahead)
    rope.velocity[:, :count] = velocity[0]
    rope.velocity[:, count] = speed[0]
    rope.position[:, count] = 0.0
    rope.ends.payout[:] = rate[0] if led else U
    rope.ends.tow_force[:], rope.ends.drum_pull = -(held + k * wet) * ahead, held
    return rope


def tow_lumped(
    tow_velocity: TowVelocity,
    length: float,
    duration: float,
    step: float,
    *,
    segment_length: float,
    cable: CableProperties,
    current: Current,
    drogue_drag_area: float,
) -> History:
    """Tow a cable of fixed length from its steady straight tow on, as `cable.tow` does.

    Args:
        tow_velocity: function of time [s] that gives the tow point's velocity north, east, down (3,). [m/s]
        length: L. [m]
        duration: how long. [s]
        step: time between recorded results. [s]
        segment_length: Δs; taken a little smaller where L is not a whole number of it. [m]
        cable: the cable.
        current: the water's velocity, at places relative to the tow point at the start.
        drogue_drag_area: C_d A of a drogue at the free end. [m²]

    Returns:
        the history; positions are relative to where the tail is at the start.
    """
    times, tow, velocity, _ = sample_path(tow_velocity, duration, step)
    count = max(1, int(np.ceil(length / segment_length - 1e-9)))
    rope, lengths = new_rope(count), np.full(count, length / count)
    tail_drag = 0.5 * cable.water_density * drogue_drag_area
    J = current.at((0.0, 0.0, 0.0), 0.0)
    ahead = steady_direction(velocity[0] - J, first_direction(velocity - J), cable, tail_drag)
    tow += length * ahead
    still = np.zeros((times.size, 4))
    course = Course(times, np.c_[tow, still], np.c_[velocity, still])
    tail = tail_drag * float(np.sum((velocity[0] - J) ** 2))
    tensions = steady_tensions(velocity[0] - J, ahead, cable, lengths, tail)
    lay(rope, cable, lengths, 0.5 * (tensions[1:] + tensions[:-1]), tow[0], ahead)
    rope.velocity[:, : count + 1] = velocity[0]
    rope.ends.free_end, rope.ends.tail_drag, rope.ends.drum_pull = True, tail_drag, tail
    rope.ends.tow_force[:] = -tensions[0] * ahead
    return _run(rope, course, cable, DrumProperties(), current.numbers(-tow[0]), length / count)


def _run(
    rope: Rope,
    course: Course,
    cable: CableProperties,
    drum: DrumProperties | Winch,
    water: Water,
    segment_length: float,
) -> History:
    """Run, and return the history."""
    journey = run_rope(rope, course, cable.numbers(), drum.numbers(), water, segment_length)
    rows, completed = journey.rows, journey.solved.converged
    force = np.array([row.tow_force for row in rows])
    return History(
        time=course.times[: len(rows)],
        tow_force=force,
        tow_tension=np.linalg.norm(force, axis=1),
        drum_tension=np.array([row.drum_tension for row in rows]),
        length=np.array([row.length for row in rows]),
        tow_point=course.values[: len(rows), :3],
        shapes=tuple(row.position for row in rows),
        tensions=tuple(row.tension for row in rows),
        outcome=Outcome(
            completed=completed,
            message="The run reached its end." if completed else _reason(rope, journey),
            iterations=journey.iterations,
            worst_residual=journey.solved.residual,
            steps=journey.steps,
        ),
        scheme="lumped",
    )


def _reason(rope: Rope, journey: Journey) -> str:
    """Return why a run ended early: when, where, and what to try."""
    held, solved = unknowns(rope), journey.solved
    if solved.worst == FULL:
        return (
            f"The drum gave far more cable than the paths of its ends ask for until t = {journey.stopped_at:g} s: "
            "nothing holds it back. Let the drum rub, or use a winch."
        )
    node, axis = divmod(solved.worst, 3)
    if solved.worst >= 3 * held + (0 if rope.ends.free_end else 1):
        place = f"length of segment {solved.worst - 3 * held - (0 if rope.ends.free_end else 1)}"
    else:
        place = "pay-out at the drum" if node >= held else f"{AXES[axis]} balance at node {node + 1}"
    return (
        f"The cable could not be solved beyond t = {journey.stopped_at:g} s: the {place} is off by "
        f"{solved.residual:.1e} times its tolerance, even in the smallest step. Try other segments, or a smoother "
        "motion of the tow point."
    )


MOST_HALVINGS = 12
"""A failing step is halved up to this many times before the run gives up."""


FULL = -1
"""In place of the worst equation of a step: no room for more cable."""


class Course(NamedTuple):
    """Where the ends are and what the winch does, at times, with cubics in between.

    Attributes:
        times: (n,). [s]
        values: place of the tow point (3), of the drum (3), what a winch is asked for (1): (n, 7). [m], or [N]
        rates: their rates of change (n, 7).
    """

    times: np.ndarray
    values: np.ndarray
    rates: np.ndarray


class Row(NamedTuple):
    """What is recorded at a time: force on the vehicle (3,), tension at the drum, length, positions and tensions."""

    tow_force: np.ndarray
    drum_tension: float
    length: float
    position: np.ndarray
    tension: np.ndarray


class Journey(NamedTuple):
    """A run: its rows, Newton iterations and steps; how and from when on the last step failed, when one did."""

    rows: list[Row]
    iterations: int
    steps: int
    solved: StageSolved
    stopped_at: float


def run_rope(
    rope: Rope, course: Course, c: CableNumbers, drum: DrumNumbers, water: Water, segment_length: float
) -> Journey:
    """Follow a course from its first row on, to its end or until a step fails however small."""
    begin(rope, _leg(course, 1, 0.0), c, water)
    capacity = rope.spring.shape[1] - 2
    rows, spent, steps, solved = [_row(rope)], 0, 0, StageSolved(True, 0, 0.0, 0)
    for k in range(1, course.times.size):
        done, step = 0.0, 1.0
        while done < 1.0:
            end = min(done + step, 1.0) if done + step < 1.0 - 1e-9 else 1.0
            solved = _try(rope, course, k, done, end, c, drum, water, segment_length)
            spent, steps = spent + solved.iterations, steps + 1
            if solved.converged:
                done, step = end, 2.0 * step
            elif step > 0.5**MOST_HALVINGS:
                step *= 0.5
            else:
                time = float(course.times[k - 1] + done * (course.times[k] - course.times[k - 1]))
                return Journey(rows, spent, steps, solved, time)
        if rope.ends.count == capacity and rope.ends.last[OLD] > 2.0 * segment_length:
            return Journey(rows, spent, steps, StageSolved(False, 0, 0.0, FULL), float(course.times[k]))
        rows.append(_row(rope))
    return Journey(rows, spent, steps, solved, float(course.times[-1]))


def _try(
    rope: Rope,
    course: Course,
    k: int,
    done: float,
    end: float,
    c: CableNumbers,
    drum: DrumNumbers,
    water: Water,
    segment_length: float,
) -> StageSolved:
    """Take one step between two fractions of row k; a step that fails leaves everything as it was."""
    state = rope.spring[STATE].copy()
    h = float((end - done) * (course.times[k] - course.times[k - 1]))
    legs = np.array([_leg(course, k, done + GAMMA * (end - done)), _leg(course, k, end)])
    solved = StageSolved(*take_step(rope, h, legs, c, drum, water, segment_length))
    if not solved.converged:
        rope.spring[STATE] = state
    return solved


def _leg(course: Course, k: int, x: float) -> np.ndarray:
    """Return time, the seven values and their seven rates at the fraction x of row k (15,)."""
    a, b, u, v = course.values[k - 1], course.values[k], course.rates[k - 1], course.rates[k]
    h, y = course.times[k] - course.times[k - 1], 1.0 - x
    leg = np.empty(START_OF_LEG[-1])
    leg[0] = course.times[k - 1] + x * h
    leg[1:8] = (1.0 + 2.0 * x) * y * y * a + (3.0 - 2.0 * x) * x * x * b + h * x * y * (y * u - x * v)
    leg[8:] = 6.0 * x * y * (b - a) / h + y * (1.0 - 3.0 * x) * u + x * (3.0 * x - 2.0) * v
    return leg


def _row(rope: Rope) -> Row:
    """Return what there is to record of the present state; tensions at nodes lie between those of the springs."""
    N, T = rope.ends.count, np.empty(rope.ends.count + 1)
    rest, pull = rope.spring[REST, 1 : N + 1], rope.spring[PULL, 1 : N + 1]
    at_drum = max(float(rope.ends.drum_pull), 0.0)
    T[0], T[N] = np.linalg.norm(rope.ends.tow_force), at_drum
    T[1:N] = (rest[1:] * pull[:-1] + rest[:-1] * pull[1:]) / (rest[1:] + rest[:-1])
    return Row(rope.ends.tow_force.copy(), at_drum, float(rest.sum()), rope.position[OLD, : N + 1].copy(), T)
