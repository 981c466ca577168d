"""How long one diagnosis takes on this machine, nothing shared: to the first screen, and to the verdict."""

from __future__ import annotations

import json
from math import inf
from pathlib import Path
from time import perf_counter

from subzero.diagnosis.diagnose import diagnose

from .cases import SEED, Case, make

LIMITS = {"fig6": (3.0, 15.0), "rich": (inf, 30.0)}
"""Manoeuvre → how long the first screen and the verdict may take; infinite where nothing is asked. [s]"""
CAUSES = {"healthy": (), "one hidden": ("roll_stiffness",), "two hidden": ("roll_stiffness", "motor_lag")}
Row = tuple[str, str, float, float]


def timed(seed: int = SEED) -> list[Row]:
    """Return (manoeuvre, what is hidden, seconds to the screen, to the verdict); the compiler's time is left out."""
    _diagnosed(seed, "fig6", ())
    return [(manoeuvre, words, *_diagnosed(seed, manoeuvre, causes)) for manoeuvre in LIMITS
            for words, causes in CAUSES.items()]  # fmt: skip


def _diagnosed(seed: int, manoeuvre: str, causes: tuple[str, ...]) -> tuple[float, float]:
    """Return how long one diagnosis takes. [s]"""
    kind = ("healthy", "single", "pair")[len(causes)]
    made = make(Case(seed=seed, index=10_000, kind=kind, number=0, manoeuvre=manoeuvre, causes=causes))
    start = perf_counter()
    verdict = diagnose([made.logged], budget="verdict")
    return verdict.seconds["screen"], perf_counter() - start


def keep(results: Path, rows: list[Row]) -> None:
    """Write the times beside the results."""
    results.with_suffix(".times.json").write_text(json.dumps(rows))


def kept(results: Path) -> list[Row]:
    """Return the times that were measured with some results."""
    path = results.with_suffix(".times.json")
    return [tuple(row) for row in json.loads(path.read_text())] if path.exists() else []
