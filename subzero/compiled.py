"""Compile physics with numba, and keep what was compiled for the next run.

The one thing that all packages share: a decorator, `compiled`, for functions on plain floats and arrays.
Numba's on-disk cache notices an edit in the file of a function, but not in another file whose functions it
inlined. So the cache directory of a package is named by a digest of all compiled sources that the package can
see (`SEES`): any edit of those starts a new one. It lies in the user's cache directory (``SUBZERO_CACHE_DIR``
moves it), so a read-only installation works too.

Setting ``NUMBA_DISABLE_JIT=1`` runs the same code interpreted.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

import numba
import numba.extending

Function = TypeVar("Function", bound=Callable[..., Any])

numba.config.OPT = type(numba.config.OPT)(
    1
)  # LLVM's first level: compiles in 25 s instead of 27 s, and the loop runs a fifth faster

SEES = {"cable": ("cable",), "vehicle": ("vehicle",)}
"""Which packages' compiled functions a package can call; all others (subzero itself, tests) see everything."""

ALL = ("cable", "subzero", "vehicle")

SHARED = ("compiled.py", "scratch.py")
"""Files that all compiled code depends on."""


@cache
def source_digest(packages: tuple[str, ...] = ALL) -> str:
    """Return twelve hexadecimal digits that change with any edit of a compiled file of these packages."""
    root = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256(numba.__version__.encode())
    shared = [root / "subzero" / name for name in SHARED]
    for path in sorted({*shared, *(path for package in packages for path in (root / package).rglob("*.py"))}):
        source = path.read_bytes()
        if b"compiled" in source:
            digest.update(source)
    return digest.hexdigest()[:12]


@cache
def cache_directory(package: str = "subzero") -> Path:
    """Return the directory that holds the machine code of these very sources."""
    base = os.environ.get("SUBZERO_CACHE_DIR") or Path(
        os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "subzero"
    )
    return Path(base) / f"{package}-{source_digest(SEES.get(package, ALL))}"


def is_warm() -> bool:
    """Say whether the coupled loop of this very version has been compiled before on this machine."""
    return cache_directory().is_dir()


def compiled(function: Function) -> Function:
    """Compile a function of plain floats and arrays; strict IEEE arithmetic, so runs repeat to the last bit.

    It borrows the arrays that it is given: it makes none, and gives none back (`allocating` may). So nobody counts who
    holds an array, which took as long as the arithmetic: the coupled loop runs half as long again with it.

    A function whose name starts with an underscore is compiled as by `inner`.
    """
    return inner(function) if function.__name__.startswith("_") else _compile(function, gate=True)


def allocating(function: Function) -> Function:
    """Compile a function as `compiled` does, that makes arrays or gives some back."""
    return _compile(function, gate=not function.__name__.startswith("_"), makes=True)


def inner(function: Function) -> Function:
    """Compile a function that only compiled code calls: without its gate to Python it is ready sooner."""
    return _compile(function, gate=False)


def inlined(function: Function) -> Function:
    """Compile a function as a part of each that calls it: for what is done at every node.

    A call hands over a `Line` array by array, which takes longer than the arithmetic of a node.
    """
    return _compile(function, gate=False, inline=True)


def _compile(function: Function, *, gate: bool, inline: bool = False, makes: bool = False) -> Function:
    """Compile a function, and keep its machine code in the directory of its package."""
    package = function.__module__.partition(".")[0]
    numba.config.CACHE_DIR = str(cache_directory(package if package in SEES else "subzero"))
    options = {
        "cache": True,
        "error_model": "numpy",
        "nogil": True,
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": not gate,
        "forceinline": inline,
        "_nrt": makes,
    }
    return numba.njit(**options)(function)


def by_field(field: str, yes: Function, no: Function) -> Function:
    """Return a function (line, c) that is `yes` where the record c has a field, else `no`; only one is compiled.

    What few runs need so does not lengthen the first compilation of all others.
    """

    def choose(line, c):
        return (yes if field in c.dtype.names else no)(line, c)

    def typed(line, c):
        chosen: Any = (yes if field in c.fields else no).py_func  # type: ignore[attr-defined]
        return FunctionType(
            chosen.__code__, chosen.__globals__
        )  # without the annotations, which numba compares too

    numba.extending.overload(choose)(typed)
    return choose  # type: ignore[return-value]
