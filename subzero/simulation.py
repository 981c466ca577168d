"""Run a trial, from a checked scenario to a labelled result."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import scenarios
from cable.moving_end import Names, describe_stop, enlarged
from subzero.convergence import Accuracy, run_converged
from subzero.engine import coupling
from subzero.engine.initial_conditions import Later, checked_later, go_on_with, prepare, rows_of_changes
from subzero.engine.recording import BY_NODE, Pace, Recording, Run, cut, new_recording, record_row
from subzero.engine.time_loop import NO_ROOM, run_rows
from subzero.errors import truth
from subzero.model import Model, load, model_of
from subzero.room import REMEDY, has_room, refuse_what_cannot_fit
from subzero.run_state import Live, Setup

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[float], None]
"""Called now and then with the fraction that is done, 0 to 1."""


def simulate(
    scenario: str | Path | scenarios.Trial,
    *,
    tethered: bool = True,
    model: Model | None = None,
    later: Later = (),
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate a trial and return its labelled result.

    Args:
        scenario: name of a shipped scenario, path of a scenario file, or a trial.
        tethered: with the cable; the same code runs without.
        model: another model than the one that the scenario describes.
        later: times of results [s] and the model that holds from each of them on, such as one with a bent rudder.
        progress: told the fraction that is done.

    Returns:
        one variable per channel of `subzero.channels`, the force breakdown, the cable's shape and tensions; units on
        every variable; scenario, parameters, versions and outcome as attributes. Look at ``attrs["outcome"]``: a run
        that could not go on keeps what it has.

    Raises:
        scenarios.ScenarioError: the scenario cannot be used.
        UserError: a time of `later` is none of the run.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    model, tethered, later = model_of(trial, model), truth("tethered", tethered), checked_later(later)
    from subzero.dataset import dataset_of

    run, accuracy = _as_fine_as_asked(trial, model, tethered, progress, later)
    result = dataset_of(trial, model, tethered, run, accuracy)
    if later:
        result.attrs["later"] = json.dumps([[time, changed.parameters()] for time, changed in later])
    return result


def _as_fine_as_asked(
    trial: scenarios.Trial, model: Model, tethered: bool, progress: Progress | None, later: Later
) -> tuple[Run, Accuracy | None]:
    """Run a trial, and finer where its `rtol` asks for it: a tethered one of the default scheme and of one model."""
    if not tethered or trial.scheme != "moving_end" or trial.rtol == 0.0 or later:
        return run_trial(trial, model, tethered, progress, later=later), None
    return run_converged(
        trial,
        lambda one, times, parts, told: run_trial(one, model, True, told, times=times, parts=parts),
        progress,
    )


def run_trial(
    trial: scenarios.Trial,
    model: Model,
    tethered: bool,
    progress: Progress | None = None,
    *,
    later: Later = (),
    times: np.ndarray | None = None,
    parts: int = 1,
) -> Run:
    """Run a trial with steps and segments as they are, in plain arrays.

    Args:
        trial: what is run.
        model: vehicle, cable, drum and water.
        tethered: with the cable.
        progress: told the fraction that is done.
        later: times of rows and the models that hold from them on.
        times: of the rows (n,); those of the trial when not given. [s]
        parts: exchanges of hull and cable from a row to the next.
    """
    refuse_what_cannot_fit(trial, model, tethered)
    times = trial.times() if times is None else times
    changes = rows_of_changes(trial, tethered, times, later)
    if tethered and trial.scheme != "moving_end":
        from subzero.paper import run_as_printed

        return run_as_printed(trial, model, progress)
    setup, live = prepare(trial, model, tethered, longest_exchange=float(np.diff(times).max()) / parts)
    recording = new_recording(times.size, 4 * times.size * live.line.length.size if tethered else 0)
    used = record_row(setup, live, recording, 0, 0.0, 0)
    row, ending, pace = 1, coupling.FINE, Pace()
    while row < times.size and ending in (coupling.FINE, NO_ROOM):
        if row - 1 in changes:
            setup = go_on_with(changes.pop(row - 1), setup, live, trial, tethered, float(times[row - 1]))
        last = min(times.size, row + pace.rows, *(change + 1 for change in changes))
        with pace:
            row, used, ending = run_rows(setup, live, recording, times, row, last, used, parts)
        if ending == NO_ROOM:
            if not has_room(4 * max(recording.tension.size, used)):
                break
            live, recording = more_room(live, recording, used)
        if progress is not None:
            progress(row / times.size)
    return Run(
        times=times[:row],
        recording=cut(recording, row, used),
        completed=ending == coupling.FINE,
        message=in_words(ending, float(times[row - 1]), setup, live),
    )


def more_room(live: Live, recording: Recording, used: int) -> tuple[Live, Recording]:
    """Return the same run with twice the room for nodes."""
    capacity = 2 * live.line.length.size
    nodes = 2 * max(recording.tension.size, used + 64 * capacity)
    larger = {}
    for name in BY_NODE:
        old = getattr(recording, name)
        larger[name] = np.zeros((nodes, *old.shape[1:]))
        larger[name][:used] = old[:used]
    return live._replace(line=enlarged(live.line, capacity)), recording._replace(**larger)


NAMES = Names(
    step="cable_step_s",
    segment="segment_length_m",
    wet="wet_length_m",
    rate="pay_out_rate_m_s",
    yielding='control = "constant_tension"',
)
"""What the settings of a cable are called in a trial file."""
WENT_WELL = "The run reached its end."


def in_words(ending: int, time: float, setup: Setup, live: Live) -> str:
    """Say how a run ended: when, where, and what to try."""
    if ending == coupling.FINE:
        return WENT_WELL
    if ending == coupling.CABLE_FAILED:
        return describe_stop(time, live.line, setup.fixed.drum, setup.fixed.cable, NAMES)
    if ending == NO_ROOM:
        return f"The cable's shapes until t = {time:g} s fill the memory that is free. {REMEDY}"
    if ending == coupling.DISAGREED:
        return (
            f"Vehicle and cable found no common tow force beyond t = {time:g} s, even in the smallest steps. "
            "Try a shorter cable_step_s and hull_step_s."
        )
    stiff = hasattr(setup.fixed.cable, "bending_stiffness")
    longer = ", or a longer segment_length_m for the stiff cable" if setup.fixed.tethered and stiff else ""
    return (
        f"The vehicle's speed beyond t = {time:g} s is absurd (more than {coupling.FASTEST:g} m/s, or not a number). "
        f"Try a shorter hull_step_s (it is {setup.fixed.hull_step:g}){longer}, or look at the commands and the "
        "vehicle's numbers."
    )
