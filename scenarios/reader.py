"""Read a scenario, the trial file and all files that it names, into one checked `Trial`.

Problems are collected from all files and raised together; only a trial file that cannot be read at all stops
sooner. Without [winch] the drum is free, without [vessel] it stands on the shore, and without a profile in [water] the
water moves the same everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import remainder, tau
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from scenarios.command_columns import command_columns, listed_columns
from scenarios.errors import Problem, ScenarioError
from scenarios.files import Source, find
from scenarios.instructions import Motion
from scenarios.parts import Part, nested, read_changes, read_part, read_tolerances
from scenarios.quantities import (
    PROFILE,
    SCHEMES,
    SECTIONS,
    STATION,
    VESSEL,
    WATER,
    WINCH,
    Quantity,
)
from scenarios.samples import LEFT_OPEN, check_times, commands, inline, motion, read_instructions
from scenarios.schema import LISTS, check_page, check_section
from scenarios.steps import misfits
from scenarios.trial import (
    FOUND_BY_TRIM,
    FOUND_WHY,
    ONLY_DEFAULT,
    ONLY_DEFAULT_CABLE,
    PLACES,
    RUN_FIELDS,
    SETPOINT,
    START_FIELDS,
    TRIM_NEEDS_SPEED,
    Profile,
    Start,
    Station,
    Trial,
    Vessel,
    Winch,
    only_default,
)
from subzero.errors import printable

Found = TypeVar("Found")

VehicleCheck = Callable[[Mapping[str, Any]], Iterable[Any]]
"""Takes the numbers of a vehicle; gives complaints with the attributes key, found, why, allowed."""

Read = tuple[dict[str, Any], list[Problem]]
"""Fields of a `Trial`, and the problems; fields are only good without problems."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """A trial file while it is read: its contents, and the problems found so far."""

    source: Source
    problems: list[Problem] = field(default_factory=list)

    def keep(self, result: tuple[Found, list[Problem]]) -> Found:
        """Note the problems of a result, and return the rest of it."""
        self.problems.extend(result[1])
        return result[0]

    def section(self, name: str) -> dict[str, Any]:
        """Return a section, checked number by number; empty if there is a problem."""
        return self.keep(check_section(self.source, name, self.source.table.get(name, {})))


def load(
    name_or_path: str | Path,
    *,
    commands_csv: str | Path | None = None,
    motion_csv: str | Path | None = None,
    check_vehicle: VehicleCheck | None = None,
) -> Trial:
    """Return a shipped or a user's scenario, checked.

    Args:
        name_or_path: a name of `names`, or the path of a TOML file.
        commands_csv: a CSV file of commands that replaces those of the scenario.
        motion_csv: a CSV file of a motion that replaces the commands or the motion of the scenario, and what its start
            says besides the cable.
        check_vehicle: takes the numbers of the vehicle and gives what its own equations find wrong with them,
            as objects with the attributes key, found, why, allowed. (This package does not depend on the vehicle.)

    Raises:
        ScenarioError: with every problem of every file.
    """
    reading = Reading(source=find(name_or_path))
    reading.problems.extend(check_page(reading.source))
    run, start = (reading.section(name) for name in ("run", "start"))
    reading.problems.extend(check_steps(reading.source, run, start))
    around: dict[str, Any] = {}
    for read in (_read_water, _read_winch, _read_vessel, _read_station):
        around |= reading.keep(read(reading.source))
    vehicle, cable, tolerances = _parts(reading, check_vehicle)
    reading.problems.extend(check_scheme(reading.source, run, cable.get("cable", {})))
    given = {
        kind: path for kind, path in zip(LISTS, (commands_csv, motion_csv), strict=True) if path is not None
    }
    samples = {}
    if given or "station" not in reading.source.table:
        columns = command_columns(vehicle)
        samples = reading.keep(read_instructions(reading.source, given, run.get("duration_s"), columns))
    if "motion" not in samples:
        reading.problems.extend(check_trim(reading.source, start))
    if reading.problems:
        raise ScenarioError(_in_order(reading.problems))
    prescribed = motion(samples["motion"]) if "motion" in samples else None
    return Trial(
        name=printable(Path(name_or_path).stem),
        description=reading.source.table["description"],
        text=reading.source.text,
        source=printable(str(name_or_path)),
        **{name: run[quantity.name] for name, quantity in RUN_FIELDS.items()},
        scheme=run["scheme"],
        start=_start(start, prescribed),
        vehicle=vehicle,
        cable=cable["cable"],
        drum=cable["drum"],
        tolerances=tolerances,
        **around,
        commands=commands(samples["commands"], listed_columns(vehicle)) if "commands" in samples else None,
        motion=prescribed,
    )


def _in_order(problems: list[Problem]) -> list[Problem]:
    """Sort problems by line within each file; files keep the order in which they were read."""
    files = list(dict.fromkeys(problem.file for problem in problems))
    return sorted(problems, key=lambda problem: (files.index(problem.file), problem.line or 0))


def _part(reading: Reading, kind: str) -> Part:
    """Return the vehicle or the cable that the trial names, as far as it is good."""
    named = reading.source.table.get(kind)
    if not isinstance(named, str):
        return Part()  # `check_page` has said so
    return reading.keep(read_part(reading.source, kind, named))


def _parts(
    reading: Reading, check: VehicleCheck | None
) -> tuple[dict[str, Any], dict[str, Any], dict[str, float]]:
    """Return the numbers of the vehicle, those of cable and drum, with the changes of the trial, and tolerances."""
    part, cable = (_part(reading, kind) for kind in ("vehicle", "cable"))
    changes = reading.keep(read_changes(reading.source))
    of_vehicle = {
        key.removeprefix("vehicle."): value for key, value in changes.items() if key.startswith("vehicle.")
    }
    of_cable = {key: value for key, value in changes.items() if not key.startswith("vehicle.")}
    vehicle = nested({**part.values, **of_vehicle})
    if check and part.complete:
        reading.problems.extend(_complaint(reading, part, of_vehicle, said) for said in check(vehicle))
    declared = {f"vehicle.{key}": tolerance for key, tolerance in part.tolerances.items()} | dict(
        cable.tolerances
    )
    return (
        vehicle,
        nested({**cable.values, **of_cable}),
        declared | reading.keep(read_tolerances(reading.source)),
    )


def _complaint(reading: Reading, part: Part, changed: Mapping[str, float], said: Any) -> Problem:
    """Return a complaint of the vehicle as a problem of the file that holds the number."""
    source, key = part.source or reading.source, said.key
    if key in changed:
        source, key = reading.source, f"changes.vehicle.{key}"
    remedy = f"Allowed: {said.allowed}."
    line = source.line(key)
    return Problem(file=source.name, line=line, key=key, found=said.found, why=said.why, remedy=remedy)


def check_trim(source: Source, start: Mapping[str, Any]) -> list[Problem]:
    """Return keys of [start] that at_trim determines and that are given, or that at_trim needs and that are
    missing.
    """
    table = source.table.get("start", {})
    if not start.get("at_trim", False) or not isinstance(table, Mapping):
        return []
    names = [START_FIELDS[name].name for name in FOUND_BY_TRIM]
    problems = [
        source.problem(f"start.{name}", FOUND_WHY, "Leave it out.", found=table[name])
        for name in names
        if name in table
    ]
    speed = start.get("surge_speed_m_s", 1.0)
    if not speed > 0.0:
        problems.append(
            source.problem("start.surge_speed_m_s", TRIM_NEEDS_SPEED, "Above 0 m/s.", found=speed)
        )
    return problems


def _start(start: Mapping[str, Any], prescribed: Motion | None) -> Start:
    """Return the start; a prescribed motion starts where it says."""
    fields = {name: start[quantity.name] * quantity.scale for name, quantity in START_FIELDS.items()}
    if prescribed is None:
        return Start(**fields, at_trim=start["at_trim"])
    left_open = {name: value for name, value in fields.items() if START_FIELDS[name].name in LEFT_OPEN}
    said = {name: float(getattr(prescribed, name)[0]) for name in prescribed.given if name in fields}
    for angle in ("heading", "roll"):
        said[angle] = remainder(said.get(angle, 0.0), tau)
    return Start(**left_open | said)


def check_steps(source: Source, run: Mapping[str, float], start: Mapping[str, float]) -> list[Problem]:
    """Return the inconsistencies of [run] and [start], as far as their numbers are valid by themselves.

    Args:
        source: the trial file, for the lines in messages.
        run: numbers of the section [run], without those that are wrong.
        start: numbers of the section [start], likewise.
    """
    keys = {field: quantity.name for field, quantity in (RUN_FIELDS | START_FIELDS).items()}
    given = {**run, **start}
    numbers = {field: given[key] for field, key in keys.items() if key in given}
    return [
        source.problem(f"run.{keys[field]}", why, remedy, found=found)
        for field, found, why, remedy in misfits(numbers, keys)
    ]


def _read_lists(
    source: Source, section: str, left_out: Mapping[str, list[float]] | None = None
) -> tuple[dict[str, Any], dict[str, list[float]], list[Problem]]:
    """Return the values of a section over time, those of its lists that are given, and the problems.

    Args:
        source: the trial file, which has the section.
        section: its name.
        left_out: lists that are taken where the file gives none.
    """
    values, problems = check_section(source, section, source.table[section])
    lists = {**(left_out or {}), **_lists(values, section)}
    samples, wrong = inline(source, section, lists)
    return values, lists, problems + wrong + (check_times(samples, None) if samples else [])


def _lists(values: Mapping[str, Any], section: str) -> dict[str, list[float]]:
    """Return the lists of a section that are given, by name."""
    names = (quantity.name for quantity in SECTIONS[section] if quantity.many)
    return {name: values[name] for name in names if values.get(name) is not None}


def _fields(section: str, rows: tuple[Quantity, ...], lists: Mapping[str, list[float]]) -> dict[str, Any]:
    """Return the fields of the value of a section, in inner units; a list that is left out is zero."""
    zeros = [0.0] * len(lists[rows[0].name])
    table = np.column_stack([np.array(lists.get(row.name, zeros)) * row.scale for row in rows])
    return {name: table[:, place] for name, place in PLACES[section].items()}


def _read_water(source: Source) -> Read:
    """Return the uniform current, and the profile that is added to it by depth."""
    values, problems = check_section(source, "water", source.table.get("water", {}))
    current = tuple(float(values.get(quantity.name, 0.0)) for quantity in WATER)
    fields = {"current": current, "sea_bed": float(values.get("sea_bed_m", 0.0))}
    lists = _lists(values, "water")
    problems += _check_profile(source, lists) if lists else []
    if problems or not lists:
        return fields, problems
    return fields | {"profile": Profile(**_fields("water", PROFILE, lists))}, []


def _check_profile(source: Source, lists: Mapping[str, list[float]]) -> list[Problem]:
    """Return the problems of a profile: depths that increase, and one velocity for each."""
    given = source.table["water"]
    if "depth_m" not in given:
        why = "[water] does not say at which depths"
        return [source.problem(f"water.{name}", why, "Add depth_m, from top to bottom.") for name in lists]
    if not any(quantity.name in given for quantity in PROFILE[1:]):
        why = "[water] does not say how the water moves there"
        return [source.problem("water.depth_m", why, "Add profile_north_m_s, profile_east_m_s, or both.")]
    _, problems = inline(source, "water", lists, "depth_m")
    for at, (above, below) in enumerate(pairwise(lists.get("depth_m", [])), start=1):
        if not below > above:
            why, remedy = f"the depth before it is {above:g}", "Depths must increase from top to bottom."
            problems.append(source.problem(f"water.depth_m[{at}]", why, remedy, found=below))
    return problems


def _read_winch(source: Source) -> Read:
    """Return the winch or the free drum."""
    if "winch" not in source.table:
        return {}, []
    values, lists, problems = _read_lists(source, "winch")
    if "control" not in values:
        return {}, problems  # `check_page` or `check_section` has said so
    control = values["control"]
    problems += _check_control(source, control, lists)
    if problems:
        return {}, problems
    row = SETPOINT[control]
    return {"winch": Winch(control=control, **(_fields("winch", (WINCH[0], row), lists) if row else {}))}, []


def _check_control(source: Source, control: str, lists: Mapping[str, list[float]]) -> list[Problem]:
    """Return which lists of a winch are missing, or say nothing with its kind of control."""
    row = SETPOINT[control]
    wanted = {quantity.name: quantity.allowed for quantity in ((WINCH[0], row) if row else ())}
    problems = [
        source.problem(f"winch.{name}", f'a winch with control = "{control}" needs this list', allowed)
        for name, allowed in wanted.items()
        if name not in source.table["winch"]
    ]
    users = {quantity.name: kind for kind, quantity in SETPOINT.items() if quantity}
    for name in lists:
        if name not in wanted:
            other = f', or set control = "{users[name]}"' if name in users else ""
            why = f'it says nothing to a winch with control = "{control}"'
            problems.append(source.problem(f"winch.{name}", why, f"Leave it out{other}."))
    return problems


def _read_vessel(source: Source) -> Read:
    """Return how the drum moves."""
    if "vessel" not in source.table:
        return {}, []
    values, lists, problems = _read_lists(source, "vessel")
    if problems or not values:  # `check_page` has said that it is no section
        return {}, problems
    return {"vessel": Vessel(**_fields("vessel", VESSEL, lists))}, []


def _read_station(source: Source) -> Read:
    """Return the station that thrusters keep; it stands in place of commands."""
    if "station" not in source.table:
        return {}, []
    values, lists, problems = _read_lists(source, "station", {"time_s": [0.0]})
    if "motion" in source.table or "commands" in source.table:
        why = "[commands] or [motion] is given too, and thrusters keep this station"
        remedy = "Keep one of [station], [commands] and [motion]."
        problems.append(source.problem("station", why, remedy))
    if problems or not values:
        return {}, problems
    fields = _fields("station", STATION[1:], lists)
    return {"station": Station(**fields, bandwidth=float(values["bandwidth_rad_s"]))}, []


def check_scheme(source: Source, run: Mapping[str, Any], cable: Mapping[str, float]) -> list[Problem]:
    """Return features of a trial and its cable that only the default scheme has, if [run] asks for another one."""
    scheme, table = run.get("scheme", SCHEMES[0]), source.table
    if scheme == SCHEMES[0]:
        return []
    water = table.get("water")
    asked = [f"[{section}]" for section in ("winch", "vessel") if section in table]
    if isinstance(water, Mapping) and any(quantity.name in water for quantity in PROFILE):
        asked.append("a profile in [water]")
    if run.get("grading", 0.0) > 0.0:
        asked.append("grading")
    asked += [f"the cable's {name}" for name in ONLY_DEFAULT_CABLE if cable.get(name, 0.0) > 0.0]
    return [source.problem("run.scheme", ONLY_DEFAULT, only_default(asked), found=scheme)] if asked else []
