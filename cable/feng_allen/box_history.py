"""What a run with equation (7) leaves: states, forces, shapes, and how it ended. Plain arrays, no scheme."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from cable.feng_allen.box_newton import CONVERGED, OUTCOMES, ROW_NAMES, BoxWorkspace, NewtonReport
from cable.feng_allen.equation7 import tangent
from subzero.errors import BadValueError, checked, real, short

TowVelocity = Callable[[float], Sequence[float] | np.ndarray]
"""Gives the tow point's velocity (north, east, down) [m/s] at a time [s]."""
COMPLETED = "completed"
START = NewtonReport(CONVERGED, 0, 0.0, 0, 0)
"""The report of the time at which a run starts."""


@dataclass(frozen=True, kw_only=True)
class BoxHistory:
    """A run, one entry per time.

    Attributes:
        time: (n,) [s].
        tow_force: force on the vehicle, earth axes. (n, 3) [N]
        tow_tension: T at the vehicle. (n,) [N]
        drum_tension: T at the drum. (n,) [N]
        length: cable in the water. (n,) [m]
        states: y = [T Vt Vn Vb α β] of every node, from the vehicle to the drum; (nodes, 6) per time.
        positions: nodes relative to the drum, earth axes; (nodes, 3) per time. [m]
        iterations: Newton iterations of the step that led to this time. (n,)
        smallest_tension: of all nodes and times; below zero the cable would push. [N]
        residual: largest scaled residual of any step, before its last Newton update. [-]
        converged: whether the whole duration was run.
        message: "completed", or when, where and why the run stopped, and what to try.
    """

    time: np.ndarray
    tow_force: np.ndarray
    tow_tension: np.ndarray
    drum_tension: np.ndarray
    length: np.ndarray
    states: list[np.ndarray] = field(repr=False)
    positions: list[np.ndarray] = field(repr=False)
    iterations: np.ndarray
    smallest_tension: float
    residual: float
    converged: bool
    message: str


@dataclass(kw_only=True)
class BoxRecord:
    """Collects a run while it goes on.

    Attributes:
        compliance: e of the cable. [1/N]
        times: so far. [s]
        states: node states, copied at every time.
        lengths: of the box before each node, copied at every time. [m]
        iterations: of Newton's method.
        residual: the largest so far.
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

    def history(self, message: str = COMPLETED) -> BoxHistory:
        """Return the run so far, with the message that ended it."""
        first = np.array([y[0] for y in self.states])
        directions = np.array([tangent(y[4], y[5]) for y in first])
        pairs = zip(self.states, self.lengths, strict=True)
        return BoxHistory(
            time=np.array(self.times),
            tow_force=first[:, :1] * directions,
            tow_tension=first[:, 0],
            drum_tension=np.array([y[-1, 0] for y in self.states]),
            length=np.array([length[1:].sum() for length in self.lengths]),
            states=self.states,
            positions=[positions_of(y, length, self.compliance) for y, length in pairs],
            iterations=np.array(self.iterations),
            smallest_tension=min(float(y[:, 0].min()) for y in self.states),
            residual=self.residual,
            converged=message == COMPLETED,
            message=message,
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
    """Say when, where and why a step to `time` [s] failed, and what to try."""
    return (
        f"Stopped at {time:g} s: {OUTCOMES[report.outcome]}; worst at node {report.node}, "
        f"{ROW_NAMES[report.row]}, scaled residual {report.residual:.2g} after {report.iterations} "
        f"iterations. Try {remedy}."
    )


def check_positive(**values: float) -> None:
    """Refuse a value that is not a finite number above zero, by name."""
    for name, value in values.items():
        checked("", name, value, above=0.0)


def velocity_at(tow_velocity: TowVelocity, time: float) -> tuple[float, float, float]:
    """Return the tow point's velocity as three floats, or refuse it. [m/s]."""
    given = tow_velocity(time)
    numbers = [real(x) for x in given] if np.shape(given) == (3,) else [None]
    if None in numbers:
        raise BadValueError(
            f"tow_velocity({time:g}) is {short(given)}; it must be three finite numbers, in m/s."
        )
    north, east, down = numbers
    return north, east, down  # type: ignore[return-value]
