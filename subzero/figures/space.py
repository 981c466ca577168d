"""The cable in space: its shapes in three dimensions."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from subzero.figures import style
from subzero.figures.cable import CHANNEL, SHAPES, axes_of, way_of_drum
from subzero.figures.style import Title, spread

if TYPE_CHECKING:
    import xarray as xr

SIDE = 5.4
"""Width and height of a view in space. [inch]"""
LETTERS_A_LINE = 64
FLATTEST = 0.2
"""The shortest edge of a view in space is at least this share of the longest, so that a flat track has a depth."""
TICKS = 4


def shape_3d(run: xr.Dataset, title: Title, count: int = SHAPES) -> Figure:
    """Draw the cable at some times in space, tow point and drum, and the way of the tow point; down is down.

    Args:
        run: a run with a cable; of another, the track of the hull alone is drawn.
        title: what stands above it.
        count: how many shapes, spread over the run.
    """
    figure = Figure(figsize=(SIDE, SIDE), dpi=style.DPI, facecolor="white")
    FigureCanvasAgg(figure)
    axes: Any = figure.add_subplot(projection="3d")
    figure.subplots_adjust(left=0.0, right=0.94, bottom=0.04, top=0.92)
    words = "\n".join(textwrap.wrap(title.words, LETTERS_A_LINE)[:2])
    figure.text(0.05, 0.97, words, va="top", fontsize=style.LARGE, parse_math=False)
    has_cable = bool(run["node_count"].values.any())
    way = run["cable_position"].values[:, 0] if has_cable else _track(run)
    axes.plot(
        *way.T,
        color=style.GREY,
        linewidth=0.9,
        linestyle=":",
        label=f"way of the {'tow point' if has_cable else 'hull'}",
    )
    if has_cable:
        _shapes(run, axes, count)
        axes.plot(*way_of_drum(run)[-1:].T, "s", color=style.INK, markersize=4.5, label="drum")
    names = axes_of(run) if has_cable else ("north", "east", "depth")
    for set_label, name in zip((axes.set_xlabel, axes.set_ylabel, axes.set_zlabel), names, strict=True):
        set_label(f"{name} [m]", fontsize=style.SMALL)
    axes.tick_params(labelsize=style.TINY)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(TICKS, steps=[1, 2, 5, 10]))
    axes.invert_yaxis()  # north, east, down is right-handed only with both turned
    axes.invert_zaxis()
    _in_proportion(axes)
    axes.legend(fontsize=style.TINY, loc="upper left", bbox_to_anchor=(0.0, 0.94), frameon=False)
    return figure


def _shapes(run: xr.Dataset, axes: Any, count: int) -> None:
    """Draw the cable at some times, with a dot at the tow point."""
    times = spread(count, run.sizes["time"])
    for at, share in zip(times, np.linspace(0.0, 0.85, len(times)), strict=True):
        place, colour = run["cable_position"].values[at], colormaps["viridis"](share)
        axes.plot(*place.T, color=colour, linewidth=1.4, label=f"{run['time'].values[at]:.3g} s")
        axes.plot(*place[:1].T, "o", color=colour, markersize=3.5)


def _track(run: xr.Dataset) -> np.ndarray:
    """Return where the hull goes (n, 3). [m]"""
    return np.stack([run[name].values for name in CHANNEL], axis=1)


def _in_proportion(axes: Any) -> None:
    """Show all directions in one scale; an edge that would vanish is made `FLATTEST` of the longest."""
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    span = np.abs(np.diff(limits, axis=1)).ravel()
    wanted = np.maximum(span, FLATTEST * span.max())
    for set_limits, (low, high), size in zip(
        (axes.set_xlim, axes.set_ylim, axes.set_zlim), limits, wanted, strict=True
    ):
        middle, half = 0.5 * (low + high), 0.5 * size * np.sign(high - low)
        set_limits(middle - half, middle + half)
    axes.set_box_aspect(wanted, zoom=0.88)
