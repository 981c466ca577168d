"""Processes on this machine as an `Executor` that goes on when one of its processes dies.

They are those of `concurrent.futures.ProcessPoolExecutor`, each a fresh Python. A process that dies breaks such a pool:
all tasks under way end with `BrokenExecutor`, and the next task here starts a new one. Processes end with their parent,
however that ends, and none runs the user's script again: functions of it come by value (cloudpickle).
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import cloudpickle

from subzero.errors import UserError

MOST_FALSE_STARTS = 3
"""A pool whose processes end before their first task so many times in a row will never be ready. [-]"""


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class WorkerPool(Executor):
    """A fixed number of processes.

    Args:
        workers: how many.

    Attributes:
        count: how many.
    """

    def __init__(self, workers: int) -> None:
        self.count, self._lock = workers, threading.Lock()
        self._pool: ProcessPoolExecutor | None = None
        self._starts: list[Future[Any]] = []
        self._processes: set[Any] = set()
        self._false_starts = 0

    def start(self) -> None:
        """Start the processes now, not with the first task: each has a second to import."""
        with self._lock, _fresh_processes() as processes:
            self._pool = self._pool or self._start()
            self._processes |= processes()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Ask for ``fn(*args, **kwargs)`` in one of the processes.

        Raises:
            UserError: no process can be started.
        """
        task = cloudpickle.dumps((fn, args, kwargs))
        with self._lock, _fresh_processes() as processes:
            pool = self._pool or self._start()
            try:
                return pool.submit(_run, task)
            except BrokenProcessPool:
                return self._start().submit(_run, task)
            finally:
                self._processes |= processes()

    def _start(self) -> ProcessPoolExecutor:
        """Start a pool, in place of one that is broken."""
        if self._starts and not any(start.done() and not start.exception() for start in self._starts):
            self._false_starts += 1
            if self._false_starts >= MOST_FALSE_STARTS:
                raise UserError("No worker process could be started: each ended before its first task.")
        else:
            self._false_starts = 0
        self._processes.clear()
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(self.count, mp_context=context, initializer=_begin)
        self._starts = [self._pool.submit(_load) for _ in range(self.count)]
        return self._pool

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes: those at work after their task, or at once with `cancel_futures`."""
        if self._pool is not None:
            self._pool.shutdown(wait=wait and not cancel_futures, cancel_futures=cancel_futures)
        if cancel_futures:
            for process in self._processes:
                process.kill()


@contextmanager
def _fresh_processes() -> Iterator[Callable[[], set[Any]]]:
    """Keep processes that are started in the block from importing the user's script; yield the function that returns
    them.

    A script without ``if __name__ == "__main__"`` would start itself again in each.
    """
    main, before = sys.modules["__main__"], set(multiprocessing.active_children())
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield lambda: set(multiprocessing.active_children()) - before
    finally:
        sys.modules["__main__"] = main


def _begin() -> None:
    """Begin a process: Ctrl-C is for the parent, what tasks print goes to standard error, and it has one core."""
    from threadpoolctl import threadpool_limits

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(2, 1)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    threadpool_limits(1)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(0)


def _load() -> None:
    """Import what every member needs: the parent still plans."""
    import subzero.simulation.run  # noqa: F401


def _run(task: bytes) -> Any:
    """Do a task."""
    fn, args, kwargs = pickle.loads(task)
    return fn(*args, **kwargs)
