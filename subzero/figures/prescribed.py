"""Prescribed motions: Fig. 4 (straight ahead, with its exact solution) and Fig. 5 of the paper."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from subzero.channels import BY_NAME
from subzero.figures import style
from subzero.figures.cable import DOWN, EAST, configurations, longest
from subzero.figures.forces import cable_forces
from subzero.figures.style import (
    CYCLE,
    DASHES,
    Title,
    calm,
    headline,
    in_time,
    label,
    legend,
    sheet,
    spread,
    time_label,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHAPE_TIMES = [10.0, 15.0, 20.0, 25.0, 30.0]
"""The times of Fig. 5 (b), for runs that last no longer. [s]"""

ROUNDING = 1e-9
"""An angle [degree] that moves less than this, and a speed across [m/s] below it, are a straight course."""

NEUTRAL = 1e-6
"""A cable whose mass is that of the water it displaces, to within this share, neither sinks nor floats."""

DOTS_SHOWN = 61


def is_straight(run: xr.Dataset) -> bool:
    """Return whether the run pulls a neutral cable straight off a free drum in still water, which has an exact
    solution.
    """
    turns = max(float(np.ptp(run[name].values)) for name in ("pitch", "heading", "roll_angle"))
    slides = max(float(np.abs(run[name].values).max()) for name in ("sway_speed", "heave_speed"))
    reported = json.loads(run.attrs["parameters"])
    cable = reported["cable"]
    displaced = cable["water_density"] * cable.get("cross_section_area", np.inf)
    heavy = np.isfinite(displaced) and abs(cable["mass_per_length"] - displaced) > NEUTRAL * displaced
    moved = any(reported.get("current", ())) or any(
        reported.get(name) for name in ("profile", "winch", "vessel")
    )
    return turns < ROUNDING and slides < ROUNDING and not heavy and not moved


def exact_tension(run: xr.Dataset) -> np.ndarray:
    """Return the exact tension at the tow point of a straight course.

        T = (m u' + ½ρπdC_t u|u|) S + (I_d u'/R_d + C_f)/R_d         (37), accelerated

    S is the start's wet length and the way made; u' is taken between the samples.

    Args:
        run: a prescribed straight run; its parameters are in the attribute ``parameters``.

    Returns:
        tension at each time. Shape (samples,). [N]
    """
    reported = json.loads(run.attrs["parameters"])
    cable, drum = reported["cable"], reported["drum"]
    time, u = run["time"].values, run["surge_speed"].values
    slope = np.gradient(u, time) if time.size > 1 else np.zeros_like(u)
    way = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (u[1:] + u[:-1]))])
    S = run["cable_length"].values[0] + way
    drag = 0.5 * cable["water_density"] * np.pi * cable["diameter"] * cable["tangential_drag_coefficient"]
    at_drum = (drum["inertia"] * slope / drum["radius"] + drum["friction_torque"]) / drum["radius"]
    exact: np.ndarray = (cable["mass_per_length"] * slope + drag * u * np.abs(u)) * S + at_drum * (u > 0.0)
    return exact


def figure_4(run: xr.Dataset, title: Title) -> Figure:
    """Draw Fig. 4: the computed tension as dots on the exact line, and how far they lie from it."""
    figure, (tension, error) = sheet(1, 2, title)
    time, computed, exact = run["time"].values, run["cable_tension"].values, exact_tension(run)
    at = np.unique(np.linspace(0, time.size - 1, DOTS_SHOWN).round().astype(int))
    tension.plot(time, exact, color=style.INK, linewidth=1.0, label="exact, equation (37)")
    tension.plot(
        time[at], computed[at], **{**style.DOTS, "color": style.BLUE, "alpha": 1.0}, label="computed"
    )
    headline(tension, "Tension at the tow point")
    label(tension, None, "$T(0)$ [N]")
    legend(tension)
    difference = computed - exact
    power = int(np.floor(np.log10(np.abs(difference).max() or 1.0)))
    error.plot(time, difference / 10.0**power, color=style.BLUE, linewidth=0.8, marker=".", markersize=2.5)
    headline(error, "Computed − exact, every step")
    label(error, None, f"error [$10^{{{power}}}$ N]")
    for axes in (tension, error):
        in_time(axes, {"": run})
    time_label([tension, error], 2)
    return figure


def figure_5(run: xr.Dataset, title: Title) -> Figure:
    """Draw Fig. 5: manoeuvre, shapes of the cable, tension, tow-point velocity, forces, moments."""
    figure, panels = sheet(3, 2, title)
    manoeuvre, shapes, tension, velocity, force, moment = panels
    _manoeuvre(run, manoeuvre)
    configurations(run, shapes, _shape_times(run))
    headline(shapes, "Shape of the cable")
    legend(shapes, loc="lower left")
    _over_time(run, tension, {"cable_tension": ""}, "$T(0)$ [N]")
    headline(tension, "Tension at the tow point")
    components = {"tangential": "$V_t$", "normal": "$V_n$", "binormal": "$V_b$"}
    _over_time(
        run,
        velocity,
        {f"tow_velocity_{name}": symbol for name, symbol in components.items()},
        "velocity [m/s]",
    )
    headline(velocity, "Velocity of the tow point, cable's axes")
    cable_forces(run, force, moment)
    time_label(panels, 2)
    shapes.xaxis.labelpad = 1
    return figure


def _manoeuvre(run: xr.Dataset, axes: Axes) -> None:
    """Draw the angle that changes, pitch or heading, or both."""
    turns = [angle for angle in ("pitch", "heading") if np.ptp(run[angle].values) > ROUNDING]
    if len(turns) == 2:
        names = {angle: f"${BY_NAME[angle].symbol}$, {angle}" for angle in turns}
        _over_time(run, axes, names, "angle [degree]")
        headline(axes, "Pitch, positive nose up, and heading")
        return
    dives = longest(run, DOWN, EAST) == DOWN
    angle = "pitch" if dives else "heading"
    _over_time(run, axes, {angle: ""}, f"${BY_NAME[angle].symbol}$ [degree]")
    headline(axes, "Pitch angle, positive nose up" if dives else "Heading, clockwise from north")


def _shape_times(run: xr.Dataset) -> list[float]:
    """Return at which times the cable is drawn: those of the paper, or as many, spread over a longer run. [s]."""
    time = run["time"].values
    return SHAPE_TIMES if time[-1] <= SHAPE_TIMES[-1] else time[spread(len(SHAPE_TIMES), time.size)].tolist()


def _over_time(run: xr.Dataset, axes: Axes, names: dict[str, str], unit: str) -> None:
    """Draw some channels of one unit; those with a symbol are named in a legend."""
    for (name, symbol), colour, dash in zip(names.items(), CYCLE, DASHES, strict=False):
        axes.plot(run["time"].values, run[name].values, color=colour, linestyle=dash, label=symbol)
    label(axes, None, unit)
    in_time(axes, {"": run})
    calm(axes)
    if all(names.values()):
        legend(axes)
