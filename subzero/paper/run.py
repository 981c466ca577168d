"""Run a trial with the paper's own scheme, "paper_tangent" or "paper_drum": the Python around `subzero.paper.loop`.

Imported, and compiled, only when a trial asks for it. What comes out looks like any other run, but for its energies:
the work of the propeller and the loss of the hull are there, what needs the energy of the cable is NaN, for (22) has
no energy balance of its own. A step that fails ends the run.

Departs from source: a wet length at the start is laid straight, in segments of `segment_length` (the paper starts
without any).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import scenarios
from cable.feng_allen import (
    OUTCOMES,
    ROW_NAMES,
    START,
    NewtonReport,
    angles_of,
    box_workspace,
    equation7_numbers,
)
from subzero.coupling import CABLE_FAILED, FASTEST, FINE
from subzero.initial_conditions import prepare
from subzero.model import Model
from subzero.paper.loop import Printed, pull_of, record_printed, run_printed_rows, start_at_drum
from subzero.recording import Pace, Run, cut, new_recording
from subzero.run_state import Live, Setup
from subzero.steady_start import first_state
from subzero.vehicle_step import tow_point, way_of_tow_point

REMEDIES = {
    "paper": 'scheme = "moving_end", the default, or a longer cable_step_s',
    "paper_tangent": 'scheme = "moving_end", the default, or a longer cable_step_s',
    "paper_drum": 'scheme = "moving_end", or scheme = "paper_tangent", whose new node is not turned around the drum',
}
"""What to try; a free drum lets segments shorter than m1/(½ρπdC_t) ring, a quarter of a metre for Table 1."""


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
            row, used, ending, told = run_printed_rows(setup, live, line, recording, times, row, last, used)
        report = NewtonReport(*told)
        if progress is not None:
            progress(row / times.size)
    message = "The run reached its end." if ending == FINE else in_words(trial, ending, report, times[row])
    return Run(
        times=times[:row], recording=cut(recording, row, used), completed=ending == FINE, message=message
    )


def lay_cable(trial: scenarios.Trial, model: Model, setup: Setup, live: Live, rows: int) -> Printed:
    """Return the cable at the start: a single node at the drum, or the wet length straight behind the vehicle."""
    wet, hull = trial.start.wet_length, live.now.hull
    boxes = max(1, round(wet / trial.segment_length)) if wet > 0.0 else 0
    w, c = box_workspace(rows + boxes + 1), equation7_numbers(model.cable, model.current)
    tow_point(live.state, setup.fixed.r_c, hull.rotation, np.zeros(3))  # for the rotation
    start_at_drum(setup, live, w)
    if boxes:
        way = np.zeros(3)
        speed = way_of_tow_point(live.state, setup.fixed.r_c, hull.rotation, way)
        w.count[0] = boxes + 1
        w.length[1 : boxes + 1] = wet / boxes
        w.y[: boxes + 1] = (0.0, -speed, 0.0, 0.0, *angles_of(*-way))
        w.y[: boxes + 1, 0] = c.tangential * speed * abs(speed) * np.linspace(wet, 0.0, boxes + 1)
    live.now.force[:] = pull_of(w)
    return Printed(w, c, 1.0 / model.drum.radius if trial.scheme == "paper_drum" else 0.0)


def in_words(trial: scenarios.Trial, ending: int, report: NewtonReport, time: float) -> str:
    """Say when and where the run stopped on its way to `time` [s], and what to try."""
    reason = f"the vehicle's speed is absurd (more than {FASTEST:g} m/s, or not a number)"
    if ending == CABLE_FAILED:
        reason = (
            f"{OUTCOMES[report.outcome]}; worst at node {report.node}, {ROW_NAMES[report.row]}, scaled residual "
            f"{report.residual:.2g} after {report.iterations} iterations"
        )
    return f"The paper's scheme does not reach t = {time:g} s: {reason}. Try {REMEDIES[trial.scheme]}."
