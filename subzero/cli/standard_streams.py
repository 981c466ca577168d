"""Standard output and error of a command that may have no reader: closed, piped to ``head``, or on a full disk.

The work of a command and the files that it delivers matter more than what it prints. So a stream that can no longer be
written is replaced by the null device, and the work goes on. That a reader has gone is no error; any other reason is
kept in `Stream.error`, for the exit code.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any, TextIO


class Stream:
    """A standard stream whose writing never raises.

    Attributes:
        error: why the stream could not be written; None if it could, or if nothing reads it any more.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.error: OSError | None = None

    def write(self, text: str) -> int:
        """Write a text; return its length."""
        self._attempt(lambda: self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        self._attempt(self._stream.flush)

    def _attempt(self, action: Callable[[], object]) -> None:
        try:
            action()
        except BrokenPipeError:
            self._drop()
        except OSError as error:
            self.error = error
            self._drop()

    def _drop(self) -> None:
        """Send the rest of the buffer, and all later output, to the null device."""
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, self._stream.fileno())
        os.close(null)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def protect() -> None:
    """Make standard output and error of this process streams whose writing never raises."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:  # closed: otherwise the next file that is opened would take its number
            setattr(sys, name, open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115
    sys.stdout, sys.stderr = Stream(sys.stdout), Stream(sys.stderr)


def output_error() -> OSError | None:
    """Return why standard output could not be written, if it could not; call it at the end."""
    sys.stdout.flush()
    return getattr(sys.stdout, "error", None)
