"""The tables that a command prints about its runs: a short table, the energy balance, how well a record is
explained.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

Summary = dict[str, Any]
"""The summary of one run, as `subzero.results.summary.summarise` gives it."""

Row = tuple[str, ...]
"""The cells of a row; the first is the label of the others."""

NOTHING = "–"
SHOWN_CHANNELS = 12
"""So many channels are shown of those that change by finer steps; ``summary.json`` has all."""
RUNS = ("tethered", "untethered")

ENERGY_ROWS = {
    "propeller_work_J": "work of the propulsion [J]",
    "hull_loss_J": "  lost by hull and fins [J]",
    "cable_loss_J": "  lost by the cable [J]",
    "kinetic_change_J": "  kinetic and potential [J]",
    "drum_J": "  left at the drum [J]",
    "added_mass_term_J": "  added-mass form of (7) [J]",
    "residual_J": "  unexplained [J]",
}

DIAGNOSTIC_ROWS = {
    "closure_error_m": ("closure error [m]", "{:.1e}"),
    "energy_residual": ("energy residual, share", "{:.1e}"),
    "largest_courant_number": ("largest Courant number", "{:.2f}"),
    "smallest_tension_N": ("smallest tension in the cable [N]", "{:.4f}"),
    "newton_iterations": ("Newton iterations", "{:d}"),
}
"""Diagnostics that show how far to trust the cable: words, and how to write the number."""


INDEX_UNITS = {
    "_deg_s": "degree/s",
    "_m_s": "m/s",
    "_per_s": "1/s",
    "_N_m": "N m",
    "_deg": "degree",
    "_s": "s",
    "_m": "m",
    "_N": "N",
    "_J": "J",
}
"""How the name of an index ends → its unit; without such an end it is a share, or as large as the channel."""


def index_in_words(name: str) -> str:
    """Return the name of an index of a manoeuvre in words with its unit: ``rise_time_s`` is "rise time [s]"."""
    end = next((end for end in INDEX_UNITS if name.endswith(end)), "")
    return name.removesuffix(end).replace("_", " ") + (f" [{INDEX_UNITS[end]}]" if end else "")


def show(summary: Summary, console: Console, *, whole: bool = False) -> None:
    """Print a summary, as `subzero.simulation.comparison.summary_of` gives it; the whole of it with the diagnostics
    of the cable, of which a warning speaks where it matters.
    """
    console.print(f"[bold]{escape(summary['scenario'])}[/bold]: {escape(summary['title'])}", highlight=False)
    console.print(_runs_table(summary, whole), highlight=False)
    runs = {label: summary[label] for label in RUNS if label in summary}
    for words in dict.fromkeys(run["thinned"] for run in runs.values() if run["thinned"]):
        console.print(words, highlight=False, markup=False, soft_wrap=True)
    for label, run in runs.items():
        if run["refinement"] is not None:
            console.print(_refinement_table(label, run["refinement"]), highlight=False)
    if summary["measured"] is not None:
        console.print(_fit_table(summary["measured"]), highlight=False)
        for words in summary["measured"]["notes"]:
            console.print(words, highlight=False, markup=False, soft_wrap=True)
    show_warnings(runs, console)


def show_warnings(runs: dict[str, Summary], console: Console) -> None:
    """Print the warnings about each run and the notes on it, sentence by sentence; nothing if there are none."""
    for label, run in runs.items():
        for kind in ("warnings", "notes"):
            if run[kind]:
                console.print(f"{kind.capitalize()}, {label} run:", highlight=False, markup=False)
            for each in run[kind]:
                row = Table.grid(padding=(0, 1))
                row.add_row("  •", escape(each["message"]))
                console.print(row, highlight=False)


def number_groups(summary: Summary, *, whole: bool = True) -> list[list[Row]]:
    """Return the main results, runs side by side: rows in groups, each a row's words and a cell for each run."""
    runs = [summary[label] for label in RUNS if label in summary]
    snaps = [run["snap"] for run in runs if "snap" in run]
    first = _rows(bool(summary["prescribed"]), snaps).items()
    groups: list[list[Row]] = [[(words, *map(cell, runs)) for words, cell in first]]
    if all(run["energy"] is not None for run in runs):
        groups.append(_energy_rows([run["energy"] for run in runs]))
    if whole and any(run["diagnostics"] is not None for run in runs):
        groups.append(_diagnostic_rows([run["diagnostics"] or {} for run in runs]))
    return groups


def _runs_table(summary: Summary, whole: bool) -> Table:
    """Return the table of the main results, runs side by side."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("")
    for label in (label for label in RUNS if label in summary):
        table.add_column(label, justify="right")
    for group in number_groups(summary, whole=whole):
        table.add_section()
        for row in group:
            table.add_row(*map(escape, row))
    return table


def _rows(is_prescribed: bool, snaps: list[Summary]) -> dict[str, Callable[[Summary], str]]:
    """Return the rows of the table: words → how to read the cell from a summary; `snaps` are those of the runs."""
    rows: dict[str, Callable[[Summary], str]] = {
        "outcome": lambda run: f"{run['outcome']}, {run['time_at_end_s']:g} s",
        "warnings": lambda run: str(len(run["warnings"])),
        "peak speed [m/s]": lambda run: _peak(run, "peak_speed_m_s", "time_of_peak_speed_s", 3),
        "speed at the end [m/s]": lambda run: _plain(run["speed_at_end_m_s"], 3),
        "heading at the end [degree]": lambda run: _plain(run["heading_at_end_deg"], 2),
        "depth at the end [m]": lambda run: _plain(run["depth_at_end_m"], 2),
        "path length [m]": lambda run: _plain(run["path_length_m"], 2),
        "cable off the drum at the end [m]": lambda run: _plain(run["cable_length_at_end_m"] or None, 2),
        "largest cable force [N]": lambda run: _largest(run, "force", "N"),
        "largest cable moment [N m]": lambda run: _largest(run, "moment", "N_m"),
    }
    if is_prescribed:
        del rows["peak speed [m/s]"]
    if snaps:
        rows["peak tension, between results too [N]"] = lambda run: _snap(run, "peak_tension_N", 4)
        rows["impulse of the strongest pull [N s]"] = lambda run: _snap(run, "impulse_N_s", 4)
    if any(snap.get("time_above_strength_s") for snap in snaps):
        rows["time above the cable's strength [s]"] = lambda run: _snap(run, "time_above_strength_s", 3)
    return rows


def _snap(run: Summary, name: str, digits: int) -> str:
    """Return a number of the snap of a run; nothing for a run whose cable cannot snap."""
    return _plain(run.get("snap", {}).get(name), digits)


def _largest(run: Summary, what: str, unit: str) -> str:
    if not run[f"largest_cable_{what}_{unit}"]:
        return NOTHING
    return _peak(run, f"largest_cable_{what}_{unit}", f"time_of_largest_cable_{what}_s", 4)


def _peak(run: Summary, value: str, time: str, digits: int) -> str:
    return f"{_plain(run[value], digits)} at {_plain(run[time], 1)} s"


def _plain(value: float | None, digits: int) -> str:
    return NOTHING if value is None else f"{round(value, digits) + 0.0:.{digits}f}"


def _energy_rows(balances: list[Summary]) -> list[Row]:
    """Return the energy balance at the end, and which share of the work it leaves unexplained."""
    rows = [(words, *(_plain(balance[key], 3) for balance in balances)) for key, words in ENERGY_ROWS.items()]
    shares = [balance["unexplained_share"] for balance in balances]
    return [
        *rows,
        ("  unexplained share", *(NOTHING if share is None else f"{share:.1e}" for share in shares)),
    ]


def _diagnostic_rows(found: list[Summary]) -> list[Row]:
    """Return the diagnostics that show how far to trust the cable; none where there is no cable."""
    return [
        (words, *(NOTHING if (x := each.get(key)) is None else form.format(x) for each in found))
        for key, (words, form) in DIAGNOSTIC_ROWS.items()
    ]


def _refinement_table(label: str, channels: Summary) -> Table:
    """Return the table of the changes with half the steps and segments, the worst channels first."""
    table = Table(
        title=f"Change of the {label} run by half the steps and segments", box=box.SIMPLE_HEAD, pad_edge=False
    )
    table.title_justify, table.title_style = "left", ""
    table.add_column("channel", overflow="fold")
    for what in ("change", "of at most", "share", "at [s]"):
        table.add_column(escape(what), justify="right", no_wrap=True)
    for name, row in list(channels.items())[:SHOWN_CHANNELS]:
        numbers = (f"{row['difference']:.2g}", f"{row['largest']:.3g}", f"{100.0 * row['change']:.2g} %")
        table.add_row(escape(f"{name} [{row['unit']}]"), *numbers, f"{row['time_s']:g}")
    return table


def _fit_table(measured: Summary) -> Table:
    """Return the table of how well each run explains each measured channel, one run a line."""
    table = Table(
        title=escape(f"Model − measured, {measured['source']}"), box=box.SIMPLE_HEAD, pad_edge=False
    )
    table.title_justify, table.title_style = "left", ""
    table.add_column("channel", overflow="fold")
    table.add_column("run", no_wrap=True)
    for what in ("samples", "RMSE", "bias", "fit %"):
        table.add_column(what, justify="right", no_wrap=True)
    for row in fit_rows(measured):
        table.add_row(*map(escape, row))
    return table


def fit_rows(measured: Summary) -> list[Row]:
    """Return how well each run explains each measured channel, one run a row; the channel stands in its first row."""
    rows: list[Row] = []
    for name, row in measured["channels"].items():
        words = f"{name} [{row['unit']}]"
        for label in (label for label in RUNS if label in row):
            rows.append((words, label, *_fit_cells(row[label])))
            words = ""
    return rows


def _fit_cells(summary: Summary) -> list[str]:
    errors = [_plain(summary[key], digits) for key, digits in (("rmse", 4), ("bias", 4), ("fit_percent", 1))]
    return [str(summary["samples"]), *errors]
