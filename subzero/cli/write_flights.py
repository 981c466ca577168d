"""Write the results of manoeuvres and autopilots: files, a table of indices, and one figure.

The figure shows track, heading, speed and command, with the cable and without.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from subzero.cli.output_mode import COMMAND, OutputMode
from subzero.errors import printable
from subzero.figures.style import (
    LINES,
    Runs,
    Title,
    channel_panel,
    headline,
    label,
    legend,
    sheet,
    time_label,
    warnings_in_short,
)
from subzero.results import netcdf_csv
from subzero.results.tables import NOTHING, index_in_words, show_warnings

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from subzero.files.atomic_output import OutputFolder


Measured = dict[str, tuple["xr.Dataset", dict[str, float]]]
"""Name of a run, tethered or untethered → the run and its indices."""


def write(
    measured: Measured, title: str, answer: str, command: str, output_folder: OutputFolder
) -> dict[str, Any]:
    """Write runs, ``summary.json`` with their indices, and a figure; return the summary.

    Args:
        measured: the runs.
        title: in words.
        answer: channel that shows the answer of the vehicle.
        command: channel that was commanded.
        output_folder: where to.
    """
    from subzero.page import page_of_runs
    from subzero.results.summary import number, summary_of

    runs = {name: run for name, (run, _) in measured.items()}
    summary = summary_of(runs, None)
    summary["title"] = title = printable(title)
    output_folder.failed = any(run.attrs["outcome"] != "completed" for run in runs.values())
    for name, (run, indices) in measured.items():
        netcdf_csv.write_run(run, output_folder, name)
        summary[name]["indices"] = {key: number(value) for key, value in indices.items()}
    netcdf_csv.write_summary(summary, output_folder)
    figures = {"manoeuvre": picture(runs, title, answer, command)}
    netcdf_csv.write_figures(figures, output_folder)
    netcdf_csv.write_page(page_of_runs(runs, summary, figures, command=COMMAND.get()), output_folder)
    return summary


def print_flights(
    summary: dict[str, Any], names: list[str], output_folder: OutputFolder, output_mode: OutputMode
) -> None:
    """Print indices, warnings and where the files are."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("")
    for name in names:
        table.add_column(name, justify="right")
    for key in summary[names[0]]["indices"]:
        cells = [summary[name]["indices"][key] for name in names]
        table.add_row(
            escape(index_in_words(key)), *(NOTHING if cell is None else f"{cell:.4g}" for cell in cells)
        )
    with output_mode.emit(summary | output_folder.files()):
        console = Console()
        console.print(f"{summary['scenario']}: {summary['title']}", highlight=False, markup=False)
        console.print(table, highlight=False)
        show_warnings({name: summary[name] for name in names}, console)
        console.print(output_folder.words(), highlight=False, markup=False)


HEADLINES = {
    "heading": "Heading, clockwise from north",
    "depth": "Depth",
    "pitch": "Pitch, positive nose up",
    "surge_speed": "Forward speed",
    "yaw_rate": "Yaw rate, positive to starboard",
    "pitch_rate": "Pitch rate, positive nose going up",
    "rudder_command": "Rudder command, positive to starboard",
    "stern_plane_port_command": "Port plane command, positive nose up",
    "propeller_command": "Propeller command",
}


def picture(runs: Runs, title: str, answer: str, command: str) -> Figure:
    """Return the figure of a manoeuvre.

    Args:
        runs: tethered, untethered or both.
        title: above it.
        answer: the channel that shows the answer of the vehicle.
        command: the channel that was commanded.
    """
    first = next(iter(runs.values()))
    figure, panels = sheet(
        2, 2, Title(words=title, scenario=first.attrs["scenario"], warnings=warnings_in_short(runs))
    )
    _track(panels[0], runs)
    for axes, name in zip(panels[1:], (answer, "surge_speed", command), strict=True):
        channel_panel(axes, runs, name)
        headline(axes, HEADLINES[name])
    legend(panels[1])
    time_label(panels, 2)
    panels[2].set_xlabel(panels[3].get_xlabel())
    return figure


def _track(axes: Axes, runs: Runs) -> None:
    """Draw the ways of the hull centre, seen from above, with equal scales."""
    for name, run in runs.items():
        axes.plot(run["east"].values, run["north"].values, label=name, **LINES[name])
    axes.set_aspect("equal", adjustable="datalim")
    label(axes, "east [m]", "north [m]")
    headline(axes, "Track from above")
