"""Which errors in the data a diagnosis goes on without: proposed by a scan, and then held against physics.

`suspected` corrects the best suspect of `data_error_scan`, looks again, and so on. Nothing is named for that. Sets of
suspects, from all of them to none, are explanations like others (`compared`): a record without them has a search of
its own, with causes, what begins in mid-trial, forces and drifts. T the corrections, y the record as written:

    log p(y, errors) = log Σ_M p(T y | M) p(M) + Σ log|dT/dy| + Σ log p(error) + log p(noise)

A search that is hopelessly behind ends with its first look. What the linear problem leaves no choice of is corrected
before anything is searched, and the records with it are not searched at all if causes that hold throughout explain what
is left (`is_clear`): what no vehicle does (another sign, unit or reference of one channel, exchanged columns, repeated
values) where physics has no chance with all its parameters free at once; a command, a clock or a latency where a few
causes, throughout or from mid-trial on, are hopelessly behind (`data_error_rivals`). A step in a sensor is always held
against a search of the records with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Protocol

import numpy as np

from subzero.diagnosis.hypothesis.data_error import DataError, corrected
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.data_error_rivals import most_of_physics
from subzero.diagnosis.inference.data_error_scan import (
    FAR_BEHIND,
    OUTLIER_LOG_DENSITY,
    Suspect,
    Yardstick,
    log_prior,
    suspects,
    yardstick_of,
)
from subzero.diagnosis.inference.linear_gaussian import log_sum
from subzero.diagnosis.inference.map_fit import is_poor_fit
from subzero.diagnosis.inference.noise import log_prior_of
from subzero.diagnosis.inference.posing import pose, posed_again, usual_of
from subzero.diagnosis.inference.problem import Observed, Problem
from subzero.diagnosis.inference.repeated_values import is_rounded, repeated_values

if TYPE_CHECKING:
    from subzero.diagnosis.inference.out_of_catalogue import Findings

MOST_ERRORS = 3
"""Of a record, beside values that are repeated."""
LEAST_LEAD, LEAST_SOFT_LEAD = 5.0, 15.0
"""An error is suspected if a record is so much more probable with it, as a logarithm; the second of what is `SOFT`."""
SOFT = ("step", "late_clock", "clock_rate", "latency", "command_sign", "command_swap")
"""Kinds with a number to be fitted, or that change the motion: something that broke in mid-trial may look like them."""
ALIKE_LEAD = 3.0
"""Errors whose leads differ by less are told together."""
CLEAR_LEAD, CLEAR_GENEROUS_LEAD = 15.0, 10.0
"""With a greater lead over physics, in the linear problem, an error needs no search of the record as it is: over
nothing and every cause, and over all causes at once."""
LOUD = 2.5
"""Noise of more usual levels hides a misfit. [-]"""
SIGNATURE_LEAD = 20.0
"""Lead of what is read off a record."""
ALIKE = 10
"""So many errors of a kind share its probability, about."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SuspectedError:
    """An error of a record, its leads, and those that the record cannot tell from it; `left` is the noise of the
    channel that is explained worst without it, in usual levels, with all of physics to help; `over_few` the lead over
    a few causes, throughout or from mid-trial on.
    """

    record: int
    error: DataError
    lead: float
    generous: float
    alike: tuple[DataError, ...] = ()
    left: float = np.inf
    over_few: float = -np.inf


@dataclass(frozen=True, kw_only=True, eq=False)
class Suspicion:
    """What a scan of records says of errors in their data.

    Attributes:
        errors: that are suspected, in the order in which they are to be corrected.
        log_as_is: log evidence in the linear problem, of nothing and every cause, but for repeated values as they are.
    """

    errors: tuple[SuspectedError, ...]
    log_as_is: float = 0.0

    def subset(self, firm: bool = True, soft: int = 0) -> tuple[SuspectedError, ...]:
        """Return what no vehicle does, or none of it, and so many of the others, the first, in their order."""
        counted = [one for one in self.errors if is_soft(one)][:soft]
        return tuple(one for one in self.errors if one in counted or (firm and not is_soft(one)))

    @property
    def soft(self) -> int:
        """How many there are that a vehicle may look like."""
        return sum(map(is_soft, self.errors))

    def fewer(self, errors: Sequence[SuspectedError]) -> list[tuple[SuspectedError, ...]]:
        """Return the sets with less of those that a vehicle may look like, the largest first, and that with none."""
        sets = [self.subset(soft=k) for k in reversed(range(sum(map(is_soft, errors))))]
        return [one for one in dict.fromkeys([*sets, ()]) if one != errors]

    @property
    def clear_soft(self) -> int:
        """How many of those that a vehicle may look like, from the first on, leave physics no chance, and explain."""
        soft = [one for one in self.errors if is_soft(one)]
        clear = next((k for k, one in enumerate(soft) if not leads_clearly(one)), len(soft))
        return clear if explain(self.subset(soft=clear)) else 0

    def log_linear(self, errors: Sequence[SuspectedError]) -> float:
        """Return about the log evidence in the linear problem with some of the errors."""
        return self.log_as_is + sum(one.lead for one in errors)


def suspected(problem: Problem, records: Sequence[Logged]) -> Suspicion:
    """Return what errors the data of some records may have."""
    each = [_of_record(problem, records, i) for i in range(len(records))]
    errors = tuple(one for _, found in each for one in found)
    return Suspicion(errors=errors, log_as_is=sum(one.log_sparse for one, _ in each) if errors else 0.0)


def without(records: Sequence[Logged], found: Sequence[SuspectedError]) -> list[Logged]:
    """Return records without the errors that were found in them."""
    return [
        corrected(logged, tuple(one.error for one in found if one.record == i))
        for i, logged in enumerate(records)
    ]


def _of_record(
    problem: Problem, records: Sequence[Logged], record: int
) -> tuple[Yardstick, list[SuspectedError]]:
    """Return what a record is judged by, without values that it repeats, and the errors that it may have."""
    logged, found = records[record], list[SuspectedError]()
    yardstick = yardstick_of(problem, record, logged)
    repeated = repeated_values(logged, logged.trusted)
    for error in repeated:
        if not is_rounded(error, logged):
            found.append(
                SuspectedError(record=record, error=error, lead=SIGNATURE_LEAD, generous=SIGNATURE_LEAD)
            )
            yardstick = _after(yardstick, error)
    yardstick = replace(yardstick, repeated=tuple(one for one in repeated if is_rounded(one, logged)))
    begun = yardstick
    for _ in range(MOST_ERRORS):
        ranked = suspects(yardstick, logged.trusted)
        if not ranked or not _is_suspected(ranked[0]):
            break
        one, before = _suspected(record, ranked), yardstick
        yardstick = _after(yardstick, one.error)
        found.append(replace(one, left=max(yardstick.as_is.scales.values()),
                             over_few=_over_few(problem, records, before, one)))  # fmt: skip
    return begun, found


def _over_few(problem: Problem, records: Sequence[Logged], before: Yardstick, one: SuspectedError) -> float:
    """Return the lead of an error over a few causes of the record before it is corrected; only where it matters."""
    if not is_soft(one) or one.error.kind == "step" or one.lead < FAR_BEHIND:
        return -np.inf
    each = [before.logged if i == one.record else other for i, other in enumerate(records)]
    over_none = one.lead + before.log_sparse - before.log_none
    return over_none - most_of_physics(posed_again(problem, each), one.record)


def _is_suspected(one: Suspect) -> bool:
    return one.lead > (LEAST_SOFT_LEAD if one.error.kind in SOFT else LEAST_LEAD)


def _suspected(record: int, ranked: Sequence[Suspect]) -> SuspectedError:
    first = ranked[0]
    alike = tuple(one.error for one in ranked[1:] if one.lead > first.lead - ALIKE_LEAD)
    return SuspectedError(
        record=record, error=first.error, lead=first.lead, generous=first.generous, alike=alike
    )


def _after(yardstick: Yardstick, error: DataError) -> Yardstick:
    """Return what a record without an error is judged by; with other commands, it has sensitivities of its own."""
    logged = error.corrected(yardstick.logged)
    again = error.is_of_commands
    changed = yardstick_of(pose([logged]), 0, logged) if again else replace(yardstick, logged=logged)
    return replace(changed, corrected=(*yardstick.corrected, error), repeated=yardstick.repeated)


def explain(errors: Sequence[SuspectedError]) -> bool:
    """Say whether errors are all that the linear problem needs: what broke in mid-trial makes an error of a clock
    likely, too, but that leaves more than noise.
    """
    last = {one.record: one for one in errors}
    return all(one.left < LOUD for one in last.values())


def leads_clearly(one: SuspectedError) -> bool:
    """Say whether an error leaves physics no chance in the linear problem."""
    if is_soft(one):
        return one.over_few > FAR_BEHIND
    return one.lead > CLEAR_LEAD and one.generous > CLEAR_GENEROUS_LEAD


def is_clear(errors: Sequence[SuspectedError], work: Findings) -> bool:
    """Say whether errors need not be held against a search of the records with them: what is left then is explained
    without anything that begins in mid-trial, and without a force.
    """
    outside = max((one.log_posterior for one in work.out_of_catalogue), default=-np.inf)
    explained = work.search.best().log_posterior > outside and is_explained(work)
    return explained and all(map(leads_clearly, errors))


def is_soft(one: SuspectedError) -> bool:
    """Say whether something that a vehicle does may look like an error."""
    return one.error.kind in SOFT


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Explained:
    """Records that are taken to have errors in their data, and what explains them besides.

    Attributes:
        errors: in the data.
        work: what was found in the records without them.
        log_prior: of the errors, and what their corrections stretch.
        lost: samples that are no measurements then.
    """

    errors: tuple[SuspectedError, ...]
    work: Findings
    log_prior: float
    lost: int

    def log_evidence(self, per_lost: float) -> float:
        """Return the log evidence of the records as they were written; of samples that are lost, each so much."""
        return log_evidence(self.work) + self.log_prior + self.lost * per_lost

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

    The records without what no vehicle does, and without what physics has no chance against, get a first look; a whole
    one if neither that nor, in the linear problem, what else is suspected explains them. This gets a first look, too,
    unless it is far behind in the linear problem: by 30 nats of what explains them, by 100 of what does not. The most
    probable is finished, then what is not hopelessly behind. While that is not clear, records with more errors get the
    same.

    Args:
        suspicion: what a scan says.
        records: as they are.
        look: searches records.
    """
    least, tried = suspicion.clear_soft, list[Explained]()
    first = suspicion.subset(soft=least)
    try:
        tried.append(_explained(first, records, look.begin(without(records, first))))
        more = [suspicion.subset(soft=k + 1) for k in range(least, suspicion.soft)]
        is_open = bool(more) and not is_explained(tried[0].work)
        if is_finished := is_open and not explain(suspicion.errors):
            # what begins in mid-trial may explain it, and looks like a step or a clock
            look.finish(tried[0].work)
        behind = settings.DECISIVE_NATS if is_explained(tried[0].work) else FAR_BEHIND
        bar = tried[0].log_evidence(0.0) - behind
        more = [one for one in more if suspicion.log_linear(one) > bar]
        _race(tried, more, records, look, new=[] if is_finished else tried[:])
        for held, fewer in pairwise([first, *suspicion.fewer(first)]):
            if is_clear(held, _first(tried).work):
                break
            _race(tried, [fewer], records, look, new=[])
    except KeyboardInterrupt:  # before anything was found of one of them
        if not tried:
            raise
        tried[-1].work.complete = False
    per_lost = min(one.mean for one in tried)
    return [(one, one.log_evidence(per_lost)) for one in tried]


def _race(
    tried: list[Explained],
    more: Sequence[tuple[SuspectedError, ...]],
    records: Sequence[Logged],
    look: Look,
    *,
    new: list[Explained],
) -> None:
    """Give further sets of errors a first look, and finish what may be the most probable, also of what is new."""
    for errors in more:
        if _is_complete(tried):
            new.append(_explained(errors, records, look.begin(without(records, errors))))
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


def _explained(errors: tuple[SuspectedError, ...], records: Sequence[Logged], work: Findings) -> Explained:
    prior = sum(log_prior(one.error, ALIKE) + one.error.log_jacobian * _measured(records[one.record], one.error)
                for one in errors)  # fmt: skip
    measured = sum(int(np.isfinite(logged.record.values[name]).sum()) for logged, one in
                   zip(records, work.problem.records, strict=True) for name in one.noise)  # fmt: skip
    return Explained(errors=errors, work=work, log_prior=float(prior), lost=measured - _samples(work))


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
