"""Figures of a calibration: numbers with their intervals, errors before and after, profiles of the posterior."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from subzero.calibration.results import Calibration, Estimate, Profile
from subzero.figures import style
from subzero.figures.style import BOTTOM, TOP, WIDTH, Title, headline, legend, log_scale, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROW = 0.2
"""Height of a row of a list of numbers. [inch]"""
LEGEND = 0.75
"""Height of the legend below the profiles. [inch]"""
RISE_95 = 3.84
"""Rise of −2 log posterior at the ends of an interval of 95 %."""
COLUMNS = 4
"""Panels of profiles in a row, at most."""


def draw_calibration(found: Calibration, title: Title) -> dict[str, Figure]:
    """Return the figures of a calibration by the ending of their file's name; profiles only if they were made."""
    figures = {"numbers": numbers(found, title), "errors": errors(found, title)}
    return {**figures, "profiles": profiles(found, title)} if found.profiles else figures


def numbers(found: Calibration, title: Title) -> Figure:
    """Draw every number with its interval, as a share of the number in the file; the prior in grey."""
    figure, (axes,) = sheet(1, 1, title)
    height = TOP + 0.4 + BOTTOM + ROW * max(len(found.estimates), 4)
    _resize(figure, height, left=0.36)
    for at, estimate in enumerate(found.estimates):
        scale = abs(estimate.before) or estimate.prior_sd
        prior = 196.0 * estimate.prior_sd / scale
        axes.barh(
            at,
            2.0 * prior,
            left=-prior,
            height=0.7,
            color=style.PALE,
            label=None if at else "95 % beforehand",
        )
        low, value, high = (
            100.0 * (x - estimate.before) / scale for x in (estimate.low, estimate.value, estimate.high)
        )
        colour = style.BLUE if estimate.is_determined else style.ORANGE
        axes.plot(
            [low, high],
            [at, at],
            color=colour,
            linewidth=2.2,
            solid_capstyle="butt",
            label=None if at else "95 % calibrated",
        )
        axes.plot(value, at, "o", color=colour, markersize=4.0)
    axes.axvline(
        0.0, color=style.INK, linewidth=0.8, linestyle=style.DASHES[1], label="as in the file before"
    )
    axes.set_yticks(
        range(len(found.estimates)), [_label(each) for each in found.estimates], fontsize=style.TINY
    )
    axes.set_ylim(len(found.estimates) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    axes.set_xlim(*_span(found))
    axes.set_xlabel("change [% of the number; of its prior where that is 0]", fontsize=style.NORMAL)
    axes.legend(fontsize=style.TINY, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False)
    return figure


def _span(found: Calibration) -> tuple[float, float]:
    """Return the range of the axis: all intervals, and a part of the prior."""
    ends = [
        100.0 * (x - estimate.before) / (abs(estimate.before) or estimate.prior_sd)
        for estimate in found.estimates
        for x in (estimate.low, estimate.high)
    ]
    far = max(20.0, *map(abs, ends)) * 1.1
    return -far, far


def _label(estimate: Estimate) -> str:
    unit = "" if estimate.unit == "1" else f" [{estimate.unit}]"
    name = estimate.name.removeprefix("vehicle.").replace("_", " ").replace(".", ": ")
    return f"{name}{unit}  {estimate.before:.3g} → {estimate.value:.3g}"


def errors(found: Calibration, title: Title) -> Figure:
    """Draw the error of every channel before and after, in noise levels, in records that were not fitted."""
    names = list(dict.fromkeys(channel for rows in found.held_out.values() for channel in rows))
    figure, panels = sheet(len(found.held_out), 1, title)
    bars = {
        "before": (style.ORANGE, "before"),
        "after": (style.BLUE, "calibrated, not fitted"),
        "fitted": (style.SKY, "calibrated, fitted"),
    }
    for axes, (record, rows) in zip(panels, found.held_out.items(), strict=True):
        for at, (key, (colour, words)) in enumerate(bars.items()):
            heights = [getattr(rows[name], key) if name in rows else math.nan for name in names]
            axes.bar(np.arange(len(names)) + 0.27 * (at - 1), heights, 0.27, color=colour, label=words)
        axes.axhline(1.0, color=style.INK, linewidth=0.9, linestyle=style.DASHES[1])
        log_scale(axes)
        tops = [getattr(row, key) for row in rows.values() for key in bars]
        axes.set_ylim(0.3, 2.0 * max([1.0, *(x for x in tops if math.isfinite(x))]))
        axes.set_xticks(range(len(names)), [name.replace("_", " ") for name in names], fontsize=style.SMALL)
        axes.set_ylabel("RMS error / noise", fontsize=style.NORMAL)
        headline(axes, f"{record}: held out, {found.how}")
    legend(panels[0])
    return figure


def profiles(found: Calibration, title: Title) -> Figure:
    """Draw how much worse the fit gets with each number held at other values, and its interval."""
    columns = min(len(found.profiles), COLUMNS)
    figure, panels = sheet(math.ceil(len(found.profiles) / columns), columns, title)
    for axes, (name, each) in zip(panels, found.profiles.items(), strict=False):
        _profile(axes, each, found[name])
        section, _, key = name.removeprefix("vehicle.").replace("_", " ").rpartition(".")
        axes.set_title(f"{section}:\n{key}", loc="left", fontsize=style.TINY, pad=3)
    for axes in panels[len(found.profiles) :]:
        axes.remove()
    figure.supylabel("rise of −2 log posterior", fontsize=style.NORMAL, x=0.02)
    handles, words = panels[0].get_legend_handles_labels()
    figure.legend(handles, words, fontsize=style.TINY, loc="lower center", ncols=3, frameon=False)
    figure.subplots_adjust(hspace=0.55, wspace=0.34, bottom=LEGEND / figure.get_figheight())
    return figure


def _profile(axes: Axes, profile: Profile, estimate: Estimate) -> None:
    """Draw a profile, the parabola of the interval, and the level at its ends."""
    grid = np.linspace(profile.values[0], profile.values[-1], 80)
    axes.plot(
        grid,
        ((grid - estimate.value) / estimate.sd) ** 2,
        color=style.GREY,
        linewidth=1.0,
        linestyle=style.DASHES[1],
        label="what the interval supposes",
    )
    axes.plot(profile.values, profile.rise, "o", color=style.BLUE, markersize=3.0)
    axes.plot(grid, _between(profile, grid), color=style.BLUE, linewidth=1.2, label="all else fitted again")
    axes.axhline(RISE_95, color=style.ORANGE, linewidth=0.8, label=f"ends of 95 %: {RISE_95}")
    axes.set_ylim(0.0, 14.0)
    axes.xaxis.set_major_locator(MaxNLocator(3))
    unit = "" if estimate.unit == "1" else f"[{estimate.unit}]"
    axes.set_xlabel(unit, fontsize=style.SMALL, labelpad=1)


def _between(profile: Profile, grid: np.ndarray) -> np.ndarray:
    """Return a profile between its points, from its signed root, which is nearly linear."""
    root = np.sqrt(profile.rise) * np.where(
        np.arange(profile.rise.size) < int(np.argmin(profile.rise)), -1.0, 1.0
    )
    between: np.ndarray = np.interp(grid, profile.values, root)
    return between**2


def _resize(figure: Figure, height: float, left: float) -> None:
    figure.set_size_inches(WIDTH, height)
    figure.subplots_adjust(left=left, bottom=BOTTOM / height, top=1.0 - (TOP + 0.36) / height)
    for text in figure.texts:
        text.set_y(1.0 - 0.09 / height)
    figure.texts[0].set_x(0.02)
