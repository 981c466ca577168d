"""The tethered vehicle as a model of `subzero.identification`: one instance among others.

Every effect of the catalogue becomes a cause, its numbers parameters with their tolerances; the state at the start of a
record becomes its starts. Errors in the data are those of any model, so that effects of sensors are left out.

    model, records = vehicle_model(read_trials("log.csv"))
    verdict = identification.diagnose(records, model)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import scenarios
from scenarios.steps import held
from subzero import identification as general
from subzero.channels import BY_NAME, HEADING
from subzero.diagnosis.hypothesis.catalogue import SPECS, START, catalogue, with_own
from subzero.diagnosis.hypothesis.catalogue.sensors import SCALE
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter, with_onset
from subzero.diagnosis.hypothesis.hypotheses import moves_nothing, with_tolerances
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.latent_force import AXIS_WORDS
from subzero.diagnosis.inference.simulator import Stop, Track, economical, read, simulate_on, with_stops
from subzero.errors import UserError
from subzero.external_force import AXES, MissingForce
from subzero.records.consistency import REPORTED_COMMANDS

OF_ANY_MODEL = ("sensor_bias", "sensor_scale", "clock_offset")
"""Effects that `Sensor` and errors in the data say."""
KNOWN_SPREAD, USUAL_SPREAD = 0.1, 0.7
"""Standard deviation of the logarithm of a sensor's level: given by the user, or that of usual sensors. [-]"""
TRIAL = "trial"
"""Input by which the function knows which of several records it simulates."""
AXIS_SIZES = {"X": 0.02, "Y": 0.02, "Z": 0.02, "K": 0.0005, "M": 0.002, "N": 0.002}
"""Usual size of what the hull's equations miss, by axis: some per cent of the drag at 1 m/s. [N, N m]"""
AXIS_TIME_S, ACTS_TIME_S = 4.0, 2.0
"""Over which it changes: what the equations miss, and a force that no cause explains, which may be a knock. [s]"""
ACTS = 15.0
"""Size of a force that acts and that no cause explains, over what the hull's equations usually miss. [-]"""
STOPS, SIMULATIONS_KEPT = 10, 8
"""A simulation can be taken up at so many times less one; so many of the latest are kept."""


def vehicle_model(
    logged: Sequence[Logged], *, axes: Sequence[str] = ()
) -> tuple[general.Model, list[general.Record]]:
    """Return the model of some trials of one vehicle, and their records.

    Args:
        logged: records with their trials.
        axes: of the hull on which unknown forces act in every explanation, such as "XN"; each costs a simulation for
            every 4 s. On the others one is offered where nothing else explains a record.

    Raises:
        UserError: an axis does not exist.
    """
    for axis in axes:
        if axis not in AXES:
            raise UserError(f"there is no axis {axis!r}. Allowed: {', '.join(AXES)}.")
    settings = [economical(each.setting, float(each.record.time[-1])) for each in logged]
    channels = list(dict.fromkeys(name for each in logged for name in each.record.values if name in SPECS))
    effects = _effects(settings[0], channels)
    commands = [_commands(setting) for setting in settings]
    inputs = list(REPORTED_COMMANDS) if all(values is not None for values in commands) else []
    noise = {name: level for each in logged for name, level in each.noise.items()}
    trusted = {name for each in logged for name in each.trusted}
    model = general.Model(
        _simulate(settings, effects, channels),
        {name: _sensor(name, noise, trusted) for name in channels},
        inputs=[TRIAL, *inputs],
        parameters=[*_numbers(effects.values(), general.Number), *_numbers(START, general.Start)],
        causes=[_cause(effect) for effect in effects.values()],
        unknown=[_force(axis, usual=axis in axes) for axis in AXES],
    )
    records = [
        general.Record(
            each.record.time,
            {
                TRIAL: np.full(each.record.time.size, float(k)),
                **{name: each.record.values[name] for name in channels if name in each.record.values},
                **(dict(zip(inputs, _held(setting, each.record.time), strict=True)) if inputs else {}),
            },
            name=each.name,
        )
        for k, (each, setting) in enumerate(zip(logged, settings, strict=True))
    ]
    return model, records


def _force(axis: str, *, usual: bool) -> general.Unknown:
    """Return a force on the hull that is not known: part of every explanation, or one that may act."""
    return general.Unknown(
        axis,
        AXIS_SIZES[axis] * (1.0 if usual else ACTS),
        AXIS_TIME_S if usual else ACTS_TIME_S,
        usual=usual,
        sentence=f"a {AXIS_WORDS[axis]} acts that no cause explains",
        unit="N" if axis in "XYZ" else "N m",
    )


def _commands(setting: Setting) -> scenarios.Commands | None:
    """Return the commands of propeller, rudder and planes; None of a trial that has others."""
    commands = setting.trial.commands
    return commands if commands is not None and commands.values.shape[1] == len(REPORTED_COMMANDS) else None


def _held(setting: Setting, time: np.ndarray) -> np.ndarray:
    """Return the commands of a trial at some times (4, n)."""
    commands = setting.trial.commands
    assert commands is not None
    return np.array([held(commands.time, column, time) for column in commands.values.T])


def _with_commands(
    setting: Setting, u: Mapping[str, np.ndarray], t: np.ndarray
) -> tuple[Setting, tuple[float, ...]]:
    """Return a setting with the commands that the inputs say, which are those of the trial, or one of them times a
    factor; and what makes it another simulation.
    """
    own = _held(setting, t)
    given = np.array([u[name] for name in REPORTED_COMMANDS])
    if np.array_equal(own, given):
        return setting, ()
    size = np.einsum("kn,kn->k", own, own)
    size[size == 0.0] = np.inf
    factors = (given @ own.T) / size  # of each input, by which it is each command of the trial
    misses = np.abs(given[:, None, :] - factors[:, :, None] * own).max(axis=2)
    source = np.argmin(misses, axis=1)
    factor = factors[np.arange(source.size), source]
    commands = setting.trial.commands
    assert commands is not None
    changed = replace(commands, values=commands.values[:, source] * factor)
    key = (*source.astype(float).tolist(), *factor.tolist())
    return replace(setting, trial=replace(setting.trial, commands=changed)), key


def _effects(setting: Setting, channels: Sequence[str]) -> dict[str, Effect]:
    """Return the effects that are possible in a trial and change something in it."""
    slots = () if setting.tethered else ("cable", "drum")
    drum = ("drum",) if setting.model.winch is not None else ()
    own = with_own((), setting.model.vehicle)
    return {
        effect.id: replace(effect, parameters=tuple(p.within(setting) for p in effect.parameters))
        for effect in (with_tolerances(each, setting) for each in catalogue(channels, own).values())
        if effect.slot not in (*slots, *drum)
        and effect.id.partition(":")[0] not in OF_ANY_MODEL
        and not moves_nothing(effect, setting)
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
        zero=SPECS[name].bias,
        scale=SCALE[0],
        trusted=name in trusted,
        logger="vehicle",
    )


def _simulate(
    settings: Sequence[Setting], effects: Mapping[str, Effect], channels: Sequence[str]
) -> general.model.Simulate:
    """Return the function of the model: what the sensors of a trial would show."""
    kept, commanded = _Simulations(), all(_commands(setting) is not None for setting in settings)

    def simulate(p: Mapping[str, Any], u: Mapping[str, Any], t: np.ndarray) -> dict[str, np.ndarray]:
        trial, named = int(u[TRIAL][0]), effects.values()
        whole = {
            effect.id: [p[_name(effect, each)] for each in effect.parameters] for effect in (*named, *START)
        }
        late = {
            effect.id: (
                p[effect.id]["since"],
                [p[effect.id][_name(effect, each)] for each in effect.parameters],
            )
            for effect in named
            if effect.sudden
        }
        given, key = _with_commands(settings[trial], u, t) if commanded else (settings[trial], ())
        force = np.column_stack([u.get(axis, np.zeros(t.size)) for axis in AXES])
        asked = _Asked(
            trial,
            {effect.id: tuple(whole[effect.id]) for effect in (*named, *START) if effect.slot != "sensors"}
            | {"commands": key},
            {id: (since, *values) for id, (since, values) in late.items() if any(values)},
            t,
            force,
        )
        setting = given
        for effect in (*named, *START):
            if any(whole[effect.id]):
                setting = effect.apply(setting, *whole[effect.id])
        for id, (since, *values) in asked.late.items():
            setting = with_onset(effects[id], since).apply(setting, *values)
        if force.any():
            missing = MissingForce(time=tuple(t.tolist()), wrench=tuple(map(tuple, force.tolist())))
            setting = setting.with_model(missing=missing + setting.model.missing)
        return read(setting, kept.track(asked, setting), t, channels)

    return simulate


class _Asked(NamedTuple):
    """A simulation: the trial, deviations of effects that hold throughout, (onset, deviations) of the others, and the
    force (n, 6) on the hull at times (n,).
    """

    trial: int
    throughout: dict[str, tuple[float, ...]]
    late: dict[str, tuple[float, ...]]
    time: np.ndarray
    force: np.ndarray

    def same_until(self, other: _Asked) -> float:
        """Return the time until which another simulation is the same. [s]"""
        if (self.trial, self.throughout) != (other.trial, other.throughout):
            return -np.inf
        onsets = [since for _, (since, *_) in {*self.late.items()} ^ {*other.late.items()}]
        if not (self.force.any() or other.force.any()):
            return min(onsets, default=np.inf)
        if not np.array_equal(self.time, other.time):
            return -np.inf
        changed = np.flatnonzero((self.force != other.force).any(axis=1))
        return min([*onsets, *self.time[np.maximum(changed[:1] - 1, 0)].tolist()], default=np.inf)


class _Simulations:
    """Latest whole simulations, with how they were at some times: another goes on from where it begins to differ."""

    def __init__(self) -> None:
        self._kept: list[tuple[_Asked, Track, dict[float, Stop]]] = []

    def track(self, asked: _Asked, setting: Setting) -> Track:
        """Return the track of a simulation."""
        same = [asked.same_until(other) for other, *_ in self._kept]
        best = int(np.argmax(same)) if same else -1
        if same and same[best] == np.inf:
            return self._kept[best][1]
        times = [time for time in self._kept[best][2] if time <= same[best]] if same else []
        if times:
            return simulate_on(setting, self._kept[best][2][max(times)])
        step = setting.trial.cable_step
        grid = np.rint(np.arange(1, STOPS) * setting.trial.duration / STOPS / step) * step
        track, stops = with_stops(setting, grid.tolist())
        self._kept = [*self._kept[1 - SIMULATIONS_KEPT :], (asked, track, stops)]
        return track
