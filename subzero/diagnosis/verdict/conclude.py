"""From the explanations of a search to the verdict on a trial.

pool, named terms → records without errors in their data → fits → causes, rivals, extended model → gain, next trial
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from subzero.diagnosis.assessment import Fitted, misfits
from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.diagnosis.hypothesis.data_error import DataError
from subzero.diagnosis.hypothesis.effect import Effect
from subzero.diagnosis.hypothesis.hypotheses import Ids
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import (
    AXIS_WORDS,
    Problem,
    Progress,
    SensitiveRun,
    respond,
    sensitive_runs,
    with_finer_steps,
)
from subzero.diagnosis.inference.latent_force import DRIFT, FORCE
from subzero.diagnosis.results import (
    CALIBRATED,
    CAUSE_NAMED,
    DATA_ERROR,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUT_OF_CATALOGUE,
    UNDECIDED,
    Cause,
    Curves,
    Detectability,
    FoundError,
    Rival,
    Unknown,
    Verdict,
)
from subzero.diagnosis.verdict.estimates import between, cause_of, deviations, extended_by, name
from subzero.diagnosis.verdict.follow_up import Report, follow_up
from subzero.diagnosis.verdict.pool import (
    Explanation,
    best_of,
    fitted,
    pool_of,
    posed,
    without_errors,
)
from subzero.diagnosis.verdict.terms import id_of, ids_of_ranked
from subzero.identification.api import Outcome
from subzero.identification.explanation import WIDER
from subzero.identification.verdict import UNSEEN

LISTED_PROBABILITY, RIVAL_PROBABILITY = 1e-4, 0.01
"""Explanations that are less probable are not listed, and are no rivals of the reported one."""
MAX_RIVALS, MAX_FITTED = 8, 4
"""Most rivals, and most of them that are fitted as the reported explanation is."""
MOST = 1.0 - 1e-9
"""Largest probability of an error in the data."""
USUAL_NOISE_RATIO = (0.6, 1.6)
"""Range of the noise of a usual sensor, over its specification."""


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What a diagnosis was asked.

    Attributes:
        records: as they are.
        effects: causes besides the catalogue.
        onsets: id → effect that may begin in mid-trial.
        budget: one of BUDGETS.
        seed: of all random numbers.
        progress: called with the share that is done, and the present step.
    """

    records: Sequence[Logged]
    effects: Sequence[Effect]
    onsets: Mapping[str, Effect]
    budget: str
    seed: int
    progress: Progress


def concluded(asked: Asked, outcome: Outcome, detectable: tuple[Detectability, ...]) -> Verdict:
    """Return the verdict of a search that has ended."""
    pool, named = pool_of(outcome), names(outcome)
    best = best_of(pool, outcome)
    said = [(record, error) for record, error in best.errors if error.id in named]
    # A history is one of the records as the whole explanation has them, also if it alone is named.
    errors = list(best.errors) if any(each.startswith((FORCE, DRIFT)) for each in named) else said
    problem = posed(without_errors(asked.records, errors), asked.effects, outcome.search.problem, best.fit)
    reported = fitted(problem, asked.onsets, best)
    unstable = unstable_in(problem, reported)
    verdict, on_model = decided(outcome, best, named, is_unstable=bool(unstable))
    report = Report(
        on_model=on_model,
        problem=problem,
        pool=pool,
        best=best,
        fit=reported,
        causes=tuple(each for each in best.causes if on_model == CAUSE_NAMED and each in named),
        unknown=next(
            (each for each in named if on_model == OUT_OF_CATALOGUE and each.startswith((FORCE, DRIFT))), ""
        ),
        others=_others(asked, problem, pool, best, errors),
    )
    rest = follow_up(asked, report)
    causes = tuple(cause_of(reported, each, named[each]) for each in report.causes)
    rivals = _rivals(report, {error.id for _, error in errors})
    return Verdict(
        verdict=verdict,
        then=on_model if verdict == DATA_ERROR else "",
        sentence=_sentence(on_model, causes, rest.unknown, rivals),
        causes=causes,
        rivals=rivals,
        data_errors=tuple(_found_errors(asked.records, said, named)),
        probabilities=_listed(pool, outcome),
        tolerance_scale=_tolerance_scale(outcome),
        detectable=detectable,
        misfit={
            each.name: misfits(each, respond(each.setting, each.time, each.noise)) for each in problem.records
        },
        deviations=deviations(reported),
        extended=rest.extended,
        unknown=rest.unknown,
        gain=rest.gain,
        next_trial=rest.next_trial,
        curves=_with_recorded(rest.curves, asked.records, errors),
        notes=(*outcome.verdict.notes, *_notes(problem, _tolerance_scale(outcome), unstable)),
        seed=asked.seed,
        complete=not outcome.search.interrupted,
        unstable=tuple(run.record for run in unstable),
    )


def names(outcome: Outcome) -> dict[str, float]:
    """Return the id of each named term of the best explanation, as it is reported, → its probability."""
    problem, best = outcome.search.problem, outcome.search.ranked()[0]
    known = {each.id: each.probability for each in outcome.verdict.named}
    return {id_of(problem, best, term): known[term.id] for term in best.terms if term.id in known}


def decided(
    outcome: Outcome, best: Explanation, named: Mapping[str, float], *, is_unstable: bool
) -> tuple[str, str]:
    """Return the verdict, and that on the model, on the records without errors in their data.

    In a record of an unstable motion no force is named: a growing error of a simulation looks like one.
    """
    if not outcome.verdict.nearness.near:
        return NOTHING_NEAR, NOTHING_NEAR
    errors = {error.id for _, error in best.errors} & set(named)
    if any(each in best.causes for each in named):
        on_model = CAUSE_NAMED
    elif any(each.startswith((FORCE, DRIFT)) for each in named):
        on_model = UNDECIDED if is_unstable else OUT_OF_CATALOGUE
    elif not errors:
        on_model = outcome.verdict.verdict
    elif outcome.verdict.suspected:
        on_model = UNDECIDED
    else:
        on_model = CALIBRATED if best.is_wide else NOTHING_WRONG
    return (DATA_ERROR if errors else on_model), on_model


def unstable_in(problem: Problem, reported: Fitted) -> tuple[SensitiveRun, ...]:
    """Return the records of an unstable motion, which no simulation follows for long."""
    z = reported.fit.z[: len(problem.entries)]
    finer = with_finer_steps(problem, z)
    return sensitive_runs(finer, z) if finer else ()


def _others(
    asked: Asked,
    problem: Problem,
    pool: Sequence[Explanation],
    best: Explanation,
    errors: Sequence[tuple[int, DataError]],
) -> dict[Ids, Fitted]:
    """Return the fits of "nothing is wrong" and of the most probable other explanations, of the same records."""
    known = {(record, error.id) for record, error in errors}
    same = [each for each in pool if each is not best and each.is_of_catalogue and each.error_ids == known]
    worth = [each for each in same if each.causes and each.probability > RIVAL_PROBABILITY][:MAX_FITTED]
    plain = next((each for each in same if not each.causes), best)
    nothing = replace(plain, causes=(), fit=replace(plain.fit, terms=()))
    return {(): fitted(problem, asked.onsets, nothing)} | {
        each.causes: fitted(problem, asked.onsets, each) for each in worth
    }


def _rivals(report: Report, errors: set[str]) -> tuple[Rival, ...]:
    """Return the rivals of the reported explanation, the most probable first; where none is reported, all that
    remain: of the records without the errors that are named.
    """
    undecided = report.on_model == UNDECIDED
    listed = [each for each in report.pool if undecided or each is not report.best]
    worth = [each for each in listed if each.probability >= RIVAL_PROBABILITY][:MAX_RIVALS] or listed[:1]
    return tuple(_rival(report, each, errors) for each in worth)


def _rival(report: Report, each: Explanation, errors: set[str]) -> Rival:
    ids = tuple(id for id in each.ids if id not in errors)
    of = report.fit if each is report.best else report.others.get(each.causes)
    known = of if set(ids) == set(each.causes) else None
    return Rival(
        ids=ids,
        sentence=" and ".join(sentence_of(report, each, id) for id in ids) or "nothing is wrong",
        probability=each.probability,
        discrimination=between(report.fit, report.best.causes, each.causes)
        if each is not report.best
        else math.nan,
        parameters={id: cause_of(known, id, 1.0).parameters for id in each.causes} if known else {},
        extended=extended_by(known, each.causes) if known else None,
    )


def sentence_of(report: Report, each: Explanation, id: str) -> str:
    """Return a term of an explanation in words."""
    if error := next((error for _, error in each.errors if error.id == id), None):
        return error.sentence()
    if id.startswith(FORCE):
        return f"a {AXIS_WORDS[id.removeprefix(FORCE)]} acts that no cause explains"
    if id.startswith(DRIFT):
        return f"the sensor of the {id.removeprefix(DRIFT).replace('_', ' ')} drifts"
    plain, _, time = id.partition("@")
    sentence = next((e.effect.sentence for e in report.problem.entries if e.effect.id == plain), "")
    sentence = sentence or next(e.sentence for e in report.problem.onsets if e.id == plain)
    return f"from {time} s on {sentence}" if time else sentence


def _found_errors(
    records: Sequence[Logged], errors: Sequence[tuple[int, DataError]], named: Mapping[str, float]
) -> Iterator[FoundError]:
    """Yield the named errors in the data, of each record that has them."""
    for of, error in errors:
        for k, record in enumerate(records):
            if of in (-1, k):
                yield FoundError(
                    id=error.id,
                    record=record.name,
                    columns=error.columns,
                    sentence=error.sentence(),
                    remedy=error.remedy(),
                    probability=min(named[error.id], MOST),
                    amount=error.amount,
                    amount_sd=error.amount_sd,
                    since=error.since,
                )


def _with_recorded(
    curves: Mapping[str, Curves], records: Sequence[Logged], errors: Sequence[tuple[int, DataError]]
) -> dict[str, Curves]:
    """Return record → curves, with times and values as they were recorded of channels that have errors."""
    found = dict(curves)
    for k, each in enumerate(records):
        channels = {
            name
            for record, error in errors
            if record in (-1, k) and not error.is_of_commands
            for name in error.channels
        }
        recorded = {name: (each.record.time, each.record.values[name]) for name in sorted(channels)}
        found[each.name] = replace(found[each.name], recorded=recorded)
    return found


def _listed(pool: Sequence[Explanation], outcome: Outcome) -> dict[str, float]:
    """Return explanation → probability, the most probable first, with that of one term more that the records do not
    show; in a screening, of each one that was ranked.
    """
    found = {name(each.ids): each.probability for each in pool}
    rest = max(1.0 - sum(found.values()), 0.0)
    if outcome.search.screened is None:
        found[UNSEEN] = rest
    else:
        ranks = outcome.search.unseen()
        share = rest * np.exp(np.array(list(ranks.values())) - outcome.search.log_unseen())
        for each, p in zip(ranks, share.tolist(), strict=True):
            ids = name(ids_of_ranked(each))
            found[ids] = found.get(ids, 0.0) + p
    found = {ids: p for ids, p in found.items() if p > LISTED_PROBABILITY}
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))


def _tolerance_scale(outcome: Outcome) -> dict[float, float]:
    """Return how much wider the tolerances are than declared → probability."""
    ranked = outcome.search.ranked()
    wide = [any(term.kind == "tolerances" for term in each.terms) for each in ranked]
    p = float(np.sum(outcome.probabilities, where=np.array(wide)) / np.sum(outcome.probabilities))
    return {1.0: 1.0 - p, WIDER: p}


def _sentence(
    on_model: str, causes: Sequence[Cause], unknown: Unknown | None, rivals: Sequence[Rival]
) -> str:
    """Return the verdict on the model in a sentence."""
    if on_model == CAUSE_NAMED:
        words = " and ".join(
            (f"from {cause.start_time:g} s on " if cause.start_time is not None else "") + cause.sentence
            for cause in causes
        )
        return f"{words[0].upper()}{words[1:]}."
    if on_model == OUT_OF_CATALOGUE and unknown:
        what = (
            f"The sensor of the {unknown.axis.replace('_', ' ')} drifts"
            if unknown.is_drift
            else f"Something acts on {unknown.axis}"
        )
        return f"{what} as no cause of the catalogue explains."
    if on_model == UNDECIDED:
        return f"These records cannot tell apart: {', '.join(name(rival.ids) for rival in rivals)}."
    return SENTENCES[on_model]


SENTENCES = {
    NOTHING_WRONG: "Nothing is wrong beyond the tolerances of the model.",
    CALIBRATED: "No cause is named, but numbers of the model had to move beyond their tolerances: it wants "
    "calibration. `subzero calibrate` estimates them.",
    NOTHING_NEAR: "Nothing comes near: the best explanation leaves more than noise, or needs numbers that are far off.",
}


def _notes(problem: Problem, scale: Mapping[float, float], unstable: Sequence[SensitiveRun]) -> Iterator[str]:
    """Yield further remarks for a reader."""
    if scale[WIDER] > scale[1.0]:
        yield f"The declared tolerances look too tight: {WIDER:g} times as wide explains the records best."
    for run in unstable:
        yield (
            f"{run.record}: an unstable motion, which no simulation follows for long. At a vehicle that is a little "
            f"different, steps err by {run.levels:.1f} noise levels of {run.channel} more or less. No force is named "
            "in such a record; a shorter one of the same manoeuvre, or one that is steered less, says more."
        )
    for record in problem.records:
        for channel, noise in record.noise.items():
            ratio = noise.sd / SPECS[channel].noise
            if not USUAL_NOISE_RATIO[0] < ratio < USUAL_NOISE_RATIO[1]:
                yield f"{record.name}, {channel}: the noise is {ratio:.1f} times that of a usual sensor."
