"""The map of a log as a file: written with every reason and question, edited, and read again.

    [time]
    columns = ["TimeUS"]
    unit = "us"

    [columns]
    "NAV_SPEED" = { channel = "surge_speed", unit = "kn" }

A map that is given is the whole map, and its word holds.
"""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from subzero.channels import BY_COLUMN, BY_NAME, TIME
from subzero.errors import UserError, listed, printable, real, short, suggestion
from subzero.files.read_file import MOST_OF_A_TOML, UnreadableFileError, read_text
from subzero.logs import times
from subzero.logs.mapping import Clock, Line, Map
from subzero.logs.names import CLOCK_UNITS, TARGETS, UNITS, kind_of, unit_of
from subzero.logs.table import NUMBER, Table, names_of

NUMBERS = int, float
TIME_KEYS = {
    "columns": list,
    "unit": str,
    "start": (*NUMBERS, str),
    "part": int,
    "sort": bool,
    "every_s": NUMBERS,
}
COLUMN_KEYS = {"channel": str, "unit": str, "factor": NUMBERS}


def to_toml(mapping: Map, source: str) -> str:
    """Return a map as TOML, with every reason and question, ready to be edited."""
    clock = mapping.clock
    asked = [f"# To decide: {printable(question)}" for question in mapping.questions]
    entries = {key: getattr(clock, key) for key in TIME_KEYS}
    said = [
        f"{key} = {_text(value)}"
        for key, value in entries.items()
        if value or (key == "start" and value == 0)
    ]
    lines = [_entry(line) for line in mapping.lines]
    head = f"# How {source} is read: edit it, and give it again with subzero import ... --map."
    return "\n".join([head, *asked, "", f"[time]  # {clock.reason}", *said, "", "[columns]", *lines]) + "\n"


def _entry(line: Line) -> str:
    name, reason = _text(line.name), printable(line.reason)
    if not line.channel:
        return f"# {name}  {reason}"
    factor = f", factor = {line.factor:g}" if line.factor != 1.0 else ""
    return f"{name} = {{ channel = {_text(line.channel)}, unit = {_text(line.unit)}{factor} }}  # {reason}"


def _text(value: object) -> str:
    """Return a value as TOML writes it, which for texts, numbers and lists of texts is as JSON does."""
    return json.dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=True)


def map_content(path: str | Path) -> tuple[dict[str, Any], frozenset[str]]:
    """Return the contents of a map, and the columns of the log that it names.

    Raises:
        UserError: it cannot be read, or is no map.
    """
    try:
        content = tomllib.loads(read_text(path, MOST_OF_A_TOML))
        problems = _keys("the map", content, {"time": dict, "columns": dict})
    except (UnreadableFileError, ValueError, RecursionError) as error:
        problems = [str(error)]
    _refuse(path, problems)
    clock = content.get("time", {}).get("columns", [])
    return content, frozenset(
        [*content.get("columns", {}), *map(str, clock if isinstance(clock, list) else [])]
    )


def read_map(path: str | Path, content: dict[str, Any], table: Table) -> Map:
    """Return a map of its content, held against the log that it is for.

    Raises:
        UserError: it does not suit; names every problem.
    """
    columns, problems = content.get("columns", {}), list[str]()
    clock = _read_clock(content.get("time", {}), table, problems)
    found = [(name, entry, _problems_of_line(name, entry, table)) for name, entry in columns.items()]
    problems += [problem for *_, wrong in found for problem in wrong]
    lines = [_read_line(name, entry) for name, entry, wrong in found if not wrong]
    targets = Counter(TARGETS.get(line.channel, line.channel) for line in lines)
    problems += [
        f"{target} is more than one column; keep one" for target, count in targets.items() if count > 1
    ]
    problems += [] if columns else ["it names no columns; write them below [columns]"]
    _refuse(path, problems)
    rest = [name for name in table.columns if name not in {*columns, *clock.columns}]
    lines += [Line(name=name, reason="not used: not in the map") for name in rest]
    return Map(clock=clock, lines=tuple(lines))


def _refuse(path: str | Path, problems: list[str]) -> None:
    if problems:
        raise UserError(listed(f"The map {printable(str(path))} cannot be used:", problems))


def _keys(where: str, entry: object, allowed: Mapping[str, Any]) -> list[str]:
    """Return the keys of a table that are not allowed, or hold a value of another kind."""
    if not isinstance(entry, dict):
        return [f"{where} must be a table with {', '.join(allowed)}"]
    return [
        f"{where}: {key} is {short(value)}, which is no value for it"
        if key in allowed
        else f"{where} has no {short(key)}.{suggestion(key, allowed)} Allowed: {', '.join(allowed)}"
        for key, value in entry.items()
        if key not in allowed or not _is(value, allowed[key])
    ]


def _is(value: object, kinds: Any) -> bool:
    """Return whether a value is of some kinds: a finite number, a truth value only where that is asked for."""
    if isinstance(value, bool) or kinds is bool:
        return isinstance(value, bool) and kinds is bool
    return isinstance(value, kinds) and (isinstance(value, str | list | dict) or real(value) is not None)


def _read_clock(entry: dict[str, Any], table: Table, problems: list[str]) -> Clock:
    """Read how times are read; problems are added to a list."""
    names, start = entry.get("columns", []), entry.get("start")
    entry = entry | (
        {"start": str(start)} if isinstance(start, datetime) else {}
    )  # TOML has dates of its own
    wrong = _keys("[time]", entry, TIME_KEYS)
    if not wrong and not all(isinstance(name, str) for name in names):
        wrong = [f"[time]: columns is {short(names)}, which is no value for it"]
    if wrong:
        problems += wrong
        return Clock()
    clock = Clock(**{**entry, "columns": tuple(names)})
    problems += [_missing(name, table) for name in clock.columns if name not in table.columns]
    is_number = [table.columns[name].form == NUMBER for name in clock.columns if name in table.columns]
    if (clock.unit or any(is_number)) and clock.unit not in CLOCK_UNITS:
        problems.append(f"[time]: unit is {short(clock.unit)}; it must be one of {', '.join(CLOCK_UNITS)}")
    if bool(clock.columns) == bool(clock.every_s) or clock.every_s < 0.0 or len(clock.columns) > 2:
        problems.append("[time] needs columns, one or two, or else every_s, a number of seconds above 0")
    if clock.start is not None and times.start_of(clock.start) is None:
        problems.append(f"[time]: start is {short(clock.start)}; it must be a time as the log writes it")
    return clock


def _problems_of_line(name: str, entry: Any, table: Table) -> list[str]:
    """Return the problems of the line of one column."""
    wrong, column = _keys(short(name), entry, COLUMN_KEYS), table.columns.get(name)
    if not wrong and not {"channel", "unit"} <= set(entry):
        wrong = [f"{short(name)} needs channel and unit"]
    if column is None:
        wrong.append(_missing(name, table))
    elif column.is_empty or column.form != NUMBER:
        wrong.append(f"{short(name)} holds no numbers in this log; leave it out")
    if wrong:
        return wrong
    channel, allowed = _channel(entry), [name for name in (*BY_NAME, *TARGETS) if name != TIME.name]
    if channel not in allowed:
        return [f"{short(name)}: there is no channel {short(channel)}.{suggestion(channel, allowed)}"]
    if unit_of(kind_of(channel), entry["unit"]) and entry.get("factor") != 0:
        return []
    units, unit = ", ".join(UNITS[kind_of(channel)]), short(entry["unit"])
    return [f"{short(name)}: {channel} is in one of {units}, not in {unit}, times a factor other than 0"]


def _channel(entry: dict[str, Any]) -> str:
    """Return the channel of a line, which may be given as the column of a record."""
    name = str(entry["channel"])
    return BY_COLUMN[name].name if name in BY_COLUMN else name


def _read_line(name: str, entry: dict[str, Any]) -> Line:
    """Read a line that is right."""
    unit = unit_of(kind_of(_channel(entry)), entry["unit"])
    return Line(name=name, channel=_channel(entry), unit=unit, factor=entry.get("factor", 1.0), reason="map")


def _missing(name: object, table: Table) -> str:
    return f"the log has no column {short(name)}.{suggestion(name, table.columns)} It has {names_of(table.columns)}"
