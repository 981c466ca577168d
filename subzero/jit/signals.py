"""Signals wait while numba compiles or loads code.

Ctrl-C raises `KeyboardInterrupt` between any two steps of Python's main thread. The compiler does not survive that
everywhere: LLVM's linker destroys a module, and the next line of Python notes that it is gone; interrupted in between,
the module is destroyed twice and the interpreter crashes. So signals are deferred until the work is done, or until it
asks for them at a place where it can be broken off.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

_handlers: dict[int, Callable[[int, FrameType | None], Any]] = {}
"""Signal → the handler that it has outside; empty when none is deferred."""
_pending: list[tuple[int, FrameType | None]] = []


@contextmanager
def deferred_signals() -> Iterator[None]:
    """Defer the signals that Python handles until the end of the block; in other threads than the main one, nothing."""
    if _handlers or threading.current_thread() is not threading.main_thread():
        yield
        return
    try:
        for number in signal.valid_signals():
            if callable(handler := signal.getsignal(number)):
                _handlers[number] = handler
                with suppress(ValueError):  # this is not Python's main interpreter
                    signal.signal(number, _defer)
        yield
    finally:
        outside = dict(_handlers)
        for deferred, handler in outside.items():
            with suppress(ValueError):
                signal.signal(deferred, handler)
        _handlers.clear()
        while _pending:
            came, frame = _pending.pop(0)
            outside[came](came, frame)


def deliver_pending() -> None:
    """Handle the signals that wait: called where the work can be broken off, which ends as these will."""
    while _pending and threading.current_thread() is threading.main_thread():
        number, frame = _pending.pop(0)
        _handlers[number](number, frame)


def _defer(number: int, frame: FrameType | None) -> None:
    _pending.append((number, frame))
