"""Keep compiled code for the next run: never of other sources, never damaged, never writable by another user.

The code of one function for one kind of arguments is a file. Its folder is named by a digest of all sources that
compiled code may be made of (`sources_of`), of the compiler's version and of its settings; whatever changes starts a
new folder. A digest in front of the code finds files that were cut or changed: their code is compiled again. Where
nothing can be kept, code is compiled for the one process, and a line on standard error says so.

Folders: ``SUBZERO_CACHE_DIR``, else ``XDG_CACHE_HOME/subzero``, else ``~/.cache/subzero``; in it ``code-<digest>``.
"""

from __future__ import annotations

import hashlib
import os
import pickle
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
from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature

from subzero.errors import printable
from subzero.jit.parallel import wait_for
from subzero.jit.signals import deliver_pending

SUFFIX = ".code"
UNUSED_S = 30 * 86400.0
"""Code that no process has used for so long is removed when a new folder is made. [s]"""
ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("cable", "vehicle", "scenarios", "subzero")
CORE = (
    "cable",
    "vehicle",
    "scenarios",
    "subzero/jit",
    "subzero/engine",
    "subzero/steady_motion",
    "subzero/validity",
)
"""Folders whose functions and constants any compiled code may contain, with the files directly in ``subzero``."""

_announcements: list[Callable[[], None]] = []
_warned: set[str] = set()
counting = [False]
"""Whether a line with the number of compiled functions is unfinished on standard error."""
_compiled = [0]


@cache
def sources_of(package: str, file: Path | None = None) -> tuple[Path, ...]:
    """Return the files that the compiled code of a package (``cable``, ``subzero/diagnosis``) may depend on.

    The machine code of a function includes other functions and constants of the modules that it imports. By the
    import contracts these are in the function's own package or in the core.

    Args:
        package: folder of the function's package, relative to the root.
        file: of a function in no package of the product; only this file and the core count.
    """
    folders = {*CORE, package} if file is None else set(CORE)
    inside = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    return tuple(sorted({*inside, *(ROOT / "subzero").glob("*.py"), *([file] if file else [])}))


@cache
def digest_of(package: str, file: Path | None = None) -> str:
    """Return twelve hexadecimal digits that change with the sources, as `sources_of`, the compiler and its
    settings.
    """
    digest = hashlib.sha256(repr((_compiler(), package)).encode())
    for path in sources_of(package, file):
        # The name counts, too: a module that is renamed is another source.
        name = path.relative_to(ROOT) if path.is_relative_to(ROOT) else path
        digest.update(repr((str(name), path.read_bytes())).encode())
    return digest.hexdigest()[:12]


@cache
def folder_of(digest: str) -> Path | None:
    """Return the folder for code, which is created if necessary; None, with one warning, if nothing can be kept."""
    base = base_folder()
    if base is None:
        _warn("this user has no home folder")
        return None
    folder = base / f"code-{digest}"
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True, mode=0o700, exist_ok=True)
            _remove_unused(base)
        if all(map(_is_private, (base, folder))):
            with suppress(OSError):  # a folder that may be read only
                os.utime(folder)
            return folder
        _warn(f"others may write to {printable(str(folder))}, or own it")
    except OSError as error:
        _warn(f"{printable(str(base))}: {error.strerror}")
    return None


def _remove_unused(base: Path) -> None:
    """Remove code that no process has used for a month: files of this module, and folders that are empty then."""
    for folder in base.glob("code-" + "[0-9a-f]" * 12):
        with suppress(OSError):
            if (
                time.time() - folder.stat().st_mtime > UNUSED_S
                and not folder.is_symlink()
                and _is_private(folder)
            ):
                for file in folder.glob(f"*{SUFFIX}"):
                    file.unlink()
                folder.rmdir()


def base_folder() -> Path | None:
    """Return the folder of all compiled code; None if this user has no home."""
    if chosen := os.environ.get("SUBZERO_CACHE_DIR"):
        return Path(chosen).absolute()
    if os.path.isabs(general := os.environ.get("XDG_CACHE_HOME", "")):
        return Path(general, "subzero")
    try:
        return Path.home() / ".cache" / "subzero"
    except RuntimeError:
        return None


def _is_private(folder: Path) -> bool:
    """Say whether only this user, or root, can have written code there: it is executed without further checks."""
    about = folder.stat()
    if not hasattr(os, "geteuid"):  # Windows: a home folder has access rules of its own
        return True
    return about.st_uid in (0, os.geteuid()) and not about.st_mode & 0o022


def _compiler() -> tuple[Any, ...]:
    """Return the dependencies of compiled code other than its sources and the processor."""
    # Settings of numba that do not change the machine code.
    no_matter = ("CACHE", "THREAD", "COLOR", "GDB", "CUDA")
    settings = {
        name: value
        for name, value in os.environ.items()
        if name.startswith("NUMBA_") and not any(word in name for word in no_matter)
    }
    return sys.version, np.__version__, numba.__version__, llvmlite.__version__, sorted(settings.items())


def _warn(why: str) -> None:
    """Warn on standard error, once, that compiled code cannot be kept."""
    if "kept" not in _warned:
        _warned.add("kept")
        line = f"Compiled code is not kept: {why}. Give a folder of your own with SUBZERO_CACHE_DIR."
        with suppress(OSError, ValueError):  # standard error may be closed
            print(
                "\n" * counting[0] + line + " This run compiles what it needs (up to a minute).",
                file=sys.stderr,
            )


class MachineCode:
    """The kept code of a function, with the interface of numba's own cache.

    Args:
        function: as it is written in Python.
    """

    def __init__(self, function: Any) -> None:
        self._function = function
        path = Path(function.__code__.co_filename)
        parts = path.relative_to(ROOT).parts if path.is_relative_to(ROOT) else ("",)
        if (
            parts[0] in PACKAGES
        ):  # the sources are read now: an edit from here on is not what this process has in memory
            self._digest = digest_of("/".join(parts[:-1][: 1 + (parts[0] == "subzero")]))
        else:
            self._digest = digest_of("elsewhere", path.absolute()) if path.is_file() else ""

    @property
    def cache_path(self) -> str:
        """Return the folder, for numba's statistics."""
        return str(folder_of(self._digest))

    def file_for(self, signature: Any, codegen: Any) -> Path | None:
        """Return the file of the code for a signature on this processor; None where nothing is kept."""
        function, folder = self._function, folder_of(self._digest) if self._digest else None
        if folder is None:
            return None
        # `magic_tuple` has the processor and its features: several machines may share a home folder.
        what = (function.__module__, function.__code__.co_qualname, function.__code__.co_firstlineno)
        digest = hashlib.sha256(repr((what, str(signature), codegen.magic_tuple())).encode()).hexdigest()
        return folder / f"{function.__name__[:80]}-{digest[:24]}{SUFFIX}"

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return the kept code for a signature; None if it has to be compiled."""
        deliver_pending()
        rtsys.initialize(target_context)  # the runtime that kept code calls
        file = self.file_for(signature, target_context.codegen())
        if file is not None:
            wait_for(file, deliver_pending)
            if code := _read(file):
                found = CompileResult._rebuild(target_context, *pickle.loads(code))
                # A file's name has only a digest of the signature, which might collide with that of others.
                if found.signature.args == tuple(normalize_signature(signature)[0]):
                    return found
        while _announcements:
            _announcements.pop()()
        return None

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep the compiled code for a signature; not code that contains addresses of this process."""
        _compiled[0] += 1
        file = self.file_for(signature, data.codegen)
        if (
            file
            and self._function.__closure__ is None
            and not data.lifted
            and not data.library.has_dynamic_globals
        ):
            _write(file, dumps(data._reduce()))

    def enable(self) -> None:
        """Do nothing: the cache is always enabled."""

    disable = flush = enable


def _read(file: Path) -> bytes | None:
    """Return the code in a file; None if there is none, or it is damaged."""
    try:
        data = file.read_bytes()
    except OSError:
        return None
    # The digest includes the file's name: code under another name counts as damaged.
    code = data[32:]
    return code if data[:32] == hashlib.sha256(file.name.encode() + code).digest() else None


def _write(file: Path, code: bytes) -> None:
    """Write a file with this code atomically."""
    try:
        # In the same folder, as a file can be replaced atomically only within a file system.
        handle, unfinished = tempfile.mkstemp(dir=file.parent)
        try:
            with open(handle, "wb") as out:
                out.write(hashlib.sha256(file.name.encode() + code).digest() + code)
            os.replace(unfinished, file)
        except BaseException:
            with suppress(OSError):
                os.unlink(unfinished)
            raise
    except OSError as error:
        _warn(f"{printable(str(file.parent))}: {error.strerror}")


def compiled_functions() -> int:
    """Return how many functions this process has compiled so far."""
    return _compiled[0]


def before_compiling(announce: Callable[[], None]) -> None:
    """Register a function that is called once, before the first compilation."""
    if not _compiled[0]:
        _announcements[:] = [announce]
