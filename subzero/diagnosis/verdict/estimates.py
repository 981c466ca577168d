"""The parts of a verdict on an explanation: estimates with intervals, named causes, rivals, and the extended model.

An interval is ±1.96 standard deviations of the posterior, mixed over κ. The extended model is the nominal one with
the named causes, a latent force, or a cause from its onset on; all other deviations that the fit found within
tolerance are its calibration. A latent force is fitted here, by simulations; everything else is taken from existing
fits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.assessment.goodness_of_fit import curves
from subzero.diagnosis.assessment.identifiability import against, information, marginal
from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.diagnosis.hypothesis.hypotheses import Ids, columns_of, variances
from subzero.diagnosis.inference.force_formula import Formula, describe
from subzero.diagnosis.inference.input_estimation import (
    EstimatedForce,
    LatentForceCandidate,
    estimate_drift,
    estimate_force,
    fit_with_drift,
)
from subzero.diagnosis.inference.latent_force import AXIS_WORDS, DRIFT, FORCE, MAX_DRIFT_LEVELS, samples_of
from subzero.diagnosis.inference.linear_gaussian import KAPPAS, log_sum, posterior
from subzero.diagnosis.inference.model_average import practical_causes
from subzero.diagnosis.inference.posing import rewhitened
from subzero.diagnosis.results import Cause, Curves, Estimate, Extended, Rival, Unknown

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.effect import Parameter
    from subzero.diagnosis.inference.change_point_fit import FittedChangePoint
    from subzero.diagnosis.inference.map_fit import Candidate, Fit
    from subzero.diagnosis.inference.out_of_catalogue import Findings, OutOfCatalogue
    from subzero.diagnosis.inference.problem import Problem

HALF_INTERVAL_95 = 1.96
"""Half a 95 % interval, in standard deviations."""


def name(ids: Ids) -> str:
    """Return a hypothesis' name: "none", an id, or ids with plus signs."""
    return " + ".join(ids) or "none"


def deviations(work: Findings, best: Candidate) -> dict[str, tuple[float, float]]:
    """Return parameter → (mean, standard deviation), in tolerances."""
    entries, sd = work.problem.entries, _spread(work.problem, best)
    return {
        entry.name: (float(z) / entry.parameter.tolerance, float(s) / entry.parameter.tolerance)
        for entry, z, s in zip(entries, best.fit.z, sd, strict=True)
    }


def _spread(problem: Problem, candidate: Candidate) -> np.ndarray:
    """Return the standard deviations of all entries about a candidate's fit (k,), mixed over κ."""
    log = {kappa: np.log(prior) + candidate.log_evidence[kappa] for kappa, prior in KAPPAS.items()}
    square, total = np.zeros(len(problem.entries)), log_sum(list(log.values()))
    for kappa, weight in log.items():
        found = posterior(candidate.fit.quadratic, variances(problem.entries, candidate.ids, kappa))
        square += np.exp(weight - total) * (np.diag(found.M) + (found.z - candidate.fit.z) ** 2)
    return np.sqrt(square)


def estimate(parameter: Parameter, nominal: float, mean: float, sd: float) -> Estimate:
    """Return a parameter with its 95 % interval, inside its bounds."""
    low, high = (
        float(np.clip(mean + side * HALF_INTERVAL_95 * sd, parameter.low, parameter.high)) for side in (-1, 1)
    )
    return Estimate(
        value=nominal + mean,
        low=nominal + low,
        high=nominal + high,
        unit=parameter.unit,
        nominal=nominal,
        deviation=mean,
        deviation_sd=sd,
    )


def estimates(work: Findings, candidate: Candidate, name: str) -> dict[str, Estimate]:
    """Return the parameters of a cause in a candidate's fit."""
    problem, sd = work.problem, _spread(work.problem, candidate)
    setting, found = problem.records[0].setting, {}
    for k in columns_of(problem.entries, (name,)):
        parameter = problem.entries[k].parameter
        found[parameter.name] = estimate(
            parameter, parameter.nominal(setting), float(candidate.fit.z[k]), float(sd[k])
        )
    return found


def sentence_of(problem: Problem, name: str) -> str:
    """Return the description of a cause, in words."""
    return next(entry.effect.sentence for entry in problem.entries if entry.effect.id == name)


def practical_of(work: Findings, candidate: Candidate) -> Ids:
    """Return the causes of a candidate that are of a practical size."""
    return practical_causes(work.problem.entries, candidate.ids, candidate.fit.z, candidate.kappa)


def causes(work: Findings, best: Candidate, inside: Mapping[Ids, float], ids: Ids) -> tuple[Cause, ...]:
    """Return the named causes of a candidate, each with the probability that it is among the true ones."""
    found = []
    for cause_id in ids:
        p = sum(share for ids, share in inside.items() if cause_id in ids)
        found.append(
            Cause(
                id=cause_id,
                sentence=sentence_of(work.problem, cause_id),
                probability=min(p, 1.0),
                parameters=estimates(work, best, cause_id),
            )
        )
    return tuple(found)


def cause_of(work: Findings, what: FittedChangePoint, probability: float) -> Cause:
    """Return a cause with a change point in words and numbers."""
    fit, effect, n = what.fit, what.change_point.effect, len(work.problem.entries)
    sd = np.sqrt(np.diag(posterior(fit.quadratic, fit.D).M))
    setting = what.problem.records[what.change_point.record].setting
    numbers = {
        p.name: estimate(p, p.nominal(setting), float(fit.z[n + i]), float(sd[n + i]))
        for i, p in enumerate(effect.parameters)
    }
    return Cause(
        id=effect.id,
        sentence=effect.sentence,
        probability=probability,
        parameters=numbers,
        start_time=what.change_point.time,
        start_sd=float(sd[-1]),
    )


def rivals(
    work: Findings,
    best: Candidate,
    inside: Mapping[Ids, float],
    left: Sequence[Ids],
    reported: Ids | None,
    most: int = 8,
) -> tuple[Rival, ...]:
    """Return the remaining hypotheses, at most `most`, without the reported one, if there is one; if none remains,
    the runner-up.
    """
    listed = [ids for ids in left if ids != reported][:most]
    ranked: Sequence[Ids] = sorted(inside, key=lambda ids: -inside[ids])
    listed = listed or [ids for ids in ranked if ids != reported][:1]
    return tuple(_rival(work, best, ids, inside.get(ids, 0.0)) for ids in listed)


def _rival(work: Findings, best: Candidate, ids: Ids, p: float) -> Rival:
    candidate = work.search.candidates.get(ids)
    words = " and ".join(sentence_of(work.problem, cause_id) for cause_id in ids)
    numbers = {cause_id: estimates(work, candidate, cause_id) for cause_id in ids} if candidate else {}
    return Rival(
        ids=ids,
        sentence=words or "nothing is wrong",
        probability=p,
        discrimination=between(work.problem, best.fit, best.ids, ids) if ids != best.ids else np.nan,
        parameters=numbers,
        extended=of_causes(work, candidate, ids).extended if candidate else None,
    )


def between(problem: Problem, fit: Fit, ids: Ids, others: Ids) -> float:
    """Return D of causes as they are in a fit against others; of no cause, D against the others at one effect
    scale.
    """
    if not ids:
        return between(problem, _scaled(problem, fit, others), others, ids) if others else 0.0
    own = columns_of(problem.entries, ids)
    M = marginal(problem, fit.J[:, : len(problem.entries)])
    other = columns_of(problem.entries, tuple(each for each in others if each not in ids))
    step = fit.z[own]
    if not other:
        return float(step @ information(problem, M, own) @ step)
    return against(problem, M, own, step, other)[0]


def _scaled(problem: Problem, fit: Fit, ids: Ids) -> Fit:
    """Return a fit with causes set to one effect scale."""
    z = fit.z.copy()
    for k in columns_of(problem.entries, ids):
        z[k] = problem.entries[k].parameter.scale
    return replace(fit, z=z)


def rival_of(work: Findings, what: FittedChangePoint, probability: float) -> Rival:
    """Return a cause with a change point as a rival of the reported explanation."""
    cause = cause_of(work, what, probability)
    sentence = what.change_point.with_onset.sentence
    return Rival(
        ids=(what.id,),
        sentence=sentence,
        probability=probability,
        discrimination=np.nan,
        parameters={what.id: cause.parameters},
        extended=of_sudden(work, what, cause).extended,
    )


def closest_rival(work: Findings, inside: Mapping[Ids, float], D: float, ids: Ids) -> Rival:
    """Return the explanation closest to the most probable change point, at a distance D, as a rival."""
    words = " and ".join(_words(work, cause_id) for cause_id in ids) or "nothing is wrong"
    return Rival(ids=ids, sentence=words, probability=inside.get(ids, 0.0), discrimination=D)


def _words(work: Findings, name: str) -> str:
    """Return a cause in words, also one that begins in mid-trial."""
    which, _, time = name.partition("@")
    begins = {effect.id: effect.sentence for effect in work.problem.sudden_effects}
    sentence = begins[which] if which in begins else sentence_of(work.problem, which)
    return f"from {time} s on {sentence}" if time else sentence


OUTSIDE_SENTENCES = {
    **{FORCE + axis: f"a {what} acts that no cause explains" for axis, what in AXIS_WORDS.items()},
    **{DRIFT + name: f"the sensor of the {name.replace('_', ' ')} drifts" for name in SPECS},
}
"""Forces and drifts in words."""


def force_rival(work: Findings, ids: Ids, probability: float) -> Rival:
    """Return a force or a drift, with the causes that it is added to, as a rival."""
    words = [*(sentence_of(work.problem, cause_id) for cause_id in ids[:-1]), OUTSIDE_SENTENCES[ids[-1]]]
    return Rival(ids=ids, sentence=" and ".join(words), probability=probability, discrimination=math.nan)


def names_of(whole: Sequence[Ids], others: Sequence[Rival]) -> list[str]:
    """Return the names of all explanations that the records cannot tell apart."""
    return list(dict.fromkeys([*map(name, whole), *(name(other.ids) for other in others)]))


MENTIONED_PROBABILITY = 0.01
"""Features that are less probable in a formula are not mentioned."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Extension:
    """The additions of a verdict to the model.

    Attributes:
        fit: the best fit with them.
        problem: of that fit.
        extended: the model.
        unknown: the latent force or drift.
        cause: the cause that begins in mid-trial.
    """

    fit: Fit
    problem: Problem
    extended: Extended
    unknown: Unknown | None = None
    cause: Cause | None = None

    @property
    def id(self) -> str:
        """Id of the cause with a change point, such as "rudder_offset@12"; "" if there is none."""
        return f"{self.cause.id}@{self.cause.start_time:g}" if self.cause else ""

    @property
    def is_new(self) -> bool:
        """It has new physics that may explain data: more than a calibration, and no drift of a sensor."""
        drifts = self.unknown is not None and self.unknown.is_drift
        return bool(self.extended.deviations or self.extended.missing) and not drifts


def of_causes(work: Findings, best: Candidate, ids: Ids) -> Extension:
    """Return the extension by the named causes of a candidate."""
    extended = Extended(
        deviations=by_effect(work.problem, best.fit.z, ids),
        calibration=by_effect(work.problem, best.fit.z, None, but=ids),
    )
    return Extension(fit=best.fit, problem=work.problem, extended=extended)


def of_nothing(work: Findings, best: Candidate) -> Extension:
    """Return the model as calibrated within tolerances, without new causes."""
    fit = best.fit if len(best.ids) == 0 else work.search.candidates[()].fit
    return Extension(
        fit=fit, problem=work.problem, extended=Extended(calibration=by_effect(work.problem, fit.z, None))
    )


def most_probable_force(work: Findings) -> tuple[OutOfCatalogue, LatentForceCandidate]:
    """Return the most probable latent force or drift, with the causes that it was found with."""
    return next(
        (candidate, candidate.what)
        for candidate in work.out_of_catalogue
        if isinstance(candidate.what, LatentForceCandidate)
    )


def of_unknown(work: Findings) -> Extension:
    """Return the extension by the most probable force, with its own noise; for the drift of a sensor only the causes
    that it is added to are new.
    """
    explanation, _ = most_probable_force(work)
    found = _estimated(work, explanation)
    problem = explanation.own or work.problem
    deviations = by_effect(problem, found.fit.z, explanation.causes)
    calibration = by_effect(problem, found.fit.z, None, but=explanation.causes)
    extended = Extended(deviations=deviations, calibration=calibration, missing=found.missing)
    unknown = found.unknown if found.missing is None else _as_formula(found.unknown, describe(found))
    return Extension(fit=found.fit, problem=found.problem, extended=extended, unknown=unknown)


def _as_formula(unknown: Unknown, formula: Formula) -> Unknown:
    """Return a force with the history of its formula, if there is one: it is far closer to the true force than the
    free history.
    """
    if not formula.shapes or formula.log_gain <= 0.0:
        return unknown
    times = samples_of(float(unknown.time[-1]))
    columns = np.column_stack([shape.columns for shape in formula.shapes])
    band = np.sqrt(np.maximum(np.sum(columns @ formula.covariance * columns, axis=1), 0.0))
    return replace(
        unknown,
        time=times,
        force=formula.force(),
        band=band,
        formula=formula.terms(),
        features={feature: p for feature, p in formula.features.items() if p >= MENTIONED_PROBABILITY},
    )


def curves_outside(work: Findings, explanation: OutOfCatalogue, label: str) -> dict[str, Curves]:
    """Return record → curves of a force, or of a drift as the sensor shows it, as one model."""
    found = _estimated(work, explanation)
    made = curves(found.problem, {label: found.fit})
    for i, record in enumerate(found.problem.records if found.missing is None else ()):
        own = found.knots.record == i
        made[record.name].models[label][found.unknown.axis] += np.interp(
            record.time, found.knots.time[own], found.force[own]
        )
    return made


def _estimated(work: Findings, explanation: OutOfCatalogue) -> EstimatedForce:
    """Return a force or a drift, fitted with the causes that it is added to."""
    problem = explanation.own or work.problem
    base = work.search.candidates[explanation.causes]
    assert isinstance(explanation.what, LatentForceCandidate)
    kappa = explanation.what.kappa
    fit, D = rewhitened(base.fit, work.problem, problem), variances(problem.entries, base.ids, kappa)
    kind, _, which = explanation.id.partition(":")
    if kind + ":" == FORCE:
        return estimate_force(problem, fit, which, D)
    found = estimate_drift(problem, fit, which, MAX_DRIFT_LEVELS * SPECS[which].noise, D)
    return replace(found, fit=fit_with_drift(problem, found, found.fit.D))


def of_sudden(work: Findings, what: FittedChangePoint, cause: Cause) -> Extension:
    """Return the extension by a cause that begins in mid-trial, as fitted."""
    extended = Extended(
        deviations={cause.id: {parameter: each.deviation for parameter, each in cause.parameters.items()}},
        start_times={cause.id: what.change_point.time},
        calibration=by_effect(work.problem, what.fit.z, None, but=(cause.id,)),
    )
    return Extension(fit=what.fit, problem=what.problem, extended=extended, cause=cause)


def by_effect(problem: Problem, z: np.ndarray, ids: Ids | None, but: Ids = ()) -> dict[str, dict[str, float]]:
    """Return effect → parameter → deviation of some effects; of all that hold for every trial if `ids` is None."""
    found: dict[str, dict[str, float]] = {}
    for value, entry in zip(z, problem.entries, strict=False):
        cause_id = entry.effect.id
        if entry.record < 0 and cause_id not in but and (ids is None or cause_id in ids):
            found.setdefault(cause_id, {})[entry.parameter.name] = float(value)
    return found
