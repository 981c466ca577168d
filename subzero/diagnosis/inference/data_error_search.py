"""Which errors in the data are suspected: a stepwise search forward and back, in the linear problem, before any fit.

Forward: the best suspect of `data_error_scan` is corrected, and the scan is repeated on the corrected record, until
it finds none. Back: each error is scored again at its place, with all others corrected, and its numbers are estimated
again; errors that are not needed any more are dropped, the weakest first. So the first of two errors, which may have
looked like something else while the second was there, is scored as the second is: by its own gain. A clock that is
late by less than an error is a cause, but not a linear one: where both explain more, errors are scored with it
included.

How close physics comes to a record without them is also computed before any search (`sparse_explanation`): an error
of the data that is far more probable than that needs no search of the record as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.data_error import DataError
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.data_error_saturated_model import LOUD, SaturatedModel, saturated_model_of
from subzero.diagnosis.inference.data_error_scan import (
    FAR_BEHIND,
    Suspect,
    clock_below_least,
    judged_again,
    judged_as_it_is,
    likeliest,
    may_stand_still,
    suspects,
)
from subzero.diagnosis.inference.map_fit import bounds
from subzero.diagnosis.inference.posing import posed_again
from subzero.diagnosis.inference.problem import Problem
from subzero.diagnosis.inference.repeated_values import may_be_measured, repeated_values, steps_off_grid
from subzero.diagnosis.inference.sparse_explanation import most_of_one_cause, most_of_physics

MOST_ERRORS = 3
"""Most errors of a record, not counting repeated values."""
LEAST_LEAD, LEAST_SOFT_LEAD = 5.0, 15.0
"""Least log posterior odds of a suspected error; the second is for kinds in `SOFT`."""
SOFT = ("step", "late_clock", "clock_rate", "latency", "command_sign", "command_swap")
"""Kinds with a number to be fitted, or that change the motion: a fault in mid-trial may look like them."""
ALIKE_LEAD = 3.0
"""Errors whose leads differ by less are reported together."""
CLEAR_LEAD, CLEAR_GENEROUS_LEAD = 150.0, 40.0
"""With a greater lead over physics, in the linear problem, an error needs no search of the record as it is: over no
cause and single causes, and over all causes at once. The linear problem may err by tens of nats: where much more drag
of the cable turned a dive by a degree the other way, a heading of the other sign had leads of 51 and 35, and its
search ended 5.6 nats below that of the record as it is.
"""
LEAST_SHARE = 0.5
"""An error that physics can mimic needs no such search, either, if physics explains no more than the remaining share
of its gain: the linear problem has missed a third of the evidence of a current of 0.3 m/s.
"""
SIGNATURE_LEAD = 200.0
"""Lead of an error that is read off a record: it is clear."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SuspectedError:
    """An error of a record, its leads with all others corrected, and the errors that the record cannot distinguish
    from it; `left` is the noise of the channel that is explained worst without all of them, in usual levels, under
    the saturated model; `excludes_physics` says that physics is far less probable in the linear problem;
    `may_stand_still` that a channel that seems to be frozen is rounded; `is_read_off` that it is read off the
    record's values.
    """

    record: int
    error: DataError
    lead: float
    generous: float
    alike: tuple[DataError, ...] = ()
    left: float = np.inf
    excludes_physics: bool = False
    may_stand_still: bool = False
    is_read_off: bool = False


def mimicked_by_physics(error: SuspectedError) -> bool:
    """Say whether physics can mimic an error: not one that is read off the values."""
    return error.error.kind in SOFT and not error.is_read_off


def explain(errors: Sequence[SuspectedError]) -> bool:
    """Say whether errors explain the records in the linear problem: a fault in mid-trial makes an error of a clock
    likely, too, but that leaves more than noise.
    """
    return all(error.left < LOUD for error in errors)


@dataclass(frozen=True, kw_only=True, eq=False)
class Suspects:
    """Suspected errors in the data of records.

    Attributes:
        errors: that are suspected, in the order in which they are to be corrected.
    """

    errors: tuple[SuspectedError, ...]

    def first(self, count: int) -> tuple[SuspectedError, ...]:
        """Return `count` of them, in their order: the clear ones are chosen first, then those that no vehicle can
        cause, the best first.
        """
        ranked = sorted(
            self.errors,
            key=lambda error: (not error.excludes_physics, mimicked_by_physics(error), -error.lead),
        )
        return tuple(error for error in self.errors if any(error is each for each in ranked[:count]))

    @property
    def definite_count(self) -> int:
        """Number of errors that exclude physics, or that no vehicle can cause."""
        return sum(error.excludes_physics or not mimicked_by_physics(error) for error in self.errors)

    def fewer(self, count: int) -> list[tuple[SuspectedError, ...]]:
        """Return the sets with fewer than `count` of them: those that are not clear are taken away one after the
        other, down to none.
        """
        clear = sum(error.excludes_physics for error in self.errors)
        return [*(self.first(k) for k in reversed(range(max(clear, 1), count))), ()] if count else []


def suspected(problem: Problem, records: Sequence[Logged]) -> Suspects:
    """Return the errors that the data of some records may have."""
    each = [_of_record(problem, records, i) for i in range(len(records))]
    return Suspects(errors=tuple(error for found in each for error in found))


Physics = Callable[[Problem, int], float]
"""Log odds of a physical explanation against no cause in one of the records of a problem. [nat]"""


class _Judged(NamedTuple):
    """An error with its leads, and the errors that the record cannot distinguish from it."""

    suspect: Suspect
    alike: tuple[DataError, ...]


def _of_record(problem: Problem, records: Sequence[Logged], record: int) -> list[SuspectedError]:
    """Return the errors that a record may have."""
    logged = records[record]
    repeated = repeated_values(logged, logged.trusted)
    unclear = tuple(error for error in repeated if may_be_measured(error, logged))
    started = replace(saturated_model_of(problem, record, logged), repeated=unclear)
    read_off = [error for error in repeated if not may_be_measured(error, logged)]
    jumps = steps_off_grid(logged, logged.trusted)
    read_off += [likeliest(started, started.by_whole_steps(jump)) for jump in jumps]
    started, found = _with_clock_error(
        started, read_off, _forward(started, read_off, logged.trusted), logged.trusted
    )
    found = _by_clock_of_others(started, read_off, found, logged.trusted)
    found = _closer(problem, record, started, read_off, _back(started, read_off, found))
    made = [*(_Judged(Suspect(error, SIGNATURE_LEAD, SIGNATURE_LEAD), ()) for error in read_off), *found]
    against = _Against(
        problem=problem,
        records=records,
        record=record,
        started=started,
        read_off=len(read_off),
        errors=tuple(error.suspect.error for error in made),
    )
    if against.few_causes_explain_more():
        made = [error for error in made if not any(error.suspect.error is soft for soft in against.soft)]
        against = replace(against, errors=tuple(error.suspect.error for error in made), kept={})
    left, clear = against.left if found else 0.0, _clear(against, [error.suspect for error in made])
    return [
        SuspectedError(
            record=record,
            error=error.error,
            lead=error.lead,
            generous=error.generous,
            alike=alike,
            left=left,
            excludes_physics=any(error.error is other for other in clear),
            may_stand_still=may_stand_still(started, error.error),
            is_read_off=i < len(read_off),
        )
        for i, (error, alike) in enumerate(made)
    ]


def _with_clock_error(
    started: SaturatedModel, read_off: Sequence[DataError], found: list[_Judged], trusted: frozenset[str]
) -> tuple[SaturatedModel, list[_Judged]]:
    """Return errors found one after the other, and the saturated model that they are scored in: with a clock that is
    late by less than an error included, where physics can mimic some of them, and that explains more.
    """
    soft = any(error.suspect.error.kind in SOFT for error in found)
    clock = clock_below_least(started.after(read_off)) if soft else None
    if clock is None:
        return started, found
    there = replace(started, clock=(clock.error,))
    others = _forward(there, read_off, trusted)
    explains_more = clock.lead + _total_lead(others) > _total_lead(found)
    return (there, others) if explains_more else (started, found)


def _total_lead(found: Sequence[_Judged]) -> float:
    """Return the log odds of errors against none, each scored with those before it corrected."""
    return sum(error.suspect.lead for error in found)


def _by_clock_of_others(
    started: SaturatedModel, read_off: Sequence[DataError], found: list[_Judged], trusted: frozenset[str]
) -> list[_Judged]:
    """Return errors, or those found with the clock of a channel that also seems to be late, if they are more
    probable: if most channels are uninformative, the one that is early by itself has set the clock of all.
    """
    clocks = [suspect.suspect.error for suspect in found if suspect.suspect.error.kind == "late_clock"]
    later = [suspect.suspect.error.amount for suspect in found if suspect.suspect.error.kind == "latency"]
    tried = [found]
    for error in (replace(clock, amount=clock.amount + more) for clock in clocks for more in later):
        first = _Judged(judged_again(started.after(read_off), error), ())
        tried.append(_forward(started, read_off, trusted, [first]))
    return max(tried, key=_total_lead)


def _forward(
    started: SaturatedModel,
    read_off: Sequence[DataError],
    trusted: frozenset[str],
    first: Sequence[_Judged] = (),
) -> list[_Judged]:
    """Return the most probable errors one after the other, each with those before it corrected."""
    found = [*first]
    for _ in range(MOST_ERRORS - len(found)):
        before = [*read_off, *(error.suspect.error for error in found)]
        ranked = suspects(started.after(before), trusted)
        while ranked and _is_suspected(ranked[0]) and _adds_noise(started, before, ranked[0].error):
            ranked = ranked[1:]
        if not ranked or not _is_suspected(ranked[0]):
            break
        alike = tuple(
            candidate.error for candidate in ranked[1:] if candidate.lead > ranked[0].lead - ALIKE_LEAD
        )
        found.append(_Judged(ranked[0], alike))
    return found


def _adds_noise(started: SaturatedModel, before: Sequence[DataError], error: DataError) -> bool:
    """Say whether the noise of a channel is no longer a usual sensor's once an error is corrected, and is with the
    error left in: where a rounded heading hardly leaves a value, radians explain its steps, and nothing else of it.
    """
    scales, after = started.after(before).as_is.scales, started.after([*before, error]).as_is.scales
    return any(scales.get(name, 0.0) < LOUD <= after.get(name, 0.0) for name in error.channels)


def _back(started: SaturatedModel, read_off: Sequence[DataError], found: list[_Judged]) -> list[_Judged]:
    """Return the errors that are still needed with all others corrected, scored so."""
    last = len(found) - 1  # is scored so already
    while len(found) > 1:
        found = [error if i == last else _again(started, read_off, found, i) for i, error in enumerate(found)]
        weakest = min(found, key=lambda error: error.suspect.lead - _least(error.suspect))
        if _is_suspected(weakest.suspect):
            break
        found, last = [error for error in found if error is not weakest], -1
    return found


def _closer(
    problem: Problem,
    record: int,
    started: SaturatedModel,
    read_off: Sequence[DataError],
    found: list[_Judged],
) -> list[_Judged]:
    """Return the errors that are still suspected in the problem linearised around the explanation of the record
    without them: far from the nominal model, a linearisation there errs by as much as a delay does. For errors of
    commands it is simulated anyway.
    """
    errors = [*read_off, *(error.suspect.error for error in found)]
    if not any(error.kind in SOFT for error in errors) or any(error.is_of_commands for error in errors):
        return found
    z = np.clip(started.after(errors).likeliest.z, *bounds(problem))
    if not np.isfinite(problem.residual(z)).all():
        return found
    there = replace(
        saturated_model_of(problem, record, started.logged, z), repeated=started.repeated, clock=started.clock
    )
    found = [_again(there, read_off, found, i) for i in range(len(found))]
    return [error for error in found if _is_suspected(error.suspect)]


def _again(
    started: SaturatedModel, read_off: Sequence[DataError], found: Sequence[_Judged], i: int
) -> _Judged:
    """Return one of some errors, scored with all others corrected."""
    others = [error.suspect.error for k, error in enumerate(found) if k != i]
    after = started.after([*read_off, *others], len(read_off) + i)
    return found[i]._replace(suspect=judged_again(after, found[i].suspect.error))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Against:
    """The suspected errors of a record, in the order in which they are corrected, and their comparison with a few
    causes.

    Attributes:
        problem: of all records, as posed.
        records: as they are.
        record: its number.
        started: the saturated model of the record as it is.
        errors: all of them.
        read_off: so many of them, the first, are read off the record's values.
        kept: errors that were corrected → the log odds of a physical explanation added to them.
    """

    problem: Problem
    records: Sequence[Logged]
    record: int
    started: SaturatedModel
    errors: tuple[DataError, ...]
    read_off: int
    kept: dict[tuple[Physics, tuple[int, ...]], float] = field(default_factory=dict)

    @property
    def left(self) -> float:
        """The noise of the channel that is explained worst without all of them, in usual levels."""
        return max(self.started.after(self.errors).as_is.scales.values(), default=np.inf)

    @property
    def soft(self) -> list[DataError]:
        """Those that physics can mimic."""
        return [error for error in self.errors[self.read_off :] if error.kind in SOFT]

    def few_causes_explain_more(self) -> bool:
        """Say whether soft errors with a few causes are far less probable than a few causes in their place."""
        some = self.soft
        log_with_errors = self._with_others(self.errors, most_of_physics) if some else 0.0
        return bool(some) and self.lead(some, most_of_physics) + log_with_errors < -FAR_BEHIND

    def lead_clearly(self, some: Sequence[DataError]) -> bool:
        """Say whether some errors are far more probable than a few causes, and than one of any size, with all others
        corrected: where causes explain most of the gain of the errors, the rest may be an error of the linearisation.
        """
        least = max(FAR_BEHIND, LEAST_SHARE * self._alone(some))
        return all(self.lead(some, physics) > least for physics in (most_of_physics, most_of_one_cause))

    def lead(self, some: Sequence[DataError], physics: Physics) -> float:
        """Return the log odds of some errors against a physical explanation, with all others corrected."""
        return self._alone(some) - self._with_others(self._others(some), physics)

    def _alone(self, some: Sequence[DataError]) -> float:
        """Return the log odds of some errors against none, with all others corrected."""
        held, lead = self._others(some), 0.0
        for error in some:
            place = sum(self._at(other) < self._at(error) for other in held)
            lead += judged_as_it_is(self.started.after(held, place), error).lead
            held.insert(place, error)
        return lead

    def _others(self, some: Sequence[DataError]) -> list[DataError]:
        return [error for error in self.errors if not any(error is other for other in some)]

    def _at(self, error: DataError) -> int:
        return next(i for i, other in enumerate(self.errors) if other is error)

    def _with_others(self, held: Sequence[DataError], physics: Physics) -> float:
        """Return the log odds of a physical explanation against none, where errors are corrected."""
        key = (physics, tuple(self._at(error) for error in held))
        if key not in self.kept:
            after = self.started.after(held)
            each = [after.logged if i == self.record else record for i, record in enumerate(self.records)]
            most = physics(posed_again(self.problem, each), self.record)
            self.kept[key] = most + after.log_none - after.log_sparse
        return self.kept[key]


def _clear(against: _Against, made: Sequence[Suspect]) -> list[DataError]:
    """Return the errors that exclude physics in the linear problem. Those that physics can mimic must also explain
    the whole record, and be far more probable than a few causes together and each of them: a fault in mid-trial makes
    an error of a clock likely, too. Likewise a rounded channel may stand still since a fault. A step is never clear,
    as a force or a drift may be as sudden.
    """
    soft = against.soft
    definite_count = [error for error in made if not any(error.error is each for each in soft)]
    clear = [
        error.error
        for error in definite_count
        if error.lead > CLEAR_LEAD and error.generous > CLEAR_GENEROUS_LEAD
    ]
    clear = [
        error
        for error in clear
        if not may_stand_still(against.started, error) or against.lead([error], most_of_physics) > CLEAR_LEAD
    ]
    likely = [
        error.error for error in made if error.lead > FAR_BEHIND and any(error.error is each for each in soft)
    ]
    likely = [error for error in likely if error.kind != "step"]
    if not likely or against.left >= LOUD or not against.lead_clearly(soft):
        return clear
    return clear + [error for error in likely if len(soft) == 1 or against.lead_clearly([error])]


def _is_suspected(suspect: Suspect) -> bool:
    return suspect.lead > _least(suspect)


def _least(suspect: Suspect) -> float:
    return LEAST_SOFT_LEAD if suspect.error.kind in SOFT else LEAST_LEAD
