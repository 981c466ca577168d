"""The start of a run: from a trial and a model to what stays and what changes, the cable laid straight behind."""

from __future__ import annotations

import numpy as np

import scenarios
import vehicle
from cable.drum import FREE
from cable.element import new_load
from cable.line import NOW, Line, new_line
from subzero.hanging import hang_between
from subzero.model import Model
from subzero.run_state import Live, Setup, new_now
from subzero.setup import lay_out, setup_of, wet_length
from subzero.steady_start import first_state

FIRST_ROOM = 16
"""Segments that a new cable has room for, beyond those that are in the water."""


def prepare(
    trial: scenarios.Trial,
    model: Model,
    tethered: bool,
    state: np.ndarray | None = None,
    longest_exchange: float | None = None,
) -> tuple[Setup, Live]:
    """Return what stays and what changes in a run, at its start: the cable laid straight behind the vehicle.

    Args:
        trial: what is simulated.
        model: vehicle, cable, drum and water.
        tethered: with the cable of the default scheme.
        state: another first state than that of the trial.
        longest_exchange: there is room for the hull's steps in so long an exchange; that of the trial by default. [s]

    Raises:
        UserError: a start that cannot be.
    """
    wet, size = wet_length(trial), vehicle.STATE_SIZE
    longest = longest_exchange or max(trial.cable_step, float(np.diff(trial.times()).max()))
    steps = most_hull_steps(longest, trial.hull_step)
    setup = setup_of(trial, model, tethered)
    live = Live(
        now=new_now(),
        state=first_state(trial, model, tethered) if state is None else state,
        path=np.zeros((steps + 1, size)),
        stages=np.zeros((5, size)),
        line=new_line(int(wet / trial.segment_length) + FIRST_ROOM),
        load=new_load(),
    )
    live.now.length = wet if tethered else 0.0
    live.line.ends.segment_length, live.line.ends.grading = trial.segment_length, trial.grading
    lay_out(setup, live, wet)
    if trial.start.drum is not None:
        hang_between(setup, live, trial, model)
    elif setup.fixed.drum.control != FREE:
        _hang(live.line, float(live.now.guess[2] * setup.fixed.cable.weight))
    return setup, live


def most_hull_steps(span: float, hull_step: float) -> int:
    """Return how many hull steps an exchange of `span` [s] takes at most, as `coupling.hull_steps` counts."""
    return max(1, int(np.ceil(span / hull_step - 1e-6)))


def _hang(line: Line, weight: float) -> None:
    """Add the weight that a winch carries, `weight` [N/m] per length of a straight cable below it."""
    N = int(line.ends.count)
    lengths = np.append(line.length[1:N], line.ends.last_length[NOW])
    along = np.cumsum(lengths)
    line.tension[:, 1 : N + 1] += max(weight, 0.0) * (along - 0.5 * lengths)
    line.node_tension[1 : N + 1] += max(weight, 0.0) * along
