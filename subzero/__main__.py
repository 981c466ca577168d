"""``subzero`` and ``python -m subzero``: the command line, which an interrupt may end at any time."""

from __future__ import annotations

from subzero import interrupts


def run() -> None:
    """Run the command line with the words of this process, and end it with its exit code."""
    try:
        interrupts.watch()
        from subzero.cli import main

        code = main()
        interrupts.ignore()  # all is done: what comes now cannot change it
    except KeyboardInterrupt:  # before the command line was ready, or while it said so
        interrupts.ignore()
        interrupts.say()
        code = interrupts.INTERRUPTED
    interrupts.leave(code)


if __name__ == "__main__":
    run()
