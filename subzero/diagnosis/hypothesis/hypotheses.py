"""The parameter vector z, the hypotheses about it, and a table of their prior probabilities.

z holds the parameters of all effects, which all records share, and then the start of each record. A hypothesis is a
set of causes, whose entries get the prior variance s² instead of (κτ)². With its numbers, by name, it is an extended
model, and `apply_extended` makes a setting of that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from subzero.arguments import checked_arguments
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter, plain_id, with_onset
from subzero.diagnosis.results import Extended


class Entry(NamedTuple):
    """A number of z: a parameter of an effect; of one record only, for a start (else −1)."""

    effect: Effect
    place: int
    record: int

    @property
    def parameter(self) -> Parameter:
        """The parameter."""
        return self.effect.parameters[self.place]

    @property
    def name(self) -> str:
        """The parameter's name, unique."""
        where = f"@{self.record}" if self.record >= 0 else ""
        return f"{self.effect.id}.{self.parameter.name}{where}"


def entries_of(effects: Sequence[Effect], start: Sequence[Effect], records: int) -> tuple[Entry, ...]:
    """Return the entries of z: effects that all records share, and the start of each record."""
    shared = [Entry(effect, i, -1) for effect in effects for i in range(len(effect.parameters))]
    own = [
        Entry(effect, i, record)
        for record in range(records)
        for effect in start
        for i in range(len(effect.parameters))
    ]
    return (*shared, *own)


def grouped(entries: tuple[Entry, ...]) -> list[tuple[Effect, list[int], int]]:
    """Return (effect, its places in z, its record), in order."""
    found: dict[tuple[str, int], tuple[Effect, list[int], int]] = {}
    for k, entry in enumerate(entries):
        found.setdefault((entry.effect.id, entry.record), (entry.effect, [], entry.record))[1].append(k)
    return list(found.values())


FLAT_SIGNAL = 1.0
"""A parameter whose response to one effect scale is no larger than this, in noise levels, has no slope there."""


def is_flat(entry: Entry, column: np.ndarray) -> bool:
    """Say whether whitened sensitivities to an entry (m,) are negligible."""
    return bool(np.linalg.norm(column) * entry.parameter.scale <= FLAT_SIGNAL)


def number_of(name: str, setting: Setting) -> float:
    """Return a number of a setting's vehicle, cable or drum, by its dotted name such as
    "vehicle.rudder.lift_slope".
    """
    found: Any = setting.model
    for key in name.split("."):
        found = getattr(found, key)
    return float(found)


def with_tolerances(effect: Effect, setting: Setting) -> Effect:
    """Return an effect with the tolerances that the files of a setting's vehicle, cable or trial declare.

    A parameter that moves a number by dv/dz may move it by the tolerance that is declared, τ / |dv/dz|; of several
    such numbers the most restrictive one counts. Where none is declared the tolerance of the catalogue holds.
    """
    declared = setting.trial.tolerances
    if not declared:
        return effect
    parameters = []
    for at, parameter in enumerate(effect.parameters):
        slopes = {name: _slope(effect, at, setting, name) for name in declared}
        allowed = [declared[name] / slope for name, slope in slopes.items() if slope > 0.0]
        parameters.append(replace(parameter, tolerance=min(allowed)) if allowed else parameter)
    return replace(effect, parameters=tuple(parameters))


def _slope(effect: Effect, at: int, setting: Setting, name: str) -> float:
    """Return the change of a number by a parameter of an effect, over the parameter's deviation."""
    z = small_deviation(effect.parameters[at])
    moved = _moved(effect, at, setting)
    return abs(number_of(name, moved) - number_of(name, setting)) / abs(z)


def small_deviation(parameter: Parameter) -> float:
    """Return a deviation as large as the tolerance, to a side within bounds."""
    return parameter.tolerance if parameter.tolerance <= parameter.high else -parameter.tolerance


def _moved(effect: Effect, at: int, setting: Setting) -> Setting:
    """Return a setting with one parameter of an effect moved by its tolerance."""
    return effect.apply(
        setting,
        *(small_deviation(parameter) if i == at else 0.0 for i, parameter in enumerate(effect.parameters)),
    )


def is_absent(effect: Effect, nominal: Setting) -> bool:
    """Say whether a cause of propeller, rudder or stern-planes has nothing to act on in a vehicle without them."""
    hull = nominal.model.vehicle
    if ":" in effect.id:  # of a sensor or a listed actuator, by its name
        return False
    absent = {"propulsion": not hull.propeller.thrust_constant > 0.0, "fins": False}
    absent["fins"] = not (hull.fins or hull.rudder.area > 0.0 or hull.stern_planes.area > 0.0)
    return absent.get(effect.slot, False)


def moves_nothing(effect: Effect, setting: Setting) -> bool:
    """Say whether an effect changes nothing in a setting: a share of a number that is zero there."""
    moved = [_moved(effect, at, setting) for at in range(len(effect.parameters))]
    return all(_same(each, setting) for each in moved)


def _same(setting: Setting, other: Setting) -> bool:
    parts = ("model", "sensing", "clock_offset", "later", "tethered")
    return setting.trial is other.trial and all(
        getattr(setting, part) == getattr(other, part) for part in parts
    )


Ids = tuple[str, ...]
"""The causes of a hypothesis, in alphabetical order; () is "nothing is wrong"."""


def nameable(entries: Sequence[Entry]) -> list[str]:
    """Return the ids that can be named: all but those of the start."""
    found = dict.fromkeys(entry.effect.id for entry in entries if entry.record < 0)
    return list(found)


def columns_of(entries: Sequence[Entry], ids: Ids) -> list[int]:
    """Return the places of the parameters of causes in z."""
    return [k for k, entry in enumerate(entries) if entry.record < 0 and entry.effect.id in ids]


def variances(entries: Sequence[Entry], ids: Ids, kappa: float) -> np.ndarray:
    """Return the prior variances of z (k,): (κτ)², or s² for the causes that are named."""
    D = np.array([(kappa * entry.parameter.tolerance) ** 2 for entry in entries])
    at = columns_of(entries, ids)
    D[at] = variances_named(entries, at, kappa)
    return D


def variances_named(entries: Sequence[Entry], at: Sequence[int], kappa: float) -> np.ndarray:
    """Return the prior variances that entries have if their causes are named (at,): s²."""
    own = [entries[k].parameter for k in at]
    return np.array([max(each.scale, 2.0 * kappa * each.tolerance) ** 2 for each in own])


@checked_arguments
def apply_extended(extended: Extended, setting: Setting, effects: Mapping[str, Effect]) -> Setting:
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
        setting = _with_later(setting, effects[plain_id(name)], extended.deviations[name], start)
    return setting


def starts_of(extended: Extended) -> dict[str, float]:
    """Return the onsets of causes that began in mid-trial, from their ids or from `start_times`. [s]"""
    said = {name: float(name.partition("@")[2]) for name in extended.deviations if "@" in name}
    return said | {name: start for name, start in extended.start_times.items() if name in extended.deviations}


def _with_later(setting: Setting, effect: Effect, numbers: Mapping[str, float], start: float) -> Setting:
    """Return a setting in which an effect begins in mid-trial, after all changes that are there already; onset in
    [s].
    """
    step = setting.trial.cable_step
    if effect.grows:
        return with_onset(effect, start).apply(setting, *_values(effect, numbers))
    start = min(max(round(start / step), 1) * step, setting.trial.duration)
    last = setting.later[-1][1] if setting.later else setting.model
    changed = _with(replace(setting, model=last), effect, numbers).model
    return replace(setting, later=(*setting.later, (start, changed)))


@checked_arguments
def unseen(extended: Extended, effects: Mapping[str, Effect]) -> list[str]:
    """Return the named causes of sensors and their clock, which change readings and not the motion."""
    return [name for name in extended.deviations if effects[plain_id(name)].slot in ("sensors", "clock")]


def _with(setting: Setting, effect: Effect, numbers: Mapping[str, float]) -> Setting:
    """Return a setting with an effect; parameters that are not named are unchanged."""
    return effect.apply(setting, *_values(effect, numbers))


def _values(effect: Effect, numbers: Mapping[str, float]) -> list[float]:
    return [numbers.get(parameter.name, 0.0) for parameter in effect.parameters]
