"""Effects planted in a record: deviations within tolerance, effects on top of them; and the record as sensors write
it.

The truth comes from the other cable formulation (`reference_run`); noise is AR(1), with outliers, rounding and gaps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from subzero.diagnosis.hypothesis.catalogue.sensors import NOISE
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter
from subzero.records.record import Record
from subzero.synthetic.reference_run import simulate_reference
from subzero.synthetic.unmodelled_forces import UnmodelledForce

Deviations = Mapping[str, tuple[float, ...]]
"""Effect id → a deviation for each of its parameters."""

MIN_EFFECT_SCALES, MAX_EFFECT_SCALES = 0.5, 2.0
"""Sizes of effects, in their scales."""
MAX_DRAWS = 1000


@dataclass(frozen=True, kw_only=True)
class Hidden:
    """The faults of a vehicle.

    Attributes:
        effects: effect id → deviations, on top of what the tolerances draw.
        starts: effect id → when it begins, of those that begin in mid-run. [s]
        unmodelled: a force that is not in the catalogue.
    """

    effects: Deviations = field(default_factory=dict)
    starts: Mapping[str, float] = field(default_factory=dict)
    unmodelled: UnmodelledForce | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names as in a diagnosis: ids, ``<id>@t`` for one that begins in mid-run, ``outside:<kind>``."""
        ids = tuple(f"{key}@t" if key in self.starts else key for key in self.effects)
        return ids + ((f"outside:{self.unmodelled.name}",) if self.unmodelled else ())


def draw_deviations(
    effects: Iterable[Effect], seed: int | np.random.Generator, spread: float = 1.0
) -> dict[str, tuple[float, ...]]:
    """Return a deviation of every parameter, normal with its tolerance times `spread`, within its bounds."""
    rng = np.random.default_rng(seed)
    ordered = sorted(effects, key=lambda effect: effect.id)
    return {e.id: tuple(_within(rng, p, spread * p.tolerance) for p in e.parameters) for e in ordered}


def draw_tolerances(
    setting: Setting, effects: Iterable[Effect], seed: int | np.random.Generator, spread: float = 1.0
) -> Setting:
    """Return a healthy vehicle: every number of these effects anywhere within its tolerance times `spread`."""
    effects = tuple(effects)
    return apply_all(setting, effects, draw_deviations(effects, seed, spread))


def draw_effect(
    effect: Effect, seed: int | np.random.Generator, size: float | None = None
) -> tuple[float, ...]:
    """Return deviations of an effect: its size in scales, drawn if not given, either sign where bounds allow it."""
    rng = np.random.default_rng(seed)
    drawn = float(np.exp(rng.uniform(np.log(MIN_EFFECT_SCALES), np.log(MAX_EFFECT_SCALES))))
    direction = rng.normal(size=len(effect.parameters))
    direction /= np.linalg.norm(direction)
    scaled = (drawn if size is None else size) * direction
    return tuple(_allowed(p, float(x * p.scale)) for p, x in zip(effect.parameters, scaled, strict=True))


def apply_all(setting: Setting, effects: Iterable[Effect], *deviations: Deviations) -> Setting:
    """Return the setting with the sums of some deviations; sums are kept within the bounds."""
    for effect in sorted(effects, key=lambda each: each.id):
        rows = [deviation[effect.id] for deviation in deviations if effect.id in deviation]
        if rows:
            total = np.sum(rows, axis=0)
            bounded = (min(max(x, p.low), p.high) for x, p in zip(total, effect.parameters, strict=True))
            setting = effect.apply(setting, *bounded)
    return setting


def hide(setting: Setting, effects: Iterable[Effect], tolerances: Deviations, hidden: Hidden) -> Setting:
    """Return the true setting: the nominal one with the tolerances drawn and the hidden effects."""
    effects = tuple(effects)
    at_once = {key: value for key, value in hidden.effects.items() if key not in hidden.starts}
    true = apply_all(setting, effects, tolerances, at_once)
    if hidden.starts:
        models = []
        for time in sorted(set(hidden.starts.values())):
            started = {key: hidden.effects[key] for key, at in hidden.starts.items() if at <= time}
            models.append((time, apply_all(setting, effects, tolerances, at_once, started).model))
        true = replace(true, later=tuple(models))
    return hidden.unmodelled.apply(true) if hidden.unmodelled else true


def _within(rng: np.random.Generator, parameter: Parameter, tolerance: float) -> float:
    """Return a normal deviation within the bounds."""
    for _ in range(MAX_DRAWS):
        drawn = float(rng.normal(0.0, tolerance))
        if parameter.low <= drawn <= parameter.high:
            return drawn
    return 0.0


def _allowed(parameter: Parameter, deviation: float) -> float:
    """Return a deviation, with the other sign if its bounds do not allow this one."""
    if not parameter.low <= deviation <= parameter.high:
        deviation = -deviation
    return min(max(deviation, parameter.low), parameter.high)


OUTLIER = (8.0, 25.0)
"""Outliers lie so many noise levels off."""


@dataclass(frozen=True, kw_only=True)
class SensorErrors:
    """The errors that sensors and their logger add to a true value.

    Attributes:
        noise: channel → standard deviation in its display unit, or a factor on that of usual sensors.
        rho: correlation of the noise from sample to sample.
        outliers: share of samples far off.
        missing: share of samples that are not there.
        dropout: length of a gap in every channel, somewhere. [s]
        quantum: channel → smallest step that its sensor shows.
    """

    noise: Mapping[str, float] | float = 1.0
    rho: float = 0.5
    outliers: float = 0.01
    missing: float = 0.02
    dropout: float = 0.0
    quantum: Mapping[str, float] = field(default_factory=dict)

    def levels(self) -> dict[str, float]:
        """Return channel → standard deviation of the noise, in its display unit."""
        if isinstance(self.noise, Mapping):
            return {**NOISE, **self.noise}
        return {name: self.noise * level for name, level in NOISE.items()}


USUAL = SensorErrors()
"""Errors of usual sensors."""

Simulate = Callable[[Setting, np.ndarray, Iterable[str]], Mapping[str, np.ndarray]]


def make_record(
    setting: Setting,
    times: np.ndarray,
    channels: Iterable[str],
    *,
    seed: int | np.random.Generator,
    errors: SensorErrors = USUAL,
    simulate: Simulate = simulate_reference,
    source: str = "simulated",
) -> Record:
    """Return the measurements of a setting.

    Args:
        setting: the truth.
        times: of the samples (n,). [s]
        channels: names of `subzero.channels`.
        seed: of the noise.
        errors: noise, outliers and gaps.
        simulate: the function that gives the truth.
        source: of the record, in words.
    """
    rng, channels = np.random.default_rng(seed), tuple(channels)
    levels, dropout = errors.levels(), errors.dropout
    truth, values = simulate(setting, times, channels), {}
    for name in channels:
        shown = truth[name] + levels[name] * _coloured(rng, times.size, errors.rho)
        far = rng.random(times.size) < errors.outliers
        shown += far * rng.choice([-1.0, 1.0], times.size) * rng.uniform(*OUTLIER, times.size) * levels[name]
        step = errors.quantum.get(name, 0.0)
        shown = np.round(shown / step) * step if step > 0.0 else shown
        gone = rng.random(times.size) < errors.missing
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
