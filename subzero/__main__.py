"""``subzero`` and ``python -m subzero``: the command line, which an interrupt may end at any time.

Standard output and error may have no reader: closed, piped to ``head``, or on a full disk. The work of a command and
the files that it delivers matter more than what it prints. So a stream that can no longer be written is replaced by
the null device, and the work goes on. That a reader has gone is no error; any other reason is kept in `Stream.error`,
for the exit code.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable
from typing import Any, TextIO

from subzero.cli import interrupts
from subzero.errors import foreign_package

YOUNG = 50_000
"""So many new objects before Python looks for garbage among them. A command lives for seconds and keeps most of what it
makes: looking at 700, as Python does, is a tenth of it."""

MISTAKE = UNWRITABLE = 2
"""Exit codes of what a user has to change, and where standard output could not be written: files are complete then."""


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


def protect_streams() -> None:
    """Make standard output and error of this process streams whose writing never raises."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:  # closed: otherwise the next file that is opened would take its number
            setattr(sys, name, open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115
    sys.stdout, sys.stderr = Stream(sys.stdout), Stream(sys.stderr)


def output_error() -> OSError | None:
    """Return why standard output could not be written, if it could not; call it at the end."""
    sys.stdout.flush()
    return getattr(sys.stdout, "error", None)


def run() -> None:
    """Run the command line with the words of this process, and end it with its exit code."""
    gc.set_threshold(YOUNG)
    protect_streams()
    if why := foreign_package():
        print(why, file=sys.stderr)
        sys.exit(MISTAKE)
    try:
        interrupts.watch()
        from subzero.cli.app import main

        code = main()
        if error := output_error():
            print(f"Standard output cannot be written: {error.strerror}.", file=sys.stderr)
            code = code or UNWRITABLE
    except KeyboardInterrupt:  # before the command line was ready, or while it said so
        interrupts.print_interrupted()
        code = interrupts.INTERRUPTED
    gc.freeze()  # the remaining objects go with the process: to take them apart first takes a second
    interrupts.leave(code)


if __name__ == "__main__":
    run()
