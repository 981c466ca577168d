"""What is told of a hypothesis: its parameters with intervals, its causes, its rivals and how far they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from subzero.diagnosis import rules
from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.detect import against, information, marginal
from subzero.diagnosis.effect import Parameter
from subzero.diagnosis.evidence import KAPPAS, log_sum, posterior
from subzero.diagnosis.hypotheses import Ids, places, variances
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.verdict import Cause, Estimate, Rival
from subzero.diagnosis.work import Work

PROBABLE = 1.96
"""Half a 95 % interval, in standard deviations."""


def name(ids: Ids) -> str:
    """Return a hypothesis' name: "none", an id, or ids with plus signs."""
    return " + ".join(ids) or "none"


def deviations(work: Work, best: Candidate) -> dict[str, tuple[float, float]]:
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
        float(np.clip(mean + side * PROBABLE * sd, parameter.low, parameter.high)) for side in (-1, 1)
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


def estimates(work: Work, candidate: Candidate, one: str) -> dict[str, Estimate]:
    """Return the parameters of a cause in a candidate's fit."""
    problem, sd = work.problem, _spread(work.problem, candidate)
    setting, found = problem.records[0].setting, {}
    for k in places(problem.entries, (one,)):
        parameter = problem.entries[k].parameter
        found[parameter.name] = estimate(
            parameter, parameter.nominal(setting), float(candidate.fit.z[k]), float(sd[k])
        )
    return found


def sentence_of(problem: Problem, one: str) -> str:
    """Return what a cause is, in words."""
    return next(entry.effect.sentence for entry in problem.entries if entry.effect.id == one)


def large(work: Work, candidate: Candidate) -> Ids:
    """Return those causes of a candidate that are of a practical size."""
    return rules.large(work.problem.entries, candidate.ids, candidate.fit.z, candidate.kappa)


def causes(work: Work, best: Candidate, inside: Mapping[Ids, float], ids: Ids) -> tuple[Cause, ...]:
    """Return the named causes of a candidate, each with the probability that it is among those of the truth."""
    found = []
    for one in ids:
        p = sum(share for ids, share in inside.items() if one in ids)
        found.append(
            Cause(
                id=one,
                sentence=sentence_of(work.problem, one),
                probability=min(p, 1.0),
                parameters=estimates(work, best, one),
            )
        )
    return tuple(found)


def rivals(
    work: Work,
    best: Candidate,
    inside: Mapping[Ids, float],
    left: Sequence[Ids],
    told: Ids | None,
    most: int = 8,
) -> tuple[Rival, ...]:
    """Return the hypotheses that are left beside the one that is told, if one is, at most so many; or else the
    runner-up.
    """
    listed = [ids for ids in left if ids != told][:most]
    ranked: Sequence[Ids] = sorted(inside, key=lambda ids: -inside[ids])
    listed = listed or [ids for ids in ranked if ids != told][:1]
    return tuple(_rival(work, best, ids, inside.get(ids, 0.0)) for ids in listed)


def _rival(work: Work, best: Candidate, ids: Ids, p: float) -> Rival:
    candidate = work.search.candidates.get(ids)
    words = " and ".join(sentence_of(work.problem, one) for one in ids)
    numbers = {one: estimates(work, candidate, one) for one in ids} if candidate else {}
    return Rival(
        ids=ids,
        sentence=words or "nothing is wrong",
        probability=p,
        discrimination=between(work.problem, best.fit, best.ids, ids) if ids != best.ids else np.nan,
        parameters=numbers,
    )


def between(problem: Problem, fit: Fit, ids: Ids, others: Ids) -> float:
    """Return D of causes as they are in a fit against others; of nothing, against what they would be in full size."""
    if not ids:
        return between(problem, _scaled(problem, fit, others), others, ids) if others else 0.0
    own = places(problem.entries, ids)
    M = marginal(problem, fit.J[:, : len(problem.entries)])
    other = places(problem.entries, tuple(one for one in others if one not in ids))
    step = fit.z[own]
    if not other:
        return float(step @ information(problem, M, own) @ step)
    return against(problem, M, own, step, other)[0]


def _scaled(problem: Problem, fit: Fit, ids: Ids) -> Fit:
    """Return a fit with causes of one effect scale in it."""
    from dataclasses import replace

    z = fit.z.copy()
    for k in places(problem.entries, ids):
        z[k] = problem.entries[k].parameter.scale
    return replace(fit, z=z)
