"""The search: from all hypotheses by linear evidence to a few by real fits.

all tolerances wide → a point close to the data → linear evidence of everything there → refits of what is left
→ a second cause beside the best, and a third, or another in the place of one → probabilities
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from subzero.diagnosis.around import Tried, beside, instead, swept
from subzero.diagnosis.candidate import Candidate, candidate_of
from subzero.diagnosis.fits import HOPELESS, Fits
from subzero.diagnosis.hypotheses import Ids, places, variances
from subzero.diagnosis.pose import with_finer_steps
from subzero.diagnosis.probability import Beliefs
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import ENOUGH, Fit, refit
from subzero.diagnosis.screen import look
from subzero.diagnosis.straight import straightened
from subzero.diagnosis.wide import fit_wide

KEEP, SINGLES, PAIRS = 12.0, 7, 4
"""Refit hypotheses whose log evidence is this close to the best of their kind, and at most so many."""
BENT, LEAST_BENT = 2, 10.0
"""So many causes that the wide fit bends by at least so many tolerances are fitted by themselves."""
SWEPT = 4
"""So many causes are fitted by themselves if the wide fit is not close."""
BESIDE, INSTEAD, WORTH = 2, 3, -4.0
"""At most so many with a cause more, of a log posterior that adds at least WORTH; so many with another cause."""
ASTRAY = 6.0
"""A fit with so much less log posterior than the linear problem at another promises may have gone astray."""
MOST_CAUSES, ROUNDS = 3, 4
"""Causes of a hypothesis, and rounds of growing."""
LAST, NEARER = 3, 1.0
"""Rounds of settling; so close, in tolerances, the sensitivities of what is told were made."""
RIVALS, CLOSE = 2.0, 6.0
"""What is so close to the best in log posterior is settled, too; what has a cause more or less, from farther behind."""


@dataclass(kw_only=True, eq=False)
class Search(Fits):
    """A search that goes on: what was found so far is always in `candidates`.

    Attributes:
        nominal: residual and sensitivities of the nominal model.
        beside: hypothesis → log posterior, estimated at the fit of one with a cause less.
        behind: hypothesis → how far its fit was behind the best when it was given up, in log posterior.
        economical: the problem before what economical steps get wrong was taken from its records.
        sharp_at: the hypothesis at whose fit that was done.
    """

    nominal: tuple[np.ndarray, np.ndarray] = field(init=False)
    beside: dict[Ids, float] = field(default_factory=dict)
    behind: dict[Ids, float] = field(default_factory=dict)
    economical: Problem = field(init=False)
    sharp_at: Ids | None = None

    def begin(self) -> None:
        """Make the sensitivities at the nominal model, and the fit with wide tolerances."""
        self.problem, self.wide, self.nominal = fit_wide(self.problem, self.progress)
        self.economical = self.problem

    def look(self) -> None:
        """Fill the screen: linear evidence of nothing, every cause, and every pair."""
        self.screen = look(self.problem, self.wide, self.nominal)

    def refit_best(self) -> None:
        """Fit nothing, and the best causes and pairs of the screen, with real runs: all with the sensitivities at hand,
        then those that come out best with their own.
        """
        first = self._first()
        for ids, fit in zip(first, self._aside(self._alone, first), strict=True):
            self._say(0.3, "fitting", ids, " by itself")
            self._keep(ids, fit)
        best = self.screen.best(1, SINGLES, KEEP), self.screen.best(2, PAIRS, KEEP)
        self.fit_all(list(chain([()], *best)), words="fitting")
        self.race(2)
        self.sharpen()
        self.race()

    def grow(self) -> None:
        """Look beside the best candidate for one more cause, in the place of each for another, and below it for one
        less, until the best stays.
        """
        looked: set[Ids] = set()
        for _ in range(ROUNDS):
            best = self.best()
            if best.ids in looked:
                return
            looked.add(best.ids)
            self._say(0.7, "a further cause beside", best.ids)
            self.fit_all(self._more(best) if len(best.ids) < MOST_CAUSES else [], best.fit)
            for without in best.ids:
                self._without(best, without)
            self._aside_of(best)
            self._kinked(best)
            self._straighten(best)
            self.race(2, 2.0)
            self.cross()
            self.sharpen()

    def settle(self) -> None:
        """Fit the best candidate again until it has settled, so that its numbers can be told, and what might still
        catch up with it; then its rivals from where it is.
        """
        stuck: set[Ids] = set()
        for _ in range(LAST):
            best = self.best()
            for one in [one for one in self.candidates.values() if self._is_open(one, best)]:
                if one.ids in stuck:
                    continue
                self._say(0.75, "settling", one.ids)
                self._again(one)
                if self.candidates[one.ids].log_posterior < one.log_posterior + ENOUGH:
                    stuck.add(one.ids)
        self.cross()
        self._nothing()

    def _is_open(self, one: Candidate, best: Candidate) -> bool:
        """Say whether a candidate that is as good as the best, or might still catch up with it, has not settled."""
        behind = best.log_posterior - one.hope
        if behind < RIVALS:
            return not self._settled(one.fit, NEARER)
        akin = behind < CLOSE and _akin(one.ids, best.ids)
        return akin and not one.fit.converged and not self._settled(one.fit)

    def sharpen(self) -> None:
        """Take from the records what economical steps get wrong at the best fit, if that can be seen, and fit again."""
        best = self.best()
        if self.sharp_at == best.ids:
            return
        self.progress(0.6, "finer steps")
        self.sharp_at, sharper = best.ids, with_finer_steps(self.economical, best.fit.z)
        if sharper is None:
            return
        self.problem, least = sharper, best.log_posterior - HOPELESS
        kept = {ids: one for ids, one in self.candidates.items()
                if one.log_posterior > least or set(ids) <= set(best.ids)}  # fmt: skip
        self.behind |= {ids: one.log_posterior - best.log_posterior for ids, one in self.candidates.items()
                        if ids not in kept}  # fmt: skip
        self.candidates = kept
        ids_of = list(self.candidates)
        for ids, fit in zip(ids_of, self._aside(self._going_on, ids_of), strict=True):
            self._keep(ids, fit)
            self.raced -= set() if fit.converged else {ids}
        self.raced &= set(self.candidates)

    def _going_on(self, ids: Ids) -> Fit:
        """Return the fit of a candidate from where it is, with the sensitivities at hand."""
        fit = self.candidates[ids].fit
        return refit(self.problem, fit.z, fit.J, fit.D, most_fresh=0, made_at=fit.made_at)

    @property
    def beliefs(self) -> Beliefs:
        """What is known of all hypotheses by now."""
        return Beliefs(candidates=self.candidates, screen=self.screen, beside=self.beside, behind=self.behind)

    def _first(self) -> list[Ids]:
        """Return the causes that are fitted by themselves: those that the wide fit bends most, of which the linear
        problem says little; and if it is not close to the records, the best of those that were swept.
        """
        if self.screen.far:
            return self.screen.best(1, SWEPT, np.inf)
        bent: dict[Ids, float] = {}
        for z, entry in zip(self.wide.z, self.problem.entries, strict=True):
            if entry.record < 0:
                size, ids = abs(float(z)) / entry.parameter.tolerance, (entry.effect.id,)
                bent[ids] = max(size, bent.get(ids, 0.0))
        return [ids for ids in sorted(bent, key=lambda ids: -bent[ids])[:BENT] if bent[ids] > LEAST_BENT]

    def _alone(self, ids: Ids) -> Fit:
        """Return the fit of a cause from where the wide fit has it, all else nominal, with the sensitivities there."""
        z, at = np.zeros(len(self.problem.entries)), places(self.problem.entries, ids)
        z[at] = self.screen.secants.get(ids, self.wide.z)[at]
        D = variances(self.problem.entries, ids, 1.0)
        return refit(self.problem, z, self.problem.jacobian(z), D, most_fresh=2, made_at=z)

    def _more(self, best: Candidate) -> list[Ids]:
        """Return the hypotheses with one cause more that the linear problem at the best fit finds best."""
        found = self._unknown(beside(self.problem, best))
        self.beside |= found
        ranked = sorted(found, key=lambda ids: -found[ids])[:BESIDE]
        return [ids for ids in ranked if found[ids] > best.log_posterior + WORTH]

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
            for ids, one in swept(self.problem, best, rest).items():
                if ids not in found or one.log_posterior > found[ids].log_posterior:
                    found[ids] = one
        new = self._unknown({ids: one.log_posterior for ids, one in found.items() if ids != best.ids})
        for ids in sorted(new, key=lambda ids: -new[ids])[:BESIDE]:
            if new[ids] > best.log_posterior + WORTH:
                D = variances(self.problem.entries, ids, best.kappa)
                fit = refit(self.problem, found[ids].z, found[ids].J, D, most_fresh=0)
                self._take(candidate_of(self.problem, ids, fit))

    def _straighten(self, best: Candidate) -> None:
        """Fit the best candidate, and it without one of its causes, from the smooth side of their kinks."""
        rests = [tuple(one for one in best.ids if one != without) for without in best.ids]
        for ids in [best.ids, *rests]:
            fit, D = self.candidates[ids].fit, variances(self.problem.entries, ids, 1.0)
            if found := straightened(self.problem, fit, ids, D):
                self._take(candidate_of(self.problem, ids, found))

    def _without(self, best: Candidate, without: str) -> None:
        """Fit the best hypothesis without one of its causes, and with others in its place."""
        rest = tuple(one for one in best.ids if one != without)
        self._below(rest, best.fit)
        found = self._unknown(instead(self.problem, best, rest))
        self.fit_all(sorted(found, key=lambda ids: -found[ids])[:INSTEAD], best.fit)

    def _unknown(self, found: dict[Ids, float]) -> dict[Ids, float]:
        """Return those of estimated log posteriors that no fit is known of, or only one that went astray from afar."""
        known = {ids: one.log_posterior for ids, one in self.candidates.items()}
        return {ids: log for ids, log in found.items() if known.get(ids, -np.inf) < log - ASTRAY}

    def _nothing(self) -> None:
        """Fit "nothing is wrong" from where the best fit is, if that explains more: what is outside is beside it."""
        best, none = self.best(), self.candidates[()]
        for kappa in sorted({best.kappa, none.kappa}) if best.ids else ():
            D = variances(self.problem.entries, (), kappa)
            fit = refit(self.problem, best.fit.z, best.fit.J, D, most_fresh=0, made_at=best.fit.made_at)
            if candidate_of(self.problem, (), fit).log_posterior > self.candidates[()].log_posterior:
                self._keep((), fit)


def _akin(ids: Ids, others: Ids) -> bool:
    """Say whether hypotheses are the same but for at most one cause more in one of them."""
    return len(set(ids) ^ set(others)) <= 1
