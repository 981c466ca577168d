"""`subzero.diagnose`: from files or records to a verdict.

records, trials → detectability → model → search (`subzero.identification`) → verdict, extended model, next trial
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from subzero import identification
from subzero.arguments import checked_arguments
from subzero.channels import BY_NAME
from subzero.diagnosis.assessment import detectability, with_whole_effects
from subzero.diagnosis.hypothesis.catalogue import SPECS, load, with_own
from subzero.diagnosis.hypothesis.effect import Effect
from subzero.diagnosis.hypothesis.logged import NO_RECORD, Logged
from subzero.diagnosis.hypothesis.noise import level_of
from subzero.diagnosis.inference import Progress, pose, respond
from subzero.diagnosis.read_trials import read_trials
from subzero.diagnosis.results import Detectability, Verdict
from subzero.diagnosis.vehicle_model import Effects, vehicle_model
from subzero.diagnosis.verdict import Asked, concluded
from subzero.errors import UserError, chosen, whole
from subzero.model import Model
from subzero.records.record import Record

BUDGETS = ("screen", "verdict", "full")
"""Linear evidence only; up to the verdict and the extended model; with gain and next trial."""

SEARCH_S = 120.0
"""Processor time of a search, if no other is given. [s]"""

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
        seconds: of processor time, after which the search is ended, and says so; for a model of your own without a
            limit if not given. [s]

    Raises:
        UserError: a record, a sidecar or an effects file cannot be used.
        scenarios.ScenarioError: the scenario cannot be used.
    """
    if isinstance(model, identification.Model):
        return _of_own_model(records, model, held_out, seconds, progress)
    own = load(effects) if isinstance(effects, str | Path) else tuple(effects)
    logged = _logged([records] if isinstance(records, Given) else records, model, commands)
    return diagnose_trials(logged, effects=own, progress=progress, seed=seed, budget=budget, seconds=seconds)


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
    seconds: float | None = None,
) -> Verdict:
    """Say what the nominal models of some records get wrong, and why.

    Args:
        records: of one vehicle, each with its trial.
        effects: causes besides the catalogue.
        progress: called with the fraction that is done, and a description of the current step.
        seen: called with the detectability of causes, before the records are searched.
        seed: of all random numbers.
        budget: one of BUDGETS.
        seconds: of processor time, after which the search is ended, and says so; SEARCH_S if not given. [s]

    Raises:
        UserError: no record, seed, budget or time; the nominal model cannot be run through a trial.
    """
    if not records:
        raise UserError(NO_RECORD)
    whole("seed", seed)
    chosen(dict.fromkeys(BUDGETS), budget, "budget")
    if seconds is not None and not seconds > 0.0:
        raise UserError(f"diagnose: seconds is {seconds!r}; it must be greater than 0.")
    effects = with_own(effects, records[0].setting.model.vehicle)
    asked: dict[str, Any] = {
        "effects": effects,
        "progress": progress,
        "seen": seen,
        "seed": seed,
        "budget": budget,
        "seconds": SEARCH_S if seconds is None else seconds,
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
    seconds: float,
) -> Verdict:
    """Diagnose records, all of whose channels can be used."""
    began, report = perf_counter(), Steady(progress or (lambda share, words: None))
    known = Effects.of([each.setting for each in records], _channels(records), effects)
    asked = Asked(
        records=records,
        effects=effects,
        onsets={**known.onsets, **{id: effect for id, effect in known.throughout.items() if effect.sudden}},
        budget=budget,
        seed=seed,
        progress=report,
    )
    with threadpool_limits(limits=1, user_api="blas"):  # simulations use the cores; matrices are small
        detectable = _detectable(records, effects)
        if seen:
            seen(detectable)
        model, own = vehicle_model(records, effects=effects)
        searched = perf_counter()
        outcome = identification.api.outcome(
            own, model, progress=report, seconds=seconds, screen=budget == "screen"
        )
        concluding = perf_counter()
        verdict = concluded(asked, outcome, detectable)
    parts = {
        "detectability": searched - began,
        "search": concluding - searched,
        "conclusion": perf_counter() - concluding,
    }
    return replace(verdict, seconds=parts)


@dataclass
class Steady:
    """A progress that never decreases."""

    progress: Progress
    most: float = 0.0

    def __call__(self, share: float, words: str) -> None:
        """Report a share that is done, and the present step."""
        self.most = max(self.most, share)
        self.progress(self.most, words)


def _channels(records: Sequence[Logged]) -> list[str]:
    """Return the channels of some records that can be diagnosed."""
    return list(dict.fromkeys(name for each in records for name in each.record.values if name in SPECS))


def _detectable(records: Sequence[Logged], effects: tuple[Effect, ...]) -> tuple[Detectability, ...]:
    """Return the detectability of causes in records, with usual noise, around the nominal model."""
    problem = pose(records, effects)
    J = problem.jacobian(np.zeros(len(problem.entries)))
    return detectability(problem, with_whole_effects(problem, J))


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
