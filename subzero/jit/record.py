"""Numbers as records in memory, which compiled functions take as a single pointer."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np

Numbers = TypeVar("Numbers")


class Packed(np.void):  # type: ignore[misc]  # final in numpy's stubs only
    """A record in memory whose fields are attributes.

    ``numpy.record`` is the same but for a lookup of attributes in Python, through which numba, too, asks for the
    record's memory: an interrupt in there ends the interpreter.
    """

    def __getattr__(self, name: str) -> Any:
        """Return a field; what every record has is found before this is asked."""
        try:
            return self[name]
        except ValueError:
            raise AttributeError(self._unknown(name)) from None

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a field."""
        try:
            self[name] = value
        except ValueError:
            raise AttributeError(self._unknown(name)) from None

    def _unknown(self, name: str) -> str:
        """Return what is wrong with the name of a field."""
        return f"This record has no field {name!r}; it has {', '.join(self.dtype.names or ())}."


_layouts: dict[Any, np.dtype[Any]] = {}
"""What a value of `packed` is made of → its dtype."""


def packed(values: Numbers) -> Numbers:
    """Return a named tuple or dataclass of numbers, arrays, and more of its kind as one record in memory.

    Fields are read and written by the same names. Compiled functions take a record as a single pointer where
    they take a named tuple field by field: that halves the first compilation.
    """
    inside, shape = _read(values)
    if shape not in _layouts:
        _layouts[shape] = _layout(values)
    out: Any = np.zeros(1, dtype=_layouts[shape])
    out[0] = inside
    return cast(
        Numbers, out[0]
    )  # it is a `Packed`, and to whoever reads and writes its fields what it was made of


@cache
def _names(kind: type) -> tuple[str, ...] | None:
    """Return the names of the fields of a kind of named tuple or dataclass; None for anything else."""
    if dataclasses.is_dataclass(kind):
        return tuple(field.name for field in dataclasses.fields(kind))
    return getattr(kind, "_fields", None)


def _fields(value: Any) -> tuple[str, ...] | None:
    """Return the names of the fields of a named tuple or dataclass; None for anything else."""
    kind: Any = type(value)
    return _names(kind)


def _read(value: Any) -> tuple[Any, Any]:
    """Return a value of `packed` as numpy takes it (records as tuples, rows as lists), and what it is made of."""
    if isinstance(value, Packed):
        return value, value.dtype
    names = _fields(value)
    if names is None and not isinstance(value, tuple):
        return value, (value.dtype, value.shape) if isinstance(value, np.ndarray) else type(value)
    parts = [_read(part) for part in (value if names is None else [getattr(value, name) for name in names])]
    inside = [part for part, _ in parts]
    return inside if names is None else tuple(inside), (type(value), *(shape for _, shape in parts))


def _layout(value: Any) -> np.dtype[Any]:
    """Return the dtype that holds a value of `packed`."""
    if isinstance(value, Packed):
        return value.dtype
    names = _fields(value)
    if names is not None:
        return np.dtype((Packed, [(name, _layout(getattr(value, name))) for name in names]))
    if isinstance(value, tuple):
        return np.dtype((_layout(value[0]), (len(value),)))
    array = np.asarray(value)
    return np.dtype((array.dtype, array.shape))
