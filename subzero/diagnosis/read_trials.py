"""From files to the input of a diagnosis: measured records, each with the trial that it belongs to.

A record is a CSV file of `subzero.records.record`, with or without columns of commands and a file of metadata. All
problems of it are reported before any long computation, in one message for a record.

A comparison (`check_epoch`, `check_against_runs`) requires less: the epoch, the units and the signs, but neither a
length nor a sampling rate. It has its simulation anyway, so these checks cost nothing.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import scenarios
from scenarios.heading import turned
from subzero.arguments import checked_arguments
from subzero.channels import BY_NAME, HEADING
from subzero.diagnosis.hypothesis.catalogue.sensors import NOISE, SPECS
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.errors import UserError, listed
from subzero.model import Model, load
from subzero.records.consistency import (
    FROM_RECORD,
    REPORTED_COMMANDS,
    cut_to,
    epoch_problems,
    is_constant,
    repeating,
    stuck,
    time_problems,
    trial_with_commands,
    unit_questions,
    without_repeats,
)
from subzero.records.metadata import Metadata, read_metadata
from subzero.records.record import Record, fits, measured_alone, modelled, read_record, with_heading_of

if TYPE_CHECKING:
    import xarray as xr

Simulated = Callable[[Setting, np.ndarray, Sequence[str]], Mapping[str, np.ndarray]]
"""(setting, times, channels) → channel → readings of the sensors."""


@checked_arguments
def read_trials(
    paths: Sequence[str | Path | Record] | str | Path | Record,
    *,
    scenario: str | Path | None = None,
    commands: str | None = None,
    simulated: Simulated | None = None,
) -> list[Logged]:
    """Read measured records, each with the trial it belongs to.

    Args:
        paths: CSV files, folders of them, or records in memory.
        scenario: the trial of every record whose sidecar does not name one.
        commands: "record" or "scenario", if a record's commands may differ from the scenario's.
        simulated: the nominal simulation; `subzero.diagnosis.inference.simulator.respond` if None.

    Raises:
        UserError: a record, or its sidecar, cannot be used.
        scenarios.ScenarioError: a scenario cannot be used.
    """
    given = [paths] if isinstance(paths, str | Path | Record) else paths
    files = _files([each for each in given if not isinstance(each, Record)])
    in_hand = [each for each in given if isinstance(each, Record)]
    names = [*_names(files), *(_name_in_hand(at, len(in_hand)) for at in range(len(in_hand)))]
    sidecars = [*(read_metadata(file.with_suffix(".toml")) for file in files), *(Metadata() for _ in in_hand)]
    records = [*map(read_record, files), *map(measured_alone, in_hand)]
    logged = [
        _logged(record, sidecar, name, scenario, commands)
        for record, sidecar, name in zip(records, sidecars, names, strict=True)
    ]
    return [_checked(trial, sidecar, simulated) for trial, sidecar in zip(logged, sidecars, strict=True)]


def _name_in_hand(at: int, count: int) -> str:
    """Return the short name of a record that is not from a file."""
    return "record" if count == 1 else f"record {at + 1}"


def _files(paths: Sequence[str | Path]) -> list[Path]:
    """Return the files, those of a folder in alphabetical order."""
    files: list[Path] = []
    for path in map(Path, paths):
        inside = sorted(path.glob("*.csv")) if path.is_dir() else [path]
        if not inside:
            raise UserError(f"The folder {path} holds no measured record. Put CSV files into it.")
        files += inside
    return list(dict.fromkeys(files))


def _names(files: Sequence[Path]) -> list[str]:
    """Return a short name for each file, different from the others'."""
    stems = [file.stem for file in files]
    return [
        stem if stems.count(stem) == 1 else f"{file.parent.name or '.'}/{stem}"
        for file, stem in zip(files, stems, strict=True)
    ]


def _logged(
    record: Record, sidecar: Metadata, name: str, scenario: str | Path | None, commands: str | None
) -> Logged:
    """Return one record with its trial, which is cut to its length."""
    named = sidecar.scenario or scenario
    if not named:
        raise UserError(
            f"Which trial is {record.source}? Give --scenario, or scenario = '…' in {Path(record.source).stem}.toml "
            "beside it."
        )
    trial = load(named)
    _refuse(record.source, time_problems(record, trial, longer=commands == FROM_RECORD))
    trial = _with_some_commands(cut_to(trial_with_commands(trial, record, commands), record))
    values, notes = _channels(record, sidecar)
    if scenario and sidecar.scenario and str(scenario) != sidecar.scenario:
        notes += (f"Its sidecar names the trial {sidecar.scenario}, so {scenario} is not taken for it.",)
    if HEADING in values:
        values[HEADING] = turned(values[HEADING], math.degrees(trial.start.heading))
    setting = Setting(
        trial=trial, model=Model.of(trial), tethered=sidecar.tethered, intervals=record.intervals
    )
    return Logged(
        record=dataclasses.replace(record, values=values),
        setting=setting,
        noise={channel: sd for channel, sd in sidecar.noise.items() if channel in values},
        name=name,
        notes=notes,
    )


def _with_some_commands(trial: scenarios.Trial) -> scenarios.Trial:
    """Return a trial that keeps a station with commands of zero added: its thrusters are commanded by the station,
    in the simulation of each hypothesis anew, and nothing else is.
    """
    if trial.commands is not None or trial.station is None:
        return trial
    nothing = scenarios.Commands(time=np.zeros(1), values=np.zeros((1, len(REPORTED_COMMANDS))))
    return dataclasses.replace(trial, commands=nothing)


def _channels(record: Record, sidecar: Metadata) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Return the channels that can be diagnosed, and notes on those that were left out."""
    values = {channel: column for channel, column in record.values.items() if channel in SPECS}
    others = [
        channel for channel in record.values if channel not in SPECS and channel not in REPORTED_COMMANDS
    ]
    notes: tuple[str, ...] = (f"Not used, for no sensor shows it: {_columns(others)}.",) if others else ()
    if sidecar.over_ground and "surge_speed" in values:
        if "speed_over_ground" in values:
            raise UserError(
                f"{record.source} has speed_over_ground_m_s and a surge_speed_m_s that its sidecar calls over ground: "
                "keep one of them."
            )
        values["speed_over_ground"] = np.abs(values.pop("surge_speed"))
        notes += ("The surge speed is over ground, so it is read as the speed over ground.",)
    if not values:
        raise UserError(
            f"{record.source} has no channel that can be diagnosed. Add one of: {_columns(SPECS)}."
        )
    rates = sidecar.rate
    return {
        name: without_repeats(record.time, value, rates.get(name)) for name, value in values.items()
    }, notes


def _checked(logged: Logged, sidecar: Metadata, simulated: Simulated | None) -> Logged:
    """Return a record after checks that its channels look like its trial."""
    nominal = (simulated or _nominal())(logged.setting, logged.record.time, tuple(logged.record.values))
    record = with_heading_of(logged.record, nominal.get(HEADING))
    values = record.values
    noise = {channel: logged.noise.get(channel, NOISE[channel]) for channel in values}
    suspects = {channel: column for channel, column in values.items() if not sidecar.trusts(channel)}
    still = [channel for channel, column in suspects.items() if is_constant(column)]
    _refuse(record.source, stuck(suspects, nominal, noise))
    kept = {channel: column for channel, column in values.items() if channel not in still}
    if not kept:
        raise UserError(f"{record.source}: no channel moves. A diagnosis needs one that the trial moves.")
    asked = unit_questions({name: each for name, each in kept.items() if name in suspects}, nominal, noise)
    notes = (*logged.notes, *record.notes, *_notes(still, repeating(kept)), *(f"{words}." for words in asked))
    trusted = frozenset(kept) - frozenset(suspects)
    return dataclasses.replace(
        logged, record=dataclasses.replace(record, values=kept), notes=notes, trusted=trusted
    )


def _nominal() -> Simulated:
    """Return the simulation itself; the compiler is imported only here."""
    from subzero.diagnosis.inference.simulator import respond

    return respond


def _notes(still: Sequence[str], held: Sequence[str]) -> list[str]:
    """Return notes on channels that are left out, or that are hard to judge."""
    notes = [f"Left out, for it never changes: {_columns(still)}."] if still else []
    if held:
        notes.append(
            f"Most samples repeat the one before: {_columns(held)}. If the sensor is slower than the record, give its "
            "rate under [rate_hz] in the sidecar."
        )
    return notes


def _columns(channels: Sequence[str] | Mapping[str, object]) -> str:
    return ", ".join(BY_NAME[channel].column for channel in channels)


def _refuse(path: str, problems: list[str]) -> None:
    if problems:
        raise UserError(listed(f"The measured record {path} cannot be diagnosed:", problems))


def check_epoch(record: Record, trial: scenarios.Trial) -> Metadata:
    """Check before a simulation that a record was measured in its trial, and return its sidecar.

    Raises:
        UserError: it was not, or the sidecar cannot be used.
    """
    _refuse_times(record, epoch_problems(record, trial))
    path = Path(record.source)
    return read_metadata(path.with_suffix(".toml")) if path.suffix.lower() == ".csv" else Metadata()


def check_against_runs(record: Record, runs: Mapping[str, xr.Dataset], sidecar: Metadata) -> None:
    """Check that a record looks like one of the runs of its trial, the tethered one first.

    Raises:
        UserError: no sample can be compared, or a channel looks like another unit, another sign, or a stuck sensor.
    """
    if not any(each.samples for by_run in fits(dict(runs), record).values() for each in by_run.values()):
        _refuse_times(record, ["none of its samples can be compared: where the runs are, it has gaps"])
    suspects = {
        name: values for name, values in record.values.items() if name in NOISE and not sidecar.trusts(name)
    }
    found: list[list[str]] = []
    for run in runs.values():
        simulated = {name: modelled(run, name, record.time) for name in suspects}
        known = {name: values for name, values in suspects.items() if _overlaps(values, simulated[name])}
        found.append(stuck(known, simulated, NOISE) + unit_questions(known, simulated, NOISE))
    # A cable changes sizes, never units: a record that fits the simulation without one is in the right unit, too.
    _refuse_times(record, min(found, key=len, default=[]))


def _overlaps(measured: np.ndarray, simulated: np.ndarray) -> bool:
    return bool(np.isfinite(measured + simulated).any())


def _refuse_times(record: Record, problems: list[str]) -> None:
    if problems:
        raise UserError(listed(f"The measured record {record.source} cannot be compared:", problems))
