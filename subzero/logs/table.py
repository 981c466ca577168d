"""A table of numbers from a log: columns of one length, with the units that the file writes; and the error for none.

Every cell is a number. Dates and times of day are seconds, a text is a gap, and a column knows which of them it holds
(`Column.form`). The meaning of a column is not decided here (`logs.names`), and no unit is converted.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from subzero.channels import TIME
from subzero.errors import UserError, printable, short

NUMBER, TEXT = "number", "text"
LARGEST = 1e19
"""Nothing that is logged is larger; nanoseconds since 1970 are 2e18."""
MOST_NAMES = 12
"""So many columns are named in a message."""
SENTINELS = (99999.0, 65535.0, 32768.0, 32767.0, 9999.0, 999.0)
"""Numbers, of either sign, that stand for a gap in a column whose other values are all less than half as large."""

Wanted = Callable[[str, str], bool]
"""Says whether a column of this name and unit may be used; of others no values are kept."""
Progress = Callable[[float], None]
"""Called with the share of a file that is read, 0 to 1."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column of a log.

    Args:
        values: numbers, or seconds of dates and times; NaN in gaps, and in all rows if it is not wanted. Shape (rows,).
        unit: as the file writes it, empty if it does not.
        form: the form of its cells: "number", "text", or a form of `logs.times`.
    """

    values: np.ndarray
    unit: str = ""
    form: str = NUMBER

    @property
    def is_empty(self) -> bool:
        """Return whether it holds no value."""
        return not np.isfinite(self.values).any()


class Table(NamedTuple):
    """The contents of a log.

    Args:
        source: the file, as the user named it.
        columns: name → column; all of one length.
        notes: rows and columns that were left out in reading, in sentences.
        stride: of so many rows of the file one is kept.
    """

    source: str
    columns: Mapping[str, Column]
    notes: tuple[str, ...] = ()
    stride: int = 1


class Sample(NamedTuple):
    """A number in a log of messages: name and unit of its column, time, value."""

    name: str
    unit: str
    time: float
    value: float


def refusal(path: str | Path, why: str, remedy: str) -> UserError:
    """Return the error for a log that cannot be imported, in one line."""
    return UserError(f"The log {printable(str(path))} cannot be imported: {why}. {remedy}")


def names_of(names: Iterable[str]) -> str:
    """Return names of columns as a message shows them: the first ones, and how many more."""
    shown = [short(name) for name in names]
    rest = [f"{len(shown) - MOST_NAMES} more"] if len(shown) > MOST_NAMES else []
    return ", ".join([*shown[:MOST_NAMES], *rest])


def numbers(values: np.ndarray, form: str = NUMBER, unit: str = "") -> Column:
    """Return a column in which numbers that nothing measures are gaps."""
    return Column(values=np.where(np.abs(values) <= LARGEST, values, np.nan), form=form, unit=unit)


def side_by_side(samples: Iterable[Sample]) -> dict[str, Column]:
    """Return samples that each have their own times [s] as columns with gaps, on one clock."""
    series: dict[tuple[str, str], tuple[array[float], array[float]]] = {}
    for name, unit, at, value in samples:
        stamps, values = series.setdefault((name, unit), (array("d"), array("d")))
        stamps.append(at)
        values.append(value)
    if not series:
        return {}
    times = np.unique(np.concatenate([np.asarray(stamps) for stamps, _ in series.values()]))
    columns = {TIME.column: Column(values=times, unit="s")}
    for (name, unit), (stamps, values) in series.items():
        spread = np.full(times.size, np.nan)
        spread[np.searchsorted(times, np.asarray(stamps))] = np.asarray(values)
        columns[name] = numbers(spread, unit=unit)
    return columns


def without_sentinels(columns: Mapping[str, Column]) -> tuple[dict[str, Column], list[str]]:
    """Return columns without numbers that stand for a gap, and a sentence about each of them."""
    found, notes = dict(columns), list[str]()
    for name, column in columns.items():
        values = column.values
        for sentinel in SENTINELS if column.form == NUMBER else ():
            is_gap, size = np.abs(values) == sentinel, np.abs(values)
            others = np.max(size, where=np.isfinite(size) & ~is_gap, initial=0.0)
            if is_gap.any() and others < 0.5 * sentinel:
                values = np.where(is_gap, np.nan, values)
                notes.append(f"{short(name)}: {is_gap.sum()} cells of ±{sentinel:g} are taken as gaps.")
        found[name] = replace(column, values=values)
    return found, notes
