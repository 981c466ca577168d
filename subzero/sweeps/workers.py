"""Processes on this machine as an `Executor`: one pipe each, so that one that dies takes nothing along.

`concurrent.futures.ProcessPoolExecutor` would do, but for this: if one of its processes dies, it breaks and loses what
all of them were at; if its parent is killed, they wait for ever; and a script without ``if __name__ == "__main__"``
starts itself again. Here (`subzero.sweeps.processes`)

* one that dies is replaced, and only its own task hears of it, by a `WorkerDiedError`;
* all end with their parent, however that ends, because their input does;
* none runs the user's script again: functions of it come by value (cloudpickle).
"""

from __future__ import annotations

import os
import pickle
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from contextlib import suppress
from pathlib import Path
from typing import Any

import cloudpickle

from subzero.errors import UserError
from subzero.sweeps.processes import FORKS, ForkServer, ForkServerError, Worker, fresh

MOST_FALSE_STARTS = 3
"""A process that ends before it is ready, by itself so many times in a row, will never be. [-]"""


def rehearse_file(spec: Path) -> None:
    """Read the sweep that a file asks for and rehearse a member of it, while its parent reads the same file."""
    from subzero.sweeps.plan import read_plan

    read_plan(spec).job.rehearse()


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class WorkerDiedError(RuntimeError):
    """The process that had a task died of it, or was killed."""


Tasks = queue.SimpleQueue[tuple[Future[Any], bytes] | None]


class WorkerPool(Executor):
    """A fixed number of processes.

    Args:
        workers: how many.
        forks: where they come from; one of their own when not given.

    Attributes:
        count: how many.
    """

    def __init__(self, workers: int, forks: ForkServer | None = None) -> None:
        self._tasks: Tasks = queue.SimpleQueue()
        self.count, self._is_guest = workers, forks is not None
        self._forks = forks or (ForkServer() if FORKS else None)
        self._hands = [_Hand(self._tasks, self._forks) for _ in range(workers)]

    def prepare(self, rehearsal: Callable[[], object]) -> None:
        """Have something done once, where processes come from, before their first task: what it loads, all have."""
        if self._forks is not None:
            self._forks.prepare(rehearsal)

    def sibling(self) -> WorkerPool | None:
        """Return another pool whose processes have what was prepared until their first task; None without forks."""
        return None if self._forks is None else WorkerPool(self.count, self._forks)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Ask for ``fn(*args, **kwargs)`` in one of the processes."""
        future: Future[Any] = Future()
        self._tasks.put((future, cloudpickle.dumps((fn, args, kwargs))))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes: those at work after their task, or at once with `cancel_futures`."""
        if cancel_futures:
            with suppress(queue.Empty):
                while True:
                    left = self._tasks.get_nowait()
                    if left is not None:
                        left[0].cancel()
        for _ in self._hands:
            self._tasks.put(None)
        for hand in self._hands:
            if cancel_futures:
                hand.kill()
        if cancel_futures:
            self._leave()
        if wait:
            for hand in self._hands:
                hand.join()
            self._leave()

    def _leave(self) -> None:
        """End what its processes come from, if that is its own."""
        if self._forks is not None and not self._is_guest:
            self._forks.close()


class _Hand:
    """A thread that looks after one process at a time, and hands it tasks."""

    def __init__(self, tasks: Tasks, forks: ForkServer | None) -> None:
        self._tasks, self._forks, self._ended = tasks, forks, False
        self._process: Worker | None = None
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._false_starts, self._trouble = 0, ""
        self._thread.start()

    def join(self) -> None:
        """Wait for the end."""
        self._thread.join()

    def kill(self) -> None:
        """End the process at once; no other is started."""
        self._ended = True
        if (process := self._process) is not None:
            process.kill()

    def _serve(self) -> None:
        if self._forks is None:  # it has as much to import as the parent that plans; a fork has it all
            self._start()
        while (task := self._tasks.get()) is not None:
            future, asked = task
            if future.set_running_or_notify_cancel():
                self._answer(future, asked)
        if self._process is not None:
            self._process.close()

    def _answer(self, future: Future[Any], asked: bytes) -> None:
        """Let the process do a task, and give its answer to the future."""
        while not self._ended:
            if self._process is None and not self._start():
                if self._false_starts >= MOST_FALSE_STARTS:
                    future.set_exception(UserError(f"No worker process could be started. {self._trouble}"))
                    return
                continue
            assert self._process is not None
            if not self._process.send(asked):  # it died while it had nothing to do
                self._process = None
                continue
            try:
                good, made = pickle.loads(self._process.receive())
            except (EOFError, OSError):
                words, self._process = self._process.how_it_ended(), None
                future.set_exception(WorkerDiedError(words))
            else:
                future.set_result(made) if good else future.set_exception(made)
            return
        future.set_exception(WorkerDiedError("it was ended"))

    def _start(self) -> bool:
        """Start a process; return whether it is ready."""
        try:
            process = self._process = fresh() if self._forks is None else self._forks.worker()
        except ForkServerError as error:
            self._trouble = f"{error}."
            self._false_starts += error.by_itself
            return False
        try:
            process.receive()
        except (EOFError, OSError):
            self._trouble = process.how_it_ended()
            self._false_starts += process.ended_by_itself
            self._process = None
            return False
        self._false_starts = 0
        return True
