"""A record: columns of readings and inputs at their times, from memory or from a table with a header.

read("tanks.csv", time="4 s", level="yEst", pump="uEst")       # every 4 s
read("dive.csv.gz", time="elapsed", depth="eng_depth")         # times in a column [s]
"""

from __future__ import annotations

import csv
import gzip
import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from subzero.errors import UserError


@dataclass(frozen=True, eq=False)
class Record:
    """What was measured.

    Attributes:
        time: of the inputs, and of every channel without its own times (n,). [s]
        columns: name of a channel or an input → its values; NaN where there is none.
        times: channel → its own times, for an instrument with its own clock. [s]
        name: as messages and tables show it.
    """

    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    times: Mapping[str, np.ndarray] = field(default_factory=dict)
    name: str = "the record"

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", _ascending(self.time, f"{self.name}: time"))
        columns = {name: _numbers(values, f"{self.name}: {name}") for name, values in self.columns.items()}
        times = {
            name: _ascending(values, f"{self.name}: times of {name}") for name, values in self.times.items()
        }
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "times", times)
        for name, values in columns.items():
            if values.size != self.times_of(name).size:
                raise UserError(
                    f"{self.name}: {name} has {values.size} values and {self.times_of(name).size} times; give one "
                    "time for each value."
                )

    def times_of(self, channel: str) -> np.ndarray:
        """Return the times of a channel (m,). [s]"""
        return self.times.get(channel, self.time)

    def between(self, start: float, end: float) -> Record:
        """Return the record until a time, with the readings before another left out; inputs are kept. [s]

        A simulation begins at the beginning, so the inputs before `start` are needed.
        """

        def part(name: str, values: np.ndarray) -> np.ndarray:
            t = self.times_of(name)
            return np.where(t >= start, values, np.nan)[t <= end]

        columns = {name: part(name, values) for name, values in self.columns.items()}
        times = {name: t[t <= end] for name, t in self.times.items()}
        return Record(self.time[self.time <= end], columns, times, self.name)


def read(
    path: str | Path, *, time: str, times: Mapping[str, str] | None = None, name: str = "", **columns: str
) -> Record:
    """Return a record from a table: CSV with a header, packed by gzip or not.

    Args:
        path: of the table.
        time: the column of times [s], or the interval between rows, such as "4 s".
        times: channel → column of its own times.
        name: of the record; the file's if it is not given.
        **columns: name in the model → column of the table.

    Raises:
        UserError: no such file or column; a value is no number.
    """
    table = _table(Path(path))
    chosen = {own: _column(table, column, str(path)) for own, column in columns.items()}
    rows = len(next(iter(chosen.values()), np.zeros(0)))
    step = _interval(time)
    if step is None:
        grid = _column(table, time, str(path))
        kept = np.isfinite(grid)
        grid, chosen = grid[kept], {own: values[kept] for own, values in chosen.items()}
    else:
        grid = step * np.arange(rows)
    own_times = {own: _column(table, column, str(path)) for own, column in (times or {}).items()}
    return Record(grid, chosen, own_times, name or Path(path).name)


def _interval(text: str) -> float | None:
    number, _, unit = text.strip().partition(" ")
    if unit not in ("s", "ms"):
        return None
    try:
        return float(number) * (1e-3 if unit == "ms" else 1.0)
    except ValueError:
        return None


def _table(path: Path) -> dict[str, list[str]]:
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise UserError(
            f"{path}: {error.strerror or error}. Give the path of a table with a header."
        ) from None
    text = (gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw).decode("utf-8-sig", errors="replace")
    rows = [row for row in csv.reader(io.StringIO(text)) if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise UserError(f"{path}: there are {len(rows)} rows; a table needs a header and values.")
    header = [cell.strip() for cell in rows[0]]
    return {
        name: [row[k] if k < len(row) else "" for row in rows[1:]] for k, name in enumerate(header) if name
    }


def _column(table: Mapping[str, list[str]], name: str, path: str) -> np.ndarray:
    if name not in table:
        near = get_close_matches(name, table, 1)
        hint = f" Did you mean {near[0]!r}?" if near else f" There are: {', '.join(table)}."
        raise UserError(f"{path}: no column {name!r}.{hint}")
    cells = [cell.strip() for cell in table[name]]
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError as error:
        raise UserError(f"{path}: column {name!r}: {error}.") from None


def _numbers(values: Any, what: str) -> np.ndarray:
    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise UserError(f"{what} has values that are no numbers.") from None
    if found.ndim != 1:
        raise UserError(f"{what} has the shape {found.shape}; give one row of values.")
    return np.where(np.isfinite(found), found, np.nan)


def _ascending(values: Any, what: str) -> np.ndarray:
    found = _numbers(values, what)
    if found.size < 2:
        raise UserError(f"{what} has {found.size} values; two or more are needed.")
    if not np.isfinite(found).all() or not (np.diff(found) > 0.0).all():
        at = int(np.argmax(~(np.diff(found) > 0.0)))
        raise UserError(
            f"{what} does not rise from row {at} to {at + 1}: {found[at]:g}, {found[at + 1]:g}. Sort it."
        )
    return found
