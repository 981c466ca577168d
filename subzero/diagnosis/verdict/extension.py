"""The extended model of a verdict: the nominal one with the named causes, a latent force, or a cause from its onset on.

All other deviations that the fit found within tolerance are its calibration. A latent force is fitted here, by
simulations; everything else is taken from fits that are there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.diagnosis.hypothesis.hypotheses import Ids, variances
from subzero.diagnosis.inference.basis import samples_of
from subzero.diagnosis.inference.force_formula import Formula, describe
from subzero.diagnosis.inference.input_estimation import (
    EstimatedForce,
    LatentForceCandidate,
    estimate_drift,
    estimate_force,
    fit_beside_drift,
)
from subzero.diagnosis.inference.latent_force import FORCE, MAX_DRIFT_LEVELS
from subzero.diagnosis.results import Cause, Extended, Unknown

if TYPE_CHECKING:
    from subzero.diagnosis.inference.change_point_fit import FittedChangePoint
    from subzero.diagnosis.inference.map_fit import Candidate, Fit
    from subzero.diagnosis.inference.out_of_catalogue import Findings, OutOfCatalogue
    from subzero.diagnosis.inference.problem import Problem

MENTIONED_PROBABILITY = 0.01
"""Features that are less probable in a formula are not mentioned."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Extension:
    """What a verdict adds to the model.

    Attributes:
        fit: the best fit with it.
        problem: whose entries the fit has.
        extended: the model.
        unknown: the force that is missing.
        cause: the cause that begins in mid-trial.
    """

    fit: Fit
    problem: Problem
    extended: Extended
    unknown: Unknown | None = None
    cause: Cause | None = None

    @property
    def id(self) -> str:
        """Of the sudden cause, such as "rudder_offset@12"; "" if there is none."""
        return f"{self.cause.id}@{self.cause.start_time:g}" if self.cause else ""

    @property
    def is_new(self) -> bool:
        """There is new physics in it that data may be explained by: no mere calibration, and no sensor that drifts."""
        drifts = self.unknown is not None and self.unknown.is_drift
        return bool(self.extended.deviations or self.extended.missing) and not drifts


def of_causes(work: Findings, best: Candidate, ids: Ids) -> Extension:
    """Return the extension by those causes of a candidate that are named."""
    extended = Extended(
        deviations=by_effect(work.problem, best.fit.z, ids),
        calibration=by_effect(work.problem, best.fit.z, None, but=ids),
    )
    return Extension(fit=best.fit, problem=work.problem, extended=extended)


def of_nothing(work: Findings, best: Candidate) -> Extension:
    """Return the model as calibrated within tolerances, with nothing new in it."""
    fit = best.fit if len(best.ids) == 0 else work.search.candidates[()].fit
    return Extension(
        fit=fit, problem=work.problem, extended=Extended(calibration=by_effect(work.problem, fit.z, None))
    )


def of_unknown(work: Findings) -> Extension:
    """Return the extension by the most probable force; beside the drift of a sensor there is nothing new but causes."""
    explanation = next(one for one in work.out_of_catalogue if isinstance(one.what, LatentForceCandidate))
    found = _estimated(work, explanation)
    if found.missing is None:
        found = replace(found, fit=fit_beside_drift(work.problem, found, found.fit.D))
    deviations = by_effect(work.problem, found.fit.z, explanation.causes)
    calibration = by_effect(work.problem, found.fit.z, None, but=explanation.causes)
    extended = Extended(deviations=deviations, calibration=calibration, missing=found.missing)
    unknown = found.unknown if found.missing is None else _as_formula(found.unknown, describe(found))
    return Extension(fit=found.fit, problem=found.problem, extended=extended, unknown=unknown)


def _as_formula(unknown: Unknown, formula: Formula) -> Unknown:
    """Return a force as its formula tells it, if there is one: far closer to what acts than the free history."""
    if not formula.shapes or formula.log_gain <= 0.0:
        return unknown
    times = samples_of(float(unknown.time[-1]))
    columns = np.column_stack([shape.columns for shape in formula.shapes])
    band = np.sqrt(np.maximum(np.sum(columns @ formula.covariance * columns, axis=1), 0.0))
    return replace(unknown, time=times, force=formula.force(), band=band, formula=formula.terms(),
                   features={one: p for one, p in formula.features.items() if p >= MENTIONED_PROBABILITY})  # fmt: skip


def _estimated(work: Findings, explanation: OutOfCatalogue) -> EstimatedForce:
    """Return a force or a drift, fitted beside the causes that it stands beside."""
    base = work.search.candidates[explanation.causes]
    assert isinstance(explanation.what, LatentForceCandidate)
    D = variances(work.problem.entries, base.ids, explanation.what.kappa)
    kind, _, which = explanation.id.partition(":")
    if kind + ":" == FORCE:
        return estimate_force(work.problem, base.fit, which, D)
    return estimate_drift(work.problem, base.fit, which, MAX_DRIFT_LEVELS * SPECS[which].noise, D)


def of_sudden(work: Findings, what: FittedChangePoint, cause: Cause) -> Extension:
    """Return the extension by a cause that begins in mid-trial, as it is fitted."""
    extended = Extended(
        deviations={cause.id: {parameter: one.deviation for parameter, one in cause.parameters.items()}},
        start_times={cause.id: what.change_point.time},
        calibration=by_effect(work.problem, what.fit.z, None, but=(cause.id,)),
    )
    return Extension(fit=what.fit, problem=what.problem, extended=extended, cause=cause)


def by_effect(problem: Problem, z: np.ndarray, ids: Ids | None, but: Ids = ()) -> dict[str, dict[str, float]]:
    """Return effect → parameter → deviation of some effects; of all that hold for every trial if `ids` is None."""
    found: dict[str, dict[str, float]] = {}
    for value, entry in zip(z, problem.entries, strict=False):
        one = entry.effect.id
        if entry.record < 0 and one not in but and (ids is None or one in ids):
            found.setdefault(one, {})[entry.parameter.name] = float(value)
    return found
