"""The cable: its shape, its tension along its length, and its force on the vehicle.

`tension` shows the pull along the whole cable at all times, and between which values it has been (a range graph).
`deployment` shows what a winch does, or a vessel that carries the drum: cable and distance, pay-out, tension, tracks.
`shape_3d` shows the cable in space.
"""

from __future__ import annotations

import json
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from subzero.figures import style
from subzero.figures.style import Title, calm, headline, in_time, label, legend, sheet, spread

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


Colour = tuple[float, float, float, float]
NORTH, EAST, DOWN = 0, 1, 2
AXES = ("north of the drum", "east of the drum", "below the drum")
MOVING = ("north of the vessel's start", "east of the vessel's start", "below the vessel")
CHANNEL = ("north", "east", "depth")
TINY = 1e-9
RESTING = 1e-6
"""A drum that moves less than this stands. [m]"""
SHORTEST = 0.1
"""A view shows at least this much, even if nothing has moved. [m]"""

FLAT = 8.0
"""A view that is so many times as wide as what it shows is high is stretched upwards, and says so. [-]"""
ALONG, OVER = 240, 400
"""Points along the cable and times of an image of the tension, at most. [-]"""

SHAPES = 5
"""So many shapes show how a cable grows, and can still be distinguished."""
SIDE = 5.4
"""Width and height of a view in space. [inch]"""
LETTERS_A_LINE = 64
FLATTEST = 0.2
"""The shortest edge of a view in space is at least this share of the longest, so that a flat track has a depth."""
TICKS = 4


def shape(run: xr.Dataset, title: Title) -> Figure:
    """Draw the cable at several times from above and from the side, and the tension along it."""
    figure, panels = sheet(2, 2, title)
    along = longest(run, NORTH, EAST)
    views = ((panels[0], EAST, NORTH), (panels[1], along, DOWN))
    times = spread(SHAPES, run.sizes["time"])
    colours = [colormaps["viridis"](fraction) for fraction in np.linspace(0.0, 0.85, len(times))]
    for at, colour in zip(times, colours, strict=True):
        for axes, right, up in views:
            _one_shape(run["cable_position"].values[at], axes, right, up, colour)
        _one_tension(run, int(at), panels[2], colour)
    names = axes_of(run)
    for axes, right, up in views:
        _track(run, axes, right, up, times, colours)
        label(axes, f"{names[right]} [m]", f"{names[up]} [m]")
    in_scale(panels[0])
    stretched = in_scale(panels[1], stretch=True)
    panels[1].invert_yaxis()
    headline(panels[0], "The cable from above")
    side = "east" if along == NORTH else "south"
    far = f"From the {side}; depth stretched {stretched:.0f} times"
    headline(panels[1], far if stretched > 1.0 else f"The cable from the {side}")
    headline(panels[2], "Tension along the cable")
    label(panels[2], "distance from the vehicle $s$ [m]", "$T$ [N]")
    legend(panels[2])
    _pull(run, panels[3])
    return figure


def tension(run: xr.Dataset, title: Title) -> Figure | None:
    """Draw the tension along the cable over time as an image, and the largest and the smallest that was anywhere.

    None without a cable that has two nodes at two times.
    """
    along, values = tension_along(run)
    if along.size < 2 or values.shape[0] < 2:
        return None
    figure, (image, graph) = sheet(1, 2, title)
    left, bottom, width, height = image.get_position().bounds
    image.set_position((left, bottom, 0.84 * width, height))  # a bar of colours stands to its right
    times = run["time"].values[spread(OVER, run.sizes["time"])]
    drawn = image.pcolormesh(along, times, values, cmap=style.TENSION, shading="nearest", rasterized=True)
    image.grid(visible=False)
    bar = figure.colorbar(drawn, cax=image.inset_axes((1.03, 0.0, 0.05, 1.0)))
    bar.ax.tick_params(labelsize=style.SMALL, length=2)
    bar.ax.set_title("$T$ [N]", fontsize=style.SMALL, pad=3)
    headline(image, "Tension along the cable")
    label(image, "distance from the vehicle $s$ [m]", "time [s]")
    _range(graph, along, values)
    return figure


def tension_along(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return distances from the vehicle (points,) [m] and the tension there (times, points) [N], NaN beyond the drum.

    Times are those of `OVER`; a cable that has no more than one node has no tension anywhere.
    """
    times = spread(OVER, run.sizes["time"])
    place, pull = run["cable_position"].values[times], run["cable_node_tension"].values[times]
    pieces = np.linalg.norm(np.diff(place, axis=1), axis=2)
    arc = np.concatenate([np.zeros((times.size, 1)), np.cumsum(pieces, axis=1)], axis=1)
    longest = float(np.nanmax(arc, initial=0.0))
    if longest <= SHORTEST:
        return np.empty(0), np.empty((0, 0))
    along = np.linspace(0.0, longest, ALONG)
    values = np.full((times.size, ALONG), np.nan)
    for row, (s, T) in enumerate(zip(arc, pull, strict=True)):
        known = np.isfinite(s) & np.isfinite(T)
        if known.sum() > 1:
            values[row] = np.interp(along, s[known], T[known], right=np.nan)
    return along, values


def _range(axes: Axes, along: np.ndarray, values: np.ndarray) -> None:
    """Draw the range graph: between which tensions every place along the cable has been."""
    here = np.isfinite(values).any(axis=0)
    low, high = np.nanmin(values[:, here], axis=0), np.nanmax(values[:, here], axis=0)
    axes.fill_between(along[here], low, high, color=style.PALE, linewidth=0)
    axes.plot(along[here], high, color=style.ORANGE, linewidth=1.5, label="largest")
    axes.plot(along[here], low, color=style.BLUE, linewidth=1.3, linestyle=style.DASHES[1], label="smallest")
    axes.plot(along, values[-1], color=style.INK, linewidth=1.0, label="at the end")
    headline(axes, "Largest and smallest tension")
    label(axes, "distance from the vehicle $s$ [m]", "$T$ [N]")
    axes.set_xlim(0.0, float(along[-1]))
    calm(axes)
    legend(axes)


def configurations(run: xr.Dataset, axes: Axes, times: list[float]) -> None:
    """Draw Fig. 5 (b): the cable at some times, in the plane in which the vehicle goes."""
    across = longest(run, DOWN, EAST)
    now = run["time"].values
    shown = [time for time in times if time <= now[-1] + TINY]
    for time, colour in zip(shown, style.CYCLE, strict=False):
        place = run["cable_position"].values[int(np.argmin(np.abs(now - time)))]
        axes.plot(place[:, NORTH], place[:, across], color=colour, linewidth=1.3, label=f"{time:g} s")
    names = axes_of(run)
    label(axes, f"{names[NORTH]} [m]", f"{names[across]} [m]")
    in_scale(axes)
    axes.invert_yaxis()  # down is down; and from above, with north to the right, east is down


def drum_direction(run: xr.Dataset) -> np.ndarray:
    """Return where the drum is, relative to its place at the start (n, 3); without a cable it is not known. [m]."""
    nodes = run["node_count"].values
    places: np.ndarray = run["cable_position"].values[np.arange(nodes.size), np.maximum(nodes - 1, 0)]
    return places


def axes_of(run: xr.Dataset) -> tuple[str, str, str]:
    """Return the labels of the earth axes: counted from a drum that is at rest, or from the start of a vessel."""
    return MOVING if np.ptp(drum_direction(run), axis=0).max() > RESTING else AXES


def longest(run: xr.Dataset, *candidates: int) -> int:
    """Return that one of some earth axes along which the vehicle goes farthest, the first if alike."""
    reach = [float(np.ptp(run[CHANNEL[axis]].values)) for axis in candidates]
    return candidates[int(np.argmax(reach))]


def in_scale(axes: Axes, *, stretch: bool = False) -> float:
    """Show both directions in the same scale, by widening the one that has space to spare.

    Args:
        axes: a view of the cable.
        stretch: leave what would be a flat line as high as the panel.

    Returns:
        how many times the vertical is stretched: 1 of an equal scale.
    """
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    width, height = axes.get_window_extent().size
    if stretch and right - left > FLAT * max(top - bottom, SHORTEST) * width / height:
        middle, half = 0.5 * (bottom + top), 0.5 * max(top - bottom, SHORTEST)
        axes.set_ylim(middle - half, middle + half)
        return (right - left) / (2.0 * half) * height / width
    scale = max((right - left) / width, (top - bottom) / height, SHORTEST / width)
    x, y = 0.5 * (left + right), 0.5 * (bottom + top)
    axes.set_xlim(x - 0.5 * scale * width, x + 0.5 * scale * width)
    axes.set_ylim(y - 0.5 * scale * height, y + 0.5 * scale * height)
    return 1.0


def _one_shape(place: np.ndarray, axes: Axes, right: int, up: int, colour: Colour) -> None:
    """Draw the cable at one time in one view, with a dot where the vehicle is."""
    axes.plot(place[:, right], place[:, up], color=colour, linewidth=1.3)
    axes.plot(place[0, right], place[0, up], "o", color=colour, markersize=3.5)


def _one_tension(run: xr.Dataset, at: int, axes: Axes, colour: Colour) -> None:
    """Draw the tension along the cable at one time."""
    pieces = np.linalg.norm(np.diff(run["cable_position"].values[at], axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(pieces)])
    words = f"{run['time'].values[at]:.3g} s"
    axes.plot(s, run["cable_node_tension"].values[at], color=colour, linewidth=1.3, label=words)


def _track(
    run: xr.Dataset, axes: Axes, right: int, up: int, times: np.ndarray, colours: list[Colour]
) -> None:
    """Draw where the tow point went, and the drum, behind the shapes; if the drum moves, its way and its places."""
    tow, drum = run["cable_position"].values[:, 0], drum_direction(run)
    axes.plot(tow[:, right], tow[:, up], color=style.GREY, linewidth=0.9, linestyle=":", zorder=1.5)
    if axes_of(run) is AXES:
        axes.plot(0.0, 0.0, "s", color=style.INK, markersize=4.5)
        return
    axes.plot(drum[:, right], drum[:, up], color=style.INK, linewidth=0.9, linestyle="--", zorder=1.5)
    for at, colour in zip(times, colours, strict=True):
        axes.plot(drum[at, right], drum[at, up], "s", color=colour, markersize=4.5)


def _pull(run: xr.Dataset, axes: Axes) -> None:
    """Draw the tension at both ends over time."""
    time = run["time"].values
    axes.plot(time, run["cable_tension"].values, color=style.BLUE, linewidth=1.5, label="$T(0)$, tow point")
    axes.plot(time, run["drum_tension"].values, color=style.GREEN, linewidth=1.2, label="$T(S)$, drum")
    headline(axes, "Tension at the ends")
    label(axes, "time [s]", "$T$ [N]")
    in_time(axes, {"": run})
    calm(axes)
    legend(axes)


MARKS = 60.0
"""Tracks carry a dot every so many seconds; in short runs, at a tenth of the run. [s]"""


def is_deployed(run: xr.Dataset) -> bool:
    """Return whether a winch turns the drum or a vessel carries it."""
    reported = json.loads(run.attrs["parameters"])
    return any(reported.get(name) for name in ("winch", "vessel"))


def deployment(run: xr.Dataset, title: Title) -> Figure:
    """Draw how the cable is deployed."""
    figure, (length, rate, pull, plan) = sheet(2, 2, title)
    time, S = run["time"].values, run["cable_length"].values
    far = np.linalg.norm(run["cable_position"].values[:, 0] - drum_direction(run), axis=1)
    length.plot(time, S, color=style.BLUE, linewidth=1.5, label="$S$, cable in the water")
    length.plot(time, far, color=style.ORANGE, linestyle=style.DASHES[1], label="from drum to vehicle")
    headline(length, "Cable in the water, and the straight way")
    label(length, "time [s]", "length [m]")
    rate.plot(time, np.gradient(S, time) if time.size > 1 else 0.0 * time, color=style.BLUE, linewidth=1.5)
    headline(rate, "Pay-out rate, negative reels in")
    label(rate, "time [s]", "$dS/dt$ [m/s]")
    pull.plot(time, run["drum_tension"].values, color=style.GREEN, linewidth=1.5)
    headline(pull, "Tension at the drum")
    label(pull, "time [s]", "$T(S)$ [N]")
    for axes in (length, rate, pull):
        in_time(axes, {"": run})
        calm(axes)
    legend(length, columns=1)
    _tracks(run, plan)
    return figure


def _tracks(run: xr.Dataset, axes: Axes) -> None:
    """Draw the ways of vehicle and drum from above, with a dot every minute."""
    time = run["time"].values
    spacing = MARKS if time[-1] >= 2.0 * MARKS else max(0.1 * time[-1], 1e-9)
    marks = np.searchsorted(
        time, np.arange(0.0, time[-1] + 1e-9, spacing) - 1e-9
    )  # the last may round beyond
    ways = {"vehicle": run["cable_position"].values[:, 0], "drum": drum_direction(run)}
    for (words, way), colour in zip(ways.items(), (style.ORANGE, style.BLUE), strict=True):
        axes.plot(way[:, EAST], way[:, NORTH], color=colour, linewidth=1.2, label=words)
        axes.plot(way[marks, EAST], way[marks, NORTH], "o", color=colour, markersize=3.0)
    names = axes_of(run)
    label(axes, f"{names[EAST]} [m]", f"{names[NORTH]} [m]")
    headline(axes, f"Both from above, a dot every {spacing:g} s")
    legend(axes)
    in_scale(axes)


def shape_3d(run: xr.Dataset, title: Title) -> Figure:
    """Draw the cable at some times in space, tow point and drum, and the way of the tow point; down is down.

    Args:
        run: a run with a cable; of another, the track of the hull alone is drawn.
        title: the title above it.
    """
    figure = Figure(figsize=(SIDE, SIDE), dpi=style.DPI, facecolor="white")
    FigureCanvasAgg(figure)
    axes: Any = figure.add_subplot(projection="3d")
    figure.subplots_adjust(left=0.0, right=0.94, bottom=0.04, top=0.92)
    words = "\n".join(textwrap.wrap(title.words, LETTERS_A_LINE)[:2])
    figure.text(0.05, 0.97, words, va="top", fontsize=style.LARGE, parse_math=False)
    has_cable = bool(run["node_count"].values.any())
    hull = np.stack([run[name].values for name in CHANNEL], axis=1)
    way = run["cable_position"].values[:, 0] if has_cable else hull
    axes.plot(
        *way.T,
        color=style.GREY,
        linewidth=0.9,
        linestyle=":",
        label=f"way of the {'tow point' if has_cable else 'hull'}",
    )
    if has_cable:
        _shapes_in_space(run, axes)
        axes.plot(*drum_direction(run)[-1:].T, "s", color=style.INK, markersize=4.5, label="drum")
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


def _shapes_in_space(run: xr.Dataset, axes: Any) -> None:
    """Draw the cable at some times, with a dot at the tow point."""
    times = spread(SHAPES, run.sizes["time"])
    for at, share in zip(times, np.linspace(0.0, 0.85, len(times)), strict=True):
        place, colour = run["cable_position"].values[at], colormaps["viridis"](share)
        axes.plot(*place.T, color=colour, linewidth=1.4, label=f"{run['time'].values[at]:.3g} s")
        axes.plot(*place[:1].T, "o", color=colour, markersize=3.5)


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
