"""`subzero.diagnose`: from files or records to a verdict, and the order in which the engine runs its parts.

    problem → detectability → residuals → model search → out of catalogue → verdict → extended model, gain, next trial

If even the fit with wide priors (κ = 4) is not close to the records, or the first fits are all poor, explanations
that are not in the catalogue are tried first: with an estimated input force the simulation follows the records, where
linearisation is accurate, and a change point that explains them ends the search.

For records that may have errors in their data there are several findings, one for each set of errors that was tried;
the sets are nested. The verdict reports the largest set for which the probability of it, or of a larger one, is high
enough to be named; the next larger set is reported with the diagnosis as possible, if it is not improbable.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from subzero import identification
from subzero.arguments import checked_arguments
from subzero.channels import BY_NAME
from subzero.diagnosis.assessment.goodness_of_fit import curves, misfits
from subzero.diagnosis.assessment.identifiability import detectability, with_whole_effects
from subzero.diagnosis.hypothesis.catalogue import load, with_own
from subzero.diagnosis.hypothesis.data_error import DataError
from subzero.diagnosis.hypothesis.effect import Effect
from subzero.diagnosis.hypothesis.logged import NO_RECORD, Logged
from subzero.diagnosis.hypothesis.noise import level_of
from subzero.diagnosis.inference.data_error_choice import compared
from subzero.diagnosis.inference.data_error_evidence import Explained, leaves_only_noise
from subzero.diagnosis.inference.data_error_search import SuspectedError, mimicked_by_physics, suspected
from subzero.diagnosis.inference.linear_gaussian import log_sum
from subzero.diagnosis.inference.model_average import NAMED_PROBABILITY
from subzero.diagnosis.inference.model_search import Search
from subzero.diagnosis.inference.out_of_catalogue import (
    Findings,
    each_with_refitted_noise,
    explanations_outside,
    is_explained,
)
from subzero.diagnosis.inference.posing import pose, posed_again, sensitive_runs
from subzero.diagnosis.inference.problem import Problem, Progress
from subzero.diagnosis.inference.simulator import respond
from subzero.diagnosis.read_trials import read_trials
from subzero.diagnosis.results import (
    DATA_ERROR,
    NOTHING_NEAR,
    UNDECIDED,
    Curves,
    Detectability,
    FoundError,
    Rival,
    Verdict,
)
from subzero.diagnosis.verdict.conclude import conclude, decided
from subzero.diagnosis.verdict.follow_up import follow_up, ranked, refuted_rivals
from subzero.errors import UserError, chosen, whole
from subzero.model import Model
from subzero.records.record import Record

WORTH_TELLING = 0.05
"""Errors that are less probable are not reported with a diagnosis of the records that leaves them uncorrected."""
MOST, EVEN = 1.0 - 1e-9, 0.5
"""Largest probability of an error; and of one that may not be named."""

BUDGETS = ("screen", "verdict", "full")
"""Linear evidence only; up to the verdict and the extended model; with gain and next trial."""

Given = Logged | Record | identification.Record | str | Path
Seen = Callable[[tuple[Detectability, ...]], None]


@checked_arguments
def diagnose(
    records: Given | Sequence[Given],
    model: str | Path | Model | identification.Model | None = None,
    *,
    effects: str | Path | Sequence[Effect] = (),
    commands: str | None = None,
    progress: Progress | None = None,
    seed: int = 0,
    budget: str = "full",
    held_out: identification.Record | Sequence[identification.Record] = (),
    seconds: float | None = None,
) -> Verdict | identification.Verdict:
    """Say what a simulation gets wrong, name the cause, extend the model and measure the gain.

        >>> verdict = subzero.diagnose("record.csv", "fig6")
        >>> verdict.verdict, [cause.id for cause in verdict.causes]
        ('cause_named', ['rudder_lag'])

    Args:
        records: CSV files, folders of them, records in memory, or `Logged` of `read_trials`; several are fitted
            together.
        model: the scenario that was flown (sidecars may name their own), another nominal model, or a model of your own
            (`Model` of this package), whose records are `Record` of this package.
        effects: causes of your own besides the catalogue: a Python file with EFFECTS, or the effects.
        commands: "record" or "scenario", if a record's commands may differ from the scenario's.
        progress: called with the fraction that is done, and a description of the current step.
        seed: of all random numbers.
        budget: "full", "verdict" without gain and next trial, or "screen" for the screening alone, in a few seconds.
        held_out: records of a model of your own that no fit sees.
        seconds: of processor time, after which the search for a model of your own is ended. [s]

    Raises:
        UserError: a record, a sidecar or an effects file cannot be used.
        scenarios.ScenarioError: the scenario cannot be used.
    """
    if isinstance(model, identification.Model):
        return _of_own_model(records, model, held_out, seconds, progress)
    own = load(effects) if isinstance(effects, str | Path) else tuple(effects)
    logged = _logged([records] if isinstance(records, Given) else records, model, commands)
    return diagnose_trials(logged, effects=own, progress=progress, seed=seed, budget=budget)


def _of_own_model(
    records: Given | Sequence[Given],
    model: identification.Model,
    held_out: identification.Record | Sequence[identification.Record],
    seconds: float | None,
    progress: Progress | None,
) -> identification.Verdict:
    """Diagnose a model of the user's own."""
    given = [records] if isinstance(records, Given) else list(records)
    own = [record for record in given if isinstance(record, identification.Record)]
    if len(own) < len(given):
        raise UserError(
            "records of a model of your own are subzero.diagnosis.Record: read them by subzero.diagnosis.read."
        )
    return identification.diagnose(own, model, held_out=held_out, seconds=seconds, progress=progress)


def _logged(records: Sequence[Given], model: str | Path | Model | None, commands: str | None) -> list[Logged]:
    """Return records with their trials, and with another nominal model if one is given."""
    scenario = None if isinstance(model, Model) else model
    found = [record for record in records if isinstance(record, Logged)]
    paths = [record for record in records if not isinstance(record, Logged | identification.Record)]
    if len(found) + len(paths) < len(records):
        raise UserError("a subzero.diagnosis.Record needs a model of your own: diagnose(record, Model(...)).")
    found += read_trials(paths, scenario=scenario, commands=commands) if paths else []
    if not isinstance(model, Model):
        return found
    return [
        dataclasses.replace(trial, setting=dataclasses.replace(trial.setting, model=model)) for trial in found
    ]


@checked_arguments
def diagnose_trials(
    records: Sequence[Logged],
    *,
    effects: Iterable[Effect] = (),
    progress: Progress | None = None,
    seen: Seen | None = None,
    seed: int = 0,
    budget: str = "full",
) -> Verdict:
    """Say what the nominal models of some records get wrong, and why.

    Args:
        records: of one vehicle, each with its trial.
        effects: causes besides the catalogue.
        progress: called with the fraction that is done, and a description of the current step.
        seen: called with the detectability of causes, before the records are searched.
        seed: of all random numbers.
        budget: one of BUDGETS.

    Raises:
        UserError: no record, seed or budget; the nominal model cannot be run through a trial.
    """
    if not records:
        raise UserError(NO_RECORD)
    whole("seed", seed)
    chosen(dict.fromkeys(BUDGETS), budget, "budget")
    effects = with_own(effects, records[0].setting.model.vehicle)
    asked: dict[str, Any] = {
        "effects": effects,
        "progress": progress,
        "seen": seen,
        "seed": seed,
        "budget": budget,
    }
    try:
        verdict = _diagnosed(records, **asked)
        return replace(
            verdict, notes=(*verdict.notes, *(note for record in records for note in record.notes))
        )
    except np.linalg.LinAlgError:
        kept, note = _without_worst_channel(records)
    verdict = diagnose_trials(kept, **asked)
    return replace(verdict, notes=(note, *verdict.notes))


def _diagnosed(
    records: Sequence[Logged],
    effects: tuple[Effect, ...],
    progress: Progress | None,
    seen: Seen | None,
    seed: int,
    budget: str,
) -> Verdict:
    """Diagnose records, all of whose channels can be used."""
    started = perf_counter()
    problem = pose(records, effects)
    with threadpool_limits(limits=1, user_api="blas"):  # simulations use the cores; matrices are small
        suspicion = suspected(problem, records)
        looking = _Looking(
            problem=problem,
            effects=effects,
            progress=progress or (lambda share, words: None),
            seen=seen or (lambda table: None),
            seed=seed,
            budget=budget,
            scanned=perf_counter() - started,
            most=len(suspicion.errors) + 1,
        )
        if not suspicion.errors:
            work = looking.start(records)
            looking.begin(work)
            looking.finish(work)
            return _concluded(work)
        return _on_records(records, compared(suspicion, records, looking), _concluded)


def _without_worst_channel(records: Sequence[Logged]) -> tuple[list[Logged], str]:
    """Return records without the channel that is farthest from its simulation, in levels of its sensor's noise, for a
    diagnosis that has failed; and a sentence that names the channel.

    Raises:
        UserError: there is no other channel in that record.
    """
    far: dict[tuple[int, str], float] = {}
    for i, each in enumerate(records):
        for name, shown in respond(each.setting, each.record.time, tuple(each.record.values)).items():
            left = each.record.values[name] - shown
            far[i, name] = float(np.sqrt(np.nanmean(left**2))) / level_of(name, each.noise)
    at, name = max(far, key=lambda key: far[key])
    record, column = records[at].record, BY_NAME[name].column
    if len(record.values) < 2:
        raise UserError(
            f"{record.source}: {column}, its only channel, is {far[at, name]:.2g} levels of noise away from the "
            "simulation, too far for a diagnosis. Check its unit and the trial."
        )
    values = {channel: column for channel, column in record.values.items() if channel != name}
    kept = list(records)
    kept[at] = replace(records[at], record=replace(record, values=values))
    return (
        kept,
        f"{record.source}: {column} is set aside: no diagnosis can be computed with it. Check its values.",
    )


@dataclass(kw_only=True, eq=False)
class _Looking:
    """The search of records, as they are or with errors in their data corrected: a `DiagnosisSteps`.

    Attributes:
        problem: of the records as they are.
        effects: causes besides the catalogue.
        scanned: duration of the scan for errors in the data. [s]
        most: largest number of searches.
        done: number of searches so far.
        shown: the largest share of the work that was reported.
    """

    problem: Problem
    effects: tuple[Effect, ...]
    progress: Progress
    seen: Seen
    seed: int
    budget: str
    scanned: float
    most: int
    done: int = 0
    shown: float = 0.0

    def _report_progress(self, share: float, words: str) -> None:
        """Report the progress, which never decreases."""
        self.shown = max(self.shown, share)
        self.progress(self.shown, words)

    def start(self, records: Sequence[Logged]) -> Findings:
        """Return findings with the fit of records within wide tolerances."""
        low, self.done = self.done / self.most, self.done + 1
        search = Search(
            problem=posed_again(self.problem, records, self.effects),
            progress=lambda share, words: self._report_progress(low + share / self.most, words),
        )
        work = Findings(search=search, seed=self.seed, budget=self.budget)
        work.seconds["errors in the data"] = self.scanned
        seen = self.seen if self.done == 1 else lambda table: None
        _keeping_what_there_is(work, lambda: _fit_wide(work, seen))
        return work

    def begin(self, work: Findings, is_hopeless: Callable[[], bool] = lambda: False) -> None:
        """Do the first part, the screening; if it is hopeless, stop after explanations that are not in the catalogue,
        as one of them may still explain the records.
        """
        _keeping_what_there_is(work, lambda: _first_step(work, is_hopeless))

    def finish(self, work: Findings) -> None:
        """Do the remaining part."""
        if work.complete and self.budget != "screen":
            _keeping_what_there_is(work, lambda: _refine(work))


def _keeping_what_there_is(findings: Findings, part: Callable[[], None]) -> None:
    """Do a part; if it is interrupted, keep the results so far."""
    try:
        part()
    except KeyboardInterrupt:
        findings.complete = False
        if () not in findings.search.candidates:
            raise


@contextmanager
def _timed(findings: Findings, part: str) -> Iterator[None]:
    """Record the duration of a part."""
    started = perf_counter()
    yield
    findings.seconds[part] = findings.seconds.get(part, 0.0) + perf_counter() - started


def _concluded(findings: Findings) -> Verdict:
    known = ranked(findings)
    return conclude(findings, known, follow_up(findings, known))


def _fit_wide(findings: Findings, seen: Seen) -> None:
    """Fit within wide tolerances, measure the misfit, and report the detectability of causes."""
    search = findings.search
    with _timed(findings, "screen"):
        search.begin()
        _measure_misfit(findings)
        findings.detectable = detectability(
            findings.problem, with_whole_effects(findings.problem, search.nominal[1])
        )
        seen(findings.detectable)


def _first_step(findings: Findings, is_hopeless: Callable[[], bool]) -> None:
    """Screen all hypotheses, fit the best, and try explanations that are not in the catalogue where none of them
    explains the records.
    """
    search, explained = findings.search, False
    with _timed(findings, "screen"):
        if search.is_far and findings.budget != "screen":
            explained = _one_explains(findings)
            if not explained:
                _from_afar(findings)
                findings.given_up = is_hopeless()
            if findings.given_up:
                return
        if not search.is_far or not search.screen.far:
            search.screen_causes()
    if findings.budget == "screen":
        search.fit(())
        return
    with _timed(findings, "fits"):
        search.first_fits()
        findings.given_up = not explained and is_hopeless() and bool(findings.out_of_catalogue)
        if not findings.given_up:
            search.fit_from_nominal()
        if search.is_poor() and not findings.given_up:
            search.refine_first()
    if search.is_poor() and not findings.out_of_catalogue:
        _search_out_of_catalogue(findings, 0.6, "forces, and causes that begin in mid-trial")


def _refine(findings: Findings) -> None:
    """Fit until no fit improves, and try explanations that are not in the catalogue again."""
    search = findings.search
    if not is_explained(search, findings.out_of_catalogue):
        with _timed(findings, "fits"):
            search.refine_first()
            search.grow()
            search.settle()
        _search_out_of_catalogue(findings, 0.8, "forces that no cause explains")
    with _timed(findings, "outside"):
        findings.refuted = refuted_rivals(search)
        findings.sensitive = sensitive_runs(search.problem, search.best().fit.z)
        findings.out_of_catalogue = each_with_refitted_noise(search, findings.out_of_catalogue)
        _measure_misfit(findings)


def _search_out_of_catalogue(findings: Findings, share: float, words: str) -> None:
    findings.search.progress(share, words)
    with _timed(findings, "outside"):
        findings.out_of_catalogue = explanations_outside(findings.search)


def _measure_misfit(findings: Findings) -> None:
    """Compare the nominal simulation with the records, with the noise as it is estimated so far."""
    for record in findings.records:
        findings.misfit[record.name] = misfits(record, respond(record.setting, record.time, record.noise))


def _one_explains(findings: Findings) -> bool:
    """Fit single causes that are best in simulations of some sizes, and say whether one of them explains the records,
    within declared tolerances: then no force or change point is needed as a linearisation point.
    """
    findings.search.progress(0.2, "causes of any size")
    findings.search.only_nothing()
    findings.search.screen_causes()
    findings.search.fit_large_effects()
    return leaves_only_noise(findings) and not findings.search.is_poor()


def _from_afar(findings: Findings) -> None:
    """Fit a force or a change point, so that the simulation follows the records, and use that fit as the
    linearisation point.
    """
    search = findings.search
    search.progress(0.25, "forces, and causes that begin in mid-trial")
    aside = search.set_aside()
    findings.out_of_catalogue = explanations_outside(search)
    if findings.out_of_catalogue[0].point:
        search.relinearise_at(findings.out_of_catalogue[0].point.fit)
    search.take_back(aside)


def _on_records(
    records: Sequence[Logged],
    tried: Sequence[tuple[Explained, float]],
    conclude: Callable[[Findings], Verdict],
) -> Verdict:
    """Return the verdict on records that may have errors in their data.

    Args:
        records: as they are.
        tried: sets of errors that they may have, each with the explanation of the corrected records and its log
            evidence.
        conclude: makes the verdict on records from findings.
    """
    sets = sorted((trial for trial, _ in tried), key=lambda trial: len(trial.errors))
    total, logs = log_sum([log for _, log in tried]), {id(trial): log for trial, log in tried}
    each = np.exp([logs[id(trial)] - total for trial in sets])
    at_least = np.minimum(np.cumsum(each[::-1])[::-1], MOST)  # of a set, or of a larger one
    reported = max((i for i, trial in enumerate(sets) if _is_named(trial, at_least[i])), default=0)
    verdict = conclude(sets[reported].work)
    is_complete = all(trial.work.complete for trial in sets)
    if sets[reported].errors:
        is_decided = is_complete or not any(map(mimicked_by_physics, sets[reported].errors))
        verdict = _with_errors(
            verdict, records, sets[reported], float(at_least[reported]) if is_decided else None
        )
    verdict = replace(verdict, complete=is_complete)
    if reported + 1 == len(sets):
        return verdict
    return _with_possible(verdict, records, sets[reported], sets[reported + 1], float(at_least[reported + 1]))


def _is_named(explanation: Explained, probability: float) -> bool:
    """Say whether errors may be the verdict: they are probable, and the records without them are explained."""
    if probability < NAMED_PROBABILITY or not leaves_only_noise(explanation.work):
        return False
    return decided(explanation.work, ranked(explanation.work)) != NOTHING_NEAR


def _with_errors(
    after: Verdict, records: Sequence[Logged], explanation: Explained, probability: float | None
) -> Verdict:
    """Return the verdict `data_error`, with the diagnosis of the records without the errors; `undecided` where they
    could not be compared with all other explanations (None), as the diagnosis was interrupted.
    """
    share = EVEN if probability is None else probability
    errors = _reported(records, explanation.errors, share)
    curves = {
        name: replace(own, recorded=_recorded(records, explanation.errors, name))
        for name, own in after.curves.items()
    }
    listed = {
        _name_with_errors(explanation.errors, name): share * p for name, p in after.probabilities.items()
    }
    words = " ".join(f"{error.record}: {error.sentence}: {error.remedy}." for error in errors)
    return replace(
        after,
        verdict=UNDECIDED if probability is None else DATA_ERROR,
        data_errors=errors,
        then=after.verdict,
        sentence=f"{words} After that: {after.sentence}",
        probabilities=listed,
        curves=curves,
    )


def _recorded(
    records: Sequence[Logged], found: Sequence[SuspectedError], name: str
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return channel → times and values as a record has them, of channels with errors in their data."""
    return {
        channel: (records[suspect.record].record.time, records[suspect.record].record.values[channel])
        for suspect in found
        for channel in (() if suspect.error.is_of_commands else suspect.error.channels)
        if records[suspect.record].name == name
    }


def _with_possible(
    reported: Verdict, records: Sequence[Logged], less: Explained, more: Explained, probability: float
) -> Verdict:
    """Return a verdict with further errors in the data added as possible.

    Errors that would be probable enough, but may not be named, get a probability of at most one half.
    """
    if probability < WORTH_TELLING:
        return reported
    probability = min(probability, EVEN)
    known = {(error.record, error.error.id) for error in less.errors}
    further = [error for error in more.errors if (error.record, error.error.id) not in known]
    errors = _reported(records, further, probability)
    listed = {name: (1.0 - probability) * p for name, p in reported.probabilities.items()}
    listed[_name_with_errors(more.errors, "none")] = probability
    words = " and ".join(error.sentence for error in errors)
    rival = Rival(
        ids=tuple(error.id for error in errors),
        sentence=words,
        probability=probability,
        discrimination=np.nan,
    )
    drawn = _with_planted(
        reported.curves, records, more, further, f"rival: {_name_with_errors(more.errors, 'none')}"
    )
    rivals = tuple(sorted([*reported.rivals, rival], key=lambda each: -each.probability))
    ranked = dict(sorted(listed.items(), key=lambda pair: -pair[1]))
    with_rival = replace(
        reported,
        rivals=rivals,
        curves=drawn,
        probabilities=ranked,
        sentence=f"{reported.sentence} Or {words}.",
        data_errors=reported.data_errors or errors,
    )
    if probability <= 1.0 - NAMED_PROBABILITY or reported.on_model == NOTHING_NEAR:
        return with_rival
    return replace(with_rival, then=UNDECIDED) if reported.then else replace(with_rival, verdict=UNDECIDED)


def _with_planted(
    shown: Mapping[str, Curves],
    records: Sequence[Logged],
    more: Explained,
    further: Sequence[SuspectedError],
    label: str,
) -> dict[str, Curves]:
    """Return record → curves, with the explanation of the records without further errors added, as it would be
    recorded with these.
    """
    found, made = dict(shown), curves(more.work.problem, {label: more.work.search.best().fit})
    for i, record in enumerate(records):
        own = made[record.name]
        logged = replace(record, record=Record(source="", time=own.time, values=own.models[label]))
        for suspect in further:
            logged = suspect.error.planted(logged) if suspect.record == i else logged
        time, values = logged.record.time, logged.record.values
        model = {name: np.interp(shown[record.name].time, time, column) for name, column in values.items()}
        found[record.name] = replace(shown[record.name], models={**shown[record.name].models, label: model})
    return found


def _name_with_errors(found: Sequence[SuspectedError], name: str) -> str:
    """Return the name of an explanation with errors in the data added to it."""
    ids = dict.fromkeys(trial.error.id for trial in found)
    return " + ".join([*ids, *([] if name == "none" else [name])])


def _reported(
    records: Sequence[Logged], found: Sequence[SuspectedError], probability: float
) -> tuple[FoundError, ...]:
    return tuple(
        FoundError(
            id=trial.error.id,
            record=records[trial.record].name,
            columns=trial.error.columns,
            sentence=trial.error.sentence(),
            remedy=trial.error.remedy(),
            probability=probability,
            amount=trial.error.amount,
            amount_sd=trial.error.amount_sd,
            since=trial.error.since,
            alike=tuple(_words(each) for each in trial.alike),
        )
        for trial in found
    )


def _words(error: DataError) -> str:
    return f"{error.sentence()}: {error.remedy()}"
