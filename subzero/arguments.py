"""Raise an error, in one sentence, for an argument of another kind than a function declares, before the function
begins.

    @checked_arguments
    def simulate(scenario: str | Path | Trial, *, progress: Progress | None = None) -> Dataset: ...

    simulate("fig6", progress=[])   simulate: progress is []; it must be a function of 1 argument or None.

The annotations define the allowed arguments; there is no other table. Whether a number is within its limits is
checked by the function (`subzero.errors.checked`).

Why no library: pydantic copies and converts what it checks; beartype looks at one item of a list, and at no signature
of a callback; typeguard imports for 0.2 s, and refuses numpy's numbers and arrays. None knows names that a module
imports for its annotations only. What is left to write for any of them is as long as this.
"""

from __future__ import annotations

import builtins
import functools
import inspect
import sys
import typing
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from importlib import import_module
from itertools import islice
from numbers import Integral
from pathlib import Path
from types import NoneType, SimpleNamespace, UnionType
from typing import Any, TypeVar

import numpy as np

from subzero.errors import BadValueError, real, short

Made = TypeVar("Made", bound=Callable[..., Any])

MOST_ITEMS = 20_000_000
"""More items than this fill the memory before anything is computed with them."""

MOST_SEEN = 1000
"""So many items of a list are looked at: more would take longer than many a function."""


def checked_arguments(made: Made) -> Made:
    """Return a function that refuses, before it begins, arguments of other kinds than its annotations say.

    Args:
        made: a function; or a class, whose constructor is checked.

    Raises:
        BadValueError: from the function that is returned.
    """
    if isinstance(made, type):
        made.__init__ = checked_arguments(made.__init__)  # type: ignore[misc]
        return made
    signature, owner = inspect.signature(made), made.__qualname__.removesuffix(".__init__")

    @functools.wraps(made)
    def checking(*positional: Any, **named: Any) -> Any:
        try:
            given = signature.bind(*positional, **named).arguments
        except TypeError as error:
            raise TypeError(f"{owner}() {error}") from None
        for name, hint in _hints(made).items():
            if name in given and not _fits(given[name], hint):
                raise BadValueError(f"{owner}: {name} is {short(given[name])}; it must be {_words(hint)}.")
        return made(*positional, **named)

    return typing.cast(Made, checking)


def numbers_in(values: object) -> np.ndarray | None:
    """Return values as an array of floats, finite or not; None unless they are numbers that form an array."""
    try:
        found = np.array(values)
    except (TypeError, ValueError, OverflowError):
        return None
    return found.astype(float) if found.dtype.kind in "iuf" else None


def check_is_run(owner: str, run: Any) -> None:
    """Raise an error if a dataset is not a run.

    Raises:
        BadValueError: it does not say which scenario was simulated.
    """
    if "scenario" not in run.attrs:
        raise BadValueError(f"{owner}: run is {short(run)}; it must be a run, such as of subzero.simulate.")


class _Names(dict[str, Any]):
    """The names of a module, with those that it imports for its annotations only."""

    def __missing__(self, name: str) -> Any:
        subzero = sys.modules["subzero"]
        return (
            getattr(subzero, name)
            if name in subzero.__all__
            else import_module({"xr": "xarray"}.get(name, name))
        )


@functools.cache
def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """Return argument → its allowed kinds, for the arguments that have a place or a name of their own."""
    several = inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD
    annotated = {
        name: parameter.annotation
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.kind not in several and parameter.annotation is not parameter.empty
    }
    names = _Names(vars(builtins) | function.__globals__)
    return typing.get_type_hints(SimpleNamespace(__annotations__=annotated), {}, names)


def _is_list(value: Any) -> bool:
    """Return whether a value is a list, a tuple, an array or their like, that is not endless."""
    try:
        is_list = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes)
        return is_list and len(value) <= MOST_ITEMS
    except (TypeError, OverflowError):  # an array of no axis; a range of more than 2**63 numbers
        return False


def _is_series(value: Any) -> bool:
    """Return whether a value is a list, or gives items in another way: a set, a mapping, a generator."""
    is_other = isinstance(value, Iterable) and not isinstance(value, Sequence | np.ndarray)
    return is_other or _is_list(value)


_KINDS: dict[Any, tuple[str, Callable[[Any], bool]]] = {
    bool: ("True or False", lambda value: isinstance(value, bool | np.bool_)),
    int: ("a whole number", lambda value: isinstance(value, Integral) and not isinstance(value, bool)),
    float: ("a finite number", lambda value: real(value) is not None),
    str: (
        "a text",
        lambda value: isinstance(value, str) and "\0" not in value,
    ),  # no file can have such a name
    Path: ("a Path", lambda value: isinstance(value, Path) and "\0" not in str(value)),
    NoneType: ("None", lambda value: value is None),
    Any: ("anything", lambda value: True),
    **dict.fromkeys((Mapping, dict), ("a mapping", lambda value: isinstance(value, Mapping))),
    **dict.fromkeys((Sequence, list, tuple, np.ndarray), ("a list", _is_list)),
    Iterable: ("a list", _is_series),
}
"""Kind → its name in messages, and whether a value is of it; any other kind is a class."""


def _fits(value: Any, hint: Any) -> bool:
    """Return whether a value is of an annotated kind."""
    kind, inside = typing.get_origin(hint) or hint, typing.get_args(hint)
    if kind in (typing.Union, UnionType):
        return any(_fits(value, part) for part in inside)
    if kind is Callable:
        return _takes(value, inside[0])
    if kind not in _KINDS:
        return not isinstance(kind, type) or isinstance(value, kind)
    if not _KINDS[kind][1](value):
        return False
    if kind in (Mapping, dict):
        return all(
            _fits(key, inside[0]) and _fits(item, inside[1]) for key, item in islice(value.items(), MOST_SEEN)
        )
    if kind is tuple and inside[1:] not in ((), (...,)):
        return len(value) == len(inside) and all(map(_fits, value, inside))
    return not (inside and isinstance(value, Collection)) or all(
        _fits(item, inside[0]) for item in islice(value, MOST_SEEN)
    )


def _takes(function: Any, arguments: Collection[Any]) -> bool:
    """Return whether a value can be called with so many arguments, as far as Python knows."""
    if not callable(function):  # `inspect` would ask for its text, which may itself be wrong
        return False
    try:
        inspect.signature(function).bind(*arguments)
    except TypeError:
        return False
    except ValueError:  # a built-in one, of which it knows nothing
        pass
    return True


def _words(hint: Any) -> str:
    """Return the kind that an annotation asks for, in words."""
    kind, inside = typing.get_origin(hint) or hint, typing.get_args(hint)
    if kind in (typing.Union, UnionType):
        return " or ".join(dict.fromkeys(map(_words, inside)))
    if kind is Callable:
        return f"a function of {len(inside[0])} argument{'s' * (len(inside[0]) != 1)}"
    items = inside[1:] if kind in (Mapping, dict) else [part for part in inside if part is not ...]
    if kind not in _KINDS or not items:
        return _KINDS[kind][0] if kind in _KINDS else kind.__name__
    count = f" of {len(items)}" if len(items) > 1 else ""
    return f"{_KINDS[kind][0]}{count} (each {' or '.join(dict.fromkeys(map(_words, items)))})"
