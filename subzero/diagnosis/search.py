"""The search: from all hypotheses by linear evidence to a few by real fits.

all tolerances wide → a point close to the data → linear evidence of everything there → refits of what is left
→ a second cause beside the best, and a third, or another in the place of one → probabilities
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import numpy as np

from subzero.diagnosis.candidate import Candidate, candidate_of
from subzero.diagnosis.evidence import KAPPAS
from subzero.diagnosis.growing import GrowingFits
from subzero.diagnosis.hypotheses import Ids, places, variances
from subzero.diagnosis.probability import Beliefs
from subzero.diagnosis.refit import Fit, gone_on, is_lost, refit
from subzero.diagnosis.screen import is_close, look
from subzero.diagnosis.stride import ENOUGH
from subzero.diagnosis.wide import fit_wide

KEEP, SINGLES, PAIRS = 12.0, 7, 4
"""Refit hypotheses whose log evidence is this close to the best of their kind, and at most so many."""
BENT, LEAST_BENT = 2, 10.0
"""So many causes that the wide fit bends by at least so many tolerances are fitted by themselves."""
SWEPT = 4
"""So many causes are fitted by themselves if the wide fit is not close."""
FIRST, LAST, NEARER = 3, 3, 1.0
"""So many are fitted from off their kinks; rounds of settling; so close, in tolerances, the sensitivities of what is
told were made.
"""
RIVALS, CLOSE = 2.0, 6.0
"""What is so close to the best in log posterior is settled, too; what has a cause more or less, from farther behind;
the first within CLOSE are fitted from off their kinks, too.
"""


@dataclass(kw_only=True, eq=False)
class Search(GrowingFits):
    """A search that goes on: what was found so far is always in `candidates`.

    Attributes:
        is_far: nothing came close to the records so far, not even within wide tolerances.
    """

    is_far: bool = False

    def begin(self) -> None:
        """Make the sensitivities at the nominal model, and the fit with wide tolerances."""
        self.problem, self.wide, self.nominal = fit_wide(self.problem, self.progress)
        self.economical, self.is_far = self.problem, not is_close(self.problem, self.wide)

    def only_nothing(self) -> None:
        """Take the wide fit for that of "nothing is wrong", before anything else is known."""
        self._take(candidate_of(self.problem, (), self.wide))

    def go_near(self, fit: Fit) -> None:
        """Make everything around a linear problem that is closer to the records than that of the wide fit."""
        self.wide, self.is_far = fit, False

    def look(self) -> None:
        """Fill the screen: linear evidence of nothing, every cause, and every pair."""
        self.screen = look(self.problem, self.wide, self.nominal, far=self.is_far)

    def first_fits(self) -> None:
        """Fit nothing, and the best causes and pairs of the screen, with real runs and the sensitivities at hand."""
        first = self._first()
        for ids, fit in zip(first, self._aside(self._alone, first), strict=True):
            self._say(0.3, "fitting", ids, " by itself")
            self._keep(ids, fit)
        best = self.screen.best(1, SINGLES, KEEP), self.screen.best(2, PAIRS, KEEP)
        self.fit_all(list(chain([()], *best)), words="fitting")

    def races(self) -> None:
        """Fit what came out best again, with sensitivities of its own."""
        self.race(2)
        self.sharpen()
        self.race()

    def is_lost(self) -> bool:
        """Say whether nothing that was fitted so far explains the records, within declared tolerances."""
        return is_lost(self.best().fit) or self.best().kappa > min(KAPPAS)

    def settle(self) -> None:
        """Fit the best candidate again until it has settled, so that its numbers can be told, and what might still
        catch up with it; then its rivals from where it is.
        """
        self._once_more()
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

    def _once_more(self) -> None:
        """Fit the first candidates from off their kinks, if they are close to the best and were not so begun before."""
        for ids in self._ranked()[:FIRST]:
            close = self.candidates[ids].log_posterior > self.best().log_posterior - CLOSE
            if close and ids not in self.begun:
                self._say(0.75, "once more", ids)
                self.begin_again(self.candidates[ids])

    def _is_open(self, one: Candidate, best: Candidate) -> bool:
        """Say whether a candidate that is as good as the best, or might still catch up with it, has not settled."""
        behind = best.log_posterior - one.hope
        if behind < RIVALS:
            return not self._settled(one.fit, NEARER)
        akin = behind < CLOSE and _akin(one.ids, best.ids)
        return akin and not one.fit.converged and not self._settled(one.fit)

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
        return gone_on(
            self.problem, refit(self.problem, z, self.problem.jacobian(z), D, most_fresh=2, made_at=z)
        )

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
