"""The tethered vehicle as a model of `subzero.identification`: one instance among others.

Every effect of the catalogue becomes a cause, its numbers parameters with their tolerances; the state at the start of a
record becomes its starts. Errors in the data are those of any model, so that effects of sensors are left out.

    model, records = vehicle_model(read_trials("log.csv"))
    verdict = identification.diagnose(records, model)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

import scenarios
from scenarios.steps import held
from subzero import identification as general
from subzero.channels import BY_NAME, HEADING
from subzero.diagnosis.hypothesis.catalogue import ONSETS, SAMPLED, SPECS, START, catalogue, with_own
from subzero.diagnosis.hypothesis.catalogue.sensors import CLOCK, SCALE
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter, with_onset
from subzero.diagnosis.hypothesis.hypotheses import is_absent, moves_nothing, with_tolerances
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.hypothesis.noise import KNOWN_SPREAD, USUAL_SPREAD
from subzero.diagnosis.inference.latent_force import AXIS_WORDS, DRIFT, with_missing_force
from subzero.diagnosis.inference.simulator import (
    Stop,
    Track,
    economical,
    read,
    simulate_on,
    with_limit,
    with_stops,
)
from subzero.errors import UserError
from subzero.external_force import AXES, MissingForce
from subzero.records.consistency import REPORTED_COMMANDS

OF_ANY_MODEL = ("sensor_bias", "sensor_scale", "clock_offset")
"""Effects that `Sensor` and errors in the data say."""
DRIFT_LEVELS, DRIFT_TIME_S = 6.0, 5.0
"""Usual size of a drift, in levels of the sensor [-], and over which time it changes [s]."""
AFTERWARDS = ("sensors", "clock")
"""Slots of effects that act on a finished simulation."""
TRIAL = "trial"
"""Input by which the function knows which of several records it simulates."""
AXIS_SIZES = {"X": 0.02, "Y": 0.02, "Z": 0.02, "K": 0.0005, "M": 0.002, "N": 0.002}
"""Usual size of what the hull's equations miss, by axis: some per cent of the drag at 1 m/s. [N, N m]"""
AXIS_TIME_S, ACTS_TIME_S = 4.0, 1.5
"""Over which it changes: what the equations miss, and a force that no cause explains, which may be a knock. [s]"""
ACTS = 15.0
"""Size of a force that acts and that no cause explains, over what the hull's equations usually miss. [-]"""
STOPS, SIMULATIONS_KEPT = 10, 8
"""A simulation can be taken up at so many times less one; so many of the latest are kept."""


def vehicle_model(
    logged: Sequence[Logged], *, effects: Iterable[Effect] = (), axes: Sequence[str] = ()
) -> tuple[general.Model, list[general.Record]]:
    """Return the model of some trials of one vehicle, and their records.

    Args:
        logged: records with their trials.
        effects: causes besides the catalogue.
        axes: of the hull on which unknown forces act in every explanation, such as "XN"; each costs a simulation for
            every 4 s. On the others one is offered where nothing else explains a record.

    Raises:
        UserError: an axis does not exist; the nominal model cannot be run through a trial.
    """
    for axis in axes:
        if axis not in AXES:
            raise UserError(f"there is no axis {axis!r}. Allowed: {', '.join(AXES)}.")
    settings = [_prepared(each) for each in logged]
    channels = list(dict.fromkeys(name for each in logged for name in each.record.values if name in SPECS))
    known = Effects.of(settings, channels, effects)
    commands = [_commands(setting) for setting in settings]
    inputs = list(REPORTED_COMMANDS) if all(values is not None for values in commands) else []
    model = general.Model(
        _simulate(settings, known, channels),
        {name: _sensor(name, logged) for name in channels},
        inputs=[TRIAL, *inputs],
        parameters=[
            *_numbers(known.throughout.values(), general.Number),
            *_numbers(known.starts, general.Start),
        ],
        causes=[*map(_cause, known.throughout.values()), *map(_onset, known.onsets.values())],
        unknown=[*(_force(axis, usual=axis in axes) for axis in AXES), *map(_drift, channels)],
        trusted_inputs=[TRIAL],
        parallel=True,
    )
    return model, [
        _record(k, each, setting, channels, inputs)
        for k, (each, setting) in enumerate(zip(logged, settings, strict=True))
    ]


def _prepared(logged: Logged) -> Setting:
    """Return the setting of a record in economical steps, to its end and on, as its clock may be early."""
    end = min(float(logged.record.time[-1]), logged.setting.trial.duration) - CLOCK.parameters[0].low
    return with_limit(economical(logged.setting, end))[0]


def _record(
    k: int, logged: Logged, setting: Setting, channels: Sequence[str], inputs: Sequence[str]
) -> general.Record:
    """Return a record, the trial of number k, with its commands as inputs."""
    time, values = logged.record.time, logged.record.values
    columns = {name: values[name] for name in channels if name in values}
    held = dict(zip(inputs, _held(setting, time), strict=True)) if inputs else {}
    return general.Record(time, {TRIAL: np.full(time.size, float(k)), **columns, **held}, name=logged.name)


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


def _drift(channel: str) -> general.Unknown:
    """Return the drift of a sensor over time, which may act."""
    return general.Unknown(
        f"{DRIFT}{channel}",
        DRIFT_LEVELS * SPECS[channel].noise,
        DRIFT_TIME_S,
        usual=False,
        sentence=f"the sensor of the {channel.replace('_', ' ')} drifts",
        unit=BY_NAME[channel].unit,
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


@dataclass(frozen=True)
class Effects:
    """The effects that are possible in some trials and change something there.

    Attributes:
        throughout: id → effect that may hold throughout, and has a tolerance.
        onsets: id → effect that can only begin in mid-trial.
        starts: effects of the start of each record.
    """

    throughout: Mapping[str, Effect]
    onsets: Mapping[str, Effect]
    starts: Sequence[Effect]

    @classmethod
    def of(cls, settings: Sequence[Setting], channels: Sequence[str], more: Iterable[Effect]) -> Effects:
        """Return those of the catalogue and of the vehicle's lists, and more."""
        nominal = settings[0]
        own = with_own(more, nominal.model.vehicle)
        may = [effect for effect in catalogue(channels, own).values() if _is_possible(effect, settings)]
        throughout = [with_tolerances(effect, nominal) for effect in may if effect.slot != CLOCK.slot]
        return cls(
            {
                effect.id: replace(effect, parameters=tuple(p.within(nominal) for p in effect.parameters))
                for effect in throughout
                if effect.id.partition(":")[0] not in OF_ANY_MODEL and not moves_nothing(effect, nominal)
            },
            {effect.id: effect for effect in ONSETS if _is_possible(effect, settings)},
            (*START, SAMPLED) if any(setting.intervals for setting in settings) else START,
        )

    def on(self, p: Mapping[str, Any]) -> Iterator[tuple[Effect, list[float]]]:
        """Yield the effects that hold throughout with their deviations in parameters of the model."""
        for effect in (*self.throughout.values(), *self.starts):
            yield effect, [p[_name(effect, each)] for each in effect.parameters]

    def late(self, p: Mapping[str, Any]) -> Iterator[tuple[Effect, float, list[float]]]:
        """Yield the effects that begin in mid-trial, with their onset [s] and deviations."""
        for effect in self.throughout.values():
            if effect.sudden:
                yield (
                    effect,
                    p[effect.id]["since"],
                    [p[effect.id][_name(effect, z)] for z in effect.parameters],
                )
        for effect in self.onsets.values():
            yield effect, p[effect.id]["since"], [p[effect.id][z.name] for z in effect.parameters]


def _is_possible(effect: Effect, settings: Sequence[Setting]) -> bool:
    """Return whether a cause is possible in some trials: without a cable or a free drum, some are not."""
    tethered = any(setting.tethered for setting in settings)
    winch = any(setting.model.winch is not None for setting in settings)
    there = (effect.slot not in ("cable", "drum") or tethered) and not (effect.slot == "drum" and winch)
    return there and not is_absent(effect, settings[0])


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


def _onset(effect: Effect) -> general.Cause:
    """Return a cause that can only begin in mid-trial."""
    numbers = {
        p.name: general.Number(0.0, scale=p.scale, low=p.low, high=p.high, unit=p.unit)
        for p in effect.parameters
    }
    off = dict.fromkeys(numbers, 0.0)
    return general.Cause(effect.id, effect.sentence, off=off, onset=True, throughout=False, **numbers)  # type: ignore[arg-type]


def _sensor(name: str, logged: Sequence[Logged]) -> general.Sensor:
    known = {each.noise[name] for each in logged if name in each.noise}
    steps = [each.steps[name] for each in logged if name in each.steps]
    return general.Sensor(
        noise=max(known, default=SPECS[name].noise),
        spread=KNOWN_SPREAD if known else USUAL_SPREAD,
        unit=BY_NAME[name].unit.replace("degree", "deg"),
        angle=name == HEADING,
        resolution=steps[0] if steps else None,
        zero=SPECS[name].bias,
        scale=SCALE[0],
        trusted=any(name in each.trusted for each in logged),
        logger="vehicle",
    )


def _simulate(
    settings: Sequence[Setting], effects: Effects, channels: Sequence[str]
) -> general.model.Simulate:
    """Return the function of the model: what the sensors of a trial would show."""
    kept, commanded = _Simulations(), all(_commands(setting) is not None for setting in settings)

    def simulate(p: Mapping[str, Any], u: Mapping[str, Any], t: np.ndarray) -> dict[str, np.ndarray]:
        trial, force = int(u[TRIAL][0]), np.column_stack([u.get(axis, np.zeros(t.size)) for axis in AXES])
        on = [(effect, values) for effect, values in effects.on(p) if any(values)]
        late = [(effect, since, values) for effect, since, values in effects.late(p) if any(values)]
        setting, key = _with_commands(settings[trial], u, t) if commanded else (settings[trial], ())
        asked = _Asked(
            trial,
            {effect.id: tuple(values) for effect, values in on if effect.slot not in AFTERWARDS}
            | {"commands": key},
            {effect.id: (since, *values) for effect, since, values in late},
            t,
            force,
        )
        setting = with_effects(setting, on, late, t, force)
        shown = read(setting, kept.track(asked, setting), t, channels)
        return {name: values + u.get(f"{DRIFT}{name}", 0.0) for name, values in shown.items()}

    return simulate


def with_effects(
    setting: Setting,
    on: Iterable[tuple[Effect, list[float]]],
    late: Iterable[tuple[Effect, float, list[float]]],
    time: np.ndarray,
    force: np.ndarray,
) -> Setting:
    """Return a setting with effects: deviations of those that hold throughout; onset and deviations of the others; and
    a force (n, 6) on the hull at times (n,).
    """
    for effect, values in on:
        setting = effect.apply(setting, *values)
    for effect, since, values in late:
        setting = with_onset(effect, since).apply(setting, *values)
    if not force.any():
        return setting
    missing = MissingForce(time=tuple(time.tolist()), wrench=tuple(map(tuple, force.tolist())))
    return with_missing_force(setting, missing)


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
        kept = self._kept  # another thread may replace it
        same = [asked.same_until(other) for other, *_ in kept]
        best = int(np.argmax(same)) if same else -1
        if same and same[best] == np.inf:
            return kept[best][1]
        times = [time for time in kept[best][2] if time <= same[best]] if same else []
        if times:
            return simulate_on(setting, kept[best][2][max(times)])
        step = setting.trial.cable_step
        grid = np.rint(np.arange(1, STOPS) * setting.trial.duration / STOPS / step) * step
        track, stops = with_stops(setting, grid.tolist())
        self._kept = [*self._kept[1 - SIMULATIONS_KEPT :], (asked, track, stops)]
        return track
