"""Newton's method on all box equations of a cable at once, damped, with an outcome instead of a NaN.

One pass goes from the vehicle to the drum: it evaluates a box with its slopes, notes the worst residual and
eliminates the node's unknowns right away, so the cost and the memory of a pass grow with the number of
nodes. A step that does not lower the residual is halved; it is also cut so that no angle turns by more than a
radian in one iteration. Residuals are compared in units of a force scale (tension, drag and momentum flux of
the whole cable) and a velocity scale (the fastest node).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cable.feng_allen.box_equations import (
    BoxRule,
    BoxScratch,
    Ends,
    box_rows,
    box_scratch,
    drum_rows,
    tow_rows,
)
from cable.feng_allen.box_solver import CARRIED, RIGHT, SIZE, WINDOW, back_substitute, carry, eliminate
from cable.feng_allen.equation7 import EQUATIONS, Equation7Numbers, angles_of
from subzero.jit import compiled, inlined, inner

CONVERGED, STALLED, SINGULAR, NOT_FINITE, FULL, SLACK = 0, 1, 2, 3, 4, 5
OUTCOMES = (
    "converged",
    "Newton's method stalled: no damped step lowers the residual",
    "the equations do not determine a node (slack cable, or vertical tangent)",
    "a number that is not finite appeared",
    "more nodes are needed than the workspace holds",
    "the cable goes slack: it would have to push",
)
TOW_ROWS, DRUM_ROWS = 6, 7
ROW_NAMES = (*EQUATIONS, "velocity of the tow point", "conditions at the drum")

UPDATE_TOLERANCE = 1e-9
"""Newton converges quadratically: an update of 1e-9 (relative) leaves an error near rounding."""
RESIDUAL_FLOOR = 1e-12
"""Below this scaled residual the equations hold to rounding. A slack cable at rest gets there too, although
its angles are not determined: they keep their values."""
SMALLEST_FRACTION = 1.0 / 128.0
MOST_ITERATIONS = 60
LARGEST_TURN = 1.0
"""No angle moves by more in one iteration. [rad]"""


NOTHING = 1e-9
"""Less cable than this [m] in a step counts as zero: a thousandth of its diameter would be more."""


class NewtonReport(NamedTuple):
    """How a step ended: outcome (index into `OUTCOMES`), passes, worst scaled residual and where it is."""

    outcome: int
    iterations: int
    residual: float
    node: int
    row: int
    """Index into `ROW_NAMES`."""


START = NewtonReport(CONVERGED, 0, 0.0, 0, 0)
"""The report of the time at which a run starts."""


@inlined
def reported(report: NewtonReport) -> tuple[int, int, float, int, int]:
    """Return a report as compiled code may hand it to Python: a plain tuple, see `subzero.jit`."""
    return report.outcome, report.iterations, report.residual, report.node, report.row


class BoxWorkspace(NamedTuple):
    """All arrays of a cable with at most ``len(y)`` nodes; box j lies between nodes j − 1 and j."""

    y: np.ndarray
    """States (nodes, 6)."""
    history: np.ndarray
    known: np.ndarray
    base: np.ndarray
    update: np.ndarray
    length: np.ndarray
    """Length of box j [m]."""
    count: np.ndarray  # type: ignore[assignment]  # hides the tuple method of that name
    """(2,): the number of nodes in use, and before the last step of the paper's scheme."""
    factors: np.ndarray
    orders: np.ndarray
    window: np.ndarray
    scratch: BoxScratch


def box_workspace(capacity: int) -> BoxWorkspace:
    """Return zeroed arrays for at most `capacity` nodes."""
    return BoxWorkspace(
        y=np.zeros((capacity, SIZE)),
        history=np.zeros((capacity, SIZE)),
        known=np.zeros((capacity, SIZE)),
        base=np.zeros((capacity, SIZE)),
        update=np.zeros((capacity, SIZE)),
        length=np.zeros(capacity),
        count=np.zeros(2, dtype=np.int64),
        factors=np.zeros((capacity, SIZE, RIGHT + 1)),
        orders=np.zeros((capacity, SIZE), dtype=np.int64),
        window=np.zeros((WINDOW, RIGHT + 1)),
        scratch=box_scratch(),
    )


@compiled
def start_paper(w: BoxWorkspace, north: float, east: float, down: float, friction: float) -> None:
    """Set the single node of a cable of no length: the tow point at the drum, conditions (8)-(11).

    Args:
        w: the workspace; node 0 is set, `count` becomes 1.
        north: velocity of the tow point, earth axes. The cable leaves in the opposite direction. [m/s]
        east: the same.
        down: the same.
        friction: C_f/R_d, the tension that turns the drum. [N]
    """
    alpha, beta = angles_of(-north, -east, -down)
    w.count[0] = 1
    w.y[0, 0] = friction
    w.y[0, 1] = -math.sqrt(north * north + east * east + down * down)
    w.y[0, 2] = 0.0
    w.y[0, 3] = 0.0
    w.y[0, 4] = alpha
    w.y[0, 5] = beta


@compiled
def scales(w: BoxWorkspace, ends: Ends, c: Equation7Numbers) -> tuple[float, float]:
    """Return a force [N] and a velocity [m/s] against which residuals and updates are small or not."""
    tension, length = 0.0, 0.0
    speed = 1e-3 + math.sqrt(ends.north**2 + ends.east**2 + ends.down**2)
    for j in range(w.count[0]):
        tension = max(tension, abs(w.y[j, 0]))
        speed = max(speed, abs(w.y[j, 1]))
        length += w.length[j]
    return tension + (c.m + c.tangential * length) * speed * speed, speed


@compiled
def worst_row(window: np.ndarray, first: int, last: int, force: float, speed: float) -> tuple[float, int]:
    """Return the largest scaled residual of rows first … last − 1 and its row; a NaN wins."""
    worst, where = 0.0, first
    for row in range(first, last):
        equation = row - CARRIED
        unit = force if equation in (0, 4, 5) else speed
        value = abs(window[row, RIGHT]) / unit
        if not value <= worst:
            worst, where = value, row
    return worst, where


@compiled
def clear(window: np.ndarray) -> None:
    """Set the window to zero (a loop compiles in a tenth of the time of a slice)."""
    for row in range(WINDOW):
        for column in range(RIGHT + 1):
            window[row, column] = 0.0


@compiled
def last_length(w: BoxWorkspace, rule: BoxRule) -> float:
    """Return the length of the last box, which is L_h − Vt/a when its end moves. [m]."""
    last = w.count[0] - 1
    return rule.end_history - w.y[last, 1] / rule.rate if rule.moves else w.length[last]


@inner
def newton_pass(
    w: BoxWorkspace, rule: BoxRule, ends: Ends, c: Equation7Numbers, force: float, speed: float
) -> NewtonReport:
    """Evaluate and eliminate all boxes; outcome 0 when ``w.factors`` is ready for back substitution."""
    last = w.count[0] - 1
    inner = BoxRule(rule.weight, rule.mix, rule.rate, False, 0.0)
    clear(w.window)
    tow_rows(w.window, w.y[0], ends)
    worst, _ = worst_row(w.window, 0, CARRIED, force, speed)
    node, row, regular = 0, TOW_ROWS, True
    for j in range(1, last + 1):
        box, length = (rule, last_length(w, rule)) if j == last else (inner, w.length[j])
        left, right, before, after = w.y[j - 1], w.y[j], w.history[j - 1], w.history[j]
        box_rows(w.window, left, right, before, after, w.known[j], length, box, c, w.scratch)
        value, place = worst_row(w.window, CARRIED, WINDOW, force, speed)
        if not value <= worst:
            worst, node, row = value, j, place - CARRIED
        regular = eliminate(w.window, WINDOW, w.factors[j - 1], w.orders[j - 1]) and regular
        carry(w.window)
    drum_rows(w.window, w.y[last], w.history[last], rule.rate, ends)
    value = max(worst_row(w.window, 4, 5, force, speed)[0], abs(w.window[5, RIGHT]) / force)
    value = max(value, abs(w.window[3, RIGHT]) / speed)
    if not value <= worst:
        worst, node, row = value, last, DRUM_ROWS
    regular = eliminate(w.window, SIZE, w.factors[last], w.orders[last]) and regular
    outcome = CONVERGED if regular else SINGULAR
    return NewtonReport(outcome if worst < math.inf else NOT_FINITE, 0, worst, node, row)


@compiled
def update_size(w: BoxWorkspace, force: float, speed: float) -> tuple[float, float]:
    """Return the largest scaled update and the largest turn of an angle [rad]."""
    size, turn = 0.0, 0.0
    for j in range(w.count[0]):
        size = max(size, abs(w.update[j, 0]) / force)
        for i in range(1, 4):
            size = max(size, abs(w.update[j, i]) / speed)
        turn = max(turn, abs(w.update[j, 4]), abs(w.update[j, 5]))
    return max(size, turn), turn


@compiled
def copy_nodes(source: np.ndarray, out: np.ndarray, count: int) -> None:
    """Copy the states of the first `count` nodes."""
    for j in range(count):
        for i in range(SIZE):
            out[j, i] = source[j, i]


@compiled
def move(w: BoxWorkspace, fraction: float) -> None:
    """Set y = base + fraction · update."""
    for j in range(w.count[0]):
        for i in range(SIZE):
            w.y[j, i] = w.base[j, i] + fraction * w.update[j, i]


@inner
def solve_boxes(w: BoxWorkspace, rule: BoxRule, ends: Ends, c: Equation7Numbers) -> NewtonReport:
    """Solve all box equations for ``w.y``, starting from what it holds; see the module's first words."""
    force, speed = scales(w, ends, c)
    count = w.count[0]
    before, fraction = math.inf, 1.0
    report = NewtonReport(STALLED, 0, math.inf, 0, 0)
    for iteration in range(MOST_ITERATIONS):
        now = newton_pass(w, rule, ends, c, force, speed)
        if now.residual <= RESIDUAL_FLOOR:
            return NewtonReport(CONVERGED, iteration + 1, now.residual, now.node, now.row)
        worse = now.outcome != CONVERGED or now.residual >= before
        if worse and iteration == 0:
            return NewtonReport(now.outcome, 1, now.residual, now.node, now.row)
        if worse:
            fraction *= 0.5
            if fraction < SMALLEST_FRACTION:
                break
            move(w, fraction)
            continue
        report = NewtonReport(STALLED, iteration + 1, now.residual, now.node, now.row)
        before = now.residual
        back_substitute(w.factors, w.orders, count, w.update)
        size, turn = update_size(w, force, speed)
        copy_nodes(w.y, w.base, count)
        fraction = 1.0 if turn <= LARGEST_TURN else LARGEST_TURN / turn
        move(w, fraction)
        if size < UPDATE_TOLERANCE:
            return NewtonReport(CONVERGED, iteration + 1, now.residual, now.node, now.row)
        if not size < math.inf:
            return NewtonReport(NOT_FINITE, iteration + 1, now.residual, now.node, now.row)
    return report
