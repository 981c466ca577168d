"""Which errors in the data a diagnosis goes on without: found one after the other, and then held against physics.

`suspected` corrects the best suspect of `data_error_scan`, looks again, and so on. Whether they are errors is for
real fits to say: the corrected record has to be explained to its noise, and better than the record as it is. Where the
linear problem leaves physics no chance with all its parameters free at once, no more is asked (`is_clear`); else the
record as it is has a search of its own, and the two are set beside each other in the units of the record as written:

    log p(y, error) = log p(T y) + Σ log|dT/dy| + log p(error)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from subzero.diagnosis.hypothesis.data_error import DataError, corrected
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.data_error_scan import (
    OUTLIER_LOG_DENSITY,
    Suspect,
    Yardstick,
    log_prior,
    suspects,
    yardstick_of,
)
from subzero.diagnosis.inference.linear_gaussian import log_sum
from subzero.diagnosis.inference.map_fit import is_poor_fit
from subzero.diagnosis.inference.out_of_catalogue import Findings
from subzero.diagnosis.inference.posing import pose, usual_of
from subzero.diagnosis.inference.problem import Observed, Problem
from subzero.diagnosis.inference.repeated_values import is_rounded, repeated_values

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


@dataclass(frozen=True, kw_only=True, eq=False)
class SuspectedError:
    """An error of a record, its leads, and those that the record cannot tell from it."""

    record: int
    error: DataError
    lead: float
    generous: float
    alike: tuple[DataError, ...] = ()


def suspected(problem: Problem, records: Sequence[Logged]) -> list[SuspectedError]:
    """Return the errors in the data of some records, in the order in which they are to be corrected."""
    return [one for i, logged in enumerate(records) for one in _of_record(problem, i, logged)]


def without(records: Sequence[Logged], found: Sequence[SuspectedError]) -> list[Logged]:
    """Return records without the errors that were found in them."""
    return [
        corrected(logged, tuple(one.error for one in found if one.record == i))
        for i, logged in enumerate(records)
    ]


def _of_record(problem: Problem, record: int, logged: Logged) -> list[SuspectedError]:
    yardstick, found = yardstick_of(problem, record, logged), list[SuspectedError]()
    repeated = repeated_values(logged, logged.trusted)
    for error in repeated:
        if not is_rounded(error, logged):
            found.append(
                SuspectedError(record=record, error=error, lead=SIGNATURE_LEAD, generous=SIGNATURE_LEAD)
            )
            yardstick = _after(yardstick, error)
    yardstick = replace(yardstick, repeated=tuple(one for one in repeated if is_rounded(one, logged)))
    for _ in range(MOST_ERRORS):
        ranked = suspects(yardstick, logged.trusted)
        if not ranked or not _is_suspected(ranked[0]):
            break
        found.append(_suspected(record, ranked))
        yardstick = _after(yardstick, ranked[0].error)
    return found


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


def is_clear(found: Sequence[SuspectedError], after: Findings) -> bool:
    """Say whether errors need not be held against a search of the records as they are."""
    leads = all(one.lead > CLEAR_LEAD and one.generous > CLEAR_GENEROUS_LEAD for one in found)
    return leads and is_explained(after)


def may_be_named(found: Sequence[SuspectedError], after: Findings) -> bool:
    """Say whether errors may be the verdict: those that something else may look like only if they explain all."""
    return is_explained(after) or not any(one.error.kind in SOFT for one in found)


def is_explained(work: Findings) -> bool:
    """Say whether one hypothesis leaves nothing but the noise of usual sensors."""
    usual = all(noise.sd < LOUD * usual_of(name, one.values[name], one.known).level + noise.resolution
                for one in work.problem.records for name, noise in one.noise.items())  # fmt: skip
    return usual and not is_poor_fit(work.search.best().fit)


def log_odds(
    found: Sequence[SuspectedError], records: Sequence[Logged], after: Findings, as_is: Findings | None
) -> float:
    """Return the log odds of errors in the data against physics alone.

    Args:
        found: the errors.
        records: as they are.
        after: what was found in the records without the errors.
        as_is: what was found in the records as they are; None if nobody looked, then the scan's word is taken.
    """
    if as_is is None:
        return min(min(one.lead, one.generous) for one in found)
    there, here = log_evidence(after), log_evidence(as_is)
    for one in found:
        there += log_prior(one.error, 10) + one.error.log_jacobian * _measured(records[one.record], one.error)
    lost = sum(_samples(as_is.problem.records)) - sum(_samples(after.problem.records))
    return there - here + lost * here / max(sum(_samples(as_is.problem.records)), 1)


def _measured(logged: Logged, error: DataError) -> int:
    return sum(int(np.isfinite(logged.record.values[name]).sum()) for name in error.channels
               if name in logged.record.values)  # fmt: skip


def log_evidence(work: Findings) -> float:
    """Return the log evidence of records, all explanations together, as a density of what was measured."""
    inside = work.search.beliefs.log_total()
    found = log_sum([inside, *(one.log_posterior for one in work.out_of_catalogue)])
    return found + sum(_fixed(one) for one in work.problem.records)


def _samples(records: Sequence[Observed]) -> list[int]:
    return [int(np.isfinite(one.values[name]).sum()) for one in records for name in one.noise]


def _fixed(one: Observed) -> float:
    """Return what the noise of a record adds to its log density: −½ log det Σ, and what outliers cost."""
    found = 0.0
    for name, noise in one.noise.items():
        out = int(np.isfinite(one.values[name]).sum()) - noise.count
        level = usual_of(name, one.values[name], one.known).level
        found += out * (OUTLIER_LOG_DENSITY - np.log(level)) - noise.log_scale
    return found
