"""Write the runs of a command: all their files, and the text on the terminal."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from subzero.cli.output_mode import COMMAND, PLAIN, OutputMode
from subzero.results import netcdf_csv

if TYPE_CHECKING:
    import xarray as xr

    import scenarios
    from subzero.files.atomic_output import OutputFolder
    from subzero.records.record import Record


def default_folder(trial: scenarios.Trial) -> Path:
    """Return the folder that is named after a trial, here; a path in a name cannot lead elsewhere."""
    return Path(re.sub(r"[^\w.-]+", "_", trial.name).strip(".") or "run")


def write_all(
    runs: dict[str, xr.Dataset],
    record: Record | None,
    output_folder: OutputFolder,
    *,
    width: float | None = None,
    kind: str = "png",
    exports: Sequence[str] = (),
    float64: bool = False,
) -> dict[str, Any]:
    """Write everything that belongs to some runs of one trial, and return their summary.

    Args:
        runs: by label.
        record: the measured record, if there is one.
        output_folder: where to.
        width: of the figures; None for two columns of a page. [inch]
        kind: of the figures: png, svg or pdf.
        exports: kinds of files for other programs (`subzero.results.export`).
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
        write_exports(run, label, exports, output_folder)
    netcdf_csv.write_summary(summary, output_folder)
    with page_width(WIDTH if width is None else width):
        figures = draw(runs, record)
        netcdf_csv.write_figures(figures, output_folder, kind)
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
    summary: dict[str, Any],
    output_folder: OutputFolder,
    *,
    strict: bool = False,
    output_mode: OutputMode = PLAIN,
) -> bool:
    """Print the summary and where the files are; say why runs could not go on, and if `strict`, that some warn.

    Returns:
        whether all is well.
    """
    from subzero.results.tables import RUNS, show

    with output_mode.emit(summary | output_folder.files()):
        console = Console()
        show(summary, console, whole=output_mode.verbose)
        console.print(output_folder.words(), highlight=False, markup=False)
    stopped = [label for label in RUNS if summary.get(label, {}).get("outcome") == "stopped"]
    for label in stopped:
        print(f"The {label} run stopped: {summary[label]['outcome_message']}", file=sys.stderr)
    return not (stopped or (strict and refuse_warnings(summary)))


def refuse_warnings(summary: dict[str, Any]) -> bool:
    """Say on standard error which runs end with warnings, as --strict wants it; return whether there are some."""
    from subzero.results.tables import RUNS

    counts = {label: len(summary[label]["warnings"]) for label in RUNS if label in summary}
    warned = [f"{count} of the {label} run" for label, count in counts.items() if count]
    if warned:
        print(f"Warnings under --strict: {', '.join(warned)}. All files are written.", file=sys.stderr)
    return bool(warned)
