"""Explanations near one another, ranked in the linear problem: with one term more, and with other errors in the data.

A rank is the evidence of an explanation linearised where another one is, times its prior: without a fit. The best are
ranked again with noise of their own.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from subzero.identification.candidates import best_span, declared, suggested
from subzero.identification.explanation import (
    CLOCK,
    CLOCK_KINDS,
    Entry,
    Identity,
    Term,
    Terms,
    log_prior,
    unknown_terms,
    with_term,
)
from subzero.identification.fit import Levels, Linear, fitted_levels, levels_under, quieter, stepped, tempered
from subzero.identification.problem import CORRECTIONS, Problem

MOST_TERMS = 8
"""An explanation has no more terms."""
RANKED_AGAIN = 10
"""So many of the best are ranked again with their own noise."""
GROSS = 100.0
"""An error in the data that gains more is a gross one. [nats]"""
OF_INPUTS = ("input", "exchanged")
"""Kinds of errors in what the simulation is given."""
GROSS_KINDS = ("unit", "affine", "swapped", "input", "exchanged", "stuck")
"""Errors in the data that may be gross, as those of all channels' clock, unusual ones of the times of a channel, and
those that begin in mid-record may."""

Key = tuple[tuple[str, float, float], ...]
"""What an explanation is."""


def key(terms: Terms) -> Key:
    """Return what an explanation is: of terms that begin at some time, whatever that is."""
    return tuple(
        (term.id, term.factor, term.offset) if term.kind in ("unit", "input") else (term.id, 1.0, 0.0)
        for term in terms
    )


def is_gross_kind(term: Term) -> bool:
    """Return whether an error in the data may be a gross one, which no cause can imitate."""
    begins = term.is_data_error and math.isfinite(term.begins)
    return term.kind in GROSS_KINDS or term.target == CLOCK or bool(term.centre) or begins


def new_term(base: Linear, linear: Linear) -> Term:
    """Return the term that one explanation has and another has not."""
    have = {term.id for term in base.terms}
    return next((term for term in linear.terms if term.id not in have), linear.terms[-1])


def moving(terms: Terms) -> set[tuple[str, float]]:
    """Return the terms by which the simulation has other inputs, or a channel other readings."""
    return {(term.id, term.factor) for term in terms if term.kind in ("swapped", *OF_INPUTS)}


def distinct(ranked: Iterable[tuple[float, Linear]]) -> list[tuple[float, Linear]]:
    """Return the first of each explanation among ranked ones."""
    found: dict[Key, tuple[float, Linear]] = {}
    for score, linear in ranked:
        found.setdefault(key(linear.terms), (score, linear))
    return list(found.values())


Columns = Mapping[str, np.ndarray]
"""Channel → residuals (m,), or sensitivities (m, n)."""


class Sensitivities:
    """Sensitivities to the numbers that a new term brings, which hold wherever noise hides one simulation from another.

    Hundreds of terms are ranked around each fit, most of which hardly differ from another one. A fit computes
    sensitivities of its own where those of its start do not hold.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._known: dict[Any, list[tuple[Columns, Columns]]] = {}

    def of(
        self, terms: Terms, entries: Sequence[Entry], x: np.ndarray, wanted: Sequence[int], e: Columns
    ) -> Columns:
        """Return sensitivities to some entries at x (n,), where the residuals are e."""
        if all(entries[i].kind in CORRECTIONS for i in wanted):  # no simulation is needed
            return self._problem.jacobian(terms, entries, x, wanted)
        inputs = [(term.id, term.factor) for term in terms if term.kind in OF_INPUTS]
        what = (*inputs, *((entries[i].identity, x[i]) for i in wanted))
        known = self._known.setdefault(what, [])
        for there, columns in known:
            if self._are_alike(terms, e, there):
                return columns
        known.append((e, self._problem.jacobian(terms, entries, x, wanted)))
        return known[-1][1]

    def _are_alike(self, terms: Terms, e: Columns, there: Columns) -> bool:
        """Return whether residuals differ by less than the levels of the sensors."""
        levels = self._problem.levels(terms)
        return all(
            float(np.mean((e[name] - there[name])[self._problem.used(name, terms)] ** 2)) < levels[name] ** 2
            for name in e
        )


class Ranking:
    """Ranks of explanations of some records.

    Attributes:
        terms: that may be added to an explanation, but for unknown inputs.
        unknown: inputs that are 0 in a healthy model, and may act.
        gross: those of `terms` that may be gross errors in the data.
        ranks: explanation → explanation with one term more → its score in the linear problem of the former.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.terms, self.unknown = declared(problem), unknown_terms(problem.model)
        # Offsets are among them for those that begin in mid-record, errors of a channel's times for unusual ones.
        may_be = ("offset", *CLOCK_KINDS)
        self.gross = [term for term in self.terms if term.kind in may_be or is_gross_kind(term)]
        self.ranks: dict[Key, dict[Key, float]] = {}
        self.loggers = {name: sensor.logger for name, sensor in problem.model.channels.items()}
        self._added: dict[int, tuple[Linear, list[tuple[float, Linear]]]] = {}
        self._sensitivities = Sensitivities(problem)

    def there(self, base: Linear, terms: Terms, new: Term | None = None) -> Linear | None:
        """Return another explanation, linearised at the point of a base, its new term where that begins; None if it
        cannot be simulated there.
        """
        problem, entries = self.problem, self.problem.entries(terms)
        known = {
            entry.identity: (value, i)
            for i, (entry, value) in enumerate(zip(base.entries, base.x.tolist(), strict=True))
        }
        away = self._away(entries, new, known)
        # Sensitivities are known along one simulation, and where a channel has readings.
        kept = set(known) - set(away) if moving(terms) == moving(base.terms) else set()
        fresh = [i for i, entry in enumerate(entries) if entry.identity not in kept]
        old = [i for i, entry in enumerate(entries) if entry.identity in kept]
        begin = {identity: value for identity, (value, _) in known.items()} | away
        x = np.array([begin.get(entry.identity, entry.centre) for entry in entries])
        found, valid = problem.residuals(terms, entries, [x])
        if not valid[0]:
            return None
        e = {name: column[:, 0] for name, column in found.items()}
        own = self._sensitivities.of(terms, entries, x, fresh, e) if fresh else {}
        J = {}
        for name, before in base.J.items():
            J[name] = np.empty((before.shape[0], len(entries)))
            J[name][:, old] = before[:, [known[entries[i].identity][1] for i in old]]
            if fresh:
                J[name][:, fresh] = own[name]
        levels = levels_under(problem, terms, base)
        return Linear(terms, entries, x, e, J, levels)

    def _away(
        self, entries: Sequence[Entry], new: Term | None, known: Collection[Identity]
    ) -> dict[Identity, float]:
        """Return where the search for the numbers of a new term begins, if that is not at their nominal values; of
        numbers that no term has had (not known), or that it changes.
        """
        if not (new and (new.size or new.centre)):
            return {}
        causes = {cause.id: cause for cause in self.problem.model.causes}
        changes = causes[new.target].changes if new.kind == "cause" else {}
        return {
            entry.identity: float(np.clip(entry.centre + new.size * entry.sd, entry.low, entry.high))
            for entry in entries
            if (entry.kind == "cause" and entry.identity not in known)
            or (entry.kind in CLOCK_KINDS and (entry.kind, entry.name) == (new.kind, new.target))
            or (entry.kind == "number" and entry.name in changes)
        }

    def score(self, linear: Linear) -> float:
        """Return the log posterior probability of an explanation in a linear problem, up to a constant."""
        return linear.evidence(self.problem)[1] + log_prior(linear.terms, self.loggers)

    def with_own_noise(self, linear: Linear) -> tuple[float, Linear]:
        """Return an explanation with the noise of its own residuals, and its score."""
        own = replace(linear, levels=fitted_levels(self.problem, linear))
        return self.score(own), own

    def own_score(self, linear: Linear) -> float:
        """Return the score of an explanation with the noise of its own residuals."""
        return self.with_own_noise(linear)[0]

    def additions(self, base: Linear, terms: list[Term]) -> list[tuple[float, Linear]]:
        """Return explanations with one of some terms more, linearised, with their scores: the best first."""
        present = {term.id for term in base.terms}
        worth = [term for term in suggested(self.problem, base, terms) if term.id not in present]
        there = [self.there(base, with_term(base.terms, term), term) for term in worth]
        found = [(self.score(linear), linear) for linear in there if linear]
        return sorted(found, key=lambda pair: -pair[0])

    def best(self, base: Linear) -> list[tuple[float, Linear]]:
        """Return explanations with one term more with their scores, ranked with their own noise."""
        if len(base.terms) >= MOST_TERMS:
            return []
        if id(base) in self._added:
            return self._added[id(base)][1]
        additions = self.additions(base, self.terms)
        self.ranks[key(base.terms)] = {key(linear.terms): score for score, linear in reversed(additions)}
        again = [self.with_own_noise(linear) for linear in self._worth_own_noise(base, additions)]
        found = distinct(sorted(again, key=lambda pair: -pair[0]))
        self._added[id(base)] = (base, found)  # kept with its base, so that no other can take its identity
        return found

    def _worth_own_noise(self, base: Linear, ranked: list[tuple[float, Linear]]) -> Iterator[Linear]:
        """Yield the best, ranked with the noise of the explanation that they are added to, and ranked with usual noise
        where that is less, from which their own is then sought: what a term would explain may be part of the former.
        And all with a gross error more: one outlier, hidden in the wrong unit, puts it last with the noise of others.
        """
        calm = [replace(each, levels=quieter(self.problem, each.terms, each.levels)) for _, each in ranked]
        quiet = sorted(((self.score(each), each) for each in calm), key=lambda pair: -pair[0])
        gross = [pair for pair in quiet if is_gross_kind(new_term(base, pair[1]))]
        levels: dict[Key, Levels] = {}
        for some in (distinct(ranked)[:RANKED_AGAIN], distinct(quiet)[:RANKED_AGAIN], distinct(gross)):
            for _, linear in some:
                if levels.get(key(linear.terms)) != linear.levels:
                    yield linear
                levels.setdefault(key(linear.terms), linear.levels)

    def with_gross_errors(self, nominal: Linear, without: Collection[str] = ()) -> Linear:
        """Return the nominal model with the units and regressions that gain most in the linear problem, one after the
        other, as long as each is a gross error; `without` errors of some kinds.
        """
        terms = [term for term in self.gross if term.kind not in without]
        here, before = nominal, self.score(nominal)
        while len(here.terms) < MOST_TERMS:
            added = [
                (score, there)
                for score, there in self.additions(here, terms)
                for new in [new_term(here, there)]
                if is_gross_kind(new) and new.kind != "offset"  # a step is judged with the noise of a fit
            ]
            if not added or added[0][0] < before + GROSS:
                break
            before, here = added[0]
        return here

    def nearest(self, nominal: Linear) -> Linear | None:
        """Return the nominal model with the one term more with which the first step of a fit leads closest to records
        that are far: a rank is of the linear problem, which does not hold there. None if there is no term.
        """
        added = [linear for _, linear in self.additions(nominal, self.terms)]
        made = [replace(each, levels=tempered(self.problem, each)) for each in added]
        ranked = distinct(sorted(((self.score(each), each) for each in made), key=lambda pair: -pair[0]))
        steps = [(stepped(self.problem, each), each) for _, each in ranked[:RANKED_AGAIN]]
        _, found = max(steps, key=lambda pair: self.own_score(pair[0]), default=(None, None))
        return found and replace(found, levels=levels_under(self.problem, found.terms, nominal))

    def best_unknown(self, base: Linear) -> list[tuple[float, Linear]]:
        """Return explanations with one unknown input more with their scores, ranked with their own noise."""
        if len(base.terms) >= MOST_TERMS:
            return []
        present = {term.id for term in base.terms}
        there = [
            linear for term in self.unknown if term.id not in present for linear in self._acting(base, term)
        ]
        found = sorted(((self.score(linear), linear) for linear in there), key=lambda pair: -pair[0])
        ranks = {key(each.terms): score for score, each in reversed(found)}
        self.ranks.setdefault(key(base.terms), {}).update(ranks)
        again = [self.with_own_noise(linear) for linear in self._worth_own_noise(base, found)]
        return distinct(sorted(again, key=lambda pair: -pair[0]))

    def _acting(self, base: Linear, term: Term) -> Iterator[Linear]:
        """Yield explanations with an unknown input more, which acts throughout, or for a time; the latter with the
        noise of the base and with usual noise.
        """
        throughout = self.there(base, with_term(base.terms, term), term)
        if throughout is None:
            return
        yield throughout
        for levels in (throughout.levels, quieter(self.problem, throughout.terms, throughout.levels)):
            span = best_span(self.problem, replace(throughout, levels=levels), term)
            if linear := self.there(throughout, with_term(base.terms, span), span):
                yield linear
