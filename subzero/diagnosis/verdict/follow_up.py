"""The parts of a verdict that need more simulations: an unknown force, the gain, the next trial, curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.assessment import Fitted, curves, gain, next_trial
from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.diagnosis.hypothesis.effect import MINUTE_S, plain_id
from subzero.diagnosis.hypothesis.hypotheses import Ids, columns_of
from subzero.diagnosis.inference import (
    MAX_DRIFT_LEVELS,
    Fit,
    Formula,
    Problem,
    describe,
    estimate_drift,
    estimate_force,
    fit_with_drift,
    samples_of,
)
from subzero.diagnosis.inference.latent_force import FORCE
from subzero.diagnosis.results import (
    CALIBRATED,
    CAUSE_NAMED,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUT_OF_CATALOGUE,
    UNDECIDED,
    Curves,
    Extended,
    Gain,
    NextTrial,
    Unknown,
)
from subzero.diagnosis.verdict.estimates import extended_by, name, places
from subzero.diagnosis.verdict.pool import Explanation

if TYPE_CHECKING:
    from subzero.diagnosis.verdict.conclude import Asked

RIVALS_DRAWN = {
    CAUSE_NAMED: 1,
    OUT_OF_CATALOGUE: 1,
    NOTHING_NEAR: 1,
    CALIBRATED: 0,
    NOTHING_WRONG: 0,
    UNDECIDED: 5,
}
"""Verdict → number of rivals that are drawn."""
MAX_SURVIVORS = 4
"""Most explanations that the next trial is to tell apart."""
MENTIONED_PROBABILITY = 0.01
"""Features that are less probable in a formula are not mentioned."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Report:
    """What a verdict reports.

    Attributes:
        on_model: the verdict on the records without errors in their data.
        problem: of those.
        pool: all explanations, the most probable first.
        best: the reported one.
        fit: its fit.
        causes: those that are named.
        unknown: id of the force or drift that is named; "" for none.
        others: causes → fit of an explanation of the same records; () is "nothing is wrong".
    """

    on_model: str
    problem: Problem
    pool: Sequence[Explanation]
    best: Explanation
    fit: Fitted
    causes: Ids
    unknown: str
    others: Mapping[Ids, Fitted]

    @property
    def probabilities(self) -> dict[Ids, float]:
        """Causes of explanations that have a fit → probability."""
        found: dict[Ids, float] = {}
        for each in self.pool:
            if each.is_of_catalogue:
                found[each.causes] = found.get(each.causes, 0.0) + each.probability
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class FollowUp:
    """Results that need simulations after the search.

    Attributes:
        extended: the model with the named causes.
        unknown: the latent force or drift.
        gain: of the extended model on held-out data.
        next_trial: recommended next trial.
        curves: record → curves of all models that are drawn.
    """

    extended: Extended
    unknown: Unknown | None = None
    gain: Gain | None = None
    next_trial: NextTrial | None = None
    curves: Mapping[str, Curves] = field(default_factory=dict)


def follow_up(asked: Asked, report: Report) -> FollowUp:
    """Return the results that a verdict needs."""
    new, unknown, extended = _extension(report)
    is_full = asked.budget == "full"
    is_new = bool(extended.deviations or extended.missing) and not (unknown and unknown.is_drift)
    return FollowUp(
        extended=extended,
        unknown=unknown,
        gain=_gained(report, new, asked.seed) if is_full and is_new else None,
        next_trial=_next_trial(asked, report) if is_full and report.on_model == UNDECIDED else None,
        curves=_curves(report, new),
    )


def _extension(report: Report) -> tuple[Fitted, Unknown | None, Extended]:
    """Return the fit of the extended model, the unknown force or drift, and the model."""
    if report.on_model == OUT_OF_CATALOGUE:
        return _of_unknown(report)
    if report.on_model == CAUSE_NAMED:
        return report.fit, None, extended_by(report.fit, report.causes)
    nothing = report.others[()]
    return nothing, None, extended_by(nothing, ())


def _of_unknown(report: Report) -> tuple[Fitted, Unknown, Extended]:
    kind, _, which = report.unknown.partition(":")
    problem, fit = report.fit
    if kind + ":" == FORCE:
        found = estimate_force(problem, fit, which)
        unknown = with_formula(found.unknown, describe(found))
    else:
        found = estimate_drift(problem, fit, which, MAX_DRIFT_LEVELS * SPECS[which].noise)
        found = replace(found, fit=fit_with_drift(problem, found, found.fit.D))
        unknown = found.unknown
    new = Fitted(found.problem, found.fit)
    return new, unknown, replace(extended_by(new, report.causes), missing=found.missing)


def with_formula(unknown: Unknown, formula: Formula) -> Unknown:
    """Return a force with the history of its formula, if there is one: it is far closer to the true force than the
    free history.
    """
    if not formula.shapes or formula.log_gain <= 0.0:
        return unknown
    columns = np.column_stack([shape.columns for shape in formula.shapes])
    band = np.sqrt(np.maximum(np.sum(columns @ formula.covariance * columns, axis=1), 0.0))
    return replace(
        unknown,
        time=samples_of(float(unknown.time[-1])),
        force=formula.force(),
        band=band,
        formula=formula.terms(),
        features={feature: p for feature, p in formula.features.items() if p >= MENTIONED_PROBABILITY},
    )


def _gained(report: Report, new: Fitted, seed: int) -> Gain:
    """Return the gain of the extended model on held-out data, compared with a refit within tolerances and the best
    rival.
    """
    nothing = report.others[()]
    rival = next((fit for causes, fit in report.others.items() if causes and "@" not in name(causes)), None)
    nominal = report.problem.residual(np.zeros(len(report.problem.entries)))
    return gain(nominal, nothing, new, rival, seed=seed)


@dataclass(frozen=True, eq=False)
class Survivor:
    """An explanation with its fit, as it will be in trials to come."""

    ids: Ids
    fit: Fit


def _next_trial(asked: Asked, report: Report) -> NextTrial | None:
    """Return the trial that would best tell apart the most probable remaining explanations."""
    known = {**report.others, **({report.best.causes: report.fit} if report.best.is_of_catalogue else {})}
    chances = {causes: p for causes, p in report.probabilities.items() if causes in known}
    ranked = sorted(chances, key=lambda causes: -chances[causes])
    few = [each for causes in ranked if (each := _survivor(report.problem, causes, known[causes]))]
    few = few[:MAX_SURVIVORS]
    asked.progress(0.92, "the next trial, for " + ", ".join(name(each.ids) for each in few))
    weights = [chances[each.ids] for each in few]
    return next_trial(report.problem, few, probabilities=weights, seed=asked.seed)


def _survivor(problem: Problem, causes: Ids, of: Fitted) -> Survivor | None:
    """Return an explanation as it will be in trials to come: a cause that began in mid-trial holds throughout, as large
    (or grown) as it is at the end of its record, with the posterior of its size; None for a jam, which is no deviation
    of a fin that follows its command.
    """
    n, fit = len(problem.entries), of.fit
    z, J, D = fit.z[:n].copy(), fit.J[:, :n].copy(), fit.D[:n].copy()
    for cause in (each for each in causes if "@" in each):
        own = [k for k in places(of, cause) if of.problem.entries[k].parameter.name != "start_time"]
        entry = of.problem.entries[own[0]]
        grows = next((e.grows for e in problem.sudden_effects if e.id == plain_id(cause)), "")
        at = columns_of(problem.entries, (grows or plain_id(cause),))
        if not at:
            return None
        lasts = float(problem.records[max(entry.record, 0)].time[-1]) - float(cause.partition("@")[2])
        grown = lasts / MINUTE_S if grows else 1.0
        z[at], J[:, at], D[at] = grown * fit.z[own], fit.J[:, own] / grown, grown**2 * fit.D[own]
    return Survivor(causes, replace(fit, z=z, J=J, D=D))


def _curves(report: Report, new: Fitted) -> dict[str, Curves]:
    """Return record → curves of the nominal model, of the refits, and of the rivals that are drawn."""
    fits: dict[str, Fitted | None] = {"nominal": None, "tolerance": report.others[()]}
    if report.on_model in (CAUSE_NAMED, OUT_OF_CATALOGUE):
        fits["extended"] = new
    drawn = {causes: fit for causes, fit in report.others.items() if causes}
    if report.on_model == UNDECIDED and report.best.causes and report.best.is_of_catalogue:
        drawn = {report.best.causes: report.fit, **drawn}
    for causes in list(drawn)[: RIVALS_DRAWN[report.on_model]]:
        fits[f"rival: {name(causes)}"] = drawn[causes]
    found = curves(report.problem, {"nominal": None})
    for label, of in fits.items():
        if of is not None:
            own = curves(of.problem, {label: of.fit})
            found = {
                record: replace(each, models={**each.models, **own[record].models})
                for record, each in found.items()
            }
    return found
