"""The file that keeps members' results: SQLite, so that a kill at any moment costs at most those not written yet.

Members come in batches, each in one transaction: it is in the file as a whole, or not at all. A member's number is the
key of its row, so none can be in it twice. The file of a sweep that is running is locked; another command with it is
refused. A manifest says what the members belong to: a sweep that differs in anything that could change a number is
refused, with what differs.

Why SQLite: of what was measured (`python -m benchmarks.sweep --stores`), it alone takes single members at any time
without leaving half a file behind, and it is in every Python.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from subzero.errors import UserError, printable
from subzero.sweeps.member import Member

FILE = "members.sqlite"

TABLES = """
CREATE TABLE IF NOT EXISTS manifest (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS members (
    member INTEGER PRIMARY KEY, reason TEXT NOT NULL, warnings TEXT NOT NULL, own TEXT NOT NULL,
    scalars BLOB NOT NULL, channels BLOB NOT NULL, seconds REAL NOT NULL, refinement_share REAL NOT NULL,
    digest BLOB NOT NULL
);
"""
COLUMNS = "member, reason, warnings, own, scalars, channels, seconds, refinement_share"
"""Of a row, in the order of its digest, which follows them."""
BLOCK = 512
"""So many members are read at a time. [-]"""


class Store:
    """The members of one sweep that are finished; `opened` gives one.

    Args:
        connection: to the file.
        path: of the file.
        shape: channels and times of a member.
    """

    def __init__(self, connection: sqlite3.Connection, path: Path, shape: tuple[int, int]) -> None:
        self._file, self.path, self._shape = connection, path, shape

    def finished(self, members: int) -> np.ndarray:
        """Return which of so many members are finished (members,); damaged rows are taken out, to be run again."""
        done, damaged = np.zeros(members, dtype=bool), []
        with _reported(self.path), self._file:
            for *row, digest in self._file.execute(f"SELECT {COLUMNS}, digest FROM members"):
                if digest == _digest(row) and row[0] < members:
                    done[row[0]] = True
                else:
                    damaged.append(row[:1])
            self._file.execute("BEGIN")
            self._file.executemany("DELETE FROM members WHERE member = ?", damaged)
        return done

    def add(self, members: Iterable[Member]) -> None:
        """Keep some members: all of them or none.

        Raises:
            UserError: the disk takes no more; what was kept before is still there.
        """
        rows = [
            (
                int(member.index),
                member.reason,
                json.dumps(member.warnings) if member.warnings else "",
                json.dumps(member.own) if member.own else "",
                member.scalars.tobytes(),
                b"" if member.reason else member.channels.tobytes(),
                float(member.seconds),
                float(member.refinement_share),
            )
            for member in members
        ]
        with _reported(self.path), self._file:
            self._file.execute("BEGIN")
            self._file.executemany(
                f"INSERT OR IGNORE INTO members ({COLUMNS}, digest) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [(*row, _digest(row)) for row in rows],
            )

    def forget_failed(self) -> int:
        """Take out the members that failed, so that they are run again; return how many."""
        with _reported(self.path), self._file:
            self._file.execute("BEGIN")
            return self._file.execute("DELETE FROM members WHERE reason != ''").rowcount

    def blocks(self) -> Iterator[list[Member]]:
        """Give all members in their order, some at a time."""
        last = -1
        while True:
            with _reported(self.path):
                rows = self._file.execute(
                    f"SELECT {COLUMNS} FROM members WHERE member > ? ORDER BY member LIMIT {BLOCK}", (last,)
                ).fetchall()
            if not rows:
                return
            last = rows[-1][0]
            yield [self._member(row) for row in rows]

    def failures(self) -> int:
        """Return how many members have failed."""
        with _reported(self.path):
            return int(self._file.execute("SELECT count(*) FROM members WHERE reason != ''").fetchone()[0])

    def reasons(self, most: int) -> list[tuple[int, str]]:
        """Return the first members that failed, and why."""
        with _reported(self.path):
            return self._file.execute(
                f"SELECT member, reason FROM members WHERE reason != '' ORDER BY member LIMIT {most}"
            ).fetchall()

    def _member(self, row: Any) -> Member:
        member, reason, warned, own, scalars, channels, seconds, refinement_share = row
        shown = (
            np.frombuffer(channels, dtype=np.float32)
            if channels
            else np.full(self._shape, np.nan, np.float32)
        )
        return Member(
            index=member,
            reason=reason,
            warnings=tuple((check, message) for check, message in json.loads(warned or "[]")),
            scalars=np.frombuffer(scalars, dtype=float),
            channels=shown.reshape(self._shape),
            own=json.loads(own or "{}"),
            seconds=seconds,
            refinement_share=refinement_share,
        )


def _digest(row: Sequence[Any]) -> bytes:
    """Return the SHA-256 of a row: kinds, lengths and values."""
    found = hashlib.sha256()
    for value in row:
        data = value if isinstance(value, bytes) else repr(value).encode()
        found.update(f"{type(value).__name__} {len(data)} ".encode() + data)
    return found.digest()


@contextmanager
def opened(folder: Path, manifest: Mapping[str, str], shape: tuple[int, int]) -> Iterator[Store]:
    """Give the store of a sweep in a folder, a new one or that of the same sweep.

    Args:
        folder: where it is, or will be.
        manifest: the settings that the members belong to: name → its digest or text.
        shape: channels and times of a member.

    Raises:
        UserError: it holds another sweep, another command has it, it cannot be written.
    """
    path = folder / FILE
    with _reported(path):
        folder.mkdir(parents=True, exist_ok=True)
        connection = sqlite3.connect(path, isolation_level=None, timeout=1.0)
    try:
        with _reported(path):
            connection.execute(
                "PRAGMA locking_mode = EXCLUSIVE"
            )  # before WAL: then no memory is shared, on any disk
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = NORMAL")
            connection.text_factory = lambda data: data.decode(
                "utf-8", "replace"
            )  # a damaged text fails its digest
            _check(connection)
            connection.executescript(TABLES)
            known = dict(connection.execute("SELECT key, value FROM manifest"))
        _refuse_another(path, known, manifest)
        with _reported(path), connection:
            connection.execute("BEGIN IMMEDIATE")
            connection.executemany("INSERT OR IGNORE INTO manifest VALUES (?, ?)", manifest.items())
        yield Store(connection, path, shape)
    finally:
        connection.close()


def _check(connection: sqlite3.Connection) -> None:
    """Raise an error for a file whose pages do not fit together, before any of them is used."""
    (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if found != "ok":
        raise sqlite3.DatabaseError(" ".join(str(found).split()))


def _refuse_another(path: Path, known: Mapping[str, str], wanted: Mapping[str, str]) -> None:
    """Raise an error for a file whose members belong to another sweep."""
    differ = [key for key in wanted if known and known.get(key) != wanted[key]]
    if differ:
        raise UserError(
            f"{printable(str(path.parent))} holds members of another sweep: its {', '.join(differ)}"
            f" {'differ' if len(differ) > 1 else 'differs'}. Give another folder with --out DIR, or remove it to begin"
            " anew."
        )


@contextmanager
def _reported(path: Path) -> Iterator[None]:
    """Turn a refusal of the disk, or of SQLite, into a clean message."""
    name = printable(str(path))
    try:
        yield
    except sqlite3.OperationalError as error:
        if "locked" in str(error):
            why = "another command is running this sweep"
            remedy = "Wait for it, or give another folder with --out DIR"
        elif error.sqlite_errorcode & 0xFF in (
            sqlite3.SQLITE_FULL,
            sqlite3.SQLITE_IOERR,
            sqlite3.SQLITE_READONLY,
        ):
            why = str(error)
            remedy = "What it has is kept: make room, and run the same command again"
        else:
            why, remedy = f"it is damaged ({error})", "Remove it, or give another folder with --out DIR"
        raise UserError(f"{name}: {why}. {remedy}.") from error
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise UserError(
            f"{name} is no store of a sweep ({error}). Remove it, or give another folder with --out DIR."
        ) from error
    except OSError as error:
        raise UserError(
            f"{name} cannot be written: {error.strerror}. Give another folder with --out DIR."
        ) from error
