"""What the commands of manoeuvres and autopilots leave behind: files, and one table of indices."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.table import Table

from subzero import output
from subzero.errors import printable
from subzero.report import NOTHING, show_warnings

if TYPE_CHECKING:
    import xarray as xr

    from subzero.output import Stage

Measured = dict[str, tuple["xr.Dataset", dict[str, float]]]
"""Name of a run, tethered or untethered → the run and its indices."""


def write(measured: Measured, title: str, answer: str, command: str, stage: Stage) -> dict[str, Any]:
    """Write runs, ``summary.json`` with their indices, and a figure; return the summary.

    Args:
        measured: the runs.
        title: in words.
        answer: channel that shows the answer of the vehicle.
        command: channel that was commanded.
        stage: where to.
    """
    from subzero.autopilot.manoeuvre_figure import picture
    from subzero.page import page_of_runs
    from subzero.summary import summary_of

    runs = {name: run for name, (run, _) in measured.items()}
    summary = summary_of(runs, None)
    summary["title"] = title = printable(title)
    stage.failed = any(run.attrs["outcome"] != "completed" for run in runs.values())
    for name, (run, indices) in measured.items():
        output.write_run(run, stage, name)
        summary[name]["indices"] = {key: _number(value) for key, value in indices.items()}
    output.write_summary(summary, stage)
    figures = {"manoeuvre": picture(runs, title, answer, command)}
    output.write_figures(figures, stage)
    output.write_page(page_of_runs(runs, summary, figures, command=output.COMMAND.get()), stage)
    return summary


def tell(summary: dict[str, Any], names: list[str], stage: Stage) -> list[str]:
    """Print indices, warnings and where the files are; return the messages of runs that could not go on."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("")
    for name in names:
        table.add_column(name, justify="right")
    for key in summary[names[0]]["indices"]:
        cells = [summary[name]["indices"][key] for name in names]
        table.add_row(key, *(NOTHING if cell is None else f"{cell:.4g}" for cell in cells))
    console = Console()
    console.print(f"{summary['scenario']}: {summary['title']}", highlight=False, markup=False)
    console.print(table, highlight=False)
    show_warnings({name: summary[name] for name in names}, console)
    console.print(stage.words(), highlight=False, markup=False)
    return [
        f"The {name} run stopped: {summary[name]['outcome_message']}"
        for name in names
        if summary[name]["outcome"] == "stopped"
    ]


def _number(value: float) -> float | None:
    """Return a plain float that JSON can hold: None for what does not exist."""
    return float(value) if math.isfinite(value) else None
