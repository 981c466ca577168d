"""The search for explanations: ranked in the linear problem (`ranking`), the best fitted with simulations; add, drop,
swap.

It begins twice: at the nominal model, where gross errors in the data are plain whatever a fit would bend, and so is a
single cause that explains more than they do; and at the fit of "nothing is wrong". Without a gross error a fit moves
the parameters to suit the wrong readings: what may stand in its place is judged where the fit with it ends.

Inputs that are 0 in a healthy model cost a simulation for each knot. They are offered when nothing else gains: with the
best explanation, and without the causes in it. A part of the time is kept for that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from time import process_time

import numpy as np
from scipy.special import logsumexp

from subzero.identification.candidates import suggested
from subzero.identification.explanation import (
    Term,
    Terms,
    log_prior,
    with_term,
    without,
)
from subzero.identification.fit import (
    Fit,
    Linear,
    fit,
    linearised,
    starting_point,
    usual_levels,
)
from subzero.identification.nearness import follows
from subzero.identification.problem import Problem, Progress
from subzero.identification.ranking import (
    GROSS,
    OF_INPUTS,
    Key,
    Ranking,
    distinct,
    is_gross_kind,
    key,
    new_term,
)

MANY_TERMS = 3
"""Where an explanation needs more terms, an unknown input may act instead of them."""
FITTED = 6
"""At most so many of the best ranked explanations are fitted."""
WITHIN = 5.0
"""Explanations within this of the best are expanded, too. [nats]"""
ONSET_GAIN = 5.0
"""A cause that begins in mid-record gains up to that when it is fitted: its time is not linear. [nats]"""
WORTH = 3.0
"""A term that is ranked to lose more is not fitted. A fit that is GROSS below the best one is not brought to its end.
[nats]"""
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


def _changes_with_time(term: Term) -> bool:
    """Return whether a term acts in a part of a record, or more and more, as an unknown input may."""
    return term.kind == "drift" or math.isfinite(term.begins)


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
        ranking: ranks of explanations near one another.
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
        self._offered: set[Key] = set()
        self._refuted: list[tuple[set[str], str, float]] = []
        self.ranking = Ranking(self.problem)

    @property
    def settled(self) -> bool:
        """Whether all that is next to the best explanation was tried, also if the search did not come to its end."""
        best = self.ranked()[0].terms
        return self.complete or (self.compared == key(best) and self._alike(best) in self._expanded)

    def score(self, fitted: Fit) -> float:
        """Return the log posterior probability of an explanation, up to a constant."""
        return fitted.log_evidence + log_prior(fitted.terms, self.ranking.loggers)

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
        ranks = self.ranking.ranks.get(key(best.terms) if self.screened is None else self.screened, {})
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
        self._fit_ranked(base.linear, self.ranking.best(base.linear)[:1])
        best = self.ranked()[0]
        bare = None if best is base else self.ranking.there(best.linear, base.terms)
        if bare:  # the fit of the base may have ended far below what this one leaves
            self._fit(bare, self.ranking.own_score(bare), again=True)

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
        """Fit the gross errors in the data that gain most at the nominal model: also those of channels alone, if one of
        an input is among them, which several channels may show, each of which may be wrong as well. Where they do not
        explain the records, the one term that leads closest to these, and if need be what gross errors there are with
        it.
        """
        first = self.ranking.with_gross_errors(nominal)
        found = [self._fit(first)]
        if any(term.kind in OF_INPUTS for term in first.terms):
            found.append(self._fit(self.ranking.with_gross_errors(nominal, without=OF_INPUTS)))
        if any(follows(self.problem, each) for each in found):
            return
        closest = self.ranking.nearest(nominal)
        if closest and not follows(self.problem, self._fit(closest)):
            self._fit(self.ranking.with_gross_errors(closest))

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
        if not self.ranking.unknown:
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
            self._fit_ranked(base.linear, self.ranking.best_unknown(base.linear))
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
        bare = self.ranking.there(base.linear, terms)
        return self._fit(bare) if bare else base

    def _fit_single_causes(self, base: Fit) -> None:
        """Fit each cause with a base, if there are few: a rank is of the linear problem, which may be blind to what a
        cause does when it is large, and to its twin.
        """
        causes: dict[str, list[Term]] = {}
        for term in self.ranking.terms:
            if term.kind == "cause" and math.isinf(term.begins):
                causes.setdefault(term.id, []).append(term)
        for sizes in causes.values() if len(causes) <= FEW_CAUSES else ():
            made = [self.ranking.there(base.linear, with_term(base.terms, term), term) for term in sizes]
            if found := [linear for linear in made if linear]:
                self._fit(max(found, key=self.ranking.score))

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
            bare = self.ranking.there(base.linear, without(base.terms, term))
            if bare and term not in gross:
                # A fit that ended elsewhere may be far below what this one leaves when its term is dropped.
                rank = self.ranking.own_score(bare)
                is_near = rank > self._best() - GROSS
                self._fit_additions(self._fit(bare, rank, again=True).linear if is_near else bare)
            for twin in self._twins(term):
                linear = self.ranking.there(base.linear, with_term(without(base.terms, term), twin))
                if linear and self.ranking.own_score(linear) > self.score(base) - GROSS:
                    self._fit(linear)
        self._expanded[self._alike(base.terms)] = self.score(base)

    def _is_simpler_better(self, base: Fit) -> bool:
        """Fit an explanation without each of its terms that the linear problem does not miss; return whether one of
        these is better.
        """
        there = [self.ranking.there(base.linear, without(base.terms, term)) for term in base.terms]
        ranked = sorted(
            ((self.ranking.own_score(bare), bare) for bare in there if bare), key=lambda pair: -pair[0]
        )
        worth = (pair for pair in ranked if pair[0] > self.score(base))
        return any(self.score(self._fit(bare, rank, again=True)) > self.score(base) for rank, bare in worth)

    def _is_gross(self, base: Fit, term: Term) -> bool:
        """Return whether a term is an error that no cause can imitate (as one may an offset, a scale, a drift or a
        delay), and without which the linear problem is far less probable.
        """
        if not is_gross_kind(term):
            return False
        bare = self.ranking.there(base.linear, without(base.terms, term))
        return bare is not None and self.ranking.own_score(bare) < self.score(base) - GROSS

    def _replacements(self, base: Fit, term: Term) -> list[Fit]:
        """Return the fits of the best explanations with another gross error in the place of one: a unit or a regression
        of the same channel, or any other that brings the readings closer, from the point where the fit with that ends.
        """
        bare = self.ranking.there(base.linear, without(base.terms, term))
        if bare is None:
            return []
        units = [each for each in self.ranking.gross if each.kind == "unit" and each.target == term.target]
        other = [each for each in suggested(self.problem, bare, self.ranking.gross) if is_gross_kind(each)]
        made = [self.ranking.there(bare, with_term(bare.terms, each)) for each in (*units, *other)]
        found = [self.ranking.with_own_noise(linear) for linear in made if linear]
        ranked = distinct(sorted(found, key=lambda pair: -pair[0]))[:FITTED]
        near = (pair for pair in ranked if pair[0] > max(self.score(base) - WITHIN, self._best() - GROSS))
        return [self._fit(linear, score) for score, linear in near]

    def _fit_additions(self, base: Linear) -> None:
        """Fit the best explanations with one term more, except those that are ranked far below the best of all fits.

        What is ranked like the first of them is fitted, too, however well that one does: a rank is of the linear
        problem, which may be too strict with all of them, and twins have one rank.
        """
        self._fit_ranked(base, self.ranking.best(base))

    def _fit_ranked(self, base: Linear, ranked: list[tuple[float, Linear]]) -> None:
        """Fit the first of explanations with one term more than a base, which are ranked."""
        here, added = self.ranking.score(base), ranked[:FITTED]
        for score, linear in added:
            late = any(term.kind == "cause" and math.isfinite(term.begins) for term in linear.terms)
            near = min(self._best(), added[0][0]) - WITHIN - (ONSET_GAIN if late else 0.0)
            new = new_term(base, linear).id
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
        least = max(far - log_prior(start.terms, self.ranking.loggers), known)
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
