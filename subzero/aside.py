"""Work that no interrupt may break into: done in a thread of its own, for which the main thread waits.

Ctrl-C raises `KeyboardInterrupt` in the main thread, between any two steps of Python's. The compiler does not outlive
that everywhere. LLVM's linker destroys a module, and the next line of Python says that it is gone: interrupted in
between, the module is destroyed once more when its last reference goes, and the interpreter dies of SIGSEGV behind the
command's last words.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, TypeVar

Made = TypeVar("Made")


class _Work(threading.Thread):
    """A piece of work.

    Attributes:
        is_over: set when it is done, or has failed.
        is_given_up: whether nobody waits for it any more.
    """

    def __init__(self, work: Callable[[], Any]) -> None:
        super().__init__(name="aside")
        self._work = work
        self._made: Any = None
        self._error: BaseException | None = None
        self.is_over = threading.Event()
        self.is_given_up = False

    def run(self) -> None:
        """Do it, and keep what comes of it."""
        try:
            self._made = self._work()
        except BaseException as error:
            self._error = error
        finally:
            self.is_over.set()

    def made(self) -> Any:
        """Return what was made; raise what went wrong."""
        if self._error is not None:
            try:
                raise self._error
            finally:
                del self._error  # a ring of references otherwise
        return self._made


def aside(work: Callable[[], Made]) -> Made:
    """Return what is made by work that an interrupt of this call lets go on until it heeds (`heed`) or is done.

    Signals reach the main thread only: others do their work themselves.
    """
    if threading.current_thread() is not threading.main_thread():
        return work()
    thread = _Work(work)
    try:
        thread.start()
        thread.is_over.wait()
    except BaseException:
        thread.is_given_up = True
        raise
    return thread.made()


def heed() -> None:
    """End the work of this thread if nobody waits for it any more: called where it can be broken off.

    Raises:
        KeyboardInterrupt: so it is.
    """
    if getattr(threading.current_thread(), "is_given_up", False):
        raise KeyboardInterrupt
