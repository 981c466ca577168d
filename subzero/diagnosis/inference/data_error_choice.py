"""Which errors in the data a diagnosis goes on without: proposed by a scan, and then held against physics.

Nothing is named because `data_error_search` suspects it. Sets of suspects, from all of them to none, are explanations
like others (`compared`): a record without them has a search of its own, with causes, what begins in mid-trial, forces
and drifts. T the corrections, y the record as written:

    log p(y, errors) = log Σ_M p(T y | M) p(M) + Σ log|dT/dy| + Σ log p(error) + log p(noise)

A sample that is lost counts as any other of its channel. But where a rounded channel may be frozen or stand still, what
it repeats is certain in the one case, and in the other an interval each, no density (`repeated_values`).

A search that is hopelessly behind ends within its first look, or with it. What the linear problem leaves no choice of
is corrected before anything is searched, and the records with it are not searched at all if causes that hold throughout
explain what is left (`is_clear`): what no vehicle does (another sign, unit or reference of one channel, exchanged
columns, repeated values) where physics has no chance with all its parameters free at once; a command, a clock or a
latency where a few causes, throughout or from mid-trial on, are hopelessly behind (`data_error_search`). A step in a
sensor is always held against a search of the records with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
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
from subzero.diagnosis.inference.model_fits import log_density_of_noise, log_evidence_of
from subzero.diagnosis.inference.out_of_catalogue import Findings, is_explained, linear_of_first
from subzero.diagnosis.inference.posing import sensor_of
from subzero.diagnosis.inference.problem import Observed, Problem
from subzero.diagnosis.inference.repeated_values import log_odds_of_frozen, steps_of

SHIFTS = ("late_clock", "clock_rate", "latency")
"""Kinds that put samples outside the trial."""
ALIKE = 10
"""So many errors of a kind share its probability, about."""


def is_clear(errors: Sequence[SuspectedError], work: Findings) -> bool:
    """Say whether errors need not be held against a search of the records with them: what is left then is explained
    without anything that begins in mid-trial, and without a force.
    """
    outside = max((one.log_posterior for one in work.out_of_catalogue), default=-np.inf)
    explained = work.search.best().log_posterior > outside and leaves_only_noise(work)
    return explained and all(one.is_clear for one in errors)


def may_be_named(errors: Sequence[SuspectedError], work: Findings) -> bool:
    """Say whether errors may be the verdict: those that something else may look like only if they explain all."""
    return leaves_only_noise(work) or not any(is_soft(one) for one in errors)


def leaves_only_noise(work: Findings) -> bool:
    """Say whether one explanation leaves nothing but the noise of usual sensors."""
    return _is_quiet(work) and (
        not is_poor_fit(work.search.best().fit) or any(one.point for one in work.out_of_catalogue)
    )


def _is_quiet(work: Findings) -> bool:
    """Say whether the most probable explanation leaves no channel more than the noise of a usual sensor: the noise that
    was estimated behind wide tolerances may be that of a misfit, which something explains by now.
    """
    problem, r = _best_residual(work)
    for i, one in enumerate(problem.records):
        for name, noise in one.noise.items():
            left = min(float(np.sqrt(np.mean(_own(problem, r, i, name) ** 2))), 1.0)
            level = sensor_of(one, name).level
            most = LOUD * float(np.hypot(level, noise.resolution / np.sqrt(12.0)))
            if noise.sd * left >= most:
                return False
    return True


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
        noise, usual = one.noise[self.channel], sensor_of(one, self.channel)
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
        lost: channel → samples that are no measurements then, but for those of rounded channels that are frozen.
        standing: rounded channels that are held to stand still.
    """

    errors: tuple[SuspectedError, ...]
    work: Findings
    log_prior: float
    lost: Mapping[str, int]
    standing: tuple[Standing, ...] = ()

    def log_evidence(self, per_lost: Mapping[str, float]) -> float:
        """Return the log evidence of the records as they were written; of samples that are lost, each so much as its
        channel is given. That a frozen channel repeats its value is certain; one that stands still has its odds in
        place of a density.
        """
        standing = sum(one.log_excess(self.work) for one in self.standing)
        lost = sum(count * per_lost.get(name, 0.0) for name, count in self.lost.items())
        return log_evidence(self.work) + self.log_prior + lost - standing

    @cached_property
    def means(self) -> dict[str, float]:
        """Channel → the mean log density of a sample: units differ, and so do densities in them."""
        problem, r = _best_residual(self.work)
        samples = _samples(self.work)
        total = dict.fromkeys(samples, 0.0)
        for i, one in enumerate(problem.records):
            for name in one.noise:
                square = float(np.sum(_own(problem, r, i, name) ** 2))
                total[name] += _fixed(one, name) - 0.5 * square
        return {name: total[name] / count for name, count in samples.items() if count}

    def is_behind(self, other: Explained) -> bool:
        """Say whether no more causes, nor better fits, bring it close to another that leaves only noise."""
        if other is self or not leaves_only_noise(other.work):
            return False
        per_lost, behind = _least_means([self, other]), settings.DECISIVE_NATS
        return self.log_evidence(per_lost) + self._to_be_gained() < other.log_evidence(per_lost) - behind

    def _to_be_gained(self) -> float:
        """Return what better fits promise; while only the wide one was made, what any may promise."""
        if not self.work.search.screen.log_posterior:
            return settings.MAX_PREDICTED_GAIN_NATS
        fits = self.work.search.candidates.values()
        return max(one.optimistic_log_posterior for one in fits) - max(one.log_posterior for one in fits)


def _least_means(several: Sequence[Explained]) -> dict[str, float]:
    """Return channel → the least of the mean log densities of a sample."""
    means = [one.means for one in several]
    return {name: min(one[name] for one in means if name in one) for name in set().union(*means)}


class Look(Protocol):
    """A search for causes, what begins in mid-trial, forces and drifts, in three parts; it may be interrupted."""

    def start(self, records: Sequence[Logged]) -> Findings:
        """Return how close wide tolerances come to records."""

    def begin(self, work: Findings, is_hopeless: Callable[[], bool]) -> None:
        """Have a first look; if it is hopeless, no farther than outside, as what is there may explain records, too."""

    def finish(self, work: Findings) -> None:
        """Find the rest."""


def compared(suspicion: Suspicion, records: Sequence[Logged], look: Look) -> list[tuple[Explained, float]]:
    """Return what errors the data may have, with what explains the records besides and its log evidence.

    The records without what no vehicle does, and without what physics has no chance against, get a first look. If that
    explains what is left, by causes within declared tolerances or by what begins in mid-trial, only all errors together
    are held against it, where they explain the records in the linear problem: a fin that jams in the first second does
    what a command with the other sign does, and a lag what a delay does. If not, so are those without more, one after
    the other: at once where all errors together explain the records; else after a whole search, as something may have
    begun in mid-trial, which looks like a step or a clock. The most probable is finished, then what is not hopelessly
    behind. While that is not clear, records with more errors get the same.

    Where even wide tolerances do not come close, a first look takes long: if nothing outside explains the records,
    those without more errors have theirs before it goes on.

    Args:
        suspicion: what a scan says.
        records: as they are.
        look: searches records.
    """
    comparison = _Comparison(suspicion, records, look)
    tried = comparison.tried
    try:
        comparison.with_more()
        comparison.with_fewer()
    except KeyboardInterrupt:  # before anything was found of one of them
        if not tried:
            raise
        tried[-1].work.complete = False
    per_lost, least = _least_means(tried), min(tried, key=lambda one: len(one.errors))
    return [
        (one, one.log_evidence(per_lost) + _of_samples_outside(one, least, records, per_lost))
        for one in tried
    ]


def _of_samples_outside(
    one: Explained, least: Explained, records: Sequence[Logged], per_lost: Mapping[str, float]
) -> float:
    """Return by how much samples that a clock or a delay puts outside the trial are more probable than those of their
    channel on average: they have their density given all others, beside the explanation of the records with the least
    errors,

        log p(y outside | y inside) = log p(y) − log p(y inside)

    The ends of a record are like no others: something begins there, and noise that wanders is at its farthest.
    """
    kept, seen = _inside(one, least, records), least.work.problem.records
    gone = [{name: ~some[name] & np.isfinite(record.values[name]) for name in record.noise}
            for some, record in zip(kept, seen, strict=True)]  # fmt: skip
    if not any(lost.any() for each in gone for lost in each.values()):
        return 0.0
    every = [{name: np.ones(some.size, dtype=bool) for name, some in each.items()} for each in kept]
    linear, D = linear_of_first(least.work.search, least.work.out_of_catalogue)
    log_all, log_inside = (
        log_evidence_of(least.work.search.problem, linear, D, some) for some in (every, kept)
    )
    found = float(log_all - log_inside)
    for each, record in zip(gone, seen, strict=True):
        for name, lost in each.items():
            found += np.count_nonzero(lost & ~record.noise[name].used) * _log_outlier(record, name)
            found -= np.count_nonzero(lost) * per_lost.get(name, 0.0)
    return found


def _inside(one: Explained, least: Explained, records: Sequence[Logged]) -> list[dict[str, np.ndarray]]:
    """Return channel → which samples of the records with the least errors are inside the trial with others (n,)."""
    found = []
    for i, logged in enumerate(records):
        places, here = _places(logged, one.errors, i), _places(logged, least.errors, i)
        found.append({name: np.isin(column, places[name]) for name, column in here.items()})
    return found


def _places(logged: Logged, errors: Sequence[SuspectedError], record: int) -> dict[str, np.ndarray]:
    """Return channel → which of the samples that were written stands where when clocks are put right (n,); -1 where
    none does.
    """
    count = np.arange(logged.record.time.size, dtype=float)
    written = replace(logged.record, values=dict.fromkeys(logged.record.values, count))
    shifts = tuple(one.error for one in errors if one.record == record and one.error.kind in SHIFTS)
    shown = corrected(replace(logged, record=written), shifts).record.values
    return {name: np.where(np.isfinite(column), column, -1.0) for name, column in shown.items()}


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Sets of suspected errors, held against one another: those whose first look was taken are in `tried`."""

    suspicion: Suspicion
    records: Sequence[Logged]
    look: Look
    tried: list[Explained] = field(default_factory=list)

    def with_more(self) -> None:
        """Hold what no vehicle does, and what physics has no chance against, against records with more errors."""
        least, errors = self.suspicion.firm, self.suspicion.errors
        first, more = (
            self.suspicion.first(least),
            [self.suspicion.first(k + 1) for k in range(least, len(errors))],
        )
        work = self.look.start(without(self.records, first))
        now = self._look_at(first, work, more if work.search.is_far and explain(errors) else [])
        new = self.tried[:]
        if not more or _is_settled(now.work):
            self.tried[:], new = [now], [now]
            more = more[-1:] if explain(errors) else []
        elif not explain(errors):
            self.look.finish(now.work)
            new, more = [], [] if leaves_only_noise(now.work) else more
        self._race(new + self._looks(more if len(self.tried) == 1 else []))

    def with_fewer(self) -> None:
        """Hold errors that are not clear against records with fewer of them corrected."""
        least = self.suspicion.firm
        for held, errors in pairwise([self.suspicion.first(least), *self.suspicion.fewer(least)]):
            if is_clear(held, _first(self.tried).work):
                break
            self._race(self._looks([errors]))

    def _looks(self, more: Sequence[tuple[SuspectedError, ...]]) -> list[Explained]:
        """Give further sets of errors a first look, and return what is found, unless interrupted."""
        return [
            self._look_at(errors, self.look.start(without(self.records, errors)))
            for errors in more
            if _is_complete(self.tried)
        ]

    def _look_at(
        self,
        errors: tuple[SuspectedError, ...],
        work: Findings,
        before: Sequence[tuple[SuspectedError, ...]] = (),
    ) -> Explained:
        """Have a first look at records without errors, that was started; where that is asked whether it is hopeless,
        and nothing that begins in mid-trial explains them, look at those without others before. Return what is found.
        """

        def is_hopeless() -> bool:
            if not self.tried and not is_explained(work.search, work.out_of_catalogue):
                self._looks(before)
            return self._is_hopeless(errors, work)

        self.look.begin(work, is_hopeless)
        self.tried.append(self._explained(errors, work))
        return self.tried[-1]

    def _is_hopeless(self, errors: tuple[SuspectedError, ...], work: Findings) -> bool:
        """Say whether records without errors are hopelessly behind something that was tried, even with the causes of
        that: what is far from a run is not found around it.
        """
        better = [one for one in self.tried if self._explained(errors, work).is_behind(one)]
        for one in better:
            if one.work.problem.entries is not work.problem.entries:
                return False
            work.search.fit_like(one.work.search.best())
        now = self._explained(errors, work)
        return any(now.is_behind(one) for one in better)

    def _race(self, new: Sequence[Explained]) -> None:
        """Finish what may be the most probable, of what is new among what was tried."""
        waiting = [one for one in new if not one.work.given_up]
        while waiting and _is_complete(self.tried):
            now = _first(waiting)
            waiting.remove(now)
            if not any(now.is_behind(one) for one in self.tried):
                self._fit_like_others(now.work)
                self.look.finish(now.work)

    def _fit_like_others(self, work: Findings) -> None:
        """Fit what explains the records without other errors from where it does: a fit may end in a local minimum, and
        what it lacks there is no evidence of an error.
        """
        for one in self.tried:
            if one.work is not work and one.work.problem.entries is work.problem.entries:
                work.search.fit_like(one.work.search.best())

    def _explained(self, errors: tuple[SuspectedError, ...], work: Findings) -> Explained:
        """Return records that are taken to have errors, with what was found in the records without them."""
        prior = sum(log_prior(one.error, ALIKE)
                    + one.error.log_jacobian * _measured(self.records[one.record], one.error)
                    for one in errors)  # fmt: skip
        return Explained(errors=errors, work=work, log_prior=float(prior), lost=self._lost(errors, work),
                         standing=_standing(self.suspicion, errors, self.records))  # fmt: skip

    def _lost(self, errors: Sequence[SuspectedError], work: Findings) -> Counter[str]:
        """Return how many samples of each channel are no measurements without errors: more than 0 or fewer, where
        channels are exchanged.
        """
        lost = Counter[str]()
        for logged, seen in zip(self.records, work.problem.records, strict=True):
            lost.update({name: int(np.isfinite(logged.record.values[name]).sum()) for name in seen.noise})
        lost.subtract(_samples(work))
        for one in errors:
            if one.may_stand_still:
                lost[one.error.channels[0]] -= int(_lost_by(one, errors, self.records).sum())
        return lost


def _is_settled(work: Findings) -> bool:
    """Say whether a first look leaves nothing to be explained: by causes within declared tolerances, or by one that
    begins in mid-trial, and is far before them.
    """
    if is_explained(work.search, work.out_of_catalogue):
        return True
    return leaves_only_noise(work) and not work.search.is_poor()


def _is_complete(tried: Sequence[Explained]) -> bool:
    """Say whether nothing was interrupted."""
    return all(one.work.complete for one in tried)


def _first(tried: Sequence[Explained]) -> Explained:
    per_lost = _least_means(tried)
    return max(tried, key=lambda one: one.log_evidence(per_lost))


def _measured(logged: Logged, error: DataError) -> int:
    return sum(int(np.isfinite(logged.record.values[name]).sum()) for name in error.channels
               if name in logged.record.values)  # fmt: skip


def log_evidence(work: Findings) -> float:
    """Return the log evidence of records, all explanations together, as a density of what was measured."""
    inside = work.search.beliefs.log_total()
    found = log_sum([inside, *(one.log_posterior for one in work.out_of_catalogue)])
    return found + sum(_fixed(one, name) for one in work.problem.records for name in one.noise)


def _samples(work: Findings) -> Counter[str]:
    """Return how many samples of each channel were measured."""
    samples = Counter[str]()
    for one in work.problem.records:
        samples.update({name: int(np.isfinite(one.values[name]).sum()) for name in one.noise})
    return samples


def _fixed(one: Observed, name: str) -> float:
    """Return what the noise of a channel adds to its log density: −½ log det Σ, what outliers cost, and its prior."""
    out = int(np.isfinite(one.values[name]).sum()) - one.noise[name].count
    return out * _log_outlier(one, name) + log_density_of_noise(one, name)


def _log_outlier(one: Observed, name: str) -> float:
    """Return the log density of an outlier of a channel."""
    return float(OUTLIER_LOG_DENSITY - np.log(sensor_of(one, name).level))
