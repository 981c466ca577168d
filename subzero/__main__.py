"""``subzero`` and ``python -m subzero``: the command line, which an interrupt may end at any time."""

from __future__ import annotations

import gc
import sys

from subzero.cli import interrupts, standard_streams
from subzero.errors import foreign_package

YOUNG = 50_000
"""So many new objects before Python looks for garbage among them. A command lives for seconds and keeps most of what it
makes: looking at 700, as Python does, is a tenth of it."""

MISTAKE = UNWRITABLE = 2
"""Exit codes of what a user has to change, and where standard output could not be written: files are complete then."""


def run() -> None:
    """Run the command line with the words of this process, and end it with its exit code."""
    gc.set_threshold(YOUNG)
    standard_streams.protect()
    if why := foreign_package():
        print(why, file=sys.stderr)
        sys.exit(MISTAKE)
    try:
        interrupts.watch()
        from subzero.cli.app import main

        code = main()
        if error := standard_streams.output_error():
            print(f"Standard output cannot be written: {error.strerror}.", file=sys.stderr)
            code = code or UNWRITABLE
    except KeyboardInterrupt:  # before the command line was ready, or while it said so
        interrupts.print_interrupted()
        code = interrupts.INTERRUPTED
    gc.freeze()  # the remaining objects go with the process: to take them apart first takes a second
    interrupts.leave(code)


if __name__ == "__main__":
    run()
