"""Hide an effect in a record, drawn from a seed: every number from its tolerance, and the effect among them."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import scenarios
from scenarios.heading import TURN
from scenarios.steps import sample_times
from subzero.arguments import checked_arguments
from subzero.channels import HEADING, TIME, column_name
from subzero.diagnosis.hypothesis.catalogue import START, catalogue, with_own
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect
from subzero.diagnosis.hypothesis.hypotheses import is_absent, moves_nothing, with_tolerances
from subzero.errors import UserError, checked, chosen, printable, whole
from subzero.model import Model, load
from subzero.records.consistency import REPORTED_COMMANDS
from subzero.records.record import Record
from subzero.synthetic.planted import Hidden, draw_deviations, draw_effect, hide, make_record
from subzero.synthetic.reference_run import NoTruthError
from subzero.synthetic.sealed_answer import SEALED, Answer, seal
from subzero.synthetic.unmodelled_forces import draw_unmodelled

BASIC = ("surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth")
"""Channels that a challenge measures."""
SAMPLE_S = 0.1
"""Time between samples. [s]"""
KIND_PROBABILITIES = {"none": 0.2, "single": 0.4, "sudden": 0.1, "pair": 0.15, "outside": 0.15}
"""Kind of hidden effect → its probability."""


@dataclass(frozen=True, kw_only=True)
class Challenge:
    """A record, the trial with the nominal model, the true setting, and the hidden effects."""

    record: Record
    nominal: Setting
    true: Setting
    hidden: Hidden
    answer: Answer


def draw_hidden(
    nominal: Setting, effects: Mapping[str, Effect], seed: int | np.random.Generator, kind: str | None = None
) -> Hidden:
    """Return something to hide, of a kind of KIND_PROBABILITIES or of any; each effect as likely as any other."""
    rng = np.random.default_rng(seed)
    kind = kind or str(rng.choice(list(KIND_PROBABILITIES), p=list(KIND_PROBABILITIES.values())))
    if kind == "none":
        return Hidden()
    if kind == "outside":
        return Hidden(unmodelled=draw_unmodelled(nominal, rng))
    ids = [key for key, effect in sorted(effects.items()) if effect.sudden or kind != "sudden"]
    chosen = [str(key) for key in rng.choice(ids, 2 if kind == "pair" else 1, replace=False)]
    drawn = {key: draw_effect(effects[key], rng) for key in chosen}
    begins = float(np.round(rng.uniform(0.3, 0.6) * nominal.trial.duration))
    return Hidden(effects=drawn, starts={chosen[0]: begins} if kind == "sudden" else {})


@checked_arguments
def challenge(
    scenario: str | Path | scenarios.Trial = "fig6",
    seed: int = 0,
    folder: str | Path | None = None,
    *,
    kind: str | None = None,
    spread: float = 1.0,
) -> Challenge:
    """Return a record with something hidden in it, drawn from a seed; written to a folder if one is given.

    Args:
        scenario: the scenario to fly.
        seed: draws everything.
        folder: for ``record.csv``, ``record.toml`` and the sealed answer.
        kind: the kind of effect to hide, one of KIND_PROBABILITIES; drawn if None.
        spread: of the true numbers, in tolerances.

    Raises:
        UserError: the motion is prescribed, or there is no truth for anything that was drawn.
    """
    whole("challenge: seed", seed)
    checked("challenge", "spread", spread, least=0.0)
    if kind is not None:
        chosen(KIND_PROBABILITIES, kind, "kind of challenge")
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    if trial.commands is None and trial.station is None:
        raise UserError(
            f"The scenario {trial.name} prescribes the motion: whatever is wrong, the vehicle moves alike. "
            "Take one that commands its vehicle, such as fig6."
        )
    nominal = Setting(trial=trial, model=Model.of(trial))
    effects = _possible(nominal)
    both = (*effects.values(), *START)
    times = sample_times(trial.duration, SAMPLE_S)
    for attempt in range(10):
        rng = np.random.default_rng([seed, attempt])
        hidden, tolerances = draw_hidden(nominal, effects, rng, kind), draw_deviations(both, rng, spread)
        true = hide(nominal, both, tolerances, hidden)
        try:
            record = make_record(true, times, BASIC, seed=rng, source=f"challenge {seed} on {trial.name}")
        except NoTruthError:
            continue
        answer = _answer(hidden, effects, tolerances, str(trial.name), seed)
        made = Challenge(record=record, nominal=nominal, true=true, hidden=hidden, answer=answer)
        if folder is not None:
            write(made, Path(folder), scenario)
        return made
    raise UserError(f"Nothing that seed {seed} draws can be flown on '{trial.name}'. Try another seed.")


def _possible(nominal: Setting) -> dict[str, Effect]:
    """Return the effects that can be hidden in a trial, those of the lists of its vehicle among them."""
    known = catalogue(BASIC, with_own((), nominal.model.vehicle))
    return {
        key: with_tolerances(effect, nominal)
        for key, effect in known.items()
        if not is_absent(effect, nominal) and not moves_nothing(effect, nominal)
    }


def _answer(
    hidden: Hidden,
    effects: Mapping[str, Effect],
    tolerances: Mapping[str, tuple[float, ...]],
    scenario: str,
    seed: int,
) -> Answer:
    """Return the hidden effects as an answer in words."""
    unmodelled = hidden.unmodelled
    kind = (
        "outside"
        if unmodelled
        else ("sudden" if hidden.starts else ("none", "single", "pair")[len(hidden.effects)])
    )
    named = {
        key: dict(zip((p.name for p in effects[key].parameters), values, strict=True))
        for key, values in hidden.effects.items()
    }
    words = tuple(effects[key].sentence for key in hidden.effects)
    return Answer(
        kind=kind,
        names=hidden.names,
        sentences=words + ((unmodelled.sentence,) if unmodelled else ()),
        deviations=named,
        starts=dict(hidden.starts),
        axis=unmodelled.axis if unmodelled else "",
        feature=unmodelled.feature if unmodelled else "",
        tolerances=dict(tolerances),
        scenario=scenario,
        seed=seed,
    )


def write(made: Challenge, folder: Path, scenario: str | Path | scenarios.Trial) -> None:
    """Write the record with its commands, its metadata, and the sealed answer."""
    folder.mkdir(parents=True, exist_ok=True)
    _write_csv(made, folder / "record.csv")
    lines = [f"source = {json.dumps(made.record.source, ensure_ascii=False)}", 'surge_speed = "water"']
    if not isinstance(scenario, scenarios.Trial):
        where = str(Path(scenario).resolve()) if Path(scenario).suffix == ".toml" else str(scenario)
        if printable(where) != where:
            raise UserError(
                f"A sidecar cannot name the scenario {printable(where)}. Give the file a plain name."
            )
        lines.append(f"scenario = {json.dumps(where, ensure_ascii=False)}")
    (folder / "record.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / SEALED).write_text(seal(made.answer), encoding="utf-8")


def _write_csv(made: Challenge, path: Path) -> None:
    """Write channels and commands; a gap is an empty cell, and a compass shows 0 to 360 degrees."""
    record, commands = made.record, made.nominal.trial.commands
    shown = {**record.values, HEADING: record.values[HEADING] % TURN}
    columns = {column_name(TIME.name): record.time} | {column_name(k): v for k, v in shown.items()}
    if commands is not None:
        reported = commands.at(record.time)
        scales = [scale for _, _, scale in REPORTED_COMMANDS.values()]
        columns |= {column_name(name): reported[:, i] * scales[i] for i, name in enumerate(REPORTED_COMMANDS)}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow("" if np.isnan(cell) else f"{cell:.7g}" for cell in row)
