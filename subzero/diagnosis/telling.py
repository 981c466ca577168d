"""From finished work to the verdict as a value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.contenders import contenders, names_of, rivals_of, to_come
from subzero.diagnosis.detect import separation, with_secants
from subzero.diagnosis.effects.sensors import SPECS
from subzero.diagnosis.estimates import causes, deviations, large, name
from subzero.diagnosis.extending import Extension, ahead, gained, of_causes, of_nothing, of_sudden, of_unknown
from subzero.diagnosis.foreign import shares, tolerance_scale
from subzero.diagnosis.hypotheses import Ids
from subzero.diagnosis.rules import HEALTHY, Late, decide, smallest_set
from subzero.diagnosis.showing import curves
from subzero.diagnosis.sudden_told import (
    cause_of,
    closest,
    fitted,
    is_large,
)
from subzero.diagnosis.verdict import (
    CAUSE_NAMED,
    NOTHING_WRONG,
    OUTSIDE,
    UNDECIDED,
    Cause,
    Unknown,
    Verdict,
)
from subzero.diagnosis.work import Work

WORTH_TELLING = 1e-4
"""Hypotheses that are less probable than this are not listed."""
DRAWN = {CAUSE_NAMED: 1, OUTSIDE: 1, UNDECIDED: 3, NOTHING_WRONG: 0}
"""Verdict → so many rivals are drawn: of what is undecided, the best and two more."""
USUAL = (0.6, 1.6)
"""Noise of a usual sensor, over its specification."""


def tell(work: Work) -> Verdict:
    """Return the verdict of finished (or interrupted) work."""
    search = work.search
    inside, outside = shares(search, work.foreign)
    top = max((ids for ids in inside if ids in search.candidates), key=lambda ids: inside[ids])
    best, sudden = search.candidates[top], fitted(work)
    late = Late(outside[sudden[0].id], is_large(sudden[0]), closest(work, sudden[0])[0]) if sudden else Late()
    forces = sum(p for key, p in outside.items() if "@" not in key)
    verdict = decide(inside, forces, *_large(work, best), late)
    if verdict == CAUSE_NAMED and late.is_named:
        new = of_sudden(work, sudden[0], cause_of(work, sudden[0], late.probability))
    else:
        new = _extension(work, verdict, best)
    return _told(work, verdict, best, inside, outside, new)


def _large(work: Work, best: Candidate) -> tuple[bool, float]:
    """Return whether causes of a candidate are of a practical size, and their D against the closest rival."""
    ids = large(work, best)
    if not ids:
        return False, 0.0
    J = with_secants(work.problem, best.fit.J, best.fit.z)
    return True, separation(work.problem, J, best.fit.z, ids, best.kappa)[0]


def _extension(work: Work, verdict: str, best: Candidate) -> Extension:
    """Return what a verdict adds to the model."""
    if verdict == OUTSIDE:
        return of_unknown(work)
    return of_causes(work, best, large(work, best)) if verdict == CAUSE_NAMED else of_nothing(work, best)


def _told(
    work: Work,
    verdict: str,
    best: Candidate,
    inside: dict[Ids, float],
    outside: dict[str, float],
    new: Extension,
) -> Verdict:
    """Return the verdict as a value."""
    candidates, everything = work.search.candidates, inside | {(key,): p for key, p in outside.items()}
    whole = smallest_set(everything)
    left = contenders(work, verdict, best, inside, whole)
    others = rivals_of(work, verdict, best, inside, outside, left, new)
    named = _named(work, verdict, best, inside, new)
    fitted_too = [one.ids for one in others if one.ids and one.ids in candidates]
    rival = candidates[fitted_too[0]].fit if fitted_too else None
    fits = {"nominal": None, "tolerance": candidates[()].fit}
    fits |= {"extended": new.fit} if verdict in (CAUSE_NAMED, OUTSIDE) else {}
    fits |= {f"rival: {name(ids)}": candidates[ids].fit for ids in fitted_too[: DRAWN[verdict]]}
    full = work.budget == "full" and work.complete
    return Verdict(
        verdict=verdict,
        sentence=_sentence(verdict, named, best, names_of(whole, others), new.unknown),
        causes=named,
        rivals=others,
        unknown=new.unknown,
        extended=new.extended,
        gain=gained(work, new, rival) if full and new.is_new else None,
        next_trial=ahead(work, to_come(work, left.hypotheses, left.late), everything)
        if full and verdict == UNDECIDED
        else None,
        curves=curves(new.problem, fits),
        probabilities=_listed(inside, outside),
        tolerance_scale=tolerance_scale(work.search),
        **_common(work, best, sum(inside.values())),
    )


def _named(
    work: Work, verdict: str, best: Candidate, inside: dict[Ids, float], new: Extension
) -> tuple[Cause, ...]:
    """Return the causes that are named."""
    if new.cause:
        return (new.cause,)
    return causes(work, best, inside, large(work, best)) if verdict == CAUSE_NAMED else ()


def _common(work: Work, best: Candidate, inside: float) -> dict[str, Any]:
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
    return {key: p for key, p in sorted(listed.items(), key=lambda pair: -pair[1]) if p > WORTH_TELLING}


def _notes(work: Work, best: Candidate, inside: float) -> tuple[str, ...]:
    """Return what else a reader should know; of the tolerances, if what holds throughout is probable."""
    found, scale = [], tolerance_scale(work.search)
    wide = max(scale, key=lambda kappa: scale[kappa])
    if wide > 1.0 and inside > HEALTHY:
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
            if not USUAL[0] < ratio < USUAL[1]:
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
