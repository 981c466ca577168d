"""Tell a waiting user how far a command is: a bar on the terminal for anything that takes over a second."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console

if TYPE_CHECKING:
    from rich.progress import Progress

COMPILING = "Compiling what is not compiled yet (all of it takes about 50 s, once)…"

PATIENCE = 1.0
"""What takes less needs no bar. [s]"""


def progress_bar(words: str) -> ProgressBar:
    """Return a progress bar on standard error, above which it is said should something have to be compiled first."""
    from subzero.machine_code import before_compiling

    console = Console(stderr=True, highlight=False)
    before_compiling(lambda: console.print(COMPILING))
    return ProgressBar(words, console)


class ProgressBar:
    """Called with the fraction that is done, shows a bar once the work has taken a while.

    Nothing is shown where nobody looks: the bar needs a terminal.
    """

    def __init__(self, words: str, console: Console) -> None:
        self._words = words
        self._console = console
        self._bar: Progress | None = None
        self._started = time.monotonic()

    def __call__(self, fraction: float, words: str = "") -> None:
        """Show that this fraction, 0 to 1, is done, and what is being done."""
        self._words = words or self._words
        if self._bar is None and time.monotonic() - self._started > PATIENCE and self._console.is_terminal:
            self._open()
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=fraction, description=self._words)

    def _open(self) -> None:
        from rich.progress import Progress

        self._bar = Progress(console=self._console, transient=True)
        self._bar.add_task(self._words, total=1.0)
        self._bar.start()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()
