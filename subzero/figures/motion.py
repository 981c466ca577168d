"""The motion of the vehicle: the four panels of Fig. 6, its actuators and its attitude."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.channels import BY_NAME, LISTED
from subzero.figures import style
from subzero.figures.style import (
    Runs,
    Title,
    channel_panel,
    headline,
    in_time,
    label,
    legend,
    sheet,
    time_label,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from subzero.records.record import Record

ATTITUDE = {
    "propeller_speed": "Propeller speed",
    "depth": "Depth",
    "rudder_angle": "Rudder angle, positive to starboard",
    "roll_angle": "Roll, positive starboard side down",
    "stern_plane_port_angle": "Stern-planes, positive raises the nose",
    "pitch": "Pitch, positive nose up",
}
SHOWN = ("surge_speed", "heading", *ATTITUDE)
"""Channels that have a panel of their own in every comparison."""

SEEN = 1e-3
"""Two angles that differ by less are one line. [degree]"""


def figure_6(runs: Runs, record: Record | None, title: Title) -> Figure:
    """Draw Fig. 6 of Feng and Allen (2004): propeller command, forward speed, rudder command, heading.

    The command of the rudder is drawn together with its angle: the response of its servo, with feedback of its
    position or without, which is what the paper names as the improvement.
    """
    figure, panels = sheet(2, 2, title)
    propeller, speed, rudder, heading = panels
    longest = max(runs.values(), key=lambda run: run.sizes["time"])
    _command(propeller, longest, "propeller_command", "$n_c$ [rev/s]")
    headline(propeller, "Propeller command")
    channel_panel(speed, runs, "surge_speed", record)
    headline(speed, "Forward speed")
    legend(speed)
    _rudder(rudder, runs, longest)
    headline(rudder, "Rudder, positive to starboard")
    channel_panel(heading, runs, "heading", record)
    headline(heading, "Heading, clockwise from north")
    time_label(panels, 2)
    return figure


def attitude(runs: Runs, record: Record | None, title: Title) -> Figure:
    """Draw the actuators and the response of the hull: six panels."""
    figure, panels = sheet(3, 2, title)
    for axes, (name, words) in zip(panels, ATTITUDE.items(), strict=True):
        channel_panel(axes, runs, name, record)
        headline(axes, words)
    _starboard_plane(runs, panels[4])
    panels[1].invert_yaxis()
    legend(panels[0])
    time_label(panels, 2)
    return figure


STATION = {
    "north": "Place, northwards of the start",
    "east": "Place, eastwards of the start",
    "depth": "Depth",
    "heading": "Heading, clockwise from north",
    "pitch": "Pitch, positive nose up",
}


def station(runs: Runs, record: Record | None, title: Title) -> Figure:
    """Draw place, heading and pitch; and the commands of the thrusters of one run, or the roll where there are none."""
    figure, panels = sheet(3, 2, title)
    has_thrusters = "thruster_command" in next(iter(runs.values()))
    shown = STATION if has_thrusters else STATION | {"roll_angle": ATTITUDE["roll_angle"]}
    for axes, (name, words) in zip(panels, shown.items(), strict=False):
        channel_panel(axes, runs, name, record)
        headline(axes, words)
    panels[2].invert_yaxis()
    if has_thrusters:
        _thrusters(panels[5], runs)
    legend(panels[0])
    time_label(panels, 2)
    return figure


def _thrusters(axes: Axes, runs: Runs) -> None:
    """Draw the commands of the thrusters of the first run."""
    which, run = next(iter(runs.items()))
    for name, command in zip(run["thruster"].values, run["thruster_command"].values.T, strict=True):
        axes.plot(run["time"].values, command, linewidth=0.8, label=str(name).replace("_", " "))
    label(axes, None, "share of full command [-]")
    headline(axes, f"Thrusters, {which}")
    in_time(axes, runs)
    legend(axes, columns=2)


def actuators(runs: Runs, title: Title) -> Figure | None:
    """Draw fins, moving masses and buoyancy engines of a list, a panel each, of one run; None for a vehicle without."""
    which, run = next(iter(runs.items()))
    thrusters = set(run["thruster"].values.tolist()) if "thruster" in run.coords else set()
    names = {str(each.attrs[LISTED]): None for each in run.variables.values() if LISTED in each.attrs}
    shown = [name for name in names if name not in thrusters]
    if not shown:
        return None
    figure, panels = sheet((len(shown) + 1) // 2, 2, title)
    for axes, name in zip(panels, shown, strict=False):
        channel_panel(axes, {which: run}, f"{name}_state")
        axes.step(
            run["time"].values,
            run[f"{name}_command"].values,
            where="post",
            label="commanded",
            **style.COMMAND,
        )
        headline(axes, name.replace("_", " ").capitalize())
    for axes in panels[len(shown) :]:
        axes.remove()
    legend(panels[0])
    time_label(panels[: len(shown)], 2)
    return figure


def measured(runs: Runs, record: Record, title: Title) -> Figure | None:
    """Draw all measured channels that figure 6 and the attitude do not show; None if there are none."""
    names = [name for name in record.values if name not in SHOWN]
    if not names:
        return None
    figure, panels = sheet((len(names) + 1) // 2, 2, title)
    for axes, name in zip(panels, names, strict=False):
        channel_panel(axes, runs, name, record)
        words = BY_NAME[name].long_name
        headline(axes, words[0].upper() + words[1:])
    legend(panels[0])
    for axes in panels[len(names) :]:
        axes.remove()
    time_label(panels[: len(names)], 2)
    return figure


def _starboard_plane(runs: Runs, axes: Axes) -> None:
    """Add the starboard plane, thin, if it does not do the same as the port plane."""
    for which, run in runs.items():
        port, starboard = (run[f"stern_plane_{side}_angle"].values for side in ("port", "starboard"))
        if np.abs(port - starboard).max() > SEEN:
            thin = {**style.LINES[which], "linewidth": 0.8}
            axes.plot(run["time"].values, starboard, label=f"starboard, {which}", **thin)
            legend(axes)
    label(axes, None, r"$\delta_p$, $\delta_s$ [degree]")


def _rudder(axes: Axes, runs: Runs, longest: xr.Dataset) -> None:
    """Draw the rudder's command and its angle; a run in which they are the same has no line of its own."""
    _command(axes, longest, "rudder_command", r"$\delta_{rc}$, $\delta_r$ [degree]", label="commanded")
    drawn: list[np.ndarray] = []
    for which, run in runs.items():
        angle = run["rudder_angle"].values
        if all(_differ(angle, other) for other in drawn):
            words = _feedback(run) + (f", {which}" if drawn else "")
            axes.plot(run["time"].values, angle, label=f"actual, {words}", **style.LINES[which])
            drawn.append(angle)
    legend(axes, columns=2)


def _differ(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two angles can be distinguished in a figure as long as both are known."""
    both = min(a.size, b.size)
    return float(np.abs(a[:both] - b[:both]).max()) > SEEN


def _feedback(run: xr.Dataset) -> str:
    """Return whether the rudder's servo has feedback of the rudder's position."""
    servo = json.loads(run.attrs["parameters"]).get("vehicle", {}).get("rudder_servo", {})
    return "with feedback" if servo.get("position_feedback", 0.0) > 0.0 else "without feedback"


def _command(axes: Axes, run: xr.Dataset, name: str, unit: str, **more: Any) -> None:
    """Draw a command as the steps it is, with zero in view."""
    axes.step(run["time"].values, run[name].values, where="post", **style.COMMAND, **more)
    label(axes, None, unit)
    in_time(axes, {"": run})
    axes.update_datalim([(0.0, 0.0)])
    axes.autoscale_view(scalex=False)
