"""Locks on a name, besides its probability: the prediction of what was not fitted.

Of records that were held out the prediction must surely improve. Where the record itself is divided, it must not surely
get worse by the noise of the sensors: other parameters may bend so far that a short last part looks the same. (Wider
tolerances are a term of the search: what they explain as well is undecided there.)

    gain = Σ (e/ν)² without the term − Σ (e/ν)² with it     in free simulation of readings that were not fitted

A history says nothing about another time: where an explanation has an unknown input, every second part of a record is
left out, and predicted.

The interval of the gain is a bootstrap over blocks of time (Künsch 1989), as residuals are correlated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from subzero.identification.explanation import CLOCK, Entry, Term, Terms, data_terms, without
from subzero.identification.fit import Fit, Products, free_fit, spreads
from subzero.identification.model import COMMAND
from subzero.identification.nearness import rests_on_histories, witnesses
from subzero.identification.problem import FEWEST_SAMPLES, Problem
from subzero.identification.record import Record

FITTED_SHARE = 0.6
"""Share of a single record that is fitted, where the rest is predicted. [-]"""
FEWEST_GAPS = 4.0
"""A part that is left out is no longer than a record over this. [-]"""
MOST = 0.5
"""Where unknown inputs act for a longer share of the time, and a channel rests on them, little bears witness. [-]"""
PLAIN = ("unit", "stuck")
"""Kinds of terms that are named all the same: a known unit is plain, also where a model follows with an input's help,
if its factor is seen or another channel agrees with the model (and `nearness` sees to it that the unit is not all that
explains a channel); so are equal readings. Another sign or a turn is not: a model that is wrong may go the other way.
"""
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


def locks(problem: Problem, best: Fit, held_out: Sequence[Record], *, settled: bool) -> dict[str, Locks]:
    """Return the locks of every term of the best explanation: id → locks.

    Args:
        problem: records and model.
        best: the fit of the explanation.
        held_out: records that no fit has seen.
        settled: whether all next to the explanation was tried.
    """
    terms, gap = [term for term in best.terms if term.kind != "tolerances"], _gap(problem, best.terms)
    split = _split(problem, held_out) if gap == math.inf else -math.inf
    tried = [term for term in terms if not _begins_too_late(term, split)]
    histories = [term for term in tried if term.kind == "unknown"]
    others = [term for term in tried if term not in histories]
    gains: dict[str, Gain] = {}
    if histories:
        gains |= _gains(problem, best, histories, _with_gaps(problem, gap))
    if others:
        gains |= _gains(problem, best, others, _folds(problem, held_out, split, gap))
    rests = _share_unknown(problem, terms) > MOST and rests_on_histories(problem, best)
    doubted = _doubted(problem, best, rests=rests)
    return {
        term.id: _locks(
            term,
            gains.get(term.id),
            [*_late_commands(problem, term), *doubted.get(term.id, ())],
            settled,
        )
        for term in terms
    }


def _locks(term: Term, gain: Gain | None, reasons: Sequence[str], settled: bool) -> Locks:
    found = list(reasons)
    if not settled and not _is_plain(term):
        found.append("the search was ended before all that is next to it was tried")
    if gain is not None and not gain.holds:
        found.append(
            f"it does not surely predict {gain.what}: {gain.before:.2f} levels of the sensors without it, "
            f"{gain.after:.2f} with it"
        )
    return Locks(gain, tuple(found))


def _doubted(problem: Problem, best: Fit, *, rests: bool) -> dict[str, list[str]]:
    """Return term → why an error of the model may look like it: where channels rest on unknown inputs all but these and
    plain ones; and a unit with a factor that the readings hardly show, if no other channel bears witness to the model.
    """
    found: dict[str, list[str]] = {}
    for term in best.terms:
        is_factor = term.kind == "unit" and _is_plain(term)
        if rests and not _is_plain(term) and term.kind != "unknown":
            found[term.id] = [
                "an unknown input acts for most of the time, without which the model explains less than half of a "
                "channel"
            ]
        elif (
            is_factor
            and witnesses(problem, best) <= {term.target}
            and _by_chance(problem, best, term) > 2.0 * SURE
        ):
            found[term.id] = [
                "no other channel agrees with the model as it is, and another factor may serve as well"
            ]
    return found


def _is_plain(term: Term) -> bool:
    """Return whether no error of the model looks like a term: a unit with a factor, equal readings."""
    return term.kind in PLAIN and not (term.kind == "unit" and abs(term.factor) == 1.0)


def _by_chance(problem: Problem, best: Fit, term: Term) -> float:
    """Return the probability that one of a channel's known factors is where the readings say that any factor is, if all
    factors between the least and the largest are equally probable.
    """
    units = [each for each in data_terms(problem.model) if (each.kind, each.target) == ("unit", term.target)]
    logs = np.unique(np.log(np.abs([each.factor for each in units])))
    sd = _spread_of_factor(problem, best, term, float(np.ptp(logs)))
    return float((logs != 0.0).sum() * 2.0 * ndtri(1.0 - SURE) * sd / np.ptp(logs))


def _spread_of_factor(problem: Problem, best: Fit, term: Term, prior: float) -> float:
    """Return the standard deviation of the logarithm of a unit's factor, were it free with a wide prior."""
    linear, name = best.linear, term.target
    others = [i for i, entry in enumerate(best.entries) if (entry.kind, entry.name) != ("gain", name)]
    J = {
        each: np.column_stack([columns[:, others], np.zeros(len(columns))])
        for each, columns in linear.J.items()
    }
    at = problem.where(problem.readings_of(name, best.terms), term)
    J[name][at, -1] = (problem.recorded(name, best.terms) - linear.e[name])[at]
    sd = np.append(spreads([best.entries[i] for i in others], linear.levels), prior)
    A, *_ = Products(problem, best.terms, linear.e, J).total(linear.levels.noise)
    variance = np.linalg.inv(sd[:, None] * A * sd + np.eye(sd.size))[-1, -1]
    return prior * math.sqrt(
        max(variance, 0.0)
    )  # rounding may leave less than nothing of a factor that is plain


def _share_unknown(problem: Problem, terms: Sequence[Term]) -> float:
    """Return the share of the time in which unknown inputs act that terms say. [-]"""
    acts = [
        min(term.ends, record.time[-1]) - max(term.begins, record.time[0])
        for term in terms
        for k, record in enumerate(problem.records)
        if term.kind == "unknown" and term.record in (-1, k)
    ]
    return float(sum(acts) / sum(np.ptp(record.time) for record in problem.records))


def _late_commands(problem: Problem, term: Term) -> list[str]:
    """Return that commands may as well act late: those that may be off, if all readings are late together."""
    if term.kind != "delay" or (term.target != CLOCK and len(problem.channels) > 1):
        return []
    names = [each.name for each in problem.model.always if each.name.startswith(COMMAND)]
    return [f"{name.removeprefix(COMMAND)} may as well act late or early" for name in names]


class Fold(NamedTuple):
    """Records that are fitted, records that are predicted, the time from which predictions count [s], and their name:
    records that were held out, if it is strict.

    Starts and histories of the predicted records are fitted to the readings that are seen: all, or those that gaps
    leave, and then only the others count.
    """

    fitted: Problem
    predicted: Problem
    begin: float
    what: str
    strict: bool = False
    seen: Problem | None = None


def _split(problem: Problem, held_out: Sequence[Record]) -> float:
    """Return the time at which a single record is divided; −∞ if whole records are predicted. [s]"""
    time = problem.records[0].time
    whole = held_out or len(problem.records) > 1
    return -math.inf if whole else float(time[0] + FITTED_SHARE * np.ptp(time))


def _begins_too_late(term: Term, split: float) -> bool:
    """Return whether a fit of the first part of a record says nothing about a term."""
    late = term.begins > split or term.kind == "stuck" or (term.kind == "cause" and term.begins > -math.inf)
    return split > -math.inf and late


def _gap(problem: Problem, terms: Terms) -> float:
    """Return how long readings are left out at once: the time in which the quickest unknown input of an explanation
    changes, or a part of the shortest record; ∞ if it has none. [s]
    """
    acting = {term.target for term in terms if term.kind == "unknown"}
    times = [each.time for each in problem.model.offered if each.name in acting]
    shortest = min(float(np.ptp(record.time)) for record in problem.records)
    return min([*times, shortest / FEWEST_GAPS]) if times else math.inf


def _with_gaps(problem: Problem, gap: float) -> list[Fold]:
    """Return the prediction of every second part of records, each as long as a gap [s], by a fit of the others; none if
    these are too few.
    """
    what = "every second part of the record by a fit of the others"
    seen = _seen(problem, gap)
    return [Fold(seen, problem, -math.inf, what, seen=seen)] if seen else []


def _seen(whole: Problem, gap: float) -> Problem | None:
    """Return records without every second part, each as long as a gap [s]; None if too few readings are left."""
    start = [record.time[0] for record in whole.records]
    gaps = {
        name: np.floor((each.time - np.take(start, each.record)) / gap) % 2 == 1
        for name, each in whole.channels.items()
    }
    left = [(np.isfinite(each.values) & ~gaps[name]).sum() for name, each in whole.channels.items()]
    return Problem(whole.model, whole.without(gaps)) if min(left) >= FEWEST_SAMPLES else None


def _folds(problem: Problem, held_out: Sequence[Record], split: float, gap: float = math.inf) -> list[Fold]:
    """Return the predictions to make: of records that were held out; of several records each by a fit of the others; of
    a single one the last part by a fit of the first. With an unknown input the predicted records have gaps. [s]
    """
    if gap < math.inf and not held_out and len(problem.records) == 1:
        return _with_gaps(problem, gap)
    records, model = problem.records, problem.model

    def seen(there: Problem) -> Problem | None:
        return _seen(there, gap) if gap < math.inf else None

    if held_out:
        there = Problem(model, held_out)
        return [Fold(problem, there, split, "the records that were held out", strict=True, seen=seen(there))]
    if split > -math.inf:
        first = Problem(model, [records[0].between(-math.inf, split)])
        return [Fold(first, problem, split, "the last part of the record by a fit of the first")]
    parts = [
        (Problem(model, records[:k] + records[k + 1 :]), Problem(model, [r])) for k, r in enumerate(records)
    ]
    return [Fold(*part, split, "each record by a fit of the others", seen=seen(part[1])) for part in parts]


def _gains(problem: Problem, best: Fit, tried: Sequence[Term], folds: Sequence[Fold]) -> dict[str, Gain]:
    """Return the gain of terms in free simulation of what was not fitted: id → gain; none if there is nothing."""
    having = _predicted(problem, best, best.terms, folds)
    if not having:
        return {}
    return {
        term.id: _gain(having, _predicted(problem, best, without(best.terms, term), folds), folds[0])
        for term in tried
    }


Squares = tuple[np.ndarray, np.ndarray]
"""Squared residuals of a channel (m,), in levels of its sensor, and which of its readings they are of (n,)."""


def _predicted(problem: Problem, best: Fit, terms: Terms, folds: Sequence[Fold]) -> list[Squares]:
    """Return the squares of predictions: for each channel of a fold."""
    squares, levels, sizes = [], problem.levels(best.terms), best.linear.levels.sizes
    for fold in folds:
        here = tuple(replace(term, record=-1) for term in terms)
        learned = free_fit(fold.fitted, here, _shared(best), sizes)
        fixed = {entry.identity: value for entry, value in learned.values.items() if entry.record < 0}
        there = fold.predicted.with_fixed(fixed)
        known = learned.values if fold.begin > -math.inf or fold.seen is fold.fitted else {}
        seen = fold.seen.with_fixed(fixed) if fold.seen else there
        predicted = free_fit(seen, here, known, sizes)
        e, _ = there.residuals(here, predicted.entries, [predicted.x])
        for name in predicted.linear.e:
            kept = there.used(name, here) & (there.channels[name].time > fold.begin)
            if fold.seen:
                kept &= ~np.isfinite(seen.channels[name].values)
            if name in levels and kept.any():
                squares.append(((e[name][kept, 0] / levels[name]) ** 2, kept))
    return squares


def _shared(best: Fit) -> dict[Entry, float]:
    """Return the numbers of a fit that all records share."""
    return {entry: value for entry, value in best.values.items() if entry.record < 0}


def _of_both(
    having: Sequence[Squares], lacking: Sequence[Squares]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the squares of readings that both predictions are of."""
    pairs = [
        ((a, kept), (b, other), kept & other) for (a, kept), (b, other) in zip(having, lacking, strict=True)
    ]
    return [a[both[kept]] for (a, kept), _, both in pairs], [b[both[other]] for _, (b, other), both in pairs]


def _gain(with_term: Sequence[Squares], without_term: Sequence[Squares], fold: Fold) -> Gain:
    """Return the gain between squared residuals with and without a term, with its bootstrap interval."""
    having, lacking = _of_both(with_term, without_term)
    better = np.concatenate([b - a for a, b in zip(having, lacking, strict=True)])
    blocks = np.array([np.mean(part) for part in np.array_split(better, min(BLOCKS, better.size))])
    draws = np.random.default_rng(0).integers(0, blocks.size, (DRAWS, blocks.size))
    means = blocks[draws].mean(axis=1)
    low, high = (float(np.quantile(means, share)) for share in (SURE, 1.0 - SURE))
    if not np.isfinite(blocks).all():
        low = high = _sign(having, lacking)
    before, after = (float(np.sqrt(np.mean(np.concatenate(rows)))) for rows in (lacking, having))
    return Gain(before, after, low, high, fold.what, fold.strict)


def _sign(having: Sequence[np.ndarray], lacking: Sequence[np.ndarray]) -> float:
    """Return the gain where a free simulation fails: infinite if only that without the term does."""
    fails = [not np.isfinite(np.concatenate(rows)).all() for rows in (having, lacking)]
    return math.inf if fails == [False, True] else -math.inf
