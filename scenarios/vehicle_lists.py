"""Sections that a vehicle file need not have: derivatives, flow axes, and a table for each listed actuator.

    [thrusters.front_port]       [fins.upper_port]       [moving_masses.battery]       [buoyancy_engines.bladder]

`vehicle.lists` has the meaning of their numbers; here are the units, and the keys that a file may leave out.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

Leaf = Mapping[str, Any]
Leaves = dict[str, Leaf]


@dataclass(frozen=True)
class Table:
    """The keys of a table and their units, and the values of those that may be left out."""

    units: Mapping[str, str]
    optional: Mapping[str, float] = field(default_factory=dict)


def _units(lines: str) -> dict[str, str]:
    """Read lines ``unit ; keys`` into key → unit."""
    rows = [line.split(";") for line in lines.strip().splitlines()]
    return {key: unit.strip() for unit, keys in rows for key in keys.split()}


LISTS = {
    "thrusters": Table(
        _units("""
m    ; x y z
1    ; direction_x direction_y direction_z
N    ; thrust_ahead thrust_astern
1    ; curve_exponent dead_band
kg/s ; loss_per_inflow
m    ; reaction_arm
s    ; lag
1    ; lost_command
"""),
        {"curve_exponent": 2.0, "dead_band": 0.0, "loss_per_inflow": 0.0, "reaction_arm": 0.0}
        | {"lag": 0.1, "lost_command": 0.0},
    ),
    "fins": Table(
        _units("""
m2    ; area
1/rad ; lift_slope
1     ; aspect_ratio span_efficiency profile_drag_coefficient normal_force_coefficient
rad   ; stall_angle
m     ; x y z
rad   ; span_angle
1     ; rudder_share plane_share roll_share
s     ; lag
rad/s ; rate_limit
rad   ; offset deflection_limit
1     ; lost_command
"""),
        {"rudder_share": 0.0, "plane_share": 0.0, "roll_share": 0.0}
        | {"lag": 0.1, "offset": 0.0, "lost_command": 0.0},
    ),
    "moving_masses": Table(
        _units("""
kg    ; mass
m     ; x y z travel_aft travel_forward
m/s   ; slide_rate
rad   ; turn_limit
rad/s ; turn_rate
s     ; lag
1     ; lost_command
"""),
        {"turn_limit": 0.0, "turn_rate": 1.0, "lag": 0.1, "lost_command": 0.0},
    ),
    "buoyancy_engines": Table(
        _units("""
m    ; x y z
m3   ; least_volume most_volume
m3/s ; pump_rate
s    ; lag
1    ; lost_command
"""),
        {"lag": 0.1, "lost_command": 0.0},
    ),
}
"""Lists of actuators: the section, and the table of each."""

FLOW_AXES = _units("""
kg/m ; drag drag_per_incidence_squared side_force_per_sideslip lift lift_per_incidence
kg   ; roll_per_sideslip pitch pitch_per_incidence yaw_per_sideslip
kg s ; roll_per_roll_rate pitch_per_pitch_rate yaw_per_yaw_rate
""")
"""Coefficients of forces in flow axes, [flow_axes]: all or none."""

OPTIONAL_SECTIONS = ("derivatives", "flow_axes", *LISTS)
"""Sections that a vehicle file need not have."""

LISTED = re.compile(rf"(?P<section>{'|'.join(LISTS)})\.(?P<name>[^.]+)\.(?P<key>[^.]+)")
DERIVATIVE = re.compile(r"derivatives\.[XYZKMN]_(?P<speed>[uvwpqr])(dot|\|?(?P=speed)\|?)?")
"""``derivatives.X_u``, ``X_uu`` or ``X_u|u|``, ``X_udot``."""


def optional_leaves(given: Mapping[str, Leaf]) -> Leaves:
    """Return the pattern of the sections that a vehicle need not have, as far as a file has them.

    Args:
        given: dotted key → inline table of a file.
    """
    found = [match for match in map(LISTED.fullmatch, given) if match]
    rows = dict.fromkeys((match["section"], match["name"]) for match in found)
    listed: Leaves = {
        f"{section}.{name}.{key}": {"unit": unit}
        for section, name in rows
        for key, unit in LISTS[section].units.items()
    }
    winged = any(key.startswith("flow_axes.") for key in given)
    axes: Leaves = {f"flow_axes.{key}": {"unit": unit} for key, unit in FLOW_AXES.items()} if winged else {}
    derivatives: Leaves = {key: {"unit": derivative_unit(key)} for key in given if DERIVATIVE.fullmatch(key)}
    return listed | axes | derivatives


@cache
def value_left_out(key: str) -> float | None:
    """Return the value of a number of a listed actuator that its file leaves out; None if it must say it."""
    match = LISTED.fullmatch(key)
    return LISTS[match["section"]].optional.get(match["key"]) if match else None


def derivative_unit(key: str) -> str:
    """Return the unit of a derivative such as ``derivatives.K_pp``: force per speed, per speed squared, or per rate."""
    force, _, speed = key.rpartition(".")[2].partition("_")
    kind = 0 if speed.endswith("dot") else 2 if len(speed) > 1 else 1
    metres = (force in "KMN") + (speed[0] in "pqr") * (2 if kind == 2 else 1) - (kind == 2)
    length = {-1: "/m", 0: "", 1: " m", 2: " m2"}[metres]
    return f"kg{length}/s" if kind == 1 else f"kg{length}"
