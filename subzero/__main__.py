"""``subzero`` and ``python -m subzero``: the command line, which an interrupt may end at any time."""

from __future__ import annotations

import gc

from subzero import interrupts

YOUNG = 50_000
"""So many new objects before Python looks for garbage among them. A command lives for seconds and keeps most of what it
makes: looking at 700, as Python does, is a tenth of it."""


def run() -> None:
    """Run the command line with the words of this process, and end it with its exit code."""
    gc.set_threshold(YOUNG)
    try:
        interrupts.watch()
        from subzero.cli import main

        code = main()
        interrupts.ignore()  # all is done: what comes now cannot change it
    except KeyboardInterrupt:  # before the command line was ready, or while it said so
        interrupts.ignore()
        interrupts.say()
        code = interrupts.INTERRUPTED
    gc.freeze()  # what is left goes with the process: to take it apart first takes a second
    interrupts.leave(code)


if __name__ == "__main__":
    run()
