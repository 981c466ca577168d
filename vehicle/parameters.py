"""The parameters of the vehicle, and the checks of a set of them.

Every number of a vehicle is a field of a frozen dataclass, a `Section`, made by `parameter`: it carries its meaning,
its unit and its hard limits (outside of which the equations make no sense; plausible ranges and provenance live
with the values, in the vehicle's file). A section checks its numbers when it is made; `read_section` turns a plain
mapping into one and collects all problems instead of stopping at the first.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from contextlib import suppress
from numbers import Real
from typing import Any

from subzero import errors
from subzero.errors import UserError, real, short


@dataclasses.dataclass(frozen=True, kw_only=True)
class Problem:
    """One problem with the numbers of a vehicle: the key, the value found, the reason, the values allowed."""

    key: str
    found: str
    why: str
    allowed: str

    def __str__(self) -> str:
        return f"{self.key}: found {self.found}; {self.why}. Allowed: {self.allowed}."


class VehicleError(UserError, ValueError):
    """The numbers given do not make a vehicle; `problems` lists everything that is wrong with them."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        self.problems = problems
        super().__init__("\n".join(str(problem) for problem in problems))


class Section:
    """A part of a vehicle: a frozen dataclass of `parameter` fields, checked when it is made."""

    def __post_init__(self) -> None:
        """Raise VehicleError for numbers that are not possible."""
        problems = []
        for name, field in _fields(type(self)).items():
            value = getattr(self, name)
            if is_plainly_right(value, field):
                continue
            problem = check_value(f"{type(self).__name__}.{name}", value, field)
            if problem:
                problems.append(problem)
            elif type(value) is not float:
                object.__setattr__(self, name, float(value))
        if problems:
            raise VehicleError(tuple(problems))

    def values(self) -> tuple[float, ...]:
        """Return the numbers, in the order of the fields: `dataclasses.astuple` in a tenth of the time, as numbers need
        no copies.
        """
        return tuple([getattr(self, name) for name in _fields(type(self))])

    def by_name(self) -> dict[str, float]:
        """Return the numbers by the names of their fields; `dataclasses.asdict` copies each."""
        return {name: getattr(self, name) for name in _fields(type(self))}


def _fields(section: type) -> Mapping[str, dataclasses.Field[Any]]:
    """Return the fields of a section by name; `dataclasses.fields` looks through all of them to make a list."""
    fields: Mapping[str, dataclasses.Field[Any]] = section.__dataclass_fields__  # type: ignore[attr-defined]
    return fields


def parameter(
    meaning: str,
    unit: str,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    above: float | None = None,
    unlimited: bool = False,
) -> Any:
    """Declare a field with its meaning, unit and hard limits.

    `above` is a lower limit itself excluded; an `unlimited` one may be infinite, which switches it off.
    """
    limits = {"low": low if above is None else above, "high": high, "strict": above is not None}
    return dataclasses.field(metadata={"meaning": meaning, "unit": unit, "unlimited": unlimited, **limits})


def allowed_values(field: dataclasses.Field[Any]) -> str:
    """Return in words which values a field may take, with the unit."""
    low, high, unit = field.metadata["low"], field.metadata["high"], field.metadata["unit"]
    bounds = []
    if low > -math.inf:
        bounds.append(f"{'above' if field.metadata['strict'] else 'at least'} {low:g}")
    if high < math.inf:
        bounds.append(f"at most {high:g}")
    return f"a number {' and '.join(bounds)} [{unit}]".replace("  ", " ")


def is_plainly_right(value: object, field: dataclasses.Field[Any]) -> bool:
    """Return whether a value is a float within its limits, as most are: a tenth of the time of `check_value`."""
    if type(value) is not float:
        return False
    limits, low = field.metadata, field.metadata["low"]
    is_least = value == low > -math.inf and not limits["strict"]
    return is_least or bool(low < value < limits["high"])


def check_value(key: str, value: object, field: dataclasses.Field[Any]) -> Problem | None:
    """Return the problem with one value, or None."""
    low, high, strict = (field.metadata[name] for name in ("low", "high", "strict"))
    if isinstance(value, float) and value == math.inf and field.metadata["unlimited"]:
        return None
    number = real(value)
    if number is None:
        why = "this is not a number"
        if isinstance(value, Real) and not isinstance(value, bool):
            why = "NaN is not a number" if value != value else "this is not a finite number"
    elif number < low or number > high or (strict and number == low):
        why = f"{field.metadata['meaning']} cannot be that"
    else:
        return None
    return Problem(key=key, found=short(value), why=why, allowed=allowed_values(field))


def nearest(name: object, valid: list[str]) -> str:
    """Suggest the nearest valid name, or list them all."""
    close = errors.nearest(name, valid) if isinstance(name, str) else []
    return f"did you mean '{close[0]}'" if close else "one of " + ", ".join(valid)


def read_section(kind: type, section: str, values: object, problems: list[Problem]) -> Any:
    """Make one section of a vehicle from a mapping; append to `problems`, and return None, if that fails."""
    fields = _fields(kind)
    if isinstance(values, Mapping) and values.keys() == fields.keys():
        with suppress(VehicleError):  # then each problem is reported below, by its name in the file
            return kind(**values)
    if not isinstance(values, Mapping):
        allowed = "a table with " + ", ".join(fields)
        problems.append(Problem(key=section, found=f"{values!r}", why="a table is needed", allowed=allowed))
        return None
    before = len(problems)
    for name in values:
        if name not in fields:
            key, allowed = f"{section}.{name}", nearest(name, list(fields))
            problems.append(Problem(key=key, found="this key", why="no such parameter", allowed=allowed))
    for name, field in fields.items():
        key, allowed = f"{section}.{name}", allowed_values(field)
        problem: Problem | None = Problem(key=key, found="nothing", why="it is missing", allowed=allowed)
        if name in values:
            problem = check_value(key, values[name], field)
        if problem:
            problems.append(problem)
    if len(problems) > before:
        return None
    return kind(**{name: float(values[name]) for name in fields})
