"""Equation (7) with a moving end: box rule in space, TR-BDF2 in time; second order in both, every step.

This independent formulation (six unknowns, angles) complements the default Cartesian one; scheme "equation7".

*Space.* Nodes 0 … N−1 are material points, node N is the end s = S(t) on the drum, with dS/dt = −Vt(S) solved
together with everything else. A last box longer than 1.5 Δs gets a node at Δs, by linear interpolation; one
shorter than 0.4 Δs loses its first node. Segment length and time step have nothing to do with each other.

*Time.* TR-BDF2 (Bank and others, 1985) with γ = 2 − √2: a trapezoidal stage to t + γ Δt, then backward
differences over t, t + γ Δt, t + Δt. Both stages read ẏ = a (y − h) with the same a = 2/(γ Δt). It is
L-stable and stiffly accurate: the tension, which has no rate of its own, is solved again at the end of every
step and does not remember (no staircase); and as the last stage differences states only, the tension is of
second order too. SDIRK2, whose stages are of first order, gives its inertia part to first order only.

*How fine.* Where T < m1 Vt² the cable runs faster than its transverse waves, and Vn = Vb = 0 alone does not
say at which angle it leaves the drum. With a free drum (T = 0 there) that layer is m1/(½ρπdCt) long, 0.25 m
for Table 1 at any speed. Segments down to that length smooth over it; shorter ones resolve it and ring.

Leaves out: slack. T → 0 in a bent cable leaves the angles undetermined, and a vertical tangent (cosβ = 0)
leaves α undetermined; a run that meets either stops and says so. The drum stands while the cable would run
back.

The end itself is never touched when the cable gains or loses a node, so tension and velocity at the drum do not jump.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cable.feng_allen.box_equations import BoxRule, Ends
from cable.feng_allen.box_newton import (
    CONVERGED,
    FULL,
    NOTHING,
    SLACK,
    BoxWorkspace,
    NewtonReport,
    box_workspace,
    copy_nodes,
    scales,
    solve_boxes,
    start_paper,
)
from cable.feng_allen.equation7 import Equation7Numbers
from subzero.jit import compiled, inner

GAMMA = 2.0 - math.sqrt(2.0)
NEW_SHARE = 1.0 / (GAMMA * (2.0 - GAMMA))
OLD_SHARE = (1.0 - GAMMA) ** 2 * NEW_SHARE
"""The second stage starts from NEW_SHARE y(t + γΔt) − OLD_SHARE y(t)."""
SLACK_TOLERANCE = 1e-6
"""Tensions below zero by less than this, in units of the cable's force scale, are rounding."""


@inner
def solve_stage(
    w: BoxWorkspace, a: float, end_history: float, ends: Ends, c: Equation7Numbers
) -> NewtonReport:
    """Solve ẏ = a (y − h) with the moving end; the drum is held while the cable would run back."""
    rule = BoxRule(1.0, 1.0, a, True, end_history)
    last = w.count[0] - 1
    report = solve_boxes(w, rule, ends, c)
    if report.outcome == CONVERGED and w.y[last, 1] > 0.0:
        still = Ends(ends.north, ends.east, ends.down, ends.inertia, ends.friction, True)
        report = solve_boxes(w, rule, still, c)
    return report


@inner
def refuse_slack(w: BoxWorkspace, report: NewtonReport, ends: Ends, c: Equation7Numbers) -> NewtonReport:
    """Return the report, or one that names the node with the least tension when that is below zero."""
    worst = 0
    for j in range(w.count[0]):
        worst = j if w.y[j, 0] < w.y[worst, 0] else worst
    force, _ = scales(w, ends, c)
    if w.y[worst, 0] >= -SLACK_TOLERANCE * force:
        return report
    return NewtonReport(SLACK, report.iterations, report.residual, worst, 0)


@compiled
def start_step(b: MovingBoxes, middle: Ends) -> bool:
    """Keep y(t) in ``b.old``, after a cable of no length took the direction of motion; False: no motion."""
    w = b.boxes
    speed = w.y[0, 1]
    is_new = w.count[0] == 2 and w.length[1] <= NOTHING
    if is_new:
        start_moving_boxes(b, middle.north, middle.east, middle.down, middle.friction)
    copy_nodes(w.y, b.old, w.count[0])
    if is_new:
        b.old[0, 1] = speed
        b.old[1, 1] = speed
    return not is_new or w.y[0, 1] < -NOTHING


@compiled
def first_stage(b: MovingBoxes, a: float) -> float:
    """Set h = y(t) + ẏ(t)/a, the trapezoidal rule to t + γΔt; return L_h of the last box [m]."""
    w, count = b.boxes, b.boxes.count[0]
    for j in range(count):
        for i in range(6):
            w.history[j, i] = b.old[j, i] + b.rate[j, i] / a
    return w.length[count - 1] - b.old[count - 1, 1] / a


@compiled
def second_stage(b: MovingBoxes, length: float, middle_length: float) -> float:
    """Set h = NEW_SHARE y(t + γΔt) − OLD_SHARE y(t), backward differences; return L_h [m]."""
    w = b.boxes
    for j in range(w.count[0]):
        for i in range(6):
            w.history[j, i] = NEW_SHARE * w.y[j, i] - OLD_SHARE * b.old[j, i]
    return NEW_SHARE * middle_length - OLD_SHARE * length


@compiled
def box_step(
    b: MovingBoxes, step: float, middle: Ends, new: Ends, segment_length: float, c: Equation7Numbers
) -> tuple[int, int, float, int, int]:
    """Take one TR-BDF2 step; return its `NewtonReport` as a tuple. On failure ``b`` holds the cable before the step.

    Args:
        b: the cable, started with `start_moving_boxes`.
        step: Δt. [s]
        middle: velocity of the tow point at t + γΔt, and the drum.
        new: the same at t + Δt.
        segment_length: Δs. [m]
        c: constants of equation (7).
    """
    w, a = b.boxes, 2.0 / (GAMMA * step)
    if not start_step(b, middle):
        return CONVERGED, 0, 0.0, 0, 0
    last, length = w.count[0] - 1, w.length[w.count[0] - 1]
    end_history = first_stage(b, a)
    report = solve_stage(w, a, end_history, middle, c)
    spent = report.iterations
    if report.outcome == CONVERGED:
        middle_length = end_history - w.y[last, 1] / a
        end_history = second_stage(b, length, middle_length)
        report = solve_stage(w, a, end_history, new, c)
        spent += report.iterations
    if report.outcome == CONVERGED:
        report = refuse_slack(w, report, new, c)
    if report.outcome != CONVERGED:
        copy_nodes(b.old, w.y, last + 1)
        return report.outcome, spent, report.residual, report.node, report.row
    for j in range(last + 1):
        for i in range(6):
            b.rate[j, i] = a * (w.y[j, i] - w.history[j, i])
    w.length[last] = end_history - w.y[last, 1] / a
    fits = fit_nodes(b, segment_length)
    return CONVERGED if fits else FULL, spent, report.residual, report.node, report.row


SPLIT, MERGE = 1.5, 0.4
"""Lengths of the last box, in segments, beyond which a node is inserted or removed."""


class MovingBoxes(NamedTuple):
    """A cable with a moving end: the boxes, the rates of change of its nodes, and where a step began."""

    boxes: BoxWorkspace
    rate: np.ndarray
    """ẏ at the nodes; of the last node, along its own path (nodes, 6) [1/s]."""
    old: np.ndarray
    """y at the beginning of a step."""


def moving_boxes(capacity: int) -> MovingBoxes:
    """Return a cable of zero length with space for `capacity` nodes; `start_moving_boxes` gives it a direction."""
    return MovingBoxes(box_workspace(capacity), np.zeros((capacity, 6)), np.zeros((capacity, 6)))


@compiled
def start_moving_boxes(b: MovingBoxes, north: float, east: float, down: float, friction: float) -> None:
    """Lay a cable of no length against the motion of the tow point; its two nodes are the same place."""
    start_paper(b.boxes, north, east, down, friction)
    b.boxes.count[0] = 2
    b.boxes.length[1] = 0.0
    for i in range(6):
        b.boxes.y[1, i] = b.boxes.y[0, i]
        b.rate[0, i] = 0.0
        b.rate[1, i] = 0.0


@compiled
def fit_nodes(b: MovingBoxes, segment_length: float) -> bool:
    """Insert or remove nodes until the last box has an admissible length; return False when the arrays are full."""
    w = b.boxes
    while w.length[w.count[0] - 1] > SPLIT * segment_length:
        if w.count[0] == len(w.y):
            return False
        insert_node(b, segment_length)
    while w.count[0] > 2 and w.length[w.count[0] - 1] < MERGE * segment_length:
        remove_node(b)
    return True


@compiled
def insert_node(b: MovingBoxes, segment_length: float) -> None:
    """Put a material node Δs into the last box, by linear interpolation; the end does not change.

    The new node does not move with the end: its rate is interpolated from that of the material at the end,
    ẏ + Vt ∂y/∂s.
    """
    w, n = b.boxes, b.boxes.count[0]
    length, speed = w.length[n - 1], w.y[n - 1, 1]
    part = segment_length / length
    for i in range(6):
        left, end = w.y[n - 2, i], w.y[n - 1, i]
        material = b.rate[n - 1, i] + speed * (end - left) / length
        w.y[n, i], b.rate[n, i] = end, b.rate[n - 1, i]
        w.y[n - 1, i] = left + part * (end - left)
        b.rate[n - 1, i] = b.rate[n - 2, i] + part * (material - b.rate[n - 2, i])
    w.length[n - 1], w.length[n] = segment_length, length - segment_length
    w.count[0] = n + 1


@compiled
def remove_node(b: MovingBoxes) -> None:
    """Remove the last material node; the last two boxes become one, the end does not change."""
    w, n = b.boxes, b.boxes.count[0]
    for i in range(6):
        w.y[n - 2, i], b.rate[n - 2, i] = w.y[n - 1, i], b.rate[n - 1, i]
    w.length[n - 2] += w.length[n - 1]
    w.count[0] = n - 1


def with_capacity(b: MovingBoxes, step: float, segment_length: float) -> MovingBoxes:
    """Return the cable with space for twice as many nodes as the next step can add."""
    used = int(b.boxes.count[0])
    wanted = used + 8 + int(4.0 * abs(b.boxes.y[used - 1, 1]) * step / segment_length)
    if wanted <= len(b.boxes.y):
        return b
    larger = moving_boxes(2 * wanted)
    larger.boxes.y[:used], larger.rate[:used] = b.boxes.y[:used], b.rate[:used]
    larger.boxes.length[:used], larger.boxes.count[0] = b.boxes.length[:used], used
    return larger
