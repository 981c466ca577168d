"""Does a verdict survive a rounding? ``python -m benchmarks.diagnosis.jitter``.

Records of `benchmarks.diagnosis.world` are diagnosed again as copies that say the same: with seven significant digits,
as a file has them, and with a hundredth of a noise level added to every sample before the sensor rounds it. A verdict
of a copy repeats if it has the verdict and the first name of the original. What is more probable than it repeats is
sure of the way of the search.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import cyclopts
import numpy as np

from subzero.diagnosis.api import diagnose_trials
from subzero.diagnosis.hypothesis.logged import Logged

from .results import results_of
from .world import Drawn, drawn, record_of

DIGITS = 7
SURE = 0.95
app = cyclopts.App(name="python -m benchmarks.diagnosis.jitter", help_format="plaintext", version_flags=[])
Said = tuple[str, str, float]
"""Verdict, first name, and its probability."""


def with_digits(logged: Logged) -> Logged:
    """Return a copy with DIGITS digits."""
    values = {name: np.array([float(f"{x:.{DIGITS}g}") for x in column])
              for name, column in logged.record.values.items()}  # fmt: skip
    return replace(logged, record=replace(logged.record, values=values))


def result_of(one: Drawn, count: int) -> dict[str, Any]:
    """Return what is said of a record and of its copies: with DIGITS digits, and so many that were shaken."""
    logged, _ = record_of(one)
    rngs = [np.random.default_rng([one.seed, one.index, 9, copy]) for copy in range(count)]
    shaken = [record_of(one, rng)[0] for rng in rngs]
    said = [_said(each, one.index) for each in (logged, with_digits(logged), *shaken)]
    return {"index": one.index, "flown": one.flown, "family": one.family, "cause": one.cause, "said": said}


def _said(logged: Logged, seed: int) -> Said:
    verdict = diagnose_trials([logged], seed=seed, budget="verdict")
    first, p = next(iter(verdict.probabilities.items()))
    return verdict.verdict, first, p


def repeats(result: Mapping[str, Any]) -> list[bool]:
    """Say of every copy whether it has the verdict and the first name of the original."""
    original, *others = result["said"]
    return [tuple(one[:2]) == tuple(original[:2]) for one in others]


def summary(results: Sequence[Mapping[str, Any]]) -> str:
    """Return how many copies repeat, of all and of originals that were sure."""
    sure = [one for one in results if one["said"][0][2] >= SURE]
    return "\n".join(
        f"{name:<24}{sum(sum(repeats(one)) for one in some):5d} of {sum(len(repeats(one)) for one in some):5d} repeat"
        for name, some in (("all", results), (f"originals of p >= {SURE:g}", sure))
    )


def line_of(result: Mapping[str, Any]) -> str:
    """Return a result as a line: the original, and the copies that differ."""
    original, *others = ((verdict, f"{first} {p:.2f}") for verdict, first, p in result["said"])
    differ = [" ".join(one) for one, same in zip(others, repeats(result), strict=True) if not same]
    return (f"{result['index']:4d} {result['flown']:14} {result['family']:12} {result['cause'] or 'healthy'} → "
            f"{' '.join(original)}{'; BUT ' + ', '.join(differ) if differ else ''}")  # fmt: skip


@app.default
def benchmark(
    *,
    count: int = 18,
    copies: int = 5,
    seed: int = 101,
    workers: int = 2,
    results: Path | None = None,
    resume: bool = False,
) -> None:
    """Diagnose records and copies of them that say the same, and print whether the verdicts do.

    Args:
        count: how many records.
        copies: with a little noise, of each.
        seed: of all records.
        workers: processes.
        results: where they are kept, one JSON object a line; nowhere if not given.
        resume: keep the results of an interrupted run, and go on behind them.
    """
    made = partial(result_of, count=copies)
    known = results_of(drawn(seed, count), made, tell=line_of, workers=workers, path=results, resume=resume)
    print(summary(known))


if __name__ == "__main__":
    app()
