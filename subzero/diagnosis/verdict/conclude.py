"""From findings to the verdict: the decision, named causes, rivals, and words; a pure function of findings.

    findings, distances → decision → follow-up (simulations, `follow_up`) → verdict

The named explanation is reported with the remaining models: hypotheses and change points that the records allow, each
with its distance D. No simulation and no fit is made here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.diagnosis.hypothesis.hypotheses import PRACTICAL_TOLERANCES_SUDDEN
from subzero.diagnosis.inference.linear_gaussian import KAPPAS
from subzero.diagnosis.inference.model_average import (
    HEALTHY_PROBABILITY,
    ChangePointSummary,
    credible_set,
    decide,
    is_near,
    qualified,
    tolerance_scale,
)
from subzero.diagnosis.results import (
    CALIBRATED,
    CAUSE_NAMED,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUTSIDE,
    UNDECIDED,
    Cause,
    Curves,
    Gain,
    NextTrial,
    Rival,
    Unknown,
    Verdict,
)
from subzero.diagnosis.verdict.estimates import (
    OUTSIDE_SENTENCES,
    causes,
    closest_rival,
    deviations,
    force_rival,
    most_probable_force,
    name,
    names_of,
    practical_of,
    rival_of,
    rivals,
)

if TYPE_CHECKING:
    import numpy as np

    from subzero.diagnosis.hypothesis.hypotheses import Entry, Ids
    from subzero.diagnosis.inference import Candidate
    from subzero.diagnosis.inference.change_point_fit import FittedChangePoint
    from subzero.diagnosis.inference.out_of_catalogue import Findings
    from subzero.diagnosis.verdict.estimates import Extension

LISTED_PROBABILITY = 1e-4
"""Hypotheses that are less probable than this are not listed."""


USUAL_NOISE_RATIO = (0.6, 1.6)
"""Range of the noise of a usual sensor, over its specification."""


class ClosestRival(NamedTuple):
    """The closest rival of an explanation: the squared distance D to it, and its causes; () for the tolerances."""

    discrimination: float = 0.0
    ids: Ids = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Ranked:
    """All explanations by their probability, and the closest rival of the first of each kind.

    Attributes:
        inside: hypothesis → probability; with those of explanations out of the catalogue they sum to 1.
        outside: a latent force, a drift or a change point, last, with the causes that it is added to → probability.
        best: the most probable hypothesis that has a fit.
        close_to_best: the closest rival of its causes of a practical size.
        change_points: those with a fit of their own, the most probable first.
        close_to_change_point: the closest rival of the first of them.
    """

    inside: Mapping[Ids, float]
    outside: Mapping[Ids, float]
    best: Candidate
    close_to_best: ClosestRival
    change_points: Sequence[FittedChangePoint]
    close_to_change_point: ClosestRival

    @property
    def probabilities(self) -> dict[Ids, float]:
        """Every explanation → probability."""
        return {**self.inside, **self.outside}

    @property
    def change_point(self) -> ChangePointSummary:
        """A summary of the most probable change point."""
        if not self.change_points:
            return ChangePointSummary()
        first = self.change_points[0]
        return ChangePointSummary(
            self.outside[(first.id,)], is_large(first), self.close_to_change_point.discrimination
        )


def is_large(fitted: FittedChangePoint) -> bool:
    """Say whether a change point is of a practical size; calibration does not change in mid-trial, so that half the
    tolerance of calibration is enough.
    """
    sizes = zip(fitted.change_point.mean, fitted.change_point.effect.parameters, strict=True)
    return any(
        abs(float(z)) > PRACTICAL_TOLERANCES_SUDDEN * fitted.change_point.kappa * p.tolerance
        for z, p in sizes
    )


class RemainingModels(NamedTuple):
    """The explanations that the records allow: hypotheses, change points, latent forces and drifts with the causes
    that they are added to; and the credible set, the smallest one that is probable enough.
    """

    hypotheses: list[Ids]
    change_points: list[FittedChangePoint]
    forces: list[Ids]
    credible: list[Ids]


@dataclass(frozen=True, kw_only=True, eq=False)
class FollowUp:
    """Results that need simulations after the search, made for one verdict.

    Attributes:
        verdict: it was made for.
        remaining: the explanations that the records allow.
        extension: the verdict's additions to the model.
        rivals: of the reported explanation, the most probable first.
        gain: of the extended model on held-out data.
        next_trial: recommended next trial.
        curves: record → curves of all models that are drawn.
    """

    verdict: str
    remaining: RemainingModels
    extension: Extension
    rivals: tuple[Rival, ...]
    gain: Gain | None
    next_trial: NextTrial | None
    curves: Mapping[str, Curves]


def decided(findings: Findings, ranked: Ranked) -> str:
    """Return the verdict that follows from probabilities, sizes and distances."""
    forces = sum(p for ids, p in ranked.outside.items() if "@" not in ids[-1])
    is_practical = bool(practical_of(findings, ranked.best))
    apart = ranked.close_to_best.discrimination
    verdict = decide(ranked.inside, forces, is_practical, apart, ranked.change_point)
    if verdict == OUTSIDE and findings.sensitive:
        verdict = UNDECIDED  # a growing error of a simulation looks like a force
    entries, z, named, kappa = _explanation(findings, ranked, verdict)
    names_something = verdict in (CAUSE_NAMED, OUTSIDE)
    if not is_near(entries, z, named) or (names_something and kappa == max(KAPPAS)):
        return NOTHING_NEAR
    return qualified(verdict, findings.problem.entries, ranked.best)


def _explanation(
    findings: Findings, ranked: Ranked, verdict: str
) -> tuple[Sequence[Entry], np.ndarray, Ids, float]:
    """Return the entries of the explanation that a verdict is about, their deviations (k,), the causes it names, and
    the scale κ of the tolerances under which it is most probable.
    """
    best, entries = ranked.best, findings.problem.entries
    kappa = most_probable_force(findings)[1].kappa if verdict == OUTSIDE else best.kappa
    if verdict == CAUSE_NAMED and ranked.change_point.is_named:
        first = ranked.change_points[0]
        change = first.change_point
        return first.problem.entries, first.fit.z, (change.effect.id,), change.kappa
    added = max(findings.out_of_catalogue, key=lambda each: each.log_posterior, default=None)
    if added and added.point and added.log_posterior > best.log_posterior:
        return entries, added.point.fit.z, best.ids, kappa
    return entries, best.fit.z, best.ids, kappa


def remaining_models(ranked: Ranked) -> RemainingModels:
    """Return the explanations that the records allow, from the credible set."""
    credible = credible_set(ranked.probabilities)
    return RemainingModels(
        hypotheses=[ids for ids in credible if ids in ranked.inside],
        change_points=[point for point in ranked.change_points if (point.id,) in credible],
        forces=[ids for ids in credible if ids and ids[-1] in OUTSIDE_SENTENCES],
        credible=credible,
    )


def rivals_of(
    findings: Findings, ranked: Ranked, verdict: str, remaining: RemainingModels, new: Extension
) -> tuple[Rival, ...]:
    """Return the rivals of the reported explanation, the most probable first; where none is reported, all that
    remain.
    """
    is_undecided, best = verdict == UNDECIDED, ranked.best
    found = rivals(findings, best, ranked.inside, remaining.hypotheses, None if is_undecided else best.ids)
    if new.cause:
        found = (closest_rival(findings, ranked.inside, *ranked.close_to_change_point),)
    late = [
        rival_of(findings, point, ranked.outside[(point.id,)])
        for point in remaining.change_points
        if point.id != new.id
    ]
    forces = (
        [force_rival(findings, ids, ranked.outside[ids]) for ids in remaining.forces] if is_undecided else []
    )
    return tuple(sorted([*found, *late, *forces], key=lambda force: -force.probability))


def conclude(findings: Findings, ranked: Ranked, follow_up: FollowUp) -> Verdict:
    """Return the verdict of a finished (or interrupted) search."""
    new, best, verdict = follow_up.extension, ranked.best, follow_up.verdict
    named = _named(findings, ranked, verdict, new)
    left = names_of(follow_up.remaining.credible, follow_up.rivals)
    return Verdict(
        verdict=verdict,
        sentence=_sentence(verdict, named, best, left, new.unknown),
        causes=named,
        rivals=follow_up.rivals,
        unknown=new.unknown,
        extended=new.extended,
        gain=follow_up.gain,
        next_trial=follow_up.next_trial,
        curves=follow_up.curves,
        probabilities=_listed(ranked.probabilities),
        tolerance_scale=tolerance_scale(findings.search.candidates.values()),
        detectable=findings.detectable,
        misfit=findings.misfit,
        deviations=deviations(findings, best),
        notes=_notes(findings, best, sum(ranked.inside.values())),
        seconds=findings.seconds,
        seed=findings.seed,
        complete=findings.complete,
        unstable=tuple(run.record for run in findings.sensitive),
    )


def _named(findings: Findings, ranked: Ranked, verdict: str, new: Extension) -> tuple[Cause, ...]:
    """Return the causes that are named."""
    if new.cause:
        return (new.cause,)
    best = ranked.best
    return (
        causes(findings, best, ranked.inside, practical_of(findings, best)) if verdict == CAUSE_NAMED else ()
    )


def _listed(probabilities: Mapping[Ids, float]) -> dict[str, float]:
    """Return hypothesis → probability, the most probable first."""
    listed = sorted(probabilities.items(), key=lambda pair: -pair[1])
    return {name(ids): p for ids, p in listed if p > LISTED_PROBABILITY}


def _notes(work: Findings, best: Candidate, inside: float) -> tuple[str, ...]:
    """Return further remarks for a reader; on the tolerances, if causes that hold throughout are probable."""
    found, scale = [], tolerance_scale(work.search.candidates.values())
    wide = max(scale, key=lambda kappa: scale[kappa])
    if wide > 1.0 and inside > HEALTHY_PROBABILITY:
        found.append(
            f"The declared tolerances look too tight: {wide:g} times as wide explains the records best."
        )
    if not best.fit.converged:
        found.append(
            "The best fit has not settled entirely; its numbers are less certain than their intervals say."
        )
    found += [
        f"{run.record}: an unstable motion, which no simulation follows for long. At a vehicle that is a little "
        f"different, steps err by {run.levels:.1f} noise levels of {run.channel} more or less. No force is named in "
        "such a record; a shorter one of the same manoeuvre, or one that is steered less, says more."
        for run in work.sensitive
    ]
    for record, channels in work.misfit.items():
        for channel, each in channels.items():
            ratio = each.noise_sd / SPECS[channel].noise
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
    if verdict == CALIBRATED:
        return (
            "No cause is named, but numbers of the model had to move beyond their tolerances: it wants calibration. "
            "`subzero calibrate` estimates them."
        )
    if verdict == NOTHING_NEAR:
        return (
            "Nothing comes near: the best explanation leaves more than noise, or bends what it does not name."
        )
    if verdict == CAUSE_NAMED:
        since = f"From {named[0].start_time:g} s on, " if named[0].start_time is not None else ""
        words = since + ", and ".join(cause.sentence for cause in named)
        return f"{words[0].upper()}{words[1:]}."
    if verdict == OUTSIDE and unknown and unknown.is_drift:
        return f"The sensor of the {unknown.axis.replace('_', ' ')} drifts as no cause of the catalogue explains."
    if verdict == OUTSIDE and unknown:
        return f"Something acts on {unknown.axis} that no cause of the catalogue explains."
    return f"These records cannot tell apart: {', '.join(left)}."
