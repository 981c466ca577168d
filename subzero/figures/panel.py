"""What goes into a panel: channels over time, headline, units, legend, and axes that do not mislead."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.channels import BY_NAME
from subzero.figures.style import DOTS, DPI, LINES, NORMAL, SMALL, TINY, Runs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from subzero.records.record import Record

LEGEND_ROW, LEGEND_MARGIN = 0.145, 0.1
"""Height of one row of a legend and of the space around it. [inch]"""


def headline(axes: Axes, text: str) -> None:
    """Say in words what a panel shows, behind its letter."""
    letter = axes.get_title(loc="left")
    axes.set_title(f"{letter} {text}".strip(), loc="left", fontsize=NORMAL, pad=3)


def label(axes: Axes, x: str | None, y: str) -> None:
    """Name the axes, with units."""
    if x is not None:
        axes.set_xlabel(x, fontsize=NORMAL, labelpad=2)
    axes.set_ylabel(y, fontsize=NORMAL)
    axes.yaxis.set_label_coords(-0.17, 0.5)


def legend(axes: Axes, columns: int = 3, *, tight: bool = False, **where: Any) -> None:
    """Show the legend, small; if no place is given, above the curves, where room is made for it."""
    if not where:
        rows = math.ceil(len(axes.get_legend_handles_labels()[1]) / columns)
        height = axes.get_window_extent().height / DPI
        taken = min((rows * LEGEND_ROW + LEGEND_MARGIN) / height, 0.6)
        low, high = axes.get_ylim()
        axes.set_ylim(low, low + (high - low) / (1.0 - taken))
        where = {"loc": "upper left", "ncols": columns, "columnspacing": 0.9, "borderaxespad": 0.2}
    size = {"fontsize": TINY, "handlelength": 1.3} if tight else {"fontsize": SMALL, "handlelength": 2.0}
    axes.legend(**size | {"framealpha": 0.85, "edgecolor": "none", "handletextpad": 0.5} | where)


def channel_panel(axes: Axes, runs: Runs, name: str, record: Record | None = None) -> None:
    """Draw one channel of all runs over time, and what was measured of it."""
    channel = BY_NAME[name]
    for run_name, run in runs.items():
        axes.plot(run["time"].values, run[name].values, label=run_name, **LINES[run_name])
    if record is not None and name in record.values:
        axes.plot(record.time, record.values[name], label="measured", zorder=1.5, **DOTS)
    label(axes, None, f"${channel.symbol}$ [{channel.unit}]")
    in_time(axes, runs)
    calm(axes, smallest=1e-3)


def in_time(axes: Axes, runs: Runs) -> None:
    """Let the time axis be the simulated time, whatever was measured besides."""
    end = max(float(run["time"].values[-1]) for run in runs.values())
    axes.set_xlim(0.0, end if end > 0.0 else 1.0)


def calm(axes: Axes, smallest: float = 1e-6) -> None:
    """Do not blow up rounding errors: a curve that is constant is shown as a straight line."""
    low, high = axes.get_ylim()
    middle, span = 0.5 * (low + high), high - low
    least = max(smallest, 1e-4 * abs(middle))
    if span < least:
        half = max(0.05 * abs(middle), 0.5 * smallest, 0.5 * least)
        axes.set_ylim(middle - half, middle + half)


def time_label(panels: list[Axes], columns: int) -> None:
    """Name the time axis below the lowest row only."""
    for axes in panels[-columns:]:
        axes.set_xlabel("time [s]", fontsize=NORMAL, labelpad=2)


def spread(count: int, size: int) -> np.ndarray:
    """Return `count` indices spread evenly over a sequence, its end included, its start not."""
    return (
        np.unique(np.linspace(0, size - 1, count + 1).round().astype(int)[1:])
        if size > 1
        else np.zeros(1, int)
    )
