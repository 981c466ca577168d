"""Read a file that a user names: never more than it may hold, never for ever, never half of a result.

Every reader of scenarios, records, sidecars, models and answers opens its file here. What is no plain file (a folder,
a device, a pipe, a socket) is refused before it is opened, so that no read waits for somebody else. A file that is
larger than anything of its kind has reason to be is refused before it fills the memory. And a result of ours whose
folder was left in the middle of a write (`subzero.files.atomic_output`) is refused, because its neighbours may be
of another run. What a file says is shown to people through `errors.printable`.
"""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path

from subzero.errors import UserError, printable

MEGABYTE = 1 << 20
"""[byte]"""

MOST_OF_A_TOML = 4 * MEGABYTE
"""A trial with 50 000 switch points has 2 MB; the parser takes about a second for each of them. [byte]"""

MOST_OF_A_CSV = 128 * MEGABYTE
"""A day of 15 channels at 10 Hz; cells as text take about ten times as much memory. [byte]"""

MOST_OF_AN_ANSWER = MEGABYTE
"""A sealed answer has 2 kB, and 8 kB unpacked. [byte]"""

MOST_OF_A_PROGRAM = MEGABYTE
"""No autopilot or list of effects has a thousand pages. [byte]"""

MOST_COLUMNS = 1000
"""Of a table; a run has fifty channels. Of every unknown column the nearest known one is looked for."""

INCOMPLETE = "incomplete-subzero.json"
"""Stands in an output folder as long as files are replaced in it: their names."""


class UnreadableFileError(UserError):
    """A file that cannot be read.

    Attributes:
        why: the problem with it, the end of a sentence.
        remedy: the remedy, a sentence.
        is_missing: there is none.
    """

    def __init__(self, name: str, why: str, remedy: str, *, is_missing: bool = False) -> None:
        """Keep the parts, for readers that say them in their own words."""
        super().__init__(f"{printable(name)}: {why}. {remedy}".rstrip())
        self.why, self.remedy, self.is_missing = why, remedy, is_missing


def read_text(path: str | Path, most: int) -> str:
    """Return the text of a file in UTF-8, with or without its mark, line ends as they are.

    Args:
        path: the file.
        most: how large it may be. [byte]

    Raises:
        UnreadableFileError: there is none, it is no plain file, it is too large, cannot be read, or is no text.
    """
    data = read_bytes(path, most)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        why, remedy = "this is not a text file in UTF-8", "Save it as plain text, encoding UTF-8."
    raise UnreadableFileError(str(path), why, remedy)


def read_bytes(path: str | Path, most: int) -> bytes:
    """Return the contents of a plain file of at most `most` bytes.

    Raises:
        UnreadableFileError: as `read_text`.
    """
    data = _begin(path, most + 1)
    if len(data) > most:
        why = f"it is larger than {most // MEGABYTE} MB, the most that is read"
        raise UnreadableFileError(str(path), why, "Leave out what is not needed, or split it.")
    return data


def check_readable(path: str | Path) -> None:
    """Raise an error for a file that cannot be read, for formats that a library opens itself.

    Raises:
        UnreadableFileError: as `read_text`; of any size.
    """
    _begin(path, 1)


def _begin(path: str | Path, count: int) -> bytes:
    """Return the first bytes of a plain file that holds one result."""
    data, is_missing = None, False
    try:
        data = _first_bytes(Path(path), count)
        why, remedy = (
            "this is a device, a pipe or a socket, not a file",
            "Save what it gives to a file first.",
        )
    except FileNotFoundError:
        why, remedy, is_missing = "there is no such file", "Check the path.", True
    except IsADirectoryError:
        why, remedy = "this is a folder, not a file", "Name a file in it."
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        why, remedy = f"it cannot be read ({reason})", "Name a file that you may read."
    if data is None:
        raise UnreadableFileError(str(path), why, remedy, is_missing=is_missing)
    _refuse_half_written(Path(path))
    return data


def _first_bytes(path: Path, count: int) -> bytes | None:
    """Return the first bytes of a plain file; None if it is something that may never end or never begin."""
    if (mode := os.stat(path).st_mode) and stat.S_ISDIR(mode):
        raise IsADirectoryError
    if not stat.S_ISREG(mode):
        return None
    # What stands there may have been replaced since: opening never waits, and what was opened is looked at again.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with open(handle, "rb") as file:
        return file.read(count) if stat.S_ISREG(os.fstat(handle).st_mode) else None


def _refuse_half_written(path: Path) -> None:
    """Raise an error for a result whose folder holds files of two runs."""
    if path.name in interrupted_files(path.parent):
        why = f"a command was killed while it wrote {printable(str(path.parent))}: its files are of two runs"
        remedy = (
            f"Run the command again with --out {printable(str(path.parent))}; if the files are your own, remove"
            f" {INCOMPLETE} there."
        )
        raise UnreadableFileError(str(path), why, remedy)


def interrupted_files(folder: Path) -> frozenset[str]:
    """Return the names of the results in a folder that may be old or new after an interruption; none if all is
    well.
    """
    marker = folder / INCOMPLETE
    if not os.path.lexists(marker):
        return frozenset()
    try:
        data = _first_bytes(marker, MEGABYTE)
        names = json.loads(data or b"")["files"]
        return frozenset(name for name in names if isinstance(name, str))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        # A damaged marker still says that something was interrupted here.
        return frozenset(_names_in(folder))


def _names_in(folder: Path) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:
        return []


def make_toml(path: Path, text: str) -> None:
    """Make a TOML file that is not there yet; one that exists is left alone.

    Raises:
        UserError: its name ends otherwise, it exists, or it cannot be made.
    """
    where = printable(str(path))
    if path.suffix != ".toml":
        raise UserError(f"{where} must end in .toml, such as {printable(path.stem or 'my_trial')}.toml.")
    try:
        with open(path, "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise UserError(f"{where} exists and is left alone. Give another name.") from None
    except OSError as error:
        raise UserError(
            f"{where} cannot be made: {error.strerror}. Give a path that you may write."
        ) from None
