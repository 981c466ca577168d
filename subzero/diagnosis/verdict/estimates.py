"""Numbers of an explanation with their intervals: named causes, rivals, and the extended model.

An interval is ±1.96 standard deviations of the posterior around the fit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from subzero.diagnosis.assessment import Fitted
from subzero.diagnosis.assessment.identifiability import against, information, marginal
from subzero.diagnosis.hypothesis.effect import Parameter, plain_id
from subzero.diagnosis.hypothesis.hypotheses import Entry, Ids, columns_of
from subzero.diagnosis.inference import posterior
from subzero.diagnosis.results import Cause, Estimate, Extended

HALF_INTERVAL_95 = 1.96
"""Half a 95 % interval, in standard deviations."""


def name(ids: Ids) -> str:
    """Return the name of an explanation: "none", an id, or ids with plus signs."""
    return " + ".join(ids) or "none"


def spread(of: Fitted) -> np.ndarray:
    """Return the standard deviations of all entries of a fit (k,)."""
    return np.sqrt(np.diag(posterior(of.fit.quadratic, of.fit.D).M))


def deviations(of: Fitted) -> dict[str, tuple[float, float]]:
    """Return parameter → (mean, standard deviation), in tolerances."""
    rows = zip(of.problem.entries, of.fit.z.tolist(), spread(of).tolist(), strict=True)
    return {
        entry.name: (z / entry.parameter.tolerance, sd / entry.parameter.tolerance) for entry, z, sd in rows
    }


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


def places(of: Fitted, cause: str) -> list[int]:
    """Return the places of the numbers of a cause in a fit: those of its onset too, if it begins in mid-trial."""
    late = "@" in cause
    return [
        k
        for k, entry in enumerate(of.problem.entries)
        if plain_id(entry.effect.id) == plain_id(cause) and ("@" in entry.effect.id) == late
    ]


def cause_of(of: Fitted, cause: str, probability: float) -> Cause:
    """Return a cause of a fit in words and numbers."""
    entries, sd = of.problem.entries, spread(of)
    at = places(of, cause)
    own = {entries[k].parameter.name: k for k in at}
    begins = own.pop("start_time", None)
    setting = of.problem.records[max(entries[at[0]].record, 0)].setting
    numbers = {
        each: estimate(
            entries[k].parameter, entries[k].parameter.nominal(setting), float(of.fit.z[k]), float(sd[k])
        )
        for each, k in own.items()
    }
    return Cause(
        id=plain_id(cause),
        sentence=_plain_sentence(entries[at[0]]),
        probability=probability,
        parameters=numbers,
        start_time=None if begins is None else onset(entries[begins], float(of.fit.z[begins])),
        start_sd=0.0 if begins is None else float(sd[begins]),
    )


def _plain_sentence(entry: Entry) -> str:
    """Return the sentence of an effect without its onset."""
    _, since, time = entry.effect.id.partition("@")
    return entry.effect.sentence.removeprefix(f"from {time} s on ") if since else entry.effect.sentence


def onset(entry: Entry, moved: float) -> float:
    """Return the time at which a cause begins in a fit. [s]"""
    return round(float(entry.effect.id.partition("@")[2]) + moved, 2)


def extended_by(of: Fitted, causes: Ids) -> Extended:
    """Return the nominal model with causes of a fit; all its other numbers are calibration."""
    named = {cause: cause_of(of, cause, 1.0) for cause in causes}
    own = {plain_id(cause) for cause in causes}
    calibration: dict[str, dict[str, float]] = {}
    for z, entry in zip(of.fit.z.tolist(), of.problem.entries, strict=True):
        if entry.record < 0 and entry.effect.id not in own:
            calibration.setdefault(entry.effect.id, {})[entry.parameter.name] = z
    return Extended(
        deviations={
            each.id: {number: estimate.deviation for number, estimate in each.parameters.items()}
            for each in named.values()
        },
        start_times={each.id: each.start_time for each in named.values() if each.start_time is not None},
        calibration=calibration,
    )


def between(of: Fitted, ids: Ids, others: Ids) -> float:
    """Return D of causes as they are in a fit against others; of no cause, D against the others at one effect
    scale; NaN of causes that begin in mid-trial.
    """
    if any("@" in each for each in (*ids, *others)):
        return float("nan")
    if not ids:
        return between(_scaled(of, others), others, ids) if others else 0.0
    entries = of.problem.entries
    own = columns_of(entries, ids)
    M, step = marginal(of.problem, of.fit.J), of.fit.z[own]
    other = columns_of(entries, tuple(each for each in others if each not in ids))
    if not other:
        return float(step @ information(of.problem, M, own) @ step)
    return against(of.problem, M, own, step, other)[0]


def _scaled(of: Fitted, ids: Ids) -> Fitted:
    """Return a fit with causes set to one effect scale."""
    z = of.fit.z.copy()
    for k in columns_of(of.problem.entries, ids):
        z[k] = of.problem.entries[k].parameter.scale
    return of._replace(fit=replace(of.fit, z=z))
