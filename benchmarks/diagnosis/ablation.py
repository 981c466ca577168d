"""What each rescue of the search is worth: it is switched off, and the same records are diagnosed again.

    python -m benchmarks.diagnosis.ablation [--records 48] [--seed 1] [--only WITHIN,TWINS]

Two carts on springs (the model of tests/identification/test_unknown_input.py) with numbers drawn from their tolerances,
and one of seven things wrong, two of them together, or nothing. A record is right if exactly that is named; wrong if
anything else is. What is worth nothing here, and nothing in the benchmarks of the vehicle, should go.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np

import subzero.diagnosis as sd

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "identification"))
import test_unknown_input as carts

RESCUES: dict[str, tuple[str, Any, str]] = {
    "RANKED_AGAIN": ("ranking", 1, "the best ten are ranked again with their own noise"),
    "FITTED": ("search", 1, "the best six are fitted"),
    "WITHIN": ("search", 0.0, "explanations near the best one are expanded, too"),
    "ONSET_GAIN": ("search", 0.0, "a cause that begins in mid-record may gain when it is fitted"),
    "GROSS_KINDS": ("ranking", (), "gross errors in the data are sought at the nominal model, first"),
    "TWINS": ("search", (), "an error of another channel of the unit is tried in its place"),
    "FEW_CAUSES": ("search", 0, "few causes are all fitted, whatever their rank"),
    "MANY_TERMS": ("search", 99, "unknown inputs are tried where an explanation needs many terms"),
    "TEMPER": ("fit", 1e-9, "a fit from afar takes a share of the residual for noise"),
    "SHARES": ("fit", (1.0,), "a step that does not gain is shortened"),
    "PATIENCE": ("fit", 1, "a fit goes on after a round that gained nothing"),
    "PASSES": ("api", 1, "the search begins anew without outliers"),
    "SIZES_TRIED": ("candidates", 1, "delays of several sizes are tried"),
    "BEGINS_TRIED": ("candidates", 3, "an offset may begin at a hundred times"),
    "TIMES_TRIED": ("noise", (10.0,), "slow noise is sought from several times"),
}
"""Name of a steering number in `subzero.identification` → its module, what switches it off, and what it does."""


class Case(NamedTuple):
    """A record, and the ids that should be named of it."""

    record: sd.Record
    truth: frozenset[str]


def drawn(seed: int) -> Case:
    """Return a record: healthy, or with one thing wrong, or two."""
    rng = np.random.default_rng([seed, 7])
    numbers = {"k": rng.normal(4.0, 0.04), "c": rng.normal(0.3, 0.01), "s": rng.normal(2.0, 0.02)}
    return CASES[seed % len(CASES)](seed, rng, numbers | {"gain": rng.normal(1.0, 0.01)})


def _healthy(seed: int, rng: np.random.Generator, numbers: Mapping[str, Any]) -> Case:
    return Case(carts.record(seed, **numbers), frozenset())


def _cause(seed: int, rng: np.random.Generator, numbers: Mapping[str, Any]) -> Case:
    name, key, factor = (("stiffness", "k", 1.15), ("damping", "c", 1.7), ("drive", "gain", 0.85))[
        int(rng.integers(3))
    ]
    return Case(carts.record(seed, **{**numbers, key: factor * numbers[key]}), frozenset({name}))


def _force(seed: int, rng: np.random.Generator, numbers: Mapping[str, Any]) -> Case:
    side = str(rng.choice(carts.PUSHES))
    pushed = carts.record(seed, **{**numbers, side: carts.hidden(seed, rng.uniform(0.05, 0.3))})
    return Case(pushed, frozenset({f"unknown:{side}"}))


def _unit(case: Case, rng: np.random.Generator) -> Case:
    name, factor = str(rng.choice(["a", "b"])), float(rng.choice([1.0 / 0.3048, 1000.0]))
    return _with(case, f"unit:{name}", **{name: case.record.columns[name] * factor})


def _late(case: Case, rng: np.random.Generator) -> Case:
    """Return the record with a clock that is late by up to half of it."""
    shift = int(rng.integers(5, 100))
    drive = case.record.columns["drive"]
    late = {
        name: np.concatenate([np.full(shift, np.nan), case.record.columns[name][:-shift]]) for name in "ab"
    }
    return _with(case, "delay:clock", drive=drive, **late)


def _step(case: Case, rng: np.random.Generator) -> Case:
    at = int(rng.integers(60, 240))
    moved = case.record.columns["a"] + 0.05 * (np.arange(carts.SAMPLES) >= at)
    return _with(case, "offset:a", a=moved)


def _stuck(case: Case, rng: np.random.Generator) -> Case:
    at, values = int(rng.integers(60, 200)), case.record.columns["b"].copy()
    values[at : at + 60] = values[at]
    return _with(case, "stuck:b", b=values)


def _swapped(case: Case, rng: np.random.Generator) -> Case:
    columns = case.record.columns
    return _with(case, "swapped:a/b", a=columns["b"], b=columns["a"])


def _spikes(case: Case, rng: np.random.Generator) -> Case:
    """Return the record with readings of zero where the motion is not, which are set aside and are no error."""
    values = case.record.columns["a"].copy()
    values[rng.choice(carts.SAMPLES, 4, replace=False)] += rng.choice([-1.0, 1.0], 4)
    return _with(case, "", a=values)


def _with(case: Case, error: str, **columns: np.ndarray) -> Case:
    return Case(carts.changed(case.record, **columns), case.truth | ({error} if error else set()))


def _of(
    base: Callable[..., Case], *errors: Callable[..., Case]
) -> Callable[[int, np.random.Generator, Mapping[str, Any]], Case]:
    """Return how a record with errors in its data is made."""

    def make(seed: int, rng: np.random.Generator, numbers: Mapping[str, Any]) -> Case:
        case = base(seed, rng, numbers)
        for error in errors:
            case = error(case, rng)
        return case

    return make


CASES = (
    _of(_healthy), _of(_cause), _of(_force), _of(_healthy, _unit), _of(_healthy, _late), _of(_healthy, _step),
    _of(_healthy, _stuck), _of(_healthy, _swapped), _of(_cause, _spikes), _of(_cause, _unit), _of(_cause, _step),
    _of(_force, _unit),
)  # fmt: skip


def named(case: Case) -> frozenset[str]:
    """Return the ids of what is named of a record, whenever it begins."""
    found = sd.diagnose(case.record, carts.model()).named
    return frozenset(each.id.partition("@")[0] for each in found)


@contextmanager
def without(name: str) -> Iterator[None]:
    """Switch a rescue off."""
    module, off, _ = RESCUES[name]
    home = importlib.import_module(f"subzero.identification.{module}")
    kept = getattr(home, name)
    setattr(home, name, off)
    try:
        yield
    finally:
        setattr(home, name, kept)


def judged(cases: list[Case]) -> tuple[list[frozenset[str]], float]:
    """Return what is named of each record, and the processor time. [s]"""
    begun = process_time()
    return [named(case) for case in cases], process_time() - begun


def row(name: str, cases: list[Case], names: list[frozenset[str]], ratio: float, words: str) -> str:
    """Return a line of the table."""
    right = sum(found == case.truth for case, found in zip(cases, names, strict=True))
    wrong = sum(bool(found - case.truth) for case, found in zip(cases, names, strict=True))
    return f"{name:14s}{right:7d}{wrong:7d}{ratio:10.2f}  {words}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--records", type=int, default=48)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="some rescues, with commas between")
    given = parser.parse_args()
    cases = [drawn(len(CASES) * given.seed * 100 + i) for i in range(given.records)]
    usual, seconds = judged(cases)
    print(f"{'without':14s}{'right':>7s}{'wrong':>7s}{'CPU ratio':>10s}  of {len(cases)} records")
    print(row("(nothing)", cases, usual, 1.0, f"the search as it is, {seconds:.0f} s"), flush=True)
    for name in filter(None, given.only.split(",")) if given.only else RESCUES:
        with without(name):
            names, own = judged(cases)
        print(row(name, cases, names, own / seconds, RESCUES[name][2]), flush=True)


if __name__ == "__main__":
    main()
