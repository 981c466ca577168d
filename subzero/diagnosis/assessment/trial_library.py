"""Trials worth flying, in one table: each makes another setting from the present one.

All keep its vehicle, cable and start; commands are at whole tenths of a second, rudder and stern-planes well within
stall, the propeller below what the battery allows. To add one: a function (setting) → setting, and a line in LIBRARY.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import pi, radians
from typing import TYPE_CHECKING

import numpy as np

import scenarios
from scenarios.steps import held

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Setting

RUDDER_AMPLITUDE, PLANE_AMPLITUDE = radians(8.0), radians(1.5)
"""Amplitudes of rudder and stern-planes. [rad]"""
DRIVE_SHARE = 0.95
"""Share of the propeller's highest speed that is used."""

Row = tuple[float, float, float, float, float]
"""Time [s], propeller [rev/s], rudder, port and starboard stern-plane [rad]."""


def cruise(setting: Setting) -> float:
    """Return the propeller speed that the trial is flown at. [rev/s]"""
    assert setting.trial.commands is not None
    return float(np.abs(setting.trial.commands.values[:, 0]).max())


def fastest(setting: Setting) -> float:
    """Return the highest propeller speed that is used. [rev/s]"""
    vehicle = setting.model.vehicle
    return DRIVE_SHARE * vehicle.motor.speed_per_volt * vehicle.battery.full_voltage


def flown(setting: Setting, rows: Sequence[Row], duration: float) -> Setting:
    """Return the setting with other commands and another duration [s]; listed actuators keep theirs.

    >>> import subzero
    >>> from subzero.diagnosis import Setting
    >>> glider = subzero.load_scenario("glider_sawtooth")
    >>> given = Setting(trial=glider, model=subzero.Model.of(glider))
    >>> commands = flown(given, [(0.0, 5.0, 0.0, 0.0, 0.0), (400.0, 7.0, 0.0, 0.0, 0.0)], 500.0).trial.commands
    >>> commands.listed
    ('battery_slide', 'battery_turn', 'bladder')
    >>> commands.at(np.array([0.0, 300.0, 400.0]))[:, [0, 4, 6]].tolist()
    [[5.0, 0.02, -0.0003], [5.0, -0.02, 0.0003], [7.0, -0.02, 0.0003]]
    """
    table, before = np.array(rows, dtype=float), setting.trial.commands
    assert before is not None
    time = np.union1d(table[:, 0], before.time) if before.listed else table[:, 0].copy()
    values = np.column_stack(
        [held(table[:, 0], table[:, 1:], time), before.at(time)[:, table.shape[1] - 1 :]]
    )
    commands = scenarios.Commands(time=time, values=values, listed=before.listed)
    return replace(setting, trial=replace(setting.trial, commands=commands, duration=duration, motion=None))


def rows_of(setting: Setting) -> tuple[Row, ...]:
    """Return the commands of a setting as rows."""
    commands = setting.trial.commands
    assert commands is not None
    four = commands.values[:, :4]
    return tuple((float(t), *map(float, row)) for t, row in zip(commands.time, four, strict=True))  # type: ignore[misc]


def _rudder(setting: Setting, steps: Sequence[tuple[float, float]], duration: float) -> Setting:
    """Return a trial at cruise with rudder steps (time [s], share of RUDDER_AMPLITUDE)."""
    n = cruise(setting)
    return flown(
        setting,
        [(0.0, n, 0.0, 0.0, 0.0), *((t, n, x * RUDDER_AMPLITUDE, 0.0, 0.0) for t, x in steps)],
        duration,
    )


def _planes(setting: Setting, steps: Sequence[tuple[float, float, float]], duration: float) -> Setting:
    """Return a trial at cruise with steps of stern-planes: time [s], shares of PLANE_AMPLITUDE (port, starboard)."""
    n = cruise(setting)
    moved = ((t, n, 0.0, a * PLANE_AMPLITUDE, b * PLANE_AMPLITUDE) for t, a, b in steps)
    return flown(setting, [(0.0, n, 0.0, 0.0, 0.0), *moved], duration)


def _propeller(setting: Setting, steps: Sequence[tuple[float, float]], duration: float) -> Setting:
    """Return a straight trial with steps of the propeller (time [s], share of cruise)."""
    top = fastest(setting)
    return flown(setting, [(t, min(x * cruise(setting), top), 0.0, 0.0, 0.0) for t, x in steps], duration)


def _at_speed(setting: Setting, factor: float) -> Setting:
    """Return the same trial with the propeller turning faster or slower."""
    top = fastest(setting)
    rows = [(t, float(np.clip(factor * n, -top, top)), *fins) for t, n, *fins in rows_of(setting)]
    return flown(setting, rows, setting.trial.duration)  # type: ignore[arg-type]


def rudder_doublets(setting: Setting) -> Setting:
    """Quick doublets of the rudder, small and large."""
    steps = [
        (8, 0.5),
        (10, -0.5),
        (12, 0),
        (16, 1),
        (18, -1),
        (20, 0),
        (24, 1),
        (25, -1),
        (26, 1),
        (27, -1),
        (28, 0),
    ]
    return _rudder(setting, steps, 34.0)


def zigzag(setting: Setting) -> Setting:
    """The rudder over, every five seconds."""
    return _rudder(
        setting, [(6, 0.5), (8, -0.5), (13, 0.5), (18, -0.5), (23, 0.5), (28, -0.5), (30.5, 0)], 36.0
    )


def steady_turn(setting: Setting) -> Setting:
    """A turn with the rudder held, then straight on."""
    return _rudder(setting, [(8, 0.5), (24, 0)], 36.0)


def coast_down(setting: Setting) -> Setting:
    """The propeller stopped at speed."""
    return _propeller(setting, [(0, 1.0), (15, 0.0)], 40.0)


def stop_and_go(setting: Setting) -> Setting:
    """The propeller off and on again."""
    return _propeller(setting, [(0, 1.0), (10, 0.0), (16, 1.0), (26, 0.5), (34, 1.0)], 44.0)


def reversed_heading(setting: Setting) -> Setting:
    """The same commands, the other way."""
    return setting.with_start(heading=setting.trial.start.heading + pi)


def slower(setting: Setting) -> Setting:
    """The same commands at 56 % of the propeller's speed."""
    return _at_speed(setting, 0.56)


def faster(setting: Setting) -> Setting:
    """The same commands at twice the propeller's speed, or what the battery allows."""
    return _at_speed(setting, 2.0)


def untethered(setting: Setting) -> Setting:
    """The same commands without the cable."""
    return replace(setting, tethered=False)


def longer(setting: Setting) -> Setting:
    """The same commands, the last of them held for as long again."""
    return flown(setting, rows_of(setting), 2.0 * setting.trial.duration)


def plane_doublets(setting: Setting) -> Setting:
    """Doublets of both stern-planes alike."""
    return _planes(setting, [(8, 1, 1), (10, -1, -1), (12, 0, 0), (20, 2, 2), (21, -2, -2), (22, 0, 0)], 30.0)


def roll_doublets(setting: Setting) -> Setting:
    """Doublets of the stern-planes against each other."""
    return _planes(setting, [(8, 1, -1), (10, -1, 1), (12, 0, 0), (16, 2, -2), (17, -2, 2), (18, 0, 0)], 26.0)


def rich(setting: Setting) -> Setting:
    """Doublets of rudder and stern-planes, steps of speed, and the propeller stopped: a minute."""
    n, r, s = cruise(setting), RUDDER_AMPLITUDE, PLANE_AMPLITUDE
    fast = min(1.2 * n, fastest(setting))
    rows: list[Row] = [
        (0, n, 0, 0, 0),
        (6, n, r, 0, 0),
        (8, n, -r, 0, 0),
        (10, n, 0, 0, 0),
        (14, 0.6 * n, 0, 0, 0),
        (20, 0.6 * n, r, 0, 0),
        (21.5, 0.6 * n, -r, 0, 0),
        (23, 0.6 * n, 0, 0, 0),
        (26, fast, 0, 0, 0),
        (30, fast, 0, s, s),
        (32, fast, 0, -s, -s),
        (34, fast, 0, 0, 0),
        (38, fast, -0.5 * r, 0, 0),
        (44, fast, 0, 0, 0),
        (48, 0, 0, 0, 0),
    ]
    return flown(setting, rows, 60.0)


LIBRARY: dict[str, tuple[str, Callable[[Setting], Setting]]] = {
    "rudder_doublets": ("Fly doublets of the rudder, quick ones, small and large.", rudder_doublets),
    "reversed_heading": ("Fly the same trial with the heading reversed.", reversed_heading),
    "coast_down": ("Stop the propeller at full speed and let the vehicle coast.", coast_down),
    "untethered": ("Fly the same trial without the cable.", untethered),
    "zigzag": ("Fly a zigzag: put the rudder over every five seconds.", zigzag),
    "steady_turn": ("Fly a turn with the rudder held for 16 s, then straight on.", steady_turn),
    "stern_plane_doublets": ("Fly doublets of both stern-planes alike.", plane_doublets),
    "roll_doublets": ("Fly doublets of the stern-planes against each other.", roll_doublets),
    "stop_and_go": ("Stop the propeller, start it again, and change its speed.", stop_and_go),
    "slower": ("Fly the same trial at 56 % of the propeller's speed.", slower),
    "faster": ("Fly the same trial as fast as the propeller goes, up to twice its speed.", faster),
    "longer": ("Fly the same trial for twice as long.", longer),
    "rich": ("Fly a minute with doublets of all fins, steps of speed and a coast-down.", rich),
}
"""Name → instructions, in words; and the function that makes it from the present trial. Simple ones first: they are
preferred.
"""

CHANNELS: dict[str, str] = {
    "speed_over_ground": "Log the speed over ground, too.",
    "cable_tension": "Log the tension of the cable, too.",
    "rudder_angle": "Log the angle of the rudder, too.",
    "propeller_speed": "Log the speed of the propeller, too.",
}
"""Channels worth adding → instructions, in words."""
