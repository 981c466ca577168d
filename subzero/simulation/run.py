"""Run a trial, from a checked scenario to a labelled result."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.metadata import version
from multiprocessing import parent_process
from pathlib import Path
from threading import current_thread, main_thread
from typing import TYPE_CHECKING

import numpy as np

import scenarios
from cable.moving_end import Names, describe_stop, enlarged
from subzero.arguments import checked_arguments
from subzero.engine import coupling
from subzero.engine.initial_conditions import Later, go_on_with, prepare, rows_of_changes
from subzero.engine.recording import (
    BY_NODE,
    Grid,
    Pace,
    Recording,
    Run,
    RunState,
    new_recording,
    row_of,
    run_so_far,
)
from subzero.engine.run_state import Live, Setup
from subzero.engine.time_loop import NO_SPACE, run_rows
from subzero.errors import DISTRIBUTION, UserError, whole
from subzero.model import Model, load, model_of
from subzero.results.dataset import PlainRun, plain_run, record_accuracy
from subzero.simulation.memory_estimate import (
    REMEDY,
    THINNED,
    fits_in_memory,
    most_segments,
    refuse_what_cannot_fit,
    thinning_notice,
    with_fewer_results,
)
from subzero.simulation.provenance import code_digest, digest_of, processor, trial_digest
from subzero.simulation.refinement import Accuracy, Budget, Progress, Take, prove, run_converged
from subzero.validity import refinement_that_settles

if TYPE_CHECKING:
    import xarray as xr

    from subzero.simulation.checkpoint import Checkpoint, Keeper


@checked_arguments
def simulate(
    scenario: str | Path | scenarios.Trial,
    *,
    tethered: bool = True,
    model: Model | None = None,
    later: Later = (),
    every: float | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate a trial and return its labelled result.

    Args:
        scenario: name of a shipped scenario, path of a scenario file, or a trial.
        tethered: with the cable; the same code runs without.
        model: another model than the one that the scenario describes.
        later: times of results [s] and the model that holds from each of them on, such as one with a bent rudder.
        every: time between results that are kept, a whole number of cable steps; what the trial says if not given [s].
            They are the same as without, to the last bit, and the last result is always kept. Where the trial says
            nothing either, all are, but of a long run only as many as take
            `subzero.simulation.memory_estimate.MOST_KEPT`; ``attrs["thinned"]`` then says so.
        checkpoint: keeps where the run stands, now and then; the same call then goes on from there, and gives the same
            result, to the last bit.
        progress: called with the fraction that is done.

    Returns:
        one variable per channel of `subzero.channels`, the force breakdown, the cable's shape and tensions; units on
        every variable; scenario, parameters, versions and outcome as attributes. Look at ``attrs["outcome"]``: a run
        that could not go on keeps its results up to then.

    Raises:
        scenarios.ScenarioError: the scenario cannot be used.
        UserError: a time of `later` is none of the run; a checkpoint of another simulation.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    trial = trial if every is None else dataclasses.replace(trial, every=every)
    model = model_of(trial, model)
    kept = with_fewer_results(trial, model, tethered)
    run = simulate_plainly(
        kept, tethered=tethered, model=model, later=later, checkpoint=checkpoint, progress=progress
    )
    if kept.every != trial.every:
        run.attrs[THINNED] = thinning_notice(kept)
    return run.labelled()


def simulate_plainly(
    scenario: str | Path | scenarios.Trial,
    *,
    tethered: bool = True,
    model: Model | None = None,
    later: Later = (),
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
) -> PlainRun:
    """Simulate a trial as `simulate` does, and return its result in plain arrays, by the same names.

    Its results are all that the trial asks for, however many.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    model, tethered, later = model_of(trial, model), bool(tethered), tuple(later)
    with _kept(checkpoint, trial, model, tethered, later) as keeper:
        budget = Budget(trial.budget)
        run, accuracy = _as_fine_as_asked(trial, model, tethered, budget, progress, later, keeper)
        if accuracy is not None:
            accuracy = dataclasses.replace(accuracy, refinement_share=budget.share)
        result = plain_run(trial, model, tethered, run, accuracy, spends=True)
        if accuracy is not None and (finest := refinement_that_settles(result, trial, model)):
            found = prove(trial, _taker(model, keeper), run, accuracy, finest, budget, progress)
            record_accuracy(result, trial, model, dataclasses.replace(found, refinement_share=budget.share))
    if later:
        result.attrs["later"] = json.dumps([[time, changed.parameters()] for time, changed in later])
    return result


@contextmanager
def _kept(
    checkpoint: Checkpoint | None, trial: scenarios.Trial, model: Model, tethered: bool, later: Later
) -> Iterator[Keeper | None]:
    """Return the keeper of the runs of a simulation, None without a checkpoint."""
    if checkpoint is None:
        yield None
        return
    from subzero.simulation.checkpoint import opened

    if tethered and trial.scheme != "moving_end":
        raise UserError(f"'{trial.name}' has the scheme '{trial.scheme}'; only 'moving_end' has checkpoints.")
    manifest = {
        "trial": trial_digest(trial),
        "model": digest_of(model.parameters()),
        "later models": digest_of([[time, changed.parameters()] for time, changed in later]),
        "version of subzero": f"{version(DISTRIBUTION)} {code_digest()}",
        "processor": processor(),
    }
    with opened(checkpoint, "tethered" if tethered else "untethered", manifest) as keeper:
        yield keeper


@checked_arguments
def simulate_many(
    trials: Sequence[str | Path | scenarios.Trial],
    *,
    tethered: bool = True,
    every: float | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> list[xr.Dataset]:
    """Simulate many trials at once, in threads of this process: compiled code lets go of Python's lock.

    For thousands of runs of which only a few numbers matter, `subzero.sweep` keeps these alone, in processes.

    Args:
        trials: names, paths or trials.
        tethered: with the cable.
        every: time between results that are kept, as of `simulate`. [s]
        workers: how many threads; one for each processor if not given.
        progress: called with the fraction that is done.

    Returns:
        the results of `simulate` for each trial, in their order, the same to the last bit.

    Raises:
        UserError: the first trial that cannot be used; nothing is simulated then.
    """
    threads = os.cpu_count() if workers is None else whole("simulate_many: workers", workers, least=1)
    known = [trial if isinstance(trial, scenarios.Trial) else load(trial) for trial in trials]
    found: list[xr.Dataset] = []
    with ThreadPoolExecutor(threads) as pool:
        started = [pool.submit(simulate, trial, tethered=tethered, every=every) for trial in known]
        try:
            for run in started:
                found.append(run.result())
                if progress is not None:
                    progress(len(found) / len(started))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return found


def _as_fine_as_asked(
    trial: scenarios.Trial,
    model: Model,
    tethered: bool,
    budget: Budget,
    progress: Progress | None,
    later: Later,
    keeper: Keeper | None,
) -> tuple[Run, Accuracy | None]:
    """Run a trial, and finer where its `rtol` asks for it: a tethered one of the default scheme and of one model."""
    if not tethered or trial.scheme != "moving_end" or trial.rtol == 0.0 or later:
        return run_trial(trial, model, tethered, progress, later=later, keeper=keeper), None
    refuse_what_cannot_fit(
        trial, model, tethered, Grid(trial.times(), 1, trial.stride)
    )  # before a coarser run
    # Checkpoints are numbered in the order in which runs are made.
    side_by_side = keeper is None and _is_alone()
    return run_converged(trial, _taker(model, keeper), budget, progress, side_by_side=side_by_side)


def _is_alone() -> bool:
    """Return whether this is no thread and no process among many: these keep all processors busy as it is."""
    return current_thread() is main_thread() and parent_process() is None


def _taker(model: Model, keeper: Keeper | None) -> Take:
    """Return the function that makes a tethered run of a trial for `subzero.simulation.refinement`."""
    return lambda each, grid, reported: run_trial(each, model, True, reported, grid=grid, keeper=keeper)


def run_trial(
    trial: scenarios.Trial,
    model: Model,
    tethered: bool,
    progress: Progress | None = None,
    *,
    later: Later = (),
    grid: Grid | None = None,
    keeper: Keeper | None = None,
) -> Run:
    """Run a trial with steps and segments as they are, in plain arrays.

    Args:
        trial: the trial to run.
        model: vehicle, cable, drum and water.
        tethered: with the cable.
        progress: called with the fraction that is done.
        later: times of rows and the models that hold from them on.
        grid: its times and the rows to keep; by default those of the trial.
        keeper: keeps where the run stands, now and then, so that it can go on from there.
    """
    grid = Grid(trial.times(), 1, trial.stride) if grid is None else grid
    refuse_what_cannot_fit(trial, model, tethered, grid)
    changes = rows_of_changes(trial, tethered, grid.times, later)
    if tethered and trial.scheme != "moving_end":
        from subzero.simulation.feng_allen import run_as_printed

        return run_as_printed(trial, model, progress)
    kept = keeper() if keeper is not None else None
    now = _initial_run_state(trial, model, tethered, grid)
    now = kept.go_on(now) if kept is not None else now
    pace = Pace()
    while now.behind < grid.times.size and _goes_on(now, grid):
        start = now.behind - 1
        if start in changes:
            now = now._replace(
                setup=go_on_with(
                    changes[start], now.setup, now.live, trial, tethered, float(grid.times[start])
                )
            )
        last = min([now.behind + pace.rows, *(row + 1 for row in changes if row > start)])
        with pace:
            now = _further(now, grid, min(last, grid.times.size))
        if now.ending == NO_SPACE:
            if not fits_in_memory(4 * max(now.recording.tension.size, now.used)):
                break
            live, recording = enlarged_run(now.live, now.recording, now.used)
            now = now._replace(live=live, recording=recording)
        if kept is not None:
            kept.keep(now, grid.times, grid.stride)
        if progress is not None:
            progress(now.behind / grid.times.size)
    if kept is not None:
        kept.keep(now, grid.times, grid.stride, at_once=True)
    message = in_words(now.ending, float(grid.times[now.behind - 1]), now.setup, now.live)
    message = GIVEN_UP if _took_too_long(now, grid) else message
    completed = now.ending == coupling.FINE and _goes_on(now, grid)
    return run_so_far(grid, now.recording, now.behind, now.used, message, completed=completed)


def _goes_on(now: RunState, grid: Grid) -> bool:
    """Return whether a run can and may go on."""
    return now.ending in (coupling.FINE, NO_SPACE) and not _took_too_long(now, grid)


def _took_too_long(now: RunState, grid: Grid) -> bool:
    """Return whether a run took more iterations than it may, however many rows were filled at a time."""
    return bool(now.live.now.iterations > grid.iterations)


SPARE_SEGMENTS = 64
"""Segments allocated for a run at its start beyond those in the water, more than `fig6` pays out: to enlarge the
arrays takes half a millisecond. [-]"""
SPARE_NODES = 64
"""A recording has space for twice the nodes that are expected, and so many more in each row. [-]"""


def _initial_run_state(trial: scenarios.Trial, model: Model, tethered: bool, grid: Grid) -> RunState:
    """Return a run at its start, of which no row is written yet."""
    longest = float(np.diff(grid.times).max()) / grid.parts
    setup, live = prepare(trial, model, tethered, longest_exchange=longest, spare=SPARE_SEGMENTS)
    setup.fixed.booked = grid.booked
    rows = row_of(grid.times.size - 1, grid.stride) + 1
    each = min(4 * live.line.length.size, 2 * most_segments(trial, model) + SPARE_NODES)
    recording = new_recording(rows, rows * each if tethered else 0, grid.times.size, live.state.size)
    return RunState(setup, live, recording, 0, 0, coupling.FINE)


def _further(now: RunState, grid: Grid, last: int) -> RunState:
    """Go on until `last` times are done, or it cannot go on."""
    behind, used, ending = run_rows(
        now.setup, now.live, now.recording, grid.times, now.behind, last, now.used, grid.parts, grid.stride
    )
    return now._replace(behind=behind, used=used, ending=ending)


def enlarged_run(live: Live, recording: Recording, used: int) -> tuple[Live, Recording]:
    """Return the same run with space for twice as many nodes."""
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
"""The names of the settings of a cable in a trial file."""
WENT_WELL, GIVEN_UP = "The run reached its end.", "The run took more iterations than it may."


def in_words(ending: int, time: float, setup: Setup, live: Live) -> str:
    """Return how a run ended: when, where, and the advice."""
    if ending == coupling.FINE:
        return WENT_WELL
    if ending == coupling.CABLE_FAILED:
        return describe_stop(time, live.line, setup.fixed.drum, setup.fixed.cable, NAMES)
    if ending == NO_SPACE:
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
