"""Follow a path of both ends with the lumped cable, and record it; steps that fail are retried smaller."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.current import Water
from cable.lumped.newton import StageSolved
from cable.lumped.rope import OLD, PULL, REST, STATE, Rope
from cable.lumped.step import GAMMA, START_OF_LEG, begin, take_step
from cable.properties import CableNumbers, DrumNumbers

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
