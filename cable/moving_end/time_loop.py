"""The compiled loop of a cable whose tow point moves on a given path; steps that fail or err are retried smaller."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.current import Water
from cable.drum_motion import hermite, lead_drum
from cable.moving_end.energy import FLOWS, book_step, energy_flow
from cable.moving_end.jolt import take_jolt
from cable.moving_end.segment_load import Load
from cable.moving_end.state import NOW, Line
from cable.moving_end.step_control import estimate_error, next_step, note_force
from cable.moving_end.time_step import accept, try_step
from cable.moving_end.tow_boundary import ends
from cable.properties import CableNumbers, DrumNumbers
from cable.tow_path import TowPath
from subzero.jit import allocating, compiled

MOST_HALVINGS = 10
"""A failing step is halved up to this many times before the run gives up."""
MOST_CUTS = 6
"""A step that errs too much is made smaller by this many halvings at most, and so are those behind it: a jolt has no
accurate step, and in ever smaller ones it only rings louder."""
FIRST_STEP = 0.1
"""With an error allowed, a run begins, and goes on after a jolt, with this share of a row: it cannot tell its error."""


class Record(NamedTuple):
    """What a run keeps, one row per step; shapes are packed one behind another.

    Attributes:
        tow_force: force on the vehicle, earth axes (n, 3). [N]
        tow_tension, drum_tension, length: (n,). [N, N, m]
        segments: how many (n,).
        iterations, steps: Newton iterations and steps spent on the row (n,).
        courant: largest √(T/m1) Δt/ℓ of all segments (n,). [-]
        position: node positions relative to the drum (all nodes of all rows, 3). [m]
        tension: tensions at the nodes (all nodes of all rows,). [N]
        ledger: of the energies, see `energy.book_step` (3, FLOWS).
        impulse: of the cable on the vehicle just after a row, where the tow point jolts, earth axes (n, 3). [N s]
    """

    tow_force: np.ndarray
    tow_tension: np.ndarray
    drum_tension: np.ndarray
    length: np.ndarray
    segments: np.ndarray
    iterations: np.ndarray
    steps: np.ndarray
    courant: np.ndarray
    position: np.ndarray
    tension: np.ndarray
    ledger: np.ndarray
    impulse: np.ndarray


def new_record(rows: int, capacity: int) -> Record:
    """Return an empty record with room for `rows` rows and a line that grows to `capacity` segments."""
    nodes = rows * (capacity + 2)
    per_row = {name: np.zeros(rows) for name in ("tow_tension", "drum_tension", "length", "courant")}
    counts = {name: np.zeros(rows, np.int64) for name in ("segments", "iterations", "steps")}
    return Record(
        tow_force=np.zeros((rows, 3)),
        **per_row,
        **counts,
        position=np.zeros((nodes, 3)),
        tension=np.zeros(nodes),
        ledger=np.zeros((3, FLOWS)),
        impulse=np.zeros((rows, 3)),
    )


@compiled
def follow_path(
    line: Line,
    path: TowPath,
    led: np.ndarray,
    water: Water,
    c: CableNumbers,
    drum: DrumNumbers,
    rtol: float,
    work: Load,
    record: Record,
) -> int:
    """Pull the cable along a path of the tow point, recording after every step.

    Args:
        line: the cable at path.times[0]; changed.
        path: how the tow point moves.
        led: how the drum moves, and what its winch is asked for, see `cable.drum_motion`.
        water: how the water moves.
        c: cable.
        drum: drum or winch.
        rtol: relative error of a step that is allowed; 0 takes every step as it is.
        work: work space.
        record: filled from row 0 on, the start.

    Returns:
        how many rows are filled: all, unless it failed; `line.ends.solved` tells how the last step was solved.
    """
    rows, used = path.times.size, line.ends.count + 1
    suggested = FIRST_STEP * (path.times[1] - path.times[0])
    note_force(line)
    energy_flow(line, c, work, record.ledger[1])
    write_row(line, record, 0, 0, c)
    for k in range(1, rows):
        suggested = _cover(line, path, k, led, water, c, drum, rtol, suggested, work, record)
        if not line.ends.solved.converged or used + line.ends.count + 1 > record.tension.size:
            return k
        write_row(line, record, k, used, c)
        record.iterations[k] = line.ends.solved.iterations
        used += line.ends.count + 1
    return rows


@allocating
def _cover(
    line: Line,
    path: TowPath,
    k: int,
    led: np.ndarray,
    water: Water,
    c: CableNumbers,
    drum: DrumNumbers,
    rtol: float,
    suggested: float,
    work: Load,
    record: Record,
) -> float:
    """Go from times[k−1] to times[k], in smaller steps where needed; return the step to go on with."""
    whole = path.times[k] - path.times[k - 1]
    finest, done, spent, point = whole * 0.5**MOST_CUTS, 0.0, 0, np.zeros(3)
    jump = path.leaving[k - 1] - path.arriving[k - 1]
    if k > 1 and take_jolt(line, jump, c, drum, work, record.impulse[k - 1]):
        energy_flow(line, c, work, record.ledger[1])
        suggested = min(suggested, FIRST_STEP * whole)
    step = min(suggested, whole) if rtol > 0.0 else whole
    while True:
        step = (whole - done) / np.ceil((whole - done) / step - 1e-9)
        x, near, far = (done + step) / whole, path.place[k - 1], path.place[k]
        hermite(near, far, path.leaving[k - 1], path.arriving[k], whole, x, point)
        lead_drum(led, path.times[k - 1] + done + step, drum)
        mode = line.ends.drum_mode
        converged = try_step(line, step, point, water, c, drum, work)
        spent += line.ends.solved.iterations
        error = estimate_error(line, step) if rtol > 0.0 and converged else 0.0
        if converged and (error <= rtol or step <= finest * (1.0 + 1e-6)):
            accept(line, step, c, work)
            note_force(line)
            book_step(line, step, c, work, record.ledger)
            record.steps[k] += 1
            done += step
            suggested = next_step(step, error, rtol) if error <= rtol else max(step, finest)
            if done >= whole * (1.0 - 1e-9):
                line.ends.solved.iterations = spent
                return suggested
            step = suggested
        else:
            line.ends.drum_mode = mode
            step = max(next_step(step, error, rtol), finest) if converged else 0.5 * step
            if step < whole * 0.5**MOST_HALVINGS:
                return step


@compiled
def write_row(line: Line, record: Record, k: int, used: int, c: CableNumbers) -> None:
    """Write row k of a record, with the shape of level NOW behind the `used` nodes that are there already."""
    N = line.ends.count
    record.tow_tension[k], record.drum_tension[k] = ends(line)
    record.length[k] = line.ends.settled + line.ends.last_length[NOW]
    record.segments[k] = N
    for i in range(3):
        record.tow_force[k, i] = line.ends.tow_force[i]
    for j in range(N + 1):
        for i in range(3):
            record.position[used + j, i] = line.position[NOW, j, i]
        record.tension[used + j] = line.node_tension[j]
        if 0 < j < N:
            wave = np.sqrt(max(line.tension[NOW, j], 0.0) / (c.mass + c.added_mass))
            record.courant[k] = max(record.courant[k], wave * line.ends.previous_step / line.length[j])
