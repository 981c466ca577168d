"""What each setting of the search is worth: it is halved and doubled, and what changes in the verdicts is printed.

    python -m benchmarks.diagnosis.settings                            # every setting, a few quick cases
    python -m benchmarks.diagnosis.settings --names CLOSE_NATS,MAX_STEPS --count 3
    python -m benchmarks.diagnosis.settings --together LINEAR_NATS=8,FAR_NATS=30   # these at once

A case is a challenge (`subzero.challenge`): a manoeuvre, a seed and what is hidden. Compared with the settings as they
are: the verdict, what comes first, its probability (to 0.05), and how many simulations it took. A setting that changes
nothing here either way may still do something on a record that is harder than these.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

SAME_PROBABILITY = 0.05
"""Probabilities that differ by less are the same."""
CASES = (
    ("zigzag", 3, None),
    ("fig6", 2, None),
    ("zigzag", 7, None),
    ("fig6", 12, None),
    ("current", 9, None),
    ("zigzag", 1, "sudden"),
    ("dive", 1, "pair"),
    ("zigzag", 1, "outside"),
)
"""Manoeuvre, seed, and what is hidden (None: as the seed draws it)."""

Value = float | int | tuple[float, ...]


class Told(NamedTuple):
    """What a diagnosis tells: verdict, what comes first with its probability, and how many simulations it took."""

    verdict: str
    first: str
    probability: float
    runs: int

    def differs(self, other: Told) -> bool:
        """Say whether a user would be told something else."""
        apart = abs(self.probability - other.probability) > SAME_PROBABILITY
        return (self.verdict, self.first) != (other.verdict, other.first) or apart


def reported(case: tuple[str, int, str | None], changes: Mapping[str, Value]) -> Told:
    """Return what is told of a case with some settings changed."""
    import subzero
    from subzero.diagnosis.inference import settings
    from subzero.diagnosis.inference.simulator import RunCache

    asked, count = 0, RunCache.count

    def counted(self: RunCache, more: int) -> None:
        nonlocal asked
        asked += more
        count(self, more)

    as_they_are = {name: getattr(settings, name) for name in changes}
    RunCache.count = counted
    try:
        for name, value in changes.items():
            setattr(settings, name, value)
        scenario, seed, kind = case
        with tempfile.TemporaryDirectory() as folder:
            subzero.challenge(scenario, seed, folder, **({"kind": kind} if kind else {}))
            verdict = subzero.diagnose(Path(folder) / "record.csv", scenario, budget="verdict")
    finally:
        RunCache.count = count
        for name, value in as_they_are.items():
            setattr(settings, name, value)
    first, p = max(verdict.probabilities.items(), key=lambda pair: pair[1])
    return Told(verdict.verdict, first, float(p), asked)


def values_of_settings() -> dict[str, Value]:
    """Return the settings as they are."""
    from subzero.diagnosis.inference import settings

    return {name: value for name, value in vars(settings).items() if name.isupper()}


def scaled(value: Value, factor: float) -> Value:
    """Return a setting times a factor; a count stays one, of at least 1."""
    if isinstance(value, tuple):
        return tuple(factor * one for one in value)
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


def variants(names: list[str], together: Mapping[str, Value]) -> Iterator[tuple[str, dict[str, Value]]]:
    """Give what is tried: words, and the settings that are changed."""
    if together:
        yield "together", dict(together)
        return
    known = values_of_settings()
    for name in names or known:
        for words, factor in (("halved", 0.5), ("doubled", 2.0)):
            if scaled(known[name], factor) != known[name]:
                yield f"{name} {words}", {name: scaled(known[name], factor)}


def row(words: str, found: list[Told], plain: list[Told], cases: list[Any]) -> str:
    """Return a line: what changed, in which cases, and the simulations by those of the settings as they are."""
    runs = sum(one.runs for one in found) / sum(one.runs for one in plain)
    other = [
        f"{scenario} {seed}: {now.verdict} {now.first} {now.probability:.2f}"
        f" (was {was.verdict} {was.first} {was.probability:.2f})"
        for (scenario, seed, _), now, was in zip(cases, found, plain, strict=True)
        if now.differs(was)
    ]
    return f"{words:<42}{runs:>6.2f}  {len(other)} of {len(cases)}  {'; '.join(other)}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--names", default="", help="settings, with commas between; all if not given")
    parser.add_argument(
        "--together", default="", help="NAME=VALUE, with commas between: only these, all at once"
    )
    parser.add_argument("--count", type=int, default=len(CASES), help="how many of the cases")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    asked = parser.parse_args()
    cases = list(CASES[: asked.count])
    together = {name: json.loads(value) for name, value in
                (pair.split("=") for pair in asked.together.split(",") if pair)}  # fmt: skip
    print(f"{'setting':<42}{'runs':>6}  other verdicts", flush=True)
    with ProcessPoolExecutor(asked.workers, mp_context=get_context("spawn")) as pool:
        plain = list(pool.map(reported, cases, [{}] * len(cases)))
        for words, changes in variants([name for name in asked.names.split(",") if name], together):
            print(
                row(words, list(pool.map(reported, cases, [changes] * len(cases))), plain, cases), flush=True
            )


if __name__ == "__main__":
    main()
