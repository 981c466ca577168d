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

from cable.box_equations import (
    BoxRule,
    BoxScratch,
    Ends,
    box_rows,
    box_scratch,
    drum_rows,
    tow_rows,
)
from cable.box_solver import CARRIED, RIGHT, SIZE, WINDOW, back_substitute, carry, eliminate
from cable.equation7 import EQUATIONS, Equation7Numbers
from subzero.compiled import compiled

CONVERGED, STALLED, SINGULAR, NOT_FINITE, FULL = 0, 1, 2, 3, 4
OUTCOMES = (
    "converged",
    "Newton's method stalled: no damped step lowers the residual",
    "the equations do not determine a node (slack cable, or vertical tangent)",
    "a number that is not finite appeared",
    "more nodes are needed than the workspace holds",
)
TOW_ROWS, DRUM_ROWS = 6, 7
ROW_NAMES = (*EQUATIONS, "velocity of the tow point", "conditions at the drum")

UPDATE_TOLERANCE = 1e-9
"""Newton converges quadratically: an update of 1e-9 (relative) leaves an error near rounding."""
RESIDUAL_FLOOR = 1e-12
"""Below this scaled residual rounding decides; a rise there is not divergence."""
SMALLEST_FRACTION = 1.0 / 128.0
MOST_ITERATIONS = 60
LARGEST_TURN = 1.0
"""No angle moves by more in one iteration. [rad]"""


class NewtonReport(NamedTuple):
    """How a step ended: outcome (index into `OUTCOMES`), passes, worst scaled residual and where it is."""

    outcome: int
    iterations: int
    residual: float
    node: int
    row: int
    """Index into `ROW_NAMES`."""


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
    count: np.ndarray
    """(1,), the number of nodes in use."""
    factors: np.ndarray
    orders: np.ndarray
    window: np.ndarray
    scratch: BoxScratch


def box_workspace(capacity: int) -> BoxWorkspace:
    """Return zeroed arrays for at most `capacity` nodes."""
    return BoxWorkspace(
        *(np.zeros((capacity, SIZE)) for _ in range(5)),
        length=np.zeros(capacity),
        count=np.zeros(1, dtype=np.int64),
        factors=np.zeros((capacity, SIZE, RIGHT + 1)),
        orders=np.zeros((capacity, SIZE), dtype=np.int64),
        window=np.zeros((WINDOW, RIGHT + 1)),
        scratch=box_scratch(),
    )


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
def newton_pass(
    w: BoxWorkspace, rule: BoxRule, ends: Ends, c: Equation7Numbers, force: float, speed: float
) -> NewtonReport:
    """Evaluate and eliminate all boxes; outcome 0 when ``w.factors`` is ready for back substitution."""
    count = w.count[0]
    w.window[:, :] = 0.0
    tow_rows(w.window, w.y[0], ends)
    worst, row = worst_row(w.window, 0, CARRIED, force, speed)
    node, row = 0, TOW_ROWS
    for j in range(1, count):
        length = w.length[j]
        if rule.moves and j == count - 1:
            length = rule.end_history - w.y[j, 1] / rule.rate - rule.end_start
        last = rule.moves and j == count - 1
        box = BoxRule(rule.weight, rule.mix, rule.rate, last, rule.end_history, rule.end_start)
        box_rows(
            w.window,
            w.y[j - 1],
            w.y[j],
            w.history[j - 1],
            w.history[j],
            w.known[j],
            length,
            box,
            c,
            w.scratch,
        )
        value, place = worst_row(w.window, CARRIED, WINDOW, force, speed)
        if not value <= worst:
            worst, node, row = value, j, place - CARRIED
        if not eliminate(w.window, WINDOW, w.factors[j - 1], w.orders[j - 1]):
            return NewtonReport(SINGULAR, 0, worst, j - 1, row)
        carry(w.window)
    drum_rows(w.window, w.y[count - 1], w.history[count - 1], rule.rate, ends)
    value = (
        abs(w.window[3, RIGHT]) / speed + abs(w.window[4, RIGHT]) / speed + abs(w.window[5, RIGHT]) / force
    )
    if not value <= worst:
        worst, node, row = value, count - 1, DRUM_ROWS
    if not eliminate(w.window, SIZE, w.factors[count - 1], w.orders[count - 1]):
        return NewtonReport(SINGULAR, 0, worst, count - 1, row)
    return NewtonReport(CONVERGED if worst < math.inf else NOT_FINITE, 0, worst, node, row)


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
def move(w: BoxWorkspace, fraction: float) -> None:
    """Set y = base + fraction · update."""
    for j in range(w.count[0]):
        for i in range(SIZE):
            w.y[j, i] = w.base[j, i] + fraction * w.update[j, i]


@compiled
def solve_boxes(w: BoxWorkspace, rule: BoxRule, ends: Ends, c: Equation7Numbers) -> NewtonReport:
    """Solve all box equations for ``w.y``, starting from what it holds; see the module's first words."""
    force, speed = scales(w, ends, c)
    count = w.count[0]
    before, fraction = math.inf, 1.0
    report = NewtonReport(STALLED, 0, math.inf, 0, 0)
    for iteration in range(MOST_ITERATIONS):
        now = newton_pass(w, rule, ends, c, force, speed)
        worse = now.outcome != CONVERGED or (now.residual >= before and now.residual > RESIDUAL_FLOOR)
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
        w.base[:count] = w.y[:count]
        fraction = 1.0 if turn <= LARGEST_TURN else LARGEST_TURN / turn
        move(w, fraction)
        if size < UPDATE_TOLERANCE:
            return NewtonReport(CONVERGED, iteration + 1, now.residual, now.node, now.row)
        if not size < math.inf:
            return NewtonReport(NOT_FINITE, iteration + 1, now.residual, now.node, now.row)
    return report
