"""The columns of [commands]: propeller, rudder and stern-planes, and one for each listed actuator of the vehicle.

A listed actuator is commanded by its name: a thruster's column is its share of full thrust (``front_port``), a fin's
is its angle (``upper_port_deg``), a moving mass has two (``battery_slide_m``, ``battery_turn_deg``), a buoyancy
engine's is its volume (``bladder_m3``). A column that is left out stands at zero. A vehicle that has no propeller,
rudder or stern-planes need not command them.

`vehicle.channels` says the same of a vehicle that is made; this package does not know it, and a test holds the two
together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import degrees
from typing import Any

import numpy as np

from scenarios.errors import nearest_and_all
from scenarios.quantities import COMMANDS, Quantity

Table = Mapping[str, Any]
ROUNDING = 9
"""Limits of angles are given in degrees of so many decimals: 20 degrees are not 19.999999999999996."""


def command_columns(vehicle: Table) -> tuple[Quantity, ...]:
    """Return the columns that the commands of a vehicle may have: time, the four of every vehicle, listed actuators.

    Args:
        vehicle: its numbers, section → key → value, as far as they are good.
    """
    time, *fixed = COMMANDS
    absent = _absent(vehicle)
    four = (replace(column, default=0.0) if column.name in absent else column for column in fixed)
    return (time, *four, *listed_columns(vehicle))


def listed_columns(vehicle: Table) -> tuple[Quantity, ...]:
    """Return the columns of the listed actuators of a vehicle, in the order of `vehicle.Vehicle.channels`."""
    rows = [
        column
        for section, columns in _COLUMNS.items()
        for name, part in _tables(vehicle, section)
        for column in columns(name, part)
    ]
    return tuple(rows)


def actuator_of(column: Quantity) -> str:
    """Return the command that a column holds: its name without the unit."""
    return column.name.removesuffix(_SUFFIXES[column.unit])


Fault = tuple[str, object, str, str]
"""Which command, what was found, why it cannot be, and what to do."""


def command_faults(listed: Sequence[str], values: np.ndarray, vehicle: Table) -> list[Fault]:
    """Return the faults of commands to listed actuators: one that the vehicle lacks, a value beyond its limits.

    Args:
        listed: names of the actuators.
        values: of all commands, those of the listed actuators behind the first four (samples, 4 and more).
        vehicle: its numbers, section → key → value.
    """
    known = {actuator_of(column): column for column in listed_columns(vehicle)}
    faults: list[Fault] = []
    for name, column in zip(listed, values.T[len(COMMANDS) - 1 :], strict=True):
        if name not in known:
            remedy = nearest_and_all(name, known) if known else "It has none: leave it out."
            faults.append((f"commands.{name}", None, "the vehicle has no such actuator", remedy))
            continue
        low, high = known[name].inner_limits
        beyond = column[(column < low) | (column > high)]
        if beyond.size:
            found = f"{beyond[0] / known[name].scale:g} {known[name].unit}".removesuffix(" 1")
            faults.append((f"commands.{name}", found, "this is outside its limits", known[name].allowed))
    return faults


def written_column(column: Quantity, kind: str) -> str:
    """Return the column of a file that a run writes which holds the ``command`` of a column of commands, or the
    ``state`` of its actuator: ``upper_port_command_deg``.
    """
    return f"{actuator_of(column)}_{kind}{_SUFFIXES[column.unit]}"


_SUFFIXES = {"1": "", "degree": "_deg", "m": "_m", "m3": "_m3", "rev/s": "_rps"}
"""Unit of a command → the end of its column."""


def _tables(vehicle: Table, section: str) -> list[tuple[str, Table]]:
    """Return the actuators of a list by name."""
    tables = vehicle.get(section, {})
    return [(name, part) for name, part in tables.items() if isinstance(part, Mapping)]


def _absent(vehicle: Table) -> set[str]:
    """Return the columns of propeller, rudder and stern-planes that move nothing on this vehicle."""
    followed = [part for _, part in _tables(vehicle, "fins")]
    absent = set()
    if not vehicle.get("propeller", {}).get("thrust_constant", 1.0):
        absent.add("propeller_rps")
    if not vehicle.get("rudder", {}).get("area", 1.0) and not any(
        fin.get("rudder_share") for fin in followed
    ):
        absent.add("rudder_deg")
    follows = any(fin.get("plane_share") or fin.get("roll_share") for fin in followed)
    if not vehicle.get("stern_planes", {}).get("area", 1.0) and not follows:
        absent |= {"stern_plane_port_deg", "stern_plane_starboard_deg"}
    return absent


def _column(name: str, unit: str, low: float, high: float, meaning: str) -> Quantity:
    """Return a column that may be left out."""
    return Quantity(
        name=name + _SUFFIXES[unit], unit=unit, low=low, high=high, default=0.0, meaning=meaning, many=True
    )


def _angle(name: str, most: float, meaning: str) -> Quantity:
    """Return the column of an angle up to `most` [rad] either way."""
    limit = round(degrees(most), ROUNDING)
    return _column(name, "degree", -limit, limit, meaning)


def _of_thruster(name: str, _: Table) -> list[Quantity]:
    return [_column(name, "1", -1.0, 1.0, f"share of full thrust of {name}, negative astern")]


def _of_fin(name: str, fin: Table) -> list[Quantity]:
    return [_angle(name, fin.get("deflection_limit", 0.0), f"own angle of the fin {name}")]


def _of_mass(name: str, mass: Table) -> list[Quantity]:
    aft, forward = (mass.get(f"travel_{way}", 0.0) for way in ("aft", "forward"))
    slide = _column(f"{name}_slide", "m", -aft, forward, f"how far the mass {name} slides forward")
    return [slide, _angle(f"{name}_turn", mass.get("turn_limit", 0.0), f"how far the mass {name} turns")]


def _of_engine(name: str, engine: Table) -> list[Quantity]:
    least, most = (engine.get(f"{which}_volume", 0.0) for which in ("least", "most"))
    return [_column(name, "m3", least, most, f"volume displaced by the buoyancy engine {name}")]


_COLUMNS = {
    "thrusters": _of_thruster,
    "fins": _of_fin,
    "moving_masses": _of_mass,
    "buoyancy_engines": _of_engine,
}
"""List of a vehicle → the columns of one of its actuators."""
