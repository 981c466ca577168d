"""Validation of values where they are made, by a file or in Python: by the limits of `quantities`.

>>> import scenarios
>>> scenarios.Start(heading=27.0)
Traceback (most recent call last):
scenarios.errors.ScenarioError: The scenario cannot be used (1 problem):
  Start, heading: found 27 rad (1546.99 degree), but this is outside its limits. Allowed: -360 to 360 degree ...
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from scenarios.errors import Problem, ScenarioError
from scenarios.quantities import Quantity
from subzero.arguments import numbers_in
from subzero.errors import real
from subzero.errors import short as shown

BEYOND_LIMITS = "this is outside its limits"
NO_NUMBER = "this is not a finite number"


class Checks:
    """Problems with the fields of one value, collected and reported together.

    Args:
        value: a frozen dataclass that is being made; a field that is right is replaced by its plain number or array.
    """

    def __init__(self, value: Any) -> None:
        self._value, self._owner = value, type(value).__name__
        self._problems: list[Problem] = []

    def say(self, name: str, why: str, remedy: str, found: object = None) -> None:
        """Note a problem of a field."""
        text = "" if found is None else shown(found)
        self._problems.append(Problem(file=self._owner, key=name, found=text, why=why, remedy=remedy))

    def number(self, name: str, quantity: Quantity) -> None:
        """Check a field against a quantity of the files; it is in inner units (radians)."""
        given = getattr(self._value, name)
        number = real(given)
        if number is None:
            self.say(name, NO_NUMBER, quantity.allowed, given)
        elif not _inside(number, quantity):
            self._note_out_of_limits(name, number, quantity)
        else:
            self._keep(name, number)

    def numbers(self, fields: Mapping[str, Quantity]) -> None:
        """Check several fields, name → quantity."""
        for name, quantity in fields.items():
            self.number(name, quantity)

    def vector(self, name: str, quantities: tuple[Quantity, ...]) -> None:
        """Check a field of as many numbers as there are quantities; it becomes a tuple."""
        array = self._array(name, (len(quantities),))
        if array is None:
            return
        numbers = tuple(array.tolist())
        for i, (number, quantity) in enumerate(zip(numbers, quantities, strict=True)):
            if not _inside(number, quantity):
                self._note_out_of_limits(f"{name}[{i}]", number, quantity)
        self._keep(name, numbers)

    def rows(
        self, name: str, quantities: tuple[Quantity, ...], count: int | None = None
    ) -> np.ndarray | None:
        """Check a field of one number (one quantity) or several a sample; return it as an array, None if it is bad."""
        shape = (count,) if len(quantities) == 1 else (count, len(quantities))
        array = self._array(name, shape)
        if array is None:
            return None
        columns = array.reshape(array.shape[0], -1).T
        for quantity, column in zip(quantities, columns, strict=True):
            self._column(name, column, quantity)
        return array

    def increasing(
        self, name: str, values: np.ndarray, what: str = "Times", first: float | None = 0.0
    ) -> None:
        """Check that values increase, from `first` on if that is given."""
        if first is not None and values.size and values[0] != first:
            why = f"{what.lower()} start at {first:g}"
            self.say(f"{name}[0]", why, f"The first must be {first:g}.", values[0].item())
        steps = np.flatnonzero(~(np.diff(values) > 0.0))
        if steps.size:
            at = int(steps[0]) + 1
            why = f"the one before it is {values[at - 1]:g}"
            self.say(f"{name}[{at}]", why, f"{what} must increase.", values[at].item())

    def kind(self, name: str, kinds: tuple[type, ...], optional: bool = False) -> bool:
        """Check the kind of a field; return whether it is given and right."""
        given = getattr(self._value, name)
        if isinstance(given, kinds):
            return True
        if not (optional and given is None):
            words = " or ".join(kind.__name__ for kind in kinds) + (" or None" if optional else "")
            self.say(name, f"this is a {type(given).__name__}", f"Allowed: {words}.", given)
        return False

    def mapping(self, name: str) -> None:
        """Check that a field holds numbers by name, in tables if necessary; their meaning is checked elsewhere."""
        table = getattr(self._value, name)
        if not isinstance(table, Mapping):
            self.say(name, "this is no mapping", "Allowed: key → number.", table)
            return
        for keys, number in _leaves(table):
            if real(number) is None:
                place = name + "".join(f"[{key!r}]" for key in keys)
                self.say(place, NO_NUMBER, "Allowed: a finite number.", number)

    def refuse(self) -> None:
        """Raise a `ScenarioError` if anything is wrong."""
        if self._problems:
            raise ScenarioError(self._problems)

    def _keep(self, name: str, value: Any) -> None:
        object.__setattr__(self._value, name, value)

    def freeze(self, name: str, array: np.ndarray) -> None:
        """Keep an array as the field, read-only, so that it cannot be changed unseen."""
        array.setflags(write=False)
        self._keep(name, array)

    def _note_out_of_limits(self, name: str, number: float, quantity: Quantity) -> None:
        """Note a number outside its limits, in inner units and in those of the files."""
        unit = {"degree": " rad", "degree/s": " rad/s", "1": ""}.get(quantity.unit, f" {quantity.unit}")
        file = f" ({number / quantity.scale:g} {quantity.unit})" if quantity.scale != 1.0 else ""
        found = f"{number:g}{unit}{file}"
        problem = Problem(file=self._owner, key=name, found=found, why=BEYOND_LIMITS, remedy=quantity.allowed)
        self._problems.append(problem)

    def _column(self, name: str, values: np.ndarray, quantity: Quantity) -> None:
        """Note the first number of a column that is outside its limits."""
        wrong = np.flatnonzero(~_inside(values, quantity))
        if wrong.size:
            self._note_out_of_limits(f"{name}[{wrong[0]}]", float(values[wrong[0]]), quantity)

    def _array(self, name: str, shape: tuple[int | None, ...]) -> np.ndarray | None:
        """Return a field as an array of finite numbers of a shape (None: any count above zero); note the problems
        found.
        """
        given = getattr(self._value, name)
        words = " × ".join("samples" if n is None else str(n) for n in shape)
        array = numbers_in(given)
        if array is None:
            self.say(name, "these are not numbers", f"Allowed: finite numbers, {words}.", given)
            return None
        fits = len(array.shape) == len(shape) and all(
            n == size if n is not None else size > 0 for n, size in zip(shape, array.shape, strict=True)
        )
        if not fits:
            found = " × ".join(map(str, array.shape)) or "a single number"
            self.say(name, f"its shape is {found}", f"Allowed: {words}.")
            return None
        if not np.isfinite(array).all():
            self.say(
                name, NO_NUMBER, f"Allowed: finite numbers, {words}.", array[~np.isfinite(array)][0].item()
            )
            return None
        return np.ascontiguousarray(array)


def _leaves(inside: object, keys: tuple[object, ...] = ()) -> Iterator[tuple[tuple[object, ...], object]]:
    """Walk through tables in tables: every value with the keys that lead to it."""
    if isinstance(inside, Mapping):
        for key, value in inside.items():
            yield from _leaves(value, (*keys, key))
    else:
        yield keys, inside


def _inside(values: Any, quantity: Quantity) -> Any:
    """Return which values, in inner units, are within the limits."""
    low, high = quantity.inner_limits
    return (values >= low) & (values <= high)
