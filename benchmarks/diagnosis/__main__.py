"""Measure the cases and write the page: ``python -m benchmarks.diagnosis``."""

from __future__ import annotations

import multiprocessing
import os
import sys
from pathlib import Path

import cyclopts
from rich.console import Console

from .cases import BEFORE, SEED, Case, cases
from .results import line, place, read
from .sharing import Shared, share
from .times import keep, timed
from .trial_of import Result, result_of

app = cyclopts.App(name="python -m benchmarks.diagnosis", help_format="plaintext", version_flags=[])
console = Console(highlight=False, width=None if sys.stdout.isatty() else 150)
QUICK = 40
_shared: list[Shared] = []


@app.default
def benchmark(
    *,
    quick: bool = False,
    count: int | None = None,
    workers: int = 2,
    resume: bool = False,
    seed: int = SEED,
    results: Path | None = None,
    page: bool = True,
    kinds: tuple[str, ...] = (),
) -> None:
    """Hide effects in records, let them be found, and write docs/diagnosis_benchmark.md with its figures.

    Args:
        quick: the first 40 cases only.
        count: the first so many of all cases.
        workers: processes.
        resume: keep the results of an interrupted run, and go on behind them.
        seed: of all cases.
        results: where they are kept, one JSON object a line; beside the code if not given.
        page: write the page.
        kinds: only cases of these kinds, such as outside.
    """
    path = results or place(seed, "quick_" if quick else "")
    path.parent.mkdir(parents=True, exist_ok=True)
    if not resume:
        path.unlink(missing_ok=True)
    known = {one["index"] for one in read(path)}
    wanted = [case for case in cases(seed) if not kinds or case.kind in kinds][: QUICK if quick else count]
    measure([case for case in wanted if case.index not in known], path, workers)
    if page:
        from .page import write_page

        if not quick:
            keep(path, timed(seed))
        console.print(f"Written: {write_page(path, place(BEFORE))}")


def measure(wanted: list[Case], path: Path, workers: int) -> None:
    """Diagnose cases in processes of their own; append each result as it comes, and print it."""
    context = multiprocessing.get_context("fork")
    with context.Pool(workers, initializer=_begin) as pool, path.open("a") as file:
        for one in pool.imap_unordered(_measured, wanted):
            file.write(line(one))
            file.flush()
            console.print(line_of(one))


def line_of(one: Result) -> str:
    """Return a result as a line."""
    if "error" in one:
        return f"{one['index']:4d} {one['kind']:8} {one['manoeuvre']:5} ERROR {one['error']}"
    D = " ".join(f"{name} D {d:.0f} ({one['rival'][name]})" for name, d in one["D"].items())
    first, p = next(iter(one["probabilities"].items()))
    named = " + ".join(cause["id"] for cause in one["causes"])
    return (f"{one['index']:4d} {one['kind']:8} {one['manoeuvre']:5} {one['how']:8} {D or one['strange']} → "
            f"{one['verdict']} {named} | first {first} {p:.2f} | {one['seconds']['cpu']:.0f} s")  # fmt: skip


def _begin() -> None:
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    _shared.append(share(1))


def _measured(case: Case) -> Result:
    """Return the result of a case, or why there is none."""
    try:
        return result_of(case, _shared[0])
    except Exception as error:
        return {"index": case.index, "kind": case.kind, "manoeuvre": case.manoeuvre, "error": repr(error)}


if __name__ == "__main__":
    app()
