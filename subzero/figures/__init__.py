"""Figures of runs and comparisons, fit to print: units on every axis, one style, the trial named on each.

`draw` gives the figures that belong to some runs. A run that follows commands gets the four panels of Fig. 6 of Feng
and Allen (2004), actuators and attitude (one on station its place and its thrusters instead), the cable's shape, the
tension along it over time, forces and energy. A prescribed run gets Fig. 4 if it is straight, with its exact solution,
and Fig. 5 if it is not, besides the cable. A winch, or a vessel that carries the drum, adds a figure of its motion.
Inside `page_width` they are as narrow as a column of a page.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from subzero.arguments import check_is_run, checked_arguments
from subzero.errors import BadValueError
from subzero.figures.cable import deployment, is_deployed, shape, tension
from subzero.figures.forces import forces
from subzero.figures.motion import actuators, attitude, figure_6, measured, station
from subzero.figures.prescribed import exact_tension, figure_4, figure_5, is_straight
from subzero.figures.style import Runs, Title, page_width, warnings_in_short

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from subzero.records.record import Record

__all__ = [
    "attitude",
    "deployment",
    "draw",
    "exact_tension",
    "figure_4",
    "figure_5",
    "figure_6",
    "forces",
    "measured",
    "page_width",
    "shape",
    "station",
    "tension",
]


@checked_arguments
def draw(runs: Runs | xr.Dataset, record: Record | None = None) -> dict[str, Figure]:
    """Return the figures of some runs of one trial, by the name of their file.

    Args:
        runs: one run; or ``{"tethered": ..., "untethered": ...}``, or one of the two.
        record: the measured record, drawn as dots.

    Raises:
        UserError: a dataset that is no run, or nothing.
    """
    if not runs:
        raise BadValueError("draw: runs is empty; give a run, or runs by name.")
    for run in runs.values() if isinstance(runs, dict) else (runs,):
        check_is_run("draw", run)
    if not isinstance(runs, dict):
        runs = {"tethered" if runs.attrs["tethered"] else "untethered": runs}
    first = next(iter(runs.values()))
    title = Title(
        words=first.attrs["title"], scenario=first.attrs["scenario"], warnings=warnings_in_short(runs)
    )
    figures = _prescribed(runs, title) if first.attrs["prescribed"] else _commanded(runs, record, title)
    if "tethered" in runs and is_deployed(runs["tethered"]):
        figures["deployment"] = deployment(runs["tethered"], title)
    more = measured(runs, record, title) if record is not None else None
    return figures if more is None else {**figures, "measured": more}


def _commanded(runs: Runs, record: Record | None, title: Title) -> dict[str, Figure]:
    """Return the figures of a vehicle that follows commands."""
    run = next(iter(runs.values()))
    has_propeller = _has_propeller(run)
    figures: dict[str, Figure] = {}
    if has_propeller:
        figures |= {"fig6": figure_6(runs, record, title), "attitude": attitude(runs, record, title)}
    if "thruster_command" in run or not has_propeller:
        figures["station"] = station(runs, record, title)
    if drawn := actuators(runs, title):
        figures["actuators"] = drawn
    if "tethered" in runs:
        figures |= _cable(runs["tethered"], title)
    figures["forces"] = forces(runs.get("tethered", run), title)
    return figures


def _has_propeller(run: xr.Dataset) -> bool:
    """Return whether the vehicle of a run has a propeller; those of a run that does not say so have one."""
    propeller = json.loads(run.attrs["parameters"])["vehicle"].get("propeller", {})
    return bool(propeller.get("thrust_constant", 1.0) > 0.0)


def _prescribed(runs: Runs, title: Title) -> dict[str, Figure]:
    """Return the figures of an idealised vehicle; without its cable there is nothing to see."""
    if "tethered" not in runs:
        return {}
    run = runs["tethered"]
    main = {"fig4": figure_4(run, title)} if is_straight(run) else {"fig5": figure_5(run, title)}
    return {**main, **_cable(run, title)}


def _cable(run: xr.Dataset, title: Title) -> dict[str, Figure]:
    """Return the figures of the cable."""
    along = tension(run, title)
    return {"cable": shape(run, title)} | ({"tension": along} if along is not None else {})
