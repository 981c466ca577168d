"""Numbers as records in memory, passed to compiled functions as a single pointer.

    >>> class Spring(Record):
    ...     stiffness: float
    ...     place: np.ndarray
    ...     is_taut: bool = True
    >>> spring = Spring(2.0, np.zeros(3))
    >>> spring.place[1] = 5.0
    >>> spring
    Spring(stiffness=2.0, place=[0. 5. 0.], is_taut=True)

A compiled function takes a named tuple field by field, and a record as one pointer: that halves the first
compilation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, wraps
from inspect import get_annotations
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar, dataclass_transform

import numpy as np

if TYPE_CHECKING:

    class Memory:
        """The part of ``numpy.void`` that is used here; in numpy's stubs, and only there, that class is final."""

        base: Any
        dtype: np.dtype[Any]

        def tobytes(self) -> bytes:
            """Return the memory as bytes."""

        def __getitem__(self, name: str) -> Any: ...
        def __setitem__(self, name: str, value: Any) -> None: ...
else:
    Memory = np.void


@dataclass_transform()
class Record(Memory):
    """Numbers, arrays, records and tuples of records in one piece of memory; a class declares them as a dataclass
    does.

    Values are copied into a record. Fields are read and written by their names; an array among them is a view of the
    record's memory. Records of a class whose arrays differ in shape or kind differ in layout, and a function is
    compiled for each layout. Fields that a subclass adds come before those of its base, so that the two layouts are
    never mistaken for each other.

    ``numpy.record`` differs by a lookup of attributes in Python, through which numba, too, gets the record's memory:
    an interrupt during that crashes the interpreter.

    Raises:
        TypeError: too many arguments, too few, or an unknown name.
    """

    names: ClassVar[tuple[str, ...]] = ()
    """Names of the fields, in the order of the memory."""
    defaults: ClassVar[dict[str, Any]] = {}

    def __init_subclass__(cls) -> None:
        """Read the fields that a class declares."""
        added = [name for name, kind in get_annotations(cls).items() if "ClassVar" not in str(kind)]
        # An attribute of `numpy.void` would hide a field of the same name.
        taken = [name for name in added if hasattr(np.void, name)]
        if taken:
            raise TypeError(f"{cls.__name__}: every record has {', '.join(taken)} already. Take other names.")
        inherited = [name for base in cls.__bases__ for name in getattr(base, "names", ())]
        # Of several bases with a common one, the fields of that come last.
        cls.names = (*added, *reversed(dict.fromkeys(reversed(inherited))))
        defaults = {k: v for base in cls.__bases__ for k, v in getattr(base, "defaults", {}).items()}
        cls.defaults = defaults | {name: cls.__dict__[name] for name in added if name in cls.__dict__}
        for name in cls.defaults.keys() & cls.__dict__.keys():
            delattr(cls, name)  # a class attribute would hide the field

    def __new__(cls, *values: Any, **named: Any) -> Self:
        """Return a record of these values, by their order or their names."""
        given = cls.defaults | dict(zip(cls.names, values, strict=False)) | named
        if len(values) > len(cls.names) or given.keys() != set(cls.names):
            raise TypeError(f"{cls.__name__} takes {', '.join(cls.names)}; it got {', '.join(given)}.")
        parts = [_read(given[name]) for name in cls.names]
        made_of = (cls, *[kind for _, kind in parts])
        if made_of not in _layouts:
            fields = [(name, _layout(given[name])) for name in cls.names]
            # With the class as the type of elements, `memory[0]` is an instance of it.
            _layouts[made_of] = np.dtype((cls, fields))
        memory = np.zeros(1, dtype=_layouts[made_of])
        memory[0] = tuple([value for value, _ in parts])
        made: Self = memory[0]
        return made

    def copy(self) -> Self:
        """Return a copy in memory of its own: in a tenth of the time that it takes to make a record."""
        memory = np.empty(1, dtype=self.dtype)
        memory[0] = self
        same: Self = memory[0]
        return same

    def memory_of(self, name: str) -> np.ndarray:
        """Return the memory of a field as an array, that of a single number with one element."""
        view: np.ndarray = self.base[name]
        return view

    def __iter__(self) -> Iterator[Any]:
        """Iterate over the values in their order."""
        return (self[name] for name in self.names)

    def __repr__(self) -> str:
        """Show the fields."""
        return f"{type(self).__name__}({', '.join(f'{name}={self[name]}' for name in self.names)})"

    if not TYPE_CHECKING:  # to a type checker, fields are those that the class declares and no others

        def __getattr__(self, name: str) -> Any:
            """Return a field; attributes that every record has are found before this is called."""
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
        """Return the message for an unknown field."""
        return f"This record has no field {name!r}; it has {', '.join(self.names)}."


Made = TypeVar("Made", bound=Record)


def made_once(make: Callable[[], Made]) -> Callable[[], Made]:
    """Return a function that returns copies of one record, such as an empty work space."""
    first = cache(make)

    @wraps(make)
    def copied() -> Made:
        return first().copy()

    return copied


_layouts: dict[Any, np.dtype[Any]] = {}
"""Types of a record's fields → its dtype: always the same object, which numba recognises at once."""


def _read(value: Any) -> tuple[Any, Any]:
    """Return the value of a field in a form that numpy accepts (rows as lists), and its type."""
    if type(value) is float:  # the most frequent type
        return value, float
    if isinstance(value, Record):
        return value, value.dtype
    if isinstance(value, tuple):
        parts = [_read(part) for part in value]
        return [part for part, _ in parts], tuple(kind for _, kind in parts)
    return value, (value.dtype, value.shape) if isinstance(value, np.ndarray) else type(value)


def _layout(value: Any) -> np.dtype[Any]:
    """Return the dtype that holds the value of a field."""
    if isinstance(value, Record):
        return value.dtype
    if isinstance(value, tuple):
        return np.dtype((_layout(value[0]), (len(value),)))
    array = np.asarray(value)
    return np.dtype((array.dtype, array.shape))
