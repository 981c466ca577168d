"""Is a record consistent with the trial that it is said to be of: its times, its commands, its units?

Times: a record has to lie within its trial and be long, dense and complete enough. Commands stand in the scenario, in
the record, or in both, which then have to agree. Units: what looks like another unit is asked about, not guessed. The
nominal simulation is the reference: a channel that fits it much better in another unit, or with the other sign, is
probably in that unit. A vehicle that is merely wrong is not asked about: its channel fits badly either way.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from math import radians

import numpy as np

import scenarios
from scenarios.heading import continuous, turned
from scenarios.steps import held
from subzero.channels import BY_NAME, DEGREE, HEADING
from subzero.errors import UserError
from subzero.records.record import Record

MISTAKEN: dict[str, dict[str, float]] = {
    "m/s": {"knots": 1.944, "km/h": 3.6, "feet per second": 3.281, "cm/s": 100.0},
    "degree": {"radians": np.pi / 180.0, "centidegrees": 100.0},
    "degree/s": {"radians per second": np.pi / 180.0},
    "m": {"feet": 3.281, "centimetres": 100.0},
    "rev/s": {"revolutions per minute": 60.0, "radians per second": 2.0 * np.pi},
    "N": {"kilograms": 0.1020, "pounds": 0.2248, "grams": 102.0},
    "V": {"millivolts": 1000.0},
}
"""Unit → what a column may be in by mistake → how many of those make one."""

CLEAR_MISFIT, WIDE_MISFIT, FAR_FACTOR = 0.2, 0.6, 5.0
"""How well (error over size) a channel has to fit in the other unit: well, or less well if the factor is
above FAR_FACTOR."""

BETTER_RATIO = 3.0
"""How many times better the other unit has to fit."""

MIN_SIZE_SIGMAS = 5.0
"""Channels that never exceed so many noise levels say nothing of their unit."""

MOVED_SIGMAS = 3.0
"""A sensor that never changes is stuck if the trial moves its channel by so many noise levels."""

REPEATED_SHARE = 0.6
"""A channel that repeats its last value in more than this share of samples is held by its logger."""


def unit_questions(
    values: Mapping[str, np.ndarray], simulated: Mapping[str, np.ndarray], noise: Mapping[str, float]
) -> list[str]:
    """Return a question for every channel that looks as if it were in another unit.

    Args:
        values: channel → measured. [display unit]
        simulated: channel → nominal simulation at the same times. [display unit]
        noise: channel → usual noise of its sensor. [display unit]
    """
    asked = []
    for name, measured in values.items():
        known = np.isfinite(measured) & np.isfinite(simulated[name])
        words = _other_unit(name, measured[known], simulated[name][known], noise[name])
        asked += [words] if words else []
    return asked


def stuck(
    values: Mapping[str, np.ndarray], simulated: Mapping[str, np.ndarray], noise: Mapping[str, float]
) -> list[str]:
    """Return a problem for every channel that never changes, although the trial moves it."""
    return [
        _stuck(name, float(np.nanmax(measured)), _span(simulated[name]))
        for name, measured in values.items()
        if is_constant(measured) and _span(simulated[name]) > MOVED_SIGMAS * noise[name]
    ]


def is_constant(values: np.ndarray) -> bool:
    """Return whether a channel is the same in every sample."""
    return bool(_span(values) == 0.0)


def repeating(values: Mapping[str, np.ndarray]) -> list[str]:
    """Return the channels of which most samples repeat the one before: their noise is hard to estimate."""
    return [
        name
        for name, value in values.items()
        if np.mean(np.diff(value[np.isfinite(value)]) == 0.0) > REPEATED_SHARE
    ]


def _span(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if known.size else 0.0


def _stuck(name: str, value: float, moved: float) -> str:
    column = BY_NAME[name].column
    return (
        f"{column} is {value:g} in every sample, while the simulation moves it by {moved:.3g}: a sensor that is stuck. "
        f'Leave the column out, or say units_checked = ["{column}"] in the sidecar if it is true'
    )


def _other_unit(name: str, measured: np.ndarray, simulated: np.ndarray, noise: float) -> str:
    """Return the question about one channel, or nothing."""
    size = _rms(simulated)
    if measured.size < 5 or np.abs(simulated).max() < MIN_SIZE_SIGMAS * noise:
        return ""
    plain = _rms(measured - simulated) / size
    for words, factor in {**MISTAKEN.get(BY_NAME[name].unit, {}), "opposite": -1.0}.items():
        error = _rms(_converted(name, measured / factor, simulated) - simulated) / size
        is_far = max(abs(factor), 1.0 / abs(factor)) > FAR_FACTOR
        if error < (WIDE_MISFIT if is_far else CLEAR_MISFIT) and BETTER_RATIO * error < plain:
            return _question(name, words, factor)
    return ""


def _converted(name: str, values: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    """Return values in another unit; a heading with the turns of the simulation."""
    return turned(continuous(values, simulated), simulated) if name == HEADING else values


def _question(name: str, words: str, factor: float) -> str:
    column = BY_NAME[name].column
    allowed = f'say units_checked = ["{column}"] in the sidecar'
    if words == "opposite":
        meant = f"here it is {BY_NAME[name].long_name}"
        return f"{column} has the opposite sign of the simulation. If so turn it ({meant}); if it is right {allowed}"
    times = f"{factor:.3g}" if factor >= 1.0 else f"1/{1.0 / factor:.3g}"
    return f"{column} looks like {words} ({times} times the simulation). If so convert it; if it is right {allowed}"


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


MIN_DURATION_S, MAX_STEP_S, MIN_SAMPLES = 5.0, 5.0, 6
"""A record has to last so long [s], with a sample at least so often [s], and so many samples."""

SAME_TIME_S = 1e-6
"""Times that differ by less are the same. [s]"""


def epoch_problems(record: Record, trial: scenarios.Trial) -> list[str]:
    """Return the problem that a record begins outside its trial, if it does."""
    first = record.time[0]
    if 0.0 <= first < trial.duration:
        return []
    return [
        f"the first time is {first:g} s, but time_s counts from the start of the trial, which lasts "
        f"{trial.duration:g} s: subtract the time of the start"
    ]


def time_problems(record: Record, trial: scenarios.Trial, *, longer: bool) -> list[str]:
    """Return the problems of the times of a record; it may be `longer` than its trial if it has its own commands."""
    time, problems = record.time, epoch_problems(record, trial)
    if problems:
        return problems
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    if time.size < MIN_SAMPLES:
        problems.append(
            f"it has {time.size} sample{'s' * (time.size != 1)}; a diagnosis needs at least {MIN_SAMPLES}"
        )
    if step > MAX_STEP_S:
        problems.append(
            f"it is sampled every {step:g} s, slower than the vehicle moves: a diagnosis needs a sample every "
            f"{MAX_STEP_S:g} s, better every 0.1 s"
        )
    if time[-1] - time[0] < MIN_DURATION_S:
        problems.append(f"it lasts {time[-1] - time[0]:g} s; a diagnosis needs at least {MIN_DURATION_S:g} s")
    if not longer and time[-1] > trial.duration + max(step, trial.cable_step) + SAME_TIME_S:
        problems.append(
            f"it lasts until {time[-1]:g} s, but the trial {trial.name} ends at {trial.duration:g} s: give the "
            f"scenario that was flown, set duration_s = {math.ceil(time[-1]):d} in a copy of it, or cut the record"
        )
    return problems


def cut_to(trial: scenarios.Trial, record: Record) -> scenarios.Trial:
    """Return the trial, as long as its record."""
    steps = math.ceil(record.time[-1] / trial.cable_step - SAME_TIME_S)
    return dataclasses.replace(trial, duration=steps * trial.cable_step)


def without_repeats(time: np.ndarray, column: np.ndarray, rate: float | None) -> np.ndarray:
    """Return a channel without the repeats of a sensor slower than the record: gaps in their place."""
    if rate is None:
        return column
    turn = np.floor((time - time[0]) * rate + SAME_TIME_S)
    return np.where(np.r_[True, np.diff(turn) > 0], column, np.nan)


REPORTED_COMMANDS = {
    "propeller_command": ("the propeller command", "rev/s", 1.0),
    "rudder_command": ("the rudder command", "degree", DEGREE),
    "stern_plane_port_command": ("the port stern-plane command", "degree", DEGREE),
    "stern_plane_starboard_command": ("the starboard stern-plane command", "degree", DEGREE),
}
"""Channel, in the order of `scenarios.Commands.values` → words, unit, display units per inner unit."""

SAME_COMMAND = 0.05
"""Commands that differ by less are the same: a log rounds. [rev/s, degree]"""

FROM_RECORD, FROM_SCENARIO = "record", "scenario"


def trial_with_commands(trial: scenarios.Trial, record: Record, use: str | None) -> scenarios.Trial:
    """Return the trial with the commands that its vehicle was given.

    Args:
        trial: of the scenario.
        record: with or without columns of commands.
        use: "record" or "scenario" if they may differ; None if they may not.

    Raises:
        UserError: there are no commands, or they differ.
    """
    names = [name for name in REPORTED_COMMANDS if name in record.values]
    if use == FROM_RECORD:
        return _with_recorded_commands(record, names, trial)
    if trial.station is not None:
        return trial
    if trial.commands is None:
        raise UserError(
            f"The scenario {trial.name} prescribes the motion, so nothing tells what the vehicle was commanded. "
            "Give a scenario with commands, or --commands record if the record has the four command columns."
        )
    if use != FROM_SCENARIO:
        _agree(trial, record, names)
    return trial


def _agree(trial: scenarios.Trial, record: Record, names: list[str]) -> None:
    """Raise an error for commands that differ, with the time of the first difference."""
    assert trial.commands is not None
    step = float(np.median(np.diff(record.time))) if record.time.size > 1 else 0.0
    for name in names:
        words, unit, scale = REPORTED_COMMANDS[name]
        column = trial.commands.values[:, list(REPORTED_COMMANDS).index(name)] * scale
        near = [held(trial.commands.time, column, record.time + shift) for shift in (0.0, -step, step)]
        logged = record.values[name]
        far = np.min([np.abs(logged - each) for each in near], axis=0) > SAME_COMMAND
        if far.any():
            same = np.abs(logged - near[0]) <= SAME_COMMAND
            at = int(np.flatnonzero(np.r_[True, same[: int(np.argmax(far))]])[-1])  # they agree until there
            raise UserError(
                f"{record.source}: {words} of the record differs from the scenario's ({trial.name}) from "
                f"t = {record.time[at]:g} s on: {logged[at]:g} against {near[0][at]:g} {unit}. Give the scenario that "
                "was flown (--scenario), or say which commands hold: --commands record or --commands scenario."
            )


def _with_recorded_commands(record: Record, names: list[str], trial: scenarios.Trial) -> scenarios.Trial:
    """Return the trial with the record's commands; columns that it does not have remain those of the scenario."""
    if record.listed:
        return _with_listed_commands(record, trial)
    if not names:
        wanted = ", ".join(BY_NAME[name].column for name in REPORTED_COMMANDS)
        raise UserError(
            f"--commands record: {record.source} has no commands. Add columns of them ({wanted}), or leave the option "
            "away."
        )
    if trial.commands is None and len(names) < len(REPORTED_COMMANDS):
        missing = ", ".join(BY_NAME[name].column for name in REPORTED_COMMANDS if name not in names)
        raise UserError(f"--commands record: {record.source} lacks {missing}, and {trial.name} has none.")
    columns = [_column(record, name, at, trial.commands) for at, name in enumerate(REPORTED_COMMANDS)]
    return dataclasses.replace(trial, commands=_new_commands(record, columns), motion=None)


def _with_listed_commands(record: Record, trial: scenarios.Trial) -> scenarios.Trial:
    """Return the trial with the record's commands of listed actuators, in place of a station; a column that is not
    recorded remains that of the scenario, or zero.
    """
    zero = scenarios.Commands(time=np.zeros(1), values=np.zeros((1, len(REPORTED_COMMANDS))))
    others = trial.commands or zero
    four = [_column(record, name, at, others) for at, name in enumerate(REPORTED_COMMANDS)]
    listed = [
        held(record.time[known], column[known], record.time)
        for column in record.listed.values()
        for known in [np.isfinite(column)]
    ]
    commands = _new_commands(record, [*four, *listed], tuple(record.listed))
    try:
        return dataclasses.replace(trial, commands=commands, motion=None, station=None)
    except scenarios.ScenarioError as error:
        raise UserError(f"{record.source}: its commands are not those of {trial.name}. {error}") from None


def _new_commands(
    record: Record, columns: list[np.ndarray], listed: tuple[str, ...] = ()
) -> scenarios.Commands:
    """Return commands at the times at which they change."""
    values = np.column_stack(columns)
    new = np.flatnonzero(np.r_[True, np.any(np.diff(values, axis=0) != 0.0, axis=1)])
    time = np.where(new == 0, 0.0, record.time[new])
    return scenarios.Commands(time=time, values=np.ascontiguousarray(values[new]), listed=listed)


def _column(record: Record, name: str, at: int, others: scenarios.Commands | None) -> np.ndarray:
    """Return a command at the record's times, in inner units; a gap holds the value before it."""
    if name not in record.values:
        assert others is not None
        return others.at(record.time)[:, at]
    values = record.values[name]
    known = np.isfinite(values)
    filled = held(record.time[known], values[known], record.time)
    return filled if name == "propeller_command" else np.vectorize(radians, otypes=[float])(filled)
