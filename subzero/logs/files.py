"""Files of loggers: which ending is read how, and the readers that stand on a library.

A reader gives columns of a file, or its messages as samples that each have their own time. What a library prints, and
whatever it raises, becomes one sentence. Attitudes that are quaternions become angles, and the axes of ROS (REP 103:
east, north, up; forward, left, up) become north, east, down; both are said.

No file executes code: rosbags compiles the definitions of messages in a bag, in which its grammar allows names only.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

from subzero.channels import TIME
from subzero.errors import UserError, missing_extra, printable
from subzero.files.read_file import MEGABYTE, MOST_COLUMNS, UnreadableFileError, check_readable
from subzero.logs.names import reason_unused, recognised
from subzero.logs.table import (
    Column,
    Progress,
    Sample,
    Table,
    Wanted,
    numbers,
    refusal,
    side_by_side,
    without_sentinels,
)
from subzero.logs.text import read_alog, read_csv
from subzero.logs.times import DATE_AND_TIME

MOST_OF_A_LOG = 1024 * MEGABYTE
"""Columns of a binary file that are wanted take about as much memory. [byte]"""
DATAFLASH = b"\xa3\x95"
"""Every message of an ArduPilot log begins so."""
EARTH_FRAMES = ("map", "odom", "world", "earth")
"""Frames of ROS (REP 105) in which a velocity is none of the body."""
ROS_AXES = {
    "position": (("east", "north", "depth"), (1.0, 1.0, -1.0), "m"),
    "linear": (("surge_speed", "sway_speed", "heave_speed"), (1.0, -1.0, -1.0), "m/s"),
    "angular": (("roll_rate", "pitch_rate", "yaw_rate"), (1.0, -1.0, -1.0), "rad/s"),
}
"""Vector in a message → channels of its parts x, y, z, their signs in the axes of ROS, and their unit."""
OF_ROS = "Its axes are those of ROS: east, north, up and forward, left, up become north, east, down."

Notes = list[str]
Columns = dict[str, Column]
Reader = Callable[[Path, Wanted, Progress], Table]


def read_table(path: str | Path, wanted: Wanted, progress: Progress = lambda _: None) -> Table:
    """Return the table in a file; its ending says how it is read, and all others are CSV.

    Raises:
        UserError: it cannot be read, is too large, or holds no table.
    """
    try:
        check_readable(path)
    except UnreadableFileError as error:
        raise refusal(path, error.why, error.remedy) from None
    read, size = READERS.get(Path(path).suffix.lower(), read_csv), Path(path).stat().st_size
    if size > MOST_OF_A_LOG and read is not read_csv:
        why = f"it has {size // MEGABYTE} MB, and at most {MOST_OF_A_LOG // MEGABYTE} are read"
        raise refusal(path, why, "Split it.")
    table = read(Path(path), wanted, progress)
    if len(table.columns) > MOST_COLUMNS:
        why = f"it has {len(table.columns)} columns, and at most {MOST_COLUMNS} are read"
        raise refusal(path, why, "Leave some out.")
    columns = {
        name: c for name, c in table.columns.items() if not (name.startswith("column ") and c.is_empty)
    }
    if not columns or not max(column.values.size for column in columns.values()):
        raise refusal(path, "it holds no samples", "It needs names of columns, and rows of numbers.")
    columns, notes = without_sentinels(columns)
    return Table(printable(str(path)), columns, (*table.notes, *notes), table.stride)


def _by_library(
    kind: str, library: str, remedy: str, read: Callable[[Path, Wanted, Notes], Columns | Iterator[Sample]]
) -> Reader:
    """Return a reader that stands on a library: silent, and with one message for all that goes wrong."""

    def reader(path: Path, wanted: Wanted, progress: Progress) -> Table:
        notes, unused = Notes(), dict[str, list[str]]()

        def is_wanted(name: str, unit: str) -> bool:
            if (name, unit) not in known:
                if reason := reason_unused(name):
                    unused.setdefault(reason, []).append(name)
                named = recognised(name, unit)
                known[name, unit] = wanted(name, unit) and not (named and named.channel == TIME.name)
            return known[name, unit]

        known: dict[tuple[str, str], bool] = {}
        try:
            with _silence() as said:
                found = read(path, is_wanted, notes)
                columns = found if isinstance(found, dict) else side_by_side(found)
                is_damaged = said.tell() > 0
        except ImportError:
            raise missing_extra(f"The log {printable(str(path))}", library, "logs") from None
        except UserError:
            raise
        except Exception as error:  # those libraries raise all kinds
            why = printable(re.sub(r"\s+", " ", str(error))[:120])
            raise refusal(path, f"it is damaged or no {kind} ({why})", remedy) from None
        notes += ["Parts of it are damaged or cut off, and are left out."] if is_damaged else []
        notes += [f"{_some(names)}: not used: {reason}." for reason, names in unused.items()]
        return Table(str(path), columns, tuple(notes))

    return reader


@contextlib.contextmanager
def _silence() -> Iterator[IO[str]]:
    """Give a file that holds all that is printed meanwhile, also by machine code."""
    with tempfile.TemporaryFile("w+") as said, contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):  # a closed standard error
            kept = os.dup(2)
            stack.callback(os.close, kept)
            stack.callback(os.dup2, kept, 2)
            os.dup2(said.fileno(), 2)
        stack.enter_context(contextlib.redirect_stdout(said))
        stack.enter_context(contextlib.redirect_stderr(said))
        yield said


def _some(names: list[str]) -> str:
    return ", ".join(names) if len(names) < 4 else f"{names[0]} to {names[-1]} ({len(names)} columns)"


# Files of columns


def _mat(path: Path, wanted: Wanted, notes: Notes) -> Columns:
    """Read vectors of a MATLAB file, also those in structures; the most frequent length is that of the log."""
    from scipy.io import loadmat

    try:
        vectors = dict(_vectors("", loadmat(path, simplify_cells=True)))
    except NotImplementedError:  # scipy refuses version 7.3, which is HDF5
        remedy = "In MATLAB: x = load('log.mat'); save('log.mat', '-struct', 'x', '-v7')."
        raise refusal(path, "it is MATLAB's version 7.3", remedy) from None
    sizes = Counter(vector.size for vector in vectors.values())
    length = max(sizes, key=lambda size: (sizes[size], size), default=0)
    return {name: numbers(vector) for name, vector in vectors.items() if vector.size == length}


def _vectors(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Give the vectors of numbers in nested mappings."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if not key.startswith("__"):
                yield from _vectors(f"{name}.{key}" if name else key, inner)
    elif (
        isinstance(value, np.ndarray)
        and value.dtype.kind in "fiu"
        and max(value.shape, default=0) == value.size > 1
    ):
        yield name, value.astype(float).ravel()


def _netcdf(path: Path, wanted: Wanted, notes: Notes) -> Columns:
    """Read the variables of a netCDF file along its time."""
    import xarray as xr

    with xr.open_dataset(path, engine="netcdf4", decode_timedelta=False) as opened:
        data = opened.load()
    flat = {str(name): v for name, v in data.variables.items() if v.ndim == 1 and v.dtype.kind in "fiuM"}
    along = Counter(v.dims[0] for v in flat.values()).most_common(1)
    return {name: _of_variable(v) for name, v in flat.items() if v.dims[0] == along[0][0]}


def _of_variable(variable: Any) -> Column:
    if variable.dtype.kind == "M":
        stamps = variable.values.astype("datetime64[ns]")
        seconds = stamps.astype(np.int64) / 1e9
        return Column(values=np.where(np.isnat(stamps), np.nan, seconds), form=DATE_AND_TIME[0])
    return numbers(variable.values.astype(float), unit=str(variable.attrs.get("units", "")))


# Logs of messages


def _dataflash(path: Path, wanted: Wanted, notes: Notes) -> Iterator[Sample]:
    """Give the numbers of an ArduPilot log; a name has its message and instance, ``BARO[0].Alt``."""
    from pymavlink.DFReader import DFReader_binary

    with open(path, "rb") as file:
        if file.read(2) != DATAFLASH:
            raise refusal(path, "it is no log of ArduPilot", "Give the .BIN file that the autopilot wrote.")
    log = DFReader_binary(str(path))
    with contextlib.closing(log.filehandle), contextlib.closing(log.data_map):
        while (message := log.recv_msg()) is not None:
            fields = message.to_dict()
            if "TimeUS" in fields:
                # without the units in the log: those of ArduSub say cm of a depth in m (CTUN.BAlt)
                yield from _of_mavlink(fields, "I", {}, 1e-6 * fields["TimeUS"], wanted)
        if log.remaining:
            print("cut")  # said in one sentence with all other damage


def _tlog(path: Path, wanted: Wanted, notes: Notes) -> Iterator[Sample]:
    """Give the numbers of a telemetry log of MAVLink, of the first vehicle in it, at the times of their arrival."""
    from pymavlink import mavutil

    log, vehicle, others = mavutil.mavlogfile(str(path)), None, 0
    with contextlib.closing(log):
        while (message := log.recv_msg()) is not None:
            if message.get_type() == "BAD_DATA":
                print("bad data")
                continue
            key = getattr(message, "instance_field", None) or ""
            found = list(
                _of_mavlink(message.to_dict(), key, message.fieldunits_by_name, message._timestamp, wanted)
            )
            vehicle = message.get_srcSystem() if found and vehicle is None else vehicle
            others += bool(found) and message.get_srcSystem() != vehicle
            yield from found if message.get_srcSystem() == vehicle else ()
    notes += ["Times are those at which messages arrived."]
    notes += [f"{others} messages of other systems are left out."] if others else []


def _of_mavlink(
    fields: dict[str, Any], key: str, units: dict[str, str], at: float, wanted: Wanted
) -> Iterator[Sample]:
    instance = f"[{fields[key]}]" if key in fields else ""
    for field, value in fields.items():
        name, unit = f"{fields['mavpackettype']}{instance}.{field}", units.get(field, "")
        if isinstance(value, int | float) and wanted(name, unit):
            yield Sample(name, unit, at, float(value))


def _ulog(path: Path, wanted: Wanted, notes: Notes) -> Iterator[Sample]:
    """Give the numbers of a PX4 log; ``q`` is an attitude to north, east, down."""
    from pyulog import ULog

    with open(path, "rb") as file:
        log = ULog(file)
    if log.file_corruption:
        print("damaged")
    for topic in log.data_list:
        times, name = 1e-6 * topic.data["timestamp"], f"{topic.name}[{topic.multi_id}]"
        fields = {
            re.sub(r"xyz\[([012])\]", lambda m: "xyz"[int(m[1])], key): v for key, v in topic.data.items()
        }
        if "q[3]" in fields:
            angles = angles_of(*(fields[f"q[{k}]"].astype(float) for k in range(4)))
            fields |= dict(zip(("roll [rad]", "pitch [rad]", "yaw [rad]"), angles, strict=True))
        for field, values in fields.items():
            if wanted(f"{name}.{field}", ""):
                yield from (
                    Sample(f"{name}.{field}", "", *pair)
                    for pair in zip(times, values.astype(float), strict=True)
                )


def _mcap(path: Path, wanted: Wanted, notes: Notes) -> Iterator[Sample]:
    """Give the numbers of an MCAP log whose messages are JSON or of ROS 2."""
    from mcap.reader import make_reader

    with open(path, "rb") as file:
        others = set[str]()
        for _, channel, message in make_reader(file).iter_messages():
            if channel.message_encoding == "json":
                yield from _of_ros(
                    channel.topic, json.loads(message.data), 1e-9 * message.log_time, wanted, notes
                )
            else:
                others.add(channel.message_encoding)
    if others & {"cdr"}:
        yield from _rosbag(path, wanted, notes)
    notes += [
        f"Messages in {name} are left out; JSON and ROS 2 are read." for name in sorted(others - {"cdr"})
    ]


def _rosbag(path: Path, wanted: Wanted, notes: Notes) -> Iterator[Sample]:
    """Give the numbers of a ROS bag."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
        for link, at, data in bag.messages():
            yield from _of_ros(link.topic, bag.deserialize(data, link.msgtype), 1e-9 * at, wanted, notes)


def _of_ros(topic: str, message: Any, at: float, wanted: Wanted, notes: Notes) -> Iterator[Sample]:
    """Give the numbers in a message, ``field @ topic``, in the axes of a vehicle."""
    frame = str(_parts(_parts(message).get("header")).get("frame_id", ""))
    is_ned = "ned" in frame.lower()
    is_of_body = "child_frame_id" in _parts(message) or frame not in EARTH_FRAMES
    for name, unit, value, is_turned in _fields("", message, is_ned, is_of_body):
        column = f"{name if name != 'data' else topic.rpartition('/')[2]} @ {topic}"
        if wanted(column, unit):
            if is_turned and OF_ROS not in notes:
                notes.append(OF_ROS)
            yield Sample(column, unit, at, value)


def _parts(value: Any) -> dict[str, Any]:
    """Return the parts of a message or of JSON by their names; none of a number or a list."""
    names = getattr(type(value), "__dataclass_fields__", ())
    return value if isinstance(value, dict) else {name: getattr(value, name) for name in names}


def _fields(path: str, value: Any, is_ned: bool, is_of_body: bool) -> Iterator[tuple[str, str, float, bool]]:
    """Give name, unit and value of the numbers in a message, and whether axes were turned."""
    parts, kind = _parts(value), path.rpartition(".")[2].removesuffix("_velocity")
    if {"x", "y", "z", "w"} <= set(parts) and kind != "rotation":  # of one frame of many, to another
        roll, pitch, yaw = angles_of(*(float(parts[name]) for name in "wxyz"))
        angles = (roll, pitch, yaw) if is_ned else (roll, -pitch, (0.5 * math.pi - yaw) % (2.0 * math.pi))
        for name, angle in zip(("roll", "pitch", "heading"), angles, strict=True):
            yield name, "rad", float(angle), not is_ned
    elif kind in ROS_AXES and {"x", "y", "z"} <= set(parts) and (is_of_body or kind == "position"):
        names, signs, unit = ROS_AXES[kind]
        order = "yxz" if is_ned and kind == "position" else "xyz"  # x is north there
        for name, part, sign in zip(names, order, signs, strict=True):
            yield name, unit, float(parts[part]) * (1.0 if is_ned else sign), not is_ned
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, "", float(value), False
    for name, inner in parts.items() if kind not in (*ROS_AXES, "rotation") else ():
        yield from _fields(f"{path}.{name}".lstrip("."), inner, is_ned, is_of_body)


def angles_of(w: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
    """Return roll, pitch and yaw of a unit quaternion that turns body axes to those of the earth. [rad]"""
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    return roll, pitch, np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


READERS: dict[str, Reader] = {
    ".alog": read_alog,
    ".mat": _by_library("MATLAB file", "scipy", "Save it anew.", _mat),
    ".nc": _by_library("netCDF file", "netCDF4", "Save it anew.", _netcdf),
    ".bin": _by_library("log of ArduPilot", "pymavlink", "Copy it anew.", _dataflash),
    ".tlog": _by_library("log of MAVLink", "pymavlink", "Copy it anew.", _tlog),
    ".ulg": _by_library("log of PX4", "pyulog", "Copy it anew.", _ulog),
    ".mcap": _by_library("MCAP file", "mcap and rosbags", "Copy it anew.", _mcap),
    ".bag": _by_library("ROS bag", "rosbags", "Copy it anew.", _rosbag),
    ".db3": _by_library("ROS bag", "rosbags", "Copy it anew.", _rosbag),
}
"""Ending of a file's name → its reader."""
