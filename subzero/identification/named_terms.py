"""The terms of the best explanation as a verdict names them: with probability, alternatives, numbers and history."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from subzero.identification.explanation import AFFINE, Entry, Term, kinds_of
from subzero.identification.fit import Fit
from subzero.identification.locks import Locks
from subzero.identification.nearness import Nearness
from subzero.identification.problem import Problem
from subzero.identification.verdict import Estimate, History, Named

NAMED_PROBABILITY = 0.9
"""A term is named from this probability on, over all explanations."""


class Said(NamedTuple):
    """A term of the best explanation, as it is said.

    Attributes:
        term: the term.
        probability: that it holds, over all explanations; or that one of its alternatives does.
        alternatives: terms that say it, the first in the best explanation.
    """

    term: Term
    probability: float
    alternatives: tuple[Term, ...]


def said_of(ranked: Sequence[Fit], probabilities: np.ndarray) -> Iterator[Said]:
    """Yield the terms of the best explanation with their probabilities.

    A term that holds throughout says that something is wrong, which is so as well if it is wrong from some time on.

    Records that show that something changes with time, which no cause explains, may not tell what: of a single unknown
    input or drift the probability is that any of them holds, and the others are its alternatives, the most probable
    first, until one of them holds for sure. So are other units of a channel: kilopascals of sea water are ten to a
    metre, within half a percent.
    """
    # One thing more, unseen, may be added to any explanation.
    every = list(zip(ranked, (probabilities / probabilities.sum()).tolist(), strict=True))
    own: dict[str, float] = {}
    terms: dict[str, Term] = {}
    for each, p in every:
        for term in each.terms:
            what = _what(term)
            terms.setdefault(what, term)
            for claim in {what, what.partition("@")[0]}:
                own[claim] = own.get(claim, 0.0) + p
    anything = sum(p for each, p in every if any(map(_varies, each.terms)))
    single = sum(map(_varies, ranked[0].terms)) == 1
    for term in ranked[0].terms:
        said, varies = [term], single and _varies(term)
        others = [
            what
            for what, each in terms.items()
            if what != _what(term) and ((varies and _varies(each)) or each.id == term.id)
        ]
        others.sort(key=lambda what: own[what])
        while others and sum(own[_what(each)] for each in said) < NAMED_PROBABILITY:
            said.append(terms[others.pop()])
        total = sum(own[_what(each)] for each in said)
        yield Said(term, anything if varies and len(said) > 1 else total, tuple(said))


def _what(term: Term) -> str:
    """Return what a term says, up to "@" whenever it begins."""
    said = f"{term.kind}:{term.target}" if _varies(term) else term.id
    return f"{term.factor:.9g}, {term.offset:.9g} {said}" if term.kind in ("unit", "input") else said


def _varies(term: Term) -> bool:
    """Return whether a term is an unknown history: of an input, or the drift of a sensor."""
    return term.kind in ("unknown", "drift")


def named_term(problem: Problem, best: Fit, said: Said, lock: Locks | None, near: Nearness) -> Named:
    """Return a term of the best explanation with its numbers, or its history, and why it is not named, if it is not.

    Args:
        problem: records and model.
        best: the fit of the explanation.
        said: the term with its probability.
        lock: what was tried with it; None if nothing was.
        near: how near the explanation is to the records.
    """
    term = said.term
    sentences = dict.fromkeys(each.sentence for each in said.alternatives)
    history: tuple[History, ...] = ()
    if not all(each.is_data_error for each in said.alternatives) and _varies(term):
        history = (
            histories(problem, best, term.target) if term.kind == "unknown" else _drifts(problem, best, term)
        )
    return Named(
        id=term.id,
        sentence=", or ".join(sentences),
        is_data_error=term.is_data_error and not history,
        probability=said.probability,
        estimates=() if term.kind == "unknown" else _estimates(problem, best, term),
        gain=lock.gain if lock else None,
        against=lock.reasons if lock else ("the model is not near",) if not near.near else (),
        history=history,
    )


def _drifts(problem: Problem, best: Fit, term: Term) -> tuple[History, ...]:
    """Return the drift of a channel in each record, from its beginning to its end."""
    (drift,) = [i for i, e in enumerate(best.entries) if (e.kind, e.name) == ("drift", term.target)]
    size, sd = 0.5 * float(best.x[drift]), 0.5 * math.sqrt(best.variance[drift])
    unit, ends = problem.model.channels[term.target].unit, (-1.0, 1.0)
    return tuple(
        History(
            each.name,
            unit,
            (float(each.time[0]), float(each.time[-1])),
            tuple(end * size for end in ends),
            (sd, sd),
        )
        for each in problem.records
    )


def histories(problem: Problem, best: Fit, name: str) -> tuple[History, ...]:
    """Return an unknown input in each record where it acts, to the knots next to these, at which it is 0."""
    (unit,) = [each.unit for each in problem.model.unknown if each.name == name]
    found, sd = [], np.sqrt(best.variance)
    for k, record in enumerate(problem.records):
        own = [i for i, e in enumerate(best.entries) if e.identity[:3] == ("unknown", name, k)]
        if not own:
            continue
        time = problem.knots(k, best.entries[own[0]].intervals)
        at = [best.entries[i].knot for i in own]
        rows = np.zeros((2, time.size))
        rows[:, at] = best.x[own], sd[own]
        shown = slice(max(at[0] - 1, 0), at[-1] + 2)
        columns = (tuple(row[shown].tolist()) for row in (time, *rows))
        found.append(History(record.name, unit, *columns))
    return tuple(found)


def _estimates(problem: Problem, best: Fit, term: Term) -> tuple[Estimate, ...]:
    """Return the numbers of a term, with those of y = a + b x as they are in the record."""
    cause = next((cause for cause in problem.model.causes if cause.id == term.target), None)
    changed = tuple(cause.changes) if cause else ()
    found = []
    for entry, value, variance in zip(best.entries, best.x.tolist(), best.variance.tolist(), strict=True):
        own = entry.name.partition(".")[0] == term.target and entry.kind in ("cause", "change", "since")
        if own or (term.kind == "cause" and entry.kind == "number" and entry.name in changed):
            name = f"{entry.name}.since" if entry.kind == "since" else entry.name
            off = cause.off.get(entry.name.partition(".")[2], entry.centre) if cause else entry.centre
            found.append(Estimate(name, value, math.sqrt(variance), off))
        elif term.is_data_error and entry.name == term.target and entry.kind in kinds_of(term):
            found += _of_data_error(term, entry, value, math.sqrt(variance))
    if term.kind in ("unit", "input"):
        found = [Estimate("factor", term.factor, 0.0, 1.0), Estimate("offset", term.offset, 0.0, 0.0)]
    return tuple(found)


def _of_data_error(term: Term, entry: Entry, value: float, sd: float) -> list[Estimate]:
    if entry.kind == "gain" and term.slot[0] == AFFINE:
        return [Estimate("factor", term.factor * (1.0 + value), abs(term.factor) * sd, 1.0)]
    if entry.kind == "offset" and term.slot[0] == AFFINE:
        return [Estimate("offset", term.offset + term.factor * value, abs(term.factor) * sd, 0.0)]
    return [Estimate(entry.kind, value, sd, 0.0)]
