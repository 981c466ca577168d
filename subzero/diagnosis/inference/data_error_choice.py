"""Which data errors a diagnosis corrects: proposed by a scan, then compared with physical explanations.

No error is named only because `data_error_search` suspects it. Sets of suspects, from all of them to none, are
explanations like others (`compared`): a record without them is searched for causes, change points, forces and drifts,
and has an evidence on the same scale (`data_error_evidence`).

A search whose log posterior is HOPELESS_NATS below another ends during or after its screening. Errors on which the
linear problem is decisive are corrected before any search, and the records with them are not searched at all if
causes that hold throughout explain the corrected ones (`excludes_physics`): these are errors that no vehicle can
cause (another sign, unit or reference of one channel, exchanged columns, repeated values), where physics is far less
probable with all its parameters free at once; and errors of a command, a clock or a latency, where a few causes,
throughout or from mid-trial on, are far less probable (`data_error_search`). A step in a sensor is always compared
with a search of the records with it.
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
    """Say whether errors need no comparison with a search of the records with them: the corrected records are
    explained without a change point and without a latent force.
    """
    log_other = max((error.log_posterior for error in work.out_of_catalogue), default=-np.inf)
    explained = work.search.best().log_posterior > log_other and leaves_only_noise(work)
    return explained and all(error.excludes_physics for error in errors)


class DiagnosisSteps(Protocol):
    """A search for causes, change points, forces and drifts, in three parts; it may be interrupted."""

    def start(self, records: Sequence[Logged]) -> Findings:
        """Return how close wide tolerances come to records."""

    def begin(self, work: Findings, is_hopeless: Callable[[], bool]) -> None:
        """Do the first part, the screening; if it is hopeless, stop after explanations that are not in the catalogue,
        as one of them may still explain the records.
        """

    def finish(self, work: Findings) -> None:
        """Do the remaining part."""


def compared(
    suspicion: Suspects, records: Sequence[Logged], look: DiagnosisSteps
) -> list[tuple[Explained, float]]:
    """Return the sets of errors that the data may have, with the explanation of the corrected records and its log
    evidence.

    First, the records are screened without the errors that no vehicle can cause and those that exclude physics. If
    causes within declared tolerances or a change point explain these records, only the set of all errors is compared
    with them, where it explains the records in the linear problem: a fin that jams in the first second does what a
    command with the other sign does, and a lag what a delay does. If not, sets with more errors are compared, one
    after the other: at once where all errors together explain the records; else after a whole search, as a change
    point may look like a step or a clock error. The most probable set is finished, then those that are not hopelessly
    less probable. While the result is ambiguous, records with more errors left in them are treated likewise.

    Where the fit with wide tolerances is poor, screening takes long: if no explanation that is not in the catalogue
    explains the records, those without more errors are screened before it goes on.

    Args:
        suspicion: the suspects of a scan.
        records: as they are.
        look: the search of records.
    """
    comparison = _Comparison(suspicion, records, look)
    tried, numbers = comparison.tried, dict[int, tuple[SuspectedError, ...]]()
    try:
        comparison.with_more()
        comparison.with_fewer()
        numbers = comparison.numbers_again()
    except KeyboardInterrupt:  # before any of them has a result
        if not tried:
            raise
        tried[-1].work.complete = False
    per_lost, least = least_means(tried), min(tried, key=lambda error: len(error.errors))
    return [
        (
            replace(error, errors=numbers.get(id(error), error.errors)),
            error.log_evidence(per_lost) + _excess_of_samples_off_trial(error, least, records, per_lost),
        )
        for error in tried
    ]


def _excess_of_samples_off_trial(
    explanation: Explained, least: Explained, records: Sequence[Logged], per_lost: Mapping[str, float]
) -> float:
    """Return by how much samples that a clock error or a delay puts outside the trial are more probable than an
    average sample of their channel: their density is conditional on all other samples, under the explanation of the
    records with the least errors,

        log p(y outside | y inside) = log p(y) − log p(y inside)

    The ends of a record are not typical: there a motion begins, and noise that wanders has gone farthest.
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
    """Return channel → which samples of the records with the least errors are inside the trial under another set
    (n,).
    """
    found = []
    for i, logged in enumerate(records):
        places, here = places_of(logged, explanation.errors, i), places_of(logged, least.errors, i)
        found.append({name: np.isin(column, places[name]) for name, column in here.items()})
    return found


@dataclass(frozen=True, eq=False)
class _Comparison:
    """A comparison of sets of suspected errors: those that have been screened are in `tried`."""

    suspicion: Suspects
    records: Sequence[Logged]
    look: DiagnosisSteps
    tried: list[Explained] = field(default_factory=list)

    def with_more(self) -> None:
        """Compare the errors that no vehicle can cause, and those that exclude physics, with sets of more errors."""
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
        self._finish_likeliest(new + self._looks(more if len(self.tried) == 1 else []))

    def with_fewer(self) -> None:
        """Compare errors that are not clear with sets in which fewer of them are corrected."""
        least = self.suspicion.definite_count
        for held, errors in pairwise([self.suspicion.first(least), *self.suspicion.fewer(least)]):
            if excludes_physics(held, _first(self.tried).work):
                break
            self._finish_likeliest(self._looks([errors]))

    def numbers_again(self) -> dict[int, tuple[SuspectedError, ...]]:
        """Estimate the numbers of the most probable errors again, given the explanation of the records, and search
        the records again where other numbers explain them better; and without errors that explain nothing by the same
        samples: two sets may differ in which samples they take for outliers. Return the identity of the findings of
        the most probable set → its errors.
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
        """Search the records with some errors of a set left in them, instead of all sets that hold one of them; if
        that is interrupted before it has a result, the sets are unchanged.
        """
        gone, before = {(error.record, error.error.id) for error in needless}, self.tried[:]
        left = tuple(error for error in now.errors if (error.record, error.error.id) not in gone)
        self.tried[:] = [
            error for error in self.tried if not _holds_one(error, gone) and error.errors != left
        ]
        try:
            self._finish_likeliest([self._look_at(left, self.look.start(without(self.records, left)))])
        except KeyboardInterrupt:
            self.tried[:] = self.tried or before
            raise

    def _again(self, old: Explained, errors: tuple[SuspectedError, ...]) -> Explained:
        """Search the records without the errors with their new numbers; return the more probable explanation, and
        drop the other.
        """
        new = self._look_at(errors, self.look.start(without(self.records, errors)))
        self._finish_likeliest([new])
        more, less = (old, new) if self._explains_more(old, new) else (new, old)
        self.tried.remove(less)
        return more

    def _explains_more(self, explanation: Explained, other: Explained) -> bool:
        """Say whether errors with some numbers are more probable than with others, counting the samples that either
        puts outside the trial.
        """
        per_lost = least_means([explanation, other])
        excess = _excess_of_samples_off_trial(explanation, other, self.records, per_lost)
        return explanation.log_evidence(per_lost) + excess > other.log_evidence(per_lost)

    def _looks(self, more: Sequence[tuple[SuspectedError, ...]]) -> list[Explained]:
        """Screen further sets of errors, and return the findings, unless interrupted."""
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
        """Screen records without errors, in a search that was started; where that asks whether it is hopeless, and no
        change point explains them, screen the records without the sets of `before` first. Return the findings.
        """

        def is_hopeless() -> bool:
            if not self.tried and not is_explained(work.search, work.out_of_catalogue):
                self._looks(before)
            return self._is_hopeless(errors, work)

        self.look.begin(work, is_hopeless)
        self.tried.append(self._explained(errors, work))
        return self.tried[-1]

    def _is_hopeless(self, errors: tuple[SuspectedError, ...], work: Findings) -> bool:
        """Say whether records without errors are hopelessly less probable than a set that was tried, even with the
        causes of that set: a cause far from the linearisation point is not found around it.
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

    def _finish_likeliest(self, new: Sequence[Explained]) -> None:
        """Finish the search of those of the new sets that may be the most probable one."""
        waiting = [error for error in new if not error.work.given_up]
        while waiting and _is_complete(self.tried):
            now = _first(waiting)
            waiting.remove(now)
            if not any(now.is_less_probable(error) for error in self.tried):
                self._fit_like_others(now.work)
                self.look.finish(now.work)

    def _fit_like_others(self, work: Findings) -> None:
        """Fit the explanations of the other sets from their optimum: a fit may end in a local minimum, and a poor
        local minimum is no evidence of an error.
        """
        for error in self.tried:
            if error.work is not work and error.work.problem.entries is work.problem.entries:
                work.search.fit_like(error.work.search.best())

    def _explained(self, errors: tuple[SuspectedError, ...], work: Findings) -> Explained:
        """Return a set of errors with the findings in the records without them."""
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
        """Return how many samples of each channel are no measurements once errors are corrected: the number may be
        negative where channels are exchanged.
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
    """Say whether the screening explains the records: by causes within declared tolerances, or by one with a change
    point that is far more probable than they are.
    """
    if is_explained(work.search, work.out_of_catalogue):
        return True
    return leaves_only_noise(work) and not work.search.is_poor()


def _holds_one(explanation: Explained, errors: Container[tuple[int, str]]) -> bool:
    """Say whether a set holds one of some errors (record, id)."""
    return any((each.record, each.error.id) in errors for each in explanation.errors)


def _is_complete(tried: Sequence[Explained]) -> bool:
    """Say whether no search was interrupted."""
    return all(error.work.complete for error in tried)


def _first(tried: Sequence[Explained]) -> Explained:
    per_lost = least_means(tried)
    return max(tried, key=lambda error: error.log_evidence(per_lost))
