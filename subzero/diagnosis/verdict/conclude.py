"""From findings to the verdict: what is named, its rivals, the extended model, and the next trial.

Beside the named explanation stand the remaining models: hypotheses and change points that the records allow, each with
its distance D. A change point has its own, with the onset free:

    D = sᵀ (I + B Bᵀ)⁻¹ s,    B = [J κτ, C s_b]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from subzero.diagnosis.assessment.identifiability import (
    against,
    information,
    marginal,
    separation,
    with_secants,
)
from subzero.diagnosis.assessment.next_trial import Survivor
from subzero.diagnosis.assessment.residuals import curves
from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.diagnosis.hypothesis.effect import MINUTE_S, with_onset
from subzero.diagnosis.hypothesis.hypotheses import Ids, columns_of, nameable
from subzero.diagnosis.inference.change_point_fit import FittedChangePoint
from subzero.diagnosis.inference.change_point_scan import BaseRun, change_point_columns
from subzero.diagnosis.inference.laplace import Candidate
from subzero.diagnosis.inference.latent_force import AXIS_WORDS, DRIFT, FORCE
from subzero.diagnosis.inference.linear_gaussian import posterior
from subzero.diagnosis.inference.map_fit import Fit
from subzero.diagnosis.inference.model_average import (
    HEALTHY_PROBABILITY,
    PRACTICAL_TOLERANCES,
    ChangePointSummary,
    credible_set,
    decide,
)
from subzero.diagnosis.inference.out_of_catalogue import Findings, shares, tolerance_scale
from subzero.diagnosis.results import (
    CAUSE_NAMED,
    NOTHING_WRONG,
    OUTSIDE,
    UNDECIDED,
    Cause,
    Rival,
    Unknown,
    Verdict,
)
from subzero.diagnosis.verdict.extension import (
    Extension,
    ahead,
    causes,
    deviations,
    estimate,
    gained,
    name,
    of_causes,
    of_nothing,
    of_sudden,
    of_unknown,
    practical_of,
    rivals,
    sentence_of,
)


def fitted(work: Findings) -> list[FittedChangePoint]:
    """Return the sudden causes that have a fit of their own, the most probable first."""
    ranked = sorted(work.foreign, key=lambda one: -one.log_posterior)
    return [one.what for one in ranked if isinstance(one.what, FittedChangePoint)]


def is_large(one: FittedChangePoint) -> bool:
    """Say whether a sudden cause is of a practical size; calibration changes nothing in the middle of a trial, so that
    half of what calibration may do is enough.
    """
    sizes = zip(one.begun.mean, one.begun.effect.parameters, strict=True)
    return any(abs(float(z)) > 0.5 * PRACTICAL_TOLERANCES * one.begun.kappa * p.tolerance for z, p in sizes)


def closest(work: Findings, one: FittedChangePoint) -> tuple[float, Ids]:
    """Return D of a sudden cause against the closest of the tolerances, those that hold throughout, and the others from
    its time on; and which.
    """
    n, more = len(work.problem.entries), one.problem
    M, own = marginal(more, one.fit.J, one.begun.kappa), list(range(n, len(more.entries) - 1))
    step = one.fit.z[own]
    found: dict[Ids, float] = {(): float(step @ information(more, M, own, one.begun.kappa) @ step)}
    for other in nameable(more.entries):
        at = columns_of(more.entries, (other,))
        found[(other,)] = against(more, M, own, step, at, one.begun.kappa)[0]
    found |= _from_its_time_on(work, one)
    rival = min(found, key=lambda ids: found[ids])
    return found[rival], rival


def _from_its_time_on(work: Findings, one: FittedChangePoint) -> dict[Ids, float]:
    """Return D against each other cause that would begin when it does: what no tolerance and no size of that explains,

    D = sᵀ (I + B Bᵀ)⁻¹ s,    B = [J κτ, C s_b]

    A jam of a fin with no command lost is an offset of the fin: what both do is no rival of either.
    """
    begun, fit, n = one.begun, one.fit, len(work.problem.entries)
    others = [effect for effect in work.problem.sudden_effects if effect.id != begun.effect.id]
    C = change_point_columns(
        BaseRun(one.problem, fit.z), [(effect, begun.time) for effect in others], begun.record
    )
    free = [*range(n), fit.z.size - 1]
    tolerance = np.array([begun.kappa * one.problem.entries[k].parameter.tolerance for k in free])
    shown, within = fit.J[:, n:-1] @ fit.z[n:-1], fit.J[:, free] * tolerance
    found = dict[Ids, float]()
    for effect, own in zip(others, C, strict=True):
        scales = [0.0 if p.also_of == begun.effect.id else p.scale for p in effect.parameters]
        B = np.hstack([within, own * np.array(scales)])
        b = B.T @ shown
        rest = float(shown @ shown - b @ np.linalg.solve(np.eye(b.size) + B.T @ B, b))
        found[(with_onset(effect, begun.time).id,)] = max(rest, 0.0)
    return found


def cause_of(work: Findings, what: FittedChangePoint, probability: float) -> Cause:
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


def rival_of(work: Findings, what: FittedChangePoint, probability: float) -> Rival:
    """Return a sudden cause as a rival of what is told."""
    cause = cause_of(work, what, probability)
    return Rival(ids=(what.id,), sentence=what.begun.begun.sentence, probability=probability, discrimination=np.nan,
                 parameters={what.id: cause.parameters})  # fmt: skip


def closest_rival(work: Findings, inside: Mapping[Ids, float]) -> Rival:
    """Return what comes closest to the most probable sudden cause."""
    D, ids = closest(work, fitted(work)[0])
    words = " and ".join(_words(work, one) for one in ids) or "nothing is wrong"
    return Rival(ids=ids, sentence=words, probability=inside.get(ids, 0.0), discrimination=D)


def _words(work: Findings, one: str) -> str:
    """Return a cause in words, also one that begins in mid-trial."""
    which, _, time = one.partition("@")
    begins = {effect.id: effect.sentence for effect in work.problem.sudden_effects}
    sentence = begins[which] if which in begins else sentence_of(work.problem, which)
    return f"from {time} s on {sentence}" if time else sentence


def with_closest(work: Findings, one: FittedChangePoint) -> list[FittedChangePoint]:
    """Return a sudden cause, and beside it the one that comes closest if that has a fit of its own, which may be
    improbable by luck alone.
    """
    ids = closest(work, one)[1]
    close = [each for each in fitted(work) if ids and "@" in ids[0]
             and each.begun.effect.id == ids[0].partition("@")[0]]  # fmt: skip
    return [one, *close]


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibrationFromOnset:
    """A sudden cause as it will be in trials to come: throughout. As an `outlook.Survivor`."""

    ids: Ids
    fit: Fit


def calibration_from_onset(work: Findings, what: FittedChangePoint) -> CalibrationFromOnset | None:
    """Return a sudden cause as one that holds throughout, as large (or grown) as it is at the end of its record, with
    what the records say of its size; None of a jam, which is no deviation of a fin that follows.
    """
    n, fit, effect = len(work.problem.entries), what.fit, what.begun.effect
    at = columns_of(work.problem.entries, (effect.grows or effect.id,))
    if not at:
        return None
    lasts = float(work.problem.records[what.begun.record].time[-1]) - what.begun.time
    grown = lasts / MINUTE_S if effect.grows else 1.0
    z, J, D = fit.z[:n].copy(), fit.J[:, :n].copy(), fit.D[:n].copy()
    z[at], J[:, at], D[at] = grown * fit.z[n:-1], fit.J[:, n:-1] / grown, grown**2 * fit.D[n:-1]
    return CalibrationFromOnset(ids=(what.id,), fit=replace(fit, z=z, J=J, D=D))


OUTSIDE_SENTENCES = {
    **{FORCE + axis: f"a {what} acts that no cause explains" for axis, what in AXIS_WORDS.items()},
    **{DRIFT + name: f"the sensor of the {name.replace('_', ' ')} drifts" for name in SPECS},
}
"""Forces and drifts in words."""


class RemainingModels(NamedTuple):
    """What the records leave: hypotheses, causes that begin in mid-trial, and ids of forces and drifts."""

    hypotheses: list[Ids]
    late: list[FittedChangePoint]
    strange: list[str]


def remaining_models(
    work: Findings, verdict: str, best: Candidate, inside: dict[Ids, float], whole: Sequence[Ids]
) -> RemainingModels:
    """Return what is left, of the smallest set of all."""
    left = [ids for ids in whole if ids in inside]
    late = [one for one in fitted(work) if (one.id,) in whole]
    strange = [ids[0] for ids in whole if ids and ids[0] in OUTSIDE_SENTENCES]
    alone = all((one.begun.effect.id,) in left for one in late)
    if verdict == UNDECIDED and len(late) == len(whole) == 1:
        late = with_closest(work, late[0])
    return RemainingModels(
        _with_closest(work, best, left) if verdict == UNDECIDED and left and alone else left, late, strange
    )


def rivals_of(
    work: Findings,
    verdict: str,
    best: Candidate,
    inside: dict[Ids, float],
    outside: dict[str, float],
    left: RemainingModels,
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
    return Rival(
        ids=(key,), sentence=OUTSIDE_SENTENCES[key], probability=probability, discrimination=math.nan
    )


def names_of(whole: Sequence[Ids], others: Sequence[Rival]) -> list[str]:
    """Return the names of all that the records cannot tell apart."""
    return list(dict.fromkeys([*map(name, whole), *(name(one.ids) for one in others)]))


def trial_ahead(work: Findings, left: Sequence[Ids], late: Sequence[FittedChangePoint]) -> list[Survivor]:
    """Return what the next trial is to tell apart; what broke stays broken, so that it is the same as if it had always
    been.
    """
    found: list[Survivor] = [work.search.candidates[ids] for ids in left if ids in work.search.candidates]
    broken = [calibration_from_onset(work, one) for one in late if (one.begun.effect.id,) not in left]
    return found + [one for one in broken if one]


def _with_closest(work: Findings, best: Candidate, left: list[Ids]) -> list[Ids]:
    """Return the hypotheses that the next trial is to tell apart: those that are left, or the best and its closest
    rival, which may be improbable by luck alone.
    """
    if len(left) > 1 or not best.ids:
        return left
    J = with_secants(work.problem, best.fit.J, best.fit.z)
    rival = separation(work.problem, J, best.fit.z, best.ids, best.kappa, work.refuted)[1]
    closest = () if rival == "none" else (rival,)
    work.search.fit(closest)
    return [*left, closest]


LISTED_PROBABILITY = 1e-4
"""Hypotheses that are less probable than this are not listed."""
RIVALS_DRAWN = {CAUSE_NAMED: 1, OUTSIDE: 1, UNDECIDED: 3, NOTHING_WRONG: 0}
"""Verdict → so many rivals are drawn: of what is undecided, the best and two more."""
USUAL_NOISE_RATIO = (0.6, 1.6)
"""Noise of a usual sensor, over its specification."""


def conclude(work: Findings) -> Verdict:
    """Return the verdict of finished (or interrupted) work."""
    search = work.search
    inside, outside = shares(search, work.foreign)
    top = max((ids for ids in inside if ids in search.candidates), key=lambda ids: inside[ids])
    best, sudden = search.candidates[top], fitted(work)
    late = (
        ChangePointSummary(outside[sudden[0].id], is_large(sudden[0]), closest(work, sudden[0])[0])
        if sudden
        else ChangePointSummary()
    )
    forces = sum(p for key, p in outside.items() if "@" not in key)
    verdict = decide(inside, forces, *_large(work, best), late)
    if verdict == CAUSE_NAMED and late.is_named:
        new = of_sudden(work, sudden[0], cause_of(work, sudden[0], late.probability))
    else:
        new = _extension(work, verdict, best)
    return _told(work, verdict, best, inside, outside, new)


def _large(work: Findings, best: Candidate) -> tuple[bool, float]:
    """Return whether causes of a candidate are of a practical size, and their D against the closest rival."""
    ids = practical_of(work, best)
    if not ids:
        return False, 0.0
    J = with_secants(work.problem, best.fit.J, best.fit.z)
    return True, separation(work.problem, J, best.fit.z, ids, best.kappa, work.refuted)[0]


def _extension(work: Findings, verdict: str, best: Candidate) -> Extension:
    """Return what a verdict adds to the model."""
    if verdict == OUTSIDE:
        return of_unknown(work)
    return (
        of_causes(work, best, practical_of(work, best)) if verdict == CAUSE_NAMED else of_nothing(work, best)
    )


def _told(
    work: Findings,
    verdict: str,
    best: Candidate,
    inside: dict[Ids, float],
    outside: dict[str, float],
    new: Extension,
) -> Verdict:
    """Return the verdict as a value."""
    candidates, everything = work.search.candidates, inside | {(key,): p for key, p in outside.items()}
    whole = credible_set(everything)
    left = remaining_models(work, verdict, best, inside, whole)
    others = rivals_of(work, verdict, best, inside, outside, left, new)
    named = _named(work, verdict, best, inside, new)
    fitted_too = [one.ids for one in others if one.ids and one.ids in candidates]
    rival = candidates[fitted_too[0]].fit if fitted_too else None
    fits = {"nominal": None, "tolerance": candidates[()].fit}
    fits |= {"extended": new.fit} if verdict in (CAUSE_NAMED, OUTSIDE) else {}
    fits |= {f"rival: {name(ids)}": candidates[ids].fit for ids in fitted_too[: RIVALS_DRAWN[verdict]]}
    full = work.budget == "full" and work.complete
    return Verdict(
        verdict=verdict,
        sentence=_sentence(verdict, named, best, names_of(whole, others), new.unknown),
        causes=named,
        rivals=others,
        unknown=new.unknown,
        extended=new.extended,
        gain=gained(work, new, rival) if full and new.is_new else None,
        next_trial=ahead(work, trial_ahead(work, left.hypotheses, left.late), everything)
        if full and verdict == UNDECIDED
        else None,
        curves=curves(new.problem, fits),
        probabilities=_listed(inside, outside),
        tolerance_scale=tolerance_scale(work.search),
        **_common(work, best, sum(inside.values())),
    )


def _named(
    work: Findings, verdict: str, best: Candidate, inside: dict[Ids, float], new: Extension
) -> tuple[Cause, ...]:
    """Return the causes that are named."""
    if new.cause:
        return (new.cause,)
    return causes(work, best, inside, practical_of(work, best)) if verdict == CAUSE_NAMED else ()


def _common(work: Findings, best: Candidate, inside: float) -> dict[str, Any]:
    """Return what every verdict has."""
    return {
        "detectable": work.detectable,
        "misfit": work.misfit,
        "deviations": deviations(work, best),
        "notes": _notes(work, best, inside),
        "seconds": work.seconds,
        "seed": work.seed,
        "complete": work.complete,
    }


def _listed(inside: Mapping[Ids, float], outside: Mapping[str, float]) -> dict[str, float]:
    """Return hypothesis → probability, the most probable first."""
    listed = {name(ids): p for ids, p in inside.items()} | dict(outside)
    return {key: p for key, p in sorted(listed.items(), key=lambda pair: -pair[1]) if p > LISTED_PROBABILITY}


def _notes(work: Findings, best: Candidate, inside: float) -> tuple[str, ...]:
    """Return what else a reader should know; of the tolerances, if what holds throughout is probable."""
    found, scale = [], tolerance_scale(work.search)
    wide = max(scale, key=lambda kappa: scale[kappa])
    if wide > 1.0 and inside > HEALTHY_PROBABILITY:
        found.append(
            f"The declared tolerances look too tight: {wide:g} times as wide explains the records best."
        )
    if not best.fit.converged:
        found.append(
            "The best fit has not settled entirely; its numbers are less certain than their intervals say."
        )
    for record, channels in work.misfit.items():
        for channel, one in channels.items():
            ratio = one.noise_sd / SPECS[channel].noise
            if not USUAL_NOISE_RATIO[0] < ratio < USUAL_NOISE_RATIO[1]:
                found.append(f"{record}, {channel}: the noise is {ratio:.1f} times that of a usual sensor.")
    return tuple(found)


def _sentence(
    verdict: str,
    named: tuple[Cause, ...],
    best: Candidate,
    left: Sequence[str],
    unknown: Unknown | None,
) -> str:
    """Return the verdict in a sentence."""
    if verdict == NOTHING_WRONG:
        size = f" The fit moves {name(best.ids)}, within what calibration may." if best.ids else ""
        return f"Nothing is wrong beyond the tolerances of the model.{size}"
    if verdict == CAUSE_NAMED:
        since = f"From {named[0].start_time:g} s on, " if named[0].start_time is not None else ""
        words = since + ", and ".join(cause.sentence for cause in named)
        return f"{words[0].upper()}{words[1:]}."
    if verdict == OUTSIDE and unknown and unknown.is_drift:
        return f"The sensor of the {unknown.axis.replace('_', ' ')} drifts as no cause of the catalogue explains."
    if verdict == OUTSIDE and unknown:
        return f"Something acts on {unknown.axis} that no cause of the catalogue explains."
    return f"These records cannot tell apart: {', '.join(left)}."
