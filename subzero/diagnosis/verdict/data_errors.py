"""The verdict on records that may have errors in their data: what to change, and the diagnosis of what is left.

The sets of errors that were tried hold one another. Told is the largest of them that, with all that hold it, is
probable enough to be named; the next larger one stands beside the diagnosis as possible, if it is not improbable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from subzero.diagnosis.hypothesis.data_error import DataError
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.data_error_choice import Explained, may_be_named
from subzero.diagnosis.inference.data_error_search import SuspectedError, is_soft
from subzero.diagnosis.inference.linear_gaussian import log_sum
from subzero.diagnosis.inference.model_average import NAMED_PROBABILITY
from subzero.diagnosis.inference.out_of_catalogue import Findings
from subzero.diagnosis.results import DATA_ERROR, UNDECIDED, FoundError, Rival, Verdict

WORTH_TELLING = 0.05
"""Errors that are less probable are not told beside a diagnosis of the records without them."""
MOST, EVEN = 1.0 - 1e-9, 0.5
"""No error is more probable than that; nor, if it may not be named, than as not."""


def on_records(
    records: Sequence[Logged],
    tried: Sequence[tuple[Explained, float]],
    conclude: Callable[[Findings], Verdict],
) -> Verdict:
    """Return the verdict on records that may have errors in their data.

    Args:
        records: as they are.
        tried: what errors they may have, each set with what explains the records besides and its log evidence.
        conclude: makes the verdict on records of what was found in them.
    """
    sets = sorted((one for one, _ in tried), key=lambda one: len(one.errors))
    total, logs = log_sum([log for _, log in tried]), {id(one): log for one, log in tried}
    each = np.exp([logs[id(one)] - total for one in sets])
    at_least = np.minimum(np.cumsum(each[::-1])[::-1], MOST)  # of a set, or one that holds it
    told = max((i for i, one in enumerate(sets) if _is_named(one, at_least[i])), default=0)
    verdict = conclude(sets[told].work)
    is_complete = all(one.work.complete for one in sets)
    if sets[told].errors:
        is_decided = is_complete or not any(map(is_soft, sets[told].errors))
        verdict = _with_errors(verdict, records, sets[told], float(at_least[told]) if is_decided else None)
    verdict = replace(verdict, complete=is_complete)
    if told + 1 == len(sets):
        return verdict
    return _with_possible(verdict, records, sets[told], sets[told + 1], float(at_least[told + 1]))


def _is_named(one: Explained, probability: float) -> bool:
    return probability >= NAMED_PROBABILITY and may_be_named(one.errors, one.work)


def _with_errors(
    after: Verdict, records: Sequence[Logged], one: Explained, probability: float | None
) -> Verdict:
    """Return the verdict `data_error`, which goes on with the diagnosis of the records without the errors; `undecided`
    where they could not be held against all else (None), as the diagnosis was interrupted.
    """
    share = EVEN if probability is None else probability
    errors = _told(records, one.errors, share)
    listed = {_beside(one.errors, name): share * p for name, p in after.probabilities.items()}
    words = " ".join(f"{error.record}: {error.sentence}: {error.remedy}." for error in errors)
    return replace(after, verdict=UNDECIDED if probability is None else DATA_ERROR, data_errors=errors,
                   then=after.verdict, sentence=f"{words} After that: {after.sentence}",
                   probabilities=listed)  # fmt: skip


def _with_possible(
    told: Verdict, records: Sequence[Logged], less: Explained, more: Explained, probability: float
) -> Verdict:
    """Return a verdict beside which further errors in the data are possible.

    Errors that would be probable enough, but may not be named, are held to be as probable as not.
    """
    if probability < WORTH_TELLING:
        return told
    probability = min(probability, EVEN)
    further = [one for one in more.errors if one not in less.errors]
    errors = _told(records, further, probability)
    listed = {name: (1.0 - probability) * p for name, p in told.probabilities.items()}
    listed[_beside(more.errors, "none")] = probability
    words = " and ".join(one.sentence for one in errors)
    rival = Rival(ids=tuple(one.id for one in errors), sentence=words, probability=probability,
                  discrimination=np.nan)  # fmt: skip
    rivals = tuple(sorted([*told.rivals, rival], key=lambda one: -one.probability))
    ranked = dict(sorted(listed.items(), key=lambda pair: -pair[1]))
    beside = replace(told, rivals=rivals, probabilities=ranked, sentence=f"{told.sentence} Or {words}.",
                     data_errors=told.data_errors or errors)  # fmt: skip
    if probability <= 1.0 - NAMED_PROBABILITY:
        return beside
    return replace(beside, then=UNDECIDED) if told.then else replace(beside, verdict=UNDECIDED)


def _beside(found: Sequence[SuspectedError], name: str) -> str:
    """Return the name of an explanation with errors in the data beside it."""
    ids = dict.fromkeys(one.error.id for one in found)
    return " + ".join([*ids, *([] if name == "none" else [name])])


def _told(
    records: Sequence[Logged], found: Sequence[SuspectedError], probability: float
) -> tuple[FoundError, ...]:
    return tuple(
        FoundError(
            id=one.error.id, record=records[one.record].name, columns=one.error.columns,
            sentence=one.error.sentence(), remedy=one.error.remedy(), probability=probability,
            amount=one.error.amount, since=one.error.since, alike=tuple(_words(each) for each in one.alike),
        )
        for one in found
    )  # fmt: skip


def _words(error: DataError) -> str:
    return f"{error.sentence()}: {error.remedy()}"
