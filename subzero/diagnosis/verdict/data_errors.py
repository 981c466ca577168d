"""The verdict on records with errors in their data: what to change, and the diagnosis of the records without them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from subzero.diagnosis.hypothesis.data_error import DataError
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.data_error_choice import SuspectedError
from subzero.diagnosis.inference.model_average import NAMED_PROBABILITY
from subzero.diagnosis.results import DATA_ERROR, UNDECIDED, FoundError, Rival, Verdict

WORTH_TELLING = 0.05
"""An error that is less probable is not told beside a diagnosis of the records as they are."""
SUREST_LOG_ODDS, EVEN = 30.0, 0.5
"""Log odds say no more than that; of what is not named the probability is at most this."""


def probability_of(log_odds: float) -> float:
    """Return the probability that has log odds."""
    return float(1.0 / (1.0 + np.exp(-np.clip(log_odds, -SUREST_LOG_ODDS, SUREST_LOG_ODDS))))


def is_named(probability: float) -> bool:
    """Say whether errors of a probability are the verdict."""
    return probability >= NAMED_PROBABILITY


def with_data_errors(
    after: Verdict, records: Sequence[Logged], found: Sequence[SuspectedError], probability: float
) -> Verdict:
    """Return the verdict `data_error`, which goes on with the diagnosis of the records without the errors."""
    errors = _told(records, found, probability)
    listed = {_beside(found, name): probability * p for name, p in after.probabilities.items()}
    words = " ".join(f"{one.record}: {one.sentence}: {one.remedy}." for one in errors)
    return replace(after, verdict=DATA_ERROR, sentence=f"{words} After that: {after.sentence}", data_errors=errors,
                   then=after.verdict, probabilities=listed)  # fmt: skip


def with_possible_errors(
    as_is: Verdict, records: Sequence[Logged], found: Sequence[SuspectedError], probability: float
) -> Verdict:
    """Return the verdict on records as they are, beside which errors in their data are possible.

    Errors that are more probable, but explain no more than the records as they are, are held to be as probable as not.
    """
    if probability < WORTH_TELLING:
        return as_is
    probability = min(probability, EVEN)
    errors = _told(records, found, probability)
    listed = {name: (1.0 - probability) * p for name, p in as_is.probabilities.items()}
    key, words = _beside(found, "none"), " and ".join(one.sentence for one in errors)
    listed[key] = probability
    rival = Rival(
        ids=tuple(one.id for one in errors), sentence=words, probability=probability, discrimination=np.nan
    )
    rivals = tuple(sorted([*as_is.rivals, rival], key=lambda one: -one.probability))
    ranked = dict(sorted(listed.items(), key=lambda pair: -pair[1]))
    return replace(as_is, verdict=UNDECIDED, data_errors=errors, rivals=rivals, probabilities=ranked,
                   sentence=f"{as_is.sentence} Or {words}.")  # fmt: skip


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
