"""The effect of a signal on a command: it ends with exit code 130, soon, whatever it is doing.

Ctrl-C, SIGTERM or a closed terminal raises `KeyboardInterrupt` in the main thread, so that files are put right and the
command says what it left. Compiled code may not return to Python for a while, and a full pipe never: so a thread, which
the operating system wakes at each signal, ends the process when its patience is over, or at a second signal. Only
commands do so; a session of Python keeps its own habits.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Never

INTERRUPTED = 130
"""Exit code: 128 and the number of SIGINT, as shells have it."""
PATIENCE_S = 1.2
"""Time for a command to end by itself. [s]"""
LAST_WORDS_S = 0.2
"""Time for its last words: nothing may read them. [s]"""
SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)
)

_patience = [PATIENCE_S]
_interrupted = threading.Event()
_last_words = threading.Lock()
"""Taken by the thread that says them, for the rest of the command."""
_exit_message: list[Callable[[], str]] = []


def watch() -> None:
    """Let signals end this process; a signal that is ignored (``nohup``) remains ignored."""
    woken, waker = socket.socketpair()
    waker.setblocking(False)
    signal.set_wakeup_fd(waker.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_end_late, args=(woken, waker), daemon=True).start()
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


@contextmanager
def patience(seconds: float) -> Iterator[None]:
    """Set the time that a command has after a signal to write its results [s]; a second signal ends it at once."""
    before, _patience[0] = _patience[0], seconds
    try:
        yield
    finally:
        _patience[0] = before


def leave(code: int) -> Never:
    """End the process; after an interrupt at once, without waiting for threads that still compute."""
    for number in SIGNALS:  # the command is done; Python, while it ends, would let a signal kill the process
        signal.signal(number, signal.SIG_IGN)
    if code != INTERRUPTED:
        sys.exit(code)
    with suppress(OSError, ValueError):  # nothing reads it any more
        sys.stdout.flush()
    os._exit(code)


def reset() -> None:
    """Clear the messages that a former command of this process set."""
    _exit_message.clear()
    _interrupted.clear()
    if _last_words.locked():
        _last_words.release()


def was_interrupted() -> bool:
    """Return whether a signal came: compiled code may turn it into an error of its own."""
    return _interrupted.is_set()


def set_exit_message(message: Callable[[], str]) -> None:
    """Set the message of an interrupted command, for one that leaves more than the files of its end."""
    _exit_message[:] = [message]


def print_interrupted(words: str = "") -> None:
    """Print the last words of an interrupted command, once: by default the state of its files."""
    if _last_words.acquire(blocking=False):
        with suppress(OSError, ValueError):  # nothing reads standard error any more
            print(words or f"Interrupted; {_state()}.", file=sys.stderr, flush=True)


def _state() -> str:
    if _exit_message:
        return _exit_message[0]()
    output = sys.modules.get("subzero.files.atomic_output")
    return output.state_of_output() if output else "nothing was written"


def _interrupt(number: int, frame: FrameType | None) -> Never:
    """Raise the exception that Ctrl-C raises."""
    _interrupted.set()
    raise KeyboardInterrupt


def _end_late(woken: socket.socket, waker: socket.socket) -> None:
    """Wait for a signal; end the process when its patience is over, or by a second signal."""
    woken.recv(1)
    try:
        if _patience[0] > PATIENCE_S:
            words = "\nInterrupted; what it has is being written. Interrupt again to end it at once."
            _say_in_time(lambda: print(words, file=sys.stderr, flush=True))
        woken.settimeout(_patience[0])
        with suppress(TimeoutError):
            woken.recv(1)
        if output := sys.modules.get("subzero.files.atomic_output"):
            output.remove_temporary()
        _say_in_time(lambda: print_interrupted(f"\nInterrupted; {_state()}."))  # a progress line may be open
    finally:
        os._exit(INTERRUPTED)


def _say_in_time(say: Callable[[], None]) -> None:
    """Print something in a thread that is abandoned if nothing reads it."""
    saying = threading.Thread(target=say, daemon=True)
    saying.start()
    saying.join(LAST_WORDS_S)
