"""The compiled loop of a cable whose tow point moves on a given path; steps that fail are retried smaller."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from subzero.compiled import compiled

from .element import Load
from .line import NOW, Line
from .newton import Solved
from .properties import CableNumbers, DrumNumbers
from .stepping import accept, try_step
from .tow_point import ends

MOST_HALVINGS = 10
"""A failing step is halved up to this many times before the run gives up."""


class Record(NamedTuple):
    """What a run keeps, one row per step; shapes are packed one behind another.

    Attributes:
        tow_force: force on the vehicle, earth axes (n, 3). [N]
        tow_tension, drum_tension, length: (n,). [N, N, m]
        segments: how many (n,).
        iterations: Newton iterations spent on the step (n,).
        position: node positions relative to the drum (all nodes of all rows, 3). [m]
        tension: tensions at the nodes (all nodes of all rows,). [N]
    """

    tow_force: np.ndarray
    tow_tension: np.ndarray
    drum_tension: np.ndarray
    length: np.ndarray
    segments: np.ndarray
    iterations: np.ndarray
    position: np.ndarray
    tension: np.ndarray


@compiled
def follow_path(
    line: Line,
    times: np.ndarray,
    tow: np.ndarray,
    tow_velocity: np.ndarray,
    J: np.ndarray,
    c: CableNumbers,
    drum: DrumNumbers,
    setpoints: np.ndarray,
    segment_length: float,
    work: Load,
    record: Record,
) -> tuple[int, Solved]:
    """Pull the cable along a path of the tow point, recording after every step.

    Args:
        line: the cable at times[0]; changed.
        times: (n,). [s]
        tow: positions of the tow point relative to the drum, earth axes (n, 3). [m]
        tow_velocity: its velocities (n, 3), for smaller steps in between. [m/s]
        J: velocity of the water (3,). [m/s]
        c: cable.
        drum: drum or winch.
        setpoints: what a winch is asked for at times (n,), length [m] or tension [N].
        segment_length: Δs. [m]
        work: work space.
        record: filled from row 1 on (row 0 is the start).

    Returns:
        the number of rows that are filled (all, unless it failed) and how the last step was solved.
    """
    used = line.ends.count + 1
    solved = Solved(True, 0, 0.0, 0, 0)
    for k in range(1, times.size):
        solved = _cover(line, times, tow, tow_velocity, k, J, c, drum, setpoints, segment_length, work)
        if not solved.converged or used + line.ends.count + 1 > record.tension.size:
            return k, solved
        write_row(line, record, k, used)
        record.iterations[k] = solved.iterations
        used += line.ends.count + 1
    return times.size, solved


@compiled
def _cover(
    line: Line,
    times: np.ndarray,
    tow: np.ndarray,
    tow_velocity: np.ndarray,
    k: int,
    J: np.ndarray,
    c: CableNumbers,
    drum: DrumNumbers,
    setpoints: np.ndarray,
    segment_length: float,
    work: Load,
) -> Solved:
    """Go from times[k−1] to times[k], in smaller steps where needed."""
    whole = times[k] - times[k - 1]
    step, done, spent = whole, 0.0, 0
    point = np.zeros(3)
    while True:
        last = done + step >= whole * (1.0 - 1e-9)
        x = 1.0 if last else (done + step) / whole
        _hermite(tow, tow_velocity, k, whole, x, point)
        drum.setpoint = setpoints[k - 1] + x * (setpoints[k] - setpoints[k - 1])
        mode = line.ends.drum_mode
        solved = try_step(line, step, point, J, c, drum, work)
        spent += solved.iterations
        if solved.converged:
            accept(line, step, J, c, segment_length, work)
            done += step
            if last:
                return Solved(True, spent, solved.residual, solved.worst_node, solved.worst_equation)
            step = min(2.0 * step, whole - done)
        else:
            line.ends.drum_mode = mode
            step *= 0.5
            if step < whole * 0.5**MOST_HALVINGS:
                return solved


@compiled
def _hermite(tow: np.ndarray, velocity: np.ndarray, k: int, whole: float, x: float, out: np.ndarray) -> None:
    """Fill the tow point at the fraction x of step k, cubic between positions and velocities. [m]."""
    a, b = (1.0 - x) * (1.0 - x), x * x
    for i in range(3):
        out[i] = (1.0 + 2.0 * x) * a * tow[k - 1, i] + (3.0 - 2.0 * x) * b * tow[k, i]
        out[i] += whole * (x * a * velocity[k - 1, i] - (1.0 - x) * b * velocity[k, i])


@compiled
def write_row(line: Line, record: Record, k: int, used: int) -> None:
    """Write row k of a record, with the shape of level NOW behind the `used` nodes that are there already."""
    N = line.ends.count
    record.tow_tension[k], record.drum_tension[k] = ends(line)
    record.length[k] = line.ends.last_length[NOW]
    for j in range(1, N):
        record.length[k] += line.length[j]
    record.segments[k] = N
    for i in range(3):
        record.tow_force[k, i] = line.ends.tow_force[i]
    for j in range(N + 1):
        for i in range(3):
            record.position[used + j, i] = line.position[NOW, j, i]
        record.tension[used + j] = line.node_tension[j]
