"""The command ``subzero sweep``: everything heavy is imported inside it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, Self

from subzero.cli.output_mode import FINE, NOT_STRICT, STOPPED, Flag, StrictOutputMode
from subzero.errors import UserError, missing_extra, printable, whole

if TYPE_CHECKING:
    from subzero.files.atomic_output import OutputFolder
    from subzero.sweeps.api import SweepProgress


def sweep(
    spec: Path,
    /,
    *,
    out: Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: Flag = False,
    output_mode: StrictOutputMode = NOT_STRICT,
) -> int:
    """Run a trial with many values of its parameters, and show what they do.

    Kill it at any moment and give the same command again: it goes on with the members that are not finished.

    Args:
        spec: TOML file that says which trial, which parameters, which design (see docs/sweeps.md).
        out: folder for the files; by default one named after the file, here.
        workers: processes on this machine; by default one for each of its cores.
        scheduler: address of a Dask scheduler, such as tcp://host:8786, to run on its workers instead.
        retry: run members again that failed.
        output_mode: the form of the output.
    """
    if workers is not None and scheduler is not None:
        raise UserError("--workers are processes here, and --scheduler has its own. Leave out one of them.")
    with _executor(workers, scheduler) as executor:
        summary, output_folder = _swept(spec, out, executor, retry)
    from subzero.cli.write_sweep import print_sweep

    print_sweep(summary, output_folder, output_mode)
    return STOPPED if summary["failed"] or (output_mode.strict and summary["warnings"]) else FINE


def _swept(spec: Path, out: Path | None, executor: Any, retry: bool) -> tuple[dict[str, Any], OutputFolder]:
    """Run the sweep of a file, write all of it, and return the summary and the paths of the files."""
    from subzero.files.atomic_output import open_output_folder
    from subzero.sweeps.api import finished
    from subzero.sweeps.plan import read_plan
    from subzero.sweeps.workers import WorkerPool

    plan = read_plan(spec)
    folder = out or Path(spec.stem or "sweep")
    with (
        _Bar(plan.description, len(plan.points.values), folder) as bar,
        finished(plan, folder, workers=executor, progress=bar, retry=retry) as store,
    ):
        from subzero.cli.write_sweep import FILES, write_sweep

        with open_output_folder(folder, FILES) as output_folder:
            pool = executor if isinstance(executor, WorkerPool) else None
            summary = write_sweep(plan, store, output_folder, pool)
    return summary, output_folder


@contextmanager
def _executor(workers: int | None, scheduler: str | None) -> Iterator[Any]:
    """Give a Dask client, or processes here, which begin before the plan is read: they have as much to import."""
    if scheduler is not None:
        with _client(scheduler) as client:
            yield client
        return
    from subzero.sweeps.workers import WorkerPool, cores

    pool = WorkerPool(cores() if workers is None else whole("workers", workers, least=1))
    pool.start()
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


LINE_EVERY_S = 30.0
"""Interval of the lines that report progress if there is no terminal for a bar. [s]"""


class _Bar:
    """Shows how far a sweep is: a bar on a terminal, now and then a line elsewhere; and what an interrupt has left."""

    def __init__(self, words: str, members: int, folder: Path) -> None:
        from subzero.cli import interrupts
        from subzero.cli.progress import progress_bar

        self._bar = progress_bar(
            words, lambda: "Workers compile what is not compiled yet in their first run."
        )
        self._said, self._members, self._finished, self._folder = monotonic(), members, 0, folder
        interrupts.set_exit_message(self._left)

    def __enter__(self) -> Self:
        self._bar.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._bar.__exit__(*error)

    def __call__(self, progress_now: SweepProgress) -> None:
        """Show how far it is."""
        self._finished = progress_now.finished
        words = _in_words(progress_now)
        self._bar(progress_now.finished / progress_now.members, words)
        if not sys.stderr.isatty() and monotonic() - self._said > LINE_EVERY_S:
            self._said = monotonic()
            print(words, file=sys.stderr)

    def _left(self) -> str:
        return (
            f"{self._finished} of {self._members} members are kept in {printable(str(self._folder))}; "
            "the same command goes on from there"
        )


def _in_words(progress_now: SweepProgress) -> str:
    """Return how far a sweep is, its rate, how long it will take, and how many members failed."""
    parts = [f"{progress_now.finished} of {progress_now.members} members"]
    if progress_now.rate > 0.0:
        parts += [f"{progress_now.rate:.3g}/s", f"{_span(progress_now.seconds_left)} left"]
    member, seconds = progress_now.slowest
    if member >= 0:
        parts += [f"member {member} alone took {_span(seconds)}"]
    return ", ".join([*parts, *([f"{progress_now.failed} failed"] if progress_now.failed else [])])


def _span(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


@contextmanager
def _client(scheduler: str) -> Iterator[Any]:
    """Give a client of a Dask scheduler."""
    try:
        import distributed
    except ImportError:
        raise missing_extra("--scheduler", "Dask", "cluster") from None
    connect: Any = distributed.Client
    try:
        client = connect(scheduler, timeout=CONNECT_S)
    except (OSError, ValueError, TypeError) as error:
        raise UserError(
            f"No Dask scheduler answers at {scheduler} ({error}). Start one with 'dask scheduler',"
            " or leave out --scheduler."
        ) from error
    with client:
        yield client


CONNECT_S = 10
"""So long is waited for a scheduler's answer. [s]"""
