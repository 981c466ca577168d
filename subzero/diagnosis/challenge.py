"""Hide an effect in a record, drawn from a seed; sealed, so that nobody reads it by accident.

The truth comes from the other cable formulation (`other_code`), with every number drawn from its tolerance. Noise is
coloured, with outliers and gaps.
"""

from __future__ import annotations

import base64
import csv
import hashlib
import json
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import scenarios
from subzero.channels import TIME, column_name
from subzero.diagnosis.effect import Effect
from subzero.diagnosis.effects import START, catalogue
from subzero.diagnosis.effects.sensors import NOISE
from subzero.diagnosis.hidden import Hidden, draw_deviations, draw_effect, hide
from subzero.diagnosis.other_code import NoTruthError, simulate_otherwise
from subzero.diagnosis.outside import draw_outside
from subzero.diagnosis.setting import Setting
from subzero.diagnosis.told import TOLD
from subzero.errors import UserError
from subzero.measured import Record
from subzero.model import Model
from subzero.trials import load

BASIC = ("surge_speed", "heading", "yaw_rate", "pitch", "roll", "depth")
"""Channels that a challenge measures."""
SAMPLE = 0.1
"""Time between samples. [s]"""
ODDS = {"none": 0.2, "single": 0.4, "sudden": 0.1, "pair": 0.15, "outside": 0.15}
"""What is hidden, how often."""
OUTLIER = (8.0, 25.0)
"""Outliers lie so many noise levels off."""
SEALED = "answer.sealed"

Simulate = Callable[[Setting, np.ndarray, Iterable[str]], Mapping[str, np.ndarray]]


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What is hidden.

    Attributes:
        kind: one of ODDS.
        names: as `Hidden.names`; empty for nothing.
        sentences: the same in words.
        deviations: effect id → parameter → deviation.
        starts: effect id → when it begins. [s]
        axis, feature: of a force outside the catalogue.
        tolerances: effect id → deviations that were drawn within the tolerances.
        scenario, seed: what was asked for.
    """

    kind: str
    names: tuple[str, ...] = ()
    sentences: tuple[str, ...] = ()
    deviations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    starts: Mapping[str, float] = field(default_factory=dict)
    axis: str = ""
    feature: str = ""
    tolerances: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    scenario: str = ""
    seed: int = 0

    def __str__(self) -> str:
        """Return the answer in words."""
        if not self.names:
            return "Nothing is wrong: every number is within its tolerance."
        lines = [f"{name}: {words}" for name, words in zip(self.names, self.sentences, strict=True)]
        for key, values in self.deviations.items():
            at = f", from t = {self.starts[key]:g} s on" if key in self.starts else ""
            sizes = ", ".join(f"{name} {value:+.4g}" for name, value in values.items())
            lines.append(f"  {key} differs from the model by {sizes}{at}")
        if self.axis:
            lines.append(f"  on the axis {self.axis}" + (f", with {self.feature}" if self.feature else ""))
        return "\n".join(lines)


@dataclass(frozen=True, kw_only=True)
class Challenge:
    """A record, the trial with the nominal model, what is true, and what is hidden."""

    record: Record
    nominal: Setting
    true: Setting
    hidden: Hidden
    answer: Answer


def make_record(
    setting: Setting,
    times: np.ndarray,
    channels: Iterable[str],
    *,
    seed: int | np.random.Generator,
    noise: Mapping[str, float] | float = 1.0,
    rho: float = 0.5,
    outliers: float = 0.01,
    missing: float = 0.02,
    dropout: float = 0.0,
    quantum: Mapping[str, float] | None = None,
    simulate: Simulate = simulate_otherwise,
    source: str = "simulated",
) -> Record:
    """Return what is measured in a setting.

    Args:
        setting: the truth.
        times: of the samples (n,). [s]
        channels: names of `subzero.channels`.
        seed: of the noise.
        noise: channel → standard deviation in its display unit, or a factor on that of usual sensors.
        rho: correlation of the noise from sample to sample.
        outliers: share of samples far off.
        missing: share of samples that are not there.
        dropout: length of a gap in every channel, somewhere. [s]
        quantum: channel → smallest step that its sensor shows.
        simulate: what gives the truth.
        source: of the record, in words.
    """
    rng, channels = np.random.default_rng(seed), tuple(channels)
    factor = noise if isinstance(noise, float | int) else 1.0
    levels = {
        **{name: factor * level for name, level in NOISE.items()},
        **(noise if isinstance(noise, Mapping) else {}),
    }
    truth, values = simulate(setting, times, channels), {}
    for name in channels:
        shown = truth[name] + levels[name] * _coloured(rng, times.size, rho)
        far = rng.random(times.size) < outliers
        shown += far * rng.choice([-1.0, 1.0], times.size) * rng.uniform(*OUTLIER, times.size) * levels[name]
        step = (quantum or {}).get(name, 0.0)
        shown = np.round(shown / step) * step if step > 0.0 else shown
        gone = rng.random(times.size) < missing
        begins = rng.uniform(0.0, max(times[-1] - dropout, 0.0))
        gone |= (dropout > 0.0) & (times >= begins) & (times < begins + dropout)
        values[name] = np.where(gone, np.nan, shown)
    return Record(source=source, time=times, values=values)


def _coloured(rng: np.random.Generator, n: int, rho: float) -> np.ndarray:
    """Return AR(1) noise of level one."""
    white, out = rng.normal(size=n), np.zeros(n)
    out[0] = white[0]
    for k in range(1, n):
        out[k] = rho * out[k - 1] + np.sqrt(1.0 - rho * rho) * white[k]
    return out


def draw_hidden(
    nominal: Setting, effects: Mapping[str, Effect], seed: int | np.random.Generator, kind: str | None = None
) -> Hidden:
    """Return something to hide, of a kind of ODDS or of any; each effect as likely as any other."""
    rng = np.random.default_rng(seed)
    kind = kind or str(rng.choice(list(ODDS), p=list(ODDS.values())))
    if kind == "none":
        return Hidden()
    if kind == "outside":
        return Hidden(outside=draw_outside(nominal, rng))
    ids = [key for key, effect in sorted(effects.items()) if effect.sudden or kind != "sudden"]
    chosen = [str(key) for key in rng.choice(ids, 2 if kind == "pair" else 1, replace=False)]
    drawn = {key: draw_effect(effects[key], rng) for key in chosen}
    begins = float(np.round(rng.uniform(0.3, 0.6) * nominal.trial.duration))
    return Hidden(effects=drawn, starts={chosen[0]: begins} if kind == "sudden" else {})


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
        scenario: what is flown.
        seed: draws everything.
        folder: for ``record.csv``, ``record.toml`` and the sealed answer.
        kind: what to hide, one of ODDS; drawn if None.
        spread: of the true numbers, in tolerances.

    Raises:
        UserError: there is no truth for anything that was drawn.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    nominal, effects = Setting(trial=trial, model=Model.of(trial)), catalogue(BASIC)
    both = (*effects.values(), *START)
    times = np.arange(0.0, trial.duration + 1e-9, SAMPLE)
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


def _answer(
    hidden: Hidden,
    effects: Mapping[str, Effect],
    tolerances: Mapping[str, tuple[float, ...]],
    scenario: str,
    seed: int,
) -> Answer:
    """Return what is hidden, ready to be told."""
    outside = hidden.outside
    kind = (
        "outside"
        if outside
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
        sentences=words + ((outside.sentence,) if outside else ()),
        deviations=named,
        starts=dict(hidden.starts),
        axis=outside.axis if outside else "",
        feature=outside.feature if outside else "",
        tolerances=dict(tolerances),
        scenario=scenario,
        seed=seed,
    )


def write(made: Challenge, folder: Path, scenario: str | Path | scenarios.Trial) -> None:
    """Write the record with its commands, what is known of it, and the sealed answer."""
    folder.mkdir(parents=True, exist_ok=True)
    _write_csv(made, folder / "record.csv")
    lines = [f'source = "{made.record.source}"', 'surge_speed = "water"']
    if not isinstance(scenario, scenarios.Trial):
        where = str(Path(scenario).resolve()) if Path(scenario).suffix == ".toml" else str(scenario)
        lines.append(f"scenario = {json.dumps(where)}")
    (folder / "record.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / SEALED).write_text(seal(made.answer), encoding="utf-8")


def _write_csv(made: Challenge, path: Path) -> None:
    """Write channels and commands; a gap is an empty cell."""
    record, commands = made.record, made.nominal.trial.commands
    columns = {column_name(TIME.name): record.time} | {column_name(k): v for k, v in record.values.items()}
    if commands is not None:
        rows = np.searchsorted(commands.time, record.time + 1e-9, side="right") - 1
        told = commands.values[rows]
        scales = [scale for _, _, scale in TOLD.values()]
        columns |= {column_name(name): told[:, i] * scales[i] for i, name in enumerate(TOLD)}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow("" if np.isnan(cell) else f"{cell:.7g}" for cell in row)


def seal(answer: Answer) -> str:
    """Return an answer that nobody reads by accident, with its hash."""
    text = json.dumps(asdict(answer)).encode()
    packed = base64.b64encode(zlib.compress(text)).decode()
    return json.dumps({"sha256": hashlib.sha256(text).hexdigest(), "sealed": packed}, indent=1) + "\n"


def reveal(folder: str | Path) -> Answer:
    """Return what is hidden in the record of a folder.

    Raises:
        UserError: there is no sealed answer, or it has been changed.
    """
    path = Path(folder) / SEALED
    if not path.is_file():
        raise UserError(
            f"There is no sealed answer '{path}'. Allowed: a folder made by subzero challenge --out FOLDER."
        )
    try:
        sealed: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        text = zlib.decompress(base64.b64decode(sealed["sealed"]))
        intact = hashlib.sha256(text).hexdigest() == sealed["sha256"]
    except (ValueError, KeyError, TypeError, zlib.error):
        intact = False
    if not intact:
        raise UserError(
            f"The sealed answer '{path}' has been changed. Make the challenge again from its seed."
        )
    said: dict[str, Any] = json.loads(text)
    said |= {key: tuple(said[key]) for key in ("names", "sentences")}
    return Answer(**said)
