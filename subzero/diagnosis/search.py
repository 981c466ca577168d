"""The search: from all hypotheses by linear evidence to a few by real fits.

all tolerances wide → a point close to the data → linear evidence of everything there → refits of what is left
→ a second cause beside the best, and a third, or another in the place of one → probabilities
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from os import cpu_count
from typing import TypeVar

import numpy as np

from subzero.diagnosis.candidate import Candidate, candidate_of
from subzero.diagnosis.evidence import posterior
from subzero.diagnosis.hypotheses import Ids, places, variances
from subzero.diagnosis.pose import with_finer_steps
from subzero.diagnosis.probability import Beliefs
from subzero.diagnosis.problem import Problem, Progress
from subzero.diagnosis.refit import ENOUGH, NEARLY, Fit, refit
from subzero.diagnosis.screen import Screen, beside, instead, is_flat, look, swept
from subzero.diagnosis.wide import fit_wide

Asked, Made = TypeVar("Asked"), TypeVar("Made")
KEEP, SINGLES, PAIRS = 12.0, 7, 4
"""Refit hypotheses whose log evidence is this close to the best of their kind, and at most so many."""
BENT, LEAST_BENT = 2, 10.0
"""So many causes that the wide fit bends by at least so many tolerances are fitted by themselves."""
SWEPT = 4
"""So many causes are fitted by themselves if the wide fit is not close."""
RACERS, HOPELESS = 6, 6.0
"""At most so many fits with sensitivities of their own in a race; none for what is this far behind in log posterior."""
NEAR, NEARER = 4.0, 1.0
"""Sensitivities hold as far as this from where they were made, in tolerances; those of what is told."""
MOST_RUNS = 800
"""After so many runs only what hopes to be the best is fitted again."""
BESIDE, INSTEAD, WORTH = 2, 3, -4.0
"""At most so many with a cause more, of a log posterior that adds at least WORTH; so many with another cause."""
CROSSED = 2
"""So often close rivals are fitted from where the others are."""
ASTRAY = 6.0
"""A fit with so much less log posterior than the linear problem at another promises may have gone astray."""
MOST_CAUSES, ROUNDS = 3, 4
"""Causes of a hypothesis, and rounds of growing."""
LAST, RIVALS, CLOSE = 3, 2.0, 6.0
"""Rounds of settling the best and what is so close to it in log posterior; what has a cause more or less may catch up
from farther behind."""


@dataclass(kw_only=True, eq=False)
class Search:
    """A search that goes on: what was found so far is always in `candidates`.

    Attributes:
        problem: records and parameters.
        progress: told what is being tried.
        wide: the fit with wide tolerances.
        nominal: residual and sensitivities of the nominal model.
        screen: what the linear problem at the wide fit says.
        candidates: hypothesis → its real fit.
        raced: hypotheses that were fitted with sensitivities of their own.
        beside: hypothesis → log posterior, estimated at the fit of one with a cause less.
        behind: hypothesis → how far its fit was behind the best when it was given up, in log posterior.
        economical: the problem before what economical steps get wrong was taken from its records.
        sharp_at: the hypothesis at whose fit that was done.
        side: threads for fits side by side, whose runs may use those of the problem.
    """

    problem: Problem
    progress: Progress
    wide: Fit = field(init=False)
    nominal: tuple[np.ndarray, np.ndarray] = field(init=False)
    screen: Screen = field(default_factory=Screen)
    candidates: dict[Ids, Candidate] = field(default_factory=dict)
    raced: set[Ids] = field(default_factory=set)
    beside: dict[Ids, float] = field(default_factory=dict)
    behind: dict[Ids, float] = field(default_factory=dict)
    economical: Problem = field(init=False)
    sharp_at: Ids | None = None
    side: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(cpu_count() or 1))

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
            self.race(2, 2.0)
            self.cross()
            self.sharpen()

    def cross(self) -> None:
        """Fit the close rivals of the best candidate from where that is, and it from where they are, and keep what is
        better: where a drum stops or a cable falls slack runs have kinks, and a fit may end in a hollow of its own.
        """
        for _ in range(CROSSED):
            best = self.best()
            close = [ids for ids in self._ranked()[1:RACERS]
                     if self.candidates[ids].log_posterior > best.log_posterior - HOPELESS]  # fmt: skip
            self.fit_all(close, best.fit)
            starts = [self.candidates[ids].fit for ids in close]
            for found in self._aside(partial(self._fitted, best.ids), starts):
                self._take(found)
            if self.best().log_posterior < best.log_posterior + NEARLY:
                return

    def settle(self) -> None:
        """Fit the best candidate again until it has settled, so that its numbers can be told, and what might still
        catch up with it; then its rivals from where it is.
        """
        stuck: set[Ids] = set()
        for _ in range(LAST):
            best = self.best()
            for one in [
                one for one in self.candidates.values() if one.ids not in stuck and self._is_open(one, best)
            ]:
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
        return (
            behind < CLOSE and _akin(one.ids, best.ids) and not (one.fit.converged or self._settled(one.fit))
        )

    def fit(self, ids: Ids, start: Fit | None = None) -> None:
        """Fit a hypothesis as `fit_all` does."""
        self.fit_all([ids], start)

    def fit_all(self, several: Sequence[Ids], start: Fit | None = None, words: str = "") -> None:
        """Fit hypotheses with real runs, side by side: with the sensitivities of the wide fit, those that no fit is
        known of; or from another fit, and keep what is better.
        """
        wanted = [ids for ids in dict.fromkeys(several) if start or ids not in self.candidates]
        for ids, found in zip(wanted, self._aside(partial(self._fitted, start=start), wanted), strict=True):
            if words:
                self._say(0.3, words, ids)
            self._take(found)

    def _take(self, found: Candidate) -> None:
        """Keep a candidate if it is better than what is known of it."""
        known = self.candidates.get(found.ids)
        if known is None or found.log_posterior > known.log_posterior:
            self.candidates[found.ids] = found
            self.raced.discard(found.ids)

    def _fitted(self, ids: Ids, start: Fit | None) -> Candidate:
        """Return a hypothesis with its fit from another, or from the wide one."""
        D, z = variances(self.problem.entries, ids, 1.0), None if start else self.screen.secants.get(ids)
        start = start or self.wide
        z = posterior(start.quadratic, D).z if z is None else z
        J = self._with_slopes(start.J, ids)
        return candidate_of(
            self.problem, ids, refit(self.problem, z, J, D, most_fresh=0, made_at=start.made_at)
        )

    def _aside(self, make: Callable[[Asked], Made], several: Sequence[Asked]) -> Iterator[Made]:
        """Return what is made of each of several, side by side: the runs of one fit come one after the other."""
        return self.side.map(make, several)

    def race(self, most: int = RACERS, hopeless: float = HOPELESS) -> None:
        """Fit candidates again with sensitivities of their own, the best first, until the next is hopeless."""
        for _ in range(most):
            self.raced |= {one.ids for one in self.candidates.values() if self._settled(one.fit)}
            waiting = [one for one in self.candidates.values() if one.ids not in self.raced]
            if not waiting:
                return
            now = max(waiting, key=lambda one: one.hope)
            done = [self.candidates[ids].log_posterior for ids in self.raced]
            behind = 0.0 if self.problem.kept.asked > MOST_RUNS else hopeless
            if len(done) >= 2 and now.hope < max(done) - behind:
                return
            self._say(0.5, "fitting again", now.ids)
            self._again(now)

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

    def best(self) -> Candidate:
        """Return the most probable candidate."""
        return max(self.candidates.values(), key=lambda candidate: candidate.log_posterior)

    def _ranked(self) -> list[Ids]:
        """Return the candidates, the most probable first."""
        return sorted(self.candidates, key=lambda ids: -self.candidates[ids].log_posterior)

    @property
    def beliefs(self) -> Beliefs:
        """What is known of all hypotheses by now."""
        return Beliefs(candidates=self.candidates, screen=self.screen, beside=self.beside, behind=self.behind)

    def _say(self, share: float, words: str, ids: Ids, more: str = "") -> None:
        self.progress(share, f"{words} {' + '.join(ids) or 'nothing wrong'}{more}")

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
        for one in [
            one for one in self.candidates.values() if len(one.ids) < MOST_CAUSES and one is not best
        ]:
            for ids, log in self._unknown(beside(self.problem, one)).items():
                if log > max(best.log_posterior, found.get(ids, (-np.inf,))[0]):
                    found[ids] = log, one.fit
        for ids in sorted(found, key=lambda ids: -found[ids][0])[:BESIDE]:
            self.fit(ids, found[ids][1])

    def _kinked(self, best: Candidate) -> None:
        """Fit causes that runs have kinks in beside the best, or in the place of one of the same kind."""
        found = dict[Ids, tuple[float, np.ndarray, np.ndarray]]()
        few = best.ids if len(best.ids) < MOST_CAUSES else None
        for rest in (few, *(tuple(one for one in best.ids if one != without) for without in best.ids)):
            for ids, one in swept(self.problem, best, rest).items() if rest is not None else ():
                found[ids] = max(found.get(ids, one), one, key=lambda it: it[0])
        new = self._unknown({ids: log for ids, (log, _, _) in found.items() if ids != best.ids})
        for ids in sorted(new, key=lambda ids: -new[ids])[:BESIDE]:
            if new[ids] > best.log_posterior + WORTH:
                _, z, J = found[ids]
                D = variances(self.problem.entries, ids, best.kappa)
                self._take(candidate_of(self.problem, ids, refit(self.problem, z, J, D, most_fresh=0)))

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

    def _below(self, ids: Ids, fit: Fit) -> None:
        """Fit a part of a hypothesis from its fit, if that is better than what is known of the part."""
        known = self.candidates.get(ids)
        D = variances(self.problem.entries, ids, known.kappa if known else 1.0)
        z = posterior(fit.quadratic, D).z
        found = refit(self.problem, z, fit.J, D, most_fresh=0, made_at=fit.made_at)
        if known is None or found.objective < known.fit.objective - 0.1:
            self._keep(ids, found)
            self.raced.discard(ids)

    def _nothing(self) -> None:
        """Fit "nothing is wrong" from where the best fit is, if that explains more: what is outside is beside it."""
        best, none = self.best(), self.candidates[()]
        for kappa in sorted({best.kappa, none.kappa}) if best.ids else ():
            D = variances(self.problem.entries, (), kappa)
            fit = refit(self.problem, best.fit.z, best.fit.J, D, most_fresh=0, made_at=best.fit.made_at)
            if candidate_of(self.problem, (), fit).log_posterior > self.candidates[()].log_posterior:
                self._keep((), fit)

    def _settled(self, fit: Fit, near: float = NEAR) -> bool:
        """Say whether a fit has converged close to where its sensitivities were made, or has not left from there."""
        if fit.made_at is None:
            return False
        tolerance = np.array([entry.parameter.tolerance for entry in self.problem.entries])
        moved = float(np.max(np.abs(fit.z - fit.made_at) / tolerance))
        return moved == 0.0 or (fit.converged and moved < near)

    def _again(self, one: Candidate) -> None:
        """Fit a candidate with sensitivities of its own, under its most probable κ; again if that turns out another."""
        self.raced.add(one.ids)
        J, D = self.problem.jacobian(one.fit.z), variances(self.problem.entries, one.ids, one.kappa)
        fit = refit(self.problem, one.fit.z, J, D, r=one.fit.r, most_fresh=1, made_at=one.fit.z)
        now = self._keep(one.ids, fit)
        if now.kappa != one.kappa:
            D = variances(self.problem.entries, one.ids, now.kappa)
            self._keep(
                one.ids, refit(self.problem, fit.z, fit.J, D, r=fit.r, most_fresh=0, made_at=fit.made_at)
            )

    def _with_slopes(self, J: np.ndarray, ids: Ids) -> np.ndarray:
        """Return sensitivities with secants for those causes of a hypothesis that do nothing when they are small."""
        J = J.copy()
        for k in places(self.problem.entries, ids):
            if k in self.screen.columns and is_flat(self.problem.entries[k], J[:, k]):
                J[:, k] = self.screen.columns[k]
        return J

    def _keep(self, ids: Ids, fit: Fit) -> Candidate:
        """Keep a fit and return its candidate."""
        self.candidates[ids] = candidate_of(self.problem, ids, fit)
        return self.candidates[ids]


def _akin(ids: Ids, others: Ids) -> bool:
    """Say whether hypotheses are the same but for at most one cause more in one of them."""
    return len(set(ids) ^ set(others)) <= 1
