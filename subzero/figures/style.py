"""The one style of all figures: tethered solid, untethered dashed, measured as dots, colour-blind safe.

`sheet` gives an empty figure with its title and a grid of styled, lettered panels; the functions behind it fill a
panel: channels over time, headline, units, legend, and axes that do not mislead.

Figures are made with matplotlib's objects alone (no pyplot: half the import time, no window, nothing global
is changed) and drawn by Agg. Layout is by hand, because an automatic layout draws everything twice.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.textpath import TextPath
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator, StrMethodFormatter

from subzero.channels import channels_of
from subzero.errors import UserError
from subzero.validity import warnings_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from subzero.records.record import Record


Runs = dict[str, "xr.Dataset"]
"""Runs of one trial by name: tethered, untethered or both."""

BLUE, ORANGE, GREEN, PURPLE, AMBER, SKY = "#0072B2", "#D55E00", "#009E73", "#AA4499", "#E69F00", "#56B4E9"
INK, GREY, PALE = "#222222", "#8A8A8A", "#E3E3E3"
"""Okabe and Ito's colours for all kinds of sight, purple after Tol; ink for text, grey for the background."""

TENSION = LinearSegmentedColormap.from_list(
    "tension", [(0.0, "#FFFACC"), (0.33, "#FFB833"), (0.7, "#F24721"), (1.0, "#C70547")]
)
"""Tension as a colour, as in the replay of a page."""

CYCLE = (BLUE, ORANGE, GREEN, PURPLE, AMBER, SKY, INK, GREY)
DASHES = ("-", (0, (5, 2)), (0, (1, 1)))
"""Three curves of one panel differ in colour and in dash, to survive a grey print."""

LINES: dict[str, dict[str, Any]] = {
    "tethered": {"color": BLUE, "linestyle": DASHES[0], "linewidth": 1.5},
    "untethered": {"color": ORANGE, "linestyle": DASHES[1], "linewidth": 1.5},
}
COMMAND: dict[str, Any] = {"color": INK, "linestyle": "-", "linewidth": 1.2}
DOTS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 2.6, "color": INK, "alpha": 0.6}

DPI = 150
TINY, SMALL, NORMAL, LARGE = 7.0, 7.5, 8.5, 9.5
"""Font sizes. [pt]"""


def warnings_in_short(runs: Runs) -> str:
    """Return how many warnings some runs end with, and which checks have them, for a line of a figure; or nothing."""
    names = {
        label: [warning.check.replace("_", " ") for warning in warnings_of(run)]
        for label, run in runs.items()
    }
    count = sum(map(len, names.values()))
    if not count:
        return ""
    several = len(runs) > 1
    parts = [
        (f"{label}: " if several else "") + ", ".join(dict.fromkeys(checks))
        for label, checks in names.items()
        if checks
    ]
    return f"{count} warning{'s' if count > 1 else ''} ({'; '.join(parts)}), see summary.json"


WIDTH, ROW_HEIGHT = 7.2, 2.1
"""Two columns of a journal page; one row of panels with its time axis. [inch]"""

NARROWEST, WIDEST = 3.0, 20.0
"""So wide may a figure be: 3.4 is one column of a journal page. [inch]"""

ONE_COLUMN = 5.0
"""In a figure that is narrower than this, panels that are otherwise side by side are below one another. [inch]"""

LEFT, RIGHT = 0.72, 0.11
"""Margins to the left and to the right of the panels. [inch]"""

LETTERS_PER_INCH = 15.5
"""So many letters of a headline fit on an inch."""

BOTTOM, TOP, TITLE_LINE = 0.42, 0.31, 0.16
"""Below the panels; above them without the title; one line of the title. [inch]"""

FOOTER, FOOTER_LENGTH = 0.16, 15.3
"""Height of the line of warnings below the panels [inch], and how many letters of it fit on an inch."""

TITLE_LENGTH, MOST_TITLE_LINES = 14.0, 2
"""So many letters of a title fit on an inch; so many lines are shown of it, one more in a narrow figure."""

LETTERS = 26
"""More panels than this are not lettered."""


@dataclass(frozen=True, kw_only=True)
class Title:
    """The texts of a figure: above it the trial in words, and the name of its scenario; below it the warnings."""

    words: str
    scenario: str
    warnings: str = ""


_width: ContextVar[float] = ContextVar("width of figures [inch]", default=WIDTH)


def width() -> float:
    """Return how wide figures are. [inch]."""
    return _width.get()


@contextmanager
def page_width(inches: float) -> Iterator[None]:
    """Draw figures inside this block at a width: 7.2 for two columns of a journal page, 3.4 for one. [inch].

    Text keeps its size; panels that are side by side are drawn below one another where the page is narrow.

    Raises:
        UserError: no page is as narrow, or as wide.
    """
    if not NARROWEST <= inches <= WIDEST:
        raise UserError(
            f"A figure cannot be {inches:g} inches wide. Allowed: {NARROWEST:g} to {WIDEST:g}, such as 3.4 for one "
            f"column of a page and {WIDTH:g} for two."
        )
    before = _width.set(inches)
    try:
        yield
    finally:
        _width.reset(before)


def _lines_of(title: Title) -> list[str]:
    """Return the lines of a title; the scenario's name and the first one share a line."""
    most_letters = TITLE_LENGTH * (width() - LEFT) - len(title.scenario)
    return textwrap.wrap(title.words, max(int(most_letters), 12))[: MOST_TITLE_LINES + (width() < ONE_COLUMN)]


def sheet(rows: int, columns: int, title: Title) -> tuple[Figure, list[Axes]]:
    """Return a figure and its empty, styled panels in reading order, lettered if there are several."""
    if columns == 2 and width() < ONE_COLUMN:
        rows, columns = 2 * rows, 1
    words = _lines_of(title)
    top = TOP + TITLE_LINE * (
        len(words) + (width() < ONE_COLUMN)
    )  # headlines of narrow panels may have two lines
    bottom = BOTTOM + (FOOTER if title.warnings else 0.0)
    height = rows * ROW_HEIGHT + bottom + top
    figure = Figure(figsize=(width(), height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    left, right = LEFT / width(), 1.0 - RIGHT / width()
    figure.subplots_adjust(left=left, right=right, bottom=bottom / height, top=1.0 - top / height)
    figure.subplots_adjust(wspace=0.28, hspace=0.36 if width() >= ONE_COLUMN else 0.5)
    y = 1.0 - 0.09 / height
    figure.text(left, y, "\n".join(words), va="top", fontsize=LARGE, parse_math=False)
    corner: dict[str, Any] = {"ha": "right", "fontsize": SMALL, "color": GREY}
    figure.text(right, y, title.scenario, va="top", parse_math=False, **corner)
    if title.warnings:
        footer = textwrap.shorten(title.warnings, int(FOOTER_LENGTH * width()), placeholder=" …")
        figure.text(left, 0.06 / height, footer, fontsize=SMALL, color=ORANGE, parse_math=False)
    panels = [figure.add_subplot(rows, columns, at + 1) for at in range(rows * columns)]
    for at, axes in enumerate(panels):
        _style(axes)
        if 1 < len(panels) <= LETTERS:
            axes.set_title(f"({chr(ord('a') + at)})", loc="left", fontsize=NORMAL, pad=3)
    return figure, panels


def _style(axes: Axes) -> None:
    """Draw thin axes, a faint grid, small ticks, and no offset at the axes (27.003, not 0.003)."""
    axes.grid(visible=True, color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.ticklabel_format(useOffset=False)
    axes.tick_params(labelsize=SMALL, length=3, width=0.6, color=GREY)
    for side in axes.spines.values():
        side.set_linewidth(0.6)
        side.set_color(GREY)


LEGEND_ROW, LEGEND_MARGIN = 0.145, 0.1
"""Height of one row of a legend and of the space around it. [inch]"""


def log_scale(axes: Axes) -> None:
    """Give an axis of errors a logarithmic scale with plain numbers."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))


def headline(axes: Axes, text: str) -> None:
    """Write the title of a panel after its letter."""
    letter = axes.get_title(loc="left")
    most_letters = LETTERS_PER_INCH * _inches(axes)[0]
    lines = (
        textwrap.wrap(f"{letter} {text}".strip(), max(int(most_letters), 12)) if width() < ONE_COLUMN else []
    )
    axes.set_title("\n".join(lines) or f"{letter} {text}".strip(), loc="left", fontsize=NORMAL, pad=3)


def label(axes: Axes, x: str | None, y: str) -> None:
    """Name the axes, with units."""
    if x is not None:
        axes.set_xlabel(x, fontsize=NORMAL, labelpad=2)
    axes.set_ylabel(y, fontsize=NORMAL)
    axes.yaxis.set_label_coords(-LABEL / _inches(axes)[0], 0.5)


LABEL = 0.5
"""So far to the left of a panel stands what its vertical axis is. [inch]"""


def _inches(axes: Axes) -> tuple[float, float]:
    """Return width and height of a panel. [inch]."""
    extent = axes.get_window_extent()
    return float(extent.width) / DPI, float(extent.height) / DPI


def legend(axes: Axes, columns: int = 3, *, tight: bool = False, **where: Any) -> None:
    """Show the legend, small; if no place is given, above the curves, where space is made for it.

    Args:
        axes: a panel with labelled curves.
        columns: at most; fewer where labels are long.
        tight: with smaller letters and shorter lines.
        where: of matplotlib, instead of all that.
    """
    size, handle = (TINY, 1.3) if tight else (SMALL, 2.0)
    if not where:
        labels = axes.get_legend_handles_labels()[1]
        across, height = _inches(axes)
        columns = _columns(labels, columns, across, size, handle)
        rows = math.ceil(sum(1 + label.count("\n") for label in labels) / columns)
        taken = min((rows * LEGEND_ROW + LEGEND_MARGIN) / height, 0.6)
        low, high = axes.get_ylim()
        if axes.get_yscale() == "log":
            axes.set_ylim(low, low * (high / low) ** (1.0 / (1.0 - taken)))
        else:
            axes.set_ylim(low, low + (high - low) / (1.0 - taken))
        where = {"loc": "upper left", "ncols": columns, "columnspacing": COLUMN_GAP, "borderaxespad": 0.2}
    look = {"framealpha": 0.85, "edgecolor": "none", "handletextpad": HANDLE_GAP}
    axes.legend(**{"fontsize": size, "handlelength": handle} | look | where)


COLUMN_GAP, HANDLE_GAP = 0.9, 0.5
"""Of a legend: between its columns, and between a line and its label, in letter heights."""


def _columns(labels: list[str], most: int, across: float, size: float, handle: float) -> int:
    """Return into how many columns of a legend some labels fit; they fill one column after the other."""
    extra = (handle + COLUMN_GAP + HANDLE_GAP) * size / 72.0
    for columns in range(min(most, max(len(labels), 1)), 1, -1):
        rows = math.ceil(len(labels) / columns)
        parts = [labels[at : at + rows] for at in range(0, len(labels), rows)]
        at_most = sum(max(map(len, part)) * WIDEST_LETTER * size / 72.0 + extra for part in parts)
        if at_most <= across:
            return columns
        if sum(max(_wide(each, size) for each in part) + extra for part in parts) <= across:
            return columns
    return 1


WIDEST_LETTER = 0.66
"""No word of a legend has letters that are wider than this on average, in letter heights: it need not be measured."""


@cache
def _wide(label: str, size: float) -> float:
    """Return how wide a label is. [inch]."""
    return float(TextPath((0.0, 0.0), label or " ", size=size).get_extents().width) / 72.0


def channel_panel(axes: Axes, runs: Runs, name: str, record: Record | None = None) -> None:
    """Draw one channel of all runs over time, and its measurements."""
    channel = next(each for each in channels_of(next(iter(runs.values()))) if each.name == name)
    for run_name, run in runs.items():
        axes.plot(run["time"].values, run[name].values, label=run_name, **LINES[run_name])
    if record is not None and name in record.values:
        axes.plot(record.time, record.values[name], label="measured", zorder=1.5, **DOTS)
    label(axes, None, f"${channel.symbol}$ [{channel.unit}]")
    axes.ticklabel_format(axis="y", scilimits=(-3, 5), useMathText=True)
    in_time(axes, runs)
    calm(axes, smallest=1e-6 if channel.unit == "m3" else 1e-3)


def in_time(axes: Axes, runs: Runs) -> None:
    """Limit the time axis to the simulated time, also if the record is longer."""
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
    """Label the time axis below the lowest row only; in a narrow figure, panels are below one another."""
    columns = columns if width() >= ONE_COLUMN else 1
    for axes in panels[-columns:]:
        axes.set_xlabel("time [s]", fontsize=NORMAL, labelpad=2)


def spread(count: int, size: int) -> np.ndarray:
    """Return `count` indices spread evenly over a sequence, its end included, its start not."""
    return (
        np.unique(np.linspace(0, size - 1, count + 1).round().astype(int)[1:])
        if size > 1
        else np.zeros(1, int)
    )
