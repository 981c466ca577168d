"""The command line: ``subzero simulate``, ``compare``, ``plot``, ``explore``; ``list``, ``new``, ``show``, ``validate``
(`trials`); ``manoeuvre``, ``autopilot`` (`autopilot`); ``import`` (`import_log`);
``export-fmu``, ``import-line`` (`cables`);
``diagnose``, ``calibrate``,
``challenge`` (`diagnosis`); ``sweep`` (`sweep`); ``doctor``, ``warm``, ``completion`` (`install`).

Exit codes: 0 all is well; 2 the user has to change something (one clean message on standard error,
nothing is written); 3 a run could not go on (what it has is written, the message says when, where and
what to try), or ends with warnings under --strict (all is written); 130 it was interrupted
(`subzero.cli.interrupts`). A bug of ours keeps its traceback. Everything heavy (numba, xarray, matplotlib, pydantic)
is imported inside the commands, after the request has been checked, so that help and mistakes answer at once.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Literal

import cyclopts
from cyclopts import Parameter

import scenarios
from subzero.cli import EXAMPLES, autopilot, cables, diagnosis, import_log, install, sweep, trials
from subzero.cli.interrupts import INTERRUPTED, print_interrupted, reset, was_interrupted
from subzero.cli.output_mode import (
    COMMAND,
    FINE,
    MISTAKE,
    NOT_STRICT,
    OUTPUT_MODE,
    PLAIN,
    STOPPED,
    Flag,
    OutputMode,
    StrictOutputMode,
)
from subzero.errors import DISTRIBUTION, UserError, nearest, printable

if TYPE_CHECKING:
    import xarray as xr

    from subzero.cli.progress import ProgressBar
    from subzero.records.record import Record

    Runs = dict[str, xr.Dataset]

Export = Annotated[tuple[str, ...], Parameter(negative=())]
OPTION_LIKENESS = 0.6
"""An option that is less like an unknown one was not meant by it, on `difflib`'s scale from 0 to 1."""


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Outputs:
    """Which files are made, and how.

    Attributes:
        check: run it once more with half the steps and half the segment length, and say what changes.
        export: further files, for other programs: mcap, mat, parquet or cf; more than one may be given.
        width: of the figures in inches: 7.2 for two columns of a journal page, 3.4 for one.
        figures: png, svg or pdf.
        animate: film the replay of report.html as a gif or an mp4; needs Chromium and the extra [animate].
    """

    check: Flag = False
    export: Export = ()
    width: float | None = None
    figures: Literal["png", "svg", "pdf"] = "png"
    animate: Literal["gif", "mp4"] | None = None

    def refuse_impossible(self) -> None:
        """Raise an error for outputs that cannot be made, before anything is simulated."""
        from subzero.cli.write_results import check_pictures

        if self.export:
            from subzero.results.export import writer_of

            for kind in self.export:
                writer_of(kind)
        check_pictures(self.width, self.animate)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Inputs:
    """Inputs of the simulation besides the scenario.

    Attributes:
        with_: extended model that a diagnosis has written (extended.toml).
        effects: Python file with causes of your own that the extended model names; it is run.
        commands: CSV file of commands, instead of those of the scenario.
        motion: CSV file of the vehicle's measured states, such as a run's own tethered.csv, which it then follows.
    """

    with_: diagnosis.With = None
    effects: diagnosis.Own = None
    commands: Path | None = None
    motion: Path | None = None

    def read(self, scenario: str) -> scenarios.Trial:
        """Read the trial, without the vehicle's own check."""
        return scenarios.load(scenario, commands_csv=self.commands, motion_csv=self.motion)

    def checked(self, scenario: str) -> tuple[scenarios.Trial, dict[str, Any]]:
        """Read the trial again with the vehicle's own check, which needs the compiler and so comes late.

        Returns:
            the trial, and the extended model as arguments of a run.
        """
        from subzero.model import load

        trial = load(scenario, commands_csv=self.commands, motion_csv=self.motion)
        return diagnosis.extended_run(trial, self.with_, self.effects)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Kept:
    """Results to keep, and where.

    Attributes:
        out: folder for the files; by default one named after the scenario, here.
        every: seconds between results that are kept, a whole number of cable steps; without it as the trial says.
        float64: write all numbers in double precision; shapes and forces by name have 7 digits without it.
        checkpoint: minutes after which it is kept again how far the run is; the same command goes on from there.
    """

    out: Path | None = None
    every: float | None = None
    float64: Flag = False
    checkpoint: float | None = None

    def of(self, trial: scenarios.Trial) -> scenarios.Trial:
        """Return a trial with the results that are asked for."""
        if self.every is None:
            return trial
        try:
            return replace(trial, every=self.every)
        except scenarios.ScenarioError as error:  # the user wrote an option, not a field of a trial
            raise scenarios.ScenarioError(
                replace(problem, file="--every", key="") for problem in error.problems
            ) from error

    @contextmanager
    def kept_in(self, folder: Path) -> Iterator[dict[str, Any]]:
        """Give the checkpoint of a command as an argument of a run; it is removed when all is delivered."""
        if self.checkpoint is None:
            yield {}
            return
        from subzero.cli.interrupts import set_exit_message
        from subzero.simulation.checkpoint import Checkpoint

        kept = Checkpoint(folder=folder / "checkpoint", minutes=self.checkpoint)
        where = printable(str(kept.folder))

        def left() -> str:
            time = kept.kept_until()
            if time is None:
                return "nothing was kept yet"
            return f"the run up to t = {time:g} s is kept in {where}; the same command goes on from there"

        set_exit_message(left)
        if (time := kept.kept_until()) is not None:
            print(f"Going on from t = {time:g} s, which is kept in {where}.", file=sys.stderr)
        try:
            yield {"checkpoint": kept}
        except BaseException:
            if kept.kept_until() is None:
                kept.remove()
            raise
        kept.remove()


NO_INPUTS, USUAL_OUTPUTS, ALL_KEPT = Inputs(), Outputs(), Kept()


def _version() -> str:
    from importlib.metadata import version

    return version(DISTRIBUTION)


app = cyclopts.App(
    name="subzero",
    help="Simulate a tethered underwater vehicle and the cable it pulls off a drum on the shore.",
    version=_version,
    help_format="plaintext",
)


def simulate(
    scenario: str,
    /,
    *,
    untethered: Flag = False,
    inputs: Inputs = NO_INPUTS,
    kept: Kept = ALL_KEPT,
    outputs: Outputs = USUAL_OUTPUTS,
    output_mode: StrictOutputMode = NOT_STRICT,
) -> int:
    """Simulate one run, and write its channels, a summary and figures.

    Args:
        scenario: name of a scenario (see "subzero list"), or path of a scenario file.
        untethered: leave the cable away.
        inputs: inputs of the simulation besides the scenario.
        kept: results to keep, and where.
        outputs: which files are made, and how.
        output_mode: the form of the output.
    """
    trial = inputs.read(scenario)

    def run(trial: scenarios.Trial, **how: Any) -> tuple[Runs, None]:
        from subzero.simulation.run import simulate

        with _progress(trial, tethered=not untethered) as progress:
            made = simulate(trial, tethered=not untethered, **how, progress=progress)
        return {"untethered" if untethered else "tethered": made}, None

    return _deliver(scenario, trial, run, inputs, kept, outputs, output_mode)


def compare(
    scenario: str,
    /,
    *,
    measured: Path | None = None,
    map: Path | None = None,
    inputs: Inputs = NO_INPUTS,
    kept: Kept = ALL_KEPT,
    outputs: Outputs = USUAL_OUTPUTS,
    output_mode: StrictOutputMode = NOT_STRICT,
) -> int:
    """Simulate with the cable and without, and set both side by side.

    Args:
        scenario: name of a scenario (see "subzero list"), or path of a scenario file.
        measured: CSV file of measured channels, to compare with both runs.
        map: the measured file is a log as its logger wrote it, with this map of "subzero import".
        inputs: inputs of the simulation besides the scenario.
        kept: results to keep, and where.
        outputs: which files are made, and how.
        output_mode: the form of the output.
    """
    trial = inputs.read(scenario)
    record = _measured(measured, map)

    def run(trial: scenarios.Trial, **how: Any) -> tuple[Runs, Record | None]:
        from subzero.simulation.comparison import compare

        with _progress(trial) as progress:
            result = compare(trial, measured=record, **how, progress=progress)
        return result.runs, result.measured

    return _deliver(scenario, trial, run, inputs, kept, outputs, output_mode)


def _deliver(
    scenario: str,
    trial: scenarios.Trial,
    run: Callable[..., tuple[Runs, Record | None]],
    inputs: Inputs,
    kept: Kept,
    outputs: Outputs,
    output_mode: StrictOutputMode,
) -> int:
    """Run a trial that was read without its vehicle's own check, write and print the results; return the exit code."""
    from subzero.cli import write_results
    from subzero.results.netcdf_csv import open_output_folder

    outputs.refuse_impossible()
    folder = kept.out or write_results.default_folder(kept.of(trial))
    with kept.kept_in(folder) as checkpoint, open_output_folder(folder) as output_folder:
        trial, extended = inputs.checked(scenario)
        trial = kept.of(trial)
        runs, record = run(trial, **extended, **checkpoint)
        runs = _refined(runs, trial, extended) if outputs.check else runs
        summary = write_results.write_all(runs, record, output_folder, outputs, float64=kept.float64)
        write_results.write_film(outputs.animate, output_folder)
    is_well = write_results.print_results(summary, output_folder, output_mode)
    return FINE if is_well else STOPPED


def _measured(path: Path | None, map: Path | None) -> Record | None:
    """Return the measured record of a comparison: a file of channels, or a log with its map."""
    if path is None:
        if map is not None:
            raise UserError("--map reads a measured log, and none is given. Add --measured LOG.")
        return None
    if map is None:
        from subzero.records.record import read_record

        return read_record(path)
    from subzero.logs.api import read_log

    return read_log(path, map)


def plot(
    run: Path,
    /,
    *,
    what: Annotated[list[str] | None, Parameter(consume_multiple=True, negative=())] = None,
    out: Path | None = None,
    format: Literal["png", "svg", "pdf"] = "png",
    output_mode: OutputMode = PLAIN,
) -> int:
    """Draw a run from its file again: figures by name, or any channel over time.

    Args:
        run: tethered.nc or untethered.nc of an earlier command.
        what: tension, shape3d, motion, forces, attitude, cable; or channels, such as heading. Without it, all six.
        out: folder for the figures; by default the folder of the run.
        format: of the files.
        output_mode: the form of the output.
    """
    from subzero.files.atomic_output import open_output_folder

    names = [f"{run.stem}_{name}.{format}" for name in what or ()]
    with open_output_folder(out or run.parent, names) as output_folder:
        from subzero.figures.accessor import figures_of, open_run
        from subzero.results.netcdf_csv import lacking_letters_as_boxes

        dataset = open_run(run)
        for name, figure in figures_of(dataset, what).items():
            with lacking_letters_as_boxes():
                figure.savefig(output_folder.path / f"{run.stem}_{name}.{format}")
    with output_mode.emit(output_folder.files()):
        print(output_folder.words())
    return FINE


def explore(
    scenario: str,
    /,
    *,
    port: int = 8642,
    no_browser: Flag = False,
    output_mode: OutputMode = PLAIN,
) -> int:
    """Open a page on this machine, with sliders that say at once what the trial would do otherwise.

    Args:
        scenario: name of a scenario (see "subzero list"), or path of a scenario file.
        port: of the page's address, http://127.0.0.1:PORT; 0 is any that is free.
        no_browser: say the address, and open no browser.
        output_mode: the form of the output.
    """
    from subzero.cli.interrupts import set_exit_message
    from subzero.explore import page as explore_page

    trial = scenarios.load(scenario)
    with explore_page.address(port) as (access, listening):
        from subzero.explore.exploration import Exploration
        from subzero.model import load
        from subzero.simulation.run import simulate as run

        trial = load(scenario)
        with _progress(trial) as progress:
            nominal = run(trial, progress=progress)
        page = explore_page.Page(Exploration(trial=trial, nominal=nominal, simulate=run))
        with output_mode.emit({"url": access.url}):
            print(f"Exploring {printable(trial.name)} at {access.url} . Ctrl-C ends it.")
        sys.stdout.flush()
        set_exit_message(lambda: "the page is closed, and files that were saved stay")
        page.serve(listening, access, browser=not no_browser)
    return FINE


def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print the script that makes a shell complete commands and options; put it where your shell looks for
    completions.

    Args:
        shell: bash, zsh or fish.
    """
    sys.stdout.write(app.generate_completion(prog_name="subzero", shell=shell))
    return FINE


COMMANDS: dict[str, Callable[..., int]] = {
    "list": trials.list_shipped,
    "new": trials.new,
    "show": trials.show,
    "validate": trials.validate,
    "simulate": simulate,
    "compare": compare,
    "plot": plot,
    "explore": explore,
    "manoeuvre": autopilot.manoeuvre,
    "autopilot": autopilot.fly_step,
    "import": import_log.import_,
    "diagnose": diagnosis.diagnose,
    "calibrate": diagnosis.calibrate,
    "challenge": diagnosis.challenge,
    "sweep": sweep.sweep,
    "export-fmu": cables.export_tether,
    "import-line": cables.import_line,
    "doctor": install.doctor,
    "warm": install.warm,
    "completion": completion,
}
for _name, _command in COMMANDS.items():
    _examples = "\n".join(f"  {line}" for line in EXAMPLES[_name])
    app.command(_command, name=_name, help_epilogue=f"Examples:\n\n{_examples}\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return its exit code.

    Args:
        arguments: words behind ``subzero``; those of this process if None.
    """
    _never_choke(sys.stdout, sys.stderr)
    reset()
    _note_command(sys.argv[1:] if arguments is None else arguments)
    try:
        command, bound, _ = app.parse_args(arguments, exit_on_error=False, print_error=False)
        output_mode = next((kwarg for kwarg in bound.kwargs.values() if isinstance(kwarg, OutputMode)), PLAIN)
        with _aloud(output_mode):
            return command(*bound.args, **bound.kwargs) or FINE
    except cyclopts.CycloptsError as error:
        asked = " ".join(["subzero", *(error.command_chain or ())])
        return _refuse(f"{_in_words(error)}\nTry '{asked} --help'.")
    except UserError as error:
        return _refuse(str(error))
    except KeyboardInterrupt:
        print_interrupted()
        return INTERRUPTED
    except Exception:  # matplotlib's drawing in C++ made a ValueError of an interrupt in a call back
        if not was_interrupted():
            raise
        print_interrupted()
        return INTERRUPTED


@contextmanager
def _aloud(output_mode: OutputMode) -> Iterator[None]:
    """Set the output mode of a command; with --verbose, report the versions, and in the end how long it took."""
    OUTPUT_MODE.set(output_mode)
    began = perf_counter()
    if output_mode.verbose:
        import platform

        print(f"subzero {_version()}, Python {platform.python_version()}, {sys.executable}", file=sys.stderr)
    try:
        yield
    finally:
        OUTPUT_MODE.set(PLAIN)
        if output_mode.verbose:
            print(f"{_effort()}{perf_counter() - began:.1f} s in all.", file=sys.stderr)


def _effort() -> str:
    """Return the functions compiled by this command and their folder, as far as it has needed any machine code."""
    if "subzero.jit.machine_code" not in sys.modules:
        return ""
    from subzero.jit.machine_code import base_folder, compiled_functions

    return f"{compiled_functions()} functions compiled; machine code is kept in {printable(str(base_folder()))}. "


def _note_command(words: Sequence[str]) -> None:
    """Keep the command line, for the pages that state how to repeat it; the output folder is not part of it."""
    kept = [
        word
        for before, word in zip(["", *words], words, strict=False)
        if "--out" not in (before, word) and not word.startswith("--out=")
    ]
    COMMAND.set(printable(shlex.join(["subzero", *kept])))


def _never_choke(*streams: Any) -> None:
    """Show ``?`` instead of letters that the terminal lacks."""
    for stream in streams:
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def _refuse(message: str) -> int:
    """Print a message, and return the exit code of a mistake."""
    print("\n".join(map(printable, message.split("\n"))), file=sys.stderr)
    return MISTAKE


def _in_words(error: cyclopts.CycloptsError) -> str:
    """Return the error in the words of a command, as a sentence."""
    if isinstance(error, cyclopts.UnusedCliTokensError):
        return f"Unexpected argument: {' '.join(error.unused_tokens or [])}."
    if isinstance(error, cyclopts.MissingArgumentError) and error.argument and error.command_chain:
        return _missing(error.command_chain[0], error.argument)
    if isinstance(error, cyclopts.UnknownOptionError):
        return _unknown_option(error)
    return str(error)


def _unknown_option(error: cyclopts.UnknownOptionError) -> str:
    """Return the option that is most like one that is unknown, by their letters: all options have the dashes in
    common.
    """
    word = (error.token.keyword or error.token.value).split("=")[0]
    options = {name.lstrip("-"): name for argument in error.argument_collection for name in argument.names}
    close = nearest(word.lstrip("-"), options, likeness=OPTION_LIKENESS)
    return f"Unknown option: {word}.{f' Did you mean {options[close[0]]}?' if close else ''}"


def _missing(command: str, argument: cyclopts.Argument) -> str:
    """Return the arguments that a command needs, and how it is called."""
    if not argument.required:
        return f"{argument.name} needs a value."
    return (
        f"subzero {command} needs {argument.name.removeprefix('--').upper()}, as in: {EXAMPLES[command][0]}"
    )


def _refined(runs: Runs, trial: scenarios.Trial, extended: dict[str, Any]) -> Runs:
    """Return runs with their change at half the steps."""
    from subzero.simulation.comparison import refine

    marked = {}
    for label, run in runs.items():
        words = f"Checking the {label} run of {trial.name}"
        with _progress(trial, words, tethered=label == "tethered") as progress:
            marked[label] = refine(run, trial, **extended, progress=progress).marked_run()
    return marked


def _progress(trial: scenarios.Trial, words: str = "", *, tethered: bool = True) -> ProgressBar:
    """Return a progress bar that reports the cost of this trial where it stands still."""
    from subzero.cli.progress import costs_of, progress_bar

    return progress_bar(words or f"Simulating {trial.name}", lambda: costs_of(trial, tethered))
