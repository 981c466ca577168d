"""Which errors in the data a diagnosis goes on without: proposed by a scan, and then held against physics.

Nothing is named because `data_error_search` suspects it. Sets of suspects, from all of them to none, are explanations
like others (`compared`): a record without them has a search of its own, with causes, what begins in mid-trial, forces
and drifts. T the corrections, y the record as written:

    log p(y, errors) = log Σ_M p(T y | M) p(M) + Σ log|dT/dy| + Σ log p(error) + log p(noise)

A sample that is lost counts as any other. But where a rounded channel may be frozen or stand still, what it repeats is
certain in the one case, and in the other an interval each, no density (`repeated_values`).

A search that is hopelessly behind ends with its first look. What the linear problem leaves no choice of is corrected
before anything is searched, and the records with it are not searched at all if causes that hold throughout explain what
is left (`is_clear`): what no vehicle does (another sign, unit or reference of one channel, exchanged columns, repeated
values) where physics has no chance with all its parameters free at once; a command, a clock or a latency where a few
causes, throughout or from mid-trial on, are hopelessly behind (`data_error_search`). A step in a sensor is always held
against a search of the records with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np

from subzero.diagnosis.hypothesis.data_error import DataError, corrected
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.change_point_fit import FittedChangePoint
from subzero.diagnosis.inference.data_error_scan import log_prior
from subzero.diagnosis.inference.data_error_search import (
    LOUD,
    SuspectedError,
    Suspicion,
    explain,
    is_soft,
    without,
)
from subzero.diagnosis.inference.data_error_yardstick import OUTLIER_LOG_DENSITY
from subzero.diagnosis.inference.latent_force import FORCE
from subzero.diagnosis.inference.linear_gaussian import log_sum
from subzero.diagnosis.inference.map_fit import is_poor_fit
from subzero.diagnosis.inference.noise import log_prior_of, usual_of
from subzero.diagnosis.inference.out_of_catalogue import Findings
from subzero.diagnosis.inference.out_of_catalogue import is_explained as is_found
from subzero.diagnosis.inference.problem import Observed, Problem
from subzero.diagnosis.inference.repeated_values import log_odds_of_frozen, steps_of

ALIKE = 10
"""So many errors of a kind share its probability, about."""


def is_clear(errors: Sequence[SuspectedError], work: Findings) -> bool:
    """Say whether errors need not be held against a search of the records with them: what is left then is explained
    without anything that begins in mid-trial, and without a force.
    """
    outside = max((one.log_posterior for one in work.out_of_catalogue), default=-np.inf)
    explained = work.search.best().log_posterior > outside and is_explained(work)
    return explained and all(one.is_clear for one in errors)


def may_be_named(errors: Sequence[SuspectedError], work: Findings) -> bool:
    """Say whether errors may be the verdict: those that something else may look like only if they explain all."""
    return is_explained(work) or not any(is_soft(one) for one in errors)


def is_explained(work: Findings) -> bool:
    """Say whether one explanation leaves nothing but the noise of usual sensors."""
    usual = all(noise.sd < LOUD * usual_of(name, one.values[name], one.known).level + noise.resolution
                for one in work.problem.records for name, noise in one.noise.items())  # fmt: skip
    return usual and (
        not is_poor_fit(work.search.best().fit) or any(one.point for one in work.out_of_catalogue)
    )


class Standing(NamedTuple):
    """A rounded channel of a record that repeats its value to the end (n,), and may be frozen."""

    record: int
    channel: str
    run: np.ndarray

    def log_excess(self, work: Findings) -> float:
        """Return by how much the evidence is too great with its values as densities: what they add to it behind the
        best fit, and the log odds that it is frozen, not standing still, where each value is an interval.
        """
        problem, r = _best_residual(work)
        one, white = problem.records[self.record], _own(problem, r, self.record, self.channel)
        noise, usual = one.noise[self.channel], usual_of(self.channel, one.values[self.channel], one.known)
        run = self.run[noise.used]
        if not run.any():
            return 0.0
        before = replace(noise, used=noise.used & ~self.run, time=noise.time[~run])
        added = before.log_scale - noise.log_scale - 0.5 * float(np.sum(white[run] ** 2))
        return added + log_odds_of_frozen(steps_of(noise.time, noise.colour(white), usual), run)


def _best_residual(work: Findings) -> tuple[Problem, np.ndarray]:
    """Return the residual (m,) of the most probable explanation that has a run of its own, and its problem: of a drift
    there is none.
    """
    best = work.search.best()
    least, found = best.log_posterior, (work.problem, best.fit.r)
    for one in work.out_of_catalogue:
        if one.log_posterior > least and isinstance(one.what, FittedChangePoint):
            least, found = one.log_posterior, (one.what.problem, one.what.fit.r)
        elif one.log_posterior > least and one.point and one.id.startswith(FORCE):
            along = one.point.along
            least, found = one.log_posterior, (along.problem, along.problem.residual(along.z))
    return found


def _own(problem: Problem, r: np.ndarray, record: int, channel: str) -> np.ndarray:
    """Return the part of a residual (m,) that is of one channel of one record."""
    at = 0
    for i, one in enumerate(problem.records):
        for name, noise in one.noise.items():
            if (i, name) == (record, channel):
                return r[at : at + noise.count]
            at += noise.count
    raise KeyError(channel)


def _standing(
    whole: Suspicion, errors: Sequence[SuspectedError], records: Sequence[Logged]
) -> tuple[Standing, ...]:
    """Return the rounded channels that are held to stand still where only some suspected errors are corrected."""
    return tuple(
        Standing(one.record, one.error.channels[0], _lost_by(one, errors, records))
        for one in whole.errors
        if one.may_stand_still and not any(one is each for each in errors)
    )


def _lost_by(one: SuspectedError, errors: Sequence[SuspectedError], records: Sequence[Logged]) -> np.ndarray:
    """Return which samples of its channel (n,) one more error takes from a record."""
    others = tuple(each.error for each in errors if each.record == one.record and each is not one)
    before, after = (
        np.isfinite(corrected(records[one.record], found).record.values[one.error.channels[0]])
        for found in (others, (*others, one.error))
    )
    return before & ~after


@dataclass(frozen=True, kw_only=True, eq=False)
class Explained:
    """Records that are taken to have errors in their data, and what explains them besides.

    Attributes:
        errors: in the data.
        work: what was found in the records without them.
        log_prior: of the errors, and what their corrections stretch.
        lost: samples that are no measurements then, but for those of rounded channels that are frozen.
        standing: rounded channels that are held to stand still.
    """

    errors: tuple[SuspectedError, ...]
    work: Findings
    log_prior: float
    lost: int
    standing: tuple[Standing, ...] = ()

    def log_evidence(self, per_lost: float) -> float:
        """Return the log evidence of the records as they were written; of samples that are lost, each so much. That a
        frozen channel repeats its value is certain; one that stands still has its odds in place of a density.
        """
        standing = sum(one.log_excess(self.work) for one in self.standing)
        return log_evidence(self.work) + self.log_prior + self.lost * per_lost - standing

    @property
    def mean(self) -> float:
        """The mean log density of a sample."""
        return log_evidence(self.work) / max(_samples(self.work), 1)

    def is_behind(self, other: Explained) -> bool:
        """Say whether no more causes, nor better fits, bring it close to another that leaves only noise."""
        if other is self or not is_explained(other.work):
            return False
        fits, per_lost = self.work.search.candidates.values(), min(self.mean, other.mean)
        gain = max(one.optimistic_log_posterior for one in fits) - max(one.log_posterior for one in fits)
        return self.log_evidence(per_lost) + gain < other.log_evidence(per_lost) - settings.DECISIVE_NATS


class Look(Protocol):
    """A search for causes, what begins in mid-trial, forces and drifts, in two parts; it may be interrupted."""

    def begin(self, records: Sequence[Logged]) -> Findings:
        """Return what a first look at records finds."""

    def finish(self, work: Findings) -> None:
        """Find the rest."""


def compared(suspicion: Suspicion, records: Sequence[Logged], look: Look) -> list[tuple[Explained, float]]:
    """Return what errors the data may have, with what explains the records besides and its log evidence.

    The records without what no vehicle does, and without what physics has no chance against, get a first look. If no
    causes explain what is left, within declared tolerances, so do those without more: at once where all errors together
    explain the records in the linear problem; else after a whole search, as something may have begun in mid-trial,
    which looks like a step or a clock. The most probable is finished, then what is not hopelessly behind. While that is
    not clear, records with more errors get the same.

    Args:
        suspicion: what a scan says.
        records: as they are.
        look: searches records.
    """
    whole, least, tried = len(suspicion.errors), suspicion.firm, list[Explained]()
    first = suspicion.first(least)
    try:
        tried.append(_explained(first, suspicion, records, look.begin(without(records, first))))
        is_open = least < whole and not _is_settled(tried[0].work)
        if is_finished := is_open and not explain(suspicion.errors):
            look.finish(tried[0].work)
            is_open = not is_explained(tried[0].work)
        more = [suspicion.first(k + 1) for k in range(least, whole)] if is_open else []
        _race(tried, more, suspicion, records, look, new=[] if is_finished else tried[:])
        for held, errors in pairwise([first, *suspicion.fewer(least)]):
            if is_clear(held, _first(tried).work):
                break
            _race(tried, [errors], suspicion, records, look, new=[])
    except KeyboardInterrupt:  # before anything was found of one of them
        if not tried:
            raise
        tried[-1].work.complete = False
    per_lost = min(one.mean for one in tried)
    return [(one, one.log_evidence(per_lost)) for one in tried]


def _is_settled(work: Findings) -> bool:
    """Say whether a first look leaves nothing to be explained: by causes within declared tolerances, or by one that
    begins in mid-trial, and is far before them.
    """
    if is_found(work.search, work.out_of_catalogue):
        return True
    return is_explained(work) and not work.search.is_poor()


def _race(
    tried: list[Explained],
    more: Sequence[tuple[SuspectedError, ...]],
    whole: Suspicion,
    records: Sequence[Logged],
    look: Look,
    *,
    new: list[Explained],
) -> None:
    """Give further sets of errors a first look, and finish what may be the most probable, also of what is new."""
    for errors in more:
        if _is_complete(tried):
            new.append(_explained(errors, whole, records, look.begin(without(records, errors))))
            tried.append(new[-1])
    while new and _is_complete(tried):
        now = _first(new)
        new.remove(now)
        if not any(now.is_behind(one) for one in tried):
            look.finish(now.work)


def _is_complete(tried: Sequence[Explained]) -> bool:
    """Say whether nothing was interrupted."""
    return all(one.work.complete for one in tried)


def _first(tried: Sequence[Explained]) -> Explained:
    per_lost = min(one.mean for one in tried)
    return max(tried, key=lambda one: one.log_evidence(per_lost))


def _explained(
    errors: tuple[SuspectedError, ...], whole: Suspicion, records: Sequence[Logged], work: Findings
) -> Explained:
    prior = sum(log_prior(one.error, ALIKE) + one.error.log_jacobian * _measured(records[one.record], one.error)
                for one in errors)  # fmt: skip
    measured = sum(int(np.isfinite(logged.record.values[name]).sum()) for logged, one in
                   zip(records, work.problem.records, strict=True) for name in one.noise)  # fmt: skip
    frozen = sum(int(_lost_by(one, errors, records).sum()) for one in errors if one.may_stand_still)
    return Explained(errors=errors, work=work, log_prior=float(prior), lost=measured - frozen - _samples(work),
                     standing=_standing(whole, errors, records))  # fmt: skip


def _measured(logged: Logged, error: DataError) -> int:
    return sum(int(np.isfinite(logged.record.values[name]).sum()) for name in error.channels
               if name in logged.record.values)  # fmt: skip


def log_evidence(work: Findings) -> float:
    """Return the log evidence of records, all explanations together, as a density of what was measured."""
    inside = work.search.beliefs.log_total()
    found = log_sum([inside, *(one.log_posterior for one in work.out_of_catalogue)])
    return found + sum(_fixed(one) for one in work.problem.records)


def _samples(work: Findings) -> int:
    return sum(int(np.isfinite(one.values[name]).sum()) for one in work.problem.records for name in one.noise)


def _fixed(one: Observed) -> float:
    """Return what the noise of a record adds to its log density: −½ log det Σ, what outliers cost, and its prior."""
    found = 0.0
    for name, noise in one.noise.items():
        usual = usual_of(name, one.values[name], one.known)
        out = int(np.isfinite(one.values[name]).sum()) - noise.count
        found += (
            out * (OUTLIER_LOG_DENSITY - np.log(usual.level)) - noise.log_scale + log_prior_of(noise, usual)
        )
    return found
