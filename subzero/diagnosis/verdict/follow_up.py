"""The parts of a verdict that need simulations: distances to rivals, a latent force, gain, next trial, curves.

A change point has its own distance to others with the same onset, with the onset free:

    D = sᵀ (I + B Bᵀ)⁻¹ s,    B = [J κτ, C s_b]

Rivals that may be improbable only by chance are fitted, too, where the verdict is undecided.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.assessment.goodness_of_fit import Fitted, curves, gain
from subzero.diagnosis.assessment.identifiability import (
    against,
    information,
    marginal,
    separation,
    with_whole_effects,
)
from subzero.diagnosis.assessment.next_trial import Survivor, next_trial
from subzero.diagnosis.hypothesis.effect import MINUTE_S, with_onset
from subzero.diagnosis.hypothesis.hypotheses import Ids, columns_of, nameable
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.change_point_fit import FittedChangePoint
from subzero.diagnosis.inference.change_point_scan import BaseRun, change_point_columns
from subzero.diagnosis.inference.model_average import MIN_DISCRIMINATION, REFUTED_NATS
from subzero.diagnosis.inference.out_of_catalogue import Findings, shares
from subzero.diagnosis.results import (
    CALIBRATED,
    CAUSE_NAMED,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUTSIDE,
    UNDECIDED,
    Curves,
    Gain,
    NextTrial,
    worth_naming,
)
from subzero.diagnosis.verdict.conclude import (
    ClosestRival,
    FollowUp,
    Ranked,
    RemainingModels,
    decided,
    remaining_models,
    rivals_of,
)
from subzero.diagnosis.verdict.estimates import (
    Extension,
    cause_of,
    curves_outside,
    name,
    of_causes,
    of_nothing,
    of_sudden,
    of_unknown,
    practical_of,
)

if TYPE_CHECKING:
    from subzero.diagnosis.inference.map_fit import Candidate, Fit
    from subzero.diagnosis.inference.model_search import Search

RIVALS_DRAWN = {CAUSE_NAMED: 1, OUTSIDE: 1, NOTHING_NEAR: 1, CALIBRATED: 0, NOTHING_WRONG: 0}
"""Verdict → number of rivals that are drawn; in an undecided one all that are named."""
MAX_SURVIVORS = 4
"""Most hypotheses that the next trial is to tell apart."""


def ranked(findings: Findings) -> Ranked:
    """Return all explanations by their probability, with the closest rivals of the first."""
    inside, added = shares(findings.search, findings.out_of_catalogue)
    candidates = findings.search.candidates
    best = candidates[max((ids for ids in inside if ids in candidates), key=lambda ids: inside[ids])]
    change_points = _change_points(findings)
    return Ranked(
        inside=inside,
        outside=added,
        close_to_change_point=_closest(findings, change_points[0]) if change_points else ClosestRival(),
        best=best,
        close_to_best=_close_to(findings, best, practical_of(findings, best)),
        change_points=change_points,
    )


def follow_up(findings: Findings, known: Ranked) -> FollowUp:
    """Return the results that the verdict on ranked explanations needs."""
    verdict, candidates = decided(findings, known), findings.search.candidates
    new = _extension(findings, known, verdict)
    left = _with_closest(findings, known, verdict, remaining_models(known))
    others = rivals_of(findings, known, verdict, left, new)
    fitted_too = [other.ids for other in others if other.ids and other.ids in candidates]
    rival = candidates[fitted_too[0]].fit if fitted_too else None
    is_full = findings.budget == "full" and findings.complete
    return FollowUp(
        verdict=verdict,
        remaining=left,
        extension=new,
        rivals=others,
        gain=_gained(findings, new, rival) if is_full and new.is_new else None,
        next_trial=_next_trial(findings, left, known.probabilities)
        if is_full and verdict == UNDECIDED
        else None,
        curves=_curves(findings, verdict, new, known, [other.ids for other in others if other.ids]),
    )


def _change_points(findings: Findings) -> list[FittedChangePoint]:
    """Return the change points that have a fit of their own, the most probable first."""
    ordered = sorted(findings.out_of_catalogue, key=lambda candidate: -candidate.log_posterior)
    return [candidate.what for candidate in ordered if isinstance(candidate.what, FittedChangePoint)]


def _close_to(findings: Findings, best: Candidate, ids: Ids) -> ClosestRival:
    """Return the closest rival of causes as they are in a candidate; none if there are no causes."""
    if not ids:
        return ClosestRival()
    J = with_whole_effects(findings.problem, best.fit.J, best.fit.z)
    D, rival = separation(findings.problem, J, best.fit.z, ids, best.kappa, findings.refuted)
    return ClosestRival(D, () if rival == "none" else (rival,))


def _closest(findings: Findings, fitted: FittedChangePoint) -> ClosestRival:
    """Return the closest rival of a change point: the tolerances, a cause that holds throughout, or another with its
    onset.
    """
    n, more = len(findings.problem.entries), fitted.problem
    M, own = marginal(more, fitted.fit.J, fitted.change_point.kappa), list(range(n, len(more.entries) - 1))
    step = fitted.fit.z[own]
    found: dict[Ids, float] = {(): float(step @ information(more, M, own, fitted.change_point.kappa) @ step)}
    for other in nameable(more.entries):
        at = columns_of(more.entries, (other,))
        found[(other,)] = against(more, M, own, step, at, fitted.change_point.kappa)[0]
    found |= _from_its_time_on(findings, fitted)
    rival = min(found, key=lambda ids: found[ids])
    return ClosestRival(found[rival], rival)


def _from_its_time_on(findings: Findings, fitted: FittedChangePoint) -> dict[Ids, float]:
    """Return D against each other cause with the same onset: the part of the response that no tolerance and no size
    of the other explains,

    D = sᵀ (I + B Bᵀ)⁻¹ s,    B = [J κτ, C s_b]

    A jam of a fin with no command lost is an offset of the fin: a cause that does the same is no rival.
    """
    started, fit, n = fitted.change_point, fitted.fit, len(findings.problem.entries)
    others = [effect for effect in findings.problem.sudden_effects if effect.id != started.effect.id]
    C = change_point_columns(
        BaseRun(fitted.problem, fit.z), [(effect, started.time) for effect in others], started.record
    )
    free = [*range(n), fit.z.size - 1]
    tolerance = np.array([started.kappa * fitted.problem.entries[k].parameter.tolerance for k in free])
    shown, within = fit.J[:, n:-1] @ fit.z[n:-1], fit.J[:, free] * tolerance
    found = dict[Ids, float]()
    for effect, own in zip(others, C, strict=True):
        scales = [0.0 if p.also_of == started.effect.id else p.scale for p in effect.parameters]
        B = np.hstack([within, own * np.array(scales)])
        b = B.T @ shown
        rest = float(shown @ shown - b @ np.linalg.solve(np.eye(b.size) + B.T @ B, b))
        found[(with_onset(effect, started.time).id,)] = max(rest, 0.0)
    return found


def _extension(findings: Findings, known: Ranked, verdict: str) -> Extension:
    """Return the additions of a verdict to the model."""
    best = known.best
    if verdict == CAUSE_NAMED and known.change_point.is_named:
        first = known.change_points[0]
        return of_sudden(findings, first, cause_of(findings, first, known.change_point.probability))
    if verdict == OUTSIDE:
        return of_unknown(findings)
    if verdict == CAUSE_NAMED:
        return of_causes(findings, best, practical_of(findings, best))
    return of_nothing(findings, best)


def _with_closest(findings: Findings, known: Ranked, verdict: str, left: RemainingModels) -> RemainingModels:
    """Return the remaining models; where the verdict is undecided and one explanation remains, with its closest rival
    added, which may be improbable only by chance.
    """
    hypotheses, late, best = left.hypotheses, left.change_points, known.best
    if verdict != UNDECIDED:
        return left
    is_same_cause = all((candidate.change_point.effect.id,) in hypotheses for candidate in late)
    if len(hypotheses) == 1 and best.ids and is_same_cause:
        closest = _close_to(findings, best, best.ids).ids
        findings.search.fit(closest)
        hypotheses = [*hypotheses, closest]
    if len(late) == len(left.credible) == 1:
        rival = known.close_to_change_point.ids
        late = late + [
            point
            for point in known.change_points
            if rival and "@" in rival[0] and point.change_point.effect.id == rival[0].partition("@")[0]
        ]
    return left._replace(hypotheses=hypotheses, change_points=late)


def _gained(findings: Findings, new: Extension, rival: Fit | None) -> Gain:
    """Return the gain of an extension on held-out data, compared with a refit within tolerances and the best
    rival.
    """
    tolerance = Fitted(findings.problem, findings.search.candidates[()].fit)
    other = Fitted(findings.problem, rival) if rival else None
    nominal = findings.search.nominal[0]
    return gain(nominal, tolerance, Fitted(new.problem, new.fit), other, seed=findings.seed)


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibrationFromOnset:
    """A cause with a change point as it will be in trials to come: throughout. As a `next_trial.Survivor`."""

    ids: Ids
    fit: Fit


def _calibration_from_onset(findings: Findings, what: FittedChangePoint) -> CalibrationFromOnset | None:
    """Return a cause with a change point as one that holds throughout, as large (or grown) as it is at the end of its
    record, with the posterior of its size; None for a jam, which is no deviation of a fin that follows its command.
    """
    n, fit, effect = len(findings.problem.entries), what.fit, what.change_point.effect
    at = columns_of(findings.problem.entries, (effect.grows or effect.id,))
    if not at:
        return None
    lasts = float(findings.problem.records[what.change_point.record].time[-1]) - what.change_point.time
    grown = lasts / MINUTE_S if effect.grows else 1.0
    z, J, D = fit.z[:n].copy(), fit.J[:, :n].copy(), fit.D[:n].copy()
    z[at], J[:, at], D[at] = grown * fit.z[n:-1], fit.J[:, n:-1] / grown, grown**2 * fit.D[n:-1]
    return CalibrationFromOnset(ids=(what.id,), fit=replace(fit, z=z, J=J, D=D))


def _survivors(findings: Findings, left: RemainingModels) -> list[Survivor]:
    """Return the explanations that the next trial is to tell apart; a fault in mid-trial persists, so that it is the
    same as one that holds throughout.
    """
    candidates = findings.search.candidates
    found: list[Survivor] = [candidates[ids] for ids in left.hypotheses if ids in candidates]
    broken = [
        _calibration_from_onset(findings, point)
        for point in left.change_points
        if (point.change_point.effect.id,) not in left.hypotheses
    ]
    return found + [candidate for candidate in broken if candidate]


def _next_trial(
    findings: Findings, left: RemainingModels, probabilities: Mapping[Ids, float]
) -> NextTrial | None:
    """Return the trial that would best tell apart the most probable remaining explanations."""
    survivors = sorted(_survivors(findings, left), key=lambda survivor: -probabilities.get(survivor.ids, 0.0))
    few = survivors[:MAX_SURVIVORS]
    findings.search.progress(
        0.92, "the next trial, for " + ", ".join(name(candidate.ids) for candidate in few)
    )
    weights = [probabilities.get(candidate.ids, 0.0) for candidate in few]
    return next_trial(findings.problem, few, probabilities=weights, seed=findings.seed)


def _curves(
    findings: Findings, verdict: str, new: Extension, known: Ranked, rivals: Sequence[Ids]
) -> dict[str, Curves]:
    """Return record → curves of the nominal model, of the refits, and of the rivals that are drawn, in their order:
    causes that hold throughout, those that began in mid-trial, forces and drifts, each in the problem that it was
    fitted in.
    """
    candidates = findings.search.candidates
    late: dict[Ids, FittedChangePoint] = {(point.id,): point for point in _change_points(findings)}
    fits: dict[str, Fit | None] = {"nominal": None, "tolerance": candidates[()].fit}
    fits |= {"extended": new.fit} if verdict in (CAUSE_NAMED, OUTSIDE) else {}
    added = {(*candidate.causes, candidate.id): candidate for candidate in findings.out_of_catalogue}
    if verdict == UNDECIDED:
        drawn = [ids for ids in worth_naming(known.probabilities) if ids]
    else:
        drawn = [ids for ids in rivals if ids in candidates or ids in late][: RIVALS_DRAWN[verdict]]
    fits |= {f"rival: {name(ids)}": candidates[ids].fit for ids in drawn if ids in candidates}
    found = curves(new.problem, fits)
    for ids in (ids for ids in drawn if ids not in candidates and (ids in late or ids in added)):
        label = f"rival: {name(ids)}"
        what = late.get(ids) or added[ids].what
        if isinstance(what, FittedChangePoint):
            own = curves(what.problem, {label: what.fit})
        else:
            own = curves_outside(findings, added[ids], label)
        found = {
            record: replace(candidate, models={**candidate.models, **own[record].models})
            for record, candidate in found.items()
        }
    return found


def refuted_rivals(search: Search) -> frozenset[str]:
    """Return the rivals of the best hypothesis that are close only in the linear problem, as simulations show.

    Linearised where there is none, a play of the rudder may look like its offset, and yet explain nothing of a
    record.
    """
    best, problem, found = search.best(), search.problem, set[str]()
    J = with_whole_effects(problem, best.fit.J, best.fit.z)
    for _ in range(settings.MAX_TRIED if best.ids else 0):
        D, rival = separation(problem, J, best.fit.z, best.ids, best.kappa, found)
        if rival == "none" or D >= MIN_DISCRIMINATION:
            break
        search.fit((rival,), best.fit)
        if search.candidates[(rival,)].optimistic_log_posterior > best.log_posterior - REFUTED_NATS:
            break
        found.add(rival)
    return frozenset(found)
