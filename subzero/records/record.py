"""Measured records: a CSV file with a time column and any of the channels.

A record has the column ``time_s`` and any columns of `subzero.channels`, such as ``surge_speed_m_s`` or
``heading_deg``. An empty cell or ``nan`` is a gap. Lines that start with ``#`` are remarks. A file that
cannot be used is refused with all its problems at once. A heading that jumps from 360 to 0 degrees is made
continuous (`scenarios.heading`).

A log that is faster than a sensor fills in what lies between. The sampling model of a channel, decided from its values
alone, is one of

    fresh          every value is a measurement
    held           y_k = y_(k−1), but for every m-th row
    interpolated   y_k = ½ (y_(k−1) + y_(k+1)), but for every m-th row, to the digits that are written

with one m for the whole channel, at least half of whose m-th rows are new. Means over the same rows look like the one
or the other; a diagnosis leaves open when in its interval a value was measured. Running means, and sensors whose rows
are not evenly spread, are taken for fresh. So is a rounded sensor that stands still, whose values change at any row.

A heading is known but for whole turns: one compass begins at 359 degrees where another, or a run, begins at −1. So a
run's heading is counted from its trial's start, without a jump wherever that lies, and a record's from the run's, with
the turns of its yaw rate, or else of the run.

The files that a run writes are themselves records, so one run can be compared with another.

`fit` says how well a run explains a record: the error of a model, channel by channel.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenarios.heading import TURN, continuous, contradicted, expected, turned
from subzero.arguments import checked_arguments
from subzero.channels import BY_COLUMN, BY_NAME, HEADING, TIME
from subzero.errors import UserError, listed, nearest, printable
from subzero.errors import short as shown
from subzero.files.read_file import MOST_COLUMNS, MOST_OF_A_CSV, UnreadableFileError, read_text

if TYPE_CHECKING:
    import xarray as xr


YAW_RATE = "yaw_rate"
"""The channel that shows how often a heading has turned."""

SAME = 2e-5
"""Numbers that differ by less than this share are the same: a log has five digits or more. [-]"""
FEWEST_MEASURED = 6
"""Fewer measurements do not show how they were sampled. [-]"""
NEW_SHARE = 0.5
"""At least this share of the m-th rows has to be new: commands that step now and then are not held measurements. [-]"""
GAPS = ("", "nan", "+nan", "-nan")
"""Cells that hold no measurement; numerical libraries write a NaN with either sign."""

LARGEST = 1e9
"""No channel measures more than this, in whatever unit; squares of it are still far from an overflow."""

EPOCHS = {
    1e17: ("nanoseconds", 1e9),
    1e14: ("microseconds", 1e6),
    1e11: ("milliseconds", 1e3),
    LARGEST: ("seconds", 1.0),
}
"""A first time beyond this counts from 1970 in that unit, of which so many make a second."""

IMPORTED = "`subzero import` reads it"
"""Ends the refusal of a form that a logger writes."""

TIMES_OF_DAY = {
    r"\d{4}-\d\d-\d\d[T ]": "dates and times",
    r"(\d+ days? )?\d+:\d\d(:\d\d)?([.,]\d+)?$": "hours, minutes and seconds",
}
"""Forms of a time that is no number, and their names."""

Row = tuple[int, list[str]]
"""Line number in the file (from 1), and its cells."""


@dataclass(frozen=True, kw_only=True)
class Record:
    """A measured record: samples of some channels, with gaps.

    Args:
        source: the file, as the user named it.
        time: time of each sample, increasing. Shape (samples,). [s]
        values: channel name → measured values in the channel's display unit, NaN where there is a gap.
        notes: data that were set aside, and why, in sentences.
        intervals: channel → time between two measurements, where a logger filled in what lies between. [s]
        listed: listed actuator → its command as recorded, 1, rad, m or m3.
    """

    source: str
    time: np.ndarray
    values: Mapping[str, np.ndarray]
    notes: tuple[str, ...] = ()
    intervals: Mapping[str, float] = field(default_factory=dict)
    listed: Mapping[str, np.ndarray] = field(default_factory=dict)


LISTED_COLUMN = re.compile(r"(?P<name>\w+?)_(?P<kind>command|state)(?P<unit>|_deg|_m|_m3)")
"""Column of a listed actuator, as a run writes it: ``front_port_command``, ``upper_port_command_deg``."""
IN_EVERY_VEHICLE = ("propeller", "rudder", "stern_plane", "stern_plane_port", "stern_plane_starboard")


def listed_column(name: str) -> re.Match[str] | None:
    """Return the parts of a column of a listed actuator; None of any other."""
    found = LISTED_COLUMN.fullmatch(name)
    return found if found and name not in BY_COLUMN and found["name"] not in IN_EVERY_VEHICLE else None


@checked_arguments
def read_record(path: str | Path) -> Record:
    """Read a measured record from a CSV file, and check all of it.

    Args:
        path: the file; its columns are ``time_s`` and any channels of `subzero.channels`, each with its unit.

    Raises:
        UserError: if it cannot be read or used; names every problem with its line.
    """
    header, rows = _table(path)
    problems = _header_problems(header)
    if not problems:
        problems = [
            f"line {line}: {len(row)} cells, but the header has {len(header)} columns"
            for line, row in rows
            if len(row) != len(header)
        ]
    _refuse(path, problems)
    _refuse(path, _format_of_time([row[header.index(TIME.column)] for _, row in rows]))
    columns = {name: _numbers(name, at, rows, problems) for at, name in enumerate(header)}
    problems += _time_problems(columns[TIME.column], rows, header.index(TIME.column))
    problems += _empty_problems(columns)
    problems += _heading_problems(columns.get(BY_NAME[HEADING].column, np.empty(0)))
    _refuse(path, problems)
    values = {
        BY_COLUMN[name].name: column
        for name, column in columns.items()
        if name != TIME.column and name in BY_COLUMN
    }
    listed = {
        found["name"]: np.radians(column) if found["unit"] == "_deg" else column
        for name, column in columns.items()
        if (found := listed_column(name)) and found["kind"] == "command"
    }
    return as_measured(Record(source=_name(path), time=columns[TIME.column], values=values, listed=listed))


def as_measured(record: Record) -> Record:
    """Return a record for use: without the values that a logger filled in, its heading without jumps."""
    record = measured_alone(record)
    if HEADING not in record.values:
        return record
    like = expected(record.time, record.values.get(YAW_RATE))
    return replace(record, values={**record.values, HEADING: continuous(record.values[HEADING], like)})


def measured_alone(record: Record) -> Record:
    """Return a record without the values that a logger filled in between measurements: gaps in their place."""
    values, intervals = dict(record.values), dict[str, float]()
    for name, column in record.values.items():
        known = np.flatnonzero(np.isfinite(column))
        sampling = _sampling_of(column[known])
        if sampling is not None:
            kept = known[sampling]
            values[name] = np.full(column.size, np.nan)
            values[name][kept] = column[kept]
            intervals[name] = float(np.median(np.diff(record.time[kept])))
    if not intervals:
        return record
    words = ", ".join(f"{BY_NAME[name].column} (every {every:.3g} s)" for name, every in intervals.items())
    note = f"Only measurements are used, not what a logger filled in between them: {words}."
    return replace(record, values=values, notes=(*record.notes, note), intervals=intervals)


def _sampling_of(values: np.ndarray) -> slice | None:
    """Return which of the known values of a channel (m,) are measurements; None if all are."""
    steps = np.abs(np.diff(values))
    size = np.abs(values)
    is_new = steps > SAME * np.maximum(size[1:], size[:-1])
    off_line = np.abs(np.diff(values, 2)) > 2.0 * SAME * np.maximum(size[2:], size[:-2])
    for new in (is_new, off_line):  # held, interpolated
        rows = np.flatnonzero(new) + 1
        every = int(np.gcd.reduce(np.diff(rows))) if rows.size > 1 else 1
        if every > 1 and rows.size >= max(FEWEST_MEASURED, NEW_SHARE * values.size / every):
            return slice(rows[0] % every, None, every)
    return None


def _name(path: str | Path) -> str:
    """Return a file's name as it can be shown and written."""
    return printable(str(path))


def _refuse(path: str | Path, problems: list[str]) -> None:
    if problems:
        raise UserError(listed(f"The measured record {_name(path)} cannot be used:", problems))


def _table(path: str | Path) -> tuple[list[str], list[Row]]:
    """Return the header and the rows of a CSV file, without empty lines and remarks."""
    try:
        text = read_text(path, MOST_OF_A_CSV)
    except UnreadableFileError as error:
        if error.is_missing:
            raise UserError(
                f"There is no measured record {_name(path)}. Give the path of a CSV file."
            ) from None
        raise UserError(
            f"The measured record {_name(path)} cannot be read: {error.why}. {error.remedy}"
        ) from None
    try:
        reader = csv.reader(io.StringIO(text, newline=""))
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        raise UserError(
            f"The measured record {_name(path)} is not a CSV file: {error}. Save it as plain CSV."
        ) from None
    rows = [(line, row) for line, row in rows if any(row) and not row[0].startswith("#")]
    if len(rows) < 2:
        raise UserError(
            f"The measured record {_name(path)} holds no samples: it needs a header and at least one row."
        )
    if len(rows[0][1]) > MOST_COLUMNS:
        raise UserError(
            f"The measured record {_name(path)} has {len(rows[0][1])} columns; at most {MOST_COLUMNS} are read. "
            "Leave out those that are no channels."
        )
    return rows[0][1], rows[1:]


OTHER_WORDS = {
    TIME.column: ("time", "t", "timestamp", "seconds", "elapsed"),
    "surge_speed_m_s": ("speed", "velocity", "stw", "log", "u"),
    "speed_over_ground_m_s": ("sog",),
    "heading_deg": ("heading", "hdg", "compass", "yaw", "psi", "course", "cog"),
    "pitch_deg": ("pitch", "theta"),
    "roll_deg": ("roll", "heel", "phi"),
    "depth_m": ("depth", "z"),
    "propeller_speed_rps": ("rpm", "rps", "propeller", "thruster", "shaft"),
    "rudder_angle_deg": ("rudder",),
    "cable_tension_N": ("tension", "load", "pull"),
    "cable_length_m": ("cable", "tether"),
    "battery_voltage_V": ("battery", "voltage", "volt"),
    "north_m": ("north", "northing"),
    "east_m": ("east", "easting"),
}
"""A column → its names in other loggers."""

USUAL = "surge_speed_m_s, heading_deg, yaw_rate_deg_s, pitch_deg, roll_deg, depth_m, cable_tension_N"
"""Columns that many records have."""

PLACE_ON_EARTH = r"(.*[^a-z])?(lat|latitude|lon|lng|long|longitude)([^a-z].*)?$"
"""Names of columns of latitude and longitude, in small letters."""

SLIP_LIKENESS = 0.75
"""A name that is so much like a column is that column with a slip of the pen."""

SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars"}
"""Separators between the cells of a file that is no CSV."""


def _header_problems(header: list[str]) -> list[str]:
    between = next(
        (words for mark, words in SEPARATORS.items() if len(header) == 1 and mark in header[0]), ""
    )
    if between:
        return [
            f"its columns are separated by {between}; separate them by commas, and write numbers with a point; "
            f"{IMPORTED}"
        ]
    places = [name for name in header if re.match(PLACE_ON_EARTH, name.lower())]
    if places:
        return [
            f"columns {', '.join(map(shown, places))} are latitude and longitude; replace them by north_m and east_m "
            "from the start: 111 320 m a degree, east times the cosine of the latitude (integers are 1e-7 degrees); "
            f"{IMPORTED}"
        ]
    problems = [_unknown(name) for name in header if name not in BY_COLUMN and not listed_column(name)]
    if problems:
        problems.append(
            f"rename such a column, in the unit of its new name, or leave it out. Columns are {TIME.column}, "
            f"{USUAL}, and more in docs/diagnosis.md; {IMPORTED}"
        )
    twice = sorted({name for name in header if header.count(name) > 1})
    problems += [f"column {shown(name)} occurs twice; keep one" for name in twice]
    if TIME.column not in header:
        problems.append(
            f"column '{TIME.column}' is missing; it is needed, in seconds since the first command"
        )
    if not problems and len(header) == 1:
        problems.append("there is no column beside the time; add a channel, such as 'surge_speed_m_s'")
    return problems


def _unknown(name: str) -> str:
    """Say that a column is not known, and which might be meant: often a channel without its unit."""
    meant = BY_NAME[name].column if name in BY_NAME else _meant(name)
    guess = f" Did you mean '{meant}'?" if meant else ""
    return f"unknown column {shown(name)}.{guess}"


def _meant(name: str) -> str:
    """Return the column that is probably meant: that of the channel it begins with, one written nearly so, else what
    other loggers call so; or nothing.
    """
    words = re.findall(r"[a-z]+", re.sub(r"[\[(].*", "", name.lower()))  # without a unit in brackets
    started = max((each for each in BY_NAME if name.lower().startswith(f"{each}_")), key=len, default="")
    if started and ("rate" in words) == ("rate" in started):
        return BY_NAME[started].column
    others = [column for word in words for column, names in OTHER_WORDS.items() if word in names]
    likely = [*nearest(name, BY_COLUMN, likeness=SLIP_LIKENESS), *(others if "rate" not in words else ())]
    return next(iter([*likely, *nearest(name, BY_COLUMN)]), "")


def _numbers(name: str, at: int, rows: list[Row], problems: list[str]) -> np.ndarray:
    """Return one column as numbers; entries that are not numbers become problems."""
    column = np.full(len(rows), np.nan)
    for index, (line, row) in enumerate(rows):
        cell = row[at]
        if cell.lower() in GAPS:
            continue
        try:
            value = float(cell)
        except ValueError:
            problems.append(f"line {line}, column '{name}': {shown(cell)} is not a number; leave a gap empty")
            continue
        if abs(value) <= LARGEST:
            column[index] = value
        else:
            why = f"outside ±{LARGEST:g}" if np.isfinite(value) else "not finite"
            problems.append(f"line {line}, column '{name}': {shown(cell)} is {why}; leave a gap empty")
    return column


def _format_of_time(cells: list[str]) -> list[str]:
    """Return in one line what times are written as that are no seconds from a start; nothing of those that are."""
    first = next((cell for cell in cells if cell.lower() not in GAPS), "")
    remedy = "subtract the first one, and write seconds since the first command"
    for pattern, words in TIMES_OF_DAY.items():
        if re.match(pattern, first):
            zones = {zone.group() for cell in cells if (zone := re.search(r"(Z|[+-]\d\d:?\d\d)$", cell[10:]))}
            utc = f"convert all to UTC ({len(zones)} time zones occur), " if len(zones) > 1 else ""
            return [f"'{TIME.column}' holds {words}, such as {shown(first)}: {utc}{remedy}; {IMPORTED}"]
    try:
        number = float(first)
    except ValueError:
        return []
    for least, (unit, count) in EPOCHS.items():
        if least < number < np.inf:
            divide = f"divide by {count:g}, " if count > 1.0 else ""
            return [
                f"the first time is {shown(first)}, {unit} since 1970, a time of day: {divide}{remedy}; {IMPORTED}"
            ]
    return []


def _time_problems(time: np.ndarray, rows: list[Row], at: int) -> list[str]:
    """Time has no gaps and increases; what breaks in all rows alike is said once."""
    lines = [line for line, _ in rows]
    gaps = [line for line, row in rows if row[at].lower() in GAPS]
    problems = [f"line {line}: the time is missing; every sample needs one" for line in gaps]
    same, back = np.flatnonzero(np.diff(time) == 0.0) + 1, np.flatnonzero(np.diff(time) < 0.0) + 1
    if same.size > 1:
        problems.append(
            f"{same.size} rows have the time of the row before, from line {lines[same[0]]} on: fractions of a second "
            "are lost; write times with them, and nanoseconds with their leading zeros"
        )
        same = same[:0]
    if 0 < 2 * back.size < time.size and np.all(time[back] <= time[:2].max()):
        parts = f"line{'s' * (back.size > 1)} {', '.join(str(lines[k]) for k in back[:3])}"
        problems.append(
            f"the time begins anew at {parts}: the logger was restarted; make a record of each part, and leave out "
            f"those without the first command; {IMPORTED}"
        )
        back = back[:0]
    return problems + [
        f"line {lines[k]}: the time {time[k]:g} s does not come after {time[k - 1]:g} s; time must increase"
        for k in sorted([*same, *back])
    ]


def _heading_problems(heading: np.ndarray) -> list[str]:
    """A heading begins within two turns, else it is in a hundredth of a degree."""
    first = heading[np.isfinite(heading)][:1]
    if not first.size or abs(first[0]) <= 2.0 * TURN:
        return []
    return [
        f"'heading_deg' begins at {first[0]:g}, more than two turns, so that it is probably in centidegrees: divide it "
        f"by 100; {IMPORTED}"
    ]


def _empty_problems(columns: Mapping[str, np.ndarray]) -> list[str]:
    return [
        f"column '{name}' holds no number at all; remove it"
        for name, column in columns.items()
        if name != TIME.column and not np.isfinite(column).any()
    ]


@dataclass(frozen=True, kw_only=True)
class Fit:
    """How well a model explains one measured channel, in the channel's unit; error = model − measured.

    Args:
        samples: number of samples compared: measured, and inside the simulated time.
        rmse: root of the mean squared error.
        bias: mean error; positive if the model gives too much.
        fit_percent: 100 (1 − |error| / |measured − its mean|): 100 is perfect, 0 no better than the mean;
            NaN if the measurements do not vary.
    """

    samples: int
    rmse: float
    bias: float
    fit_percent: float


def modelled(run: xr.Dataset, name: str, time: np.ndarray) -> np.ndarray:
    """Return a channel of a run at other times: linear between its samples, NaN outside."""
    values: np.ndarray = np.interp(time, run["time"].values, run[name].values, left=np.nan, right=np.nan)
    return values


def fit(run: xr.Dataset, record: Record, name: str) -> Fit:
    """Compare one channel of a run with its measurements."""
    measured = record.values[name]
    error = modelled(run, name, record.time) - measured
    known = np.isfinite(error)
    if not known.any():
        return Fit(samples=0, rmse=np.nan, bias=np.nan, fit_percent=np.nan)
    error, measured = error[known], measured[known]
    spread = float(np.linalg.norm(measured - measured.mean()))
    share = float(np.linalg.norm(error)) / spread if spread > 0.0 else np.nan
    rmse = float(np.sqrt(np.mean(error**2)))
    return Fit(samples=error.size, rmse=rmse, bias=float(error.mean()), fit_percent=100.0 * (1.0 - share))


def fits(runs: dict[str, xr.Dataset], record: Record) -> dict[str, dict[str, Fit]]:
    """Return channel → run → how well that run explains the record."""
    return {name: {label: fit(run, record, name) for label, run in runs.items()} for name in record.values}


def with_heading_of(record: Record, simulated: np.ndarray | None) -> Record:
    """Return a record whose heading is counted as that of a simulation, without samples that contradict those around.

    Args:
        record: with or without a heading.
        simulated: heading of the simulation at the record's times, NaN outside its time (n,). [degree]
    """
    if HEADING not in record.values or simulated is None:
        return record
    values, like = record.values[HEADING], expected(record.time, record.values.get(YAW_RATE), simulated)
    gone = contradicted(values, like)
    heading = turned(continuous(np.where(gone, np.nan, values), like), simulated)
    notes = record.notes + (
        (_contradicted(record.time[gone], BY_NAME[HEADING].column),) if gone.any() else ()
    )
    return replace(record, values={**record.values, HEADING: heading}, notes=notes)


def _contradicted(time: np.ndarray, column: str) -> str:
    """Return a sentence about samples that contradict those around them, at these times [s]."""
    when = f"at {time[0]:g} s" if time.size == 1 else f"between {time[0]:g} and {time[-1]:g} s"
    return (
        f"{column}: {time.size} sample{'s' * (time.size > 1)} {when} contradict{'s' * (time.size == 1)} those "
        "before and after, as if averaged or interpolated across north; left out."
    )
