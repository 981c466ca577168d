"""The lists of actuators of a vehicle, by name, and the other sections that a vehicle need not have.

A kind of actuator is a section with `channels(name)`, its commands, and a compiled function in `vehicle.terms`. To add
one: its file, a row of LISTS, a field of `Vehicle` and `VehicleNumbers`, its numbers in `listed_numbers`, its units in
`scenarios.vehicle_lists`.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import accumulate
from typing import TYPE_CHECKING, Any

from subzero.errors import short
from vehicle.body_lift import FlowAxes
from vehicle.buoyancy_engine import MOST_ENGINES, NO_ENGINE, BuoyancyEngine
from vehicle.channels import MOST_CHANNELS, Channel, table_of
from vehicle.cross_flow import HullSection, section_problems
from vehicle.derivatives import derivatives_of, is_table
from vehicle.fin_list import MOST_FINS, NO_FIN, Fin
from vehicle.moving_mass import MOST_MASSES, NO_MASS, MovingMass
from vehicle.parameters import Problem, VehicleError, read_section
from vehicle.products import Race, product_problems
from vehicle.rigid_body import ProductsOfInertia, inertia_problems
from vehicle.thrusters import MOST_THRUSTERS, Thruster

if TYPE_CHECKING:
    from vehicle.vehicle import Vehicle

DERIVATIVES, FLOW_AXES = "derivatives", "flow_axes"
"""Sections that a vehicle need not have: derivatives by name, and forces in flow axes."""
LISTS: dict[str, tuple[type, int]] = {
    "thrusters": (Thruster, MOST_THRUSTERS),
    "fins": (Fin, MOST_FINS),
    "moving_masses": (MovingMass, MOST_MASSES),
    "buoyancy_engines": (BuoyancyEngine, MOST_ENGINES),
}
"""Lists of actuators that a vehicle may have: a table for each by its name; its kind, and how many there may be."""
HULL_SECTIONS = "sections"
"""A table for each section of a hull that is no body of revolution, by its name."""
FURTHER: dict[str, type] = {"products_of_inertia": ProductsOfInertia, "race": Race}
"""Sections of numbers that a vehicle need not have, None where it has not."""
OPTIONAL = (DERIVATIVES, FLOW_AXES, *LISTS, HULL_SECTIONS, *FURTHER)
"""All sections that a vehicle need not have."""
FIXED_COMMANDS = ("propeller", "rudder", "stern_plane", "stern_plane_port", "stern_plane_starboard")
"""Names that commands of listed actuators cannot have."""


def listed_parts(vehicle: Vehicle) -> list[tuple[Channel, ...]]:
    """Return the commands of each listed actuator of a vehicle, in their order."""
    return [part.channels(name) for section in LISTS for name, part in getattr(vehicle, section)]


def listed_numbers(vehicle: Vehicle) -> dict[str, Any]:
    """Return the numbers of channels, fins, engines and masses; each list filled up to its length."""
    water, first = vehicle.water, _first_channels(vehicle)
    fins = [fin.numbers(first[name], water.density) for name, fin in vehicle.fins]
    engines = [
        engine.numbers(first[name], water.density * water.gravity)
        for name, engine in vehicle.buoyancy_engines
    ]
    masses = [mass.numbers(first[name], water.gravity) for name, mass in vehicle.moving_masses]
    return {
        "channels": table_of(vehicle.channels),
        "channel_count": len(vehicle.channels),
        "fins": _filled(fins, NO_FIN, MOST_FINS),
        "fin_count": len(fins),
        "engines": _filled(engines, NO_ENGINE, MOST_ENGINES),
        "engine_count": len(engines),
        "masses": _filled(masses, NO_MASS, MOST_MASSES),
        "mass_count": len(masses),
    }


def _first_channels(vehicle: Vehicle) -> dict[str, int]:
    """Return the name of each listed actuator → the number of its first channel."""
    names = [name for section in LISTS for name, _ in getattr(vehicle, section)]
    counts = [len(channels) for channels in listed_parts(vehicle)]
    return dict(zip(names, accumulate(counts, initial=0), strict=False))


def _filled(rows: list[Any], empty: Any, most: int) -> tuple[Any, ...]:
    """Return rows followed by empty ones, `most` in all."""
    return (*rows, *[empty] * (most - len(rows)))


def read_optional(mapping: Mapping[str, object], problems: list[Problem]) -> dict[str, Any]:
    """Return what a vehicle need not have, of a mapping: derivatives, lists and so on; note their problems."""
    found: dict[str, Any] = {}
    tables = {name: mapping[name] for name in OPTIONAL if name in mapping}
    rows_of = {name: kind for name, (kind, _) in LISTS.items()} | {HULL_SECTIONS: HullSection}
    for name, table in tables.items():
        if not isinstance(table, Mapping):
            allowed = f"a table of tables, [{name}.name]" if name in rows_of else "a table of numbers"
            problems.append(Problem(key=name, found=short(table), why="a table is needed", allowed=allowed))
        elif kind := rows_of.get(name):
            found[name] = tuple(
                (str(row), read_section(kind, f"{name}.{row}", values, problems))
                for row, values in table.items()
            )
        elif name != DERIVATIVES:
            found[name] = read_section({FLOW_AXES: FlowAxes, **FURTHER}[name], name, table, problems)
        else:
            fins = mapping.get("fins")
            try:
                found[name] = derivatives_of(table, tuple(fins) if isinstance(fins, Mapping) else ())
            except VehicleError as error:
                problems.extend(error.problems)
    return found


def list_problems(vehicle: Vehicle) -> list[Problem]:
    """Return the problems of lists whose parts are valid by themselves."""
    problems = []
    for section, (kind, most) in LISTS.items():
        rows = getattr(vehicle, section)
        if not is_table(rows) or not all(isinstance(part, kind) for _, part in rows):
            why, allowed = "this is no such part", f"pairs of a name and a {kind.__module__}.{kind.__name__}"
            return [Problem(key=section, found=short(rows), why=why, allowed=allowed)]
        if len(rows) > most:
            found = f"{len(rows)} {section.replace('_', ' ')}"
            why = "that is more than the compiled equations hold"
            problems.append(Problem(key=section, found=found, why=why, allowed=f"up to {most}"))
    for name, thruster in vehicle.thrusters:
        if not thruster.direction.any():
            key, found = f"thrusters.{name}.direction_x", "a direction of length 0"
            why, allowed = "it pushes nowhere", "a vector of the body's axes; its length does not matter"
            problems.append(Problem(key=key, found=found, why=why, allowed=allowed))
    return problems + _channel_problems([channel.name for channel in vehicle.channels])


def further_problems(vehicle: Vehicle) -> list[Problem]:
    """Return the problems of sections, products of inertia, and of the fins and the race that derivatives name."""
    return [
        *section_problems(vehicle.sections),
        *inertia_problems(vehicle.rigid_body, vehicle.products_of_inertia),
        *product_problems(vehicle.derivatives, [name for name, _ in vehicle.fins], vehicle.race),
    ]


def _channel_problems(names: list[str]) -> list[Problem]:
    """Return the problems of commands by name: two of one name, too many, one of propeller, rudder or planes."""
    problems = []
    for name in dict.fromkeys(names):
        if names.count(name) > 1 or name in FIXED_COMMANDS:
            why, allowed = "another command has this name", "a name of its own for each actuator"
            problems.append(Problem(key=name, found="this actuator", why=why, allowed=allowed))
    if len(names) > MOST_CHANNELS:
        found = f"{len(names)} commands of listed actuators"
        why = "that is more than the compiled equations hold"
        problems.append(Problem(key="channels", found=found, why=why, allowed=f"up to {MOST_CHANNELS}"))
    return problems
