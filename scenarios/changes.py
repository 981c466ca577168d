"""Single values of a trial that differ from the files of its vehicle and its cable: the section [changes].

    "vehicle.rigid_body.mass" = 7.0
    "cable.normal_drag_coefficient" = 1.2
    "drum.inertia" = 1e-4

The quotes may be left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from scenarios.errors import Problem, nearest_or_all
from scenarios.files import Source
from scenarios.parts import Leaf, leaves, pattern, value_complaint


def changeable() -> dict[str, Leaf]:
    """Return every key that [changes] may hold, with the number of the pattern that it stands for."""
    vehicle = {f"vehicle.{key}": leaf for key, leaf in leaves(pattern("vehicle").table)}
    return vehicle | dict(leaves(pattern("cable").table))


def read_changes(source: Source) -> tuple[dict[str, float], list[Problem]]:
    """Return the changes that a trial file asks for: dotted key → value, and the problems."""
    raw = source.table.get("changes", {})
    given = dict(_flat(raw)) if isinstance(raw, Mapping) else {}
    allowed = changeable() if given else {}
    changes, problems = {}, []
    for key, value in given.items():
        place = f"changes.{key}"
        if key not in allowed:
            why = "no vehicle and no cable has such a value"
            problems.append(source.problem(place, why, _nearest(key, allowed)))
        elif complaint := value_complaint(value, allowed[key], key):
            problems.append(source.problem(place, *complaint, found=value))
        else:
            changes[key] = float(value)
    return changes, problems


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
