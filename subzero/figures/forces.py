"""Forces and moments on the vehicle, of the cable and of every named term; and the energy balance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.channels import BY_NAME
from subzero.figures import style
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
    time_label,
)
from subzero.results.summary import ENERGY_PARTS, FORCE, MOMENT

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TERMS_SHOWN = 6
"""The largest terms are drawn each, the others as their sum: more lines cannot be distinguished."""

VISIBLE = 1e-3
"""A term that never reaches this share of the largest is not drawn."""

CABLE, CABLE_COLOUR = "cable", style.GREEN
"""The cable has one colour: for its force on the vehicle, and for its energy."""

COMPONENTS = {
    "X": ("Forward force by term", "$X$ [N]"),
    "Y": ("Force to starboard by term", "$Y$ [N]"),
    "N": ("Yaw moment by term", "$N$ [N m]"),
    "Z": ("Downward force by term", "$Z$ [N]"),
    "M": ("Pitch moment by term", "$M$ [N m]"),
}
ENERGY_WORDS = {
    "hull_loss": "lost by hull and fins",
    "cable_loss": "lost by the cable",
    "kinetic_change": "kinetic and potential",
    "drum": "left at the drum",
    "added_mass_term": "added-mass form",
    "residual": "unexplained",
}


ENERGY_COLOURS = dict(
    zip(
        ENERGY_WORDS.values(),
        (style.BLUE, CABLE_COLOUR, style.ORANGE, style.PURPLE, style.AMBER, style.SKY),
        strict=True,
    )
)


def cable_forces(run: xr.Dataset, force: Axes, moment: Axes) -> None:
    """Draw Fig. 5 (e) and (f): the three forces and the three moments of the cable on the vehicle."""
    for axes, names, unit in ((force, FORCE, "force [N]"), (moment, MOMENT, "moment [N m]")):
        for name, colour, dash in zip(names, CYCLE, DASHES, strict=False):
            symbol = f"${BY_NAME[name].symbol}$"
            axes.plot(run["time"].values, run[name].values, color=colour, linestyle=dash, label=symbol)
        label(axes, None, unit)
        in_time(axes, {"": run})
        calm(axes, smallest=1e-4)
        legend(axes)
    headline(force, "Force of the cable on the vehicle")
    headline(moment, "Moment of the cable on the vehicle")


def forces(run: xr.Dataset, title: Title) -> Figure:
    """Draw the forces on the vehicle: the cable's force and moment, and every term in three components."""
    figure, panels = sheet(3, 2, title)
    cable_forces(run, panels[0], panels[1])
    components = _busiest(run)
    looks = _looks(run, components)
    for axes, component in zip(panels[2:5], components, strict=True):
        _terms(run, component, axes, looks)
    energy(run, panels[5])
    time_label(panels, 2)
    return figure


def energy(run: xr.Dataset, axes: Axes) -> None:
    """Draw where the work of the propulsion goes: the parts in colour, the work itself in ink."""
    time = run["time"].values
    parts = {ENERGY_WORDS[part]: run[f"energy_{part}"].values for part in ENERGY_PARTS}
    parts = {words: np.nan_to_num(values) for words, values in parts.items() if np.isfinite(values).any()}
    work = run["energy_propeller_work"].values
    seen = VISIBLE * max(np.abs(values).max() for values in parts.values())
    for words, values in parts.items():
        colour = ENERGY_COLOURS[words]
        if np.abs(values).max() > seen or words == ENERGY_WORDS["residual"]:
            axes.plot(time, values, color=colour, linewidth=1.2, label=words)
    axes.plot(time, work, color=style.INK, linewidth=1.4, label="work of the propulsion")
    headline(axes, "Energy since the start")
    label(axes, None, "energy [J]")
    in_time(axes, {"": run})
    calm(axes)
    legend(axes, columns=2, tight=True)


def _busiest(run: xr.Dataset) -> list[str]:
    """Return the forward force and two more components: the plane in which the vehicle manoeuvres."""
    table = np.abs(np.nan_to_num(run["force_breakdown"].values))
    most = dict(zip(run["component"].values.tolist(), table.max(axis=(0, 1)), strict=True))
    return ["X", "Y", "N"] if most["N"] >= most["M"] else ["X", "Z", "M"]


def _looks(run: xr.Dataset, components: list[str]) -> dict[int, dict[str, Any]]:
    """Return for each term that is shown its colour and dash, the same in every panel; the cable's are its own."""
    shown = dict.fromkeys(at for name in components for at in _largest(run, name)[1][:TERMS_SHOWN])
    names = run["term"].values.tolist()
    others = [at for at in shown if names[at] != CABLE]
    colours = [colour for colour in CYCLE[:TERMS_SHOWN] if colour != CABLE_COLOUR]
    looks = [{"color": colour, "linestyle": dash} for dash in DASHES for colour in colours]
    own = {at: {"color": CABLE_COLOUR} for at in shown if names[at] == CABLE}
    return own | dict(zip(others, looks, strict=False))


def _largest(run: xr.Dataset, component: str) -> tuple[np.ndarray, list[int]]:
    """Return the terms of a component over time (samples, terms), and which are worth a line, the largest first."""
    table = np.nan_to_num(run["force_breakdown"].sel(component=component).values)
    size = np.abs(table).max(axis=0)
    return table, [int(at) for at in np.argsort(-size, kind="stable") if size[at] > VISIBLE * size.max()]


def _terms(run: xr.Dataset, component: str, axes: Axes, looks: dict[int, dict[str, Any]]) -> None:
    """Draw the largest terms of one component, and the sum of the others."""
    table, order = _largest(run, component)
    names = [str(name).replace("_", " ") for name in run["term"].values]
    for at in order[:TERMS_SHOWN]:
        axes.plot(run["time"].values, table[:, at], linewidth=1.2, label=names[at], **looks[at])
    if len(order) > TERMS_SHOWN:
        rest = table[:, order[TERMS_SHOWN:]].sum(axis=1)
        axes.plot(run["time"].values, rest, color=style.GREY, linewidth=1.0, label="all others")
    words, unit = COMPONENTS[component]
    headline(axes, words)
    label(axes, None, unit)
    in_time(axes, {"": run})
    calm(axes, smallest=1e-4)
    if order:
        legend(axes, columns=2, tight=True)
