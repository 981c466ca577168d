"""Sections that a vehicle file need not have: derivatives, flow axes, and a table for each listed actuator.

    [thrusters.front_port]       [fins.upper_port]       [moving_masses.battery]       [buoyancy_engines.bladder]

`vehicle.lists` has the meaning of their numbers; here are the units, and the keys that a file may leave out.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from subzero.derivative_names import COMPLETE, FIN_NAMES, RACE, parsed

Leaf = Mapping[str, Any]


@dataclass(frozen=True)
class Table:
    """The keys of a table and their units, and the values of those that may be left out."""

    units: Mapping[str, str]
    optional: Mapping[str, float]


def _table(lines: str) -> Table:
    """Read lines ``unit ; keys``, with ``=`` and a value behind a key that may be left out."""
    rows = [line.split(";") for line in lines.strip().splitlines()]
    cells = [(unit.strip(), *key.partition("=")) for unit, keys in rows for key in keys.split()]
    units = {key: unit for unit, key, _, _ in cells}
    return Table(units, {key: float(value) for _, key, _, value in cells if value})


LISTS = {
    "thrusters": _table("""
m    ; x y z
1    ; direction_x direction_y direction_z
N    ; thrust_ahead thrust_astern
1    ; curve_exponent=2 dead_band=0
kg/s ; loss_per_inflow=0
m    ; reaction_arm=0
s    ; lag=0.1
1    ; lost_command=0
"""),
    "fins": _table("""
m2    ; area
1/rad ; lift_slope
1     ; aspect_ratio span_efficiency profile_drag_coefficient normal_force_coefficient
rad   ; stall_angle
m     ; x y z
rad   ; span_angle
1     ; rudder_share=0 plane_share=0 roll_share=0
s     ; lag=0.1
rad/s ; rate_limit
rad   ; offset=0 deflection_limit
1     ; lost_command=0
"""),
    "moving_masses": _table("""
kg    ; mass
m     ; x y z travel_aft travel_forward
m/s   ; slide_rate
rad   ; turn_limit=0
rad/s ; turn_rate=1
s     ; lag=0.1
1     ; lost_command=0
"""),
    "buoyancy_engines": _table("""
m    ; x y z
m3   ; least_volume most_volume
m3/s ; pump_rate
s    ; lag=0.1
1    ; lost_command=0
"""),
}
"""Lists of actuators: the section, and the table of each."""

FLOW_AXES = _table("""
kg/m ; drag drag_per_incidence_squared side_force_per_sideslip lift lift_per_incidence
kg   ; roll_per_sideslip pitch pitch_per_incidence yaw_per_sideslip
kg s ; roll_per_roll_rate pitch_per_pitch_rate yaw_per_yaw_rate
""").units
"""Coefficients of forces in flow axes, [flow_axes]: all or none."""

SECTIONS = {
    "sections": _table("""
m ; x breadth height
1 ; lateral_drag_coefficient vertical_drag_coefficient
"""),
}
"""Sections of a hull that is no body of revolution, [sections.name]: the table of each."""
FURTHER = {
    "products_of_inertia": _table("kg m2 ; xy xz yz").units,
    "race": _table("m ; advance\n1 ; thrust_loading").units,
}
"""Further sections: all of their numbers or none."""

OPTIONAL_SECTIONS = ("derivatives", "flow_axes", *LISTS, *SECTIONS, *FURTHER)
"""Sections that a vehicle file need not have."""

TABLES = LISTS | SECTIONS
LISTED = re.compile(rf"(?P<section>{'|'.join(TABLES)})\.(?P<name>[^.]+)\.(?P<key>[^.]+)")
DERIVATIVES = "derivatives."


def optional_leaves(given: Mapping[str, Leaf]) -> dict[str, Leaf]:
    """Return the pattern of the sections that a vehicle need not have, as far as a file has them.

    Args:
        given: dotted key → inline table of a file.
    """
    found = [match for match in map(LISTED.fullmatch, given) if match]
    rows = dict.fromkeys((match["section"], match["name"]) for match in found)
    listed: dict[str, Leaf] = {
        f"{section}.{name}.{key}": {"unit": unit}
        for section, name in rows
        for key, unit in TABLES[section].units.items()
    }
    whole = {"flow_axes": FLOW_AXES, **FURTHER}
    further: dict[str, Leaf] = {
        f"{section}.{key}": {"unit": unit}
        for section, units in whole.items()
        if any(key.startswith(f"{section}.") for key in given)
        for key, unit in units.items()
    }
    units = {key: derivative_unit(key, factor_names(given)) for key in given if key.startswith(DERIVATIVES)}
    return listed | further | {key: {"unit": unit} for key, unit in units.items() if unit}


@cache
def value_left_out(key: str) -> float | None:
    """Return the value of a number of a listed actuator that its file leaves out; None if it must say it."""
    match = LISTED.fullmatch(key)
    return TABLES[match["section"]].optional.get(match["key"]) if match else None


def factor_names(given: Mapping[str, Leaf]) -> tuple[str, ...]:
    """Return the names that may be factors of a derivative of a file: of fins, listed ones too, and the race.

    Args:
        given: dotted key → inline table of the file.
    """
    fins = dict.fromkeys(key.split(".")[1] for key in given if key.startswith("fins."))
    return (*FIN_NAMES, RACE, *fins)


def derivative_unit(key: str, named: Sequence[str]) -> str | None:
    """Return the unit of a derivative such as ``derivatives.K_pp``; None if it is none.

    Args:
        key: dotted.
        named: of `factor_names`.
    """
    name = key.removeprefix(DERIVATIVES)
    found = parsed(name, named)
    return "1" if name == COMPLETE else found.unit if found else None


def primed_names(table: Mapping[str, Any]) -> dict[str, str]:
    """Return name → name with a prime, of the derivatives of a table that have no dimensions: those of unit "1"."""
    bare = [name for name, leaf in table.items() if isinstance(leaf, Mapping) and leaf.get("unit") == "1"]
    return {name: f"{name}'" for name in bare if not name.endswith("'") and name != COMPLETE}
