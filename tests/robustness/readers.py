"""Every reader of a user's file, with a good file for each, and ways to spoil one.

A reader takes a folder with its files and gives what it read. `spoiled` mutates a file; `outcome` reads it and says
what came out: something with finite numbers only, or one message. Anything else is raised.
"""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import random
import re
import signal
import zlib
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import scenarios
from subzero.diagnosis import read_extended
from subzero.diagnosis.read_trials import read_trials
from subzero.errors import UserError
from subzero.files.read_file import INCOMPLETE, read_bytes
from subzero.model import load
from subzero.records.metadata import read_metadata
from subzero.records.record import read_record
from subzero.synthetic.sealed_answer import SEALED, Answer, reveal, seal

LONGEST = 20.0
"""A reader that takes longer hangs: the largest file of a mutation takes half a second on an idle machine. [s]"""

FIG6, UMBILICAL, CURRENT = (
    scenarios.path(name).read_text(encoding="utf-8") for name in ("fig6", "rov_umbilical", "current")
)
VEHICLE, CABLE = (
    (scenarios.path("fig6").parent.parent / part).read_text(encoding="utf-8")
    for part in ("vehicles/subzero2.toml", "cables/table1.toml")
)
COMMANDS = "time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n" + "".join(
    f"{time},27,0,0.5,-0.5\n" for time in range(31)
)
MOTION = "time_s,surge_speed_m_s,pitch_deg,heading_deg\n" + "".join(f"{t},1.5,0,{t}\n" for t in range(31))
MOVED = """description = "moved"
vehicle = "subzero2"
cable = "table1"
[run]
duration_s = 30
[motion]
file = "motion.csv"
"""
RECORD = "time_s,surge_speed_m_s,heading_deg,depth_m,rudder_command_deg\n# remark\n" + "".join(
    f"{0.5 * k},{1 + 0.01 * k},{(k * 9) % 360},{'' if k % 4 else 0.1 * k},{k % 3}\n" for k in range(60)
)
SIDECAR = """source = "basin trial"
scenario = "fig6"
tethered = true
surge_speed = "water"
units_checked = ["depth_m", "surge_speed_m_s"]
[noise]
heading_deg = 0.4
[rate_hz]
surge_speed_m_s = 2.0
"""
EXTENDED = """scenario = "fig6"
source = "record.csv"
[effects."hull_drag@12"]
share = 0.1
[effects.propeller_thrust_gain]
share = -0.02
starts_at_s = 3.0
[calibration."sensor_bias:heading"]
shift_deg = 0.3
[[missing_force]]
axis = "X"
time_s = [0.0, 1.0, 2.0]
force_N = [0.0, 0.5, 0.1]
[[missing_term]]
axis = "N"
feature = "r|r|"
coefficient = -0.2
"""
ANSWER = Answer(
    kind="single",
    names=("hull_drag",),
    sentences=("The hull drags more.",),
    starts={"hull_drag": 4.0},
    deviations={"hull_drag": {"added": 0.2}},
    tolerances={"x": (0.1, -0.2)},
    scenario="fig6",
    seed=3,
)
MARKER = json.dumps(
    {"subzero": "moving", "from": "/nowhere/.subzero-1-2", "files": ["a", "b"], "doubtful": []}
)


@dataclasses.dataclass(frozen=True)
class Reader:
    """A file to spoil, what stands beside it, and how it is read."""

    file: str
    good: str
    read: Callable[[Path], Any]
    beside: Mapping[str, str] = dataclasses.field(default_factory=dict)
    wrapped: Callable[[str], str] | None = None


def _resealed(text: str) -> str:
    """Return a spoiled answer as somebody would seal it who knows how."""
    data = text.encode("utf-8", "surrogateescape")
    packed = base64.b64encode(zlib.compress(data)).decode()
    return json.dumps({"sha256": hashlib.sha256(data).hexdigest(), "sealed": packed})


def _still(_setting: Any, times: np.ndarray, channels: Any) -> dict[str, np.ndarray]:
    return {name: np.linspace(0.1, 1.0, times.size) for name in channels}


def _trials(folder: Path) -> Any:
    return read_trials(folder / "record.csv", scenario="fig6", commands="record", simulated=_still)


READERS = {
    "trial": Reader("mine.toml", FIG6, lambda at: load(at / "mine.toml")),
    "umbilical": Reader("mine.toml", UMBILICAL, lambda at: load(at / "mine.toml")),
    "current": Reader("mine.toml", CURRENT, lambda at: load(at / "mine.toml")),
    "vehicle": Reader(
        "own.toml",
        VEHICLE,
        lambda at: load(at / "mine.toml"),
        {"mine.toml": FIG6.replace('"subzero2"', '"own.toml"')},
    ),
    "cable": Reader(
        "own.toml",
        CABLE,
        lambda at: load(at / "mine.toml"),
        {"mine.toml": FIG6.replace('"table1"', '"own.toml"')},
    ),
    "commands": Reader("log.csv", COMMANDS, lambda at: load("fig6", commands_csv=at / "log.csv")),
    "motion": Reader("motion.csv", MOTION, lambda at: load(at / "mine.toml"), {"mine.toml": MOVED}),
    "record": Reader("record.csv", RECORD, lambda at: read_record(at / "record.csv")),
    "logged": Reader("record.csv", RECORD, _trials, {"record.toml": SIDECAR}),
    "sidecar": Reader("record.toml", SIDECAR, lambda at: read_metadata(at / "record.toml")),
    "extended": Reader("extended.toml", EXTENDED, lambda at: read_extended(at / "extended.toml").extended),
    "sealed": Reader(SEALED, seal(ANSWER), reveal),
    "resealed": Reader(SEALED, json.dumps(dataclasses.asdict(ANSWER)), reveal, wrapped=_resealed),
    "marker": Reader(INCOMPLETE, MARKER, lambda at: read_bytes(at / "c", 99), {"c": "mine"}),
}

NUMBERS = (
    "nan",
    "+nan",
    "-nan",
    "inf",
    "-inf",
    "NaN",
    "Infinity",
    "-1",
    "0",
    "-0.0",
    "1e999",
    "1e308",
    "-1e300",
    "1e-300",
    "5e-324",
    "1" + "0" * 400,
    "9" * 5000,
    "0x" + "f" * 4000,
    "1_0",
    "0x10",
    "²",
    "١٢",
    "1e",
    ".5",
    "5.",
    "1,5",
    "--1",
)
VALUES = (
    "true",
    '"text"',
    "''",
    '""',
    "[]",
    "{}",
    "[[]]",
    "{value = {}}",
    "[1, 'a']",
    "1979-05-27",
    "12:30:00",
    "1979-05-27T07:32:00Z",
    "null",
    "{a = {b = {c = {d = 1}}}}",
    '"\\u001b[31mred"',
    '"\\u0000"',
    '"X"',
    "[0.0]",
    '["a", "b"]',
    "[" * 3000,
    "[" * 40 + "]" * 40,
    "{a=" * 30 + "1" + "}" * 30,
)
SIGNS = (
    "=",
    "\n",
    "\r",
    "\t",
    ",",
    ",,",
    ";",
    '"',
    '"""',
    "'''",
    "#",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "@",
    ".",
    "\\",
    "\x00",
    "\x1b[2J",
    "\ufeff",
    "é",
    "\u2028",
    " " * 300,
    "\udcff",
    "\udc80",
    "😀",
    "\n\n# ",
    "a." * 40 + "a = 1\n",
)
KEYS = (
    "[run]\n",
    "[winch]\n",
    "[vessel]\n",
    "[changes]\n",
    "[start]\n",
    "[noise]\n",
    "[rate_hz]\n",
    "[water]\n",
    "[motion]\n",
    "[commands]\n",
    "[[missing_force]]\n",
    "[[missing_term]]\n",
    "[effects]\n",
    "axis = 12:30:00\n",
    "feature = 12:30:00\n",
    '[effects."hull_drag@²"]\n',
    '[effects."hull_drag@1e999"]\n',
    "heading_deg = 1e-300\n",
    "heading_deg = 1e300\n",
    'scenario = "/dev/zero"\n',
    'file = "/dev/zero"\n',
    'vehicle = "/dev/zero.toml"\n',
    'file = "."\n',
    "units_checked = [[1]]\n",
    "units_checked = [{}]\n",
    "time_s",
    "nan,nan,nan\n",
    "duration_s = 1e300\n",
    'effects_file = ""\n',
    "changes.a.b.c = 1\n",
    "k = 1\n" * 40,
)
NUMBER = re.compile(r"(?<![\w.-])-?\d[\w.+]*")
SPICES = (*NUMBERS, *VALUES, *SIGNS, *KEYS)


def spoiled(text: str, rng: random.Random) -> str:
    """Return a text with a few pieces cut, doubled, moved, replaced by a spice, or a number by another."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 5))):
        text = rng.choice((_pierced, _pierced, _renumbered, _renumbered, _moved, _valued, _cut))(text, rng)
    return text


def _pierced(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    to = min(len(text), at + rng.choice((0, 0, 1, 3, 10, 100)))
    return text[:at] + rng.choice((*SPICES, "", text[at:to] * 2)) + text[to:]


def _renumbered(text: str, rng: random.Random) -> str:
    """Put another number or value in the place of one."""
    spots = [found.span() for found in NUMBER.finditer(text)]
    if not spots:
        return text
    at, to = rng.choice(spots)
    return text[:at] + rng.choice((*NUMBERS, *NUMBERS, *VALUES)) + text[to:]


def _valued(text: str, rng: random.Random) -> str:
    """Put another value behind a key or between two commas."""
    lines = text.split("\n")
    at = rng.randrange(len(lines))
    for sign in ("=", ":", ","):
        if sign in lines[at]:
            parts = lines[at].split(sign)
            parts[rng.randrange(1, len(parts))] = rng.choice((*NUMBERS, *VALUES))
            lines[at] = sign.join(parts)
            break
    return "\n".join(lines)


def _moved(text: str, rng: random.Random) -> str:
    """Exchange, double or drop lines."""
    lines = text.split("\n")
    i, k = (rng.randrange(len(lines)) for _ in range(2))
    how = rng.randrange(3)
    if how == 0:
        lines[i], lines[k] = lines[k], lines[i]
    elif how == 1:
        lines.insert(i, lines[k])
    else:
        del lines[i]
    return "\n".join(lines)


def _cut(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(len(text) + 1)]


class HangError(BaseException):
    """A reader took longer than `LONGEST`."""


@contextmanager
def limited():
    """Raise `HangError` in what takes longer than `LONGEST`."""

    def late(*_: Any) -> None:
        raise HangError

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def outcome(reader: Reader, text: str, folder: Path) -> str:
    """Return "read" or "refused"; raises whatever else a reader does with a text."""
    for name, other in reader.beside.items():
        (folder / name).write_text(other, encoding="utf-8")
    whole = reader.wrapped(text) if reader.wrapped else text
    (folder / reader.file).write_bytes(whole.encode("utf-8", "surrogateescape"))
    with limited():
        try:
            found = reader.read(folder)
        except (UserError, scenarios.ScenarioError) as error:
            check_message(str(error))
            return "refused"
    check_finite(found)
    return "read"


def check_message(message: str) -> None:
    """A message says something, can be printed on any terminal, and ends."""
    assert 10 < len(message) < 40_000
    assert message.replace("\n", "").isprintable(), message


def check_finite(found: Any) -> None:
    """Nothing that was read holds a number that is not finite, but for the gaps of a record."""
    if dataclasses.is_dataclass(found):
        for one in dataclasses.fields(found):
            check_finite(getattr(found, one.name))
    elif isinstance(found, Mapping):
        for one in found.values():
            gaps_aside = one[np.isfinite(one) | np.isinf(one)] if isinstance(one, np.ndarray) else one
            check_finite(gaps_aside)
    elif isinstance(found, (list, tuple, set, frozenset)):
        for one in found:
            check_finite(one)
    elif isinstance(found, (int, float, np.ndarray)):
        assert np.isfinite(np.asarray(found, dtype=float)).all(), found
