"""What a winch does, and a vessel that carries the drum: cable and way, pay-out, tension, and both tracks."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from subzero.figures import style
from subzero.figures.cable import EAST, NORTH, axes_of, in_scale, way_of_drum
from subzero.figures.panel import calm, headline, in_time, label, legend
from subzero.figures.sheet import Title, sheet

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKS = 60.0
"""Tracks carry a dot every so many seconds; in short runs, at a tenth of the run. [s]"""


def is_deployed(run: xr.Dataset) -> bool:
    """Say whether a winch turns the drum or a vessel carries it."""
    told = json.loads(run.attrs["parameters"])
    return any(told.get(name) for name in ("winch", "vessel"))


def deployment(run: xr.Dataset, title: Title) -> Figure:
    """Draw how the cable is deployed."""
    figure, (length, rate, pull, plan) = sheet(2, 2, title)
    time, S = run["time"].values, run["cable_length"].values
    far = np.linalg.norm(run["cable_position"].values[:, 0] - way_of_drum(run), axis=1)
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
    marks = np.searchsorted(time, np.arange(0.0, time[-1] + 1e-9, spacing))
    ways = {"vehicle": run["cable_position"].values[:, 0], "drum": way_of_drum(run)}
    for (words, way), colour in zip(ways.items(), (style.ORANGE, style.BLUE), strict=True):
        axes.plot(way[:, EAST], way[:, NORTH], color=colour, linewidth=1.2, label=words)
        axes.plot(way[marks, EAST], way[marks, NORTH], "o", color=colour, markersize=3.0)
    names = axes_of(run)
    label(axes, f"{names[EAST]} [m]", f"{names[NORTH]} [m]")
    headline(axes, f"Both from above, a dot every {spacing:g} s")
    in_scale(axes)
    legend(axes, loc="best")
