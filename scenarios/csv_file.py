"""Read columns of numbers from a CSV file, and say of every wrong cell where it stands.

One header line with the columns of `scenarios.quantities`, in any order, then one row a sample. Empty lines
and lines that start with ``#`` are remarks. A motion may stand in the file that a run writes: the channels that say
nothing of the motion are passed over. Whether the times make sense is checked in `scenarios.samples`.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from pathlib import Path

from scenarios.errors import Problem, ScenarioError, nearest_or_all
from scenarios.files import read_text
from scenarios.quantities import SECTIONS, Quantity
from scenarios.samples import Samples
from subzero.channels import BY_COLUMN
from subzero.errors import printable
from subzero.errors import short as shown
from subzero.user_file import MOST_COLUMNS, MOST_OF_A_CSV

Row = tuple[int, list[str]]
"""Line in the file, from 1, and the cells."""


def read_csv(path: Path, name: str, section: str) -> tuple[Samples | None, list[Problem]]:
    """Read the samples of a section from a CSV file.

    Args:
        path: the file.
        name: the file as the user named it.
        section: ``commands`` or ``motion``.

    Returns:
        the samples, None if there are no times to speak of; and the problems.
    """
    name = printable(name)
    try:
        header, rows = _table(read_text(path, name, MOST_OF_A_CSV), name)
    except ScenarioError as error:
        return None, list(error.problems)
    columns, problems = _columns(name, header[1], rows, SECTIONS[section])
    problems += _header_problems(name, header, SECTIONS[section], BY_COLUMN if section == "motion" else ())
    problems += _shape_problems(name, header[1], rows)
    problems.sort(key=lambda problem: problem.line or 0)
    whole = _whole(header[1], rows)
    time = columns.get("time_s", [])
    if not time or any(math.isnan(at) for at in time):
        return None, problems
    return Samples(file=name, key="time_s", columns=columns, lines=[line for line, _ in whole]), problems


def _whole(header: list[str], rows: list[Row]) -> list[Row]:
    """Return the rows that have one cell for each column."""
    return [row for row in rows if len(row[1]) == len(header)]


def _columns(
    name: str, header: list[str], rows: list[Row], quantities: Iterable[Quantity]
) -> tuple[dict[str, list[float]], list[Problem]]:
    """Return the columns we know, NaN where a cell cannot be used, and the problems of those cells."""
    columns: dict[str, list[float]] = {}
    problems: list[Problem] = []
    for quantity in quantities:
        if quantity.name in header:
            at = header.index(quantity.name)
            columns[quantity.name] = [
                _number(name, quantity, line, cells[at], problems) for line, cells in _whole(header, rows)
            ]
    return columns, problems


def _table(text: str, name: str) -> tuple[Row, list[Row]]:
    """Return the header and the rows, without remarks."""
    reader = csv.reader(io.StringIO(text, newline=""))
    try:
        rows = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader]
    except csv.Error as error:
        why = f"this is not a CSV file ({error})"
        problem = Problem(file=name, line=reader.line_num, why=why, remedy="Save it as plain CSV.")
        raise ScenarioError([problem]) from None
    rows = [(line, cells) for line, cells in rows if any(cells) and not cells[0].startswith("#")]
    if not rows:
        remedy = "Write a header line and one row for each sample."
        raise ScenarioError([Problem(file=name, why="the file is empty", remedy=remedy)])
    if len(rows[0][1]) > MOST_COLUMNS:
        why = f"it has more than {MOST_COLUMNS} columns"
        raise ScenarioError([Problem(file=name, why=why, remedy="Leave out those that say nothing here.")])
    return rows[0], rows[1:]


def _header_problems(
    name: str, header: Row, quantities: Iterable[Quantity], passed_over: Iterable[str]
) -> list[Problem]:
    """Return the columns that are unknown, doubled or missing."""
    line, columns = header
    problems = []
    allowed = [quantity.name for quantity in quantities]
    needed = [quantity.name for quantity in quantities if quantity.default is None]
    for at, column in enumerate(columns):
        if column not in allowed and column in passed_over:
            continue
        if column not in allowed:
            why, remedy = "there is no such column", nearest_or_all(column, allowed)
        elif column in columns[:at]:
            why, remedy = "this column stands twice", "Keep one of the two."
        else:
            continue
        problems.append(
            Problem(file=name, line=line, key="header", found=shown(column), why=why, remedy=remedy)
        )
    remedy = f"Needed: {', '.join(needed)}."
    missing = [column for column in needed if column not in columns]
    why = "this column is missing"
    return problems + [Problem(file=name, line=line, key=key, why=why, remedy=remedy) for key in missing]


def _shape_problems(name: str, columns: list[str], rows: list[Row]) -> list[Problem]:
    """Return the rows that have more or fewer cells than the header, or that there are no rows."""
    if not rows:
        return [Problem(file=name, why="there are no rows below the header", remedy="Add one a sample.")]
    count = len(columns)
    return [
        Problem(
            file=name, line=line, found=f"{len(cells)} cells",
            why=f"the header has {count} columns", remedy="Give every column one cell.",
        )
        for line, cells in rows
        if len(cells) != count
    ]  # fmt: skip


def _number(name: str, quantity: Quantity, line: int, cell: str, problems: list[Problem]) -> float:
    """Return the number in a cell; if it cannot be used, add the problem and return NaN."""
    try:
        value = float(cell)
    except ValueError:
        value, why = math.nan, "this is not a number" if cell else "this cell is empty"
    else:
        if quantity.low <= value <= quantity.high:
            return value
        why = "this is outside its limits" if math.isfinite(value) else "this is not a finite number"
    found, remedy = shown(cell) if cell else "", quantity.allowed
    problems.append(Problem(file=name, line=line, key=quantity.name, found=found, why=why, remedy=remedy))
    return math.nan
