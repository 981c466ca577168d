"""What SIGINT (Ctrl-C) and SIGTERM do to a command: it ends with exit code 130, within two seconds, whatever it does.

A signal raises `KeyboardInterrupt` as soon as Python code runs again, so that files are put right and the command says
what it left. Compiled code may not come back that soon: so a thread, which the operating system's signal wakes at once,
ends the process when its patience is over. Only commands do so; a session of Python keeps its own habits.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Never

INTERRUPTED = 130
"""Exit code: 128 and the number of SIGINT, as shells have it."""
PATIENCE_S = 1.2
"""A command has so long to end by itself. [s]"""
SIGNALS = (signal.SIGINT, signal.SIGTERM)

AGAIN_S, SAYING_S = 0.02, 0.2
"""An interrupt that was lost comes again after this; last words that are being said may take so long. [s]"""

_patience = [PATIENCE_S]
_raised = [False]
"""Whether a signal has interrupted this process."""
_saying, _said = threading.Lock(), [False]
"""Held by what says the last words of a command; and whether they are said."""
_left: list[Callable[[], str]] = []
_lost = [0]
"""How many signals were lost and have been sent again, and not been heard by the thread yet."""


def watch() -> None:
    """Let signals end this process; a signal that is ignored (``nohup``) stays so."""
    heeded = [each for each in SIGNALS if signal.getsignal(each) is not signal.SIG_IGN]
    woken, waker = socket.socketpair()
    waker.setblocking(False)
    signal.set_wakeup_fd(waker.fileno(), warn_on_full_buffer=False)
    sys.unraisablehook = _send_again
    threading.Thread(target=_end_late, args=(woken, waker), daemon=True).start()
    for each in heeded:  # last: an interrupt finds all that it needs
        signal.signal(each, _interrupt)


def ignore() -> None:
    """Let signals do nothing any more: Python, while it ends, would leave them to the system, which kills."""
    for each in SIGNALS:
        signal.signal(each, signal.SIG_IGN)


@contextmanager
def patience(seconds: float) -> Iterator[None]:
    """Let a command go on for so long after a signal, to write what it has [s]; a second signal ends it as usual."""
    before, _patience[0] = _patience[0], seconds
    try:
        yield
    finally:
        _patience[0] = before


def leave(code: int) -> Never:
    """End the process; after an interrupt at once, without waiting for threads that still compute."""
    if code != INTERRUPTED:
        sys.exit(code)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):  # nobody reads it any more
            continue
    os._exit(code)


def begin() -> None:
    """Forget what a former command of this process has left, and that it was interrupted."""
    _left.clear()
    _raised[0] = _said[0] = False


def came() -> bool:
    """Say whether a signal came: an error behind it may be its doing, as machine code makes its own of an interrupt."""
    return _raised[0]


def leaves(left: Callable[[], str]) -> None:
    """Let an interrupted command say what it leaves, which keeps something besides the files of its end."""
    _left[:] = [left]


def words() -> str:
    """Return what an interrupted command says: what became of its files."""
    if _left:
        return f"Interrupted; {_left[0]()}."
    stage = sys.modules.get("subzero.stage")
    left = stage.interruption() if stage and hasattr(stage, "interruption") else "nothing was written"
    return f"Interrupted; {left}."


def say(last: str = "") -> None:
    """Say the last words of an interrupted command, `words()` if none are given; once, whoever ends it."""
    with _saying:
        if not _said[0]:
            print(last or words(), file=sys.stderr, flush=True)
            _said[0] = True


def _interrupt(number: int, frame: FrameType | None) -> Never:
    """Raise what Ctrl-C raises."""
    _raised[0] = True
    raise KeyboardInterrupt


def _send_again(lost: sys.UnraisableHookArgs) -> None:
    """Interrupt once more where Python swallowed it, in a call back from machine code or while an object is deleted."""
    if not isinstance(lost.exc_value, KeyboardInterrupt):
        sys.__unraisablehook__(lost)
        return
    _lost[0] += 1
    main = threading.main_thread().ident or 0
    again = threading.Timer(AGAIN_S, signal.pthread_kill, (main, signal.SIGINT))
    again.daemon = True
    again.start()


def _hear(woken: socket.socket) -> None:
    """Wait for a signal that somebody sent."""
    woken.recv(1)
    while _lost[0] > 0:
        _lost[0] -= 1
        woken.recv(1)


def _end_late(woken: socket.socket, waker: socket.socket) -> None:
    """Wait for a signal, then for the process to end; end it when its patience is over, or by a second signal."""
    _hear(woken)
    if _patience[0] > PATIENCE_S:
        os.write(2, b"\nInterrupted; what it has is being written. Interrupt again to end it at once.\n")
    until = time.monotonic() + _patience[0]
    woken.settimeout(_patience[0])
    try:
        _hear(woken)
        until = min(until, time.monotonic() + PATIENCE_S)
    except TimeoutError:
        pass
    time.sleep(max(until - time.monotonic(), 0.0))
    stage = sys.modules.get("subzero.stage")
    if stage and hasattr(stage, "sweep_own"):
        stage.sweep_own()
    _saying.acquire(timeout=SAYING_S)
    if not _said[0]:
        os.write(2, f"\n{words()}\n".encode(errors="replace"))
    os._exit(INTERRUPTED)
