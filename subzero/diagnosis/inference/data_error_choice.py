"""Which errors in the data a diagnosis goes on without: proposed by a scan, and then held against physics.

Nothing is named because `data_error_search` suspects it. Sets of suspects, from all of them to none, are explanations
like others (`compared`): a record without them has a search of its own, with causes, what begins in mid-trial, forces
and drifts, and an evidence on their scale (`data_error_evidence`).

A search that is hopelessly behind ends within its first look, or with it. What the linear problem leaves no choice of
is corrected before anything is searched, and the records with it are not searched at all if causes that hold throughout
explain what is left (`excludes_physics`): what no vehicle does (another sign, unit or reference of one channel,
exchanged columns, repeated values) where physics has no chance with all its parameters free at once; a command, a
clock or a latency where a few causes, throughout or from mid-trial on, are hopelessly behind (`data_error_search`). A
step in a sensor is always held against a search of the records with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Protocol

import numpy as np

from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.data_error_evidence import (
    ALIKE,
    Explained,
    least_means,
    leaves_only_noise,
    log_outlier,
    lost_by,
    measured_by,
    numbers_again,
    places_of,
    samples_of,
    still_channels_of,
    without,
)
from subzero.diagnosis.inference.data_error_scan import log_prior
from subzero.diagnosis.inference.data_error_search import (
    SuspectedError,
    Suspects,
    explain,
)
from subzero.diagnosis.inference.model_fits import log_evidence_of
from subzero.diagnosis.inference.out_of_catalogue import Findings, is_explained, linear_of_first


def excludes_physics(errors: Sequence[SuspectedError], work: Findings) -> bool:
    """Say whether errors need not be held against a search of the records with them: what is left then is explained
    without anything that begins in mid-trial, and without a force.
    """
    outside = max((error.log_posterior for error in work.out_of_catalogue), default=-np.inf)
    explained = work.search.best().log_posterior > outside and leaves_only_noise(work)
    return explained and all(error.excludes_physics for error in errors)


class DiagnosisSteps(Protocol):
    """A search for causes, what begins in mid-trial, forces and drifts, in three parts; it may be interrupted."""

    def start(self, records: Sequence[Logged]) -> Findings:
        """Return how close wide tolerances come to records."""

    def begin(self, work: Findings, is_hopeless: Callable[[], bool]) -> None:
        """Have a first look; if it is hopeless, no farther than outside, as what is there may explain records, too."""

    def finish(self, work: Findings) -> None:
        """Find the rest."""


def compared(
    suspicion: Suspects, records: Sequence[Logged], look: DiagnosisSteps
) -> list[tuple[Explained, float]]:
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
    tried, numbers = comparison.tried, dict[int, tuple[SuspectedError, ...]]()
    try:
        comparison.with_more()
        comparison.with_fewer()
        numbers = comparison.numbers_again()
    except KeyboardInterrupt:  # before anything was found of one of them
        if not tried:
            raise
        tried[-1].work.complete = False
    per_lost, least = least_means(tried), min(tried, key=lambda error: len(error.errors))
    return [
        (
            replace(error, errors=numbers.get(id(error), error.errors)),
            error.log_evidence(per_lost) + _of_samples_outside(error, least, records, per_lost),
        )
        for error in tried
    ]


def _of_samples_outside(
    explanation: Explained, least: Explained, records: Sequence[Logged], per_lost: Mapping[str, float]
) -> float:
    """Return by how much samples that a clock or a delay puts outside the trial are more probable than those of their
    channel on average: they have their density given all others, beside the explanation of the records with the least
    errors,

        log p(y outside | y inside) = log p(y) − log p(y inside)

    The ends of a record are like no others: something begins there, and noise that wanders is at its farthest.
    """
    kept, seen = _inside(explanation, least, records), least.work.problem.records
    gone = [
        {name: ~some[name] & np.isfinite(record.values[name]) for name in record.noise}
        for some, record in zip(kept, seen, strict=True)
    ]
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
            found += np.count_nonzero(lost & ~record.noise[name].used) * log_outlier(record, name)
            found -= np.count_nonzero(lost) * per_lost.get(name, 0.0)
    return found


def _inside(
    explanation: Explained, least: Explained, records: Sequence[Logged]
) -> list[dict[str, np.ndarray]]:
    """Return channel → which samples of the records with the least errors are inside the trial with others (n,)."""
    found = []
    for i, logged in enumerate(records):
        places, here = places_of(logged, explanation.errors, i), places_of(logged, least.errors, i)
        found.append({name: np.isin(column, places[name]) for name, column in here.items()})
    return found


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Sets of suspected errors, held against one another: those whose first look was taken are in `tried`."""

    suspicion: Suspects
    records: Sequence[Logged]
    look: DiagnosisSteps
    tried: list[Explained] = field(default_factory=list)

    def with_more(self) -> None:
        """Hold what no vehicle does, and what physics has no chance against, against records with more errors."""
        least, errors = self.suspicion.definite_count, self.suspicion.errors
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
        least = self.suspicion.definite_count
        for held, errors in pairwise([self.suspicion.first(least), *self.suspicion.fewer(least)]):
            if excludes_physics(held, _first(self.tried).work):
                break
            self._race(self._looks([errors]))

    def numbers_again(self) -> dict[int, tuple[SuspectedError, ...]]:
        """Find the numbers of the most probable errors anew beside what explains the records, which are searched again
        where others explain them better; and without errors that explain nothing by the same samples: two sets may
        differ in what they hold to be an outlier. Return the identity of what is the most probable → its errors.
        """
        while _is_complete(self.tried) and not (now := _first(self.tried)).work.given_up:
            found = numbers_again(now, self.records)
            if not found.needless:
                break
            self._without(found.needless, now)
        else:
            return {}
        if found.gain > settings.CLOSE_NATS:
            now = self._again(now, found.errors)
            found = numbers_again(now, self.records)
        return {id(now): found.errors} if found.may_be_told else {}

    def _without(self, needless: Sequence[SuspectedError], now: Explained) -> None:
        """Search the records with some errors of a set left in them, in the place of all sets that hold one of them; if
        that is interrupted before anything is found, what there was stays.
        """
        gone, before = {(error.record, error.error.id) for error in needless}, self.tried[:]
        left = tuple(error for error in now.errors if (error.record, error.error.id) not in gone)
        self.tried[:] = [
            error for error in self.tried if not _holds_one(error, gone) and error.errors != left
        ]
        try:
            self._race([self._look_at(left, self.look.start(without(self.records, left)))])
        except KeyboardInterrupt:
            self.tried[:] = self.tried or before
            raise

    def _again(self, old: Explained, errors: tuple[SuspectedError, ...]) -> Explained:
        """Search the records without errors that have other numbers; return what explains more, and drop the other."""
        new = self._look_at(errors, self.look.start(without(self.records, errors)))
        self._race([new])
        more, less = (old, new) if self._explains_more(old, new) else (new, old)
        self.tried.remove(less)
        return more

    def _explains_more(self, explanation: Explained, other: Explained) -> bool:
        """Say whether errors with some numbers are more probable than with others, with what those put outside."""
        per_lost = least_means([explanation, other])
        outside = _of_samples_outside(explanation, other, self.records, per_lost)
        return explanation.log_evidence(per_lost) + outside > other.log_evidence(per_lost)

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
        better = [
            suspect for suspect in self.tried if self._explained(errors, work).is_less_probable(suspect)
        ]
        for error in better:
            if error.work.problem.entries is not work.problem.entries:
                return False
            work.search.fit_like(error.work.search.best())
        now = self._explained(errors, work)
        return any(now.is_less_probable(suspect) for suspect in better)

    def _race(self, new: Sequence[Explained]) -> None:
        """Finish what may be the most probable, of what is new among what was tried."""
        waiting = [error for error in new if not error.work.given_up]
        while waiting and _is_complete(self.tried):
            now = _first(waiting)
            waiting.remove(now)
            if not any(now.is_less_probable(error) for error in self.tried):
                self._fit_like_others(now.work)
                self.look.finish(now.work)

    def _fit_like_others(self, work: Findings) -> None:
        """Fit what explains the records without other errors from where it does: a fit may end in a local minimum, and
        what it lacks there is no evidence of an error.
        """
        for error in self.tried:
            if error.work is not work and error.work.problem.entries is work.problem.entries:
                work.search.fit_like(error.work.search.best())

    def _explained(self, errors: tuple[SuspectedError, ...], work: Findings) -> Explained:
        """Return records that are taken to have errors, with what was found in the records without them."""
        prior = sum(
            log_prior(error.error, ALIKE)
            + error.error.log_jacobian * measured_by(self.records[error.record], error.error)
            for error in errors
        )
        return Explained(
            errors=errors,
            work=work,
            log_prior=float(prior),
            lost=self._lost(errors, work),
            standing=still_channels_of(self.suspicion, errors, self.records),
        )

    def _lost(self, errors: Sequence[SuspectedError], work: Findings) -> Counter[str]:
        """Return how many samples of each channel are no measurements without errors: more than 0 or fewer, where
        channels are exchanged.
        """
        lost = Counter[str]()
        for logged, seen in zip(self.records, work.problem.records, strict=True):
            lost.update({name: int(np.isfinite(logged.record.values[name]).sum()) for name in seen.noise})
        lost.subtract(samples_of(work))
        for error in errors:
            if error.may_stand_still:
                lost[error.error.channels[0]] -= int(lost_by(error, errors, self.records).sum())
        return lost


def _is_settled(work: Findings) -> bool:
    """Say whether a first look leaves nothing to be explained: by causes within declared tolerances, or by one that
    begins in mid-trial, and is far before them.
    """
    if is_explained(work.search, work.out_of_catalogue):
        return True
    return leaves_only_noise(work) and not work.search.is_poor()


def _holds_one(explanation: Explained, errors: Container[tuple[int, str]]) -> bool:
    """Say whether a set holds one of some errors (record, id)."""
    return any((each.record, each.error.id) in errors for each in explanation.errors)


def _is_complete(tried: Sequence[Explained]) -> bool:
    """Say whether nothing was interrupted."""
    return all(error.work.complete for error in tried)


def _first(tried: Sequence[Explained]) -> Explained:
    per_lost = least_means(tried)
    return max(tried, key=lambda error: error.log_evidence(per_lost))
