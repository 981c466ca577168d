"""Figures of a finished sweep: bands over time, histograms, outcomes against parameters, main effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from subzero.channels import BY_NAME
from subzero.figures.style import (
    BLUE,
    GREY,
    INK,
    ONE_COLUMN,
    ORANGE,
    SMALL,
    TINY,
    Title,
    calm,
    headline,
    label,
    legend,
    sheet,
    time_label,
    width,
)
from subzero.results.tables import index_in_words
from subzero.sweeps.design import Points
from subzero.sweeps.member import Job
from subzero.sweeps.outcomes import unit_of
from subzero.sweeps.result import RANKS, Gathered
from subzero.sweeps.sensitivity import Effect, description_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS, MOST_ROWS, MOST_COLUMNS = 8, 5, 4
"""Of channels or histograms; of scalars; of parameters. The table and the dataset have all of them."""
MOST_BARS = 12
"""Parameters of a tornado; the others matter less. [-]"""
MOST_DOTS = 5000
"""More dots hide one another. [-]"""
NAME_LENGTH = 26
BAR_LEFT = 0.3
"""Where the bars of a tornado begin: to their left stand the names, as a share of the width."""


def draw_sweep(
    points: Points,
    job: Job,
    found: Gathered,
    effects: list[Effect],
    title: Title,
    names: Sequence[str],
) -> dict[str, Figure]:
    """Return the figures of a sweep by the name of their file.

    Args:
        points: its points.
        job: the job that was run, with the outcomes that were kept.
        found: the results.
        effects: the main effects.
        title: above each.
        names: of those that are drawn, such as "bands", as far as there is something to show.
    """
    alive, figures = _alive(found), {}
    if "bands" in names and job.outcomes.channels and np.isfinite(found.channels).any():
        figures["bands"] = _bands(job, found, title)
    if "histograms" in names and alive:
        figures["histograms"] = _histograms(found, alive, title)
    if "against" in names and alive:
        figures["against"] = _against(points, found, effects, title)
    if "tornado" in names and effects:
        figures["tornado"] = _tornado(points, effects, title)
    return figures


def _alive(found: Gathered) -> list[int]:
    """Return the scalars that have a value at all."""
    return [i for i, column in enumerate(found.scalars.T) if np.isfinite(column).any()]


def _rows(count: int) -> tuple[int, int]:
    """Return rows and columns of a sheet for so many panels."""
    return (1, 1) if count == 1 else ((count + 1) // 2, 2)


def _bands(job: Job, found: Gathered, title: Title) -> Figure:
    """Draw the median of each channel over time, and between which values 50 and 90 % of the members are."""
    names = job.outcomes.channels[:MOST_PANELS]
    figure, panels = sheet(*_rows(len(names)), title)
    for i, (axes, name) in enumerate(zip(panels, names, strict=False)):
        values = found.channels[:, i]
        here = np.isfinite(values).any(axis=0)
        low, lower, middle, upper, high = np.nanpercentile(values[:, here], RANKS, axis=0)
        time = job.outcomes.times[here]
        axes.fill_between(time, low, high, color=BLUE, alpha=0.18, linewidth=0, label="5 to 95 %")
        axes.fill_between(time, lower, upper, color=BLUE, alpha=0.35, linewidth=0, label="25 to 75 %")
        axes.plot(time, middle, color=BLUE, linewidth=1.5, label="median")
        channel = BY_NAME[name]
        label(axes, None, f"${channel.symbol}$ [{channel.unit}]")
        headline(axes, channel.long_name[0].upper() + channel.long_name[1:])
        axes.set_xlim(0.0, max(float(time[-1]), 1e-9))
        calm(axes, smallest=1e-3)
    legend(panels[0])
    time_label(panels, _rows(len(names))[1])
    _hide(panels, len(names))
    return figure


def _histograms(found: Gathered, alive: list[int], title: Title) -> Figure:
    """Draw how often each scalar has which value."""
    shown = alive[:MOST_PANELS]
    figure, panels = sheet(*_rows(len(shown)), title)
    figure.subplots_adjust(hspace=0.62)
    for axes, i in zip(panels, shown, strict=False):
        values = found.scalars[np.isfinite(found.scalars[:, i]), i]
        flat = np.ptp(values) <= 1e-9 * max(np.abs(values).max(), 1e-300)
        axes.hist(
            values,
            bins=1 if flat else int(np.clip(np.sqrt(values.size), 5, 60)),
            color=BLUE,
            alpha=0.75,
            edgecolor="white",
            linewidth=0.4,
        )
        for rank, dash in ((5.0, ":"), (50.0, "-"), (95.0, ":")):
            axes.axvline(np.percentile(values, rank), color=ORANGE, linewidth=1.1, linestyle=dash)
        label(axes, f"[{unit_of(found.names[i])}]", "members")
        headline(axes, _scalar(found.names[i]))
    _hide(panels, len(shown))
    panels[0].plot([], [], color=ORANGE, label="median, 5 and 95 %")
    legend(panels[0], 1)
    return figure


def _against(points: Points, found: Gathered, effects: list[Effect], title: Title) -> Figure:
    """Draw scalars over parameters, those that matter most first."""
    scalars = _alive(found)[:MOST_ROWS]
    parameters = _important(points, effects)[:MOST_COLUMNS]
    figure, panels = sheet(len(scalars), len(parameters), title)
    figure.subplots_adjust(hspace=0.3, wspace=0.34, left=0.12)
    every = max(1, len(points.values) // MOST_DOTS)
    size = float(np.clip(3000.0 / max(len(points.values) // every, 1), 1.5, 12.0))
    for at, axes in enumerate(panels):
        row, column = divmod(at, len(parameters))
        i, k = scalars[row], parameters[column]
        axes.set_title("", loc="left")
        x, y = points.values[::every, k], found.scalars[::every, i]
        axes.scatter(x, y, s=size, color=BLUE, alpha=0.45, linewidths=0, rasterized=True)
        if row == len(scalars) - 1:
            axes.set_xlabel(f"{_short(points.names[k])}\n[{points.spreads[k].unit}]", fontsize=SMALL)
        if column == 0:
            axes.set_ylabel(f"{_scalar(found.names[i])}\n[{unit_of(found.names[i])}]", fontsize=SMALL)
        axes.locator_params(axis="x", nbins=4)
    figure.subplots_adjust(bottom=figure.subplotpars.bottom + 0.16 / figure.get_figheight())
    return figure


def _important(points: Points, effects: list[Effect]) -> list[int]:
    """Return the parameters, those first that matter more: by the sum of their shares in each scalar."""
    total = dict.fromkeys(points.names, 0.0)
    for scalar in dict.fromkeys(effect.scalar for effect in effects):
        own = [effect for effect in effects if effect.scalar == scalar]
        largest = max((abs(item.size) for item in own if item.size == item.size), default=0.0)
        for each in own:
            if largest > 0.0 and each.size == each.size:
                total[each.parameter] += abs(each.size) / largest
    return sorted(range(len(points.names)), key=lambda k: -total[points.names[k]])


def _tornado(points: Points, effects: list[Effect], title: Title) -> Figure:
    """Draw how much each parameter moves each scalar, the greatest on top."""
    scalars = list(dict.fromkeys(effect.scalar for effect in effects))[:MOST_ROWS]
    method, first, second = description_of(points.design)
    figure, panels = sheet(len(scalars), 1, title)
    bars = min(MOST_BARS, len(points.names))
    usual, more = figure.get_figheight(), len(scalars) * 0.12 * max(bars - 5, 0)
    figure.set_size_inches(width(), usual + more)
    figure.subplots_adjust(left=BAR_LEFT if width() >= ONE_COLUMN else 2.0 * BAR_LEFT, right=0.97)
    figure.subplots_adjust(hspace=0.5 * usual / (usual + more))
    for axes, scalar in zip(panels, scalars, strict=True):
        own = [effect for effect in effects if effect.scalar == scalar][:MOST_BARS]
        places = np.arange(len(own))
        errors = [each.error if each.error == each.error else 0.0 for each in own]
        sizes = [each.size for each in own]
        axes.barh(places, sizes, color=BLUE, alpha=0.75, height=0.62, label=first)
        if any(errors):
            axes.errorbar(sizes, places, xerr=errors, fmt="none", ecolor=INK, elinewidth=0.8)
        if second:
            axes.plot([each.other for each in own], places, "o", color=ORANGE, markersize=3.5, label=second)
        axes.set_yticks(places, [_short(each.parameter, 34) for each in own], fontsize=TINY)
        axes.invert_yaxis()
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        if points.design not in ("morris", "saltelli"):
            axes.set_xlim(-1.0, 1.0)
        headline(axes, _scalar(scalar) + (f" [{unit_of(scalar)}]" if points.design == "morris" else ""))
    panels[-1].set_xlabel(method, fontsize=SMALL)
    if second:
        panels[0].legend(fontsize=SMALL, loc="lower right", framealpha=0.85, edgecolor="none")
    return figure


def _scalar(name: str) -> str:
    """Return a number of a run in words, without its unit: ``peak_speed_m_s`` is "peak speed"."""
    return index_in_words(name).partition(" [")[0].replace(".", ", ")


def _short(name: str, most: int = NAME_LENGTH) -> str:
    """Return a name without its first parts, where it has too many letters: `propeller.diameter`, of the vehicle."""
    while len(name) > most and "." in name:
        name = name.partition(".")[2]
    return name if len(name) <= most else f"…{name[-most + 1 :]}"


def _hide(panels: list[Axes], used: int) -> None:
    """Take away the panels that are left over."""
    for axes in panels[used:]:
        axes.set_visible(False)
