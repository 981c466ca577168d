"""The numerical scheme of Feng and Allen (2004), equations (14)-(26), as printed: one new node a step.

At t_k the cable has nodes 0 … k. A step

1. lets ΔS = −Vt(S_k, t_k) Δt of cable into the water (18), as a new box with its node on the drum,
2. prescribes the new node's state at t_k: [T, Vt, 0, 0, α, β − ΔS/R_d], the last node's with the tangent
   turned back around the drum (reading ``drum``, as printed), or with the tangent continued (``tangent``),
3. solves the box equations (22) with the conditions (23)-(26) for all nodes at t_{k+1}.

Segment length and time step are one thing here, and the cost of a run grows with the square of its length.
When the drum stands or is overrun (ΔS ≤ 0) the same nodes take the step and no node is added. While there is
no cable in the water at all, the single node follows the tow point, (8)-(11). Nothing in the printed scheme
keeps T ≥ 0: after a stop the trapezoidal rule rings about zero for ever (the smallest tension of its diagnostics).

``implicit=True`` takes the same boxes fully implicit in time, which removes the staircase in the tension that
the trapezoidal rule of (22) leaves; that is our comparison, not the paper's. What the scheme does, with
numbers: ``docs/paper_scheme.md``.
"""

from __future__ import annotations

from cable.feng_allen.box_equations import BoxRule, Ends, known_part
from cable.feng_allen.box_newton import (
    CONVERGED,
    FULL,
    NOTHING,
    BoxWorkspace,
    NewtonReport,
    copy_nodes,
    reported,
    solve_boxes,
    start_paper,
)
from cable.feng_allen.equation7 import Equation7Numbers, tangent
from subzero.jit import compiled, inner


@compiled
def add_node(w: BoxWorkspace, length: float, turn: float) -> None:
    """Add the new box (18) and the prescribed state of its node at t_k (the line below (21))."""
    n = w.count[0]
    for i in range(6):
        w.y[n, i] = w.y[n - 1, i]
    w.y[n, 2] = 0.0
    w.y[n, 3] = 0.0
    w.y[n, 5] -= turn
    w.length[n] = length
    w.count[0] = n + 1


@compiled
def keep_old_time(w: BoxWorkspace, weight: float, c: Equation7Numbers) -> None:
    """Store y(t_k) and the old-time share of every box."""
    copy_nodes(w.y, w.history, w.count[0])
    for j in range(1, w.count[0]):
        known_part(w.y[j - 1], w.y[j], w.length[j], weight, c, w.scratch, w.known[j])


@inner
def advance_paper(
    w: BoxWorkspace, step: float, ends: Ends, wound: float, implicit: bool, c: Equation7Numbers
) -> NewtonReport:
    """Take one step of the paper's scheme; on failure ``w`` holds the state before the step.

    Args:
        w: the workspace, started with `start_paper`. Node 0 is the tow point.
        step: Δt. [s]
        ends: velocity of the tow point at the *new* time in earth axes, and the drum.
        wound: 1/R_d for the reading ``drum``, 0 for ``tangent``. [1/m]
        implicit: fully implicit instead of (22).
        c: constants of equation (7).

    Returns:
        The outcome; the force on the vehicle is T t of node 0, `node_force`.
    """
    before = w.count[0]
    w.count[1] = before
    copy_nodes(w.y, w.history, before)
    length = -w.y[before - 1, 1] * step
    if length <= NOTHING and before == 1:
        start_paper(w, ends.north, ends.east, ends.down, ends.friction)
        return NewtonReport(CONVERGED, 0, 0.0, 0, 0)
    if length > NOTHING:
        if before == len(w.y):
            return NewtonReport(FULL, 0, 0.0, before, 0)
        add_node(w, length, wound * length)
    weight = 1.0 if implicit else 0.5
    keep_old_time(w, weight, c)
    rule = BoxRule(weight, weight, 1.0 / step, False, 0.0)
    report = solve_boxes(w, rule, ends, c)
    if report.outcome != CONVERGED:
        undo_paper_step(w)
    return report


@compiled
def paper_step(
    w: BoxWorkspace, step: float, ends: Ends, wound: float, implicit: bool, c: Equation7Numbers
) -> tuple[int, int, float, int, int]:
    """Take one step as `advance_paper`, called from Python; return the `NewtonReport` as a tuple."""
    return reported(advance_paper(w, step, ends, wound, implicit, c))


@compiled
def undo_paper_step(w: BoxWorkspace) -> None:
    """Take back the last step, so that a coupled vehicle can ask again with another velocity."""
    w.count[0] = w.count[1]
    copy_nodes(w.history, w.y, w.count[0])


@compiled
def node_force(w: BoxWorkspace, node: int) -> tuple[float, float, float]:
    """Return T t of a node in earth axes; of node 0, the force on the vehicle (12). [N]."""
    north, east, down = tangent(w.y[node, 4], w.y[node, 5])
    T = w.y[node, 0]
    return T * north, T * east, T * down
