"""Trials as data: TOML that a person can copy and edit, read and checked into values.

    >>> import scenarios
    >>> "fig6" in scenarios.names()
    True
    >>> trial = scenarios.load("fig6")          # or the path of your own file
    >>> trial.duration, trial.commands.values[0]
    (30.0, array([25.,  0.,  0.,  0.]))

To make your own trial, copy `path("fig6")`, which explains every key, edit it, and load it by its path.
Vehicles and cables are files too (`vehicles/`, `cables/`), each number with its unit, plausible range and
provenance. Commands can stand in a CSV file with the columns ``time_s, propeller_rps, rudder_deg,
stern_plane_port_deg, stern_plane_starboard_deg``. A file that cannot be used raises one `ScenarioError` with
all its problems.

Signs, here and everywhere: depth is positive down, heading runs clockwise from north, a positive rudder turns
the heading to starboard (it increases), positive stern-planes (both) pitch the nose up. Files speak of
degrees and revolutions per second; a `Trial` of radians and revolutions per second.

Modules: `trial` the value that describes a trial; `instructions` the commands or the motion of its vehicle; `steps`
the times of a run, and the settings at them; `quantities` the one table of numbers, units and limits; `checks`
validation of values where they are made; `schema` the contents that a file may have; `files` opening and parsing;
`parts` vehicles and cables; `samples` columns over time; `reader` reads them together; `errors` the report of a
problem.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenarios.errors import Problem, ScenarioError
from scenarios.quantities import CONTROLS, SCHEMES

if TYPE_CHECKING:
    from scenarios.instructions import Commands, Motion
    from scenarios.reader import load
    from scenarios.trial import Profile, Start, Station, Trial, Vessel, Winch

__all__ = [
    "CONTROLS",
    "SCHEMES",
    "Commands",
    "Motion",
    "Problem",
    "Profile",
    "ScenarioError",
    "Start",
    "Station",
    "Trial",
    "Vessel",
    "Winch",
    "describe",
    "load",
    "names",
    "path",
]

_HOME = {"load": "scenarios.reader"}
_HOME |= dict.fromkeys(("Commands", "Motion"), "scenarios.instructions")
_HOME |= dict.fromkeys(("Profile", "Start", "Station", "Trial", "Vessel", "Winch"), "scenarios.trial")
"""Name → its module, which needs numpy or pydantic: fetched when it is first used, so that a command line need not
wait for it."""


def __getattr__(name: str) -> Any:
    """Fetch a name from its module, once."""
    if name not in _HOME:
        raise AttributeError(f"module 'scenarios' has no attribute '{name}'; it has {', '.join(__all__)}")
    value = globals()[name] = getattr(import_module(_HOME[name]), name)
    return value


def names() -> list[str]:
    """Return the names of the scenarios we ship, in alphabetical order."""
    from scenarios.files import shipped

    return shipped("trials")


def describe(name: str) -> str:
    """Return the description of a scenario we ship, in one line.

    Raises:
        ScenarioError: there is no such scenario.
    """
    from scenarios.files import find

    return str(find(name).table["description"])


def path(name: str) -> Path:
    """Return where the file of a scenario we ship lies, to copy and edit it.

    Raises:
        ScenarioError: there is no such scenario.
    """
    from scenarios.files import find

    return find(name).folder / f"{name}.toml"
