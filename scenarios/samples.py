"""The instructions of a vehicle in files: columns of numbers over time, inline in the trial or in a CSV file.

Inline lists are *switch points*: the last value holds to the end of the run. The rows of a CSV file are *samples of
a log*: a row of a file holds until the next, the last one for one sampling interval more, at most 1 s (`LONGEST_HOLD`).
A log that ends before the run does is refused, because what was commanded after it is not
known. A smooth motion is known only as far as its last sample, and not where samples are missing, inline or not.

A CSV file has one header line with the columns of `scenarios.quantities`, and of commands those of
`scenarios.command_columns`, in any order, then one row a sample. Empty
lines and lines that start with ``#`` are remarks. Commands and a motion may stand in the file that a run writes
(``rudder_command_deg`` is the ``rudder_deg`` that was commanded): its other channels are passed over.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from scenarios.command_columns import actuator_of, written_column
from scenarios.errors import Problem, ScenarioError, nearest_and_all, nearest_or_all
from scenarios.files import Source, read_text
from scenarios.heading import continuous, contradicted, expected
from scenarios.instructions import (
    REACH_THE_END,
    Commands,
    Motion,
    ends_early,
    gap_at,
    gap_in_words,
    interpolation_of,
    motion_faults,
)
from scenarios.quantities import COMMANDS, MOTION, SECTIONS, SMOOTH, START, Quantity, by_field
from scenarios.schema import LISTS, check_section
from subzero.channels import BY_COLUMN
from subzero.errors import printable
from subzero.errors import short as shown
from subzero.files.read_file import MOST_COLUMNS, MOST_OF_A_CSV

LEFT_OPEN = ("depth_m", "wet_length_m", "drum_north_m", "drum_east_m", "drum_down_m")
"""Keys of [start] that a prescribed motion leaves open; the depth unless the motion says it."""

Given = Mapping[str, str | Path]
"""``commands`` or ``motion`` → a CSV file that replaces the section of the trial."""

LONGEST_HOLD = 1.0
"""The last row of a log is believed for no longer than this: a vehicle turns by tens of degrees in it. [s]"""

NUMERICAL = 1e-9
"""Times that differ by less than this are the same: decimal fractions are not exact in binary. [s]"""

Rows = tuple[Quantity, ...]
"""Columns that a section may have."""

Row = tuple[int, list[str]]
"""Line in the file, from 1, and the cells."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Columns of numbers as they stand in a file, each number checked by itself.

    Attributes:
        file: the file as the user named it.
        key: name of the column of times in messages.
        columns: column → values, in the units of the file.
        lines: the line of each sample in a CSV file; None in an inline list, where `key_line` is meant.
        key_line: line of the list of times in a trial file.
        interpolation: interpolation of a motion, see `Motion`.
    """

    file: str
    key: str
    columns: Mapping[str, Sequence[float]]
    lines: Sequence[int] | None = None
    key_line: int | None = None
    interpolation: str | None = None

    @property
    def is_smooth(self) -> bool:
        """Whether these are the samples of a motion that is smooth between them."""
        given = [name for name, q in by_field(MOTION).items() if q.name in self.columns]
        is_motion = "surge_speed" in given
        return is_motion and interpolation_of(given, self.interpolation) == SMOOTH

    @property
    def time(self) -> Sequence[float]:
        """The times of the samples. [s]"""
        return self.columns["time_s"]

    def problem(self, at: int, why: str, remedy: str) -> Problem:
        """Return a problem with the time of sample `at`."""
        line = self.lines[at] if self.lines else self.key_line
        key = self.key if self.lines else f"{self.key}[{at}]"
        return Problem(file=self.file, line=line, key=key, found=shown(self.time[at]), why=why, remedy=remedy)


def read_instructions(
    source: Source, given: Given, duration: float | None, command_rows: Rows = COMMANDS
) -> tuple[dict[str, Samples], list[Problem]]:
    """Read the commands or the motion of a trial.

    Args:
        source: the trial file.
        given: a file of commands that replaces those of the trial, or of a motion that replaces whatever it says.
        duration: how long the run lasts; None if that is wrong itself. [s]
        command_rows: the columns that the commands of its vehicle may have.

    Returns:
        ``commands`` or ``motion`` → its samples; and the problems.
    """
    kinds = [kind for kind in LISTS if source.table.get(kind) not in (None, {})]
    if "motion" in given or (given and not kinds):
        kinds = list(given)
    problems = _check_kinds(source, kinds, given)
    found: dict[str, Samples] = {}
    for kind in kinds:
        samples, wrong = _read_kind(source, kind, given, command_rows if kind == "commands" else MOTION)
        problems += wrong
        if kind == "motion" and "motion" not in given:
            problems += _check_start(source, samples)
        if samples:
            found[kind] = samples
            problems += check_times(samples, duration)
            problems += check_motion(samples) if kind == "motion" else []
            problems += _bad_headings(samples) if kind == "motion" and not problems else []
    return found, problems


def _check_kinds(source: Source, kinds: list[str], given: Given) -> list[Problem]:
    """Return the problem that there are no instructions, or two that exclude each other."""
    if not kinds:
        why = "neither [commands] nor [motion] is given"
        return [source.problem("", why, "Give one of the two; fig6 and fig5 show how.")]
    if "commands" in given and "motion" in kinds:
        why = "a prescribed motion takes no commands"
        remedy = "Leave out the file of commands, or take a scenario with [commands]."
        return [source.problem("motion", why, remedy)]
    if len(kinds) > 1:
        return [source.problem("motion", "[commands] is given too", "Keep one of [commands] and [motion].")]
    return []


def _check_start(source: Source, samples: Samples | None) -> list[Problem]:
    """Return keys of [start] that are not allowed with a prescribed motion: the motion gives them, or has no
    actuators.
    """
    start = source.table.get("start", {})
    why, remedy = "the prescribed motion says how the run starts", "Leave it out, and set it in [motion]."
    known = {quantity.name for quantity in START} | {"at_trim"}
    said = known - set(LEFT_OPEN) | {"depth_m"} & set(samples.columns if samples else ())
    given = [key for key in start if key in said] if isinstance(start, Mapping) else []
    return [source.problem(f"start.{key}", why, remedy, found=start[key]) for key in given]


def _read_kind(source: Source, kind: str, given: Given, rows: Rows) -> tuple[Samples | None, list[Problem]]:
    """Return the samples of a section: from the file that replaces it, the file that it names, or itself."""
    if kind in given:
        return read_csv(Path(given[kind]), str(given[kind]), kind, rows)
    values, problems = check_section(source, kind, source.table[kind], rows)
    asked = values.pop("interpolation", None)
    if "file" in values:
        samples, wrong = read_csv(source.folder / values["file"], values["file"], kind, rows)
    else:
        lists = {name: values[name] for name in values if values[name] is not None}
        samples, wrong = inline(source, kind, lists)
    if samples:
        samples = dataclasses.replace(samples, interpolation=asked)
    return samples, problems + wrong


def inline(
    source: Source, section: str, columns: Mapping[str, list[float]], first: str = "time_s"
) -> tuple[Samples | None, list[Problem]]:
    """Return the lists of a section as samples, None if there are no times; and those that are not as long as the
    first list.
    """
    key = f"{section}.{first}"
    if first not in columns:
        return None, []
    count = len(columns[first])
    remedy = f"Give one value for each {first.partition('_')[0]}."
    problems = [
        source.problem(
            f"{section}.{name}", f"this list has {len(values)} and {first} has {count} values", remedy
        )
        for name, values in columns.items()
        if len(values) != count
    ]
    return Samples(file=source.name, key=key, columns=columns, key_line=source.line(key)), problems


def check_times(samples: Samples, duration: float | None) -> list[Problem]:
    """Return the problems of the times: they start at 0, increase, and a log lasts as long as the run.

    Args:
        samples: the samples that were read.
        duration: how long the run lasts; None if that is not known, because it is wrong itself. [s]
    """
    time = samples.time
    problems = []
    if time[0] != 0.0:
        why = "what holds from 0 s until then is not said"
        problems.append(samples.problem(0, why, "The first time must be 0."))
    for at, (before, now) in enumerate(pairwise(time), start=1):
        if not now > before:
            why = f"the time before it is {before:g}"
            problems.append(samples.problem(at, why, "Times must increase from sample to sample."))
    if not problems and samples.is_smooth:
        return _check_smooth(samples, duration)
    if not problems and samples.lines and duration is not None:
        problems += _check_end(samples, duration)
    return problems


def check_motion(samples: Samples) -> list[Problem]:
    """Return the inconsistencies of the columns of a motion, each valid by itself."""
    names = {name: quantity.name for name, quantity in by_field(MOTION).items()}
    given = [name for name, column in names.items() if column in samples.columns]
    file, line, section = samples.file, samples.key_line, "" if samples.lines else "motion."
    return [
        Problem(file=file, line=line, key=f"{section}{names.get(name, name)}", why=why, remedy=remedy)
        for name, why, remedy in motion_faults(given, samples.interpolation)
    ]


def _check_smooth(samples: Samples, duration: float | None) -> list[Problem]:
    """Return the problems of a smooth motion where it is not known: at a gap, and after its last sample."""
    time = np.asarray(samples.time, dtype=float)
    at = gap_at(time)
    problems = [] if at is None else [samples.problem(at, *gap_in_words(time, at))]
    if duration is not None and time[-1] < duration - NUMERICAL:
        problems.append(samples.problem(time.size - 1, ends_early(duration), REACH_THE_END))
    return problems


def _check_end(samples: Samples, duration: float) -> list[Problem]:
    """Return the problem that a log ends before the run does."""
    last = samples.time[-1]
    interval = last - samples.time[-2] if len(samples.time) > 1 else 0.0
    if last + min(interval, LONGEST_HOLD) >= duration - NUMERICAL:
        return []
    why = f"the file ends early: the run lasts {duration:g} s"
    shorter = f", or set duration_s to {last:g}" if last > 0.0 else ""
    remedy = f"Add rows up to {duration:g} s{shorter}."
    return [samples.problem(len(samples.time) - 1, why, remedy)]


def commands(samples: Samples, listed: Rows = ()) -> Commands:
    """Return checked samples as commands: rev/s, radians, and the units of listed actuators.

    Args:
        samples: of commands; a column that is left out is zero.
        listed: columns of the listed actuators of the vehicle; of those that are given, the commands have one each.
    """
    given = [column for column in listed if column.name in samples.columns]
    zeros = np.zeros(len(samples.time))
    time, *values = (
        _inner(samples, column) if column.name in samples.columns else zeros for column in (*COMMANDS, *given)
    )
    names = tuple(actuator_of(column) for column in given)
    return Commands(time=time, values=np.ascontiguousarray(np.column_stack(values)), listed=names)


def motion(samples: Samples) -> Motion:
    """Return checked samples as a prescribed motion: m/s and radians. A compass in a log may jump by whole turns."""
    given = {name: _inner(samples, q) for name, q in by_field(MOTION).items() if q.name in samples.columns}
    if samples.lines:
        given["heading"] = continuous(given["heading"], _expected(given), math.tau)
    return Motion(**given, interpolation=samples.interpolation)


def _expected(given: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return how the heading of a motion is expected to go on. [rad]"""
    return expected(given["time"], given.get("yaw_rate"))


def _bad_headings(samples: Samples) -> list[Problem]:
    """Return the problem of headings of a log that contradict those around them: the vehicle would be spun round."""
    given = {name: _inner(samples, q) for name, q in by_field(MOTION).items() if q.name in samples.columns}
    bad = np.flatnonzero(contradicted(given["heading"], _expected(given), math.tau))
    if not samples.lines or not bad.size:
        return []
    more = f", and {bad.size - 1} more to {given['time'][bad[-1]]:g} s" if bad.size > 1 else ""
    why = f"its heading contradicts those before and after{more}, as if averaged across north"
    return [samples.problem(int(bad[0]), why, "Leave such rows out.")]


def _inner(samples: Samples, quantity: Quantity) -> np.ndarray:
    """Return one column in inner units."""
    return np.asarray(samples.columns[quantity.name], dtype=float) * quantity.scale


def read_csv(
    path: Path, name: str, section: str, rows: Rows | None = None
) -> tuple[Samples | None, list[Problem]]:
    """Read the samples of a section from a CSV file.

    Args:
        path: the file.
        name: the file as the user named it.
        section: ``commands`` or ``motion``.
        rows: the columns that it may have; those of the section by default.

    Returns:
        the samples, None if there are no times to speak of; and the problems.
    """
    name, wanted = printable(name), SECTIONS[section] if rows is None else rows
    try:
        (line, given), cells = _table(read_text(path, name, MOST_OF_A_CSV), name)
    except ScenarioError as error:
        return None, list(error.problems)
    commanded = wanted[1:] if section == "commands" else ()
    written = {written_column(row, "command"): row.name for row in commanded}
    header = line, [written.get(column, column) for column in given]
    columns, problems = _columns(name, header[1], cells, wanted)
    listed = wanted[len(SECTIONS[section]) :]
    passed_over = [*BY_COLUMN, *(written_column(row, "state") for row in listed)]
    problems += _header_problems(name, header, wanted, passed_over)
    problems += _shape_problems(name, header[1], cells)
    problems.sort(key=lambda problem: problem.line or 0)
    whole = _whole(header[1], cells)
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
    """Return the known columns, NaN where a cell cannot be used, and the problems of those cells."""
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
            more = {row.name for row in COMMANDS} < set(allowed)
            why = "there is no such column"
            remedy = (nearest_and_all if more else nearest_or_all)(column, allowed)
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
    why, remedy = f"the header has {len(columns)} columns", "Give every column one cell."
    return [
        Problem(file=name, line=line, found=f"{len(cells)} cells", why=why, remedy=remedy)
        for line, cells in rows
        if len(cells) != len(columns)
    ]


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
