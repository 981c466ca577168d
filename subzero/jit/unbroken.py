"""Work that no signal may break into: signals wait until it is done, or until it heeds them.

Ctrl-C raises `KeyboardInterrupt` between any two steps of Python's main thread. The compiler does not outlive that
everywhere. LLVM's linker destroys a module, and the next line of Python says that it is gone: interrupted in between,
the module is destroyed once more when its last reference goes, and the interpreter dies of SIGSEGV behind a command's
last words. (A thread of its own, which signals do not reach, would do for the compiler, but not for the modules that
it looks at: one that calls what it compiles while it is imported would wait for ever.)
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import Any, TypeVar

Made = TypeVar("Made")

_handlers: dict[int, Callable[[int, FrameType | None], Any]] = {}
"""Signal → what Python calls for it when no work is done."""
_came: list[tuple[int, FrameType | None]] = []
"""Signals that wait, and where they came."""
_working = [False]


def unbroken(work: Callable[[], Made]) -> Made:
    """Return what is made by work; a signal that comes meanwhile is heard behind it.

    Python hears signals in the main thread only: others work as they are.
    """
    if _working[0] or threading.current_thread() is not threading.main_thread():
        return work()
    try:
        _hold_back()
        return work()
    finally:
        try:
            _let_go()
        finally:
            heed()


def heed() -> None:
    """Hear the signals that wait; called where work can be broken off, it ends as these will."""
    while _came and threading.current_thread() is threading.main_thread():
        number, frame = _came.pop(0)
        _handlers[number](number, frame)


def _hold_back() -> None:
    """Let all signals that Python hears wait."""
    _working[0] = True
    for number in signal.valid_signals():
        handler = signal.getsignal(number)
        if callable(handler) and handler is not _wait:
            _handlers[number] = handler
            with suppress(ValueError):  # Python runs in a thread of another program
                signal.signal(number, _wait)


def _let_go() -> None:
    """Let signals be heard as before."""
    _working[0] = False
    for number, handler in _handlers.items():
        if signal.getsignal(number) is _wait:
            signal.signal(number, handler)


def _wait(number: int, frame: FrameType | None) -> None:
    """Keep a signal until work is over; hear it at once if another one has kept its own handler from coming back."""
    if _working[0]:
        _came.append((number, frame))
    else:
        _handlers[number](number, frame)
