"""An empty sheet: a figure with its title and a grid of styled, lettered panels.

Figures are made with matplotlib's objects alone (no pyplot: half the import time, no window, nothing global
is changed) and drawn by Agg. Layout is by hand, because an automatic layout draws everything twice.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from subzero.figures.style import DPI, GREY, LARGE, NORMAL, ORANGE, PALE, SMALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, ROW_HEIGHT = 7.2, 2.1
"""Two columns of a journal page; one row of panels with its time axis. [inch]"""

LEFT, RIGHT = 0.1, 0.985
"""Where the panels begin and end, as shares of the width."""

BOTTOM, TOP, TITLE_LINE = 0.42, 0.31, 0.16
"""Below the panels; above them without the title; one line of the title. [inch]"""

FOOTER, FOOTER_LENGTH = 0.16, 110
"""Height of the line of warnings below the panels [inch], and how many letters fit on it."""

TITLE_LENGTH = 86
"""So many letters of a title fit on a line, with the scenario's name to its right."""

LETTERS = 26
"""More panels than this are not lettered."""


@dataclass(frozen=True, kw_only=True)
class Title:
    """What stands above a figure: the trial in words, and the name of its scenario; and what warns of it, below."""

    words: str
    scenario: str
    warnings: str = ""


def sheet(rows: int, columns: int, title: Title) -> tuple[Figure, list[Axes]]:
    """Return a figure and its empty, styled panels in reading order, lettered if there are several."""
    words = textwrap.wrap(title.words, TITLE_LENGTH)[:2]
    top = TOP + TITLE_LINE * len(words)
    bottom = BOTTOM + (FOOTER if title.warnings else 0.0)
    height = rows * ROW_HEIGHT + bottom + top
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    figure.subplots_adjust(left=LEFT, right=RIGHT, bottom=bottom / height, top=1.0 - top / height)
    figure.subplots_adjust(wspace=0.28, hspace=0.36)
    y = 1.0 - 0.09 / height
    figure.text(LEFT, y, "\n".join(words), va="top", fontsize=LARGE, parse_math=False)
    corner: dict[str, Any] = {"ha": "right", "fontsize": SMALL, "color": GREY}
    figure.text(RIGHT, y, title.scenario, va="top", parse_math=False, **corner)
    if title.warnings:
        footer = textwrap.shorten(title.warnings, FOOTER_LENGTH, placeholder=" …")
        figure.text(LEFT, 0.06 / height, footer, fontsize=SMALL, color=ORANGE, parse_math=False)
    panels = [figure.add_subplot(rows, columns, at + 1) for at in range(rows * columns)]
    for at, axes in enumerate(panels):
        _style(axes)
        if 1 < len(panels) <= LETTERS:
            axes.set_title(f"({chr(ord('a') + at)})", loc="left", fontsize=NORMAL, pad=3)
    return figure, panels


def _style(axes: Axes) -> None:
    """Thin axes, a faint grid, ticks small enough to keep out of the way."""
    axes.grid(visible=True, color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.tick_params(labelsize=SMALL, length=3, width=0.6, color=GREY)
    for side in axes.spines.values():
        side.set_linewidth(0.6)
        side.set_color(GREY)
