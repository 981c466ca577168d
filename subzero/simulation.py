"""Run a trial, from a checked scenario to a labelled result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import scenarios
import vehicle
from cable.element import new_load
from cable.line import enlarged, lay_straight, new_line, set_momenta
from cable.newton import Solved
from cable.pull_out import START_LENGTH, describe_failure
from subzero import coupling
from subzero.compiled import packed
from subzero.hull import pose, tow_point
from subzero.loop import NO_ROOM, SPARE, run_rows
from subzero.model import Model
from subzero.recording import Recording, new_recording, record_row
from subzero.run_state import Fixed, Live, Orders, Setup, Track, new_now
from subzero.trials import load

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[float], None]
"""Called now and then with the fraction that is done, 0 to 1."""

CHUNKS = 50
"""How often a run comes up for air, to move the progress bar."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """A finished run in plain arrays: `rows` rows of a recording at `times`, and how it ended in words."""

    times: np.ndarray
    recording: Recording
    completed: bool
    message: str


def simulate(
    scenario: str | Path | scenarios.Trial,
    *,
    tethered: bool = True,
    model: Model | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate a trial and return its labelled result.

    Args:
        scenario: name of a shipped scenario, path of a scenario file, or a trial.
        tethered: with the cable; the same code runs without.
        model: another model than the one that the scenario describes.
        progress: told the fraction that is done.

    Returns:
        one variable per channel of `subzero.channels`, the force breakdown, the cable's shape and tensions; units on
        every variable; scenario, parameters, versions and outcome as attributes. Look at ``attrs["outcome"]``: a run
        that could not go on keeps what it has.

    Raises:
        scenarios.ScenarioError: the scenario cannot be used.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    model = model or Model.of(trial)
    from subzero.dataset import dataset_of

    return dataset_of(trial, model, tethered, run_trial(trial, model, tethered, progress))


def run_trial(trial: scenarios.Trial, model: Model, tethered: bool, progress: Progress | None = None) -> Run:
    """Run a trial with a model, in plain arrays."""
    if tethered and trial.scheme != "moving_end":
        from subzero.printed import run_as_printed

        return run_as_printed(trial, model, progress)
    times = np.linspace(0.0, trial.duration, round(trial.duration / trial.cable_step) + 1)
    setup, live = prepare(trial, model, tethered)
    recording = new_recording(times.size, 4 * times.size * live.line.length.size if tethered else 0)
    used = record_row(setup, live, recording, 0, 0.0, 0)
    row, ending, solved = 1, coupling.FINE, Solved(True, 0, 0.0, 0, 0)
    while row < times.size and ending in (coupling.FINE, NO_ROOM):
        last = min(times.size, row + 1 + times.size // CHUNKS)
        row, used, ending, solved = run_rows(setup, live, recording, times, row, last, used)
        if ending == NO_ROOM:
            live, recording = _more_room(live, recording, used)
        if progress is not None:
            progress(row / times.size)
    return Run(
        times=times[:row],
        recording=cut(recording, row, used),
        completed=ending == coupling.FINE,
        message=_in_words(ending, solved, float(times[row - 1])),
    )


def prepare(trial: scenarios.Trial, model: Model, tethered: bool) -> tuple[Setup, Live]:
    """Return what stays and what changes in a run, at its start: the cable laid straight behind the vehicle."""
    state, R, tow = _first_state(trial), np.zeros((3, 3)), np.zeros(3)
    fixed, wet = _fixed(trial, model, tethered), max(trial.start.wet_length, START_LENGTH)
    tow_point(state, fixed.r_c, R, tow)
    ahead, speed = R[:, 0].copy(), float(state[7])
    fixed.drum_place[:] = tow - wet * ahead
    line, load = new_line(int(wet / trial.segment_length) + 2 * SPARE), new_load()
    lay_straight(line, wet, ahead, speed, trial.segment_length, fixed.cable)
    set_momenta(line, fixed.current, fixed.cable, load)
    pull = -fixed.cable.tangential_drag * speed * abs(speed) * wet * tethered
    now = new_now(state, pull * ahead)
    now.ledger.kinetic = vehicle.kinetic_energy(state, fixed.current, fixed.vehicle)
    steps = int(np.ceil(trial.cable_step / trial.hull_step - 1e-6))
    live = Live(now=now, path=np.zeros((steps + 1, vehicle.STATE_SIZE)), line=line, load=load)
    return Setup(fixed=fixed, orders=_orders(trial), track=_track(trial)), live


def _fixed(trial: scenarios.Trial, model: Model, tethered: bool) -> Fixed:
    """Return the numbers of a run; the drum's place is still to be filled in."""
    fixed = Fixed(
        vehicle=model.vehicle.numbers(),
        cable=model.cable.numbers(),
        drum=model.drum.numbers(),
        current=np.array(model.current, dtype=float),
        r_c=model.vehicle.tow_point.position(),
        drum_place=np.zeros(3),
        hull_step=trial.hull_step,
        segment_length=trial.segment_length,
        tethered=tethered,
        prescribed=trial.motion is not None,
    )
    return packed(fixed)


def _first_state(trial: scenarios.Trial) -> np.ndarray:
    """Return the vehicle's state at t = 0."""
    start = trial.start
    state = vehicle.initial_state(
        depth=start.depth,
        roll=start.roll,
        pitch=start.pitch,
        heading=start.heading,
        velocity=(start.surge_speed, 0.0, 0.0, 0.0, 0.0, 0.0),
    )
    if trial.motion is not None:
        pose(_track(trial), 0.0, state)
    return state


def _orders(trial: scenarios.Trial) -> Orders:
    """Return the commands, none for a prescribed motion."""
    if trial.commands is None:
        return Orders(np.zeros(1), np.zeros((1, 4)))
    return Orders(np.array(trial.commands.time, dtype=float), np.array(trial.commands.values, dtype=float))


def _track(trial: scenarios.Trial) -> Track:
    """Return the prescribed motion, of one resting sample for a run with commands."""
    motion = trial.motion
    if motion is None:
        return Track(np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1))
    columns = (motion.time, motion.surge_speed, motion.pitch, motion.heading)
    return Track(*(np.array(column, dtype=float) for column in columns))


def _more_room(live: Live, recording: Recording, used: int) -> tuple[Live, Recording]:
    """Return the same run with twice the room for nodes."""
    capacity = 2 * live.line.length.size
    nodes = 2 * max(recording.tension.size, used + 64 * capacity)
    position, tension = np.zeros((nodes, 3)), np.zeros(nodes)
    position[:used], tension[:used] = recording.position[:used], recording.tension[:used]
    return live._replace(line=enlarged(live.line, capacity)), recording._replace(
        position=position, tension=tension
    )


def cut(recording: Recording, rows: int, used: int) -> Recording:
    """Return the part of a recording that is filled."""
    packed = {"position": recording.position[:used], "tension": recording.tension[:used]}
    by_row = {name: values[:rows] for name, values in recording._asdict().items() if name not in packed}
    return Recording(**by_row | packed)


def _in_words(ending: int, solved: Solved, time: float) -> str:
    """Say how a run ended: when, where, and what to try."""
    if ending == coupling.FINE:
        return "The run reached its end."
    if ending == coupling.CABLE_FAILED:
        return describe_failure(solved, time)
    if ending == coupling.DISAGREED:
        return (
            f"Vehicle and cable found no common tow force beyond t = {time:g} s, even in the smallest steps. "
            "Try a shorter cable_step_s and hull_step_s."
        )
    return (
        f"The vehicle's speed beyond t = {time:g} s is absurd (more than {coupling.FASTEST:g} m/s, or not a number). "
        "Look at the commands and the vehicle's numbers, or try a shorter hull_step_s."
    )
