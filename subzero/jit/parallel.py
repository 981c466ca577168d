"""Let a second process compile some functions while this one compiles others: the compiler uses one core only.

A caller that is about to compile much names the functions that are needed last, and the types of their arguments. A
second process compiles and keeps them (`subzero.jit.machine_code`); where this one needs such a function, it waits
for the file. No result depends on it: code that does not arrive is compiled here. The second process ends with this
one, whose end breaks the pipe that it reads.
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
from typing import Any

import numba

Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""A compiled function, and numba's types of its future arguments."""

POLL_S = 0.02
"""Time between two checks for an awaited file. [s]"""
START = "import sys; sys.path[:] = sys.argv[1:]; from subzero.jit.parallel import serve; serve()"

_process: list[subprocess.Popen[bytes]] = []
"""The second process of this one, if there has been one."""
_awaited: set[Path] = set()


def compile_in_parallel(calls: Callable[[], Sequence[Call]]) -> None:
    """Start a second process that compiles functions, where there is a core for it; returns at once, and does so only
    once.

    Args:
        calls: returns the functions that this process is to compile, in order.
    """
    # Else each process of a pool would start one of its own.
    is_alone = parent_process() is None and threading.current_thread() is threading.main_thread()
    if _process or numba.config.DISABLE_JIT or not is_alone or _cores() == 1 or not sys.executable:
        return
    from numba.core.registry import cpu_target

    wanted = calls()
    codegen = cpu_target.target_context.codegen()
    files = [function.machine_code.file_for(types, codegen) for function, types in wanted]  # type: ignore[attr-defined]
    # Nothing can be kept, or a run before has kept some already: a second process would hardly help.
    if None in files or any(file.exists() for file in files):
        return
    with suppress(OSError):  # no second process can be started: this one compiles all
        work = pickle.dumps([(function.__module__, function.__name__, types) for function, types in wanted])
        process = subprocess.Popen(
            [sys.executable, "-c", START, *sys.path],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C reaches this process only, and the other ends with it
        )
        _process.append(process)
        _awaited.update(files)
        assert process.stdin is not None
        process.stdin.write(work)
        process.stdin.flush()  # the open pipe keeps the other process alive


def _cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def wait_for(file: Path, meanwhile: Callable[[], None]) -> None:
    """Wait for a file of the second process, as long as that runs; `meanwhile` is called repeatedly."""
    while file in _awaited and not file.exists() and _process[0].poll() is None:
        time.sleep(POLL_S)
        meanwhile()


def serve() -> None:
    """Compile the functions listed on standard input: all that the second process does."""
    work = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_the_first, daemon=True).start()
    for module, name, types in work:
        getattr(import_module(module), name).compile(types)


def _end_with_the_first() -> None:
    """Wait until standard input breaks."""
    with suppress(OSError):
        os.read(0, 1)  # not through `sys.stdin`: its lock, held by a thread, aborts a process that ends
    os._exit(1)
