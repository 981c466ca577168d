"""The tethered vehicle as a model of `subzero.identification`: one instance among others.

Every effect of the catalogue becomes a cause, its numbers parameters with their tolerances; the state at the start of a
record becomes its starts. Errors in the data are those of any model, so that effects of sensors are left out.

    model, records = vehicle_model(read_trials("log.csv"))
    verdict = identification.diagnose(records, model)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from subzero import identification as general
from subzero.channels import BY_NAME, HEADING
from subzero.diagnosis.hypothesis.catalogue import SPECS, START, catalogue
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter, with_onset
from subzero.diagnosis.hypothesis.hypotheses import moves_nothing, with_tolerances
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.simulator import economical, respond
from subzero.errors import UserError
from subzero.external_force import AXES, MissingForce

NOT_PHYSICAL = ("sensors", "clock")
"""Slots of effects that are errors in the data."""
KNOWN_SPREAD, USUAL_SPREAD = 0.1, 0.7
"""Standard deviation of the logarithm of a sensor's level: given by the user, or that of usual sensors. [-]"""
TRIAL = "trial"
"""Input by which the function knows which of several records it simulates."""
AXIS_SIZES = {"X": 0.02, "Y": 0.02, "Z": 0.02, "K": 0.0005, "M": 0.002, "N": 0.002}
"""Usual size of what the hull's equations miss, by axis: some per cent of the drag at 1 m/s. [N, N m]"""
AXIS_TIME_S = 4.0
"""Over which it changes. [s]"""


def vehicle_model(
    logged: Sequence[Logged], *, axes: Sequence[str] = ()
) -> tuple[general.Model, list[general.Record]]:
    """Return the model of some trials of one vehicle, and their records.

    Args:
        logged: records with their trials.
        axes: of the hull on which unknown forces act, such as "XN"; each costs a simulation for every 4 s.

    Raises:
        UserError: an axis does not exist.
    """
    for axis in axes:
        if axis not in AXES:
            raise UserError(f"there is no axis {axis!r}. Allowed: {', '.join(AXES)}.")
    settings = [economical(each.setting, float(each.record.time[-1])) for each in logged]
    channels = list(dict.fromkeys(name for each in logged for name in each.record.values if name in SPECS))
    effects = _effects(settings[0])
    noise = {name: level for each in logged for name, level in each.noise.items()}
    trusted = {name for each in logged for name in each.trusted}
    model = general.Model(
        _simulate(settings, effects, channels),
        {name: _sensor(name, noise, trusted) for name in channels},
        inputs=[TRIAL],
        parameters=[*_numbers(effects.values(), general.Number), *_numbers(START, general.Start)],
        causes=[_cause(effect) for effect in effects.values()],
        unknown=[general.Unknown(axis, AXIS_SIZES[axis], AXIS_TIME_S) for axis in axes],
    )
    records = [
        general.Record(
            each.record.time,
            {TRIAL: np.full(each.record.time.size, float(k)), **each.record.values},
            name=each.name,
        )
        for k, each in enumerate(logged)
    ]
    return model, records


def _effects(setting: Setting) -> dict[str, Effect]:
    """Return the physical effects that are possible in a trial and change something in it."""
    slots = () if setting.tethered else ("cable", "drum")
    drum = ("drum",) if setting.model.winch is not None else ()
    return {
        effect.id: replace(effect, parameters=tuple(p.within(setting) for p in effect.parameters))
        for effect in (with_tolerances(each, setting) for each in catalogue(()).values())
        if effect.slot not in (*NOT_PHYSICAL, *slots, *drum) and not moves_nothing(effect, setting)
    }


def _name(effect: Effect, parameter: Parameter) -> str:
    return f"{effect.id}:{parameter.name}"


def _numbers(effects: Any, kind: Callable[..., general.Number]) -> list[general.Number]:
    """Return the parameters of effects, which are deviations from the nominal model."""
    return [
        kind(_name(effect, p), 0.0, tolerance=p.tolerance, low=p.low, high=p.high, unit=p.unit)
        for effect in effects
        for p in effect.parameters
    ]


def _cause(effect: Effect) -> general.Cause:
    changes = {_name(effect, p): p.scale for p in effect.parameters}
    return general.Cause(effect.id, effect.sentence, changes=changes, onset=effect.sudden)


def _sensor(name: str, noise: Mapping[str, float], trusted: set[str]) -> general.Sensor:
    return general.Sensor(
        noise=noise.get(name, SPECS[name].noise),
        spread=KNOWN_SPREAD if name in noise else USUAL_SPREAD,
        unit=BY_NAME[name].unit.replace("degree", "deg"),
        angle=name == HEADING,
        trusted=name in trusted,
        logger="vehicle",
    )


def _simulate(
    settings: Sequence[Setting], effects: Mapping[str, Effect], channels: Sequence[str]
) -> general.model.Simulate:
    """Return the function of the model: what the sensors of a trial would show."""

    def simulate(p: Mapping[str, Any], u: Mapping[str, Any], t: np.ndarray) -> dict[str, np.ndarray]:
        setting = settings[int(u[TRIAL][0])]
        for effect in (*effects.values(), *START):
            values = [p[_name(effect, each)] for each in effect.parameters]
            if any(values):
                setting = effect.apply(setting, *values)
        for effect in effects.values():
            from_then_on = p.get(effect.id, {})
            values = [from_then_on.get(_name(effect, each), 0.0) for each in effect.parameters]
            if any(values):
                setting = with_onset(effect, from_then_on["since"]).apply(setting, *values)
        force = np.column_stack([u.get(axis, np.zeros(t.size)) for axis in AXES])
        if force.any():
            missing = MissingForce(time=tuple(t.tolist()), wrench=tuple(map(tuple, force.tolist())))
            setting = setting.with_model(missing=missing + setting.model.missing)
        return respond(setting, t, channels)

    return simulate
