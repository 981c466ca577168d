"""From probabilities to a verdict: one visible set of rules.

nothing_wrong      p(none) ≥ 0.5, or the named size is within the practical one (then the model wants calibration)
cause_named        one hypothesis, or one cause that begins in mid-trial, with p ≥ 0.8, D ≥ 9 to its closest rival,
                   its size beyond 4 tolerances
outside_catalogue  a force or a drift that no cause explains has p ≥ 0.8
undecided          everything else: the smallest set with p ≥ 0.95
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from subzero.diagnosis.entries import Entry
from subzero.diagnosis.hypotheses import Ids, places
from subzero.diagnosis.verdict import CAUSE_NAMED, NOTHING_WRONG, OUTSIDE, UNDECIDED

Key = TypeVar("Key")
NAMED, HEALTHY, FOREIGN, SET = 0.8, 0.5, 0.8, 0.95
APART = 9.0
"""With less than this squared distance to a rival no cause is named, whatever the record happens to say."""
PRACTICAL = 4.0
"""A deviation within this many tolerances is a matter of calibration, whatever its evidence."""


def sizes(entries: Sequence[Entry], ids: Ids, z: np.ndarray, kappa: float) -> dict[str, float]:
    """Return cause → its size in tolerances, of its largest parameter."""
    found: dict[str, float] = {}
    for one in ids:
        at = places(entries, (one,))
        found[one] = max(abs(float(z[k])) / (kappa * entries[k].parameter.tolerance) for k in at)
    return found


def large(entries: Sequence[Entry], ids: Ids, z: np.ndarray, kappa: float) -> Ids:
    """Return those causes that are of a practical size: beyond what calibration may do."""
    found = sizes(entries, ids, z, kappa)
    return tuple(one for one in ids if found[one] > PRACTICAL)


def smallest_set(probabilities: Mapping[Key, float], total: float = SET) -> list[Key]:
    """Return the most probable hypotheses that together have a probability."""
    found: list[Key] = []
    have = 0.0
    for ids, p in sorted(probabilities.items(), key=lambda pair: -pair[1]):
        found.append(ids)
        have += p
        if have >= total:
            break
    return found


class Late(NamedTuple):
    """The most probable cause that begins in mid-trial: probability, of a practical size, D to its closest rival."""

    probability: float = 0.0
    practical: bool = False
    apart: float = 0.0

    @property
    def is_named(self) -> bool:
        """It may be named."""
        return self.practical and self.apart >= APART and self.probability >= NAMED


def decide(
    probabilities: Mapping[Ids, float],
    foreign: float,
    practical: bool,
    apart: float,
    late: Late | None = None,
) -> str:
    """Return the verdict.

    Args:
        probabilities: hypothesis → probability; with those outside the catalogue they sum to 1.
        foreign: probability of a force or a drift that no cause explains.
        practical: the most probable hypothesis' causes are all of a practical size.
        apart: D of the most probable hypothesis against its closest rival.
        late: what begins in mid-trial.
    """
    late = late or Late()
    best = max(probabilities, key=lambda ids: probabilities[ids])
    if foreign >= FOREIGN:
        return OUTSIDE
    if late.is_named:
        return CAUSE_NAMED
    if probabilities.get((), 0.0) >= HEALTHY:
        return NOTHING_WRONG
    if best and not practical and probabilities[best] >= HEALTHY:
        return NOTHING_WRONG
    if best and practical and apart >= APART and probabilities[best] >= NAMED:
        return CAUSE_NAMED
    return UNDECIDED
