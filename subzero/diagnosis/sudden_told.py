"""What is told of causes that begin in mid-trial: how large, how far from rivals, as a rival, in a trial to come."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from subzero.diagnosis.begun import begun_at
from subzero.diagnosis.detect import against, information, marginal
from subzero.diagnosis.estimates import estimate, sentence_of
from subzero.diagnosis.evidence import posterior
from subzero.diagnosis.hypotheses import Ids, able, named, places
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.rules import PRACTICAL
from subzero.diagnosis.struck import Struck
from subzero.diagnosis.sudden import Along, columns
from subzero.diagnosis.verdict import Cause, Rival
from subzero.diagnosis.work import Work


def fitted(work: Work) -> list[Struck]:
    """Return the sudden causes that have a fit of their own, the most probable first."""
    ranked = sorted(work.foreign, key=lambda one: -one.log_posterior)
    return [one.what for one in ranked if isinstance(one.what, Struck)]


def is_large(one: Struck) -> bool:
    """Say whether a sudden cause is of a practical size; calibration changes nothing in the middle of a trial, so that
    half of what calibration may do is enough.
    """
    sizes = zip(one.begun.mean, one.begun.effect.parameters, strict=True)
    return any(abs(float(z)) > 0.5 * PRACTICAL * one.begun.kappa * p.tolerance for z, p in sizes)


def closest(work: Work, one: Struck) -> tuple[float, Ids]:
    """Return D of a sudden cause against the closest of the tolerances, those that hold throughout, and the others from
    its time on; and which.
    """
    n, more = len(work.problem.entries), one.problem
    M, own = marginal(more, one.fit.J, one.begun.kappa), list(range(n, len(more.entries) - 1))
    step = one.fit.z[own]
    found: dict[Ids, float] = {(): float(step @ information(more, M, own, one.begun.kappa) @ step)}
    for other in named(more):
        at = places(more.entries, (other,))
        found[(other,)] = against(more, M, own, step, at, one.begun.kappa)[0]
    found |= _from_its_time_on(work, one)
    rival = min(found, key=lambda ids: found[ids])
    return found[rival], rival


def _from_its_time_on(work: Work, one: Struck) -> dict[Ids, float]:
    """Return D against each other cause that would begin when it does: what no tolerance and no size of that explains,

    D = sᵀ (I + B Bᵀ)⁻¹ s,    B = [J κτ, C s_b]
    """
    begun, fit, n = one.begun, one.fit, len(work.problem.entries)
    others = [effect for effect in able(work.problem) if effect.id != begun.effect.id]
    C = columns(Along(one.problem, fit.z), [(effect, begun.time) for effect in others], begun.record)
    free = [*range(n), fit.z.size - 1]
    tolerance = np.array([begun.kappa * one.problem.entries[k].parameter.tolerance for k in free])
    shown, within = fit.J[:, n:-1] @ fit.z[n:-1], fit.J[:, free] * tolerance
    found = dict[Ids, float]()
    for effect, own in zip(others, C, strict=True):
        B = np.hstack([within, own * np.array([p.scale for p in effect.parameters])])
        b = B.T @ shown
        rest = float(shown @ shown - b @ np.linalg.solve(np.eye(b.size) + B.T @ B, b))
        found[(begun_at(effect, begun.time).id,)] = max(rest, 0.0)
    return found


def cause_of(work: Work, what: Struck, probability: float) -> Cause:
    """Return a sudden cause in words and numbers."""
    fit, effect, n = what.fit, what.begun.effect, len(work.problem.entries)
    sd = np.sqrt(np.diag(posterior(fit.quadratic, fit.D).M))
    setting = what.problem.records[what.begun.record].setting
    numbers = {
        p.name: estimate(p, p.nominal(setting), float(fit.z[n + i]), float(sd[n + i]))
        for i, p in enumerate(effect.parameters)
    }
    return Cause(id=effect.id, sentence=effect.sentence, probability=probability, parameters=numbers,
                 start_time=what.begun.time, start_sd=float(sd[-1]))  # fmt: skip


def rival_of(work: Work, what: Struck, probability: float) -> Rival:
    """Return a sudden cause as a rival of what is told."""
    cause = cause_of(work, what, probability)
    return Rival(ids=(what.id,), sentence=what.begun.begun.sentence, probability=probability, discrimination=np.nan,
                 parameters={what.id: cause.parameters})  # fmt: skip


def closest_rival(work: Work, inside: Mapping[Ids, float]) -> Rival:
    """Return what comes closest to the most probable sudden cause."""
    D, ids = closest(work, fitted(work)[0])
    words = " and ".join(_words(work, one) for one in ids) or "nothing is wrong"
    return Rival(ids=ids, sentence=words, probability=inside.get(ids, 0.0), discrimination=D)


def _words(work: Work, one: str) -> str:
    """Return a cause in words, also one that begins in mid-trial."""
    which, _, time = one.partition("@")
    sentence = sentence_of(work.problem, which)
    return f"from {time} s on {sentence}" if time else sentence


def with_closest(work: Work, one: Struck) -> list[Struck]:
    """Return a sudden cause, and beside it the one that comes closest if that has a fit of its own, which may be
    improbable by luck alone.
    """
    ids = closest(work, one)[1]
    close = [each for each in fitted(work) if ids and "@" in ids[0]
             and each.begun.effect.id == ids[0].partition("@")[0]]  # fmt: skip
    return [one, *close]


@dataclass(frozen=True, kw_only=True, eq=False)
class FromNowOn:
    """A sudden cause as it will be in trials to come: throughout. As an `outlook.Survivor`."""

    ids: Ids
    fit: Fit


def from_now_on(work: Work, what: Struck) -> FromNowOn:
    """Return a sudden cause as one that holds throughout, as large, with what the records say of its size."""
    n, fit = len(work.problem.entries), what.fit
    at = places(work.problem.entries, (what.begun.effect.id,))
    z, J, D = fit.z[:n].copy(), fit.J[:, :n].copy(), fit.D[:n].copy()
    z[at], J[:, at], D[at] = fit.z[n:-1], fit.J[:, n:-1], fit.D[n:-1]
    return FromNowOn(ids=(what.id,), fit=replace(fit, z=z, J=J, D=D))
