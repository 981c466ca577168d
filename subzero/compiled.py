"""Compile physics with numba, and keep what was compiled for the next run.

The one thing that all packages share: a decorator, `compiled`, for functions on plain floats and arrays.
Numba's on-disk cache notices an edit in the file of a function, but not in another file whose functions it
inlined, so a cache directory is named by a digest of all our sources: any edit starts a new one. It lies in
the user's cache directory (``SUBZERO_CACHE_DIR`` moves it), so a read-only installation works too.

Setting ``NUMBA_DISABLE_JIT=1`` runs the same code interpreted.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])

PACKAGES = ("subzero", "cable", "vehicle")


def source_digest() -> str:
    """Return twelve hexadecimal digits that change with any edit of a compiled package."""
    root = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(path for package in PACKAGES for path in (root / package).rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def cache_directory() -> Path:
    """Return the directory that holds the machine code of these very sources."""
    base = os.environ.get("SUBZERO_CACHE_DIR") or Path(
        os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "subzero"
    )
    return Path(base) / f"numba-{source_digest()}"


def is_warm() -> bool:
    """Say whether this version's kernels have been compiled before on this machine."""
    return any(CACHE.rglob("*.nbc")) if CACHE.is_dir() else False


CACHE = cache_directory()
numba.config.CACHE_DIR = str(CACHE)


def compiled(function: Function) -> Function:
    """Compile a function of plain floats and arrays; strict IEEE arithmetic, so runs repeat to the last bit."""
    return numba.njit(cache=True, error_model="numpy")(function)
