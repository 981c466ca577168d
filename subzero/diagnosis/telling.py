"""From finished work to the verdict as a value: names, numbers with intervals, rivals, the extended model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from subzero.diagnosis.effects.sensors import SPECS
from subzero.diagnosis.evidence import posterior
from subzero.diagnosis.foreign import shares, tolerance_scale
from subzero.diagnosis.hypotheses import Ids, places, variances
from subzero.diagnosis.recover import Recovered, drifted, recover
from subzero.diagnosis.refit import Fit, refit
from subzero.diagnosis.rules import PRACTICAL, SET, decide, sizes, smallest_set
from subzero.diagnosis.search import Candidate, Search
from subzero.diagnosis.showing import curves
from subzero.diagnosis.sudden import Begun, with_begun
from subzero.diagnosis.unknown import DRIFTS, FORCE, Suspect
from subzero.diagnosis.verdict import (
    CAUSE_NAMED,
    NOTHING_WRONG,
    OUTSIDE,
    Cause,
    Estimate,
    Extended,
    Rival,
    Unknown,
    Verdict,
)
from subzero.diagnosis.work import Work

PROBABLE = 1.96
"""Half a 95 % interval, in standard deviations."""
WORTH_TELLING = 1e-4
"""Hypotheses that are less probable than this are not listed."""


def name(ids: Ids) -> str:
    """Return a hypothesis' name: "none", an id, or ids with plus signs."""
    return " + ".join(ids) or "none"


def tell(work: Work) -> Verdict:
    """Return the verdict of finished (or interrupted) work."""
    search = work.search
    inside, outside = shares(search, work.foreign)
    begun = {key: p for key, p in outside.items() if "@" in key}
    best = search.candidates.get(max(inside, key=lambda ids: inside[ids]), search.best())
    practical = (
        min(sizes(search.problem.entries, best.ids, best.fit.z, best.kappa).values(), default=0.0) > PRACTICAL
    )
    strange = sum(p for key, p in outside.items() if "@" not in key)
    verdict = decide(inside, strange, practical)
    sudden = max(begun, key=lambda key: begun[key], default="")
    if begun.get(sudden, 0.0) >= 0.5:
        return _told_sudden(work, inside, outside, sudden)
    return _told(work, verdict, best, inside, outside)


def _told(
    work: Work, verdict: str, best: Candidate, inside: dict[Ids, float], outside: dict[str, float]
) -> Verdict:
    """Return the verdict for hypotheses that hold throughout the trials."""
    problem = work.problem
    found = _recovered(work, best) if verdict == OUTSIDE else None
    causes = _causes(work, best, inside) if verdict == CAUSE_NAMED else ()
    fits = {"nominal": None, "tolerance": _of(work.search, ())}
    fits |= {"extended": found.fit if found else best.fit} if verdict in (CAUSE_NAMED, OUTSIDE) else {}
    rivals = _rivals(work, best, inside, outside)
    first = next((one.ids for one in rivals if one.ids and one.ids in work.search.candidates), None)
    fits |= {f"rival: {name(first)}": work.search.candidates[first].fit} if first else {}
    extended = (
        _extended(work, best, found)
        if verdict in (CAUSE_NAMED, OUTSIDE)
        else _calibrated(work, best, verdict)
    )
    return Verdict(
        verdict=verdict,
        sentence=_sentence(verdict, causes, best, rivals, found.unknown if found else None),
        causes=causes,
        rivals=rivals,
        unknown=found.unknown if found else None,
        extended=extended,
        curves=curves(problem, fits, found),
        **_common(work, best, inside, outside),
    )


def _common(work: Work, best: Candidate, inside: Mapping[Ids, float], outside: Mapping[str, float]) -> dict:
    """Return what every verdict has."""
    listed = {name(ids): p for ids, p in inside.items()} | dict(outside)
    ranked = sorted(listed.items(), key=lambda pair: -pair[1])
    return {
        "probabilities": {key: p for key, p in ranked if p > WORTH_TELLING},
        "tolerance_scale": tolerance_scale(work.search),
        "detectable": work.detectable,
        "misfit": work.misfit,
        "deviations": _deviations(work, best),
        "notes": _notes(work, best),
        "seconds": work.seconds,
        "seed": work.seed,
        "complete": work.complete,
    }


def _deviations(work: Work, best: Candidate) -> dict[str, tuple[float, float]]:
    """Return parameter → (mean, standard deviation), in tolerances."""
    entries = work.problem.entries
    sd = np.sqrt(np.diag(posterior(best.fit.quadratic, variances(entries, best.ids, best.kappa)).M))
    return {entry.name: (float(z) / entry.parameter.tolerance, float(s) / entry.parameter.tolerance)
            for entry, z, s in zip(entries, best.fit.z, sd, strict=True)}  # fmt: skip


def _notes(work: Work, best: Candidate) -> tuple[str, ...]:
    """Return what else a reader should know."""
    found = []
    scale = tolerance_scale(work.search)
    wide = max(scale, key=lambda kappa: scale[kappa])
    if wide > 1.0:
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
            if not 0.6 < ratio < 1.6:
                found.append(f"{record}, {channel}: the noise is {ratio:.1f} times that of a usual sensor.")
    return tuple(found)


def _of(search: Search, ids: Ids) -> Fit | None:
    candidate = search.candidates.get(ids)
    return candidate.fit if candidate else None


def _causes(work: Work, best: Candidate, inside: Mapping[Ids, float]) -> tuple[Cause, ...]:
    """Return the named causes, each with the probability that it is among those of the truth."""
    found = []
    for one in best.ids:
        p = sum(share for ids, share in inside.items() if one in ids)
        sentence = next(entry.effect.sentence for entry in work.problem.entries if entry.effect.id == one)
        found.append(
            Cause(id=one, sentence=sentence, probability=min(p, 1.0), parameters=_estimates(work, best, one))
        )
    return tuple(found)


def _estimates(work: Work, candidate: Candidate, one: str) -> dict[str, Estimate]:
    """Return the parameters of a cause in a candidate's fit."""
    problem, fit = work.problem, candidate.fit
    D = variances(problem.entries, candidate.ids, candidate.kappa)
    sd = np.sqrt(np.diag(posterior(fit.quadratic, D).M))
    setting, found = problem.records[0].setting, {}
    for k in places(problem.entries, (one,)):
        parameter = problem.entries[k].parameter
        nominal, mean = parameter.nominal(setting), float(fit.z[k])
        low, high = (
            float(np.clip(mean + side * PROBABLE * sd[k], parameter.low, parameter.high)) for side in (-1, 1)
        )
        found[parameter.name] = Estimate(value=nominal + mean, low=nominal + low, high=nominal + high, unit=parameter.unit,
                                         nominal=nominal, deviation=mean, deviation_sd=float(sd[k]))  # fmt: skip
    return found


def _rivals(
    work: Work, best: Candidate, inside: Mapping[Ids, float], outside: Mapping[str, float]
) -> tuple[Rival, ...]:
    """Return the other members of the 95 % set, and the runner-up."""
    listed = [ids for ids in smallest_set(inside, SET) if ids != best.ids]
    listed = listed or [ids for ids in sorted(inside, key=lambda ids: -inside[ids]) if ids != best.ids][:1]
    return tuple(_rival(work, best, ids, inside[ids]) for ids in listed)


def _rival(work: Work, best: Candidate, ids: Ids, p: float) -> Rival:
    problem, candidate = work.problem, work.search.candidates.get(ids)
    words = [
        next(entry.effect.sentence for entry in problem.entries if entry.effect.id == one) for one in ids
    ]
    numbers = {one: _estimates(work, candidate, one) for one in ids} if candidate else {}
    return Rival(ids=ids, sentence=" and ".join(words) or "nothing is wrong", probability=p,
                 discrimination=_between(work, best, ids), parameters=numbers)  # fmt: skip


def _between(work: Work, best: Candidate, ids: Ids) -> float:
    """Return D of the best hypothesis against another."""
    from subzero.diagnosis.detect import against, information, marginal

    own = places(work.problem.entries, best.ids)
    if not own:
        return 0.0
    M = marginal(work.problem, best.fit.J[:, : len(work.problem.entries)])
    other = places(work.problem.entries, tuple(one for one in ids if one not in best.ids))
    step = best.fit.z[own]
    if not other:
        return float(step @ information(work.problem, M, own) @ step)
    return against(work.problem, M, own, step, other)[0]


def _recovered(work: Work, best: Candidate) -> Recovered:
    """Return the strongest force or drift, fitted beside the causes that it stands beside."""
    foreign = next(one for one in work.foreign if isinstance(one.what, Suspect))
    base = work.search.candidates[foreign.beside]
    D = variances(work.problem.entries, base.ids, base.kappa)
    kind, _, which = foreign.id.partition(":")
    if kind + ":" == FORCE:
        return recover(work.problem, base.fit, which, D)
    return drifted(work.problem, base.fit, which, DRIFTS * SPECS[which].bias, D)


def _extended(work: Work, best: Candidate, found: Recovered | None) -> Extended:
    """Return the extended model: named causes, the force that is missing, and the rest as calibration."""
    fit = found.fit if found else best.fit
    named = () if found else best.ids
    return Extended(deviations=_by_effect(work, fit.z, named), calibration=_by_effect(work, fit.z, None, but=named),
                    missing=found.missing if found else None)  # fmt: skip


def _calibrated(work: Work, best: Candidate, verdict: str) -> Extended:
    """Return the model as calibrated within tolerances, with nothing new in it."""
    fit = best.fit if verdict == NOTHING_WRONG else work.search.candidates[()].fit
    return Extended(calibration=_by_effect(work, fit.z, None))


def _by_effect(work: Work, z: np.ndarray, ids: Ids | None, but: Ids = ()) -> dict[str, dict[str, float]]:
    """Return effect → parameter → deviation of some effects; of all that hold for every trial if `ids` is None."""
    found: dict[str, dict[str, float]] = {}
    for value, entry in zip(z, work.problem.entries, strict=False):
        one = entry.effect.id
        if entry.record < 0 and one not in but and (ids is None or one in ids):
            found.setdefault(one, {})[entry.parameter.name] = float(value)
    return found


def _told_sudden(work: Work, inside: dict[Ids, float], outside: dict[str, float], key: str) -> Verdict:
    """Return the verdict for a cause that begins in mid-trial, fitted with real runs."""
    what = next(one.what for one in work.foreign if one.id == key)
    assert isinstance(what, Begun)
    none = work.search.candidates[()]
    more = with_begun(work.problem, what)
    D = np.concatenate(
        [variances(work.problem.entries, (), none.kappa), [p.scale**2 for p in what.effect.parameters]]
    )
    start = np.concatenate([none.fit.z, what.mean])
    fit = refit(more, start, more.jacobian(start), D, most_fresh=2)
    estimates = _sudden_estimates(work, what, fit, D)
    cause = Cause(id=what.effect.id, sentence=what.effect.sentence, probability=outside[key], parameters=estimates,
                  start_time=what.time)  # fmt: skip
    deviation = {parameter: one.deviation for parameter, one in estimates.items()}
    rest = _by_effect(work, fit.z[: len(work.problem.entries)], None)
    return Verdict(
        verdict=CAUSE_NAMED,
        sentence=f"From {what.time:g} s on {what.effect.sentence}.",
        causes=(cause,),
        rivals=_rivals(work, none, inside, outside),
        extended=Extended(
            deviations={what.effect.id: deviation}, start_times={what.effect.id: what.time}, calibration=rest
        ),
        curves=curves(more, {"nominal": None, "tolerance": none.fit, "extended": fit}, None),
        **_common(work, none, inside, outside),
    )


def _sudden_estimates(work: Work, what: Begun, fit: Fit, D: np.ndarray) -> dict[str, Estimate]:
    """Return the parameters of a cause that begins in mid-trial."""
    sd, k = np.sqrt(np.diag(posterior(fit.quadratic, D).M)), len(work.problem.entries)
    found = {}
    for i, parameter in enumerate(what.effect.parameters):
        nominal, mean = parameter.nominal(work.problem.records[0].setting), float(fit.z[k + i])
        half = PROBABLE * float(sd[k + i])
        found[parameter.name] = Estimate(value=nominal + mean, low=nominal + mean - half, high=nominal + mean + half,
                                         unit=parameter.unit, nominal=nominal, deviation=mean,
                                         deviation_sd=float(sd[k + i]))  # fmt: skip
    return found


def _sentence(
    verdict: str,
    causes: tuple[Cause, ...],
    best: Candidate,
    rivals: tuple[Rival, ...],
    unknown: Unknown | None,
) -> str:
    """Return the verdict in a sentence."""
    if verdict == NOTHING_WRONG:
        size = f" The fit moves {name(best.ids)}, within what calibration may." if best.ids else ""
        return f"Nothing is wrong beyond the tolerances of the model.{size}"
    if verdict == CAUSE_NAMED:
        return " And ".join(cause.sentence for cause in causes).capitalize() + "."
    if verdict == OUTSIDE and unknown:
        return f"Something acts on {unknown.axis} that no cause of the catalogue explains."
    names = [name(best.ids), *(name(one.ids) for one in rivals)]
    return f"These records cannot tell apart: {', '.join(names)}."
