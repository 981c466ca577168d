"""Run a scheme that solves equation (7) in its angles, and return the default scheme's `History`.

`Paper`: (20)-(26) as printed, `printed_scheme`. `Equation7`: our independent second-order formulation, `box_scheme`.
Imported only when one of them is asked for, so the default scheme compiles nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cable.drum import DrumNumbers, DrumProperties
from cable.feng_allen.box_equations import Ends
from cable.feng_allen.box_newton import (
    CONVERGED,
    FULL,
    OUTCOMES,
    ROW_NAMES,
    SLACK,
    START,
    BoxWorkspace,
    NewtonReport,
    box_workspace,
    start_paper,
)
from cable.feng_allen.box_scheme import (
    GAMMA,
    MovingBoxes,
    box_step,
    moving_boxes,
    start_moving_boxes,
    with_capacity,
)
from cable.feng_allen.equation7 import Equation7Numbers, equation7_numbers, tangent
from cable.feng_allen.printed_scheme import paper_step
from cable.history import History, Outcome
from cable.schemes import Equation7, Paper
from cable.task import PullOut, uniform
from cable.tow_path import Velocity, sample_path, three_numbers


def pull_out(task: PullOut, scheme: Equation7 | Paper) -> History:
    """Pull cable off a free drum on the shore in uniform water, as `cable.pull_out` does.

    A run that cannot go on is cut short and says so in its outcome.
    """
    record, trouble = run_paper(task, scheme) if isinstance(scheme, Paper) else run_boxes(task, scheme)
    way = sample_path(task.tow_velocity, task.duration, scheme.time_step).place
    return record.history(way, scheme.name, trouble)


def run_paper(task: PullOut, scheme: Paper) -> tuple[BoxRecord, str]:
    """Pull cable off the drum with the paper's scheme (14)-(26); return the run, and why it was stopped if it was."""
    assert isinstance(task.drum, DrumProperties), "the table of schemes lets no winch through"
    c, drum = equation7_numbers(uniform(task.cable), _uniform(task)), task.drum.numbers()
    wound = 1.0 / task.drum.radius if scheme.reading == "drum" else 0.0
    steps, step = _steps(task.duration, scheme.time_step)
    w, record = box_workspace(steps + 2), BoxRecord(compliance=c.e)
    start_paper(w, *velocity_at(task.tow_velocity, 0.0), drum.friction)
    record.add(0.0, w, START)
    for k in range(1, steps + 1):
        ends = Ends(*velocity_at(task.tow_velocity, k * step), drum.inertia, drum.friction, False)
        report = NewtonReport(*paper_step(w, step, ends, wound, scheme.implicit, c))
        if report.outcome != CONVERGED:
            return record, explain(report, k * step, _remedy(scheme))
        record.add(k * step, w, report)
    return record, ""


def _remedy(scheme: Paper) -> str:
    """Return the advice for a step of the paper's scheme that fails."""
    default = "the default scheme (cable.MovingEnd)"
    if scheme.reading == "drum":
        return f"reading='tangent' or {default}"
    return default if scheme.implicit else f"a smaller time_step, or {default}"


class Fixed(NamedTuple):
    """Constants of a run in boxes: segment length [m], constants of (7), the drum."""

    segment_length: float
    cable: Equation7Numbers
    drum: DrumNumbers


def run_boxes(task: PullOut, scheme: Equation7) -> tuple[BoxRecord, str]:
    """Pull cable off the drum with the second, independent formulation of second order; likewise."""
    c = equation7_numbers(uniform(task.cable), _uniform(task), stretch_momentum=0.0)
    fixed, record = Fixed(scheme.segment_length, c, task.drum.numbers()), BoxRecord(compliance=c.e)
    steps, step = _steps(task.duration, scheme.time_step)
    b = moving_boxes(64)
    start_moving_boxes(b, *velocity_at(task.tow_velocity, 0.0), fixed.drum.friction)
    record.add(0.0, b.boxes, START)
    for k in range(steps):
        b = with_capacity(b, step, scheme.segment_length)
        report = _advance(b, fixed, task.tow_velocity, k * step, step, MOST_HALVINGS)
        if report.outcome != CONVERGED:
            remedy = "another time_step or segment_length, or the default scheme (cable.MovingEnd)"
            return record, explain(report, (k + 1) * step, remedy)
        record.add((k + 1) * step, b.boxes, report)
    return record, ""


def _advance(
    b: MovingBoxes, fixed: Fixed, tow_velocity: Velocity, time: float, step: float, halvings: int
) -> NewtonReport:
    """Take a step, in halves where it fails."""
    inertia, friction = fixed.drum.inertia, fixed.drum.friction
    middle, new = (
        Ends(*velocity_at(tow_velocity, at), inertia, friction, False)
        for at in (time + GAMMA * step, time + step)
    )
    report = NewtonReport(*box_step(b, step, middle, new, fixed.segment_length, fixed.cable))
    if report.outcome in (CONVERGED, FULL, SLACK) or halvings == 0:
        return report
    half = 0.5 * step
    report = _advance(b, fixed, tow_velocity, time, half, halvings - 1)
    if report.outcome != CONVERGED:
        return report
    return _advance(b, fixed, tow_velocity, time + half, half, halvings - 1)


def _steps(duration: float, wanted: float) -> tuple[int, float]:
    """Return how many steps a run takes, and how long they are: as wanted, but for a whole number. [s]."""
    steps = max(1, round(duration / wanted))
    return steps, duration / steps


def _uniform(task: PullOut) -> tuple[float, float, float]:
    """Return the velocity of the water, the same everywhere (3,). [m/s]."""
    north, east, down = task.current.velocity.reshape(3).tolist()
    return north, east, down


MOST_HALVINGS = 6
"""A failing step is halved this often before the run stops."""


@dataclass(kw_only=True)
class BoxRecord:
    """Collects a run while it goes on.

    Attributes:
        compliance: e of the cable. [1/N]
        times: so far. [s]
        states: y = [T Vt Vn Vb α β] of every node, from the vehicle to the drum, copied at every time (nodes, 6).
        lengths: of the box before each node, copied at every time. [m]
        iterations: of Newton's method.
        residual: the largest so far, scaled, before the last Newton update of a step. [-]
    """

    compliance: float
    times: list[float] = field(default_factory=list)
    states: list[np.ndarray] = field(default_factory=list)
    lengths: list[np.ndarray] = field(default_factory=list)
    iterations: list[int] = field(default_factory=list)
    residual: float = 0.0

    def add(self, time: float, w: BoxWorkspace, report: NewtonReport) -> None:
        """Copy the cable as it is now, and how it was solved."""
        count = int(w.count[0])
        self.times.append(time)
        self.states.append(w.y[:count].copy())
        self.lengths.append(w.length[:count].copy())
        self.iterations.append(report.iterations)
        self.residual = max(self.residual, report.residual)

    def history(self, way: np.ndarray, scheme: str, trouble: str) -> History:
        """Return the run so far, of a tow point on its way (n, 3) [m]; `trouble` is the reason if it was stopped."""
        first = np.array([y[0] for y in self.states])
        directions = np.array([tangent(y[4], y[5]) for y in first])
        pairs = zip(self.states, self.lengths, strict=True)
        return History(
            time=np.array(self.times),
            tow_force=first[:, :1] * directions,
            tow_tension=first[:, 0],
            drum_tension=np.array([y[-1, 0] for y in self.states]),
            length=np.array([length[1:].sum() for length in self.lengths]),
            tow_point=way[: len(self.times)],
            shapes=tuple(positions_of(y, length, self.compliance) for y, length in pairs),
            tensions=tuple(y[:, 0] for y in self.states),
            outcome=Outcome(
                completed=not trouble,
                message=trouble or "The run reached its end.",
                iterations=sum(self.iterations),
                worst_residual=self.residual,
            ),
            scheme=scheme,
        )


def positions_of(state: np.ndarray, length: np.ndarray, compliance: float = 0.0) -> np.ndarray:
    """Return node positions relative to the drum, by integrating (1 + eT) t from the drum. (nodes, 3) [m].

    Args:
        state: y of the nodes, vehicle first. (nodes, 6)
        length: of the box before each node; the first entry is not used. (nodes,) [m]
        compliance: e. [1/N]
    """
    middle = 0.5 * (state[1:] + state[:-1])
    alpha, beta = middle[:, 4], middle[:, 5]
    t = np.stack([np.cos(alpha) * np.cos(beta), -np.sin(alpha) * np.cos(beta), -np.sin(beta)], axis=1)
    pieces = t * (length[1:] * (1.0 + compliance * middle[:, 0]))[:, None]
    return np.concatenate([-np.cumsum(pieces[::-1], axis=0)[::-1], np.zeros((1, 3))])


def explain(report: NewtonReport, time: float, remedy: str) -> str:
    """Return when, where and why a step to `time` [s] failed, and the advice."""
    return (
        f"Stopped at {time:g} s: {OUTCOMES[report.outcome]}; worst at node {report.node}, "
        f"{ROW_NAMES[report.row]}, scaled residual {report.residual:.2g} after {report.iterations} "
        f"iterations. Try {remedy}."
    )


def velocity_at(tow_velocity: Velocity, time: float) -> tuple[float, float, float]:
    """Return the tow point's velocity as three floats, or refuse it. [m/s]."""
    given = three_numbers([tow_velocity(time)], "tow_velocity", np.array([time]))
    north, east, down = given[0].tolist()
    return north, east, down
