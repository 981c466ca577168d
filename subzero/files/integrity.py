"""Is a file still what was written? A digest at its end, and the kinds and shapes of its arrays, before they are used.

Files of ours end with 48 bytes that are no part of their format: a mark and the SHA-256 of all bytes before it. HDF5
and ZIP ignore what stands behind their own end, so other programs read these files as before, and a copy keeps its
digest. A program that changes an HDF5 file in place writes over the digest, or cuts it off. So there are three kinds of
file: with a digest that holds, with none, and damaged. HDF5 says in its head where it ends: bytes behind that are a
digest, or damage.

A digest finds damage, not intent: who writes a file on purpose can write its digest, too.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

MARK = b"subzero sha-256:"
TAIL = len(MARK) + hashlib.sha256().digest_size
HDF5 = b"\x89HDF\r\n\x1a\n"
END_OF_FILE = {0: 40, 1: 44, 2: 28, 3: 28}
"""Version of the head of an HDF5 file → where it says where the file ends, for addresses of 8 bytes."""
COPIES = 2.0
"""A value is read and decoded. [-]"""


class DamagedError(Exception):
    """A file is not what was written; the message is the end of a sentence that begins with its name."""


def append_digest(path: Path) -> None:
    """Write the digest of a file after its end."""
    with open(path, "r+b") as file:
        digest = hashlib.file_digest(file, "sha256").digest()
        file.write(MARK + digest)


def without_digest(data: bytes) -> bytes:
    """Return the bytes of a file before its digest.

    Raises:
        DamagedError: it has none, or another one.
    """
    inside, tail = data[:-TAIL], data[-TAIL:]
    if tail != MARK + hashlib.sha256(inside).digest():
        raise DamagedError("its digest is not that of its content")
    return inside


def check_digest(path: Path) -> None:
    """Raise an error for an HDF5 file that was damaged, before its library opens it; one without a digest passes.

    Raises:
        DamagedError: its digest is that of other bytes, or what stands behind its end is no digest.
    """
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        head = file.read(64)
        file.seek(max(size - TAIL, 0))
        tail = file.read()
        if not tail.startswith(MARK):
            if head.startswith(HDF5) and _end(head) not in (None, size):
                raise DamagedError("it does not end where it should")
            return
        file.seek(0)
        digest, left = hashlib.sha256(), size - TAIL
        while left and (block := file.read(min(left, 1 << 20))):
            digest.update(block)
            left -= len(block)
    if digest.digest() != tail[len(MARK) :]:
        raise DamagedError("its digest is not that of its content")


def _end(head: bytes) -> int | None:
    """Return where an HDF5 file says that it ends; None if it is of a kind that netCDF does not write."""
    at = END_OF_FILE.get(head[8])
    return None if at is None else int.from_bytes(head[at : at + 8], "little")


def check_arrays(
    arrays: Mapping[str, Any], expected: Mapping[str, tuple[str | np.dtype, tuple[Any, ...]]]
) -> None:
    """Raise an error for arrays of another kind or shape than expected, before any is read.

    Args:
        arrays: name → something with ``dtype`` and ``shape`` (or, for labelled ones, ``dimensions``).
        expected: name → a dtype, or the kinds of dtype that may be, such as "fi"; and shape, or names of dimensions.
            Other arrays may have any.

    Raises:
        DamagedError: the first that is wrong.
    """
    for name, (kinds, shape) in expected.items():
        if name not in arrays:
            raise DamagedError(f"it has no {name}")
        found = arrays[name]
        kind = np.dtype(found.dtype)
        if not (kind.kind in kinds if isinstance(kinds, str) else kind == kinds):
            raise DamagedError(f"{name} is of another kind ({kind})")
        if tuple(getattr(found, "dimensions", found.shape)) != shape:
            raise DamagedError(f"{name} has another shape")


def claimed_bytes(arrays: Mapping[str, Any]) -> float:
    """Return how many bytes of numbers arrays claim to have; reading and decoding them takes `COPIES` times as many."""
    sizes = [
        float(np.prod(array.shape, dtype=float)) * np.dtype(array.dtype).itemsize for array in arrays.values()
    ]
    return float(sum(sizes))
