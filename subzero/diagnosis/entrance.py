"""The way in for a user: `subzero.diagnose` takes files or records, and a scenario or a model."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

from subzero.diagnosis.effect import Effect
from subzero.diagnosis.effects import load
from subzero.diagnosis.logged import Logged
from subzero.diagnosis.records import read_trials
from subzero.diagnosis.verdict import Detectability, Verdict
from subzero.model import Model

Given = Logged | str | Path
Progress = Callable[[float, str], None]
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
    seen: Seen | None = None,
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
        seen: told what the records can show, before they are looked at.

    Raises:
        UserError: a record, a sidecar or an effects file cannot be used.
        scenarios.ScenarioError: the scenario cannot be used.
    """
    from subzero.diagnosis.diagnose import diagnose as engine

    own = load(effects) if isinstance(effects, str | Path) else tuple(effects)
    logged = _logged([records] if isinstance(records, Logged | str | Path) else records, model, commands)
    return engine(logged, effects=own, progress=progress, seed=seed, budget=budget, seen=seen)


def _logged(records: Sequence[Given], model: str | Path | Model | None, commands: str | None) -> list[Logged]:
    """Return records with their trials, and with another nominal model if one is given."""
    scenario = None if isinstance(model, Model) else model
    found = [record for record in records if isinstance(record, Logged)]
    paths = [record for record in records if not isinstance(record, Logged)]
    found += read_trials(paths, scenario=scenario, commands=commands) if paths else []
    if not isinstance(model, Model):
        return found
    return [dataclasses.replace(one, setting=dataclasses.replace(one.setting, model=model)) for one in found]
