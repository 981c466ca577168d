"""What is left beside what is told: hypotheses and sudden causes as rivals, and for the next trial to tell apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.detect import separation, with_secants
from subzero.diagnosis.effects.sensors import SPECS
from subzero.diagnosis.estimates import name, rivals
from subzero.diagnosis.extending import Extension
from subzero.diagnosis.hypotheses import Ids
from subzero.diagnosis.outlook import Survivor
from subzero.diagnosis.struck import Struck
from subzero.diagnosis.sudden_told import closest_rival, fitted, from_now_on, rival_of, with_closest
from subzero.diagnosis.unknown import DRIFT, FORCE, WORDS
from subzero.diagnosis.verdict import UNDECIDED, Rival
from subzero.diagnosis.work import Work

STRANGE = {
    **{FORCE + axis: f"a {what} acts that no cause explains" for axis, what in WORDS.items()},
    **{DRIFT + name: f"the sensor of the {name.replace('_', ' ')} drifts" for name in SPECS},
}
"""Forces and drifts in words."""


class Left(NamedTuple):
    """What the records leave: hypotheses, causes that begin in mid-trial, and ids of forces and drifts."""

    hypotheses: list[Ids]
    late: list[Struck]
    strange: list[str]


def contenders(
    work: Work, verdict: str, best: Candidate, inside: dict[Ids, float], whole: Sequence[Ids]
) -> Left:
    """Return what is left, of the smallest set of all."""
    left = [ids for ids in whole if ids in inside]
    late = [one for one in fitted(work) if (one.id,) in whole]
    strange = [ids[0] for ids in whole if ids and ids[0] in STRANGE]
    alone = all((one.begun.effect.id,) in left for one in late)
    if verdict == UNDECIDED and len(late) == len(whole) == 1:
        late = with_closest(work, late[0])
    return Left(
        _with_closest(work, best, left) if verdict == UNDECIDED and left and alone else left, late, strange
    )


def rivals_of(
    work: Work,
    verdict: str,
    best: Candidate,
    inside: dict[Ids, float],
    outside: dict[str, float],
    left: Left,
    new: Extension,
) -> tuple[Rival, ...]:
    """Return the rivals of what is told, the most probable first; where nothing is told, all that is left."""
    undecided = verdict == UNDECIDED
    found = rivals(work, best, inside, left.hypotheses, None if undecided else best.ids)
    found = (closest_rival(work, inside),) if new.cause else found
    late = [rival_of(work, one, outside[one.id]) for one in left.late if one.id != new.id]
    strange = [strange_rival(key, outside[key]) for key in left.strange] if undecided else []
    return tuple(sorted([*found, *late, *strange], key=lambda one: -one.probability))


def strange_rival(key: str, probability: float) -> Rival:
    """Return a force or a drift as a rival."""
    return Rival(ids=(key,), sentence=STRANGE[key], probability=probability, discrimination=math.nan)


def names_of(whole: Sequence[Ids], others: Sequence[Rival]) -> list[str]:
    """Return the names of all that the records cannot tell apart."""
    return list(dict.fromkeys([*map(name, whole), *(name(one.ids) for one in others)]))


def to_come(work: Work, left: Sequence[Ids], late: Sequence[Struck]) -> list[Survivor]:
    """Return what the next trial is to tell apart; what broke stays broken, so that it is the same as if it had always
    been.
    """
    found: list[Survivor] = [work.search.candidates[ids] for ids in left if ids in work.search.candidates]
    return found + [from_now_on(work, one) for one in late if (one.begun.effect.id,) not in left]


def _with_closest(work: Work, best: Candidate, left: list[Ids]) -> list[Ids]:
    """Return the hypotheses that the next trial is to tell apart: those that are left, or the best and its closest
    rival, which may be improbable by luck alone.
    """
    if len(left) > 1 or not best.ids:
        return left
    J = with_secants(work.problem, best.fit.J, best.fit.z)
    rival = separation(work.problem, J, best.fit.z, best.ids, best.kappa)[1]
    closest = () if rival == "none" else (rival,)
    work.search.fit(closest)
    return [*left, closest]
