"""Do verdicts degrade honestly? More records like the degraded ones: ``python -m benchmarks.diagnosis.degraded``.

Three times the noise, two channels, 10 s, true spreads of twice and of half the declared tolerances; healthy records
must not get names, and single causes must become sets rather than wrong names.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cyclopts
import numpy as np

from .__main__ import measure
from .cases import DEGRADED, SEED, Case
from .manoeuvres import ids
from .results import place, read
from .scores import Result, Score, first, names, share, truth, wrongly_sure

HEALTHY = {how: 60 if how == "wide" else 20 for how in DEGRADED}
"""How → healthy records; most of those whose true spread is twice the declared one, as the target names them."""
SINGLES = 10
"""Records with one cause, of each."""
FIRST = 20_000
"""Index of the first of these cases, behind all others."""
app = cyclopts.App(name="python -m benchmarks.diagnosis.degraded", help_format="plaintext", version_flags=[])


@app.default
def benchmark(*, workers: int = 2, seed: int = SEED, results: Path | None = None) -> None:
    """Diagnose degraded records, and keep what was said for the page of the benchmark; an interrupted run goes on.

    Args:
        workers: processes.
        seed: of all cases.
        results: the benchmark's results; these are kept beside them.
    """
    path = beside(results or place(seed))
    done = {one["index"] for one in read(path)}
    measure([case for case in degraded(seed) if case.index not in done], path, workers)


def beside(results: Path) -> Path:
    """Return where the results of degraded records are kept."""
    return results.with_suffix(".degraded.jsonl")


def kept(results: Path) -> list[Result]:
    """Return the results of degraded records."""
    return read(beside(results))


def degraded(seed: int) -> list[Case]:
    """Return the cases, all kinds in turn."""
    causes = np.random.default_rng([seed, FIRST]).permutation(ids()).tolist()
    wanted = [(i / count, how, ()) for how, count in HEALTHY.items() for i in range(count)]
    wanted += [
        ((i + 0.5) / SINGLES, how, (causes[(k + i * len(DEGRADED)) % len(causes)],))
        for k, how in enumerate(DEGRADED)
        for i in range(SINGLES)
    ]
    return [
        Case(seed=seed, index=FIRST + i, kind="degraded", number=i, manoeuvre="short" if how == "short" else "fig6",
             how=how, causes=hidden)
        for i, (_, how, hidden) in enumerate(sorted(wanted))
    ]  # fmt: skip


def rows(results: Sequence[Result]) -> list[tuple[str, Score, Score, Score]]:
    """Return how, or all → of healthy records, how many have names; of singles, how many are right first, how many are
    called something wrong with certainty.
    """
    found = []
    for how in (*DEGRADED, "all"):
        own = [one for one in results if how in (one["how"], "all") and "error" not in one]
        healthy, single = [one for one in own if not one["truth"]], [one for one in own if one["truth"]]
        found.append((how, share("false names", healthy, lambda one: bool(names(one)), "≤ 5 %", most=0.05),
                      share("right first", single, lambda one: first(one)[0] == truth(one), "–"),
                      share("wrong name", single, wrongly_sure, "–")))  # fmt: skip
    return found


if __name__ == "__main__":
    app()
