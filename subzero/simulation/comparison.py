"""Comparison of a run with another: the same trial without its cable and a measured record, or computed more finely.

`compare` simulates a trial with its cable and without, and compares both with a record.

`check` says how much a run changes with half the steps and half the segment length: half of what the run was taken
with, which is finer than its trial says where its `rtol` asked for it. What the halves change is about as large as the
error that is left, for a scheme of first order, and three times as large for one of second order: a measure of the
numbers, not of the physics, and no proof: both may miss the same.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

import scenarios
from subzero.arguments import checked_arguments
from subzero.channels import BY_NAME, CHANNELS, ENERGY_CHANNELS, HEADING, UNITS
from subzero.engine.initial_conditions import Later
from subzero.errors import UserError
from subzero.files.text_repr import Overview, shown
from subzero.model import Model, load, model_of
from subzero.records.record import Fit, Record, fits, measured_alone, modelled, read_record, with_heading_of
from subzero.results.summary import FORCE, MOMENT, summarise, summary_of
from subzero.simulation.memory_estimate import THINNED, thinning_notice, with_fewer_results
from subzero.simulation.refinement import Progress, part_of
from subzero.simulation.run import simulate
from subzero.validity import RunWarning, as_json, warnings_of

if TYPE_CHECKING:
    from subzero.simulation.checkpoint import Checkpoint

SHOWN = {
    "peak_speed_m_s": "m/s",
    "speed_at_end_m_s": "m/s",
    "heading_at_end_deg": "degree",
    "path_length_m": "m",
    "cable_length_at_end_m": "m",
    "largest_cable_force_N": "N",
}
"""Key of a summary that is shown of both runs → its unit."""


@shown
@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A trial, simulated with its cable and without.

    Args:
        tethered: the run with the cable.
        untethered: the same commands, the same code, no cable.
        trial: the trial that was simulated.
        measured: the measured record of that trial, if there is one.
    """

    tethered: xr.Dataset
    untethered: xr.Dataset
    trial: scenarios.Trial
    measured: Record | None = None

    def _overview(self) -> Overview:
        """Return the numbers that one reads first, one column a run."""
        both = [summarise(run) for run in self.runs.values()]
        rows: list[tuple[str, ...]] = [("", *self.runs)]
        for key, unit in SHOWN.items():
            words = key.removesuffix(f"_{UNITS[unit][0]}").replace("_", " ")
            rows.append((words, *("–" if each[key] is None else f"{each[key]:.4g} {unit}" for each in both)))
        rows.append(("warnings", *(str(len(each["warnings"])) for each in both)))
        if self.measured is not None:
            rows.append(("measured", f"{', '.join(self.measured.values)} ({self.measured.source})"))
        return Overview(f"{self.trial.name}: {self.trial.description}", rows)

    @property
    def runs(self) -> dict[str, xr.Dataset]:
        """The two runs by name, the tethered one first."""
        return {"tethered": self.tethered, "untethered": self.untethered}

    def fits(self) -> dict[str, dict[str, Fit]]:
        """Return channel → run → how well that run explains the measurements."""
        return {} if self.measured is None else fits(self.runs, self.measured)

    def summary(self) -> dict[str, Any]:
        """Return the comparison in plain numbers and texts, ready for JSON; keys carry their units."""
        return summary_of(self.runs, self.measured)


@checked_arguments
def compare(
    scenario: str | Path | scenarios.Trial,
    *,
    measured: str | Path | Record | None = None,
    model: Model | None = None,
    later: Later = (),
    every: float | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Simulate a trial with its cable and without.

    Args:
        scenario: name of a shipped scenario, path of a scenario file, or a trial.
        measured: a measured record or the path of one, to compare with both runs.
        model: another model than the one that the scenario describes.
        later: times of results [s] and the model that holds from each of them on.
        every: time between results that are kept, as of `simulate`; a measured record is compared with all of them.
            [s]
        checkpoint: keeps where both runs stand, as of `simulate`.
        progress: called with the fraction that is done, from 0 to 1, over both runs.

    Raises:
        scenarios.ScenarioError: if the scenario cannot be used.
        UserError: if the measured record cannot be used, or does not look like this trial.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    trial = trial if every is None else dataclasses.replace(trial, every=every)
    record = (
        read_record(measured) if isinstance(measured, str | Path) else measured and measured_alone(measured)
    )
    if record is not None and trial.stride > 1:
        raise UserError(
            f"Every {trial.every:g} s is too seldom to set a measured record beside the results of '{trial.name}'. "
            "Leave out every_s (--every)."
        )
    sidecar = _checked(record, trial)
    asked, trial = trial, _same_rows(trial, model, record)
    given = {"model": model, "later": later, "checkpoint": checkpoint}
    other: dict[str, Any] = {name: value for name, value in given.items() if value}
    tethered = simulate(trial, tethered=True, **other, progress=part_of(progress, 0.0, 0.5))
    untethered = simulate(trial, tethered=False, **other, progress=part_of(progress, 0.5, 1.0))
    if trial is not asked and record is None:
        for run in (tethered, untethered):
            run.attrs[THINNED] = thinning_notice(trial)
    if record is not None:
        record = with_heading_of(record, modelled(tethered, HEADING, record.time))
        from subzero.diagnosis.read_trials import check_against_runs

        check_against_runs(record, {"tethered": tethered, "untethered": untethered}, sidecar)
    return Comparison(tethered=tethered, untethered=untethered, trial=trial, measured=record)


def _same_rows(trial: scenarios.Trial, model: Model | None, record: Record | None) -> scenarios.Trial:
    """Return a trial that keeps as many results of both runs, of a long one, too: all of them with a record."""
    kept = with_fewer_results(trial, model_of(trial, model), True)
    return kept if record is None or kept is trial else dataclasses.replace(trial, every=trial.cable_step)


def _checked(record: Record | None, trial: scenarios.Trial) -> Any:
    """Check before the runs that a record belongs to them; return its sidecar, None if there is no record."""
    if record is None:
        return None
    from subzero.diagnosis.read_trials import check_epoch

    return check_epoch(record, trial)


HALVED = ("cable_step", "hull_step", "segment_length", "grading", "far_grading")
"""Fields of a trial that the finer run has half as large."""
TOW_FORCE = "tow_force"
"""Row of the table for the force of the cable as a vector, in addition to the channels."""
MOST = 0.01
"""A tow force that changes by more than this share of its largest value is warned of. [-]"""
VECTORS = (
    FORCE,
    MOMENT,
    ("surge_speed", "sway_speed", "heave_speed"),
    ("roll_rate", "pitch_rate", "yaw_rate"),
    ("tow_velocity_tangential", "tow_velocity_normal", "tow_velocity_binormal"),
    ENERGY_CHANNELS,
)
"""Channels that are parts of one thing: each is held against the largest of them, for a change of a part that hardly
matters is none of the whole."""
NOTHING, NOTHING_OF = 1e-6, {"degree": 1e-4, "degree/s": 1e-4, "N m": 1e-7}
"""A channel that never gets larger than this, or what its unit has instead, is zero: a share of it means nothing."""


@dataclass(frozen=True, kw_only=True)
class Refinement:
    """A run compared with one with half the steps and half the segment length.

    Attributes:
        run: at the trial's own steps.
        finer: with half of them.
        table: by channel, worst first: `change` [-], the largest change of the channel as a share of its largest value,
            or that of the largest part of its vector (`VECTORS`); `difference` and `largest`, both in the unit of the
            channel; `time` of the largest change [s]; `unit`.
    """

    run: xr.Dataset
    finer: xr.Dataset
    table: xr.Dataset

    @property
    def worst(self) -> tuple[str, float]:
        """The channel that changes most, and by which share of its largest value."""
        return str(self.table["channel"].values[0]), float(self.table["change"].values[0])

    @property
    def tow_force(self) -> float:
        """By which share of its largest value the tow force changes, at most; 0 without a cable."""
        rows = dict(
            zip(self.table["channel"].values.tolist(), self.table["change"].values.tolist(), strict=True)
        )
        return float(rows.get(TOW_FORCE, 0.0))

    @property
    def warnings(self) -> tuple[RunWarning, ...]:
        """The meaning of the change for the run."""
        if self.finer.attrs["outcome"] != self.run.attrs["outcome"]:
            words = f"With half the steps and segments the run is {self.finer.attrs['outcome']}, and not "
            return (RunWarning("refinement", f"{words}{self.run.attrs['outcome']}: neither can be trusted."),)
        if self.tow_force <= MOST:
            return ()
        row = self.table.sel(channel=TOW_FORCE)
        return (
            RunWarning(
                "refinement",
                f"With half the steps and segments the tow force changes by {100.0 * self.tow_force:.3g} % of its "
                f"largest value ({float(row['difference']):.3g} N at {float(row['time']):g} s): the numbers are no "
                "better than that. Halve cable_step_s, hull_step_s and segment_length_m until it changes no more.",
            ),
        )

    def summary(self) -> dict[str, Any]:
        """Return the table in plain numbers, ready for JSON: channel → change, difference, largest, time_s, unit."""
        rows = self.table.to_dataframe().rename(columns={"time": "time_s"})
        return {str(name): row.to_dict() for name, row in rows.iterrows()}

    def marked_run(self) -> xr.Dataset:
        """Return the run with this table and its warnings in the attributes."""
        warnings = as_json([*warnings_of(self.run), *self.warnings])
        return self.run.assign_attrs(refinement=json.dumps(self.summary()), warnings=warnings)

    def __repr__(self) -> str:
        """Show the table, ten channels of it."""
        lines = [f"{name:32s} {100.0 * row['change']:9.3g} %" for name, row in self.summary().items()]
        head = f"Refinement of '{self.run.attrs['scenario']}': change by half the steps and segments"
        return "\n".join([head, *lines[:10], *(["…"] if len(lines) > 10 else [])])


@checked_arguments
def check(
    scenario: str | Path | scenarios.Trial,
    model: Model | None = None,
    *,
    tethered: bool = True,
    later: Later = (),
    progress: Progress | None = None,
) -> Refinement:
    """Run a trial at its own steps and with half of them, and return the changes.

    Args:
        scenario: name of a shipped scenario, path of a scenario file, or a trial.
        model: another model than the one that the scenario describes.
        tethered: with the cable.
        later: times of results [s] and the model that holds from each of them on.
        progress: called with the fraction that is done, 0 to 1.

    Raises:
        scenarios.ScenarioError: the scenario cannot be used, or half its steps are below their limits.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    run = simulate(trial, tethered=tethered, model=model, later=later, progress=part_of(progress, 0.0, 0.2))
    return refine(run, trial, model, later=later, progress=part_of(progress, 0.2, 1.0))


def refine(
    run: xr.Dataset,
    trial: scenarios.Trial,
    model: Model | None = None,
    *,
    later: Later = (),
    progress: Progress | None = None,
) -> Refinement:
    """Compare a run of a trial with a finer one; arguments as `check`."""
    other: dict[str, Any] = {"model": model, "later": later} if model or later else {}
    halvings = json.loads(run.attrs.get("accuracy", "{}")).get("halvings", 0)
    if THINNED in run.attrs:
        trial = with_fewer_results(trial, model_of(trial, model), bool(run.attrs["tethered"]))
    finer = simulate(
        halved(trial, halvings + 1), tethered=bool(run.attrs["tethered"]), **other, progress=progress
    )
    return Refinement(run=run, finer=finer, table=table_of(run, finer))


def halved(trial: scenarios.Trial, times: int = 1) -> scenarios.Trial:
    """Return a trial with steps and segments halved so many times, taken as they are."""
    finer = {name: 0.5**times * getattr(trial, name) for name in HALVED}
    return dataclasses.replace(trial, rtol=0.0, **finer)


def table_of(run: xr.Dataset, finer: xr.Dataset) -> xr.Dataset:
    """Return the largest change of every channel between two runs, worst first; see `Refinement.table`.

    Compared at the times of the first run that both reach; commands and channels that remain zero are left out.
    """
    names: dict[str, tuple[str, ...]] = {
        c.name: (c.name,) for c in CHANNELS if not c.name.endswith("_command")
    }
    if run.attrs["tethered"]:
        names[TOW_FORCE] = FORCE
    rows = (_row(name, parts, run, finer) for name, parts in names.items())
    known = sorted((row for row in rows if row is not None), key=lambda row: -row["change"])
    keys = ("change", "difference", "largest", "time", "unit")
    data = {key: ("channel", [row[key] for row in known]) for key in keys}
    return xr.Dataset(data, coords={"channel": [row["channel"] for row in known]})


def _row(name: str, parts: tuple[str, ...], run: xr.Dataset, finer: xr.Dataset) -> dict[str, Any] | None:
    """Return the row of a channel, or of a vector with these parts; None if it remains zero or is unknown."""
    time, there = run["time"].values, finer["time"].values
    time = time[time <= there[-1] + 1e-9]
    ours = np.array([run[part].values[: time.size] for part in parts])
    theirs = np.array([np.interp(time, there, finer[part].values) for part in parts])
    difference, unit = np.linalg.norm(ours - theirs, axis=0), BY_NAME[parts[0]].unit
    if name == TOW_FORCE:
        largest = float(np.linalg.norm(theirs, axis=0).max())
    else:
        whole = next((vector for vector in VECTORS if name in vector), parts)
        largest = max(float(np.abs(finer[part].values).max()) for part in whole)
    if not np.isfinite(difference).all() or not largest >= NOTHING_OF.get(unit, NOTHING):
        return None
    worst = int(difference.argmax())
    change = float(difference[worst])
    row = {"channel": name, "change": change / largest, "difference": change, "largest": largest}
    return {**row, "time": float(time[worst]), "unit": unit}
