"""Keep machine code for the next run: never stale, never damaged, never anybody else's, and never needed.

What is kept of one function for one kind of arguments is a file. It lies in a folder named by a digest of all sources
that it is made of (`subzero.jit.sources`), of the versions of the compiler and of its settings, so whatever changes
starts a new folder. In front of the code stands a digest of it: a file that was cut, zeroed or has a flipped bit is
not loaded but made anew. A file appears by one renaming, so neither an interrupt nor a second process spoils it.

Such code is run as it is. So only folders and files are used that belong to this user (or to root) and that nobody
else may write. Where nothing can be kept, code is compiled for the one process; a line on standard error says so.

Folders: ``SUBZERO_CACHE_DIR``, else ``XDG_CACHE_HOME/subzero``, else ``~/.cache/subzero``; in it ``cable-<digest>``
and so on. Folders that are long out of use are removed, if nothing else lies in them.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import re
import stat
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature

from subzero.errors import printable
from subzero.jit.beside import is_delivered, made_by_second, tell_first
from subzero.jit.sources import PACKAGES, Tree
from subzero.jit.unbroken import heed

MARK = b"subzero machine code 1\n"
"""A file begins with this, then the digest of its name and of the rest."""

CODE, HALF, FORMER = ".code", ".half", (".nbi", ".nbc")
"""How names of files end: whole ones, those that are being written, those of former versions."""

OTHERS = "others"
"""Functions outside `PACKAGES` (tests, a user's own) have folders of this name."""

ANEW = "This run compiles what it needs and forgets it (up to a minute)."
ANOTHER = "Give another folder with SUBZERO_CACHE_DIR."
OF_YOUR_OWN = "Give a folder of your own with SUBZERO_CACHE_DIR, or keep others out of this one (chmod go-w)."

DAY_S = 86400.0
OUT_OF_USE_S, KEPT = 30 * DAY_S, 8
"""A folder is removed that was not used for so long [s], or for a day if so many of its package are newer."""

SAFELY = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY"))
"""How a file is opened that may be anything, as far as the system has such flags."""

_OUR_FOLDER = re.compile(rf"({'|'.join((*PACKAGES, OTHERS))})-[0-9a-f]{{12}}")
_NO_MATTER = re.compile("CACHE|THREAD|CUDA|GDB_BINARY|COLOR|SHOW_HELP|HAVE_YAML")
"""Settings of numba that change with the machine, the terminal or what else is installed, and never the code."""


class Home:
    """A folder of machine code, which may not be there, or not be ours to use.

    Args:
        base: the folder that it is in; None if there is none.
        name: its own name.
        is_current: says whether the sources are still those that it is named by.
    """

    def __init__(self, base: Path | None, name: str, is_current: Callable[[], bool]) -> None:
        self._base = base
        self.path = base / name if base else None
        self._is_current = is_current
        self._keeps = True
        self._trusted: bool | None = None

    def read(self, name: str) -> bytes | None:
        """Return the code in a file; None if it has none that can be used."""
        if self.path is None or not self._is_trusted():
            return None
        path = self.path / name
        try:
            data = _own_bytes(path)
        except OSError:  # none, or none that can be read; if it cannot be replaced either, `keep` says so
            return None
        start = len(MARK) + hashlib.sha256().digest_size
        if data[:start] != MARK + _digest(name, data[start:]):
            tell("damaged", f"Compiled code was damaged ({printable(str(path))}); compiling it anew.")
            return None
        return data[start:]

    def keep(self, name: str, code: bytes) -> None:
        """Put code into a file, as far as that is possible."""
        if not self._keeps or not self._is_current():
            return
        try:
            self._write(name, MARK + _digest(name, code) + code)
        except OSError as error:
            self._keeps = False
            if self._is_trusted():
                where, why = printable(str(self._base or "a home folder")), error.strerror or error
                tell("not kept", f"Compiled code cannot be kept in {where}: {why}. {ANOTHER} {ANEW}")

    def made(self) -> Path | None:
        """Return the folder, which is made if it is not there; None where nothing can be kept."""
        try:
            return self._made()
        except OSError:  # `keep` says so
            return None

    def _made(self) -> Path:
        """Return the folder, which is made if it is not there.

        Raises:
            OSError: nothing can be kept.
        """
        if self._base is None or self.path is None:
            raise FileNotFoundError(0, "this user has none")
        if not self.path.is_dir():
            _make(self.path)
            self._trusted = None
            if self._is_trusted():
                sweep(self._base, self.path.name)
        if not self._is_trusted():
            raise PermissionError(0, "others may write there")
        return self.path

    def _write(self, name: str, data: bytes) -> None:
        """Let a file appear with this in it."""
        folder = self._made()
        handle, half = tempfile.mkstemp(suffix=HALF, dir=folder)
        try:
            with open(handle, "wb") as file:
                file.write(data)
            os.replace(half, folder / name)
        except BaseException:
            with suppress(OSError):
                os.unlink(half)
            raise

    def _is_trusted(self) -> bool:
        """Say whether the folder may be used, and look at it once."""
        if self._trusted is None:
            self._trusted = self._looked_at()
        return self._trusted

    def _looked_at(self) -> bool:
        """Say whether the folder may be used, as far as it is there; mark it as in use."""
        for folder in (self._base, self.path):
            if folder is None:
                return True
            try:
                about = folder.stat() if folder is self._base else folder.lstat()
            except OSError:
                return True  # there is none, which a write finds out
            why = _distrust(about)
            if why:
                where = printable(str(folder))
                tell("not trusted", f"Compiled code in {where} is not used, for {why}. {OF_YOUR_OWN} {ANEW}")
                return False
        with suppress(OSError):
            os.utime(self.path or "")
        return True


def _digest(name: str, code: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\n" + code).digest()


def _distrust(about: os.stat_result) -> str:
    """Return why somebody else could have put code into a folder or file; empty if nobody could."""
    if not (stat.S_ISDIR(about.st_mode) or stat.S_ISREG(about.st_mode)):
        return "it is no folder"
    if not hasattr(os, "geteuid"):  # Windows: a home folder has access rules of its own
        return ""
    if about.st_uid not in (0, os.geteuid()):
        return f"it belongs to another user (number {about.st_uid})"
    return "others may write there" if about.st_mode & (stat.S_IWGRP | stat.S_IWOTH) else ""


def _own_bytes(path: Path) -> bytes:
    """Return what is in a file; nothing of one that others can have written."""
    handle = os.open(path, os.O_RDONLY | SAFELY)
    with open(handle, "rb") as file:
        about = os.fstat(handle)
        return b"" if _distrust(about) or not stat.S_ISREG(about.st_mode) else file.read()


def _make(folder: Path) -> None:
    """Make a folder that only this user may enter, and those above that are missing."""
    if not folder.is_dir():
        if os.path.lexists(folder):
            raise NotADirectoryError(0, f"{printable(str(folder))} is no folder")
        _make(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)


def sweep(base: Path, used: str) -> None:
    """Remove folders of machine code that are out of use; only our own files, and folders that are empty then.

    Args:
        base: the folder that they are in.
        used: name of the one that stays in any case.
    """
    now = time.time()
    ages: dict[str, list[tuple[float, str]]] = {}
    with suppress(OSError):
        for entry in os.scandir(base):
            about = entry.stat(follow_symlinks=False)
            kind = _OUR_FOLDER.fullmatch(entry.name)
            if kind and stat.S_ISDIR(about.st_mode) and not _distrust(about) and entry.name != used:
                ages.setdefault(kind[1], []).append((now - about.st_mtime, entry.path))
    for of_a_package in ages.values():
        for rank, (age, path) in enumerate(sorted(of_a_package), start=1):
            if age > OUT_OF_USE_S or (rank >= KEPT and age > DAY_S):
                _remove(path)


def _remove(folder: str) -> None:
    for path, _, names in os.walk(folder, topdown=False):
        for name in names:
            if name.endswith((CODE, HALF, *FORMER)):
                with suppress(OSError):
                    os.unlink(os.path.join(path, name))
        with suppress(OSError):
            os.rmdir(path)


def base_folder() -> Path | None:
    """Return the folder that all machine code is kept in; None if this user has no home."""
    chosen = os.environ.get("SUBZERO_CACHE_DIR")
    if chosen:
        return Path(chosen).absolute()
    general = os.environ.get("XDG_CACHE_HOME", "")
    if os.path.isabs(general):
        return Path(general, "subzero")
    try:
        return Path.home() / ".cache" / "subzero"
    except RuntimeError:  # no HOME, and a user that nobody knows
        return None


def compiler() -> str:
    """Return what machine code depends on besides its sources and the processor: versions and settings."""
    versions = (sys.version, np.__version__, numba.__version__, llvmlite.__version__)
    settings = {
        name: value
        for name, value in vars(numba.config).items()
        if name.isupper() and isinstance(value, (int, float, str, type(None))) and not _NO_MATTER.search(name)
    }
    return repr((versions, sorted((name, str(value)) for name, value in settings.items())))


_tree = Tree()


@cache
def home_of(package: str, file: Path | None = None) -> Home:
    """Return the folder of the machine code of a package of ours, or of a file outside."""
    tree = _tree
    files = tree.made_of(package, file)
    digest = tree.digest(files, compiler())
    return Home(base_folder(), f"{package}-{digest}", lambda: tree.are_as_read(files))


def _home_for(function: Any) -> Home:
    """Return the folder for a function; one that keeps nothing for what was typed in and stands in no file."""
    package = function.__module__.partition(".")[0]
    if package in PACKAGES:
        return home_of(package)
    file = Path(function.__code__.co_filename)
    return home_of(OTHERS, file.absolute()) if file.is_file() else Home(None, OTHERS, lambda: False)


class MachineCode(_Cache):  # type: ignore[misc]  # numba has no types
    """What numba asks for the machine code of a function, and gives it to.

    Args:
        function: as it is written in Python.
    """

    def __init__(self, function: Any) -> None:
        self._function = function
        self._home = _home_for(function)

    @property
    def cache_path(self) -> str | None:
        """Return the folder, for numba's statistics."""
        return str(self._home.path)

    def file_for(self, sig: Any) -> Path | None:
        """Return the file of the code for a signature, in a folder that is there; None where nothing is kept."""
        folder = self._home.made()
        if folder is None:
            return None
        return folder / self._name(sig, cpu_target.target_context.codegen())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was kept for a signature; None if it has to be compiled."""
        heed()
        # What kept code calls. What a compiler looks up besides, and takes a quarter of a second to import, it looks
        # up itself.
        rtsys.initialize(target_context)
        name = self._name(sig, target_context.codegen())
        code = self._home.read(name)
        if code is None and self._home.path is not None and is_delivered(self._home.path / name, heed):
            code = self._home.read(name)
        if code is not None:
            found = CompileResult._rebuild(target_context, *pickle.loads(code))
            if found.signature.args == tuple(normalize_signature(sig)[0]):
                return found
        _say_compiling()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Count what was compiled for a signature, and keep it; not what holds addresses of this process."""
        _made[0] += 1
        tell_first()
        if self._function.__closure__ is None and not data.lifted and not data.library.has_dynamic_globals:
            self._home.keep(self._name(sig, data.codegen), dumps(data._reduce()))

    def _name(self, sig: Any, codegen: Any) -> str:
        """Return the name of a file: of the function, for these arguments, on this processor."""
        function = self._function
        what = (function.__module__, function.__qualname__, function.__code__.co_firstlineno)
        digest = hashlib.sha256(repr((what, str(sig), codegen.magic_tuple())).encode()).hexdigest()
        return f"{re.sub('[^A-Za-z0-9_.]', '', f'{what[0]}.{what[1]}')[-100:]}-{digest[:24]}{CODE}"

    def enable(self) -> None:
        """Do nothing: it is always so."""

    def disable(self) -> None:
        """Do nothing: who wants no cache compiles without this."""

    def flush(self) -> None:
        """Do nothing: what the sources do not say any more is never found again."""


COMPILING = "compiling"

counting = [False]
"""Whether a line with the number of compiled functions stands open on standard error, and has to be ended first."""
_made = [0]
"""How many functions this process has compiled."""


def made() -> int:
    """Return how many functions this process and its second one have compiled so far."""
    return _made[0] + made_by_second()


_told: set[str] = set()
_announcements: list[Callable[[], None]] = []


def before_compiling(announce: Callable[[], None]) -> None:
    """Have something said, once, when something has to be compiled."""
    if COMPILING not in _told:
        _announcements[:] = [announce]


def _say_compiling() -> None:
    while _announcements:
        _told.add(COMPILING)
        _announcements.pop()()


def tell(kind: str, line: str) -> None:
    """Say a line on standard error; of each kind only the first."""
    if kind not in _told:
        _told.add(kind)
        with suppress(OSError, ValueError):  # nobody reads it any more
            print("\n" * counting[0] + line, file=sys.stderr, flush=True)
