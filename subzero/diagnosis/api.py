"""`subzero.diagnose`: from files or records to a verdict, and the order in which the engine does its parts.

    problem → detectability → residuals → model search → out of catalogue → verdict → extended model, gain, next trial

If even wide priors (κ = 4) do not come close to the records, or the first fits are all poor, explanations outside the
catalogue are asked first: an estimated input force takes the simulation along the records, where linearisation is
accurate, and a change point that explains them ends the search.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from time import perf_counter

from threadpoolctl import threadpool_limits

from subzero.diagnosis.assessment.identifiability import detectability, with_whole_effects
from subzero.diagnosis.assessment.residuals import misfits
from subzero.diagnosis.hypothesis.catalogue import load
from subzero.diagnosis.hypothesis.effect import Effect
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.model_search import Search
from subzero.diagnosis.inference.out_of_catalogue import Findings, explanations_outside, is_explained
from subzero.diagnosis.inference.posing import pose
from subzero.diagnosis.inference.problem import Progress
from subzero.diagnosis.inference.simulator import respond
from subzero.diagnosis.read_trials import read_trials
from subzero.diagnosis.results import Detectability, Verdict
from subzero.diagnosis.verdict.conclude import conclude
from subzero.diagnosis.verdict.follow_up import follow_up, ranked, refuted_rivals
from subzero.model import Model

BUDGETS = ("screen", "verdict", "full")
"""Linear evidence only; up to the verdict and the extended model; with gain and next trial."""

Given = Logged | str | Path
Seen = Callable[[tuple[Detectability, ...]], None]


def diagnose(
    records: Given | Sequence[Given],
    model: str | Path | Model | None = None,
    *,
    effects: str | Path | Sequence[Effect] = (),
    commands: str | None = None,
    progress: Progress | None = None,
    seed: int = 0,
    budget: str = "full",
) -> Verdict:
    """Say what a simulation gets wrong, name the cause, extend the model and measure the gain.

        >>> verdict = subzero.diagnose("record.csv", "fig6")
        >>> verdict.verdict, [cause.id for cause in verdict.causes]
        ('cause_named', ['rudder_lag'])

    Args:
        records: CSV files, folders of them, or `Logged` of `read_trials`; several are fitted together.
        model: the scenario that was flown (sidecars may name their own), or another nominal model.
        effects: causes of your own besides the catalogue: a Python file with EFFECTS, or the effects.
        commands: "record" or "scenario", if a record's commands may differ from the scenario's.
        progress: told the fraction that is done, and what is being tried.
        seed: of everything random.
        budget: "full", "verdict" without gain and next trial, or "screen" for the first look of a few seconds.

    Raises:
        UserError: a record, a sidecar or an effects file cannot be used.
        scenarios.ScenarioError: the scenario cannot be used.
    """
    own = load(effects) if isinstance(effects, str | Path) else tuple(effects)
    logged = _logged([records] if isinstance(records, Logged | str | Path) else records, model, commands)
    return diagnose_trials(logged, effects=own, progress=progress, seed=seed, budget=budget)


def _logged(records: Sequence[Given], model: str | Path | Model | None, commands: str | None) -> list[Logged]:
    """Return records with their trials, and with another nominal model if one is given."""
    scenario = None if isinstance(model, Model) else model
    found = [record for record in records if isinstance(record, Logged)]
    paths = [record for record in records if not isinstance(record, Logged)]
    found += read_trials(paths, scenario=scenario, commands=commands) if paths else []
    if not isinstance(model, Model):
        return found
    return [dataclasses.replace(one, setting=dataclasses.replace(one.setting, model=model)) for one in found]


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
        progress: told the fraction that is done, and what is being tried.
        seen: told what the records can show, before they are looked at.
        seed: of everything random.
        budget: one of BUDGETS.

    Raises:
        UserError: the nominal model cannot be run through a trial.
    """
    problem = pose(records, effects)
    search = Search(problem=problem, progress=progress or (lambda share, words: None))
    findings = Findings(search=search, seed=seed, budget=budget)
    try:
        with threadpool_limits(limits=1, user_api="blas"):  # runs have the cores; matrices are small
            _find(findings, seen or (lambda table: None))
    except KeyboardInterrupt:
        findings.complete = False
        if () not in search.candidates:
            raise
    known = ranked(findings)
    return conclude(findings, known, follow_up(findings, known))


def _find(findings: Findings, seen: Seen) -> None:
    """Do all parts in turn, and keep their times."""
    search, start = findings.search, perf_counter()

    def done(part: str) -> None:
        findings.seconds[part] = perf_counter() - start - sum(findings.seconds.values())

    search.begin()
    _measure_misfit(findings)
    findings.detectable = detectability(
        findings.problem, with_whole_effects(findings.problem, search.nominal[1])
    )
    seen(findings.detectable)
    if search.is_far and findings.budget != "screen":
        _from_afar(findings)
    search.look()
    done("screen")
    if findings.budget == "screen":
        search.fit(())
        return
    search.first_fits()
    if search.is_poor() and not findings.out_of_catalogue:
        search.progress(0.6, "forces, and causes that begin in mid-trial")
        findings.out_of_catalogue = explanations_outside(search)
    if not is_explained(search, findings.out_of_catalogue):
        search.refine_first()
        search.grow()
        search.settle()
        done("fits")
        search.progress(0.8, "forces that no cause explains")
        findings.out_of_catalogue = explanations_outside(search)
    findings.refuted = refuted_rivals(search)
    _measure_misfit(findings)
    done("outside")


def _measure_misfit(findings: Findings) -> None:
    """Set the nominal simulation beside the records, with the noise as it is known by now."""
    for one in findings.problem.records:
        findings.misfit[one.name] = misfits(one, respond(one.setting, one.time, one.noise))


def _from_afar(findings: Findings) -> None:
    """Let a force, or a cause that begins in mid-trial, take the run along the records, and look from there."""
    findings.search.progress(0.2, "forces, and causes that begin in mid-trial")
    findings.search.only_nothing()
    findings.out_of_catalogue = explanations_outside(findings.search)
    if findings.out_of_catalogue[0].point:
        findings.search.go_near(findings.out_of_catalogue[0].point.fit)
