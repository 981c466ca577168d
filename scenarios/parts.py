"""Vehicle and cable files: every number with its unit, its plausible range, and where it comes from.

A number is an inline table ``{ value = 6.6, unit = "kg", range = [6.4, 7.5], source = "..." }``. The first
file we ship of each kind is its *pattern*: a user's file must have the same sections, keys and units; only entries
that are `OPTIONAL` may be missing. ``range`` gives the plausible values, which readers, sweeps and calibrations
use. ``tolerance``, which may be left out, says how far a healthy vehicle may be from the value (one standard
deviation); diagnoses use it. ``limits`` in the pattern gives the possible values, and is enforced.

The section [changes] of a trial gives single values that differ from these files:

    "vehicle.rigid_body.mass" = 7.0
    "cable.normal_drag_coefficient" = 1.2
    "drum.inertia" = 1e-4

The quotes may be left out. The section [tolerances] gives tolerances of such values in the same way.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from typing import Any

from scenarios.errors import Problem, ScenarioError, nearest_or_all
from scenarios.files import Source, read_toml, shipped, shipped_path
from scenarios.similar_vehicle import BASE, complete
from scenarios.similar_vehicle import SECTION as KNOWN
from scenarios.vehicle_lists import (
    DERIVATIVES,
    Leaf,
    factor_names,
    optional_leaves,
    primed_names,
    value_left_out,
)
from subzero.derivative_names import complaint
from subzero.errors import short as shown

PATTERNS = {"vehicle": ("vehicles", "subzero2"), "cable": ("cables", "table1")}
"""Kind of part → the folder of its files, and the file that is the pattern."""

LEAF_KEYS = ("value", "unit", "range", "tolerance", "limits", "source")

SERVOS = ("rudder_servo", "stern_plane_port_servo", "stern_plane_starboard_servo")
FEW = 5
"""So many missing numbers are named one by one; more are one problem, of a file that is not a whole one yet."""

OPTIONAL = {
    "cable.added_mass_coefficient": 1.0,
    "cable.tangential_added_mass_coefficient": 0.0,
    "cable.internal_damping": 0.0,
    "cable.bending_stiffness": 0.0,
    "cable.strength": 0.0,
    "cable.minimum_bend_radius": 0.0,
    **{f"{servo}.{key}": 0.0 for servo in SERVOS for key in ("position_feedback", "lost_command")},
}
"""Keys of the pattern that a file need not have → the value that is taken then."""

ABOVE_ZERO = ("mass", "density", "diameter", "radius", "area", "inertia")
"""Where the pattern gives no limits, a number whose name ends in one of these must be above zero."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """A vehicle, or a cable with its drum, as read.

    Attributes:
        source: its file; None if that could not be read.
        values: dotted key → value, as far as they are good.
        tolerances: dotted key → how far a healthy vehicle may be off, of those numbers that say it.
        complete: whether all of them are good.
    """

    source: Source | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    tolerances: Mapping[str, float] = field(default_factory=dict)
    complete: bool = False


@cache
def pattern(kind: str) -> Source:
    """Return the pattern of a kind of part, ``vehicle`` or ``cable``; read once."""
    folder, name = PATTERNS[kind]
    return read_toml(shipped_path(folder, name), name)


def read_part(source: Source, kind: str, named: str) -> tuple[Part, list[Problem]]:
    """Read the vehicle or the cable that a trial file names.

    Args:
        source: the trial file.
        kind: ``vehicle`` or ``cable``.
        named: name of a shipped file, or path from the trial file's folder, ending in ``.toml``.

    Returns:
        the part, as far as it is good; and the problems.
    """
    folder, _ = PATTERNS[kind]
    if named.endswith(".toml"):
        path = source.folder / named
    elif named in shipped(folder):
        path = shipped_path(folder, named)
    else:
        remedy = nearest_or_all(named, shipped(folder)) + " Or give the path of a file that ends in .toml."
        return Part(), [source.problem(kind, f"we ship no such {kind}", remedy, found=named)]
    try:
        return part_of(read_toml(path, named), kind)
    except ScenarioError as error:
        return Part(), list(error.problems)


@lru_cache(maxsize=4)
def part_of(part: Source, kind: str) -> tuple[Part, list[Problem]]:
    """Return the vehicle or the cable of a file, one of the last few that were read, and its problems."""
    if kind == "vehicle":
        part = _with_primes(part)
    if kind == "vehicle" and BASE in part.table:
        part = _completed(part)
    values, problems = _checked(part, pattern(kind))
    said = (
        {}
        if problems
        else {key: leaf["tolerance"] for key, leaf in leaves(part.table) if "tolerance" in leaf}
    )
    tolerances = {key: float(tolerance) for key, tolerance in said.items()}
    return Part(source=part, values=values, tolerances=tolerances, complete=not problems), problems


def _completed(part: Source) -> Source:
    """Return a vehicle file that names a base, with all numbers that follow from it.

    Raises:
        ScenarioError: a base that is not shipped, and what `scenarios.similar_vehicle` refuses.
    """
    named, known = part.table[BASE], shipped(PATTERNS["vehicle"][0])
    if not isinstance(named, str) or named not in known:
        remedy = nearest_or_all(str(named), known)
        raise ScenarioError([part.problem(BASE, "we ship no such vehicle", remedy, found=named)])
    base, problems = part_of(read_toml(shipped_path(PATTERNS["vehicle"][0], named), named), "vehicle")
    if problems or base.source is None:
        raise ScenarioError(problems)
    own = {key: inside for key, inside in part.table.items() if key not in (BASE, KNOWN)}
    return complete(part, dict(leaves(base.source.table)), dict(leaves(own)))


def _checked(source: Source, model: Source) -> tuple[dict[str, float], list[Problem]]:
    """Return the values of a file, held against its pattern."""
    wanted, given = dict(leaves(model.table)), dict(leaves(source.table))
    if model is pattern("vehicle"):
        wanted |= optional_leaves(given)
    problems = [source.problem(key, *_no_such_key(key, wanted, given)) for key in given if key not in wanted]
    values, missing = {}, []
    for key, leaf in wanted.items():
        if key not in given and key in OPTIONAL:
            values[key] = OPTIONAL[key]
        elif key not in given and (default := value_left_out(key)) is not None:
            values[key] = default
        elif key not in given:
            missing.append(
                source.problem(
                    key, "this key is missing", f'Add it as {{ value = ..., unit = "{leaf["unit"]}" }}.'
                )
            )
        elif complaint := _complaint(given[key], leaf, key):
            problems.append(source.problem(key, *complaint, found=given[key].get("value")))
        else:
            values[key] = float(given[key]["value"])
    return values, (missing if len(missing) <= FEW else [_incomplete(source, model, missing)]) + problems


def _incomplete(source: Source, model: Source, missing: list[Problem]) -> Problem:
    """Return one problem for a file that is not a whole one yet: how many numbers are missing, and how to begin."""
    kind = "vehicle" if model is pattern("vehicle") else "cable"
    bases = " or ".join(f'"{name}"' for name in ("torpedo", *sorted(set(shipped("vehicles")) - {"torpedo"})))
    remedy = f"Begin with a whole one: subzero new my_{kind}.toml --like {model.name}."
    if kind == "vehicle":
        remedy = (
            f"Write base = {bases} at the top: all others then follow from what you know (docs/vehicles.md)."
        )
    why = f"{len(missing)} of the {len(dict(leaves(model.table)))} numbers of a {kind} are missing"
    return replace(missing[0], line=None, key="", why=why, remedy=remedy)


def unit_of(kind: str, key: str) -> str:
    """Return the unit of a number that a file of a kind may leave out."""
    return str((dict(leaves(pattern(kind).table)) | optional_leaves({key: {}}))[key]["unit"])


def _no_such_key(key: str, allowed: Mapping[str, Leaf], given: Mapping[str, Leaf]) -> tuple[str, str]:
    """Return why a key cannot be, and the remedy."""
    if key.startswith(DERIVATIVES) and (
        said := complaint(key.removeprefix(DERIVATIVES), factor_names(given))
    ):
        return said[0], f"Allowed: {said[1]}."
    return "this file has no such key", nearest_or_all(key, allowed)


def _with_primes(source: Source) -> Source:
    """Return a vehicle file with a prime at the names of the derivatives without dimensions, those of unit "1"."""
    given = source.table.get(DERIVATIVES[:-1])
    names = primed_names(given) if isinstance(given, Mapping) else {}
    if not names or not isinstance(given, Mapping):
        return source
    primed = {names.get(name, name): leaf for name, leaf in given.items()}
    lines = {f"{DERIVATIVES}{new}": source.line(f"{DERIVATIVES}{name}") or 0 for name, new in names.items()}
    table = source.table | {DERIVATIVES[:-1]: primed}
    return replace(source, table=table, lines=source.lines | lines)


def leaves(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Leaf]]:
    """Walk through a file: every number with its dotted key; text and lists are for readers."""
    for name, inside in table.items():
        key = f"{above}{name}"
        if isinstance(inside, Mapping) and "value" not in inside:
            yield from leaves(inside, f"{key}.")
        elif isinstance(inside, Mapping):
            yield key, inside
        elif not isinstance(inside, str | list):
            yield key, {"value": inside}


def _complaint(leaf: Leaf, model: Leaf, key: str) -> tuple[str, str] | None:
    """Return why a number of a part cannot be used, and the remedy; None if it can."""
    unit = model["unit"]
    unknown = [name for name in leaf if name not in LEAF_KEYS]
    if unknown:
        return f"'{unknown[0]}' says nothing here", nearest_or_all(unknown[0], LEAF_KEYS)
    if leaf.get("unit") != unit:
        given = shown(leaf["unit"]) if "unit" in leaf else "not given"
        return f"its unit is {given}", f'Allowed: unit = "{unit}".'
    if "tolerance" in leaf and (complaint := tolerance_complaint(leaf["tolerance"], unit)):
        return f"its tolerance is {shown(leaf['tolerance'])}: {complaint[0]}", complaint[1]
    return value_complaint(leaf["value"], model, key)


def tolerance_complaint(value: object, unit: str) -> tuple[str, str] | None:
    """Return why a value cannot be the tolerance of a number, and the remedy; None if it can."""
    allowed = f"Allowed: above 0{'' if unit == '1' else f' {unit}'}."
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= sys.float_info.max:
        return "this is not a finite number", allowed
    return None if value > 0.0 else ("this is not above 0", allowed)


def value_complaint(value: object, model: Leaf, key: str) -> tuple[str, str] | None:
    """Return why a value cannot be used for a number of the pattern, and the remedy; None if it can."""
    low, high, allowed = _limits(model, key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "this is not a number", allowed
    if not abs(value) <= sys.float_info.max:  # true of NaN, infinity, and integers beyond every float
        return "this is not a finite number", allowed
    if not low <= value <= high:
        return "this is outside its limits", allowed
    return None


def _limits(model: Leaf, key: str) -> tuple[float, float, str]:
    """Return the least and the greatest possible value, and a sentence for a message."""
    low, high, unit = -math.inf, math.inf, "" if model["unit"] == "1" else f" {model['unit']}"
    said = "any finite number"
    if "limits" in model:
        low, high = model["limits"]
        said = f"{low:g} to {high:g}"
    elif key.rpartition(".")[2].rpartition("_")[2] in ABOVE_ZERO:
        low, said = math.ulp(0.0), "above 0"
    plausible = f"; plausible is {model['range'][0]:g} to {model['range'][1]:g}" if "range" in model else ""
    return low, high, f"Allowed: {said}{unit}{plausible}."


def nested(values: Mapping[str, float]) -> dict[str, Any]:
    """Turn dotted keys into tables inside tables: ``{"hull.mass": 6.6}`` → ``{"hull": {"mass": 6.6}}``."""
    tables: dict[str, Any] = {}
    for key, value in values.items():
        *sections, name = key.split(".")
        table = tables
        for section in sections:
            table = table.setdefault(section, {})
        table[name] = value
    return tables


@cache
def changeable() -> dict[str, Leaf]:
    """Return every key that [changes] may hold, with the number of the pattern that it stands for."""
    vehicle = {f"vehicle.{key}": leaf for key, leaf in leaves(pattern("vehicle").table)}
    return vehicle | dict(leaves(pattern("cable").table))


def read_changes(source: Source) -> tuple[dict[str, float], list[Problem]]:
    """Return the changes that a trial file asks for: dotted key → value, and the problems."""
    return _numbers_by_key(source, "changes", value_complaint)


def read_tolerances(source: Source) -> tuple[dict[str, float], list[Problem]]:
    """Return the tolerances that a trial file sets itself: dotted key → tolerance, and the problems."""
    return _numbers_by_key(
        source, "tolerances", lambda value, leaf, key: tolerance_complaint(value, leaf["unit"])
    )


def _numbers_by_key(
    source: Source, section: str, complaint_of: Callable[[object, Leaf, str], tuple[str, str] | None]
) -> tuple[dict[str, float], list[Problem]]:
    """Return the numbers of a section whose keys are those of vehicle and cable, and the problems."""
    raw = source.table.get(section, {})
    given = dict(_flat(raw)) if isinstance(raw, Mapping) else {}
    own = optional_leaves(_of_vehicle(given))
    allowed = (changeable() if given else {}) | {f"vehicle.{key}": leaf for key, leaf in own.items()}
    found: dict[str, float] = {}
    problems = []
    for key, value in given.items():
        place = f"{section}.{key}"
        if key not in allowed:
            why, remedy = "no vehicle and no cable has such a value", _nearest(key, allowed)
            if key.startswith(f"vehicle.{DERIVATIVES}"):
                why, remedy = _no_such_key(key.removeprefix("vehicle."), allowed, _of_vehicle(given))
            problems.append(source.problem(place, why, remedy))
        elif complaint := complaint_of(value, allowed[key], key):
            problems.append(source.problem(place, *complaint, found=value))
        else:
            found[key] = float(value)
    return found, problems


def _of_vehicle(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a vehicle among those of vehicle and cable, and a fin for each that a derivative names.

    Which fins there are stands in the file of the vehicle; the vehicle itself refuses others.
    """
    own = {key.removeprefix("vehicle."): value for key, value in given.items() if key.startswith("vehicle.")}
    names = [key.removesuffix("'").split("_", 2) for key in own if key.startswith(DERIVATIVES)]
    return own | {f"fins.{parts[2]}.x": {} for parts in names if len(parts) > 2}


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Walk through the section; ``cable.diameter = 1`` without quotes is a table in a table."""
    for name, inside in table.items():
        if isinstance(inside, Mapping):
            yield from _flat(inside, f"{above}{name}.")
        else:
            yield f"{above}{name}", inside


def _nearest(key: str, allowed: Mapping[str, Leaf]) -> str:
    """Return the nearest key, or how keys are built."""
    hint = nearest_or_all(key, allowed)
    if hint.startswith("Did"):
        return hint
    return "Write vehicle.section.key, cable.key or drum.key, as in the files of vehicle and cable."
