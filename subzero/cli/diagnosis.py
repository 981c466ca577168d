"""The commands ``diagnose``, ``calibrate`` and ``challenge``, and ``--with``: everything heavy is imported inside."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

import scenarios
from subzero.cli.interrupts import INTERRUPTED, patience, print_interrupted
from subzero.cli.output_mode import FINE, PLAIN, STOPPED, Flag, OutputMode
from subzero.cli.progress import progress_bar
from subzero.errors import UserError, printable

if TYPE_CHECKING:
    import xarray as xr

    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.hypothesis.effect import Effect
    from subzero.diagnosis.hypothesis.logged import Logged
    from subzero.diagnosis.results import Verdict
    from subzero.records.record import Record

LAST_WORDS_S = 60.0
"""Time that an interrupted diagnosis has to print and write its partial results. [s]"""

COSTS = (
    "What costs are the simulations of the trial. Try --screen, a shorter record, or a longer cable_step_s and "
    "segment_length_m in the scenario."
)
"""Advice that is printed when a diagnosis stands still."""

With = Annotated[Path | None, Parameter(name="--with")]
Own = Annotated[Path | None, Parameter(name="--effects")]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Search:
    """How it is searched.

    Attributes:
        seed: of everything random.
        screen: only the first look, in a few seconds.
        seconds: of processor time, after which the search is ended, and says so; 120 if not given.
    """

    seed: int = 0
    screen: Flag = False
    seconds: float | None = None


FULL_SEARCH = Search()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Estimation:
    """Settings of the estimation.

    Attributes:
        free: numbers to estimate, such as rudder.lift_slope; by default the twelve that records usually determine.
        quick: the numbers only, without profiles and without what to fly next.
    """

    free: Annotated[list[str] | None, Parameter(negative=(), consume_multiple=True)] = None
    quick: Flag = False


ALL_USUAL = Estimation()


def diagnose(
    files: Annotated[list[Path], Parameter(negative=())],
    /,
    *,
    scenario: str | None = None,
    out: Path = Path("found"),
    effects: Path | None = None,
    commands: Literal["record", "scenario"] | None = None,
    map: Path | None = None,
    search: Search = FULL_SEARCH,
    output_mode: OutputMode = PLAIN,
) -> int:
    """Find the errors of a simulation in measured records, name the cause, extend the model and measure the gain.

    Args:
        files: the scenario that was flown, a name (see "subzero list") or a TOML file; a record's sidecar may name it
            instead. And CSV files of one vehicle, or folders of them, which are explained together.
        scenario: the scenario, if it does not stand among the files.
        out: folder for the files.
        effects: Python file with causes of your own (EFFECTS = [...]), besides the catalogue.
        commands: whose commands hold if the record and the scenario differ.
        map: the files are logs as their loggers wrote them, with this map of "subzero import".
        search: how it is searched.
        output_mode: the form of the output.
    """
    from subzero.results.netcdf_csv import open_output_folder

    scenario, records = _sorted(files, scenario)
    if scenario is not None:
        scenarios.load(scenario)  # a mistake in it answers at once
    with open_output_folder(out) as output_folder:
        own = _own(effects)
        logged = _read(_with_map(records, map), scenario, commands)
        from subzero.cli import write_diagnosis

        with patience(LAST_WORDS_S):
            verdict = _ask(logged, own, search, output_mode)
            write_diagnosis.write_all(
                verdict, logged, output_folder, run=simulated, effects=own, effects_file=effects
            )
    write_diagnosis.print_diagnosis(
        verdict, output_folder, scenario=logged[0].setting.trial.source, output_mode=output_mode
    )
    if not verdict.complete:
        print_interrupted("Interrupted; what it has is written.")
    return FINE if verdict.complete else INTERRUPTED


def calibrate(
    records: Annotated[list[Path], Parameter(negative=())],
    /,
    *,
    scenario: str | None = None,
    vehicle: str | None = None,
    out: Path = Path("my_vehicle.toml"),
    commands: Literal["record", "scenario"] | None = None,
    map: Path | None = None,
    estimation: Estimation = ALL_USUAL,
    output_mode: OutputMode = PLAIN,
) -> int:
    """Estimate numbers of a vehicle from measured records, all at once, and write the vehicle they make.

    Args:
        records: CSV files of one vehicle, or folders of them; several manoeuvres say more than one.
        scenario: the scenario that was flown: a name (see "subzero list") or a path; a record's sidecar may name
            another.
        vehicle: name or file of the vehicle to begin with, instead of the scenario's.
        out: file of the calibrated vehicle; figures and a JSON file are written next to it.
        commands: whose commands hold if the record and the scenario differ.
        map: the files are logs as their loggers wrote them, with this map of "subzero import".
        estimation: settings of the estimation.
        output_mode: the form of the output.
    """
    from subzero.calibration.numbers import full_name
    from subzero.cli.write_calibration import files_of, print_calibration, write_all
    from subzero.files.atomic_output import open_output_folder

    names = files_of(out)
    wanted = [full_name(name) for name in estimation.free or ()]
    if scenario is not None:
        scenarios.load(scenario)  # a mistake in it answers at once
    with open_output_folder(out.parent, names) as output_folder:
        logged = _read(_with_map(records, map), scenario, commands)
        from subzero.calibration.api import calibrate as run

        with progress_bar("Calibrating", lambda: COSTS) as progress:
            found = run(logged, free=wanted, vehicle=vehicle, progress=progress, quick=estimation.quick)
        write_all(found, output_folder, out.stem)
    print_calibration(found, output_folder, out, output_mode=output_mode)
    return STOPPED if found.refused else FINE


def challenge(
    scenario: str = "fig6",
    *,
    seed: int = 0,
    out: Path = Path("hidden"),
    reveal: Path | None = None,
    output_mode: OutputMode = PLAIN,
) -> int:
    """Hide an effect in a record, to find it with "subzero diagnose"; --reveal shows it afterwards.

    Args:
        scenario: the scenario to fly: a name (see "subzero list") or a path.
        seed: draws the effect, its size, and every number within its tolerance.
        out: folder for the record.
        reveal: folder of a challenge, to show the effect hidden in it.
        output_mode: the form of the output.
    """
    if reveal is not None:
        from subzero.synthetic.sealed_answer import reveal as reported

        answer = reported(reveal)
        with output_mode.emit({"answer": answer}):
            print(answer)
        return FINE
    scenarios.load(scenario)
    from subzero.results.netcdf_csv import open_output_folder
    from subzero.synthetic.challenge import challenge as hide

    with open_output_folder(out) as output_folder, progress_bar("Hiding an effect"):
        hide(scenario, seed, output_folder.path)
    with output_mode.emit(output_folder.files()):
        print(output_folder.words())
        print(f"Find it: subzero diagnose {scenario} {out / 'record.csv'}")
        print(f"Reveal it: subzero challenge --reveal {out}")
    return FINE


def _with_map(files: list[Path], map: Path | None) -> Sequence[Path | Record]:
    """Return the records of logs that a map reads; without a map the files of records as they are."""
    if map is None:
        return files
    from subzero.logs.api import read_log

    return [read_log(file, map) for file in files]


def _sorted(files: list[Path], scenario: str | None) -> tuple[str | None, list[Path]]:
    """Return the scenario among the named files, and the records.

    A TOML file is a scenario, and so is the name of a shipped one together with a record, even if a folder here has
    that name: `subzero compare fig6` makes one. With --scenario, or alone, such a folder is one of records.
    """
    named = [file for file in files if file.suffix == ".toml"]
    if scenario is None and not named:
        named = [
            file for file in files if str(file) in scenarios.names() and (len(files) > 1 or not file.exists())
        ]
    if len(named) + (scenario is not None) > 1:
        every = [str(file) for file in named] + ([scenario] if scenario else [])
        raise UserError(f"One scenario is flown, and these are several: {', '.join(map(printable, every))}.")
    records = [file for file in files if file not in named]
    if not records:
        raise UserError(
            "There is no record to diagnose. Give the path of a CSV file, or of a folder of them."
        )
    return (str(named[0]) if named else scenario), records


def extended_run(
    trial: scenarios.Trial, path: Path | None, own: Path | None
) -> tuple[scenarios.Trial, dict[str, Any]]:
    """Return a trial and its simulation, as an extended model says (``--with``), and the user's own causes."""
    if path is None:
        if own is not None:
            raise UserError(
                "--effects says what an extended model is made of. Give the model too: --with FILE."
            )
        return trial, {}
    from subzero.diagnosis.hypothesis.catalogue import with_own
    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.hypothesis.hypotheses import apply_extended, unseen
    from subzero.diagnosis.report.toml_file import read_extended
    from subzero.model import Model

    found = read_extended(path, with_own(_own(own), Model.of(trial).vehicle))
    setting = apply_extended(found.extended, Setting(trial=trial, model=Model.of(trial)), found.effects)
    hidden = unseen(found.extended, found.effects)
    if hidden:
        print(
            f"A run shows what is, not what sensors show, so it is without {', '.join(hidden)}.",
            file=sys.stderr,
        )
    words = f"{trial.description}, with {path}"
    return dataclasses.replace(setting.trial, description=words), {
        "model": setting.model,
        "later": setting.later,
    }


def _own(path: Path | None) -> tuple[Effect, ...]:
    """Return the user's own causes."""
    if path is None:
        return ()
    from subzero.diagnosis.hypothesis.catalogue import load

    return load(path)


def _read(paths: Sequence[Path | Record], scenario: str | None, commands: str | None) -> list[Logged]:
    """Read the records; the compiler is needed to see whether their units are plausible."""
    from subzero.diagnosis.read_trials import read_trials

    with progress_bar("Reading"):
        return read_trials(paths, scenario=scenario, commands=commands)


def simulated(setting: Setting) -> xr.Dataset:
    """Return the run of the vehicle in a setting, with the steps that the diagnosis took."""
    from subzero.simulation.run import simulate

    every = setting.trial.every or setting.trial.cable_step  # all of them, however long the record is
    trial = dataclasses.replace(setting.trial, rtol=0.0, every=every)
    return simulate(trial, tethered=setting.tethered, model=setting.model, later=setting.later)


def _ask(logged: list[Logged], own: tuple[Effect, ...], search: Search, output_mode: OutputMode) -> Verdict:
    """Diagnose under a progress bar; an interrupt ends it with its partial results, if it has any."""
    from subzero.cli.write_diagnosis import print_plan
    from subzero.diagnosis.api import diagnose_trials

    seen = None if output_mode.as_json or output_mode.quiet else print_plan
    with progress_bar("Diagnosing", lambda: COSTS) as progress:
        return diagnose_trials(
            logged,
            effects=own,
            progress=progress,
            seed=search.seed,
            budget="screen" if search.screen else "full",
            seen=seen,
            seconds=search.seconds,
        )
