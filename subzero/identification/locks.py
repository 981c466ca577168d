"""Locks on a name, besides its probability: the prediction of what was not fitted.

Of records that were held out the prediction must surely improve. Where the record itself is divided, it must not surely
get worse by the noise of the sensors: other parameters may bend so far that a short last part looks the same. (Wider
tolerances are a term of the search: what they explain as well is undecided there.)

    gain = Σ (e/ν)² without the term − Σ (e/ν)² with it     in free simulation of readings that were not fitted

The interval of the gain is a bootstrap over blocks of time (Künsch 1989), as residuals are correlated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from subzero.identification.explanation import CLOCK, Entry, Term, Terms, without
from subzero.identification.fit import Fit, free_fit
from subzero.identification.model import COMMAND
from subzero.identification.problem import Problem
from subzero.identification.record import Record

FITTED_SHARE = 0.6
"""Share of a single record that is fitted, where the rest is predicted. [-]"""
BLOCKS, DRAWS, SURE = 20, 2000, 0.05
"""Blocks of a record, draws of the bootstrap, and the share of them outside an interval, to either side."""


@dataclass(frozen=True)
class Gain:
    """How much a term improves the prediction of readings that were not fitted.

    Attributes:
        before, after: root mean square of residuals in free simulation, in levels of the sensors.
        low, high: interval of the improvement of the mean square, in squared levels.
        what: the readings that were predicted.
        strict: whether records were held out.
    """

    before: float
    after: float
    low: float
    high: float
    what: str
    strict: bool

    @property
    def holds(self) -> bool:
        """Whether the prediction improves: surely, if records were held out; else is not surely worse by a level."""
        return self.low > 0.0 if self.strict else self.high > -1.0


@dataclass(frozen=True)
class Locks:
    """The locks of a term.

    Attributes:
        gain: on what was not fitted; None if that cannot be tried, as it begins too late.
        reasons: why it may not be named; () if it may.
    """

    gain: Gain | None
    reasons: tuple[str, ...]


def locks(problem: Problem, best: Fit, held_out: Sequence[Record]) -> dict[str, Locks]:
    """Return the locks of every term of the best explanation: id → locks."""
    having: dict[str, list[np.ndarray]] = {}
    return {
        term.id: _locks(problem, best, term, held_out, having)
        for term in best.terms
        if term.kind != "tolerances"
    }


def _locks(
    problem: Problem,
    best: Fit,
    term: Term,
    held_out: Sequence[Record],
    having: dict[str, list[np.ndarray]],
) -> Locks:
    gain = held_out_gain(problem, best, term, held_out, having)
    reasons = [f"{name} may as well act late or early" for name in _late_commands(problem, term)]
    if gain is not None and not gain.holds:
        reasons.append(
            f"it does not surely predict {gain.what}: {gain.before:.2f} levels of the sensors without it, "
            f"{gain.after:.2f} with it"
        )
    return Locks(gain, tuple(reasons))


def _late_commands(problem: Problem, term: Term) -> list[str]:
    """Return the commands that may as well act late: those that may be off, if all readings are late together."""
    if term.kind != "delay" or (term.target != CLOCK and len(problem.channels) > 1):
        return []
    names = [each.name for each in problem.model.unknown]
    return [name.removeprefix(COMMAND) for name in names if name.startswith(COMMAND)]


def held_out_gain(
    problem: Problem,
    best: Fit,
    term: Term,
    held_out: Sequence[Record],
    having: dict[str, list[np.ndarray]],
) -> Gain | None:
    """Return the gain of a term in free simulation of what was not fitted; None if that cannot be tried.

    Of several records each is predicted by a fit of the others; of a single one the last part by a fit of the first.
    What is predicted with all terms is kept in `having`.
    """
    if held_out:
        folds = [(list(problem.records), list(held_out), -math.inf)]
        what = "the records that were held out"
    elif len(problem.records) > 1:
        folds = [
            (problem.records[:k] + problem.records[k + 1 :], [record], -math.inf)
            for k, record in enumerate(problem.records)
        ]
        what = "each record by a fit of the others"
    else:
        (record,) = problem.records
        split = float(record.time[0] + FITTED_SHARE * np.ptp(record.time))
        if (
            (math.isfinite(term.begins) and term.kind == "cause")
            or term.begins > split
            or term.kind == "stuck"
        ):
            return None
        folds = [([record.between(-math.inf, split)], [record], split)]
        what = "the last part of the record by a fit of the first"
    if what not in having:
        having[what] = _predicted(problem, best, best.terms, folds)
    lacking = _predicted(problem, best, without(best.terms, term), folds)
    return _gain(having[what], lacking, what, strict=bool(held_out))


Fold = tuple[Sequence[Record], Sequence[Record], float]
"""Records that are fitted, records that are predicted, the time from which predictions count."""


def _predicted(problem: Problem, best: Fit, terms: Terms, folds: Sequence[Fold]) -> list[np.ndarray]:
    """Return squared residuals of predictions, in levels of the sensors: one row of time for each channel of a fold."""
    squares, levels = [], problem.levels(best.terms)
    for fitted_records, predicted_records, begin in folds:
        here = tuple(replace(term, record=-1) for term in terms)
        learned = free_fit(Problem(problem.model, fitted_records), here, _shared(best))
        fixed = {entry.identity: value for entry, value in learned.values.items() if entry.record < 0}
        there = Problem(problem.model, predicted_records, fixed)
        predicted = free_fit(there, here, learned.values if begin > -math.inf else {})
        for name, e in predicted.linear.e.items():
            kept = there.used(name, here) & (there.channels[name].time > begin)
            if name in levels and kept.any():
                squares.append((e[kept] / levels[name]) ** 2)
    return squares


def _shared(best: Fit) -> dict[Entry, float]:
    """Return the numbers of a fit that all records share."""
    return {entry: value for entry, value in best.values.items() if entry.record < 0}


def _gain(having: Sequence[np.ndarray], lacking: Sequence[np.ndarray], what: str, *, strict: bool) -> Gain:
    """Return the gain between squared residuals with and without a term, with its bootstrap interval."""
    better = np.concatenate([b - a for a, b in zip(having, lacking, strict=True)])
    blocks = np.array([np.mean(part) for part in np.array_split(better, min(BLOCKS, better.size))])
    draws = np.random.default_rng(0).integers(0, blocks.size, (DRAWS, blocks.size))
    means = blocks[draws].mean(axis=1)
    low, high = (float(np.quantile(means, share)) for share in (SURE, 1.0 - SURE))
    if not np.isfinite(blocks).all():
        low = high = _sign(having, lacking)
    before, after = (float(np.sqrt(np.mean(np.concatenate(rows)))) for rows in (lacking, having))
    return Gain(before, after, low, high, what, strict)


def _sign(having: Sequence[np.ndarray], lacking: Sequence[np.ndarray]) -> float:
    """Return the gain where a free simulation fails: infinite if only that without the term does."""
    fails = [not np.isfinite(np.concatenate(rows)).all() for rows in (having, lacking)]
    return math.inf if fails == [False, True] else -math.inf
