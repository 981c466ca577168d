"""Defer signals while numba compiles or loads code.

Ctrl-C raises `KeyboardInterrupt` between any two steps of Python's main thread. The compiler does not tolerate that
everywhere: LLVM's linker destroys a module, and the next line of Python records that it is gone; interrupted in
between, the module is destroyed twice and the interpreter crashes. So signals are deferred until the work is done, or
until `deliver_pending` is called at a place where the work can be interrupted.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

_handlers: dict[int, Callable[[int, FrameType | None], Any]] = {}
"""Signal → its original handler; empty when signals are not deferred."""
_pending: list[tuple[int, FrameType | None]] = []


@contextmanager
def deferred_signals() -> Iterator[None]:
    """Defer the signals that Python handles until the end of the block; in other threads than the main one, do
    nothing.
    """
    # In nested blocks the outermost one defers; Python handles signals in its main thread only.
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
        # All handlers are restored before the first one is called, as that may raise.
        handlers = dict(_handlers)
        for deferred, handler in handlers.items():
            with suppress(ValueError):
                signal.signal(deferred, handler)
        _handlers.clear()
        while _pending:
            came, frame = _pending.pop(0)
            handlers[came](came, frame)


def deliver_pending() -> None:
    """Handle the pending signals: called where the work can be interrupted, as a handler may raise."""
    while _pending and threading.current_thread() is threading.main_thread():
        number, frame = _pending.pop(0)
        _handlers[number](number, frame)


def _defer(number: int, frame: FrameType | None) -> None:
    _pending.append((number, frame))
