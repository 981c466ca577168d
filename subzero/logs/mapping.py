"""The map: which column of a log is which channel, in which unit, and why; found, written, edited, and read again.

    [time]
    columns = ["TimeUS"]
    unit = "us"

    [columns]
    "NAV_SPEED" = { channel = "surge_speed", unit = "kn" }

Without a map it is found from names (`logs.names`) and values (`logs.evidence`). What they do not decide, or contradict,
is asked: the map then has to say it. A map that is given is the whole map, and its word holds.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from subzero.channels import BY_COLUMN, BY_NAME
from subzero.channels import TIME as TIME_CHANNEL
from subzero.errors import UserError, listed, printable, real, short, suggestion
from subzero.logs import evidence, times
from subzero.logs.evidence import Finding, Measured, findings
from subzero.logs.names import (
    LATITUDE,
    LONGITUDE,
    PRESSURE,
    UNITS,
    Named,
    kind_of,
    recognised,
    time_name,
    unit_of,
)
from subzero.logs.table import NUMBER, TEXT, Table
from subzero.user_file import MOST_OF_A_TOML, UnreadableFileError, read_text

ASKED = "?"
"""Unit in a map that the user has to fill in."""
TARGETS = {LATITUDE: "north", LONGITUDE: "east", PRESSURE: "depth"}
"""What is no channel itself → the channel that it becomes."""
EQUATOR_M, SQUARED_ECCENTRICITY = 6378137.0, 6.69437999014e-3
"""Ellipsoid WGS 84."""
ALIKE = 0.98
"""Cosine between two columns from which on they measure the same. [-]"""
TIME_KEYS = ("columns", "unit", "start", "part", "sort", "every_s")


@dataclass(frozen=True, kw_only=True)
class Line:
    """A column of the log in the map; without a channel it is not used.

    Args:
        name: of the column.
        channel: of `subzero.channels`, or latitude, longitude, pressure; empty if it is not used.
        unit: of the column; "?" if it is asked for.
        factor: times the column, besides its unit; −1 for one that is upside down.
        reason: why.
        question: what the user has to decide; empty if nothing.
        is_checked: the values leave no other unit.
    """

    name: str
    channel: str = ""
    unit: str = ""
    factor: float = 1.0
    reason: str = ""
    question: str = ""
    is_checked: bool = False


@dataclass(frozen=True, kw_only=True)
class Clock:
    """How times are read.

    Args:
        columns: one with times, or a date and a time of day; none if rows are evenly spread.
        unit: of its numbers, of `times.CLOCK_UNITS`; empty for dates and times of day.
        start: time of the log that is t = 0; its first one if None.
        part: which part of a clock that was restarted, from 1; 0 if it was not.
        sort: put rows in the order of their times.
        every: time between rows, if there are no columns. [s]
        reason: why.
        question: what the user has to decide; empty if nothing.
    """

    columns: tuple[str, ...] = ()
    unit: str = ""
    start: Any = None
    part: int = 0
    sort: bool = False
    every: float = 0.0
    reason: str = "map"
    question: str = ""


@dataclass(frozen=True, kw_only=True)
class Map:
    """How a log becomes a record."""

    clock: Clock
    lines: tuple[Line, ...] = field(default=())

    @property
    def questions(self) -> list[str]:
        """What the user has to decide, in sentences."""
        return [line.question for line in (self.clock, *self.lines) if line.question]


# Found


def find_clock(table: Table) -> Clock:
    """Return how the times of a log are read, by names and forms of its columns.

    Raises:
        UserError: there is no time.
    """
    forms = {name: column.form for name, column in table.columns.items() if column.form not in (NUMBER, TEXT)}
    for name, form in forms.items():
        if form in (*times.DATE_AND_TIME, times.MIXED):
            return Clock(columns=(name,), reason=form)
    days, hours = (
        [name for name, form in forms.items() if form == kind] for kind in (times.DATE, times.TIME_OF_DAY)
    )
    if days and hours:
        return Clock(columns=(days[0], hours[0]), reason="date, and time of day")
    named = {name: found for name in table.columns if name not in days + hours and (found := time_name(name))}
    numbers = [
        name
        for name in named
        if table.columns[name].form == NUMBER and np.isfinite(table.columns[name].values).any()
    ]
    if not numbers:
        if hours:
            return Clock(columns=(hours[0],), reason="time of day")
        raise UserError(
            f"The log {table.source} cannot be imported: none of its columns is a time. Name it in the map: [time] "
            'columns = ["NAME"], unit = "s", or say how far rows are apart: [time] every_s = 0.1.'
        )
    name = min(numbers, key=lambda name: named[name][0])
    column = table.columns[name]
    written = named[name][1] or {"seconds": "s"}.get(
        column.unit, column.unit if column.unit in times.CLOCK_UNITS else ""
    )
    return _clock_of_numbers(name, column.values, written)


def _clock_of_numbers(name: str, values: np.ndarray, written: str) -> Clock:
    """Return the clock of a column of numbers, in the unit that is written if its size and steps allow that."""
    likely = times.unit_by_values(values)
    if written and (written in likely or written not in ("s", "ms", "us", "ns")):
        return Clock(columns=(name,), unit=written, reason="unit in the name")
    if likely == ["s"] or (len(likely) == 1 and not written) or (len(likely) == 1 and _is_epoch(values)):
        return Clock(
            columns=(name,), unit=likely[0], reason="since 1970" if _is_epoch(values) else "by its steps"
        )
    said = (
        f"by its name in {written}, but its steps look like {_either(likely)}"
        if written
        else f"in {_either(likely)}"
    )
    question = f"time {short(name)}: {said}; say in the map which: [time] unit"
    return Clock(columns=(name,), unit=ASKED, reason="asked", question=question)


def _is_epoch(values: np.ndarray) -> bool:
    return bool(values[np.isfinite(values)][0] > min(times.EPOCHS))


def find_lines(table: Table, clock: Clock, rows: np.ndarray, time: np.ndarray) -> tuple[Line, ...]:
    """Return what every column of a log is, by names and values.

    Args:
        table: the log.
        clock: how its times are read.
        rows: those that are used, in the order of time.
        time: of these rows. [s]
    """
    named = {
        name: found
        for name, column in table.columns.items()
        if name not in clock.columns and column.form == NUMBER and (found := recognised(name, column.unit))
        and np.isfinite(column.values[rows]).any()
    }  # fmt: skip
    chosen = _chosen(named, {name: table.columns[name].values[rows] for name in named}, time)
    columns = {
        named[name].channel: Measured(
            channel=named[name].channel, values=table.columns[name].values[rows], unit=named[name].unit
        )
        for name, reason in chosen.items()
        if not reason.startswith("not used")
    }
    found = findings({**_positions(columns), **columns}, time)
    return tuple(
        Line(name=name, reason=_why_unused(table, clock, name, chosen))
        if name not in named or chosen[name].startswith("not used")
        else _line(name, named[name], found[named[name].channel], chosen[name])
        for name in table.columns
        if name not in clock.columns
    )


def _positions(columns: Mapping[str, Measured]) -> dict[str, Measured]:
    """Return north and east of latitude and longitude, if their unit is known by their size or by their names."""
    if not {LATITUDE, LONGITUDE} <= set(columns):
        return {}
    latitude, longitude = columns[LATITUDE], columns[LONGITUDE]
    likely = evidence.units_by_size(LATITUDE, latitude.values)
    units = [column.unit or (likely[0] if len(likely) == 1 else "") for column in (latitude, longitude)]
    if not all(units):
        return {}
    metres = north_and_east(latitude.values, longitude.values, *units)
    return {
        channel: Measured(channel=channel, values=values, unit="m", is_final=True)
        for channel, values in zip(("north", "east"), metres, strict=True)
    }


def north_and_east(
    latitude: np.ndarray, longitude: np.ndarray, latitude_unit: str, longitude_unit: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the way north and east of the first place (n,), on the tangent to the ellipsoid WGS 84 there. [m]"""
    phi, lam = _radians(latitude, latitude_unit), _radians(longitude, longitude_unit)
    first = np.flatnonzero(np.isfinite(phi) & np.isfinite(lam))[:1]
    phi0, lam0 = (float(phi[first[0]]), float(lam[first[0]])) if first.size else (0.0, 0.0)
    w = 1.0 - SQUARED_ECCENTRICITY * np.sin(phi0) ** 2
    meridian, normal = EQUATOR_M * (1.0 - SQUARED_ECCENTRICITY) / w**1.5, EQUATOR_M / np.sqrt(w)
    return meridian * (phi - phi0), normal * np.cos(phi0) * (lam - lam0)


def _radians(angle: np.ndarray, unit: str) -> np.ndarray:
    if unit == "ddmm.mmmm":
        whole = np.trunc(angle / 100.0)
        angle = whole + (angle - 100.0 * whole) / 60.0
    radians: np.ndarray = np.radians(angle * UNITS[LATITUDE][unit].factor)
    return radians


def _why_unused(table: Table, clock: Clock, name: str, chosen: Mapping[str, str]) -> str:
    column = table.columns[name]
    if name in chosen:
        return chosen[name]
    if not np.isfinite(column.values).any():
        return "not used: no numbers"
    return "not used: another time" if time_name(name) else "not used: no channel of this name"


def _line(name: str, named: Named, found: Finding, choice: str) -> Line:
    """Return the line of a column whose unit is stated, decided by values, or asked."""
    ties = f"; agrees with the {' and the '.join(found.agrees)}" if found.agrees else ""
    line = Line(name=name, channel=named.channel, reason=choice)
    if choice.startswith("asked"):
        return replace(
            line, unit=named.unit or ASKED, question=f"{short(name)}: {choice.removeprefix('asked: ')}"
        )
    prefix = f"{choice}; " if choice else ""
    if not named.unit:
        if len(found.units) == 1:
            return replace(line, unit=found.units[0], reason=f"{prefix}by its values{ties}", is_checked=True)
        words = f"{_either(found.units) or 'no unit fits'}; nothing in the log decides"
        question = f"{short(name)} ({named.channel}): {words}"
        return replace(line, unit=ASKED, reason="asked", question=question)
    if found.broken or named.unit not in found.units:
        contradiction = (
            f"contradicts the {' and the '.join(found.broken)}"
            if found.broken
            else "its values are too large or too small for that"
        )
        fitting = (
            f"{_either(found.units)} would fit"
            if found.units
            else "no single change of unit would repair that"
        )
        question = (
            f"{short(name)} ({named.channel}): by its name in {named.unit}, but {contradiction}; {fitting}"
        )
        return replace(line, unit=ASKED, reason="asked", question=question)
    is_checked = found.units == (named.unit,)
    return replace(line, unit=named.unit, reason=f"{prefix}{named.reason}{ties}", is_checked=is_checked)


def _either(units: Sequence[str]) -> str:
    return " or ".join([", ".join(units[:-1]), units[-1]] if len(units) > 1 else units)


def _chosen(named: Mapping[str, Named], values: Mapping[str, np.ndarray], time: np.ndarray) -> dict[str, str]:
    """Return for each column why it is chosen among those of its channel, "not used: …", or "asked: …"."""
    by_target: dict[str, list[str]] = {}
    for name, found in named.items():
        by_target.setdefault(TARGETS.get(found.channel, found.channel), []).append(name)
    reasons = {}
    for target, names in by_target.items():
        best = min((named[name].channel in TARGETS, named[name].rank) for name in names)
        rivals = [name for name in names if (named[name].channel in TARGETS, named[name].rank) == best]
        first, reason = _best_of(rivals, named, values, time)
        for name in names:
            reasons[name] = reason if name == first else f"not used: {short(first)} is the {target}"
    return reasons


def _best_of(
    rivals: Sequence[str], named: Mapping[str, Named], values: Mapping[str, np.ndarray], time: np.ndarray
) -> tuple[str, str]:
    """Return which of some columns with one name is measured where it counts, and why, or that it is asked."""
    if len(rivals) == 1:
        return rivals[0], ""
    channel = TARGETS.get(named[rivals[0]].channel, named[rivals[0]].channel)
    others = {
        found.channel: Measured(channel=found.channel, values=values[name]) for name, found in named.items()
    }
    agreeing = [
        name
        for name in rivals
        if evidence.tied(channel, {**others, channel: Measured(channel=channel, values=values[name])}, time)
    ]
    others_words = ", ".join(short(name) for name in rivals if name not in agreeing)
    if len(agreeing) == 1:
        return agreeing[
            0
        ], f"agrees with the change of {channel} that others measure, {others_words} does not"
    candidates = agreeing or list(rivals)
    if all(_are_alike(values[candidates[0]], values[name]) for name in candidates[1:]):
        return candidates[0], f"as good as {', '.join(map(short, candidates[1:]))}"
    question = f"one of {', '.join(map(short, rivals))} is the {channel}; they differ, and nothing in the log decides"
    return candidates[0], f"asked: {question}"


def _are_alike(first: np.ndarray, second: np.ndarray) -> bool:
    """Say whether two columns change alike, by as much."""
    known = np.isfinite(first) & np.isfinite(second)
    if known.sum() < 2:
        return False
    a, b = first[known] - first[known].mean(), second[known] - second[known].mean()
    size = float(a @ a + b @ b)
    return size == 0.0 or 2.0 * float(a @ b) >= ALIKE * size


# Written and read


def to_toml(mapping: Map, source: str) -> str:
    """Return a map as TOML, with every reason, ready to be edited."""
    clock = mapping.clock
    lines = [
        f"# How {source} is read: edit it, and give it again with subzero import ... --map.",
        "",
        "[time]",
    ]
    lines += [f"columns = {_text(list(clock.columns))}  # {clock.reason}"] if clock.columns else []
    entries = {
        "unit": clock.unit,
        "start": clock.start,
        "part": clock.part,
        "sort": clock.sort,
        "every_s": clock.every,
    }
    lines += [
        f"{key} = {_text(value)}"
        for key, value in entries.items()
        if value or (key == "start" and value == 0)
    ]
    lines += ["", "[columns]"]
    for line in mapping.lines:
        if line.channel:
            factor = f", factor = {line.factor:g}" if line.factor != 1.0 else ""
            entry = f"{{ channel = {_text(line.channel)}, unit = {_text(line.unit)}{factor} }}"
            lines.append(f"{_text(line.name)} = {entry}  # {printable(line.question or line.reason)}")
        else:
            lines.append(f"# {printable(_text(line.name))}  {printable(line.reason)}")
    return "\n".join(lines) + "\n"


def _text(value: object) -> str:
    """Return a value as TOML writes it, which for texts, numbers and lists of texts is as JSON does."""
    return json.dumps(
        value if isinstance(value, str | int | float | bool | list) else str(value), ensure_ascii=True
    )


def read_map(path: str | Path, table: Table) -> Map:
    """Read a map, and hold it against the log that it is for.

    Raises:
        UserError: it cannot be read, or does not suit; names every problem.
    """
    title = f"The map {printable(str(path))} cannot be used:"
    try:
        content = tomllib.loads(read_text(path, MOST_OF_A_TOML))
    except UnreadableFileError as error:
        raise UserError(listed(title, [f"{error.why}. {error.remedy}"])) from None
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise UserError(listed(title, [f"it is no TOML: {error}"])) from None
    problems: list[str] = [
        f"unknown table {short(key)}; allowed: time, columns"
        for key in content
        if key not in ("time", "columns")
    ]
    clock, columns = content.get("time", {}), content.get("columns", {})
    if not isinstance(clock, dict) or not isinstance(columns, dict):
        raise UserError(listed(title, ["time and columns are tables: [time], [columns]"]))
    found = _read_clock(clock, table, problems)
    lines = [line for name, entry in columns.items() if (line := _read_line(name, entry, table, problems))]
    if not columns:
        problems.append("it names no columns; write them below [columns]")
    targets = [TARGETS.get(line.channel, line.channel) for line in lines]
    problems += [
        f"more than one column is {target}; keep one"
        for target in sorted({t for t in targets if targets.count(t) > 1})
    ]
    if problems:
        raise UserError(listed(title, problems))
    unused = [
        Line(name=name, reason="not used: not in the map")
        for name in table.columns
        if name not in {*columns, *found.columns}
    ]
    return Map(clock=found, lines=(*lines, *unused))


def _read_clock(entry: Mapping[str, Any], table: Table, problems: list[str]) -> Clock:
    """Read how times are read; problems are added to a list."""
    problems += [
        f"[time] has no {short(key)}.{suggestion(key, TIME_KEYS)} Allowed: {', '.join(TIME_KEYS)}"
        for key in entry
        if key not in TIME_KEYS
    ]
    names, unit, every, part = (
        entry.get("columns", []),
        entry.get("unit", ""),
        entry.get("every_s", 0.0),
        entry.get("part", 0),
    )
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or len(names) > 2:
        problems.append("[time] columns must be a list of one name, or two")
        names = []
    problems += [_missing(name, table) for name in names if name not in table.columns]
    numbers = [name for name in names if name in table.columns and table.columns[name].form == NUMBER]
    if (unit or numbers) and unit not in times.CLOCK_UNITS:
        problems.append(f"[time] unit is {short(unit)}; it must be one of {', '.join(times.CLOCK_UNITS)}")
    if ("every_s" in entry) == bool(names) or (not names and not (real(every) or 0.0) > 0.0):
        problems.append("[time] needs columns, or every_s, a number of seconds above 0, not both")
    if (
        isinstance(part, bool)
        or not isinstance(part, int)
        or part < 0
        or not isinstance(entry.get("sort", False), bool)
    ):
        problems.append("[time] part must be a whole number from 1, and sort true or false")
    start = entry.get("start")
    if start is not None and times.start_of(start) is None:
        problems.append(f"[time] start is {short(start)}; it must be a time as the log writes it")
    return Clock(
        columns=tuple(names),
        unit=str(unit),
        start=start,
        part=part,
        sort=bool(entry.get("sort")),
        every=real(every) or 0.0,
    )


def _read_line(name: str, entry: object, table: Table, problems: list[str]) -> Line | None:
    """Read the line of one column; problems are added to a list."""
    if name not in table.columns:
        problems.append(_missing(name, table))
        return None
    if not isinstance(entry, dict) or not {"channel", "unit"} <= set(entry) <= {"channel", "unit", "factor"}:
        problems.append(f'{short(name)} must be {{ channel = "...", unit = "..." }}, and may have a factor')
        return None
    channel, factor = entry["channel"], real(entry.get("factor", 1.0))
    channel = BY_COLUMN[channel].name if channel in BY_COLUMN else channel
    allowed = [one for one in (*BY_NAME, *TARGETS) if one != TIME_CHANNEL.name]
    if channel not in allowed:
        problems.append(f"{short(name)}: there is no channel {short(channel)}.{suggestion(channel, allowed)}")
        return None
    unit = unit_of(kind_of(channel), str(entry["unit"]))
    if not unit:
        known = ", ".join(UNITS[kind_of(channel)])
        problems.append(
            f"{short(name)}: unit {short(entry['unit'])} of {channel} is not known; allowed: {known}"
        )
    if not factor:
        problems.append(
            f"{short(name)}: factor is {short(entry.get('factor'))}; it must be a number other than 0"
        )
    if table.columns[name].form != NUMBER or not np.isfinite(table.columns[name].values).any():
        problems.append(f"{short(name)} holds no numbers in this log; leave it out")
    return Line(name=name, channel=channel, unit=unit, factor=factor or 1.0, reason="map", is_checked=True)


def _missing(name: object, table: Table) -> str:
    return f"the log has no column {short(name)}.{suggestion(name, table.columns)} It has {', '.join(map(short, table.columns))}"
