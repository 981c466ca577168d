"""The processes that do a sweep's tasks, each at the end of two pipes, and where they come from.

A task is what `cloudpickle` makes of a function and its arguments; the answer says whether it went well, and what came
of it. A process ends when its pipe does, so with its parent, however that ends.

On Linux they are forks of one fresh Python, the `ForkServer`, which has imported and loaded all that a member needs,
once for all of them, and shares the memory of it. It has one thread that works, so nothing is torn by the fork; the
process that plans the sweep has many, and is never forked. Elsewhere, where libraries of the system do not bear a
fork, each is a fresh Python of its own.
"""

from __future__ import annotations

import gc
import io
import os
import pickle
import queue
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import inf
from time import monotonic, sleep
from typing import Any, NoReturn, Protocol

import cloudpickle

FORKS = sys.platform == "linux"
READY = b"ready"
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Each process has one core; more threads would only be in one another's way."""
LENGTH_BYTES = 8
"""Of the length of a message between processes."""
LONGEST_WORD = 100
"""Of a request to the fork server. [bytes]"""
LIVES, LOOK_S = 1000, 0.002
"""No exit code: the worker lives. So often the fork server is asked. [-], [s]"""
PATIENCE_S = 1.0
"""So long a process may take to end by itself, or the fork server to answer, before it is killed. [s]"""


class Life(Protocol):
    """How a process is ended, and how it ended."""

    def kill(self) -> None:
        """End it at once, as far as it has not ended."""

    def wait(self, timeout: float | None = None) -> int:
        """Return its exit code once it has ended, negative for a signal; subprocess.TimeoutExpired if it has not."""


class Pipe:
    """One end of a pipe for messages: the length of each in eight bytes, and the message.

    `multiprocessing.connection.Connection` takes such a handle for a socket on Windows.
    """

    def __init__(self, handle: int, mode: str) -> None:
        self._file = io.FileIO(handle, mode)

    def send(self, message: bytes) -> None:
        """Send a message; OSError if nobody can receive it."""
        rest = memoryview(len(message).to_bytes(LENGTH_BYTES, "little") + message)
        while rest:
            rest = rest[self._opened().write(rest) :]

    def receive(self) -> bytes:
        """Wait for the next message; EOFError if there is none to come."""
        return self._read(int.from_bytes(self._read(LENGTH_BYTES), "little"))

    def _read(self, count: int) -> bytes:
        parts, left = [], count
        while left:
            part = self._opened().read(left)
            if not part:
                raise EOFError
            parts.append(part)
            left -= len(part)
        return b"".join(parts)

    def _opened(self) -> io.FileIO:
        if self._file.closed:
            raise OSError("the pipe is closed")
        return self._file

    def close(self) -> None:
        """Close it."""
        self._file.close()


class Worker:
    """A process that does tasks.

    Args:
        tasks: pipe to it; taken over.
        answers: pipe from it; taken over.
        life: how it is ended.
    """

    def __init__(self, tasks: int, answers: int, life: Life) -> None:
        self._to, self._from = Pipe(tasks, "w"), Pipe(answers, "r")
        self._life = life

    def send(self, task: bytes) -> bool:
        """Hand it a task; return whether it took it."""
        try:
            self._to.send(task)
        except OSError:
            self.close()
            return False
        return True

    def receive(self) -> bytes:
        """Wait for its next word.

        Raises:
            EOFError: it has died.
        """
        return self._from.receive()

    @property
    def ended_by_itself(self) -> bool:
        """Whether it ended without a signal."""
        return self._life.wait() >= 0

    def how_it_ended(self) -> str:
        """Return how it died."""
        self.close()
        return in_words(self._life.wait())

    def close(self) -> None:
        """Let it end: it has no more tasks."""
        self._to.close()
        self._from.close()
        with suppress(subprocess.TimeoutExpired):
            self._life.wait(PATIENCE_S)
        self.kill()

    def kill(self) -> None:
        """End it at once."""
        self._life.kill()
        self._life.wait()


def in_words(code: int) -> str:
    """Return how a process ended, from its exit code."""
    if code < 0:
        return f"its process died of signal {-code} ({signal.strsignal(-code)})"
    return f"its process ended with exit code {code}"


def _python(function: str, stdin: Any, stdout: Any) -> subprocess.Popen[bytes]:
    """Start a fresh Python that calls a function of this module; nothing of the user's script runs in it."""
    code = f"import sys; sys.path[:] = {sys.path!r}; from subzero.sweeps.processes import {function}; {function}()"
    return subprocess.Popen(
        [sys.executable, "-c", code], stdin=stdin, stdout=stdout, env=os.environ | ONE_THREAD
    )


def fresh() -> Worker:
    """Start a worker that is a Python of its own."""
    popen = _python("serve", subprocess.PIPE, subprocess.PIPE)
    assert popen.stdin and popen.stdout  # noqa: PT018
    worker = Worker(os.dup(popen.stdin.fileno()), os.dup(popen.stdout.fileno()), popen)
    popen.stdin.close()
    popen.stdout.close()
    return worker


class ForkServerError(Exception):
    """It has died, `by_itself` or of a signal, or can fork no more."""

    def __init__(self, words: str, *, by_itself: bool = True) -> None:
        super().__init__(words)
        self.by_itself = by_itself


class ForkServer:
    """A fresh Python that has ready what workers need, and forks them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._ended = False
        self._start()

    def _start(self) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._popen = _python("serve_forks", theirs, subprocess.DEVNULL)
        theirs.close()

    def prepare(self, rehearsal: Callable[[], object]) -> None:
        """Have something done before the next worker begins: what it loads, workers have; what it raises is lost."""
        with tempfile.TemporaryFile() as file, self._lock, suppress(OSError):
            file.write(cloudpickle.dumps(rehearsal))
            file.flush()
            socket.send_fds(self._socket, [b"rehearse"], [file.fileno()])

    def worker(self) -> Worker:
        """Return a new worker.

        Raises:
            ForkServerError: there is none: the fork server has died; the next one comes of a new one.
        """
        (task, to), (back, answers) = os.pipe(), os.pipe()
        try:
            pid = self._forked([task, answers])
        except ForkServerError:
            os.close(to)
            os.close(back)
            raise
        finally:
            os.close(task)
            os.close(answers)
        return Worker(to, back, _Child(pid, self))

    def _forked(self, handles: list[int]) -> int:
        """Return the number of a new worker with these two pipes."""
        pid = int(self._asked(b"fork", handles))
        if pid == 0:
            raise ForkServerError("the system starts no more processes")
        return pid

    def ended(self, pid: int) -> int | None:
        """Return the exit code of a worker, None if it lives; as if killed if the fork server has died."""
        try:
            code = int(self._asked(b"wait %d" % pid))
        except ForkServerError:
            return -signal.SIGKILL
        return None if code == LIVES else code

    def _asked(self, word: bytes, handles: list[int] | None = None) -> bytes:
        """Return the answer to a request; start another fork server where this one has died."""
        with self._lock:
            if self._ended:
                raise ForkServerError("it was ended")
            with suppress(OSError):
                socket.send_fds(self._socket, [word], handles or [])
                if answer := self._socket.recv(LONGEST_WORD):
                    return answer
            self._socket.close()
            code = self._popen.wait()
            if not self._ended:
                self._start()
            raise ForkServerError(in_words(code), by_itself=code >= 0)

    def close(self) -> None:
        """End it; one that is still at something is killed."""
        self._ended = True
        idle = self._lock.acquire(timeout=PATIENCE_S)
        try:
            if not idle:
                self._popen.kill()
            self._socket.close()
            with suppress(subprocess.TimeoutExpired):
                self._popen.wait(PATIENCE_S)
            self._popen.kill()
            self._popen.wait()
        finally:
            if idle:
                self._lock.release()


class _Child:
    """A fork of the fork server, which alone is told how it ended."""

    def __init__(self, pid: int, forks: ForkServer) -> None:
        self._pid, self._forks, self._lock = pid, forks, threading.Lock()
        self._code: int | None = None

    def kill(self) -> None:
        """End it at once; nobody else has its number until the fork server was asked how it ended."""
        with self._lock, suppress(ProcessLookupError):
            if self._code is None:
                os.kill(self._pid, signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Return its exit code once it has ended."""
        until = monotonic() + (inf if timeout is None else timeout)
        while True:
            with self._lock:
                self._code = self._forks.ended(self._pid) if self._code is None else self._code
                if self._code is not None:
                    return self._code
            if monotonic() > until:
                raise subprocess.TimeoutExpired("worker", timeout or 0.0)
            sleep(LOOK_S)


def serve_forks() -> NoReturn:
    """Be a fork server: at the other end of the socket that is standard input, until that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which then closes the socket
    connection = socket.socket(fileno=os.dup(0))
    os.dup2(2, 1)  # what tasks print goes to standard error
    _load()
    while True:
        word, handles, _, _ = socket.recv_fds(connection, LONGEST_WORD, 2)
        if not word:
            os._exit(0)
        with suppress(BrokenPipeError):  # the parent is gone, which the next word says
            _heed(word, handles, connection)
        for handle in handles:
            os.close(handle)


def _load() -> None:
    """Import what every member needs: the parent still plans."""
    with _all_stays():
        import subzero.simulation.run  # noqa: F401


@contextmanager
def _all_stays() -> Iterator[None]:
    """Let Python look for no garbage among what is made inside, now and later: that is a seventh of an import."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def _heed(word: bytes, handles: list[int], connection: socket.socket) -> None:
    """Do what the fork server is asked for."""
    if word == b"rehearse":
        _rehearse(handles[0])
    elif word == b"fork":
        gc.freeze()  # what is there stays; and pages that nobody touches are shared
        connection.send(b"%d" % _forked(handles, connection))
    else:
        connection.send(b"%d" % _code_of(int(word.split()[1])))


def _forked(handles: list[int], connection: socket.socket) -> int:
    """Return the number of a new worker with these two pipes, 0 if the system has no room for it."""
    try:
        pid = os.fork()
    except OSError:
        return 0
    if pid == 0:
        connection.close()
        _serve(Pipe(handles[0], "r"), Pipe(handles[1], "w"))
        os._exit(0)
    return pid


def _code_of(pid: int) -> int:
    """Return the exit code of a worker, or that it lives."""
    ended, status = os.waitpid(pid, os.WNOHANG)
    return os.waitstatus_to_exitcode(status) if ended else LIVES


def _rehearse(handle: int) -> None:
    """Do what a file asks for, whatever comes of it: the tasks will tell."""
    with suppress(Exception), open(handle, "rb", closefd=False) as file, _all_stays():
        file.seek(0)
        pickle.load(file)()


def serve() -> None:
    """Do tasks from standard input until it ends; what they print goes to standard error."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = Pipe(os.dup(1), "w")
    os.dup2(2, 1)
    _load()
    _serve(Pipe(os.dup(0), "r"), answers)


def _serve(tasks: Pipe, answers: Pipe) -> None:
    """Do tasks until their pipe ends."""
    received: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(tasks, received), daemon=True).start()
    with suppress(OSError):  # the parent is gone
        answers.send(READY)
        answers.send(_done(received.get()))
        gc.freeze()  # what is imported and compiled by now stays: looking through it again takes a tenth of the time
        while True:
            answers.send(_done(received.get()))


def _receive(tasks: Pipe, received: queue.SimpleQueue[bytes]) -> NoReturn:
    """Receive tasks; end the process with its parent, at once, whatever task it is at."""
    with suppress(EOFError, OSError):
        while True:
            received.put(tasks.receive())
    os._exit(0)


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
