"""Every number of a trial by one dotted name, to look at it or to give it another value.

    "vehicle.rigid_body.mass"          cable.diameter, drum.inertia      as in [changes] of a trial file
    "run.duration_s"                   start.heading_deg                 keys of their sections
    "water.current_east_m_s"           water.sea_bed_m
    "commands.rudder_deg[1]"           one value of a list;  commands.propeller_rps: all its values
    "winch.tension_N"                  vessel, motion, water.profile_east_m_s likewise

Names carry the unit of the files, and so do values: degrees in ``_deg``, and what a part's file says for its numbers.
What a file refuses is refused here, in the same words, with the nearest name.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.command_columns import actuator_of, listed_columns
from scenarios.errors import Problem, ScenarioError, nearest_or_all
from scenarios.files import Source
from scenarios.parts import (
    PATTERNS,
    Part,
    changeable,
    leaves,
    nested,
    read_changes,
    read_part,
    read_tolerances,
    value_complaint,
)
from scenarios.quantities import (
    BED,
    COMMANDS,
    MOTION,
    PROFILE,
    STATION,
    VESSEL,
    WATER,
    WINCH,
    Quantity,
    by_field,
)
from scenarios.trial import PLACES, RUN_FIELDS, SETPOINT, START_FIELDS, Trial
from scenarios.vehicle_lists import OPTIONAL_SECTIONS, Leaf, optional_leaves
from subzero.errors import real
from subzero.errors import short as shown

ELEMENT = re.compile(r"(?P<list>[^\[\]]+)\[(?P<at>\d+)\]")
"""``rudder_deg[1]``."""

PARTS = ("vehicle", "cable", "drum")


def with_parameters(trial: Trial, values: Mapping[str, float]) -> Trial:
    """Return a trial with other values for some of its numbers.

    Args:
        trial: the trial to change; it is not modified.
        values: dotted name → value, in the units of the files.

    Raises:
        ScenarioError: names that the trial does not have, values outside their limits, values that do not fit together.

    >>> import scenarios
    >>> trial = scenarios.load("fig6")
    >>> with_parameters(trial, {"start.wet_length_m": 40.0, "cable.diameter": 0.003}).start.wet_length
    40.0
    """
    problems = [problem for name, value in values.items() if (problem := _problem(trial, name, value))]
    if problems:
        raise ScenarioError(problems)
    changed: dict[str, Any] = {}
    for section in dict.fromkeys(name.partition(".")[0] for name in values):
        own = {
            name.partition(".")[2]: float(value)
            for name, value in values.items()
            if name.startswith(f"{section}.")
        }
        changed |= _CHANGES[section](trial, own)
    return replace(trial, **changed)


def element_values(trial: Trial, values: Mapping[str, object]) -> dict[str, Any]:
    """Return values in which a sequence for a whole list stands element by element: ``commands.rudder_deg[0]``, ….

    Raises:
        ScenarioError: a sequence that is not as long as its list.
    """
    found: dict[str, Any] = {}
    for name, value in values.items():
        row = _row(trial, name) if isinstance(value, list | tuple | np.ndarray) else None
        if row is None or name.partition(".")[0] not in _LISTS:
            found[name] = value
            continue
        elements = list(value)  # type: ignore[call-overload]
        if len(elements) != row[1]:
            why = f"this list has {row[1]} values"
            remedy = "Give as many, one for each time of the trial."
            raise ScenarioError(
                [Problem(file=trial.name, key=name, found=shown(value), why=why, remedy=remedy)]
            )
        found |= {f"{name}[{at}]": element for at, element in enumerate(elements)}
    return found


def parameter(trial: Trial, name: str) -> float:
    """Return the value of a number of a trial, in the unit of the files; of a whole list its first.

    Raises:
        ScenarioError: the trial has no such number.
    """
    return float(_found(trial, name)[1][_at(name) or 0])


def _found(trial: Trial, name: str) -> tuple[Row, np.ndarray]:
    """Return the quantity of a number and its value or values; refuse a name that the trial does not have."""
    found, at = known_numbers(trial).get(_list_of(name)), _at(name)
    if found is None or (at is not None and at >= len(found[1])):
        raise ScenarioError([_unknown(trial, name)])
    return found


def parameter_names(trial: Trial) -> tuple[str, ...]:
    """Return the names of all numbers of a trial; lists by their name alone, without ``[1]``."""
    return tuple(known_numbers(trial))


def parameter_unit(trial: Trial, name: str) -> str:
    """Return the unit of a number of a trial, in files.

    Raises:
        ScenarioError: the trial has no such number.
    """
    row = quantity_of(trial, name)
    return row.unit if isinstance(row, Quantity) else str(row["unit"])


def parameter_values(trial: Trial, name: str) -> list[float]:
    """Return all values of a number or a list of a trial, in the unit of the files.

    Raises:
        ScenarioError: the trial has no such number.
    """
    return [float(value) for value in _found(trial, name)[1]]


def quantity_of(trial: Trial, name: str) -> Row:
    """Return the row of the table of quantities for a number, or the leaf of the pattern of a part.

    Raises:
        ScenarioError: the trial has no such number.
    """
    return _found(trial, name)[0]


def declared_ranges(trial: Trial) -> dict[str, tuple[float, float]]:
    """Return the ranges that the files of vehicle, cable and drum declare: dotted name → least, greatest value.

    The files are those that the trial names. A value that [changes] has moved keeps the range of its file.

    Raises:
        ScenarioError: the trial was not read from a file, or its files are not there any more.
    """
    ranges: dict[str, tuple[float, float]] = {}
    for kind in PATTERNS:
        above = "vehicle." if kind == "vehicle" else ""
        ranges |= {f"{above}{key}": each for key, each in ranges_in(part_file(trial, kind)).items()}
    return ranges


def ranges_in(part: Source) -> dict[str, tuple[float, float]]:
    """Return the ranges that the file of a vehicle or a cable declares: dotted key → least, greatest value."""
    return {
        key: (float(leaf["range"][0]), float(leaf["range"][1]))
        for key, leaf in leaves(part.table)
        if "range" in leaf
    }


def part_file(trial: Trial, kind: str) -> Source:
    """Return the file of the vehicle, or of the cable, that a trial names.

    Raises:
        ScenarioError: the trial was not read from a file, or its file is not there any more.
    """
    source = _source_of(trial)
    named = source.table.get(kind)
    if not isinstance(named, str):
        why = f"it does not say which {kind} it has, so no ranges are known"
        raise ScenarioError([Problem(file=trial.name, key=kind, why=why, remedy="Give the ranges.")])
    return _part(source, kind, named)[1]


def with_vehicle(trial: Trial, named: str | Path) -> tuple[Trial, Source]:
    """Return a trial with another vehicle, and the file of that vehicle; single values changed by the trial remain
    changed.

    Args:
        trial: the trial to change; it is not modified.
        named: a vehicle that we ship, or the path of a file, from the working directory.

    Raises:
        ScenarioError: there is no such vehicle, or it cannot be used.
    """
    here = replace(_source_of(trial), folder=Path())
    part, file = _part(here, "vehicle", str(named))
    changes, _ = read_changes(here)
    changed = with_parameters(
        replace(trial, vehicle=nested(part.values)),
        {key: value for key, value in changes.items() if key.removeprefix("vehicle.") in part.values},
    )
    tolerances = {
        key: tolerance for key, tolerance in trial.tolerances.items() if not key.startswith("vehicle.")
    }
    tolerances |= {
        f"vehicle.{key}": tolerance for key, tolerance in part.tolerances.items()
    } | read_tolerances(here)[0]
    return replace(changed, tolerances=tolerances), file


def changes_of(trial: Trial) -> dict[str, float]:
    """Return the single values that the file of a trial changes itself: dotted name → value."""
    return read_changes(_source_of(trial))[0]


def _part(source: Source, kind: str, named: str) -> tuple[Part, Source]:
    part, problems = read_part(source, kind, named)
    if part.source is None or problems:
        raise ScenarioError(problems)
    return part, part.source


def _source_of(trial: Trial) -> Source:
    """Return the file of a trial again, from the sources that it keeps."""
    table = tomllib.loads(trial.text) if trial.text else {}
    return Source(name=trial.source, folder=Path(trial.source).parent, text=trial.text, table=table, lines={})


# The names that exist, and the problems of a name or a value.

Row = Quantity | Leaf
"""The quantity of a number: its limits, its unit."""


def _part_rows(trial: Trial) -> dict[str, Leaf]:
    """Return the numbers of the parts of a trial: of every vehicle and cable, and the optional sections of its own."""
    lists = {name: trial.vehicle[name] for name in OPTIONAL_SECTIONS if name in trial.vehicle}
    if not lists:
        return changeable()
    own = optional_leaves(dict(leaves(lists)))
    return changeable() | {f"vehicle.{key}": leaf for key, leaf in own.items()}


def known_numbers(trial: Trial) -> dict[str, tuple[Row, np.ndarray]]:
    """Return dotted name → its quantity, and its value or values (n,), in the unit of the files."""
    known: dict[str, tuple[Row, np.ndarray]] = {}
    for name, row in _part_rows(trial).items():
        known[name] = row, np.array([_part_value(trial, name)])
    for section, owner, fields in (("run", trial, RUN_FIELDS), ("start", trial.start, START_FIELDS)):
        for field, quantity in fields.items():
            known[f"{section}.{quantity.name}"] = quantity, np.array([getattr(owner, field) / quantity.scale])
    for quantity, value in zip((*WATER, *BED), (*trial.current, trial.sea_bed), strict=True):
        known[f"water.{quantity.name}"] = quantity, np.array([value])
    if trial.station is not None:
        known[f"station.{STATION[0].name}"] = STATION[0], np.array([trial.station.bandwidth])
    for section in _LISTS:
        for quantity, column in zip(_rows(trial, section), _table(trial, section).T, strict=True):
            known[f"{section}.{quantity.name}"] = quantity, column / quantity.scale
    return known


def _row(trial: Trial, name: str) -> tuple[Row, int] | None:
    """Return the quantity of a number, and the length of its list; None if there is none. Quick for single
    numbers.
    """
    section, _, key = name.partition(".")
    if section in PARTS:
        row = changeable().get(name) or _part_rows(trial).get(name)
        return None if row is None else (row, 1)
    if section == "station" and trial.station is None:
        return None
    if section in _SINGLE and (single := _SINGLE[section].get(key)):
        return single, 1
    for quantity in _rows(trial, section) if section in _LISTS else ():
        if quantity.name == key:
            return quantity, len(_table(trial, section))
    return None


def _problem(trial: Trial, name: str, value: object) -> Problem | None:
    """Return the problem with a name or its value; None if there is none."""
    found, at = _row(trial, _list_of(name)), _at(name)
    if found is None or (at is not None and at >= found[1]) or ("[" in name and at is None):
        return _unknown(trial, name)
    row, _ = found
    complaint = _complaint(value, row) if isinstance(row, Quantity) else value_complaint(value, row, name)
    if complaint is None:
        return None
    why, remedy = complaint
    return Problem(file=trial.name, key=name, found=shown(value), why=why, remedy=remedy)


def _complaint(value: object, quantity: Quantity) -> tuple[str, str] | None:
    number = real(value)
    if number is None:
        return "this is not a finite number", quantity.allowed
    if not quantity.low <= number <= quantity.high:
        return "this is outside its limits", quantity.allowed
    return None


def _unknown(trial: Trial, name: str) -> Problem:
    """Return the problem of a name that a trial does not have, with the nearest."""
    known = known_numbers(trial)
    if _list_of(name) in known:
        count = len(known[_list_of(name)][1])
        remedy = f"Allowed: {_list_of(name)}[0] to [{count - 1}], or without [ ] for all of them."
        return Problem(file=trial.name, key=name, why=f"this list has {count} values", remedy=remedy)
    last = name.rpartition(".")[2]
    alike = [
        other for other in known if other.rpartition(".")[2] == last
    ]  # the key is right, and its section is not
    hint = f"Did you mean '{alike[0]}'?" if alike else nearest_or_all(name, known)
    if not hint.startswith("Did"):
        hint = (
            "Write section.key, such as vehicle.rigid_body.mass, cable.diameter, start.heading_deg or "
            "commands.rudder_deg[1]."
        )
    return Problem(file=trial.name, key=name, why="the trial has no such number", remedy=hint)


def _list_of(name: str) -> str:
    found = ELEMENT.fullmatch(name)
    return found["list"] if found else name


def _at(name: str) -> int | None:
    found = ELEMENT.fullmatch(name)
    return int(found["at"]) if found else None


# Sections: how their numbers are changed.


def _part_value(trial: Trial, name: str) -> float:
    section, *keys = name.split(".")
    table: Any = getattr(trial, section)
    for key in keys:
        table = table.get(key, {}) if isinstance(table, Mapping) else {}
    return float("nan") if isinstance(table, Mapping) else float(table)


def _with_part(section: str) -> Callable[[Trial, Mapping[str, float]], dict[str, Any]]:
    def changed(trial: Trial, own: Mapping[str, float]) -> dict[str, Any]:
        table = getattr(trial, section)
        for key, value in own.items():
            table = _with_key(table, key.split("."), value)
        return {section: table}

    return changed


def _with_key(table: Mapping[str, Any], keys: list[str], value: float) -> dict[str, Any]:
    """Return a table of tables with another value at the end of a way of keys."""
    key, *rest = keys
    return {**table, key: _with_key(table.get(key, {}), rest, value) if rest else value}


def _fields(fields: Mapping[str, Quantity], own: Mapping[str, float]) -> dict[str, Any]:
    """Return values by the names of the fields that hold them, in inner units."""
    return {name: own[row.name] * row.scale for name, row in fields.items() if row.name in own}


def _with_water(trial: Trial, own: Mapping[str, float]) -> dict[str, Any]:
    current = tuple(own.get(row.name, old) for row, old in zip(WATER, trial.current, strict=True))
    lists = {name: value for name, value in own.items() if name not in _SINGLE["water"]}
    changed = {"current": current, "sea_bed": own.get(BED[0].name, trial.sea_bed)}
    return changed | (_with_lists("water")(trial, lists) if lists else {})


def _with_station(trial: Trial, own: Mapping[str, float]) -> dict[str, Any]:
    lists = {name: value for name, value in own.items() if name != STATION[0].name}
    changed = _with_lists("station")(trial, lists)
    bandwidth = {"bandwidth": own[STATION[0].name]} if STATION[0].name in own else {}
    return {"station": replace(changed["station"], **bandwidth)}


def _rows(trial: Trial, section: str) -> tuple[Quantity, ...]:
    """Return the quantities of the lists of a section; none where the trial has no such section."""
    part = getattr(trial, _LISTS[section])
    if part is None:
        return ()
    if section == "motion":
        return tuple(row for name, row in by_field(MOTION).items() if getattr(part, name) is not None)
    if section == "winch":
        row = SETPOINT[part.control]
        return (WINCH[0], row) if row else ()
    if section == "commands":
        listed = {actuator_of(column): column for column in listed_columns(trial.vehicle)}
        return (*COMMANDS, *(listed[name] for name in part.listed))
    return {"vessel": VESSEL, "water": PROFILE, "station": STATION[1:]}[section]


def _places(part: Any, section: str) -> dict[str, Any]:
    """Return the fields that hold the lists of a section → their places in the table of all of them."""
    if section == "motion":
        return {name: at for at, name in enumerate(("time", *part.given))}
    return {} if section == "winch" and SETPOINT[part.control] is None else PLACES[section]


def _table(trial: Trial, section: str) -> np.ndarray:
    """Return the lists of a section in inner units, one row a sample, in the order of `_rows`."""
    part = getattr(trial, _LISTS[section])
    columns = [getattr(part, name) for name in _places(part, section)] if part is not None else []
    return np.column_stack(columns).astype(float) if columns else np.zeros((0, 0))


def _with_lists(section: str) -> Callable[[Trial, Mapping[str, float]], dict[str, Any]]:
    def changed(trial: Trial, own: Mapping[str, float]) -> dict[str, Any]:
        table, part = _table(trial, section), getattr(trial, _LISTS[section])
        rows = {row.name: (at, row.scale) for at, row in enumerate(_rows(trial, section))}
        for name, value in own.items():
            (column, scale), at = rows[_list_of(name)], _at(name)
            table[slice(None) if at is None else at, column] = value * scale
        fields = {name: table[:, place] for name, place in _places(part, section).items()}
        return {_LISTS[section]: replace(part, **fields)}

    return changed


_SINGLE: dict[str, dict[str, Quantity]] = {
    "run": {row.name: row for row in RUN_FIELDS.values()},
    "start": {row.name: row for row in START_FIELDS.values()},
    "water": {row.name: row for row in (*WATER, *BED)},
    "station": {STATION[0].name: STATION[0]},
}
"""Section → its single numbers."""

_LISTS = {
    "commands": "commands",
    "winch": "winch",
    "vessel": "vessel",
    "motion": "motion",
    "station": "station",
    "water": "profile",
}
"""Section → the field of a trial that holds its lists."""

_CHANGES: dict[str, Callable[[Trial, Mapping[str, float]], dict[str, Any]]] = {
    **{section: _with_part(section) for section in PARTS},
    **{section: _with_lists(section) for section in _LISTS if section != "water"},
    "station": _with_station,
    "run": lambda trial, own: _fields(RUN_FIELDS, own),
    "start": lambda trial, own: {"start": replace(trial.start, **_fields(START_FIELDS, own))},
    "water": _with_water,
}
"""Section → what a trial's fields are with other values in it."""
