"""What the actuators were told: in the scenario, in the record, or in both, which then have to agree."""

from __future__ import annotations

import dataclasses
from math import radians

import numpy as np

import scenarios
from subzero.channels import BY_NAME, DEGREE
from subzero.errors import UserError
from subzero.records.record import Record

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
        return _told_by(record, names, trial)
    if trial.commands is None:
        raise UserError(
            f"The scenario {trial.name} prescribes the motion, so nothing tells what the vehicle was commanded. "
            "Give a scenario with commands, or --commands record if the record has the four command columns."
        )
    if use != FROM_SCENARIO:
        _agree(trial, record, names)
    return trial


def _agree(trial: scenarios.Trial, record: Record, names: list[str]) -> None:
    """Refuse commands that differ, and say from when on."""
    assert trial.commands is not None
    step = float(np.median(np.diff(record.time))) if record.time.size > 1 else 0.0
    for name in names:
        words, unit, scale = REPORTED_COMMANDS[name]
        column = trial.commands.values[:, list(REPORTED_COMMANDS).index(name)] * scale
        near = [
            held_commands(trial.commands.time, column, record.time + shift) for shift in (0.0, -step, step)
        ]
        logged = record.values[name]
        far = np.min([np.abs(logged - one) for one in near], axis=0) > SAME_COMMAND
        if far.any():
            same = np.abs(logged - near[0]) <= SAME_COMMAND
            at = int(np.flatnonzero(np.r_[True, same[: int(np.argmax(far))]])[-1])  # they agree until there
            raise UserError(
                f"{record.source}: {words} of the record differs from the scenario's ({trial.name}) from "
                f"t = {record.time[at]:g} s on: {logged[at]:g} against {near[0][at]:g} {unit}. Give the scenario that "
                "was flown (--scenario), or say which commands hold: --commands record or --commands scenario."
            )


def held_commands(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return values that each hold until the next, at other times; the first one holds before it."""
    return values[np.clip(np.searchsorted(time, at + 1e-9, side="right") - 1, 0, None)]


def _told_by(record: Record, names: list[str], trial: scenarios.Trial) -> scenarios.Trial:
    """Return the trial with the record's commands; columns that it does not have stay the scenario's."""
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
    values = np.column_stack(columns)
    new = np.flatnonzero(np.r_[True, np.any(np.diff(values, axis=0) != 0.0, axis=1)])
    time = np.where(new == 0, 0.0, record.time[new])
    commands = scenarios.Commands(time=time, values=np.ascontiguousarray(values[new]))
    return dataclasses.replace(trial, commands=commands, motion=None)


def _column(record: Record, name: str, at: int, others: scenarios.Commands | None) -> np.ndarray:
    """Return a command at the record's times, in inner units; a gap holds what was before it."""
    if name not in record.values:
        assert others is not None
        return held_commands(others.time, others.values[:, at], record.time)
    values = record.values[name]
    known = np.isfinite(values)
    filled = held_commands(record.time[known], values[known], record.time)
    return filled if name == "propeller_command" else np.vectorize(radians, otypes=[float])(filled)
