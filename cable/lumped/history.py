"""Runs of the lumped cable with the meaning of `cable.pull_out` and `cable.tow`: an independent second opinion.

Masses at nodes and springs between them, velocities as unknowns, TR-BDF2 in time (`rope`, `step`):
no part of the solver is shared with the scheme "moving_end". Paths of both ends are followed and recorded; steps that
fail are retried smaller.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.current import Water
from cable.drum import DrumNumbers, DrumProperties
from cable.history import History, Outcome
from cable.lumped.nodes import FAINT
from cable.lumped.rope import DIRECTION, OLD, PULL, REST, STATE, Rope, new_rope, unknowns
from cable.lumped.springs import LEAST_COMPLIANCE, spring_law, spring_state
from cable.lumped.step import GAMMA, START_OF_LEG, StageSolved, begin, take_step
from cable.properties import CableNumbers, CableProperties
from cable.schemes import Lumped
from cable.task import PullOut, Tow, uniform
from cable.tow_path import first_direction, sample_path, segments_needed, steady_direction
from cable.winch import SHORTEST, Brake, ConstantTension, PayOutRate, Winch

AXES = ("northward", "eastward", "downward")


def pull_out(task: PullOut, scheme: Lumped) -> History:
    """Pull a cable off a drum, as `cable.pull_out` does; positions are relative to where the drum is at the start."""
    segment_length, wet = scheme.segment_length, task.wet_length
    segments_needed(max(wet, segment_length), segment_length, 0.0)  # refuses a cable of countless ones
    times, tow_place, velocity, _ = sample_path(task.tow_velocity, task.duration, scheme.time_step)
    still = np.zeros_like(tow_place)
    place, speed = still, still
    if task.drum_velocity is not None:
        _, place, speed, _ = sample_path(task.drum_velocity, task.duration, scheme.time_step, "drum_velocity")
    ahead = first_direction(velocity - speed)
    tow_place += wet * ahead
    setpoint, rate = winch_rows(task.drum, times, wet)
    course = Course(times, np.c_[tow_place, place, setpoint], np.c_[velocity, speed, rate])
    rope = rope_off_drum(
        course, segment_length, uniform(task.cable), task.drum, task.current.fastest, wet, ahead
    )
    fixed = Fixed(uniform(task.cable).numbers(), task.drum.numbers(), task.current.numbers(), segment_length)
    return _run(rope, course, fixed)


def tow(task: Tow, scheme: Lumped) -> History:
    """Tow a cable of fixed length, as `cable.tow` does; positions are relative to where the tail is at the start."""
    times, place, velocity, _ = sample_path(task.tow_velocity, task.duration, scheme.time_step)
    count = max(1, int(np.ceil(task.length / scheme.segment_length - 1e-9)))
    rope, lengths = new_rope(count), np.full(count, task.length / count)
    J, tail_drag = task.current.at((0.0, 0.0, 0.0), 0.0), task.tail_drag
    ahead = steady_direction(velocity - J, uniform(task.cable), tail_drag)
    place += task.length * ahead
    still = np.zeros((times.size, 4))
    course = Course(times, np.c_[place, still], np.c_[velocity, still])
    tail = tail_drag * float(np.sum((velocity[0] - J) ** 2))
    tensions = steady_tensions(velocity[0] - J, ahead, uniform(task.cable), lengths, tail)
    lay(rope, uniform(task.cable), lengths, 0.5 * (tensions[1:] + tensions[:-1]), place[0], ahead)
    rope.velocity[:, : count + 1] = velocity[0]
    rope.ends.free_end, rope.ends.tail_drag, rope.ends.drum_pull = True, tail_drag, tail
    rope.ends.tow_force[:] = -tensions[0] * ahead
    idle, water = DrumProperties().numbers(), task.current.numbers(-place[0])
    return _run(rope, course, Fixed(uniform(task.cable).numbers(), idle, water, task.length / count))


def rope_off_drum(
    course: Course,
    segment_length: float,
    cable: CableProperties,
    drum: DrumProperties | Winch,
    fastest: float,
    wet: float,
    ahead: np.ndarray,
) -> Rope:
    """Return a rope laid straight from the drum to the start of a course, with space for all the cable paid out on
    the way.

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
    if isinstance(drum, DrumProperties):  # a free drum takes nothing back
        U = max(U, 0.0)
    rope.ends.payout[:] = rope.ends.spin[:] = rate[0] if led else U
    rope.ends.tow_force[:], rope.ends.drum_pull = -(held + k * wet) * ahead, held
    return rope


CRUMPLED = 1e-6
"""Springs that pull with T are shorter by 1e-12 N/T of their length: a cable is laid no more than this too long. [m]"""


def lay(
    rope: Rope,
    cable: CableProperties,
    lengths: np.ndarray,
    tensions: np.ndarray,
    tow: np.ndarray,
    ahead: np.ndarray,
) -> None:
    """Lay springs of given lengths and tensions (n,) straight behind the tow point, on all levels."""
    n = lengths.size
    rope.ends.count = n
    least = max(FAINT, 1e-12 / CRUMPLED * float(lengths.sum()))
    rope.ends.stretch = cable.compliance
    rope.ends.compliance = max(cable.compliance, LEAST_COMPLIANCE)
    rope.ends.bending = cable.bending_stiffness
    rope.spring[REST, 1 : n + 1] = lengths
    rope.ends.last[:] = lengths[-1]
    behind = 0.0
    rope.position[:, 0] = tow
    for j in range(1, n + 1):
        rope.spring[STATE, j] = spring_state(max(tensions[j - 1], least))
        rope.spring[PULL, j], _, strain, _ = spring_law(rope.spring[STATE, j], rope.ends.compliance)
        rope.stretched[:, j] = lengths[j - 1] * (1.0 + strain)
        behind += rope.stretched[OLD, j]
        rope.position[:, j] = tow - behind * ahead
        rope.vector[DIRECTION, j] = -ahead


def winch_rows(drum: DrumProperties | Winch, times: np.ndarray, wet: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the setpoint of a winch at times (n,), and its rate: dS/dt where the length is prescribed."""
    if isinstance(drum, DrumProperties):
        return np.zeros(times.size), np.zeros(times.size)
    setpoint = drum.setpoints(times, wet)
    if not isinstance(drum, PayOutRate):
        return setpoint, np.gradient(setpoint, times)
    rate = drum.rate
    rates = np.array([float(rate(t) if callable(rate) else rate) for t in times])
    return setpoint, np.where((setpoint <= SHORTEST) & (rates < 0.0), 0.0, rates)


def held_at_drum(drum: DrumProperties | Winch, setpoint: float, payout: float) -> float:
    """Return the tension at the drum that a run starts with: a winch's, or that of friction. [N]."""
    if isinstance(drum, DrumProperties):
        return drum.friction_torque / drum.radius if payout > 0.0 else 0.0
    return setpoint if isinstance(drum, ConstantTension) else 0.0


def steady_tensions(
    U: np.ndarray, ahead: np.ndarray, cable: CableProperties, lengths: np.ndarray, tail: float
) -> np.ndarray:
    """Return the tensions at the nodes of a steady straight tow (n + 1,), √(1 + eT) in the drag and all. [N]."""
    tensions = np.full(lengths.size + 1, tail)
    drag, weight = cable.tangential_drag * abs(U @ ahead) * float(U @ ahead), cable.weight_in_water * ahead[2]
    for j in range(lengths.size - 1, -1, -1):
        here = tensions[j + 1]
        for _ in range(4):
            middle = max(0.5 * (here + tensions[j + 1]), 0.0)
            here = tensions[j + 1] + lengths[j] * (drag * np.sqrt(1.0 + cable.compliance * middle) - weight)
        tensions[j] = here
    return tensions


def _run(rope: Rope, course: Course, fixed: Fixed) -> History:
    """Run, and return the history."""
    journey = run_rope(rope, course, fixed)
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
    """Return why a run ended early: when, where, and the advice."""
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
"""Returned in place of the worst equation of a step: no space for more cable."""


class Course(NamedTuple):
    """Where the ends are and what the winch does, at times, with cubics in between.

    Attributes:
        times: (n,). [s]
        values: place of the tow point (3), of the drum (3), setpoint of a winch (1): (n, 7). [m], or [N]
        rates: their rates of change (n, 7).
    """

    times: np.ndarray
    values: np.ndarray
    rates: np.ndarray


class Fixed(NamedTuple):
    """Constants of a run, in the order of the arguments of `take_step`."""

    cable: CableNumbers
    drum: DrumNumbers
    water: Water
    segment_length: float


class Row(NamedTuple):
    """The results at one time: force on the vehicle (3,), tension at the drum, length, positions and tensions."""

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


def run_rope(rope: Rope, course: Course, fixed: Fixed) -> Journey:
    """Follow a course from its first row on, to its end or until a step fails however small."""
    begin(rope, _leg(course, 1, 0.0), fixed.cable, fixed.water)
    capacity = rope.spring.shape[1] - 2
    rows, spent, steps, solved = [_row(rope)], 0, 0, StageSolved(True, 0, 0.0, 0)
    for k in range(1, course.times.size):
        done, step = 0.0, 1.0
        while done < 1.0:
            end = min(done + step, 1.0) if done + step < 1.0 - 1e-9 else 1.0
            solved = _try(rope, course, k, (done, end), fixed)
            spent, steps = spent + solved.iterations, steps + 1
            if solved.converged:
                done, step = end, 2.0 * step
            elif step > 0.5**MOST_HALVINGS:
                step *= 0.5
            else:
                time = float(course.times[k - 1] + done * (course.times[k] - course.times[k - 1]))
                return Journey(rows, spent, steps, solved, time)
        if rope.ends.count == capacity and rope.ends.last[OLD] > 2.0 * fixed.segment_length:
            return Journey(rows, spent, steps, StageSolved(False, 0, 0.0, FULL), float(course.times[k]))
        rows.append(_row(rope))
    return Journey(rows, spent, steps, solved, float(course.times[-1]))


def _try(rope: Rope, course: Course, k: int, span: tuple[float, float], fixed: Fixed) -> StageSolved:
    """Take one step between two fractions of row k; a step that fails leaves everything as it was."""
    done, end = span
    state = rope.spring[STATE].copy()
    h = float((end - done) * (course.times[k] - course.times[k - 1]))
    legs = np.array([_leg(course, k, done + GAMMA * (end - done)), _leg(course, k, end)])
    solved = StageSolved(*take_step(rope, h, legs, *fixed))
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
    """Return the results of the present state; tensions at nodes lie between those of the springs."""
    N, T = rope.ends.count, np.empty(rope.ends.count + 1)
    rest, pull = rope.spring[REST, 1 : N + 1], rope.spring[PULL, 1 : N + 1]
    at_drum = max(float(rope.ends.drum_pull), 0.0)
    T[0], T[N] = np.linalg.norm(rope.ends.tow_force), at_drum
    T[1:N] = (rest[1:] * pull[:-1] + rest[:-1] * pull[1:]) / (rest[1:] + rest[:-1])
    return Row(
        rope.ends.tow_force.copy(),
        at_drum,
        float(rest.sum() + rope.ends.loose[OLD]),
        rope.position[OLD, : N + 1].copy(),
        T,
    )
