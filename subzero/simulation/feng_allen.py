"""Run a trial with the paper's own scheme, "paper_tangent" or "paper_drum".

Imported, and compiled, only when a trial asks for it. What comes out looks like any other run, but for its energies:
the work of the propeller and the loss of the hull are there, what needs the energy of the cable is NaN, for (22) has
no energy balance of its own. A step that fails ends the run.

Departs from source: a wet length at the start is laid straight, in segments of `segment_length` (the paper starts
without any).

In the compiled loop one cable step is one exchange, one node, one segment:

    (2) predict the vehicle to t_{k+1}, pulled by the cable's force of t_k, which is held
    (3) solve (22)-(26) with the tow point's velocity V + Ω × r_c at t_{k+1}, `cable.feng_allen.printed_scheme`
    (4) force (12) and moment (13) on the vehicle from node 0 of that solution

as section 3 of Feng and Allen (2004) prints it: nothing is iterated between vehicle and cable, and no step is tried
again. At the start the single node follows the tow point, (8)-(11); it carries the drum's friction once it moves. The
tension may be negative: nothing in the printed scheme keeps the cable from pushing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import scenarios
from cable.feng_allen import (
    CONVERGED,
    NOTHING,
    OUTCOMES,
    ROW_NAMES,
    START,
    BoxWorkspace,
    Ends,
    Equation7Numbers,
    NewtonReport,
    advance_paper,
    angles_of,
    box_workspace,
    equation7_numbers,
    node_force,
    reported,
    start_paper,
    tangent,
)
from subzero.engine.coupling import ABSURD, CABLE_FAILED, FASTEST, FINE, _move, hull_steps
from subzero.engine.energy import CABLE_LOSS, book
from subzero.engine.external_wrench import tow_direction, tow_point
from subzero.engine.initial_conditions import first_state, prepare
from subzero.engine.recording import Pace, Recording, Run, cut, new_recording, record_row, thinned
from subzero.engine.run_state import Live, Setup
from subzero.jit import compiled
from subzero.model import Model
from vehicle import STATE_SIZE


class Printed(NamedTuple):
    """The paper's cable of a run: boxes, constants of (7), and 1/R_d [1/m] if new nodes are wound on the drum."""

    w: BoxWorkspace
    c: Equation7Numbers
    wound: float


@compiled
def run_printed_rows(
    setup: Setup,
    live: Live,
    line: Printed,
    recording: Recording,
    times: np.ndarray,
    first: int,
    last: int,
    used: int,
) -> tuple[int, int, int, tuple[int, int, float, int, int]]:
    """Fill rows first … last − 1 of a recording; arguments as `subzero.engine.time_loop.run_rows`.

    Returns:
        rows that are filled, nodes in use, how it ended, and the cable's last `NewtonReport` as a tuple.
    """
    report = NewtonReport(CONVERGED, 0, 0.0, 0, 0)
    for row in range(first, last):
        ending, report = _exchange(setup, live, line, times[row - 1], times[row] - times[row - 1])
        if ending != FINE:
            return row, used, ending, reported(report)
        used = record_printed(setup, live, line, recording, row, times[row], used)
    return last, used, FINE, reported(report)


@compiled
def _exchange(setup: Setup, live: Live, line: Printed, start: float, span: float) -> tuple[int, NewtonReport]:
    """Take steps (2)-(4): the vehicle on the held force, the cable on its velocity, and the force from node 0."""
    now, steps = live.now, hull_steps(setup, span)
    for i in range(3):
        now.guess[i] = now.force[i]  # held: it ends as it began, and has no slope from before
        now.force_before[i] = now.force[i]
    if not _move(setup, live, start, span):
        return ABSURD, NewtonReport(CONVERGED, 0, 0.0, 0, 0)
    ends = _ends_of(setup, live.path[steps], now.hull.rotation)
    report = advance_paper(line.w, span, ends, line.wound, False, line.c)
    now.iterations += report.iterations
    if report.outcome != CONVERGED:
        return CABLE_FAILED, report
    F = pull_of(line.w)
    for i in range(3):
        now.force[i] = F[i]
    for i in range(STATE_SIZE):
        live.state[i] = live.path[steps, i]
    now.last_step = span
    book(setup, live, start, span, steps)
    return FINE, report


@compiled
def _ends_of(setup: Setup, state: np.ndarray, R: np.ndarray) -> Ends:
    """Return the conditions (23)-(26): the velocity R (V + Ω × r_c) of the tow point, and the drum."""
    fixed, r = setup.fixed, setup.fixed.r_c
    x = state[7] + state[11] * r[2] - state[12] * r[1]
    y = state[8] + state[12] * r[0] - state[10] * r[2]
    z = state[9] + state[10] * r[1] - state[11] * r[0]
    return Ends(
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
        fixed.drum.inertia,
        fixed.drum.friction,
        False,
    )


@compiled
def start_at_drum(setup: Setup, live: Live, w: BoxWorkspace) -> None:
    """Give the single node the tow point's velocity at the start; the rotation stands in live.now.hull."""
    ends = _ends_of(setup, live.state, live.now.hull.rotation)
    start_paper(w, ends.north, ends.east, ends.down, ends.friction)


@compiled
def pull_of(w: BoxWorkspace) -> tuple[float, float, float]:
    """Return the force on the vehicle (12), earth axes; none from a drum that does not turn yet. [N]."""
    if w.count[0] == 1 and abs(w.y[0, 1]) <= NOTHING:
        return 0.0, 0.0, 0.0
    return node_force(w, 0)


@compiled
def record_printed(
    setup: Setup, live: Live, line: Printed, recording: Recording, row: int, time: float, used: int
) -> int:
    """Write a row for the present state; return how many nodes are in use after it (`used` before)."""
    record_row(setup, live, recording, row, time, used)
    for i in range(CABLE_LOSS, recording.energy.shape[1]):
        recording.energy[row, i] = math.nan
    recording.courant[row] = math.nan
    return _record_cable(line.w, line.c.e, recording, row, used)


@compiled
def _record_cable(w: BoxWorkspace, e: float, r: Recording, row: int, used: int) -> int:
    """Write the cable's part of a row, its shape summed up from the drum: (1 + eT) t of the middle of each box."""
    n, y = w.count[0], w.y
    end = used + n - 1
    r.nodes[row], r.drum_tension[row], r.tension[end] = n, y[n - 1, 0], y[n - 1, 0]
    r.length[row] = 0.0
    for i in range(3):
        r.position[end, i] = 0.0
    for j in range(n - 1, 0, -1):
        near, far = y[j - 1], y[j]
        piece = w.length[j] * (1.0 + 0.5 * e * (near[0] + far[0]))
        t = tangent(0.5 * (near[4] + far[4]), 0.5 * (near[5] + far[5]))
        for i in range(3):
            r.position[used + j - 1, i] = r.position[used + j, i] - piece * t[i]
        r.length[row] += w.length[j]
        r.tension[used + j - 1] = near[0]
    r.arc_length[used] = 0.0
    for j in range(1, n):
        r.arc_length[used + j] = r.arc_length[used + j - 1] + w.length[j]
    return end + 1


REMEDIES = {
    "paper": 'scheme = "moving_end", the default, or a longer cable_step_s',
    "paper_tangent": 'scheme = "moving_end", the default, or a longer cable_step_s',
    "paper_drum": 'scheme = "moving_end", or scheme = "paper_tangent", whose new node is not turned around the drum',
}
"""The advice; a free drum lets segments shorter than m1/(½ρπdC_t) ring, a quarter of a metre for Table 1."""


def run_as_printed(
    trial: scenarios.Trial, model: Model, progress: Callable[[float], None] | None = None
) -> Run:
    """Run a trial with the paper's scheme, in plain arrays."""
    times = trial.times()
    state = first_state(trial, model, tethered=True)
    setup, live = prepare(
        trial, model, tethered=False, state=state
    )  # without the default scheme's cable, that is
    line = lay_cable(trial, model, setup, live, times.size)
    recording = new_recording(times.size, times.size * len(line.w.y))
    used = record_printed(setup, live, line, recording, 0, 0.0, 0)
    row, ending, report, pace = 1, FINE, START, Pace()
    while row < times.size and ending == FINE:
        last = min(times.size, row + pace.rows)
        with pace:
            row, used, ending, reported = run_printed_rows(
                setup, live, line, recording, times, row, last, used
            )
        report = NewtonReport(*reported)
        if progress is not None:
            progress(row / times.size)
    message = "The run reached its end." if ending == FINE else in_words(trial, ending, report, times[row])
    run = Run(
        times=times[:row], recording=cut(recording, row, used), completed=ending == FINE, message=message
    )
    return thinned(run, trial.stride)


def lay_cable(trial: scenarios.Trial, model: Model, setup: Setup, live: Live, rows: int) -> Printed:
    """Return the cable at the start: a single node at the drum, or the wet length straight behind the vehicle."""
    wet, hull = trial.start.wet_length, live.now.hull
    boxes = max(1, round(wet / trial.segment_length)) if wet > 0.0 else 0
    w, c = box_workspace(rows + boxes + 1), equation7_numbers(model.cable, model.current)
    tow_point(live.state, setup.fixed.r_c, hull.rotation, np.zeros(3))  # for the rotation
    start_at_drum(setup, live, w)
    if boxes:
        way = np.zeros(3)
        speed = tow_direction(live.state, setup.fixed.r_c, hull.rotation, way)
        w.count[0] = boxes + 1
        w.length[1 : boxes + 1] = wet / boxes
        w.y[: boxes + 1] = (0.0, -speed, 0.0, 0.0, *angles_of(*-way))
        w.y[: boxes + 1, 0] = c.tangential * speed * abs(speed) * np.linspace(wet, 0.0, boxes + 1)
    live.now.force[:] = pull_of(w)
    return Printed(w, c, 1.0 / model.drum.radius if trial.scheme == "paper_drum" else 0.0)


def in_words(trial: scenarios.Trial, ending: int, report: NewtonReport, time: float) -> str:
    """Return when and where the run stopped on its way to `time` [s], and the advice."""
    reason = f"the vehicle's speed is absurd (more than {FASTEST:g} m/s, or not a number)"
    if ending == CABLE_FAILED:
        reason = (
            f"{OUTCOMES[report.outcome]}; worst at node {report.node}, {ROW_NAMES[report.row]}, scaled residual "
            f"{report.residual:.2g} after {report.iterations} iterations"
        )
    return f"The paper's scheme does not reach t = {time:g} s: {reason}. Try {REMEDIES[trial.scheme]}."
