"""The extended model as a file that anyone can run: ``subzero simulate fig6 --with found/extended.toml``.

    scenario = "fig6"

    [effects.rudder_lag]            # the rudder servo lags
    time_constant_s = 0.21          # deviation; as a whole 0.31 s, the model has 0.1 s
    starts_at_s = 12.0              # only if it began in mid-trial

    [calibration.hull_drag]         # within tolerance, found by the refit
    share = 0.012

    [[missing_force]]               # what no effect explains: a history
    axis = "X"
    time_s = [0.0, 2.0, 4.0]
    force_N = [0.0, -0.3, -0.2]     # K, M, N: moment_N_m

    [[missing_term]]                # … or a formula
    axis = "X"
    feature = "u|u|"
    coefficient = -1.2              # N s2/m2

Numbers are deviations from the nominal model, with their unit in the key. `apply` makes a setting of them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from subzero.diagnosis.hypothesis.catalogue import ONSETS, START, catalogue, sensors
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter, with_onset
from subzero.diagnosis.results import Extended

STARTS = "starts_at_s"


@dataclass(frozen=True, kw_only=True)
class ExtendedFile:
    """What an extended.toml says.

    Attributes:
        extended: the deviations.
        effects: every effect that it names, by id.
        scenario: the one it was found with.
    """

    extended: Extended
    effects: Mapping[str, Effect]
    scenario: str = ""


def key_of(parameter: Parameter) -> str:
    """Return the key of a parameter, with its unit: ``time_constant_s``, ``force_N_per_min``; a share has none."""
    unit = parameter.unit.removeprefix("1").replace("degree", "deg").replace("/min", " per_min")
    return "_".join([parameter.name, *unit.replace("/", " ").split()])


def all_effects(more: Iterable[Effect] = ()) -> dict[str, Effect]:
    """Return every effect there is, by id: of the start, of all sensors, and what only begins in mid-trial, too."""
    return {**catalogue(sensors.SPECS, more), **{effect.id: effect for effect in (*START, *ONSETS)}}


def force_key(axis: str) -> str:
    """Return the key of a history on an axis, with its unit."""
    return "force_N" if axis in "XYZ" else "moment_N_m"


def apply(extended: Extended, setting: Setting, effects: Mapping[str, Effect]) -> Setting:
    """Return a setting with an extended model; causes that begin in mid-trial hold from the next exchange on.

    Args:
        extended: the deviations.
        setting: the nominal one.
        effects: by id, all that are named.
    """
    grows = {name: 0.0 for name in extended.deviations if effects[plain_id(name)].grows}
    starts = grows | starts_of(extended)
    throughout = [(name, numbers) for name, numbers in extended.deviations.items() if name not in starts]
    for name, numbers in (*extended.calibration.items(), *throughout):
        setting = _with(setting, effects[name], numbers)
    if extended.missing is not None:
        setting = setting.with_model(missing=extended.missing + setting.model.missing)
    for start, name in sorted((start, name) for name, start in starts.items()):
        setting = from_then_on(setting, effects[plain_id(name)], extended.deviations[name], start)
    return setting


def plain_id(name: str) -> str:
    """Return the id of an effect without the time at which it begins: ``hull_drag@12`` → hull_drag."""
    return name.partition("@")[0]


def starts_of(extended: Extended) -> dict[str, float]:
    """Return when causes that began in mid-trial began, whether their id says it or `start_times`. [s]"""
    said = {name: float(name.partition("@")[2]) for name in extended.deviations if "@" in name}
    return said | {name: start for name, start in extended.start_times.items() if name in extended.deviations}


def from_then_on(setting: Setting, effect: Effect, numbers: Mapping[str, float], start: float) -> Setting:
    """Return a setting in which an effect begins in mid-trial, after all changes that are there. [s]"""
    step = setting.trial.cable_step
    if effect.grows:
        return with_onset(effect, start).apply(setting, *_values(effect, numbers))
    start = min(max(round(start / step), 1) * step, setting.trial.duration)
    last = setting.later[-1][1] if setting.later else setting.model
    changed = _with(dataclasses.replace(setting, model=last), effect, numbers).model
    return dataclasses.replace(setting, later=(*setting.later, (start, changed)))


def unseen(extended: Extended, effects: Mapping[str, Effect]) -> list[str]:
    """Return the named causes of sensors and their clock, which change what is shown and not what is."""
    return [name for name in extended.deviations if effects[plain_id(name)].slot in ("sensors", "clock")]


def _with(setting: Setting, effect: Effect, numbers: Mapping[str, float]) -> Setting:
    """Return a setting with an effect; parameters that are not named stay as they are."""
    return effect.apply(setting, *_values(effect, numbers))


def _values(effect: Effect, numbers: Mapping[str, float]) -> list[float]:
    return [numbers.get(parameter.name, 0.0) for parameter in effect.parameters]
