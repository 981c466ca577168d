"""Find, open and parse the files of a scenario, and say where in them a key stands.

Shipped files are named by a word (``fig6``), the user's by a path; a path that a file mentions is relative to
the folder of that file.
"""

from __future__ import annotations

import os
import re
import tomllib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from scenarios.errors import Problem, ScenarioError, nearest, nearest_or_all
from subzero.errors import printable
from subzero.errors import short as shown
from subzero.files import read_file
from subzero.files.read_file import MOST_OF_A_TOML, UnreadableFileError

ROOT = Path(__file__).parent

MOST_LEVELS = 16
"""Tables deeper than this inside one another are refused, so that no walk through them runs out of stack."""

MOST_KEYS = 5000
"""A vehicle has some hundred numbers with four keys each; of every unknown key the nearest known one is looked for."""

LONGEST_KEY = 500
"""So much of a line is looked at to find its key. [characters]"""

LONG_KEY = re.compile(r"""(?<![\w.\-"'])(?:(?:[\w\-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){32}""")
"""A key of so many names would keep the TOML parser busy for a time that grows with their square."""

HEADER = re.compile(r"""\s*\[\s*([^\[\]]+?)\s*\]""")
KEY = re.compile(r"""\s*("[^"]*"|'[^']*'|[\w.\-]+)\s*=""")
AT = re.compile(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)$")


@dataclass(frozen=True, kw_only=True, eq=False)
class Source:
    """A parsed TOML file that can say on which line a key stands; the same text gives the same object again.

    Attributes:
        name: the file as the user named it.
        folder: folder that holds it, from which its own paths start.
        text: its text.
        table: the same, parsed; not to be changed, as it is kept for the next reader.
        lines: dotted key → line, from 1.
    """

    name: str
    folder: Path
    text: str
    table: dict[str, Any]
    lines: dict[str, int] = field(repr=False)

    def line(self, key: str) -> int | None:
        """Return the line of a key such as ``commands.rudder_deg[3]``, or that of its section."""
        key = key.partition("[")[0]
        while key and key not in self.lines:
            key = key.rpartition(".")[0]
        return self.lines.get(key)

    def problem(self, key: str, why: str, remedy: str = "", *, found: object = None) -> Problem:
        """Return a problem of this file, with the line of its key."""
        text = "" if found is None else shown(found)
        return Problem(file=self.name, line=self.line(key), key=key, found=text, why=why, remedy=remedy)


def shipped(kind: str) -> list[str]:
    """Return the names of the shipped ``trials``, ``vehicles`` or ``cables``, in alphabetical order."""
    return sorted(path.stem for path in (ROOT / kind).glob("*.toml"))


def shipped_path(kind: str, name: str) -> Path:
    """Return where a shipped file lies."""
    return ROOT / kind / f"{name}.toml"


def find(name_or_path: str | Path) -> Source:
    """Return the trial file of a shipped scenario or of a path.

    Raises:
        ScenarioError: there is none, or it is not TOML.
    """
    named = str(name_or_path)
    if named in shipped("trials"):
        return read_toml(shipped_path("trials", named), named)
    path = Path(named)
    if named and (path.suffix == ".toml" or len(path.parts) > 1 or os.path.exists(named)):
        return read_toml(path, named)
    remedy = nearest_or_all(named, shipped("trials")) + " Or give the path of a TOML file."
    raise ScenarioError(
        [Problem(file=printable(named) or "''", why="there is no such scenario", remedy=remedy)]
    )


def read_text(path: Path, name: str, most: int = MOST_OF_A_TOML) -> str:
    """Return the text of a file, for any line ends; `name` is its name in messages.

    Raises:
        ScenarioError: it is not there, is no plain file, holds more than `most` bytes, cannot be read, or is not text.
    """
    try:
        return read_file.read_text(path, most).replace("\r\n", "\n")
    except UnreadableFileError as error:
        remedy = _neighbour(path) if error.is_missing else error.remedy
        problem = Problem(file=printable(name), why=error.why, remedy=remedy)
    raise ScenarioError([problem])


def _neighbour(path: Path) -> str:
    """Return a hint at a file in the same folder with nearly the same name."""
    try:
        names = {near.stem: near.name for near in path.parent.iterdir() if near.suffix == path.suffix}
    except OSError:
        return "Its folder does not exist either: check the path."
    close = nearest(path.stem, names)
    return f"Did you mean '{printable(names[close])}'?" if close else "Check the path."


def read_toml(path: Path, name: str) -> Source:
    """Read a TOML file.

    Raises:
        ScenarioError: it cannot be read, or is not TOML; with line and column.
    """
    return parsed(printable(name), path.parent, read_text(path, name))


@lru_cache(maxsize=8)
def parsed(name: str, folder: Path, text: str) -> Source:
    """Return a TOML file with this text, one of the last few that were read: a trial read again is parsed once."""
    if LONG_KEY.search(text):
        why = f"it has a key of more than {2 * MOST_LEVELS} names with dots between"
        raise ScenarioError([Problem(file=name, why=why, remedy="Two names are enough.")])
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ScenarioError([_syntax_problem(name, text, str(error))]) from None
    if _is_deep(table):
        why = f"it has tables inside tables more than {MOST_LEVELS} levels deep"
        raise ScenarioError([Problem(file=name, why=why, remedy="Remove them; two levels are enough.")])
    if _keys(table) > MOST_KEYS:
        why = f"it has more than {MOST_KEYS} keys"
        raise ScenarioError([Problem(file=name, why=why, remedy="Remove those that say nothing here.")])
    return Source(name=name, folder=folder, text=text, table=table, lines=_key_lines(text))


def _is_deep(table: dict[str, Any]) -> bool:
    """Return whether a file is nested deeper than any of ours has reason to be."""
    level: list[Any] = [table]
    for _ in range(MOST_LEVELS):
        inside = [each for thing in level for each in (thing.values() if isinstance(thing, dict) else thing)]
        level = [each for each in inside if isinstance(each, dict | list)]
    return bool(level)


def _keys(thing: Any) -> int:
    """Return how many keys a file has; tables in a list count too."""
    if isinstance(thing, dict):
        return len(thing) + sum(map(_keys, thing.values()))
    return sum(map(_keys, thing)) if isinstance(thing, list) else 0


def _syntax_problem(name: str, text: str, message: str) -> Problem:
    """Return the problem that the TOML parser met, with the line it stands on."""
    at = AT.search(message)
    lines = text.split("\n")
    line = int(at[1]) if at and at[1] else len(lines)
    column = f", at column {at[2]}" if at and at[2] else ""
    return Problem(
        file=name,
        line=line,
        found=shown(lines[line - 1].strip()),
        why=f"this is not valid TOML{column}: {AT.sub('', message)}",
        remedy="Write one 'key = value' a line, text in double quotes, lists as [1, 2, 3].",
    )


def _key_lines(text: str) -> dict[str, int]:
    """Return dotted key → line, from 1, of each key at the start of a line; good enough for a message."""
    lines: dict[str, int] = {}
    section = ""
    for number, whole in enumerate(text.split("\n"), start=1):
        line = whole[:LONGEST_KEY]  # a pattern may look at each of n blanks n times
        if header := HEADER.match(line):
            section = header[1] + "."
            lines.setdefault(header[1], number)
        elif key := KEY.match(line):
            lines.setdefault(section + key[1].strip("\"'"), number)
    return lines
