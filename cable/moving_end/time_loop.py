"""The compiled loop of a cable whose tow point moves on a given path; steps that fail or err are retried smaller.

`pull_out` and `tow` lay a cable out, move it along a sampled path, and return its history.

Where an error is allowed (`rtol`), it is estimated, and the next step is the one that would just be allowed. A
backward difference of second order errs by h(h + h')/6 x‴ in the velocity V, that is by h(h + h')/6 V̈. The tow force
goes about with the square of the velocity, so it errs by h(h + h')/6 F̈ or so, while the force that is extrapolated
from the two steps before is off by h(h + h')/2 F̈. A third of that gap, as a share of the largest force so far, is
the error estimate.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import NamedTuple

import numpy as np

from cable.clamps import Clamps
from cable.current import Water
from cable.drum import LENGTH, DrumNumbers, DrumProperties
from cable.drum_motion import PLACE, SETPOINT, VELOCITY, drum_path, hermite, lead_drum, resting
from cable.history import Equilibrium, History, Outcome
from cable.moving_end.energy import FLOWS, LOSS, STORED, book_step, energy_flow
from cable.moving_end.initial_shape import (
    division,
    lay_held,
    lay_straight,
    start_in_water,
    towed,
    trail,
)
from cable.moving_end.jolt import take_jolt
from cable.moving_end.remeshing import accept, end_tensions
from cable.moving_end.segment_load import Load, new_load
from cable.moving_end.state import NOW, Line, Solved, new_line, paid_out
from cable.moving_end.stops import describe_stop
from cable.moving_end.time_step import try_step
from cable.properties import CableNumbers
from cable.schemes import MovingEnd
from cable.sea_bed import SeaBed
from cable.task import PullOut, Tow
from cable.tow_path import (
    TowPath,
    check_memory,
    first_direction,
    length_of_way,
    sample_path,
    segments_needed,
)
from cable.winch import Brake, PayOutRate
from subzero.errors import BadValueError
from subzero.jit import compiled, inner, scratch

MOST_HALVINGS = 10
"""A failing step is halved up to this many times before the run gives up."""
MOST_CUTS = 6
"""A step that errs too much is made smaller by this many halvings at most, and so are those behind it: a jolt has no
accurate step, and in ever smaller ones it only rings louder."""
FIRST_STEP = 0.1
"""With `rtol` given, the first step of a run, or after a jolt, is this share of a row, as it has no error
estimate."""


class Record(NamedTuple):
    """The results of a run, one row per step; shapes are packed one after another.

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
    """Return an empty record with space for `rows` rows and a line that grows to `capacity` segments."""
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
        led: motion of the drum, and setpoint of its winch, see `cable.drum_motion`.
        water: how the water moves.
        c: cable.
        drum: drum or winch.
        rtol: relative error of a step that is allowed; 0 takes every step as it is.
        work: work space.
        record: filled from row 0 on, the start.

    Returns:
        the number of filled rows: all, unless it failed; `line.ends.solved` holds how the last step was solved.
    """
    # A row takes one node more than it has segments, and rows are packed without gaps.
    rows, used = path.times.size, line.ends.count + 1
    suggested = FIRST_STEP * (path.times[1] - path.times[0])
    note_force(line)
    energy_flow(line, c, work, record.ledger[1])
    write_row(line, record, 0, 0, c)
    for k in range(1, rows):
        suggested = cover(line, path, k, led, water, c, drum, rtol, suggested, work, record)
        # Out of memory for a row is treated like a step that failed: the caller keeps the rows that are filled.
        if not line.ends.solved.converged or used + line.ends.count + 1 > record.tension.size:
            return k
        write_row(line, record, k, used, c)
        record.iterations[k] = line.ends.solved.iterations
        used += line.ends.count + 1
    return rows


@inner
def cover(
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
    finest, done, spent, point = whole * 0.5**MOST_CUTS, 0.0, 0, scratch(1, 3)[0]
    jump = scratch(1, 3)[0]
    for i in range(3):
        jump[i] = path.leaving[k - 1, i] - path.arriving[k - 1, i]
    # In row 1 the jump from rest is part of the initial state, which `lay_straight` has filled.
    if k > 1 and take_jolt(line, jump, c, drum, work, record.impulse[k - 1]):
        energy_flow(line, c, work, record.ledger[1])
        suggested = min(suggested, FIRST_STEP * whole)
    step = min(suggested, whole) if rtol > 0.0 else whole
    while True:
        # The rest of the row is divided evenly, so that the last step is not tiny.
        step = (whole - done) / np.ceil((whole - done) / step - 1e-9)
        x, near, far = (done + step) / whole, path.place[k - 1], path.place[k]
        hermite(near, far, path.leaving[k - 1], path.arriving[k], whole, x, point)
        lead_drum(led, path.times[k - 1] + done + step, drum)
        mode = line.ends.drum_mode
        converged = try_step(line, step, point, water, c, drum, work)
        spent += line.ends.solved.iterations
        error = estimate_error(line, step) if rtol > 0.0 and converged else 0.0
        # The smallest step is accepted with any error: a jolt has no accurate one.
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
            # A rejected step may have changed the state of the drum.
            line.ends.drum_mode = mode
            step = max(next_step(step, error, rtol), finest) if converged else 0.5 * step
            if step < whole * 0.5**MOST_HALVINGS:
                return step


@compiled
def write_row(line: Line, record: Record, k: int, used: int, c: CableNumbers) -> None:
    """Write row k of a record, with the shape of level NOW after the `used` nodes that are there already."""
    N = line.ends.count
    record.tow_tension[k], record.drum_tension[k] = end_tensions(line)
    record.length[k] = paid_out(line)
    record.segments[k] = N
    for i in range(3):
        record.tow_force[k, i] = line.ends.tow.force[i]
    for j in range(N + 1):
        for i in range(3):
            record.position[used + j, i] = line.position[NOW, j, i]
        record.tension[used + j] = line.node_tension[j]
        if 0 < j < N:
            wave = np.sqrt(max(line.tension[NOW, j], 0.0) / (c.mass + c.added_mass))
            record.courant[k] = max(record.courant[k], wave * line.ends.previous_step / line.length[j])


def pull_out(task: PullOut, scheme: MovingEnd) -> History:
    """Pull a cable off a drum, as `cable.pull_out` does."""
    start, segment_length = task.start, scheme.segment_length
    if isinstance(start, Equilibrium):
        segment_length = float(start.segment_lengths[0])
    path, wet = sample_path(task.tow_velocity, task.duration, scheme.time_step), task.wet_length
    led = led_drum(task, path.times)
    direction = first_direction(path.leaving - led[:, VELOCITY:SETPOINT])
    path.place[:] += start.shape[0] - start.shape[-1] if isinstance(start, Equilibrium) else wet * direction
    line = new_line(_capacity(task, path, led, segment_length, scheme))
    line.ends.layout.segment_length, line.ends.layout.grading = segment_length, scheme.grading
    line.ends.solver.tolerance, line.ends.layout.run_in = scheme.tolerance, scheme.run_in
    c, drum = task.cable.numbers(task.bed, task.clamps, task.surface), task.drum.numbers()
    _refuse_clamp(task.clamps, not isinstance(task.drum, Brake), "at the drum")
    line.ends.origin[:] = task.origin
    line.ends.solver.pulls_only = task.bed is not None and c.compliance > 0.0
    _refuse_below(task.bed, np.array([path.place[0], led[0, PLACE:VELOCITY]]) + task.origin)
    # The velocity of the drum at the start is needed before the first step sets it.
    drum.velocity[:] = led[0, VELOCITY:SETPOINT]
    if isinstance(start, Equilibrium):
        rate = (led[1, SETPOINT] - led[0, SETPOINT]) / path.times[1] if drum.control == LENGTH else 0.0
        lay_held(line, start, path.leaving[0], drum.velocity, rate)
    else:
        lay_straight(line, wet, direction, path.leaving[0], drum, c)
    run = _run(line, path, led, task.current.numbers(task.origin), c, drum, scheme.rtol)
    return run if task.surface is None else replace(run, has_surface=True)


def tow(task: Tow, scheme: MovingEnd) -> History:
    """Tow a cable of fixed length, as `cable.tow` does."""
    path = sample_path(task.tow_velocity, task.duration, scheme.time_step)
    segments_needed(task.length, scheme.segment_length, 0.0)  # refuses a cable of countless ones
    check_memory(path.times.size, division(task.cable, task.length, scheme.segment_length))
    c = task.cable.numbers(task.bed, task.clamps, task.surface)
    _refuse_clamp(task.clamps, True, "at the free tail")
    _refuse_below(task.bed, np.zeros((1, 3)))
    J = task.current.at((0.0, 0.0, 0.0))
    line = towed(task.cable, path.leaving, task.length, scheme.segment_length, J, task.tail_drag)
    line.ends.solver.tolerance = scheme.tolerance
    path.place[:] += line.position[NOW, 0]
    # Places are counted from the tail: with this origin the tow point starts at (0, 0, 0), where J was taken.
    origin = line.ends.origin[:] = -line.position[NOW, 0]
    trail(line, task.bed, task.surface)
    water = task.current.numbers(origin)
    run = _run(line, path, resting(path.times), water, c, DrumNumbers(), scheme.rtol)
    return run if task.surface is None else replace(run, has_surface=True)


def _refuse_below(bed: SeaBed | None, ends: np.ndarray) -> None:
    """Raise an error if an end (n, 3) of a cable is below the bed."""
    if bed is not None:
        bed.refuse_below(ends, "pull_out or tow")


def _refuse_clamp(clamps: Clamps | None, cannot: bool, where: str) -> None:
    """Raise an error for a clamp at a second end that is free, or where cable passes."""
    if clamps is not None and clamps.second is not None and cannot:
        raise BadValueError(
            f"pull_out or tow: the second end is clamped {where}; only what a cable.Brake holds can be. Leave"
            " Clamps.second out, or hold that end by drum=cable.Brake()."
        )


def led_drum(task: PullOut, times: np.ndarray) -> np.ndarray:
    """Return the way of the drum and the setpoints of its winch at times (n,), see `cable.drum_motion`."""
    if isinstance(task.drum, DrumProperties):
        setpoints = np.zeros(times.size)
    else:
        setpoints = task.drum.setpoints(times, task.wet_length)
    if task.drum_velocity is None:
        return resting(times, setpoints)
    way = sample_path(task.drum_velocity, float(times[-1]), float(times[1] - times[0]), "drum_velocity")
    return drum_path(times, way.place, way.leaving, setpoints)


def _capacity(task: PullOut, path: TowPath, led: np.ndarray, segment_length: float, scheme: MovingEnd) -> int:
    """Return the number of segments to allocate; raise an error if they do not fit into memory.

    For a winch the longest cable is known. A free drum gives the cable that the ways of both ends and the current
    require, and some by its own motion; space is allocated for three times their sum and 5 m more, and `stops`
    reports where that is exceeded.
    """
    if isinstance(task.drum, PayOutRate | Brake):
        longest = float(led[:, SETPOINT].max())
    else:
        ways = length_of_way(path.place) + length_of_way(led[:, PLACE:VELOCITY])
        reach = 1.5 * (ways + task.current.fastest * task.duration) + task.wet_length
        # Space for twice the reach, and 5 m: the arrays of a compiled run cannot grow.
        longest = 2.0 * reach + 5.0
    capacity = segments_needed(longest, segment_length, scheme.grading) + int(scheme.run_in / segment_length)
    if isinstance(task.start, Equilibrium):
        capacity += task.start.segment_lengths.size
    check_memory(path.times.size, capacity)
    return capacity


def _run(
    line: Line,
    path: TowPath,
    led: np.ndarray,
    water: Water,
    c: CableNumbers,
    drum: DrumNumbers,
    rtol: float,
) -> History:
    """Run a line that is laid out, and return its history."""
    work = new_load()
    start_in_water(line, water, c, work)
    record = new_record(path.times.size, line.length.size - 1)
    rows = follow_path(line, path, led, water, c, drum, rtol, work, record)
    solved = line.ends.solved
    trouble = "" if rows == path.times.size else describe_stop(float(path.times[rows - 1]), line, drum, c)
    return as_history(path, record, rows, solved, trouble)


def as_history(path: TowPath, record: Record, rows: int, solved: Solved, trouble: str) -> History:
    """Return the record's filled rows as a history; `trouble` is the reason if it was stopped."""
    times, tow, completed = path.times, path.place, rows == path.times.size
    message = "The run reached its end." if completed else trouble
    # Shapes are packed in one array; the cuts are the first nodes of the rows.
    cuts = np.cumsum(record.segments[:rows] + 1).tolist()
    parts = [slice(first, last) for first, last in zip([0, *cuts], cuts, strict=False)]
    return History(
        time=times[:rows],
        tow_force=record.tow_force[:rows],
        tow_tension=record.tow_tension[:rows],
        drum_tension=record.drum_tension[:rows],
        length=record.length[:rows],
        tow_point=tow[:rows],
        shapes=tuple(record.position[part] for part in parts),
        tensions=tuple(record.tension[part] for part in parts),
        outcome=Outcome(
            completed=completed,
            message=message,
            iterations=int(record.iterations[:rows].sum()),
            worst_residual=float(solved.residual),
            steps=int(record.steps[:rows].sum()),
            largest_courant_number=float(record.courant[:rows].max()),
            energy_residual=float(abs(record.ledger[2, STORED]) / max(record.ledger[2, LOSS], 1e-30)),
        ),
        scheme="moving_end",
        tow_impulse=record.impulse[:rows],
    )


SAFETY = 0.8
LARGEST_GROWTH, LARGEST_CUT = 2.0, 0.2


@inner
def estimate_error(line: Line, step: float) -> float:
    """Return the relative error of the tow force on level NEW; 0 when there are too few steps to estimate it. [-]."""
    if line.ends.previous_step <= 0.0:
        return 0.0
    ratio, F, past = step / line.ends.previous_step, line.ends.tow.force, line.ends.tow.past
    # F is compared with its linear extrapolation from two steps (see the module).
    gap, size = 0.0, line.ends.tow.largest * line.ends.tow.largest
    for i in range(3):
        gap += (F[i] - past[0, i] - ratio * (past[0, i] - past[1, i])) ** 2
    return sqrt(gap / max(size, 1e-30)) / 3.0


@inner
def note_force(line: Line) -> None:
    """Remember the tow force of an accepted step."""
    square, F = 0.0, line.ends.tow.force
    for i in range(3):
        line.ends.tow.past[1, i] = line.ends.tow.past[0, i]
        line.ends.tow.past[0, i] = F[i]
        square += F[i] * F[i]
    line.ends.tow.largest = max(line.ends.tow.largest, sqrt(square))


@inner
def next_step(step: float, error: float, rtol: float) -> float:
    """Return the step that would err by a little less than `rtol`, given that `step` errs by `error`. [s]."""
    if error <= 0.0 or rtol <= 0.0:
        return LARGEST_GROWTH * step
    # Limits on the change keep one odd estimate from changing the step by orders of magnitude.
    return step * min(max(SAFETY * sqrt(rtol / error), LARGEST_CUT), LARGEST_GROWTH)
