"""Report the progress of a command: a bar on the terminal for any work that takes over a second, and one line if the
work stands still, or will take hours: where it stands, the cause of the cost, and the setting to change.

A thread watches the work, so that it reports even while machine code does not return. Compiling does not count as
standing still: it is counted, function by function, on the bar, or without a terminal on a line that grows.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import cache
from time import monotonic
from types import TracebackType
from typing import TYPE_CHECKING

from subzero.cli.output_mode import OUTPUT_MODE
from subzero.errors import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    import scenarios

COMPILING = "Compiling what is not compiled yet (all of it takes about half a minute, once)…"

PATIENCE_S = 1.0
"""Shorter work needs no bar. [s]"""
STANDSTILL_S = 20.0
"""Work that has not moved for so long is reported to stand still; a rate is watched for so long before it counts.
[s]"""
LONG_S = 3600.0
"""Work that will take longer than this is reported. [s]"""
CHECK_S = 1.0
"""So often the thread looks. [s]"""


def progress_bar(words: str, costs: Callable[[], str] = str) -> ProgressBar:
    """Return a progress bar on standard error, above which it is said should something have to be compiled first.

    Arguments as of `ProgressBar`.
    """
    from rich.console import Console

    from subzero.jit.machine_code import before_compiling

    console = Console(stderr=True, highlight=False, quiet=OUTPUT_MODE.get().quiet)
    before_compiling(lambda: console.print(COMPILING))
    return ProgressBar(words, console, costs)


class ProgressBar:
    """A callable that takes the fraction that is done, and shows a bar once the work has taken a while.

    The bar needs a terminal; a standstill is reported anywhere, once, and so is work that will take hours.

    Args:
        words: the name of the work.
        console: the console to print to.
        costs: the cause of the cost of this work, and the setting to change, in a sentence or two.
    """

    def __init__(self, words: str, console: Console, costs: Callable[[], str] = str) -> None:
        self._words, self._console, self._costs = words, console, costs
        self._bar: Progress | None = None
        self._fraction, self._started, self._moved = 0.0, monotonic(), monotonic()
        self._reported: set[str] = set()
        self._counting, self._made, self._opening = False, -1, threading.Lock()
        self._ended = threading.Event()

    def __call__(self, fraction: float, words: str = "") -> None:
        """Show that this fraction, 0 to 1, is done, and the task in progress."""
        if fraction != self._fraction or (words and words != self._words):
            self._moved = monotonic()
        self._words, self._fraction = words or self._words, fraction
        if monotonic() - self._started > PATIENCE_S:
            self._open()
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=fraction, description=self._words)

    def check(self) -> None:
        """Report if the work stands still, or if its rate so far means hours; each once."""
        now = monotonic()
        if _compiling():
            self._started, self._moved = self._started + CHECK_S, now
            self._count()
            return
        self._end_count()
        ran = now - self._started
        left = ran * (1.0 / self._fraction - 1.0) if self._fraction > 0.0 else 0.0
        if now - self._moved >= STANDSTILL_S:
            self._notify("still", f"has not moved on for {now - self._moved:.0f} s")
        elif ran >= STANDSTILL_S and left > LONG_S:
            self._notify("long", f"will take about {left / 3600.0:.2g} hours more at this rate")

    def _notify(self, what: str, news: str) -> None:
        if what not in self._reported:
            self._reported.add(what)
            line = f"{self._words} stands at {100.0 * self._fraction:.3g} % and {news}. {self._costs()}"
            self._console.print(
                printable(line.rstrip()), soft_wrap=True, highlight=False, markup=False, emoji=False
            )

    def _count(self) -> None:
        """Show how many functions are compiled."""
        from subzero.jit.machine_code import compiled_functions, counting

        self._counting = True
        self._open()
        if self._bar is not None:
            words = f"{self._words}: {compiled_functions()} functions compiled"
            self._bar.update(self._bar.task_ids[0], description=words)
        else:
            now = compiled_functions()
            self._console.print(f" {now}" if now != self._made else ".", end="", soft_wrap=True)
            self._console.file.flush()
            self._made, counting[0] = now, True

    def _end_count(self) -> None:
        """Return to the task in progress, once nothing is compiled any more."""
        if self._counting:
            self._counting = False
            if self._bar is not None:
                self._bar.update(self._bar.task_ids[0], description=self._words)
            else:
                from subzero.jit.machine_code import counting

                counting[0] = False
                self._console.print(" functions.", soft_wrap=True)

    def _open(self) -> None:
        """Show a bar with the time that has passed, if there is a terminal for it."""
        from rich.progress import Progress, SpinnerColumn, TimeElapsedColumn

        with self._opening:
            if self._bar is None and self._console.is_terminal and not self._ended.is_set():
                columns = (SpinnerColumn("line"), *Progress.get_default_columns(), TimeElapsedColumn())
                bar = Progress(*columns, console=self._console, transient=True)
                bar.add_task(self._words, total=1.0)
                bar.start()
                self._bar = bar

    def _watch(self) -> None:
        while not self._ended.wait(CHECK_S):
            self.check()

    def __enter__(self) -> ProgressBar:
        _listen()
        threading.Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._end_count()
        with self._opening:
            if self._bar is not None:
                self._bar.stop()


_compilations = [0]
"""How many functions are being compiled now, one inside another."""


def _compiling() -> bool:
    """Return whether numba is compiling."""
    return _compilations[0] > 0


@cache
def _listen() -> None:
    """Count the compilations of numba, from now on."""
    from numba.core import event

    class Count(event.Listener):  # type: ignore[misc]  # numba has no types
        def on_start(self, event: object) -> None:
            _compilations[0] += 1

        def on_end(self, event: object) -> None:
            _compilations[0] -= 1

    event.register("numba:compile", Count())


def costs_of(trial: scenarios.Trial, tethered: bool = True) -> str:
    """Return the costs of a run of a trial, the vehicle's steps or the cable's, and the setting to change."""
    from subzero.model import Model
    from subzero.simulation.memory_estimate import work_of

    work = work_of(trial, Model.of(trial), tethered)
    span = f"{trial.duration:g} s in steps of"
    if work.cable > work.hull:
        return (
            f"What costs is the cable, up to {work.segments} segments, {span} {trial.cable_step:g} s. Try a longer "
            "segment_length_m, a grading, a longer cable_step_s, or a shorter duration_s."
        )
    return f"What costs is the vehicle, {span} {trial.hull_step:g} s. Try a longer hull_step_s or a shorter duration_s."
