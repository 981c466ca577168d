"""One figure of a manoeuvre: the track, the heading, the speed and what was commanded, with the cable and without."""

from __future__ import annotations

from typing import TYPE_CHECKING

from subzero.figures.panel import channel_panel, headline, label, legend, time_label
from subzero.figures.sheet import Title, sheet
from subzero.figures.style import LINES, Runs, warnings_in_short

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEADLINES = {
    "heading": "Heading, clockwise from north",
    "depth": "Depth",
    "pitch": "Pitch, positive nose up",
    "surge_speed": "Forward speed",
    "rudder_command": "Rudder command, positive to starboard",
    "stern_plane_port_command": "Port plane command, positive nose up",
    "propeller_command": "Propeller command",
}


def picture(runs: Runs, title: str, answer: str, command: str) -> Figure:
    """Return the figure of a manoeuvre.

    Args:
        runs: tethered, untethered or both.
        title: above it.
        answer: the channel that shows the answer of the vehicle.
        command: the channel that was commanded.
    """
    first = next(iter(runs.values()))
    figure, panels = sheet(
        2, 2, Title(words=title, scenario=first.attrs["scenario"], warnings=warnings_in_short(runs))
    )
    _track(panels[0], runs)
    for axes, name in zip(panels[1:], (answer, "surge_speed", command), strict=True):
        channel_panel(axes, runs, name)
        headline(axes, HEADLINES[name])
    legend(panels[1])
    time_label(panels, 2)
    panels[2].set_xlabel(panels[3].get_xlabel())
    return figure


def _track(axes: Axes, runs: Runs) -> None:
    """Draw the ways of the hull centre, seen from above, with equal scales."""
    for name, run in runs.items():
        axes.plot(run["east"].values, run["north"].values, label=name, **LINES[name])
    axes.set_aspect("equal", adjustable="datalim")
    label(axes, "east [m]", "north [m]")
    headline(axes, "Track from above")
