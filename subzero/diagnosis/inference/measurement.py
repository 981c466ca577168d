"""What the sensors would measure in a setting, without their noise: h(z) of the diagnosis.

The record's `surge_speed` is what a speed log shows: through the water.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import numpy as np

from scenarios.steps import fitting_step
from subzero.channels import DEGREE
from subzero.diagnosis.hypothesis.configuration import Sensing, Setting
from subzero.diagnosis.inference.simulator import LENGTH, RUDDER, TENSION, VOLTAGE, WATER, simulate_track
from subzero.records.record import HEADING, turned
from vehicle.state import QUATERNION, SHAFT, VELOCITY

HULL_STEP_S, CABLE_STEP_S, SEGMENT_M = 0.05, 0.2, 1.0
"""Steps of a diagnosis: errors of 1e-4 m/s and 0.03 degrees on fig6, a twentieth of the sensors' noise, in a third of
the time."""
FINE_STEPS = (0.025, 0.1, 0.25)
"""Hull step, cable step [s] and segment length [m] to measure their errors with."""


def economical(setting: Setting, duration: float) -> Setting:
    """Return a setting in the steps of a diagnosis, no longer than needed; commands stay at their times."""
    trial = setting.trial
    on_grid = trial.commands is None or multiples(trial.commands.time, HULL_STEP_S)
    hull_step = max(trial.hull_step, HULL_STEP_S) if on_grid else trial.hull_step
    cable_step = max(trial.cable_step, CABLE_STEP_S)
    steps = int(np.ceil(min(duration, trial.duration) / cable_step - 1e-9))
    made = replace(trial, hull_step=fitting_step(cable_step, hull_step), cable_step=cable_step,
                   duration=steps * cable_step, segment_length=max(trial.segment_length, SEGMENT_M))  # fmt: skip
    return replace(setting, trial=made)


def finer(setting: Setting) -> Setting:
    """Return a setting in steps that are fine, to see what economical ones get wrong."""
    hull_step, cable_step, segment = FINE_STEPS
    trial = setting.trial
    cable_step = min(trial.cable_step, cable_step)
    made = replace(trial, hull_step=fitting_step(cable_step, min(trial.hull_step, hull_step)), cable_step=cable_step,
                   segment_length=min(trial.segment_length, segment))  # fmt: skip
    return replace(setting, trial=made)


def multiples(times: np.ndarray, step: float) -> bool:
    """Say whether all times are whole multiples of a step."""
    return bool(np.all(np.abs(times / step - np.round(times / step)) < 1e-6))


def respond(setting: Setting, times: np.ndarray, channels: Iterable[str]) -> dict[str, np.ndarray]:
    """Return what the sensors would show.

    Args:
        setting: of the trial.
        times: when they are read (n,). [s]
        channels: names of `subzero.channels`, of those in `TRUTHS`.

    Returns:
        channel → values (n,) in its display unit; NaN from where the run could not go on. Behind its end the last hold.
    """
    grid, track = simulate_track(setting)
    earlier = times - setting.clock_offset
    return {
        name: np.interp(earlier, grid, sensed(setting.sensing.get(name), grid, truth(setting, track, name)))
        for name in channels
    }


def truth(setting: Setting, track: np.ndarray, channel: str) -> np.ndarray:
    """Return what is true of a channel along a setting's track (n,); a heading as it is counted from the start."""
    found = TRUTHS[channel](track)
    return turned(found, DEGREE * setting.trial.start.heading) if channel == HEADING else found


def sensed(sensor: Sensing | None, grid: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return what a sensor makes of the truth on an even grid."""
    if sensor is None:
        return truth
    lagged = _lagged(truth, sensor.lag / (grid[1] - grid[0])) if sensor.lag > 0.0 else truth
    return (1.0 + sensor.scale) * lagged + sensor.bias


def _lagged(truth: np.ndarray, lag: float) -> np.ndarray:
    """Return a first-order delay of values that are linear between samples, exactly; the lag in samples."""
    from scipy.signal import lfilter

    keep = np.exp(-1.0 / lag)
    old, new = lag * (1.0 - keep) - keep, 1.0 - lag * (1.0 - keep)
    return lfilter([new, old], [1.0, -keep], truth, zi=[truth[0] * (1.0 - new)])[0]


def _roll(track: np.ndarray) -> np.ndarray:
    w, x, y, z = track[:, QUATERNION : QUATERNION + 4].T
    return DEGREE * np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


def _pitch(track: np.ndarray) -> np.ndarray:
    w, x, y, z = track[:, QUATERNION : QUATERNION + 4].T
    return DEGREE * np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))


def _heading(track: np.ndarray) -> np.ndarray:
    """Return the heading without its jumps at south, but for whole turns. [degree]"""
    w, x, y, z = track[:, QUATERNION : QUATERNION + 4].T
    return DEGREE * np.unwrap(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def _surge_through_water(track: np.ndarray) -> np.ndarray:
    """Return u − (Rᵀ J)_x. [m/s]"""
    w, x, y, z = track[:, QUATERNION : QUATERNION + 4].T
    forward = np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)], axis=1)
    return track[:, VELOCITY] - np.sum(forward * track[:, WATER : WATER + 3], axis=1)


def _over_ground(track: np.ndarray) -> np.ndarray:
    return np.linalg.norm(track[:, VELOCITY : VELOCITY + 3], axis=1)


def _column(at: int, scale: float = 1.0) -> Callable[[np.ndarray], np.ndarray]:
    return lambda track: scale * track[:, at]


TRUTHS: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "north": _column(0),
    "east": _column(1),
    "depth": _column(2),
    "roll_angle": _roll,
    "pitch": _pitch,
    "heading": _heading,
    "surge_speed": _surge_through_water,
    "sway_speed": _column(VELOCITY + 1),
    "heave_speed": _column(VELOCITY + 2),
    "roll_rate": _column(VELOCITY + 3, DEGREE),
    "pitch_rate": _column(VELOCITY + 4, DEGREE),
    "yaw_rate": _column(VELOCITY + 5, DEGREE),
    "speed_over_ground": _over_ground,
    "propeller_speed": _column(SHAFT),
    "rudder_angle": _column(RUDDER, DEGREE),
    "battery_voltage": _column(VOLTAGE),
    "cable_tension": _column(TENSION),
    "cable_length": _column(LENGTH),
}
"""Channel → what is true of it, from a track, in its display unit; a heading but for whole turns."""
