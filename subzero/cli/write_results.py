"""Write the runs of a command: all their files, and the text on the terminal."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from subzero.cli.output_mode import COMMAND, StrictOutputMode
from subzero.results import netcdf_csv

if TYPE_CHECKING:
    import xarray as xr

    import scenarios
    from subzero.cli.app import Outputs
    from subzero.files.atomic_output import OutputFolder
    from subzero.records.record import Record


def default_folder(trial: scenarios.Trial) -> Path:
    """Return the folder that is named after a trial, here; a path in a name cannot lead elsewhere."""
    return Path(re.sub(r"[^\w.-]+", "_", trial.name).strip(".") or "run")


def write_all(
    runs: dict[str, xr.Dataset],
    record: Record | None,
    output_folder: OutputFolder,
    outputs: Outputs,
    *,
    float64: bool,
) -> dict[str, Any]:
    """Write everything that belongs to some runs of one trial, and return their summary.

    Args:
        runs: by label.
        record: the measured record, if there is one.
        output_folder: where to.
        outputs: which files are made, and how.
        float64: as of `output.write_run`.
    """
    from subzero.figures import draw, page_width
    from subzero.figures.style import WIDTH
    from subzero.page import page_of_runs
    from subzero.results.export import write_exports
    from subzero.results.summary import summary_of

    summary = summary_of(runs, record)
    output_folder.failed = any(run.attrs["outcome"] != "completed" for run in runs.values())
    for label, run in runs.items():
        netcdf_csv.write_run(run, output_folder, label, float64=float64)
        write_exports(run, label, outputs.export, output_folder)
    netcdf_csv.write_summary(summary, output_folder)
    with page_width(WIDTH if outputs.width is None else outputs.width):
        figures = draw(runs, record)
        netcdf_csv.write_figures(figures, output_folder, outputs.figures)
    netcdf_csv.write_page(
        page_of_runs(runs, summary, figures, command=COMMAND.get(), record=record), output_folder
    )
    return summary


def check_pictures(width: float | None, film: str | None) -> None:
    """Raise an error for figures that cannot be so wide, and a film that cannot be made here, before any
    simulation.
    """
    if width is not None:
        from subzero.figures import page_width

        with page_width(width):
            pass
    if film is not None:
        from subzero.page.browser import check_film

        check_film()


def write_film(kind: str | None, output_folder: OutputFolder) -> None:
    """Write the replay of ``report.html`` as ``replay.gif`` or ``replay.mp4``, if it is asked for."""
    if kind is None:
        return
    from subzero.cli.progress import progress_bar
    from subzero.page.browser import film

    with progress_bar("Filming") as progress:
        film(output_folder.path / "report.html", output_folder.path / f"replay.{kind}", progress)


def print_results(
    summary: dict[str, Any], output_folder: OutputFolder, output_mode: StrictOutputMode
) -> bool:
    """Print the summary and where the files are; return whether all is well, as `is_well`."""
    from subzero.results.tables import show

    with output_mode.emit(summary | output_folder.files()):
        console = Console()
        show(summary, console, whole=output_mode.verbose)
        console.print(output_folder.words(), highlight=False, markup=False)
    return is_well(summary, output_mode)


def is_well(summary: dict[str, Any], output_mode: StrictOutputMode) -> bool:
    """Say on standard error why runs could not go on, else under --strict which end with warnings; return whether all
    is well.
    """
    from subzero.results.tables import RUNS

    runs = {label: summary[label] for label in RUNS if label in summary}
    stopped = [label for label, run in runs.items() if run["outcome"] == "stopped"]
    for label in stopped:
        print(f"The {label} run stopped: {runs[label]['outcome_message']}", file=sys.stderr)
    counts = {label: len(run["warnings"]) for label, run in runs.items()}
    warned = [f"{count} of the {label} run" for label, count in counts.items() if count]
    if warned and output_mode.strict and not stopped:
        print(f"Warnings under --strict: {', '.join(warned)}. All files are written.", file=sys.stderr)
    return not (stopped or (warned and output_mode.strict))
