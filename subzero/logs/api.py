"""From a log to a checked record: read, map, convert, report the steps.

No value is changed without a line about it: `Imported.table` has one for each column, and the notes of the record name
what was left out, shifted, or not decided by the values. `trial_of` writes a trial for a record.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import scenarios
from scenarios.heading import TURN
from subzero.arguments import checked_arguments
from subzero.channels import BY_NAME, HEADING, TIME
from subzero.errors import SHOWN_PROBLEMS, UserError, listed, printable, short
from subzero.logs import times
from subzero.logs.files import read_table
from subzero.logs.map_file import map_content, read_map
from subzero.logs.mapping import ASKED, Clock, Map, contradictions, find_clock, find_map, north_and_east
from subzero.logs.names import (
    CLOCK_UNITS,
    LATITUDE,
    LONGITUDE,
    PRESSURE,
    TARGETS,
    UNITS,
    kind_of,
    recognised,
)
from subzero.logs.table import NUMBER, Progress, Table, names_of, refusal
from subzero.records.record import LARGEST, Record, as_measured

AIR_M = 9.3, 10.9
"""The pressure of air at the surface, as a depth in sea water. [m]"""
ONLY_NAMES = "taken from names; the values of the log alone would allow others too."


@dataclass(frozen=True, kw_only=True)
class Imported:
    """A log as a record, and how it became one.

    Args:
        source: the log, as the user named it.
        mapping: which column is which channel.
        record: values as they are written, NaN in gaps; None if the map asks something.
    """

    source: str
    mapping: Map
    record: Record | None = None

    def table(self) -> list[tuple[str, str, str, str, str]]:
        """Return column, channel, unit, factor to the channel's unit, and reason, a row for each column of the log."""
        clock = self.mapping.clock
        rows = [(name, TIME.name, clock.unit or "-", "", clock.reason) for name in clock.columns]
        for line in self.mapping.lines:
            factor = ""
            if line.channel and line.unit != ASKED:
                unit = UNITS[kind_of(line.channel)][line.unit]
                factor = f"{line.factor * unit.factor:.5g}" + (f" {unit.offset:+.5g}" if unit.offset else "")
            rows.append((line.name, line.channel, line.unit, factor, line.reason))
        return rows


@checked_arguments
def read_log(path: str | Path, map: str | Path | None = None) -> Record:
    """Read a log as its logger wrote it, as a checked record.

    Units, names and times are found from the columns' names and values; ``record.notes`` says what was done. What they
    do not decide has to be said by a map (``subzero import LOG --map-out map.toml`` writes one to edit).

    Args:
        path: CSV of any delimiter and encoding, ``.mat``, netCDF ``.nc``, MOOS ``.alog``; with the extra ``logs``
            ArduPilot ``.bin`` and ``.tlog``, PX4 ``.ulg``, ``.mcap``, and ROS ``.bag`` and ``.db3``.
        map: TOML file that says which column is which channel, in which unit; found if None.

    Raises:
        UserError: it cannot be read, or something has to be decided first; says what to do.
    """
    found = import_log(path, map)
    if found.record is None:
        raise undecided(found)
    return as_measured(found.record)


def undecided(found: Imported) -> UserError:
    """Return the error that asks for the decisions which names and values of a log leave open."""
    questions = found.mapping.questions
    remedy = f"write the map with subzero import {found.source} --map-out map.toml, edit it, and give it with --map"
    title = f"The log {found.source} cannot be imported before this is decided:"
    return UserError(listed(title, [*questions[: SHOWN_PROBLEMS - 1], remedy]))


def import_log(
    path: str | Path, map_path: str | Path | None = None, progress: Progress = lambda _: None
) -> Imported:
    """Read a log with the map that is given or found.

    Args:
        path: the log.
        map_path: the map.
        progress: called with the share of the file that is read.

    Raises:
        UserError: it cannot be read, or the map does not suit.
    """
    if map_path is None:
        table = read_table(path, lambda name, unit: recognised(name, unit) is not None, progress)
        clock, questions = find_clock(table)
        rows, time, notes = _rows(path, table, clock)
        mapping = find_map(table, clock, rows, time)
        mapping = replace(mapping, questions=(*questions, *mapping.questions))
    else:
        content, names = map_content(map_path)
        table = read_table(path, lambda name, unit: name in names, progress)
        mapping = read_map(map_path, content, table)
        rows, time, notes = _rows(path, table, mapping.clock)
        mapping = replace(mapping, notes=contradictions(mapping, table, rows, time))
    if not any(line.channel for line in mapping.lines) and not mapping.questions:
        why = f"none of its columns is a channel: {names_of(table.columns)}"
        raise refusal(path, why, "Name them in a map, see docs/logs.md.")
    if mapping.questions:
        return Imported(source=table.source, mapping=mapping)
    values, more = _values(table, mapping, rows)
    if not values:
        raise refusal(path, "no channel has a number in the rows that are used", "Look at its times.")
    notes = [*table.notes, *notes, *more, *mapping.notes, *_open_units(mapping)]
    is_used = np.any([np.isfinite(column) for column in values.values()], axis=0)  # most messages are others
    values = {name: column[is_used] for name, column in values.items()}
    record = Record(source=table.source, time=time[is_used], values=values, notes=tuple(notes))
    return Imported(source=table.source, mapping=mapping, record=record)


def _rows(path: str | Path, table: Table, clock: Clock) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return the rows that are used, in the order of time, their times from t = 0 on [s], and notes on both."""
    size = next(iter(table.columns.values())).values.size
    if not clock.columns:
        notes = [f"Times: a row every {clock.every_s:g} s, by the map."]
        return np.arange(size), clock.every_s * table.stride * np.arange(size), notes
    seconds = _seconds(path, table, clock)
    rows = np.flatnonzero(np.isfinite(seconds))
    notes = [f"{size - rows.size} rows have no time and are left out."] if rows.size < size else []
    if unset := times.first_after_setting(seconds[rows]):
        rows = rows[unset:]
        notes.append(f"{unset} rows before the clock was set are left out.")
    rows = rows[np.argsort(seconds[rows], kind="stable")] if clock.sort else rows
    begins = times.parts_of(seconds[rows])
    if clock.part:
        if not 0 < clock.part <= len(begins):
            why = f"the map asks for part {clock.part}, and its clock has {len(begins)}"
            raise refusal(path, why, "Correct it.")
        rows = rows[begins[clock.part - 1] : [*begins, rows.size][clock.part]]
        notes.append(f"Part {clock.part} of {len(begins)} is used: {rows.size} of {size} rows.")
        begins = [0]
    if problem := times.problem_of(seconds[rows], begins, table.stride):
        raise refusal(path, *problem)
    return _from_start(path, clock, rows, seconds[rows], notes)


def _seconds(path: str | Path, table: Table, clock: Clock) -> np.ndarray:
    """Return the clock of all rows in seconds, NaN where there is none."""
    columns = [table.columns[name] for name in clock.columns]
    if any(column.form == times.MIXED for column in columns):
        raise refusal(path, "some of its times have a zone and some have none", "Write all of them with one.")
    if len(columns) == 2 and columns[1].form == NUMBER:
        return columns[0].values + columns[1].values * CLOCK_UNITS[times.fraction_unit(columns[1].values)]
    total: np.ndarray = np.sum([column.values for column in columns], axis=0)
    if clock.unit == "hhmmss":
        return times.over_midnight(times.seconds_of_digits(total))
    if [column.form for column in columns] == [times.TIME_OF_DAY]:
        return times.over_midnight(total)
    likely = [*times.unit_by_values(total), "s"][0] if clock.unit == ASKED else clock.unit or "s"
    return total * CLOCK_UNITS[likely]


def _from_start(
    path: str | Path, clock: Clock, rows: np.ndarray, seconds: np.ndarray, notes: list[str]
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Shift times so that they count from the start of the trial, and leave out what was before."""
    start = float(seconds[0])
    if clock.start is not None:
        given = times.start_of(clock.start) or 0.0
        start = given if isinstance(clock.start, str) else given * CLOCK_UNITS[clock.unit or "s"]
    kept = seconds >= start
    if kept.sum() < 2:
        why = f"the start in the map, {short(clock.start)}, leaves fewer than two rows"
        raise refusal(path, why, "Correct it.")
    notes += [] if kept.all() else [f"{(~kept).sum()} rows before the start are left out."]
    if start != 0.0:
        whose = "the first time of the log" if clock.start is None else "the start in the map"
        notes.append(f"Times: {start:.12g} s, {whose}, is taken from all of them.")
    digits = 9 if abs(start) < 1e6 else 6  # a float of seconds since 1970 has no more
    return rows[kept], np.round(seconds[kept] - start, digits), notes


def _values(table: Table, mapping: Map, rows: np.ndarray) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return channel → values in its unit, and notes on positions and pressures."""
    lines = {line.channel: line for line in mapping.lines if line.channel}
    values, notes = dict[str, np.ndarray](), list[str]()
    for channel, line in lines.items():
        if channel not in (LATITUDE, LONGITUDE):
            unit, written = UNITS[kind_of(channel)][line.unit], table.columns[line.name].values[rows]
            values[TARGETS.get(channel, channel)] = line.factor * (written * unit.factor + unit.offset)
    if LATITUDE in lines and LONGITUDE in lines:
        places = [lines[name] for name in (LATITUDE, LONGITUDE)]
        written = [table.columns[place.name].values[rows] for place in places]
        values["north"], values["east"] = north_and_east(written, [place.unit for place in places])
        notes.append("North and east are metres from the first place, on the ellipsoid WGS 84.")
    if PRESSURE in lines:
        notes.append("Depth is by pressure, in sea water of 1025 kg/m³; an absolute one less 1013.25 hPa.")
        absolute = f"{lines[PRESSURE].unit} absolute"
        least = np.nanmin(values[TARGETS[PRESSURE]], initial=AIR_M[1])
        if absolute in UNITS[PRESSURE] and AIR_M[0] < least < AIR_M[1]:
            notes.append(
                f"The least pressure is that of air: if it is absolute, say so in a map: unit = {absolute!r}."
            )
    values = {name: np.where(np.abs(column) <= LARGEST, column, np.nan) for name, column in values.items()}
    return {name: column for name, column in values.items() if np.isfinite(column).any()}, notes


def _open_units(mapping: Map) -> list[str]:
    """Return a sentence about units that only a name vouches for."""
    names = names_of(line.name for line in mapping.lines if line.is_open)
    return [f"Units of {names}: {ONLY_NAMES}"] if names else []


def to_csv(record: Record) -> str:
    """Return a record in the form that `subzero.read_record` takes, with ten digits."""
    names = [name for name in BY_NAME if name in record.values]
    remarks = ["# " + printable(line).replace('"', "'") for line in (f"from {record.source}", *record.notes)]
    header = ",".join([TIME.column, *(BY_NAME[name].column for name in names)])
    table = np.column_stack([record.time, *(record.values[name] for name in names)])
    rows = (",".join("" if value != value else f"{value:.10g}" for value in row) for row in table.tolist())
    return "\n".join([*remarks, header, *rows]) + "\n"


COPIED = "fig6"
"""The trial that is copied for a record."""
START = {
    "heading_deg": "heading",
    "pitch_deg": "pitch",
    "roll_deg": "roll_angle",
    "depth_m": "depth",
    "surge_speed_m_s": "surge_speed",
    "sway_speed_m_s": "sway_speed",
    "heave_speed_m_s": "heave_speed",
    "roll_rate_deg_s": "roll_rate",
    "pitch_rate_deg_s": "pitch_rate",
    "yaw_rate_deg_s": "yaw_rate",
    "propeller_speed_rps": "propeller_speed",
    "rudder_angle_deg": "rudder_angle",
}
"""Key of ``[start]`` → channel whose first value it takes."""
COMMANDS = (
    "propeller_command",
    "rudder_command",
    "stern_plane_port_command",
    "stern_plane_starboard_command",
)
DIGITS = 6


def trial_of(record: Record, file: str) -> str:
    """Return the text of a trial that begins where a record begins, and lasts as long.

    It is a copy of a shipped trial, every key explained, with the duration, the start and the commands of the record.
    What the record does not say keeps the value of a vehicle at rest; a record without commands gives commands of zero.

    Args:
        record: with times from 0 on.
        file: of the record, from the folder of the trial; it is the file of the commands if it has them.
    """
    text = Path(scenarios.path(COPIED)).read_text(encoding="utf-8")
    text = text[text.index("description = ") :]
    step = scenarios.load(COPIED).cable_step
    duration = step * np.floor(float(record.time[-1]) / step + 1e-6)
    text = _with_value(text, "description", f'"As {file} begins: the start and the commands of a record"')
    text = _with_value(text, "duration_s", repr(round(float(duration), DIGITS)))
    for key, channel in START.items():
        measured = record.values.get(channel, np.zeros(0))
        first = measured[np.isfinite(measured)][:1]
        value = float(first[0]) if first.size else 0.0
        value = math.fmod(value, TURN) if channel == HEADING else value  # a compass may count its turns
        text = _with_value(text, key, repr(round(value, DIGITS)))
    if all(name in record.values for name in COMMANDS):
        commands = f'[commands]\nfile = "{file}"\n'
    else:
        keys = [BY_NAME[name].column.replace("_command", "") for name in COMMANDS]
        commands = "[commands]                      # the record has none\ntime_s = [0.0]\n"
        commands += "".join(f"{key} = [0.0]\n" for key in keys)
    return re.sub(r"\[commands\].*?(?=\n\[changes\])", lambda _: commands, text, count=1, flags=re.DOTALL)


def _with_value(text: str, key: str, value: str) -> str:
    """Return the text of a trial with another value of a key; the comment behind it remains."""
    return re.sub(rf"(?m)^({key} = )(?:\"[^\"]*\"|\S+)", lambda found: found[1] + value, text, count=1)
