"""Growing: what is beside the best candidate, in the place of its causes, and below it, until the best stays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from subzero.diagnosis.around import Tried, beside, instead, swept
from subzero.diagnosis.candidate import Candidate, candidate_of
from subzero.diagnosis.hypotheses import Ids, named, places, variances
from subzero.diagnosis.kinks import begun_again, kinked, strayed
from subzero.diagnosis.refit import Fit, refit
from subzero.diagnosis.sharp import SharpFits

BESIDE, INSTEAD, WORTH = 2, 3, -4.0
"""At most so many with a cause more, of a log posterior that adds at least WORTH; so many with another cause."""
ASTRAY = 6.0
"""A fit with so much less log posterior than the linear problem at another promises may have gone astray."""
SIMPLER, COARSE = -15.0, (0.5, 1.5)
"""One cause in the place of two is fitted if its log posterior adds at least that, at one of these effect scales."""
MOST_CAUSES, ROUNDS = 3, 4
"""Causes of a hypothesis, and rounds of growing."""


@dataclass(kw_only=True, eq=False)
class GrowingFits(SharpFits):
    """Fits that more are made around.

    Attributes:
        beside: hypothesis → log posterior, estimated at the fit of one with a cause less.
        begun: hypotheses that were fitted from off their kinks.
    """

    beside: dict[Ids, float] = field(default_factory=dict)
    begun: set[Ids] = field(default_factory=set)

    def grow(self) -> None:
        """Look beside the best candidate for one more cause, in the place of each for another, and below it for one
        less, until the best stays.
        """
        looked: set[Ids] = set()
        for _ in range(ROUNDS):
            best = self.begin_again(self.best())
            if best.ids in looked:
                return
            looked.add(best.ids)
            self._say(0.7, "a further cause beside", best.ids)
            self.fit_all(self._more(best) if len(best.ids) < MOST_CAUSES else [], best.fit)
            for without in best.ids:
                self._without(best, without)
            self._aside_of(best)
            self._kinked(best)
            self._parts_again(best)
            self.race(2, 2.0)
            self.cross()
            self.sharpen()
            if self.best().ids == best.ids:
                self._simpler()

    def _more(self, best: Candidate) -> list[Ids]:
        """Return the hypotheses with one cause more that the linear problem at the best fit finds best."""
        found = self._unknown(beside(self.problem, best))
        self.beside |= found
        return _best_of(found, best.log_posterior + WORTH)

    def _without(self, best: Candidate, without: str) -> None:
        """Fit the best hypothesis without one of its causes, and with others in its place."""
        rest = tuple(one for one in best.ids if one != without)
        self._below(rest, best.fit)
        found = self._unknown(instead(self.problem, best, rest))
        self.fit_all(sorted(found, key=lambda ids: -found[ids])[:INSTEAD], best.fit)

    def _aside_of(self, best: Candidate) -> None:
        """Fit what comes out best beside the other candidates, if the linear problem there has it before the best: a
        right pair may be far from a wrong cause that is as good as any by itself.
        """
        found: dict[Ids, tuple[float, Fit]] = {}
        for one in self.candidates.values():
            if one is not best and len(one.ids) < MOST_CAUSES:
                for ids, log in self._unknown(beside(self.problem, one)).items():
                    if log > max(best.log_posterior, found.get(ids, (-np.inf,))[0]):
                        found[ids] = log, one.fit
        for ids in sorted(found, key=lambda ids: -found[ids][0])[:BESIDE]:
            self.fit(ids, found[ids][1])

    def _kinked(self, best: Candidate) -> None:
        """Fit causes that runs have kinks in beside the best, or in the place of one of its causes."""
        found = dict[Ids, Tried]()
        rests = [tuple(one for one in best.ids if one != without) for without in best.ids]
        for rest in [best.ids, *rests] if len(best.ids) < MOST_CAUSES else rests:
            for ids, one in swept(self.problem, best, rest, kinked(self.problem, rest)).items():
                if ids not in found or one.log_posterior > found[ids].log_posterior:
                    found[ids] = one
        for ids in self._worth_fitting(found, best, WORTH):
            D = variances(self.problem.entries, ids, best.kappa)
            fit = refit(self.problem, found[ids].z, found[ids].J, D, most_fresh=0)
            self._take(candidate_of(self.problem, ids, fit))

    def _simpler(self) -> None:
        """Fit causes in the place of two of the best candidate's: what is one and large may look like two, and then the
        linear problem there says little of it.
        """
        best, found, entries = self.best(), dict[Ids, Tried](), self.problem.entries
        others = places(entries, tuple(one for one in named(self.problem) if one not in best.ids))
        for rest in combinations(best.ids, len(best.ids) - 2) if len(best.ids) > 1 else ():
            found |= swept(self.problem, best, rest, others, COARSE)
        worth = self._worth_fitting(found, best, SIMPLER)
        for ids in worth:
            z, D = found[ids].z, variances(entries, ids, best.kappa)
            fit = refit(self.problem, z, self.problem.jacobian(z), D, most_fresh=2, made_at=z)
            self._take(candidate_of(self.problem, ids, fit))
        self.race(2 if worth else 0)

    def _worth_fitting(self, found: Mapping[Ids, Tried], best: Candidate, least: float) -> list[Ids]:
        """Return the best of what was tried that no fit is known of, if its log posterior adds `least` to the best."""
        new = self._unknown({ids: one.log_posterior for ids, one in found.items() if ids != best.ids})
        return _best_of(new, best.log_posterior + least)

    def begin_again(self, one: Candidate) -> Candidate:
        """Fit a candidate from off its kinks, once, and return what is best then."""
        if one.ids not in self.begun:
            self.begun.add(one.ids)
            D = variances(self.problem.entries, one.ids, one.kappa)
            self._take(candidate_of(self.problem, one.ids, begun_again(self.problem, one.fit, one.ids, D)))
        return self.best()

    def _parts_again(self, best: Candidate) -> None:
        """Fit the best candidate without one of its causes from off its kinks, where that went astray."""
        for without in best.ids:
            ids = tuple(one for one in best.ids if one != without)
            fit, D = self.candidates[ids].fit, variances(self.problem.entries, ids, 1.0)
            if strayed(self.problem, fit, ids):
                self._take(candidate_of(self.problem, ids, begun_again(self.problem, fit, ids, D)))

    def _unknown(self, found: dict[Ids, float]) -> dict[Ids, float]:
        """Return those of estimated log posteriors that no fit is known of, or only one that went astray from afar."""
        known = {ids: one.log_posterior for ids, one in self.candidates.items()}
        return {ids: log for ids, log in found.items() if known.get(ids, -np.inf) < log - ASTRAY}


def _best_of(found: Mapping[Ids, float], least: float) -> list[Ids]:
    """Return the best hypotheses, at most BESIDE, of those whose log posterior is above the least."""
    ranked = sorted(found, key=lambda ids: -found[ids])[:BESIDE]
    return [ids for ids in ranked if found[ids] > least]
