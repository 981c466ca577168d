"""The compiled loop of a coupled run with the paper's scheme: one cable step is one exchange, one node, one segment.

    (2) predict the vehicle to t_{k+1}, pulled by the cable's force of t_k, which is held
    (3) solve (22)-(26) with the tow point's velocity V + Ω × r_c at t_{k+1}, `cable.feng_allen.printed_scheme`
    (4) force (12) and moment (13) on the vehicle from node 0 of that solution

as section 3 of Feng and Allen (2004) prints it: nothing is iterated between vehicle and cable, and no step is tried
again. At the start the single node follows the tow point, (8)-(11); it carries the drum's friction once it moves. The
tension may be negative: nothing in the printed scheme keeps the cable from pushing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cable.feng_allen import (
    CONVERGED,
    NOTHING,
    BoxWorkspace,
    Ends,
    Equation7Numbers,
    NewtonReport,
    advance_paper,
    node_force,
    start_paper,
    tangent,
    told,
)
from subzero.coupling import ABSURD, CABLE_FAILED, FINE, _move, hull_steps
from subzero.energy import CABLE_LOSS, book
from subzero.jit import compiled
from subzero.recording import Recording, record_row
from subzero.run_state import Live, Setup
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
    """Fill rows first … last − 1 of a recording; arguments as `subzero.loop.run_rows`.

    Returns:
        rows that are filled, nodes in use, how it ended, and the cable's last `NewtonReport` as a tuple.
    """
    report = NewtonReport(CONVERGED, 0, 0.0, 0, 0)
    for row in range(first, last):
        ending, report = _exchange(setup, live, line, times[row - 1], times[row] - times[row - 1])
        if ending != FINE:
            return row, used, ending, told(report)
        used = record_printed(setup, live, line, recording, row, times[row], used)
    return last, used, FINE, told(report)


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
    """Return the force on the vehicle (12), earth axes; none from a drum that has not begun to turn. [N]."""
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
    return end + 1
