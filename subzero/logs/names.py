"""The meaning of the name of a column: its channel and its unit, looked up in the tables of ``names.toml``.

A name is cut into words, ``NAV_HEADING`` → nav heading, ``depth[cm]`` → depth in cm, ``yaw_rad`` → yaw in rad. Words of
a message or a sensor before it, and numbers of instances, do not count. Only whole names of the table are recognised:
``DesYaw`` is no heading. Of ``heading @ /odom`` in a log of ROS, the topic only says whether it is a command.
"""

from __future__ import annotations

import re
import tomllib
from importlib.resources import files
from typing import NamedTuple

from subzero.channels import BY_NAME

LATITUDE, LONGITUDE, PRESSURE = "latitude", "longitude", "pressure"
TARGETS = {LATITUDE: "north", LONGITUDE: "east", PRESSURE: "depth"}
"""A quantity that is no channel itself → the channel that it becomes."""
RARE = ("mm", "km", "mm/s", "mrad", "mrad/s", "psi", "dbar absolute", "bar absolute", "psi absolute")
"""Units that are only believed where a name says so."""
BRACKET = r"[\[(]([^\])]*)[\])]?"
"""A unit in a name, or the number of an instance."""


class Unit(NamedTuple):
    """A unit that loggers use: a written value times `factor`, plus `offset`, is in the channel's unit."""

    factor: float
    offset: float = 0.0
    words: str = ""


class Named(NamedTuple):
    """The meaning of a name: channel, unit (empty: nothing), why, and its rank; a lower one is the better
    measurement.
    """

    channel: str
    unit: str
    reason: str
    rank: int


def kind_of(channel: str) -> str:
    """Return where the units of a channel stand in `UNITS`: its display unit, or its own name."""
    return channel if channel in TARGETS else BY_NAME[channel].unit


def is_unit(text: str) -> bool:
    """Return whether a text is a known unit."""
    return any(_spelling(text) == spelling for _, spelling in SPELLINGS) or text in ("-", "1", "%")


def unit_of(kind: str, text: str) -> str:
    """Return the unit in `UNITS` that a text means; empty if none."""
    return SPELLINGS.get((kind, _spelling(text)), "")


def reason_unused(name: str) -> str:
    """Return why a column that loggers are known for is no channel; empty if it may be one."""
    return next((reason for reason, pattern in UNUSED.items() if pattern.search(name)), "")


def recognised(name: str, unit: str = "") -> Named | None:
    """Return the meaning of a column's name, and of the unit that the file has for it; None if no channel and no
    time.

    Args:
        name: as the logger wrote it.
        unit: of a row of units, or an attribute; empty if there is none.
    """
    field, _, topic = name.partition(" @ ")
    plain = re.sub(BRACKET, " ", field)
    words = _words(plain)
    if reason_unused(name) or not COMMANDS.isdisjoint(_words(topic)):
        return None
    if re.search(r"(^|[^A-Za-z])[A-Za-z]\d+$", plain.strip()):  # T1 is no time, and Q1 no pitch rate
        return None
    inside = next((text for text in re.findall(BRACKET, field) if not text.isdigit()), "")
    for end in range(len(words), max(len(words) - 3, 0), -1):  # the last words may be a unit
        if (known := _looked_up(words[:end])) is None:
            continue
        channel, usual, rank = known
        ending = unit_of(kind_of(channel), "".join(words[end:]))
        if end < len(words) and not ending:
            continue
        by_file, by_name = unit_of(kind_of(channel), unit), unit_of(kind_of(channel), inside) or ending
        if by_file and usual.endswith(" up"):  # an altitude is a height whatever its unit
            by_file = unit_of(kind_of(channel), f"{by_file} up") or by_file
        reason = ["name", "name of its logger", "unit in the name", "unit in the file"]
        level = 3 if by_file else 2 if by_name else 1 if usual else 0
        return Named(channel, by_file or by_name or usual, reason[level], rank)
    return None


def _looked_up(words: list[str]) -> tuple[str, str, int] | None:
    """Return channel, usual unit and rank of some words, without those of a message before them."""
    key = "_".join(words)
    if key in NAMES:
        return NAMES[key]
    if key in BY_NAME:
        return key, "", 0
    known = _looked_up(words[1:]) if words and words[0] in PREFIXES else None
    return known and (known[0], known[1], known[2] + len(NAMES))


def _words(name: str) -> list[str]:
    """Return the words of a name in small letters: parted by signs, capitals and numbers, which are left out."""
    return [word.lower() for word in re.findall(r"[A-ZÄÖÜ]?[a-zäöüµμ°]+|[A-ZÄÖÜ]+(?![a-z])", name)]


def _spelling(unit: str) -> str:
    """Return a unit as it is looked up: small, letters and numbers only."""
    return re.sub(r"[^a-z0-9°µ]", "", unit.lower().replace("μ", "µ").replace("º", "°"))


def _names(rows: dict[str, str]) -> dict[str, tuple[str, str, int]]:
    """Return name → channel, the unit that its logger always writes, and its rank among the names of the channel."""
    found = {}
    for channel, text in rows.items():
        for rank, entry in enumerate(text.split()):
            name, _, unit = entry.partition(":")
            found[name] = channel, unit and SPELLINGS[kind_of(channel), _spelling(unit)], rank
    return found


_TABLES = tomllib.loads(files("subzero.logs").joinpath("names.toml").read_text(encoding="utf-8"))
UNITS: dict[str, dict[str, Unit]] = {
    kind: {name: Unit(**row) for name, row in rows.items()} for kind, rows in _TABLES["units"].items()
}
"""Display unit of a channel → unit that a logger may use."""
UNITS[LONGITUDE] = UNITS[LATITUDE]
SPELLINGS: dict[tuple[str, str], str] = {
    (kind, _spelling(word)): name
    for kind, units in UNITS.items()
    for name, unit in units.items()
    for word in (name, *unit.words.split())
}
"""(Display unit, spelling) → unit."""
NAMES = _names(_TABLES["names"])
PREFIXES, COMMANDS = (frozenset(_TABLES[kind]["words"].split()) for kind in ("prefixes", "commands"))
UNUSED = {reason: re.compile(pattern) for reason, pattern in _TABLES["unused"].items()}
LIMITS: dict[str, float] = _TABLES["limits"]
CLOCK_UNITS = {name: unit.factor for name, unit in UNITS["s"].items()}
"""Unit of a clock → seconds; MATLAB's datenum counts days."""
