"""Logs in text: CSV of any kind, and MOOS.

A CSV file is read in chunks of lines. Its delimiter and its decimal sign are those with which most cells of its first
lines are numbers or times, in equally long rows. Memory is bounded: of columns that are not wanted no value is kept,
and of a file with more rows than a record can have only every n-th row is.
"""

from __future__ import annotations

import csv
import io
import itertools
import os
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from subzero.errors import short
from subzero.logs.names import LATITUDE, LONGITUDE, is_unit, recognised
from subzero.logs.table import (
    NUMBER,
    TEXT,
    Column,
    Progress,
    Sample,
    Table,
    Wanted,
    numbers,
    refusal,
    side_by_side,
)
from subzero.logs.times import form_of, in_order, seconds_of

GAPS = frozenset(
    ("", "nan", "+nan", "-nan", "null", "none", "na", "n/a", "#n/a", "-", "--", "inf", "-inf", "+inf")
)
"""Cells that hold no measurement, in small letters."""
HEMISPHERE, SIGNS = "hemisphere", {"N": 1.0, "E": 1.0, "S": -1.0, "W": -1.0}
"""Form of letters after latitudes and longitudes, and their signs."""
HEAD, LONGEST_LINE, CHUNK = 1 << 16, 1 << 20, 20_000
"""The size of the first look [byte], the longest line [character], and rows that are converted at once."""
SAMPLE = 100
"""Number of lines that determine delimiter, decimal sign and header."""
MOST_ROWS = 1_000_000
"""Of more rows only every n-th is kept: a record of ten channels then has about as much text as is read of one."""
REMARKS = ("#", "%", "//")
FORMATS = ((",", "."), *itertools.product((";", "\t", "|", " "), (".", ",")))
"""Delimiter (a blank is any white space) and decimal sign."""


class _Layout(NamedTuple):
    """How a CSV file is written: delimiter, decimal sign, names, units, lines before the first row, and rows to one."""

    delimiter: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    skipped: int
    stride: int


def read_csv(path: Path, wanted: Wanted, progress: Progress) -> Table:
    """Read a table in text."""
    layout = _layout(path, list(itertools.islice(lines_of(path), SAMPLE)))
    parts: list[list[Column]] = [[] for _ in layout.names]
    kept, notes = list[int](), list[str]()
    for rows in _chunks(path, layout, notes, progress):
        cells = list(zip(*rows, strict=True))
        if not parts[0]:
            parts = [[_column(column, layout.decimal)] for column in cells]
            kept = [at for at, found in enumerate(parts) if _is_kept(found[0], layout, at, wanted)]
            _hold_stride(path, [parts[at][0].values for at in kept], layout.stride)
            parts = [[replace(found, values=found.values[:: layout.stride])] for (found,) in parts]
        else:
            for at in kept:
                parts[at].append(_column(cells[at], layout.decimal))
    if not parts[0]:
        return Table(str(path), {})
    size = sum(part.values.size for part in parts[kept[0]]) if kept else parts[0][0].values.size
    columns = {}
    for at, (name, unit) in enumerate(zip(layout.names, layout.units, strict=True)):
        values = None if at in kept else np.broadcast_to(np.nan, size)
        columns[name] = replace(_joined(path, name, parts[at], values), unit=unit)
        parts[at] = []  # so that no column is in memory twice
    notes += _with_hemispheres(columns)
    notes += [f"Of {layout.stride} rows one is kept, {size} in all."] if layout.stride > 1 else []
    return Table(str(path), columns, tuple(notes), layout.stride)


def _is_kept(column: Column, layout: _Layout, at: int, wanted: Wanted) -> bool:
    return column.form not in (NUMBER, TEXT) or wanted(layout.names[at], layout.units[at])


def _hold_stride(path: Path, columns: Sequence[np.ndarray], stride: int) -> None:
    """Raise an error where leaving rows out would lose a sensor: rows that hold the sensors in turn."""
    known = [np.isfinite(values) for values in columns]
    if any(2.0 * is_known[::stride].mean() < is_known.mean() for is_known in known):
        why = f"it has more than {MOST_ROWS} rows, which hold sensors in turn"
        raise refusal(path, why, "Split it.")


def lines_of(path: Path, progress: Progress = lambda _: None) -> Iterator[str]:
    """Give the lines of a text file, without ends."""
    size = os.path.getsize(path)
    with (
        open(path, "rb") as raw,
        io.TextIOWrapper(raw, _encoding(path), errors="replace", newline=None) as file,
    ):
        for number in itertools.count(1):
            if not (line := file.readline(LONGEST_LINE)):
                return
            if len(line) == LONGEST_LINE:
                why = f"a line has more than {LONGEST_LINE} characters"
                raise refusal(path, why, "Is it a table in text?")
            if number % CHUNK == 0:
                progress(raw.tell() / size)
            yield line.rstrip("\n")


def _encoding(path: Path) -> str:
    """Return the encoding of a text file, from its first bytes."""
    with open(path, "rb") as file:
        head = file.read(HEAD)
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if b"\0" in head:
        raise refusal(path, "it is no text, and its ending says nothing else", "Endings are in docs/logs.md.")
    try:
        head.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return "utf-8-sig" if error.start > len(head) - 4 == HEAD - 4 else "latin-1"
    return "utf-8-sig"


def _layout(path: Path, lines: list[str]) -> _Layout:
    """Find how a CSV file is written from its first lines; a remark before the first row may hold the names."""
    written = [(at, line) for at, line in enumerate(lines) if line.strip()]
    plain = [line for _, line in written if not line.startswith(REMARKS)]
    if not plain:
        raise refusal(path, "it holds no samples", "It needs names of columns, and rows of numbers.")
    delimiter, decimal = max(FORMATS, key=lambda kind: _fit(plain, *kind))
    width = _width([_cells(line, delimiter) for line in plain])
    rows = [(at, _cells(line.lstrip("#%/ "), delimiter), line.startswith(REMARKS)) for at, line in written]
    if all(
        not row[-1] for _, row, _ in rows if len(row) == width
    ):  # a delimiter behind each row, but for the names
        rows = [(at, [*row, ""] if len(row) == width - 1 else row, is_remark) for at, row, is_remark in rows]
    full = [(at, row, is_remark) for at, row, is_remark in rows if len(row) == width]
    is_data = [not is_remark and _has_numbers(row, decimal) for _, row, is_remark in full]
    head = full[: is_data.index(True) if any(is_data) else None]
    at, units = (head[-1][0] if head else 0), [""] * width
    if head and _are_units(head[-1][1], decimal):
        units = head.pop()[1]
    if not head:
        raise refusal(path, "its first row has numbers, not names of columns", "Write names above it.")
    length = sum(len(line) + 1 for line in plain) / len(plain)
    stride = -int(-os.path.getsize(path) / length // MOST_ROWS)
    return _Layout(delimiter, decimal, _distinct(head[-1][1]), tuple(units), at + 1, stride)


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    if '"' in line:
        try:
            row = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
        except (csv.Error, StopIteration):
            return []
        return [cell.strip() for cell in row]
    return [cell.strip() for cell in line.split(delimiter)]


def _width(rows: Sequence[Sequence[str]]) -> int:
    """Return the usual number of cells in a row."""
    return Counter(len(row) for row in rows).most_common(1)[0][0]


def _fit(lines: list[str], delimiter: str, decimal: str) -> tuple[bool, float, int]:
    """Return how well a delimiter and a decimal sign suit some lines: the share of cells that are values in full
    rows.
    """
    rows = [_cells(line, delimiter) for line in lines]
    width = _width(rows)
    full = [row for row in rows if len(row) == width]
    good = sum(cell.lower() in GAPS or _has_numbers([cell], decimal) for row in full for cell in row)
    return width > 1, len(full) / len(rows) * good / max(sum(map(len, full)), 1), width


def _has_numbers(row: Sequence[str], decimal: str) -> bool:
    return any(_value(cell, decimal)[0] != TEXT for cell in row)


def _are_units(row: Sequence[str], decimal: str) -> bool:
    """Return whether a row holds units: no numbers, and most of its cells are known."""
    written = [cell for cell in row if cell]
    return bool(written) and not _has_numbers(row, decimal) and 2 * sum(map(is_unit, written)) > len(written)


def _distinct(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of which none is empty and none occurs twice."""
    found: dict[str, None] = {}
    for at, name in enumerate(names, start=1):
        new = name or f"column {at}"
        while new in found:
            new = f"{name} ({at})"
            name = f"{name}_"
        found[new] = None
    return tuple(found)


def _chunks(path: Path, layout: _Layout, notes: list[str], progress: Progress) -> Iterator[list[list[str]]]:
    """Give the rows, some thousands at once, of the first chunk all and then those that are kept; a last row that was
    cut off is left out.
    """
    rows, width, cut, count = list[list[str]](), len(layout.names), 0, 0
    for number, line in enumerate(lines_of(path, progress), start=1):
        if number <= layout.skipped or not line.strip() or line.startswith(REMARKS):
            continue
        if cut:
            why = f"line {cut} has another number of cells than the {width} names"
            raise refusal(path, why, "Repair or remove it.")
        count += 1
        if count > CHUNK and (count - 1) % layout.stride:
            continue
        row = _cells(line, layout.delimiter)
        if len(row) == width:
            rows.append(row)
        else:
            cut = number
        if len(rows) == CHUNK:
            yield rows
            rows = []
    notes += [f"The last row, line {cut}, was cut off and is left out."] if cut else []
    if rows:
        yield rows


def _number(cell: str, decimal: str) -> float | None:
    try:
        return float(cell.replace(",", ".", 1) if decimal == "," else cell)
    except ValueError:
        return None


def _value(cell: str, decimal: str) -> tuple[str, float]:
    """Return the form of a cell, and its number; that of a place may end in a letter."""
    if (number := _number(cell, decimal)) is not None:
        return NUMBER, number
    if cell[-1:] in SIGNS and re.match(r"[\d.,]+ ?°? ?[NSEW]$", cell):
        size = _number(cell[:-1].rstrip(" °"), decimal)
        return (NUMBER, SIGNS[cell[-1]] * size) if size is not None else (TEXT, np.nan)
    return seconds_of(cell) or (TEXT, np.nan)


def _column(cells: Sequence[str], decimal: str) -> Column:
    """Convert cells of one column; its form is that of most of them that are no gaps."""
    if decimal == ".":
        try:
            return numbers(np.array(cells, dtype=float))
        except ValueError:
            pass
    values, forms = np.full(len(cells), np.nan), Counter[str]()
    written = {cell for cell in cells if cell.lower() not in GAPS}
    if written and written <= set(SIGNS):
        return Column(values=np.array([SIGNS.get(cell, np.nan) for cell in cells]), form=HEMISPHERE)
    for at, cell in enumerate(cells):
        if cell in written:
            form, values[at] = _value(cell, decimal)
            forms[form] += 1
    return numbers(values, _form(forms))


def _form(forms: Counter[str]) -> str:
    """Return the form of a column."""
    if not forms:
        return NUMBER
    return TEXT if TEXT in forms and 2 * forms[TEXT] >= forms.total() else form_of(forms)


def _joined(path: Path, name: str, parts: list[Column], values: np.ndarray | None) -> Column:
    """Return one column of its parts, or with the values that are given in their place."""
    forms = Counter(part.form for part in parts if not part.is_empty) or Counter(part.form for part in parts)
    values = np.concatenate([part.values for part in parts]) if values is None else values
    values, form, problem = in_order(values, _form(forms))
    if problem:
        raise refusal(path, f"{short(name)} {problem}", "Write dates as 2026-11-28.")
    return Column(values=values, form=form)


def _with_hemispheres(columns: dict[str, Column]) -> list[str]:
    """Give latitudes and longitudes the signs of the letters in the column after them, and note it."""
    notes = []
    for name, letters in itertools.pairwise(columns):
        if columns[letters].form != HEMISPHERE:
            continue
        found = recognised(name)
        if found and found.channel in (LATITUDE, LONGITUDE):
            signed = np.abs(columns[name].values) * columns[letters].values
            columns[name] = replace(columns[name], values=signed)
            notes.append(f"{short(name)} has the signs of the letters in {short(letters)}.")
        columns[letters] = replace(columns[letters], form=TEXT)
    return notes


def read_alog(path: Path, wanted: Wanted, progress: Progress) -> Table:
    """Read the numbers of a MOOS log: ``time  NAME  source  value``; each name becomes a column with gaps."""

    def samples() -> Iterator[Sample]:
        for line in lines_of(path, progress):
            parts = line.split(None, 3)
            if len(parts) == 4 and not line.startswith("%") and wanted(parts[1], ""):
                time, value = _number(parts[0], "."), _number(parts[3].strip(), ".")
                if time is not None and value is not None:
                    yield Sample(parts[1], "", time, value)

    return Table(str(path), side_by_side(samples()))
