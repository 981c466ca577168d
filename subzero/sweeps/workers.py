"""Processes on this machine as an `Executor`: one pipe each, so that one that dies takes nothing along.

`concurrent.futures.ProcessPoolExecutor` would do, but for this: if one of its processes dies, it breaks and loses what
all of them were at; if its parent is killed, they wait for ever; and a script without ``if __name__ == "__main__"``
starts itself again. Here each process is a fresh Python that reads tasks from its standard input:

* one that dies is replaced, and only its own task hears of it, by a `WorkerDiedError`;
* all end with their parent, however that ends, because their input does;
* none runs the user's script again: functions of it come by value (cloudpickle).

Nothing is forked: a forked process has the locks of its parent's threads, and none of the threads.
"""

from __future__ import annotations

import gc
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

import cloudpickle

from subzero.errors import UserError

READY = b"ready"
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Each process has one core; more threads would only be in one another's way."""
MOST_FALSE_STARTS = 3
"""A process that ends before it is ready, by itself so many times in a row, will never be. [-]"""


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class WorkerDiedError(RuntimeError):
    """The process that had a task died of it, or was killed."""


class WorkerPool(Executor):
    """A fixed number of processes.

    Args:
        workers: how many.

    Attributes:
        count: how many.
    """

    def __init__(self, workers: int) -> None:
        self._tasks: queue.SimpleQueue[tuple[Future[Any], bytes] | None] = queue.SimpleQueue()
        self.count = workers
        self._hands = [_Hand(self._tasks) for _ in range(workers)]

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
            if wait:
                hand.join()


class _Hand:
    """A thread that looks after one process at a time, and hands it tasks."""

    def __init__(self, tasks: queue.SimpleQueue[tuple[Future[Any], bytes] | None]) -> None:
        self._tasks, self._ended = tasks, False
        self._process: _Process | None = None
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
        process = self._process = _Process()
        try:
            process.receive()
        except (EOFError, OSError):
            self._trouble = process.how_it_ended()
            self._false_starts += process.ended_by_itself
            self._process = None
            return False
        self._false_starts = 0
        return True


class _Process:
    """A fresh Python that does tasks."""

    def __init__(self) -> None:
        code = f"import sys; sys.path[:] = {sys.path!r}; from subzero.sweeps.workers import serve; serve()"
        self._popen = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | ONE_THREAD,
        )
        assert self._popen.stdin and self._popen.stdout  # noqa: PT018
        self._to = Connection(os.dup(self._popen.stdin.fileno()), readable=False)
        self._from = Connection(os.dup(self._popen.stdout.fileno()), writable=False)
        self._popen.stdin.close()
        self._popen.stdout.close()

    def send(self, task: bytes) -> bool:
        """Hand it a task; return whether it took it."""
        try:
            self._to.send_bytes(task)
        except OSError:
            self.close()
            return False
        return True

    def receive(self) -> bytes:
        """Wait for its next word.

        Raises:
            EOFError: it has died.
        """
        return self._from.recv_bytes()

    @property
    def ended_by_itself(self) -> bool:
        """Whether it ended without a signal."""
        return self._popen.wait() >= 0

    def how_it_ended(self) -> str:
        """Return how it died."""
        self.close()
        code = self._popen.wait()
        if code < 0:
            return f"its process died of signal {-code} ({signal.strsignal(-code)})"
        return f"its process ended with exit code {code}"

    def close(self) -> None:
        """Let it end: it has no more tasks."""
        self._to.close()
        self._from.close()
        if self._popen.poll() is None:
            with suppress(subprocess.TimeoutExpired):
                self._popen.wait(timeout=1.0)
        self.kill()

    def kill(self) -> None:
        """End it at once."""
        self._popen.kill()
        self._popen.wait()


def serve() -> None:
    """Do tasks from standard input until it ends; what they print goes to standard error."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which then closes the input
    answers = Connection(os.dup(1), readable=False)
    os.dup2(2, 1)
    tasks = Connection(os.dup(0), writable=False)
    import subzero.simulation  # noqa: F401  # now, while the parent still plans

    with suppress(EOFError, OSError):  # the parent is gone
        answers.send_bytes(READY)
        answers.send_bytes(_done(tasks.recv_bytes()))
        gc.freeze()  # what is imported and compiled by now stays: looking through it again takes a tenth of the time
        while True:
            answers.send_bytes(_done(tasks.recv_bytes()))


def _done(task: bytes) -> bytes:
    """Return the answer to a task: whether it went well, and what came of it."""
    try:
        fn, args, kwargs = pickle.loads(task)
        return pickle.dumps((True, fn(*args, **kwargs)), protocol=pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        return pickle.dumps((False, _as_it_is(error)))


def _as_it_is(error: Exception) -> Exception:
    """Return an error that another process can read."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
