"""The search over hypotheses: from linear evidence of all to MAP fits of a few, by adding, dropping and swapping
causes.

fit with κ = 4 → screening of no cause, all causes, all pairs → fits of the best, and of causes that are better where
sizes are simulated from the nominal model → best-first refinement → add, drop, swap, or merge two causes of the best,
until it no longer changes → refit the best and its rivals until they converge
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import chain, combinations

import numpy as np

from subzero.diagnosis.hypothesis.hypotheses import MAX_CAUSES, Ids, columns_of, nameable, variances
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.linear_gaussian import KAPPAS
from subzero.diagnosis.inference.map_fit import (
    Candidate,
    Fit,
    candidate_of,
    continued,
    is_poor_fit,
    refit,
    restarted_where_smooth,
)
from subzero.diagnosis.inference.model_average import Added, Beliefs
from subzero.diagnosis.inference.model_fits import Fits
from subzero.diagnosis.inference.screening import (
    TriedSize,
    fit_wide,
    is_close,
    screening_of,
    swept_from_nominal,
    with_one_added,
    with_one_swapped,
    with_sizes_tried,
    without_slope,
)


@dataclass(kw_only=True, eq=False)
class Search(Fits):
    """A search that can be continued, with more fits around the best: all fits so far are in `candidates`.

    Attributes:
        is_far: no fit is close to the records so far, not even within wide tolerances.
        one_more: hypothesis → gain of its further cause, estimated at the fit of one with a cause less.
        restarted: hypotheses that were fitted again from smooth values of their non-smooth parameters.
    """

    is_far: bool = False
    one_more: dict[Ids, Added] = field(default_factory=dict)
    restarted: set[Ids] = field(default_factory=set)

    def grow(self) -> None:
        """Add a cause to the best candidate, swap each of its causes for another, and drop each, until the best no
        longer changes: at most once for each cause that it may have, and once more.
        """
        looked: set[Ids] = set()
        for _ in range(MAX_CAUSES + 1):
            best = self.restart(self.best())
            if best.ids in looked:
                return
            looked.add(best.ids)
            self._report_progress(0.7, "a further cause with", best.ids)
            self.fit_all(self._more(best) if len(best.ids) < MAX_CAUSES else [], best.fit)
            for without in best.ids:
                self._without(best, without)
            self._compare_with_others(best)
            self._of_real_size(best)
            self.refine(settings.MAX_ADDED, settings.CLOSE_NATS)
            self.cross()
            self.sharpen()
            if self.best().ids == best.ids:
                self._simpler()

    def _more(self, best: Candidate) -> list[Ids]:
        """Return the best hypotheses with one cause more, in the linear problem at the best fit."""
        found = self._unknown(with_one_added(self.problem, best))
        self.one_more |= {ids: Added(best.ids, log - best.log_posterior) for ids, log in found.items()}
        return _best_of(found, best.log_posterior - settings.FURTHER_CAUSE_NATS)

    def _without(self, best: Candidate, without: str) -> None:
        """Fit the best hypothesis without one of its causes, and with others instead of it."""
        rest = tuple(cause_id for cause_id in best.ids if cause_id != without)
        self._below(rest, best.fit)
        found = self._unknown(with_one_swapped(self.problem, best, rest))
        self.fit_all(sorted(found, key=lambda ids: -found[ids])[: settings.MAX_TRIED], best.fit)

    def _compare_with_others(self, best: Candidate) -> None:
        """Fit the best hypotheses with one cause added to the other candidates, if their linear evidence there
        exceeds that of the best: the true pair may be far from a wrong cause that is as probable as any by itself.
        """
        found: dict[Ids, tuple[float, Fit]] = {}
        for candidate in self.candidates.values():
            if candidate is not best and len(candidate.ids) < MAX_CAUSES:
                for ids, log in self._unknown(with_one_added(self.problem, candidate)).items():
                    if log > max(best.log_posterior, found.get(ids, (-np.inf,))[0]):
                        found[ids] = log, candidate.fit
        for ids in sorted(found, key=lambda ids: -found[ids][0])[: settings.MAX_ADDED]:
            self.fit(ids, found[ids][1])

    def _of_real_size(self, best: Candidate) -> None:
        """Fit causes that have no effect while they are small, added to the best or instead of one of its causes: in
        the linear problem they have no sensitivity.
        """
        found, entries = dict[Ids, TriedSize](), self.problem.entries
        flat = set(without_slope(self.problem, best.fit.J))
        rests = [tuple(cause_id for cause_id in best.ids if cause_id != without) for without in best.ids]
        for rest in [best.ids, *rests] if len(best.ids) < MAX_CAUSES else rests:
            for ids, candidate in with_sizes_tried(
                self.problem, best, rest, sorted(flat - set(columns_of(entries, rest))), settings.SWEEP_SCALES
            ).items():
                if ids not in found or candidate.log_posterior > found[ids].log_posterior:
                    found[ids] = candidate
        for ids in self._worth_fitting(found, best, -settings.FURTHER_CAUSE_NATS):
            D = variances(entries, ids, best.kappa)
            fit = refit(self.problem, found[ids].z, found[ids].J, D, most_fresh=0)
            self._take(candidate_of(self.problem, ids, fit))

    def _simpler(self) -> None:
        """Fit causes instead of two of the best candidate's: one large cause may look like two, and then the linear
        problem there is inaccurate for it.
        """
        best, found, entries = self.best(), dict[Ids, TriedSize](), self.problem.entries
        others = columns_of(
            entries,
            tuple(candidate for candidate in nameable(self.problem.entries) if candidate not in best.ids),
        )
        for rest in combinations(best.ids, len(best.ids) - 2) if len(best.ids) > 1 else ():
            found |= with_sizes_tried(self.problem, best, rest, others, settings.MERGED_SCALES)
        worth = self._worth_fitting(found, best, -settings.LINEAR_NATS)
        for ids in worth:
            z, D = found[ids].z, variances(entries, ids, best.kappa)
            fit = refit(self.problem, z, self.problem.jacobian(z), D, most_fresh=2, made_at=z)
            self._take(candidate_of(self.problem, ids, fit))
        self.refine(2 if worth else 0)

    def _worth_fitting(self, found: Mapping[Ids, TriedSize], best: Candidate, least: float) -> list[Ids]:
        """Return the best of the hypotheses that were simulated but not yet fitted, if their log posterior exceeds
        that of the best plus `least`.
        """
        new = self._unknown(
            {ids: candidate.log_posterior for ids, candidate in found.items() if ids != best.ids}
        )
        return _best_of(new, best.log_posterior + least)

    def restart(self, candidate: Candidate) -> Candidate:
        """Fit a candidate once more from smooth values of its non-smooth parameters, if that was not done before, and
        return the best candidate.
        """
        if candidate.ids not in self.restarted:
            self.restarted.add(candidate.ids)
            D = variances(self.problem.entries, candidate.ids, candidate.kappa)
            self._take(
                candidate_of(
                    self.problem,
                    candidate.ids,
                    restarted_where_smooth(self.problem, candidate.fit, candidate.ids, D),
                )
            )
        return self.best()

    def _unknown(self, found: dict[Ids, float]) -> dict[Ids, float]:
        """Return the estimated log posteriors of hypotheses without a fit, or with one in a bad local minimum, far
        below the estimate.
        """
        known = {ids: candidate.log_posterior for ids, candidate in self.candidates.items()}
        return {
            ids: log for ids, log in found.items() if known.get(ids, -np.inf) < log - settings.HOPELESS_NATS
        }

    def begin(self) -> None:
        """Compute the sensitivities at the nominal model, and the fit with wide tolerances."""
        self.problem, self.wide, self.nominal = fit_wide(self.problem, self.progress)
        self.economical, self.is_far = self.problem, not is_close(self.problem, self.wide)

    def only_nothing(self) -> None:
        """Use the wide fit as that of "nothing is wrong", before any other fit."""
        self._take(candidate_of(self.problem, (), self.wide))

    def relinearise_at(self, fit: Fit) -> None:
        """Use a fit that is closer to the records than the wide fit as the linearisation point."""
        self.wide, self.is_far = fit, False

    def fit_like(self, other: Candidate) -> None:
        """Fit a hypothesis from its optimum for the same trials with other corrections of the records, with the
        sensitivities there.
        """
        z, D = other.fit.z, variances(self.problem.entries, other.ids, other.kappa)
        fit = refit(self.problem, z, self.problem.jacobian(z), D, most_fresh=1, made_at=z)
        self._take(candidate_of(self.problem, other.ids, fit))

    def screen_causes(self) -> None:
        """Screen: linear evidence of no cause, every cause, and every pair."""
        self.screen = screening_of(self.problem, self.wide, self.nominal, far=self.is_far)

    def first_fits(self) -> None:
        """Fit "nothing is wrong" and the best causes and pairs of the screening by simulations, with the
        sensitivities at hand.
        """
        if self.screen.far:
            self.fit_large_effects()
        first = [] if self.screen.far else self._first()
        for ids, fit in zip(first, self._in_parallel(self._alone, first), strict=True):
            self._report_progress(0.3, "fitting", ids, " by itself")
            self._keep(ids, fit)
        best = (
            self.screen.best(1, settings.MAX_RANKED, settings.LINEAR_NATS),
            self.screen.best(2, settings.MAX_PAIRS, settings.LINEAR_NATS),
        )
        self.fit_all(list(chain([()], *best)), words="fitting")

    def fit_from_nominal(self) -> None:
        """Fit single causes that are better than all fits so far when some sizes of them are simulated from the
        nominal model: for causes that change the motion much the linear problem at a wide fit is inaccurate. Where
        only wide tolerances explain the records, the best of them are fitted in any case. Nothing is done where the
        wide fit was far from the records, as they were so fitted then, or where nothing seems wrong.
        """
        if self.screen.far or not (self.best().ids or self.is_poor()):
            return
        swept = swept_from_nominal(self.problem, *self.nominal)
        least = -np.inf if self.is_poor() else self.best().log_posterior
        for ids in _best_of(self._unknown(swept.log_posterior), least):
            self._report_progress(0.4, "fitting", ids, " by itself")
            self._take(candidate_of(self.problem, ids, self._alone(ids, swept.starts[ids])))

    def fit_large_effects(self) -> None:
        """Fit the best causes of the screen by themselves, the best first; once one explains the records, within
        declared tolerances, those far below it in the screening are left out.
        """
        for ids in self._first():
            best = self.best().log_posterior
            if not self.is_poor() and self.screen.log_posterior[ids] < best - settings.DECISIVE_NATS:
                return
            if ids not in self.candidates:
                self._report_progress(0.3, "fitting", ids, " by itself")
                self._keep(ids, self._alone(ids))

    def set_aside(self) -> dict[Ids, Candidate]:
        """Continue as if only the wide fit existed, and return the candidates, for `take_back`."""
        aside, self.candidates = self.candidates, {}
        self.only_nothing()
        return aside

    def take_back(self, candidates: Mapping[Ids, Candidate]) -> None:
        """Keep candidates that are better than the known fits of their hypotheses."""
        for candidate in candidates.values():
            self._take(candidate)

    def refine_first(self) -> None:
        """Fit the best candidates again, with sensitivities of their own."""
        self.refine(2)
        self.sharpen()
        self.refine()

    def is_poor(self) -> bool:
        """Say whether no fit so far explains the records within declared tolerances."""
        return is_poor_fit(self.best().fit) or self.best().kappa > min(KAPPAS)

    def settle(self) -> None:
        """Fit the best candidate again until it has converged, so that its numbers can be reported, and those that
        might still become better; then its rivals from its optimum.
        """
        self._restart_best()
        stuck: set[Ids] = set()
        for _ in range(settings.MAX_TRIED):
            best = self.best()
            for each in [
                candidate for candidate in self.candidates.values() if self._is_open(candidate, best)
            ]:
                if each.ids in stuck:
                    continue
                self._report_progress(0.75, "settling", each.ids)
                self._again(each)
                if (
                    self.candidates[each.ids].log_posterior
                    < each.log_posterior + settings.NEGLIGIBLE_GAIN_NATS
                ):
                    stuck.add(each.ids)
        self.cross()
        self._nothing()

    def _restart_best(self) -> None:
        """Fit the first candidates from smooth values of their non-smooth parameters, if they are close to the best
        and were not so restarted before.
        """
        for ids in self._ranked()[: settings.MAX_TRIED]:
            close = self.candidates[ids].log_posterior > self.best().log_posterior - settings.HOPELESS_NATS
            if close and ids not in self.restarted:
                self._report_progress(0.75, "once more", ids)
                self.restart(self.candidates[ids])

    def _is_open(self, candidate: Candidate, best: Candidate) -> bool:
        """Say whether a candidate that is as good as the best, or might still become so, has not converged."""
        behind = best.log_posterior - candidate.optimistic_log_posterior
        if behind < settings.CLOSE_NATS:
            return not self._settled(candidate.fit, settings.OWN_JACOBIAN_TOLERANCES)
        akin = behind < settings.HOPELESS_NATS and _akin(candidate.ids, best.ids)
        return (
            akin
            and not candidate.fit.converged
            and not self._settled(candidate.fit, settings.JACOBIAN_HOLDS_TOLERANCES)
        )

    @property
    def beliefs(self) -> Beliefs:
        """The posterior over all hypotheses, from the fits so far."""
        return Beliefs(
            candidates=self.candidates, screen=self.screen, one_more=self.one_more, behind=self.behind
        )

    def _first(self) -> list[Ids]:
        """Return the causes that are fitted by themselves: those that the wide fit moves most, for which the linear
        problem is inaccurate; or, if it is not close to the records, the best of those that were simulated at some
        sizes.
        """
        if self.screen.far:
            return self.screen.best(1, settings.MAX_PAIRS, np.inf)
        moved: dict[Ids, float] = {}
        for z, entry in zip(self.wide.z, self.problem.entries, strict=True):
            if entry.record < 0:
                size, ids = abs(float(z)) / entry.parameter.tolerance, (entry.effect.id,)
                moved[ids] = max(size, moved.get(ids, 0.0))
        return [
            ids
            for ids in sorted(moved, key=lambda ids: -moved[ids])[: settings.MAX_ADDED]
            if moved[ids] > settings.BENT_TOLERANCES
        ]

    def _alone(self, ids: Ids, start: np.ndarray | None = None) -> Fit:
        """Return the fit of a cause from deviations (k,), those of the wide fit if None, all else nominal, with the
        sensitivities there.
        """
        z, at = np.zeros(len(self.problem.entries)), columns_of(self.problem.entries, ids)
        z[at] = (self.screen.starts.get(ids, self.wide.z) if start is None else start)[at]
        D = variances(self.problem.entries, ids, 1.0)
        return continued(
            self.problem, refit(self.problem, z, self.problem.jacobian(z), D, most_fresh=2, made_at=z)
        )

    def _nothing(self) -> None:
        """Fit "nothing is wrong" from the best fit, and keep that if it is better: explanations that are not in the
        catalogue are added to it.
        """
        best, none = self.best(), self.candidates[()]
        for kappa in sorted({best.kappa, none.kappa}) if best.ids else ():
            D = variances(self.problem.entries, (), kappa)
            fit = refit(self.problem, best.fit.z, best.fit.J, D, most_fresh=0, made_at=best.fit.made_at)
            if candidate_of(self.problem, (), fit).log_posterior > self.candidates[()].log_posterior:
                self._keep((), fit)


def _akin(ids: Ids, others: Ids) -> bool:
    """Say whether hypotheses differ by at most one cause, which one of them has in addition."""
    return len(set(ids) ^ set(others)) <= 1


def _best_of(found: Mapping[Ids, float], least: float) -> list[Ids]:
    """Return the best hypotheses, at most MAX_ADDED, of those whose log posterior is above the least."""
    ranked = sorted(found, key=lambda ids: -found[ids])[: settings.MAX_ADDED]
    return [ids for ids in ranked if found[ids] > least]
