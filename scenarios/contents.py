"""The contents of a trial, a vehicle or a cable, number by number: value, unit, plausible range, and source.

For people who look before they run (`subzero show`). A trial's numbers come with the limits and the meaning of the
table of quantities; those of a vehicle or a cable with the range and the source that their own file gives.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from textwrap import shorten
from typing import Any

from scenarios.errors import Problem, ScenarioError, nearest_or_all
from scenarios.files import Source, parsed, read_toml, shipped, shipped_path
from scenarios.parameters import known_numbers
from scenarios.parts import PATTERNS, Part, leaves, part_of, read_changes, read_part, unit_of
from scenarios.quantities import Quantity
from scenarios.trial import Trial
from scenarios.vehicle_lists import OPTIONAL_SECTIONS
from subzero.errors import printable

SENTENCE_END = re.compile(r"(?<=[\w)]{2})\. (?=[A-Z])")
"""A full stop after a whole word, which an initial is not."""

LONGEST = 160
"""A sentence is cut after so many letters."""

FOLDERS = {"trial": "trials", "vehicle": "vehicles", "cable": "cables"}
"""Kind of file → the folder of those that are shipped."""


ORIGINS = ("measured", "derived", "guessed")
"""Where a number comes from: measured or published; from the shape of the vehicle, by a formula; or from judgement."""
DERIVED, GUESSED = ("geometry formula", "derived"), ("estimate", "none", "convention", "no source")
"""Beginnings of a source in a file that say so; all others are measured, printed or given."""


def origin_of(source: str) -> str:
    """Return which of `ORIGINS` the source of a number in a vehicle or cable file says."""
    if source.startswith(DERIVED):
        return "derived"
    return "guessed" if source.startswith(GUESSED) or not source else "measured"


@dataclass(frozen=True, kw_only=True)
class Number:
    """A number of a file.

    Attributes:
        name: dotted, as `Trial.with_changes` takes it.
        values: one, or all of a list, in the unit of the file.
        unit: in the file.
        low: least plausible value; of a trial, the least that is allowed.
        high: greatest.
        source: where the value comes from; of a trial, its meaning.
        origin: of a vehicle or a cable: one of `ORIGINS`.
    """

    name: str
    values: tuple[float, ...]
    unit: str
    low: float
    high: float
    source: str
    origin: str = ""


@dataclass(frozen=True, kw_only=True)
class Contents:
    """A file in numbers.

    Attributes:
        kind: "trial", "vehicle" or "cable".
        name: as it was given.
        description: in a line.
        numbers: all of them, in the order of the file; of a trial without those of its vehicle and cable.
        parts: of a trial: "vehicle" and "cable" → what it names.
    """

    kind: str
    name: str
    description: str
    numbers: tuple[Number, ...]
    parts: dict[str, str]


def first_line(kind: str, name: str) -> str:
    """Return the description of a shipped vehicle or cable: the first sentence of its file."""
    return first_sentence(shipped_path(FOLDERS[kind], name).read_text(encoding="utf-8"))


def first_sentence(text: str) -> str:
    """Return the first sentence of the remark that a file begins with; nothing if it begins with none."""
    lines = takewhile(lambda line: line.startswith("# "), text.splitlines())
    words = " ".join(line.removeprefix("#").strip() for line in lines)
    return shorten(SENTENCE_END.split(words)[0].rstrip(".") + ".", LONGEST, placeholder=" …") if words else ""


def locate(name_or_path: str | Path) -> tuple[str, Source]:
    """Return the kind of a file and the file: a shipped name, or the path of a TOML file.

    Raises:
        ScenarioError: there is none, it is not TOML, or it is neither a trial nor a vehicle nor a cable.
    """
    named = str(name_or_path)
    for kind, folder in FOLDERS.items():
        if named in shipped(folder):
            return kind, read_toml(shipped_path(folder, named), named)
    if not named.endswith(".toml"):
        every = [name for folder in FOLDERS.values() for name in shipped(folder)]
        remedy = f"{nearest_or_all(named, every)} Or give the path of a TOML file."
        why = "there is no such scenario, vehicle or cable"
        raise ScenarioError([Problem(file=printable(named) or "''", why=why, remedy=remedy)])
    source = read_toml(Path(named), named)
    return _kind_of(source), source


def _kind_of(source: Source) -> str:
    """Return the kind of a user's file, by the sections that only this kind has."""
    table = source.table
    if {"base", "known", "rigid_body", *OPTIONAL_SECTIONS} & table.keys():
        return "vehicle"
    for kind, key, shape in (("vehicle", "hull", dict), ("cable", "drum", dict), ("trial", "vehicle", str)):
        if isinstance(table.get(key), shape):
            return kind
    why = "this is neither a trial (vehicle = …, cable = …) nor a vehicle ([hull]) nor a cable ([cable], [drum])"
    raise ScenarioError([source.problem("", why, "subzero new my_trial.toml makes one to begin with.")])


def contents(name_or_path: str | Path) -> Contents:
    """Return the contents of a file.

    Args:
        name_or_path: name of a shipped trial, vehicle or cable, or the path of a TOML file.

    Raises:
        ScenarioError: it cannot be used; with every problem.
    """
    kind, source = locate(name_or_path)
    if kind == "trial":
        from scenarios.reader import load

        return _of_trial(load(name_or_path), source)
    return _of_whole(kind, source.name, source.text, read_whole(kind, source))


def contents_of_text(kind: str, name: str, text: str) -> Contents:
    """Return the contents of a vehicle or a cable that is not written yet; nothing is.

    Raises:
        ScenarioError: with all its problems.
    """
    part, problems = part_of(parsed(name, Path(), text), kind)
    if problems:
        raise ScenarioError(problems)
    return _of_whole(kind, name, text, part)


def _of_whole(kind: str, name: str, text: str, part: Part) -> Contents:
    """Return the contents of a vehicle or a cable."""
    said = first_sentence(text)
    return Contents(kind=kind, name=name, description=said, numbers=tuple(_of_part(kind, part)), parts={})


def read_whole(kind: str, source: Source) -> Part:
    """Return the vehicle or cable in a file.

    Raises:
        ScenarioError: with all its problems.
    """
    name = source.name if source.name.endswith(".toml") else shipped_path(PATTERNS[kind][0], source.name)
    here = Source(name=source.name, folder=Path(), text="", table={}, lines={})
    part, problems = read_part(here, kind, str(name))
    if problems:
        raise ScenarioError(problems)
    return part


def _of_part(kind: str, part: Part) -> Iterator[Number]:
    """Return the numbers of a vehicle or a cable, with the range and the source that its file gives."""
    above = "vehicle." if kind == "vehicle" else ""
    given = dict(leaves(part.source.table if part.source else {}))
    left_out: dict[str, Any] = {
        key: {"value": value, "unit": unit_of(kind, key), "source": "convention: it is left out in the file"}
        for key, value in part.values.items()
        if key not in given
    }
    whole = given | left_out
    sections = list(dict.fromkeys(key.rpartition(".")[0] for key in whole))
    for key, leaf in sorted(whole.items(), key=lambda row: sections.index(row[0].rpartition(".")[0])):
        low, high = leaf.get("range", (float("nan"), float("nan")))
        yield Number(
            name=f"{above}{key}",
            values=(float(leaf["value"]),),
            unit=str(leaf.get("unit", "")),
            low=float(low),
            high=float(high),
            source=str(leaf.get("source", "")),
            origin=origin_of(str(leaf.get("source", ""))),
        )


def _of_trial(trial: Trial, source: Source) -> Contents:
    """Return the numbers of a trial that are not in another file, and those of other files that it changes."""
    changes, _ = read_changes(source)
    numbers = []
    for name, (row, values) in known_numbers(trial).items():
        if isinstance(row, Quantity):
            unit, low, high, words = row.unit, row.low, row.high, row.meaning
        elif name in changes:
            low, high = row.get("range", (float("nan"), float("nan")))
            unit, words = str(row["unit"]), "changed by this trial"
        else:
            continue
        found, low, high = tuple(float(value) for value in values), float(low), float(high)
        numbers.append(Number(name=name, values=found, unit=unit, low=low, high=high, source=words))
    parts = {kind: str(source.table[kind]) for kind in ("vehicle", "cable")}
    return Contents(
        kind="trial", name=trial.name, description=trial.description, numbers=tuple(numbers), parts=parts
    )
