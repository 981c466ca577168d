"""The one style of all figures: tethered solid, untethered dashed, measured as dots, colour-blind safe.

Figures are made with matplotlib's objects alone (no pyplot: half the import time, no window, nothing global
is changed) and drawn by Agg. Layout is by hand, because an automatic layout draws everything twice.
"""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from subzero.channels import BY_NAME

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from subzero.measured import Record

Runs = dict[str, "xr.Dataset"]
"""Runs of one trial by name: tethered, untethered or both."""

BLUE, ORANGE, GREEN, PURPLE, SKY, INK, GREY = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#AA4499",
    "#56B4E9",
    "#222222",
    "#8A8A8A",
)
"""Okabe and Ito's colours for all kinds of sight, purple after Tol; ink for text, grey for what is behind."""

CYCLE = (BLUE, ORANGE, GREEN, PURPLE, "#E69F00", SKY, INK, GREY, "#6B4C00")
LINES: dict[str, dict[str, Any]] = {
    "tethered": {"color": BLUE, "linestyle": "-", "linewidth": 1.5},
    "untethered": {"color": ORANGE, "linestyle": (0, (5, 2)), "linewidth": 1.5},
}
COMMAND: dict[str, Any] = {"color": INK, "linestyle": "-", "linewidth": 1.2}
DOTS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 2.6, "color": INK, "alpha": 0.6}

LETTERS = 26
DPI = 150
WIDTH, ROW_HEIGHT, MARGIN_HEIGHT = 7.2, 2.15, 0.75
"""Inches: two columns of a journal page, one row of panels, title and time axis."""

SMALL, NORMAL, LARGE = 7.5, 8.5, 9.5
"""Font sizes. [pt]"""

TITLE_LENGTH = 100
"""So many letters of a title fit above two columns."""


def sheet(rows: int, columns: int, title: str) -> tuple[Figure, list[Axes]]:
    """Return a figure and its empty, styled panels in reading order, lettered if there are several."""
    height = rows * ROW_HEIGHT + MARGIN_HEIGHT
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    figure.subplots_adjust(left=0.088, right=0.985, bottom=0.46 / height, top=1 - 0.5 / height)
    figure.subplots_adjust(wspace=0.24, hspace=0.36)
    words = textwrap.shorten(title, TITLE_LENGTH, placeholder=" …")
    figure.suptitle(words, x=0.088, y=1 - 0.09 / height, ha="left", va="top", fontsize=LARGE)
    panels = [figure.add_subplot(rows, columns, at + 1) for at in range(rows * columns)]
    for at, axes in enumerate(panels):
        _style(axes)
        if 1 < len(panels) <= LETTERS:
            axes.set_title(f"({chr(ord('a') + at)})", loc="left", fontsize=NORMAL, pad=3)
    return figure, panels


def _style(axes: Axes) -> None:
    """Thin axes, a faint grid, ticks small enough to keep out of the way."""
    axes.grid(visible=True, color="#E3E3E3", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=SMALL, length=3, width=0.6, color=GREY)
    for side in axes.spines.values():
        side.set_linewidth(0.6)
        side.set_color(GREY)


def headline(axes: Axes, text: str) -> None:
    """Say in words what a panel shows, behind its letter."""
    letter = axes.get_title(loc="left")
    axes.set_title(f"{letter} {text}".strip(), loc="left", fontsize=NORMAL, pad=3)


def label(axes: Axes, x: str | None, y: str) -> None:
    """Name the axes, with units."""
    if x is not None:
        axes.set_xlabel(x, fontsize=NORMAL, labelpad=2)
    axes.set_ylabel(y, fontsize=NORMAL)
    axes.yaxis.set_label_coords(-0.125, 0.5)


def legend(axes: Axes, **where: Any) -> None:
    """Show the legend, small, on a white ground."""
    axes.legend(**{"fontsize": SMALL, "frameon": True, "framealpha": 0.85, "edgecolor": "none", **where})


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
