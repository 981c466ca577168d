"""Compile some functions in a second process while this one compiles others, as the compiler uses one core only.

Whoever is about to compile much names the functions that it will need last, and for what arguments. A second process
compiles them, and keeps their code where this one looks for it (`subzero.jit.machine_code`); should this one be there
before, it compiles meanwhile what it will need afterwards, and then waits. No result depends on it: what the second
process does not deliver, for whatever reason, is compiled here. It ends with this process, however that ends: it
listens to a pipe that breaks then. Through another one it tells of each function that it has compiled.

There is none where it would not help: the code is kept already, nothing can be kept, only one core may be used,
another process has one at work on the same folder, or this process itself is one of many.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from multiprocessing import parent_process
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba

if TYPE_CHECKING:
    from filelock import BaseFileLock

Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""A compiled function, and numba's types of the arguments that it will be called with."""

LOCK = "beside.half"
"""File in a folder of machine code that is locked while a second process is at work; swept with the folder."""
LOOK_S = 0.02
"""So often this process looks whether the second one has delivered. [s]"""
PATIENCE_S = 60.0
"""So long this process waits for a file; a second process that takes longer has been stopped, or has no core. [s]"""
MADE = b"."
"""What a second process writes for each function that it has compiled."""
BEGIN = "import sys; sys.path[:] = sys.argv[1:]; from subzero.jit.beside import serve; serve()"

_asked = [False]
"""Whether a second process has been asked for: there is never another."""
_second: list[subprocess.Popen[bytes]] = []
"""The second process of this one, if there has been one."""
_promised: set[Path] = set()
"""Files that it will make."""
_meanwhile: list[Call] = []
"""What this process compiles where it would wait for such a file."""
_told = [0]
"""How many functions it has told of."""
_serving = [False]
"""Whether this is a second process."""


def compile_beside(last: Callable[[], Sequence[Call]], meanwhile: Callable[[], Sequence[Call]]) -> None:
    """Have functions compiled by a second process, if that helps; returns at once, and does nothing a second time.

    Args:
        last: returns what that process is to compile, in this order.
        meanwhile: returns what this one compiles wherever it would wait for that, in this order. These functions call
            none of the others, and nothing that calls them is called before them.
    """
    if numba.config.DISABLE_JIT or _asked[0]:
        return
    _asked[0] = True
    if not _may_have_one():
        return
    calls = last()
    files = [function._cache.file_for(types) for function, types in calls]  # type: ignore[attr-defined]
    if None in files or any(file.exists() for file in files):
        return
    lock = _locked(files[0].parent)
    if lock is not None:
        try:
            _start(calls, files, lock)
            _meanwhile.extend(meanwhile())
        except OSError:  # no more processes, or it is gone already: this one compiles all
            lock.release()


def _may_have_one() -> bool:
    """Say whether a second process would have a core, and this one is not itself one of several."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    is_alone = parent_process() is None and threading.current_thread() is threading.main_thread()
    return cores > 1 and is_alone and bool(sys.executable)


def _locked(folder: Path) -> BaseFileLock | None:
    """Return the lock of a folder; None if another process has it, or nothing can be written there."""
    from filelock import FileLock, Timeout  # half a second, which only a process that compiles has to spend

    lock = FileLock(folder / LOCK, timeout=0.0, mode=0o600, thread_local=False)
    try:
        lock.acquire()
    except (Timeout, OSError):
        return None
    return lock


def _start(calls: Sequence[Call], files: Sequence[Path], lock: BaseFileLock) -> None:
    """Start the second process; the lock is held as long as it lives."""
    told = pickle.dumps(
        [
            (each.__module__, each.__name__, str(file.parent), types)
            for (each, types), file in zip(calls, files, strict=True)
        ]
    )
    second = subprocess.Popen(
        [sys.executable, "-c", BEGIN, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C is for this process, which takes it along
    )
    _second.append(second)
    _promised.update(files)
    threading.Thread(target=_see_it_end, args=(second, lock), daemon=True).start()
    assert second.stdin is not None
    second.stdin.write(told)
    second.stdin.flush()  # and stays open: where it breaks, the second process ends


def _see_it_end(second: subprocess.Popen[bytes], lock: BaseFileLock) -> None:
    """Hear what the second process tells, and wait for it, so that no dead one is left behind; close both pipes."""
    assert second.stdin is not None
    assert second.stdout is not None
    while second.stdout.read(len(MADE)):
        _told[0] += 1
    second.wait()
    lock.release()
    for pipe in (second.stdin, second.stdout):
        with suppress(OSError):
            pipe.close()


def is_delivered(file: Path, heed: Callable[[], None]) -> bool:
    """Say whether a file is there that the second process makes; wait for it as long as that one works.

    Args:
        file: any file of machine code.
        heed: called again and again while this waits.
    """
    if file not in _promised:
        return False
    until = time.monotonic() + PATIENCE_S
    while not file.exists() and _second and _second[0].returncode is None and time.monotonic() < until:
        if _meanwhile:
            function, types = _meanwhile.pop(0)
            function.compile(types)  # type: ignore[attr-defined]
        else:
            time.sleep(LOOK_S)
        heed()
    _promised.discard(file)
    return file.exists()


def made_by_second() -> int:
    """Return how many functions the second process has compiled so far."""
    return _told[0]


def tell_first() -> None:
    """Tell the first process, if this is a second one, that a function has been compiled."""
    if _serving[0]:
        with suppress(OSError):  # it has gone, and this one goes as well
            os.write(sys.__stdout__.fileno(), MADE)  # type: ignore[union-attr]


def serve() -> None:
    """Compile what stands in standard input, and end as soon as that breaks: the second process's whole life."""
    work = pickle.load(sys.stdin.buffer)
    _serving[0] = True
    threading.Thread(target=_end_with_the_first, daemon=True).start()
    for module, name, folder, types in work:
        function = getattr(import_module(module), name)
        if function._cache.cache_path != folder:  # other sources or settings than the first process has
            return
        function.compile(types)


def _end_with_the_first() -> None:
    """Wait until nobody is there any more who could write to standard input."""
    with suppress(OSError):
        os.read(0, 1)  # not through `sys.stdin`: its lock, held by a thread, aborts a process that ends
    os._exit(1)
