"""How long one diagnosis takes on this machine, nothing shared: to the first screen, and to the verdict."""

from __future__ import annotations

import json
from math import inf
from pathlib import Path
from time import perf_counter

from subzero.diagnosis.api import diagnose_trials

from .cases import SEED, Case, cases, make

LIMITS = {"fig6": (3.0, 15.0), "rich": (inf, 30.0)}
"""Manoeuvre → how long the first screen and the verdict may take; infinite where nothing is asked. [s]"""
RECORDS = {"fig6": 9, "rich": 3}
"""Manoeuvre → how many records of each kind are timed: the first ones of the seed."""
KINDS = {"healthy": "healthy", "single": "one hidden", "pair": "two hidden", "sudden": "one from mid-trial on",
         "outside": "outside the catalogue"}  # fmt: skip
Row = tuple[str, str, float, float]


def timed(seed: int = SEED) -> list[Row]:
    """Return (manoeuvre, what is hidden, seconds to the screen, to the verdict); the compiler's time is left out."""
    every = cases(seed)
    _diagnosed(every[0])
    return [(manoeuvre, words, *_diagnosed(case)) for manoeuvre, count in RECORDS.items()
            for kind, words in KINDS.items()
            for case in [one for one in every if (one.kind, one.manoeuvre) == (kind, manoeuvre)][:count]]  # fmt: skip


def _diagnosed(case: Case) -> tuple[float, float]:
    """Return how long one diagnosis takes. [s]"""
    made = make(case)
    start = perf_counter()
    verdict = diagnose_trials([made.logged], seed=case.index, budget="verdict")
    return verdict.seconds["screen"], perf_counter() - start


def keep(results: Path, rows: list[Row]) -> None:
    """Write the times beside the results."""
    results.with_suffix(".times.json").write_text(json.dumps(rows))


def kept(results: Path) -> list[Row]:
    """Return the times that were measured with some results."""
    path = results.with_suffix(".times.json")
    return [tuple(row) for row in json.loads(path.read_text())] if path.exists() else []
