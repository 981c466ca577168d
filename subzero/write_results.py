"""Deliver the runs of a command: all their files, and what is told on the terminal."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from subzero import output

if TYPE_CHECKING:
    import xarray as xr

    import scenarios
    from subzero.records.record import Record
    from subzero.stage import Stage


def default_folder(trial: scenarios.Trial) -> Path:
    """Return the folder that is named after a trial, here; a path in a name cannot lead elsewhere."""
    return Path(re.sub(r"[^\w.-]+", "_", trial.name).strip(".") or "run")


def write_all(runs: dict[str, xr.Dataset], record: Record | None, stage: Stage) -> dict[str, Any]:
    """Write everything that belongs to some runs of one trial, and return their summary."""
    from subzero.figures import draw
    from subzero.page import page_of_runs
    from subzero.summary import summary_of

    summary = summary_of(runs, record)
    stage.failed = any(run.attrs["outcome"] != "completed" for run in runs.values())
    for label, run in runs.items():
        output.write_run(run, stage, label)
    output.write_summary(summary, stage)
    figures = draw(runs, record)
    output.write_figures(figures, stage)
    output.write_page(
        page_of_runs(runs, summary, figures, command=output.COMMAND.get(), record=record), stage
    )
    return summary


def tell(summary: dict[str, Any], stage: Stage, *, strict: bool = False) -> bool:
    """Print the summary and where the files are; say why runs could not go on, and if `strict`, that some warn.

    Returns:
        whether all is well.
    """
    from subzero.report import RUNS, show

    console = Console()
    show(summary, console)
    console.print(stage.words(), highlight=False, markup=False)
    stopped = [label for label in RUNS if summary.get(label, {}).get("outcome") == "stopped"]
    for label in stopped:
        print(f"The {label} run stopped: {summary[label]['outcome_message']}", file=sys.stderr)
    return not (stopped or (strict and refuse_warnings(summary)))


def refuse_warnings(summary: dict[str, Any]) -> bool:
    """Say on standard error which runs end with warnings, as --strict wants it; return whether there are some."""
    from subzero.report import RUNS

    counts = {label: len(summary[label]["warnings"]) for label in RUNS if label in summary}
    warned = [f"{count} of the {label} run" for label, count in counts.items() if count]
    if warned:
        print(f"Warnings under --strict: {', '.join(warned)}. All files are written.", file=sys.stderr)
    return bool(warned)
