"""The search for explanations: ranked in the linear problem, the best fitted with simulations; add, drop, swap.

It begins twice: at the nominal model, where gross errors in the data are plain whatever a fit would bend, and so is a
single cause that explains more than they do; and at the fit of "nothing is wrong". Without a gross error a fit moves
the parameters to suit the wrong readings: what may stand in its place is judged where the fit with it ends.

Inputs that are 0 in a healthy model cost a simulation for each knot. They are offered when nothing else gains: with the
best explanation, and without the causes in it. A part of the time is kept for that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from time import process_time

import numpy as np
from scipy.special import logsumexp

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
    without,
)
from subzero.identification.fit import (
    Fit,
    Levels,
    Linear,
    fit,
    fitted_levels,
    levels_under,
    linearised,
    quieter,
    starting_point,
    usual_levels,
)
from subzero.identification.nearness import follows
from subzero.identification.problem import Problem, Progress
from subzero.identification.sensitivities import Sensitivities

MOST_TERMS, MANY_TERMS = 8, 3
"""An explanation has no more terms; where it needs more than so many, an unknown input may act instead of them."""
RANKED_AGAIN, FITTED = 10, 6
"""So many of the best are ranked again with their own noise; at most so many of these are fitted."""
WITHIN = 5.0
"""Explanations within this of the best are expanded, too. [nats]"""
ONSET_GAIN = 5.0
"""A cause that begins in mid-record gains up to that when it is fitted: its time is not linear. [nats]"""
WORTH, GROSS = 3.0, 100.0
"""A term that is ranked to lose more is not fitted; an error in the data that gains more is a gross one, and a fit that
is so far below the best one is not brought to its end. [nats]"""
GROSS_KINDS = ("unit", "affine", "swapped", "input", "exchanged", "stuck")
"""Errors in the data that may be gross, as those of all channels' clock, unusual ones of the times of a channel, and
those that begin in mid-record may."""
OF_MODEL = ("number", "start", "unknown")
"""Kinds of entries that every explanation has, and histories: these begin at 0."""
TWINS = ("offset", "scale", "affine", "delay")
"""Errors that another channel of the unit may have in the place of the first one."""
FEW_CAUSES = 12
"""So many causes are all fitted by themselves, whatever their rank."""
MOST_FITS = 60
"""The search ends after so many fits, and says so."""
FOR_UNKNOWN = 0.25
"""Share of a search's time that is kept to compare its best explanation with unknown inputs: their ranking takes about
a fifth of a whole search. [-]"""

Key = tuple[tuple[str, float, float], ...]


def key(terms: Terms) -> Key:
    """Return what an explanation is: of terms that begin at some time, whatever that is."""
    return tuple(
        (term.id, term.factor, term.offset) if term.kind in ("unit", "input") else (term.id, 1.0, 0.0)
        for term in terms
    )


def _is_gross_kind(term: Term) -> bool:
    """Return whether an error in the data may be a gross one, which no cause can imitate."""
    begins = term.is_data_error and math.isfinite(term.begins)
    return term.kind in GROSS_KINDS or term.target == CLOCK or bool(term.centre) or begins


def _changes_with_time(term: Term) -> bool:
    """Return whether a term acts in a part of a record, or more and more, as an unknown input may."""
    return term.kind == "drift" or math.isfinite(term.begins)


def _new(base: Linear, linear: Linear) -> Term:
    """Return the term that one explanation has and another has not."""
    have = {term.id for term in base.terms}
    return next((term for term in linear.terms if term.id not in have), linear.terms[-1])


def moving(terms: Terms) -> set[tuple[str, float]]:
    """Return the terms by which the simulation has other inputs, or a channel other readings."""
    return {(term.id, term.factor) for term in terms if term.kind in ("swapped", "input", "exchanged")}


class _TimeOverError(Exception):
    """A search has had its time."""


@dataclass(eq=False)
class Search:
    """A search.

    Attributes:
        problem: records and model.
        progress: called before every fit.
        seconds: of processor time, after which no fit begins. [s]
        begin: a fit of other records of these, from whose explanation the search goes on.
        fits: explanation → its best fit.
        ranks: explanation with one term more than another → its score in the linear problem of that one.
        complete: whether it came to its end.
        compared: the latest explanation that was compared with unknown inputs; None if none was.
        interrupted: whether the user ended it.
        screened: the explanation to which one term more was only ranked; None for a whole search.
    """

    problem: Problem
    progress: Progress
    seconds: float = math.inf
    begin: Fit | None = None
    fits: dict[Key, Fit] = field(default_factory=dict)
    ranks: dict[Key, dict[Key, float]] = field(default_factory=dict)
    complete: bool = True
    compared: Key | None = None
    interrupted: bool = False
    screened: Key | None = None

    def __post_init__(self) -> None:
        self._begun = process_time()
        self._end = self._begun + (1.0 - FOR_UNKNOWN) * self.seconds
        self._expanded: dict[tuple[tuple[str, str], ...], float] = {}
        self._left: set[Key] = set()
        self._tried: set[Key] = set()
        self._added: dict[int, tuple[Linear, list[tuple[float, Linear]]]] = {}
        self._offered: set[Key] = set()
        self._refuted: list[tuple[set[str], str, float]] = []
        self._sensitivities = Sensitivities(self.problem)
        self._terms, self._unknown = declared(self.problem), unknown_terms(self.problem.model)
        # Offsets are among them for those that begin in mid-record, errors of a channel's times for unusual ones.
        may_be = ("offset", *CLOCK_KINDS)
        self._gross = [term for term in self._terms if term.kind in may_be or _is_gross_kind(term)]
        self._loggers = {name: sensor.logger for name, sensor in self.problem.model.channels.items()}

    @property
    def settled(self) -> bool:
        """Whether all that is next to the best explanation was tried, also if the search did not come to its end."""
        best = self.ranked()[0].terms
        return self.complete or (self.compared == key(best) and self._alike(best) in self._expanded)

    def score(self, fitted: Fit) -> float:
        """Return the log posterior probability of an explanation, up to a constant."""
        return fitted.log_evidence + log_prior(fitted.terms, self._loggers)

    def ranked(self) -> list[Fit]:
        """Return all fits, the most probable first."""
        return sorted(self.fits.values(), key=self.score, reverse=True)

    def log_unseen(self) -> float:
        """Return the log of the sum of the scores of the best explanation with one term more, of those that were not
        worth a fit: records that do not show a cause do not exclude it.
        """
        scores = list(self.unseen().values())
        return float(logsumexp(scores)) if scores else -math.inf

    def unseen(self) -> dict[Key, float]:
        """Return explanations with one term more that were not worth a fit, with the scores that they are ranked with;
        of a screening, all that were not fitted, none of them with more than the best fit.
        """
        best = self.ranked()[0]
        most = self.score(best)
        ranks = self.ranks.get(key(best.terms) if self.screened is None else self.screened, {})
        unfitted = {name: score for name, score in ranks.items() if name not in self.fits}
        if self.screened is not None:
            return {name: min(score, most) for name, score in unfitted.items()}
        return {name: score for name, score in unfitted.items() if score < most - WORTH}

    def start(self) -> None:
        """Fit "nothing is wrong", and the explanation from which the search goes on: that with gross errors in the data
        alone, if none is given.
        """
        self._within_time(self._start)

    def screen(self) -> None:
        """Rank one term more than the best of the first fits in the linear problem, and fit the first of them."""
        base = self.ranked()[0]
        self.screened = key(base.terms)
        self._fit_ranked(base.linear, self._best_additions(base.linear)[:1])
        best = self.ranked()[0]
        bare = None if best is base else self.there(best.linear, base.terms)
        if bare:  # the fit of the base may have ended far below what this one leaves
            self._fit(bare, self._own_score(bare), again=True)

    def run(self, *, with_outliers: bool) -> None:
        """Search until no move gains; or, if not `with_outliers`, until the best explanation shows some, without which
        the search is to begin anew.
        """
        self._within_time(lambda: self._run(with_outliers))

    def outliers(self) -> dict[str, np.ndarray]:
        """Return channel → which readings (m,) are outliers of the best explanation so far; none if the time is
        over.
        """
        best = self.ranked()[0]
        return self.problem.outliers(best.terms, best.linear.e) if self.complete else {}

    def _within_time(self, part: Callable[[], None]) -> None:
        """Do a part of the search; if its time is over, or the user interrupts it, what was found is kept."""
        try:
            part()
        except _TimeOverError:
            self.complete = False
        except KeyboardInterrupt:
            if not self.fits:
                raise
            self.complete, self.interrupted = False, True

    def _start(self) -> None:
        problem, entries = self.problem, self.problem.entries(())
        centre = np.array([entry.centre for entry in entries])
        nominal = linearised(problem, (), entries, centre, usual_levels(problem, ()), must=True)
        if (fitted := self.begin) is None:
            self._fit_first(nominal)
        else:
            self._fit(linearised(problem, fitted.terms, fitted.entries, fitted.x, fitted.linear.levels))
        self._fit(nominal)

    def _fit_first(self, nominal: Linear) -> None:
        """Fit the gross errors in the data that gain most at the nominal model; where they do not explain the records,
        and a single term is ranked higher there, fit that one, and what gross errors there are with it.
        """
        gross = self._greedy(nominal)
        if not follows(self.problem, self._fit(gross)):
            ranked = self._additions(nominal, self._terms)
            if ranked and ranked[0][0] > self._linear_score(gross):
                self._fit(self._greedy(ranked[0][1]))

    def _run(self, with_outliers: bool) -> None:
        """Search; where the time or the number of fits does not suffice, an unknown input is tried all the same."""
        try:
            self._explore(with_outliers)
        except _TimeOverError:
            self.complete = False
        if not self.complete:
            self._end = self._begun + self.seconds
            while self._fit_unknown():
                pass

    def _explore(self, with_outliers: bool) -> None:
        for first in {key(each.terms): each for each in (self.fits[()], self.ranked()[0])}.values():
            self._fit_single_causes(first)
        while (base := self._next()) is not None or self._fit_unknown():
            if len(self.fits) >= MOST_FITS:
                self.complete = False
                return
            if not with_outliers and self.outliers():
                return
            if base is not None:
                self._expand(base)
            if len(self.ranked()[0].terms) > MANY_TERMS:
                self._fit_unknown()

    def _fit_unknown(self) -> bool:
        """Fit inputs that are 0 in a healthy model, where they may explain what nothing else does: with the best
        explanation, with no more of it than its gross errors, and with nothing, as a large input may look like a gross
        error. Return whether something was fitted.
        """
        best, before = self.ranked()[0], len(self.fits)
        if not self._unknown:
            self.compared = key(best.terms)
            return False
        self._fit_unknown_with(best)
        own = self._causes_of(best)
        doubtful = not follows(self.problem, best) or len(own) > 1 or any(map(_changes_with_time, own))
        if len(self.fits) > before or doubtful:
            self._fit_unknown_with(self._without_causes(best))
            self._fit_unknown_with(self.fits[()])
        self.compared = key(best.terms)
        return len(self.fits) > before

    def _fit_unknown_with(self, base: Fit) -> None:
        """Fit unknown inputs with a base, once."""
        if key(base.terms) not in self._offered:
            self._fit_ranked(base.linear, self._ranked_unknown(base.linear))
            self._offered.add(key(base.terms))

    def _causes_of(self, base: Fit) -> list[Term]:
        """Return the terms of an explanation but for gross errors in the data: an unknown input may look like them."""
        return [term for term in base.terms if term.kind != "unknown" and not self._is_gross(base, term)]

    def _without_causes(self, base: Fit) -> Fit:
        """Return the fit of an explanation with no more than its gross errors in the data."""
        causes = self._causes_of(base)
        terms = tuple(term for term in base.terms if term not in causes and term.kind != "unknown")
        if key(terms) in self.fits:
            return self.fits[key(terms)]
        bare = self.there(base.linear, terms)
        return self._fit(bare) if bare else base

    def _ranked_unknown(self, base: Linear) -> list[tuple[float, Linear]]:
        """Return explanations with one unknown input more with their scores, ranked with their own noise."""
        if len(base.terms) >= MOST_TERMS:
            return []
        present = {term.id for term in base.terms}
        there = [
            linear for term in self._unknown if term.id not in present for linear in self._acting(base, term)
        ]
        found = sorted(((self._linear_score(linear), linear) for linear in there), key=lambda pair: -pair[0])
        ranks = {key(each.terms): score for score, each in reversed(found)}
        self.ranks.setdefault(key(base.terms), {}).update(ranks)
        again = [self._with_own_noise(linear) for linear in self._worth_own_noise(found)]
        return self._distinct(sorted(again, key=lambda pair: -pair[0]))

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

    def _fit_single_causes(self, base: Fit) -> None:
        """Fit each cause with a base, if there are few: a rank is of the linear problem, which may be blind to what a
        cause does when it is large, and to its twin.
        """
        causes: dict[str, list[Term]] = {}
        for term in self._terms:
            if term.kind == "cause" and math.isinf(term.begins):
                causes.setdefault(term.id, []).append(term)
        for sizes in causes.values() if len(causes) <= FEW_CAUSES else ():
            made = [self.there(base.linear, with_term(base.terms, term), term) for term in sizes]
            if found := [linear for linear in made if linear]:
                self._fit(max(found, key=self._linear_score))

    def _next(self) -> Fit | None:
        """Return the best explanation that was neither expanded nor left for a better one, if it is near the best of
        all, and no part of it is better: what a term more did not gain, two will not. Nor if it is like one that was
        expanded, and not much better.
        """
        ranked = self.ranked()
        best = self.score(ranked[0])
        for i, each in enumerate(ranked):
            own = set(key(each.terms))
            simpler = any(set(key(other.terms)) < own for other in ranked[:i])
            done = key(each.terms) in self._left
            like = self._expanded.get(self._alike(each.terms), -np.inf)
            if self.score(each) > max(best - WITHIN, like + WITHIN) and not (simpler or done):
                return each
        return None

    def _alike(self, terms: Terms) -> tuple[tuple[str, str], ...]:
        """Return what an explanation has in common with those that say nearly the same: with another known unit of a
        channel, or an error of its twin.
        """
        sensors = self.problem.model.channels
        found = [
            (term.kind, sensors[term.target].unit)
            if term.kind in TWINS and term.target in sensors
            else (term.id, "")
            for term in terms
        ]
        return tuple(sorted(found))

    def _expand(self, base: Fit) -> None:
        """Fit the best explanations that are one move away: those with a term less first, which are expanded instead if
        they are better; then with other gross errors in the data, as all else depends on them.
        """
        if self._is_simpler_better(base):
            return
        better, gross = base, []
        for term in base.terms:
            if self._is_gross(base, term):
                gross.append(term)
                better = max([better, *self._replacements(better, term)], key=self.score)
        if better is not base:
            self._left.add(key(base.terms))
            return
        self._fit_additions(base.linear)
        for term in base.terms:
            bare = self.there(base.linear, without(base.terms, term))
            if bare and term not in gross:
                # A fit that ended elsewhere may be far below what this one leaves when its term is dropped.
                rank = self._own_score(bare)
                is_near = rank > self._best() - GROSS
                self._fit_additions(self._fit(bare, rank, again=True).linear if is_near else bare)
            for twin in self._twins(term):
                linear = self.there(base.linear, with_term(without(base.terms, term), twin))
                if linear and self._own_score(linear) > self.score(base) - GROSS:
                    self._fit(linear)
        self._expanded[self._alike(base.terms)] = self.score(base)

    def _is_simpler_better(self, base: Fit) -> bool:
        """Fit an explanation without each of its terms that the linear problem does not miss; return whether one of
        these is better.
        """
        there = [self.there(base.linear, without(base.terms, term)) for term in base.terms]
        ranked = sorted(((self._own_score(bare), bare) for bare in there if bare), key=lambda pair: -pair[0])
        worth = (pair for pair in ranked if pair[0] > self.score(base))
        return any(self.score(self._fit(bare, rank, again=True)) > self.score(base) for rank, bare in worth)

    def _is_gross(self, base: Fit, term: Term) -> bool:
        """Return whether a term is an error that no cause can imitate (as one may an offset, a scale, a drift or a
        delay), and without which the linear problem is far less probable.
        """
        if not _is_gross_kind(term):
            return False
        bare = self.there(base.linear, without(base.terms, term))
        return bare is not None and self._own_score(bare) < self.score(base) - GROSS

    def _replacements(self, base: Fit, term: Term) -> list[Fit]:
        """Return the fits of the best explanations with another gross error in the place of one: a unit or a regression
        of the same channel, or any other that brings the readings closer, from the point where the fit with that ends.
        """
        bare = self.there(base.linear, without(base.terms, term))
        if bare is None:
            return []
        units = [each for each in self._gross if each.kind == "unit" and each.target == term.target]
        other = [each for each in suggested(self.problem, bare, self._gross) if _is_gross_kind(each)]
        made = [self.there(bare, with_term(bare.terms, each)) for each in (*units, *other)]
        found = [self._with_own_noise(linear) for linear in made if linear]
        ranked = self._distinct(sorted(found, key=lambda pair: -pair[0]))[:FITTED]
        near = (pair for pair in ranked if pair[0] > max(self.score(base) - WITHIN, self._best() - GROSS))
        return [self._fit(linear, score) for score, linear in near]

    def _fit_additions(self, base: Linear) -> None:
        """Fit the best explanations with one term more, except those that are ranked far below the best of all fits.

        What is ranked like the first of them is fitted, too, however well that one does: a rank is of the linear
        problem, which may be too strict with all of them, and twins have one rank.
        """
        self._fit_ranked(base, self._best_additions(base))

    def _fit_ranked(self, base: Linear, ranked: list[tuple[float, Linear]]) -> None:
        """Fit the first of explanations with one term more than a base, which are ranked."""
        here, added = self._linear_score(base), ranked[:FITTED]
        for score, linear in added:
            late = any(term.kind == "cause" and math.isfinite(term.begins) for term in linear.terms)
            near = min(self._best(), added[0][0]) - WITHIN - (ONSET_GAIN if late else 0.0)
            new = _new(base, linear).id
            if score < max(here - WORTH, near) or self._is_refuted(base.terms, new, score - here):
                continue
            if self.score(self._fit(linear, score)) < min(here, score - GROSS):
                self._refuted.append(({term.id for term in base.terms}, new, score - here))

    def _is_refuted(self, terms: Terms, new: str, gain: float) -> bool:
        """Return whether a fit has shown, with some of these terms, that another one gains nothing, of which the linear
        problem expected the same and was far wrong: it expects that with any terms, and each such fit is long.
        """
        own = {term.id for term in terms}
        same = [
            base for base, name, expected in self._refuted if name == new and abs(gain - expected) < WITHIN
        ]
        return any(base <= own for base in same)

    def _twins(self, term: Term) -> Iterator[Term]:
        """Yield the same error, undone, of other channels of its unit: two gauges differ, and either may be wrong."""
        if term.kind not in TWINS or term.target not in self.problem.channels:
            return
        sensors = self.problem.model.channels
        for name in self.problem.channels:
            alike = sensors[name].unit == sensors[term.target].unit
            if name != term.target and alike and not sensors[name].trusted:
                yield replace(
                    term.about(name),
                    factor=1.0 / term.factor,
                    offset=-term.offset / term.factor,
                    size=-term.size,
                    centre=-term.centre,
                )

    def _fit(self, start: Linear, expected: float = -np.inf, *, again: bool = False) -> Fit:
        """Return the fit of an explanation from a start; also from the nominal model, if it is much less probable than
        expected of the linear problem: what another explanation moved may bar the way there. One that was fitted before
        is fitted `again` only if much more is expected. No fit goes on that is far below the best one, or below another
        of the same explanation.
        """
        name = key(start.terms)
        if name in self._tried and not (again and expected > self.score(self.fits[name]) + WORTH):
            return self.fits[name]
        if () in self.fits and process_time() > self._end:
            raise _TimeOverError
        self._tried.add(name)
        words = " + ".join(term.id for term in start.terms) or "nothing is wrong"
        self.progress(min(0.9, 0.05 + 0.02 * len(self.fits)), f"fit of {words}")
        far = self._best() - GROSS
        known = self.fits[name].log_evidence if name in self.fits else -math.inf
        least = max(far - log_prior(start.terms, self._loggers), known)
        fitted = fit(self.problem, start, least)
        if self.score(fitted) < expected - WORTH and expected > far:
            values = zip(start.entries, start.x.tolist(), strict=True)
            own = {entry: value for entry, value in values if entry.kind not in OF_MODEL}
            if nominal := starting_point(self.problem, start.terms, own):
                second = fit(self.problem, nominal, max(least, fitted.log_evidence))
                fitted = max(fitted, second, key=self.score)
        if name not in self.fits or self.score(fitted) > self.score(self.fits[name]):
            self.fits[name] = fitted
            self._left.discard(name)
        return self.fits[name]

    def _best(self) -> float:
        """Return the score of the best fit."""
        return max(map(self.score, self.fits.values()), default=-math.inf)

    def _greedy(self, nominal: Linear) -> Linear:
        """Return the nominal model with the units and regressions that gain most in the linear problem, one after the
        other, as long as each is a gross error.
        """
        here, before = nominal, self._linear_score(nominal)
        while len(here.terms) < MOST_TERMS:
            added = [
                (score, there)
                for score, there in self._additions(here, self._gross)
                for new in [_new(here, there)]
                if _is_gross_kind(new) and new.kind != "offset"  # a step is judged with the noise of a fit
            ]
            if not added or added[0][0] < before + GROSS:
                break
            before, here = added[0]
        return here

    def _linear_score(self, linear: Linear) -> float:
        return linear.evidence(self.problem)[1] + log_prior(linear.terms, self._loggers)

    def _best_additions(self, base: Linear) -> list[tuple[float, Linear]]:
        """Return explanations with one term more with their scores, ranked with their own noise."""
        if len(base.terms) >= MOST_TERMS:
            return []
        if id(base) in self._added:
            return self._added[id(base)][1]
        additions = self._additions(base, self._terms)
        self.ranks[key(base.terms)] = {key(linear.terms): score for score, linear in reversed(additions)}
        again = [self._with_own_noise(linear) for linear in self._worth_own_noise(additions)]
        found = self._distinct(sorted(again, key=lambda pair: -pair[0]))
        self._added[id(base)] = (base, found)  # kept with its base, so that no other can take its identity
        return found

    def _worth_own_noise(self, ranked: list[tuple[float, Linear]]) -> Iterator[Linear]:
        """Yield the best, ranked with the noise of the explanation that they are added to, and ranked with usual noise
        where that is less, from which their own is then sought: what a term would explain may be part of the former.
        """
        calm = [replace(each, levels=quieter(self.problem, each.terms, each.levels)) for _, each in ranked]
        quiet = sorted(((self._linear_score(each), each) for each in calm), key=lambda pair: -pair[0])
        levels: dict[Key, Levels] = {}
        for order in (ranked, quiet):
            for _, linear in self._distinct(order)[:RANKED_AGAIN]:
                if levels.get(key(linear.terms)) != linear.levels:
                    yield linear
                levels.setdefault(key(linear.terms), linear.levels)

    def _distinct(self, ranked: Iterable[tuple[float, Linear]]) -> list[tuple[float, Linear]]:
        found: dict[Key, tuple[float, Linear]] = {}
        for score, linear in ranked:
            found.setdefault(key(linear.terms), (score, linear))
        return list(found.values())

    def _with_own_noise(self, linear: Linear) -> tuple[float, Linear]:
        """Return an explanation with the noise of its own residuals, and its score."""
        own = replace(linear, levels=fitted_levels(self.problem, linear))
        return self._linear_score(own), own

    def _own_score(self, linear: Linear) -> float:
        return self._with_own_noise(linear)[0]

    def _additions(self, base: Linear, terms: list[Term]) -> list[tuple[float, Linear]]:
        """Return explanations with one of some terms more, linearised, with their scores: the best first."""
        present = {term.id for term in base.terms}
        worth = [term for term in suggested(self.problem, base, terms) if term.id not in present]
        there = [self.there(base, with_term(base.terms, term), term) for term in worth]
        found = [(self._linear_score(linear), linear) for linear in there if linear]
        return sorted(found, key=lambda pair: -pair[0])

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
