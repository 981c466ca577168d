"""Metadata of a measured record that a user can give: a TOML file in the same folder, with the same name.

source = "basin trial of 12 May, run 3"
scenario = "fig6"               # the trial it belongs to; else the one of the command line
tethered = true
surge_speed = "water"           # what the speed log shows: speed through the "water" or over "ground"
units_checked = ["depth_m"]     # these columns are right although they look odd; true for all
[noise]                         # standard deviation where it is known, else it is estimated
heading_deg = 0.4
[rate_hz]                       # of sensors slower than the record, which repeats their values
surge_speed_m_s = 2.0
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scenarios import ScenarioError
from scenarios.files import Source, read_toml
from subzero.channels import BY_COLUMN, TIME
from subzero.errors import UserError, listed, printable, suggestion
from subzero.errors import short as shown

WORDS = {"source": str, "scenario": str, "tethered": bool, "surge_speed": str}
LIMITS = {"noise": (1e-6, 1e6), "rate_hz": (1e-4, 1e5)}
"""Standard deviations finer than any sensor resolves or wider than any channel is, in whatever unit, are slips of the
pen (their squares divide residuals); so are sensors slower than three hours or faster than any. [display unit, 1/s]"""
TABLES = tuple(LIMITS)
KEYS = (*WORDS, "units_checked", *TABLES)
OVER = ("water", "ground")


@dataclass(frozen=True, kw_only=True)
class Metadata:
    """The metadata of a record.

    Attributes:
        source: where it comes from.
        scenario: name, or path from the sidecar's folder; "" if it does not say.
        tethered: with the cable.
        over_ground: the surge speed is over ground, not through the water.
        checked: channels that are right although they look odd; None for all.
        noise: channel → standard deviation. [its display unit]
        rate: channel → how often its sensor gives a new value. [1/s]
    """

    source: str = ""
    scenario: str = ""
    tethered: bool = True
    over_ground: bool = False
    checked: frozenset[str] | None = frozenset()
    noise: Mapping[str, float] = field(default_factory=dict)
    rate: Mapping[str, float] = field(default_factory=dict)

    def trusts(self, channel: str) -> bool:
        """Return whether the user has said that a channel is right as it is."""
        return self.checked is None or channel in self.checked


def read_metadata(path: Path) -> Metadata:
    """Read a sidecar; one that is not there says nothing.

    Raises:
        UserError: it cannot be used; names every problem with its line.
    """
    if not os.path.lexists(path):
        return Metadata()
    source = _toml(path)
    problems = [*_keys(source), *_words(source), *_checked(source)]
    problems += [said for table in TABLES for said in _table(source, table)]
    if problems:
        raise UserError(listed(f"The sidecar {printable(str(path))} cannot be used:", problems))
    said = source.table
    named = said.get("scenario", "")  # a shipped scenario, or a path from the sidecar's folder
    return Metadata(
        source=printable(said.get("source", "")),
        scenario=str(path.parent / named) if named.endswith(".toml") else named,
        tethered=said.get("tethered", True),
        over_ground=said.get("surge_speed", "water") == "ground",
        checked=_trusted(said.get("units_checked", [])),
        noise=_by_channel(said.get("noise", {})),
        rate=_by_channel(said.get("rate_hz", {})),
    )


def _toml(path: Path) -> Source:
    try:
        return read_toml(path, str(path))
    except ScenarioError as error:
        problems = [str(problem) for problem in error.problems]
        raise UserError(listed(f"The sidecar {printable(str(path))} cannot be used:", problems)) from None


def _at(source: Source, key: str) -> str:
    line = source.line(key)
    return f"line {line}, {key}" if line else key


def _keys(source: Source) -> list[str]:
    return [
        f"{_at(source, key)}: there is no such key.{suggestion(key, KEYS)} Allowed: {', '.join(KEYS)}."
        for key in source.table
        if key not in KEYS
    ]


def _words(source: Source) -> list[str]:
    kinds = {str: "a text in quotes", bool: "true or false"}
    problems = [
        f"{_at(source, key)}: found {shown(source.table[key])}, but this is not {kinds[kind]}"
        for key, kind in WORDS.items()
        if key in source.table and not isinstance(source.table[key], kind)
    ]
    over = source.table.get("surge_speed", "water")
    if isinstance(over, str) and over not in OVER:
        problems.append(f"{_at(source, 'surge_speed')}: found {shown(over)}. Allowed: 'water' or 'ground'.")
    return problems


def _checked(source: Source) -> list[str]:
    said = source.table.get("units_checked", [])
    if isinstance(said, bool):
        return []
    if not isinstance(said, list):
        return [f"{_at(source, 'units_checked')}: found {shown(said)}. Allowed: true, or a list of columns."]
    return [
        _unknown(source, "units_checked", column)
        for column in said
        if not isinstance(column, str) or column not in BY_COLUMN
    ]


def _table(source: Source, name: str) -> list[str]:
    """Return the problems of a table of columns and positive numbers."""
    table = source.table.get(name, {})
    if not isinstance(table, Mapping):
        return [f"{_at(source, name)}: this is not a section; write [{name}] and a line for each column"]
    problems, (low, high) = [], LIMITS[name]
    for column, value in table.items():
        key = f"{name}.{column}"
        if column not in BY_COLUMN or column == TIME.column:
            problems.append(_unknown(source, key, column))
        elif isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0.0:
            problems.append(f"{_at(source, key)}: found {shown(value)}, but this is not a number above 0")
        elif not low <= value <= high:
            problems.append(f"{_at(source, key)}: found {shown(value)}. Allowed: {low:g} to {high:g}")
    return problems


def _unknown(source: Source, key: str, column: object) -> str:
    return f"{_at(source, key)}: there is no column {shown(column)}.{suggestion(str(column), BY_COLUMN)}"


def _trusted(said: bool | list[str]) -> frozenset[str] | None:
    if isinstance(said, bool):
        return None if said else frozenset()
    return frozenset(BY_COLUMN[column].name for column in said)


def _by_channel(table: Mapping[str, Any]) -> dict[str, float]:
    return {BY_COLUMN[column].name: float(value) for column, value in table.items()}
