"""What sensors show of a truth by the other formulation, written independently of `response`.

y' = (x − y)/lag,   shown = (1 + scale) y + bias,   at t − clock offset
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.setting import Sensing, Setting
from subzero.environment import water_of

if TYPE_CHECKING:
    from subzero.diagnosis.other_code import Truth

STATE = {"north": 0, "east": 1, "depth": 2, "sway_speed": 8, "heave_speed": 9,
         "roll_rate": 10, "pitch_rate": 11, "yaw_rate": 12, "propeller_speed": 13}  # fmt: skip
"""Channel → its place in the state of the hull."""
SHORT = 0.01
"""A lag of less than this share of a step leaves nothing of the step before. [-]"""


def seen(setting: Setting, truth: Truth, times: np.ndarray, channels: Iterable[str]) -> dict[str, np.ndarray]:
    """Return channel → what its sensor shows at times (n,), in the display unit; NaN behind the end of the truth."""
    grid = truth.run.times
    out = {}
    for name in channels:
        shown = _sensor(setting.sensing.get(name, Sensing()), grid, _true(name, setting, truth))
        out[name] = np.interp(times - setting.clock_offset, grid, shown, right=np.nan)
    return out


def _true(name: str, setting: Setting, truth: Truth) -> np.ndarray:
    """Return what is true of a channel at the times of the run (n,), in its display unit."""
    r, scale = truth.run.recording, BY_NAME[name].scale
    if name in STATE:
        return scale * r.state[:, STATE[name]]
    if name in ("roll", "pitch"):
        return scale * r.attitude[:, ("roll", "pitch").index(name)]
    if name == "heading":
        continuous = np.unwrap(r.attitude[:, 2])
        whole = np.round((setting.trial.start.heading - continuous[0]) / (2.0 * np.pi))
        return scale * (continuous + 2.0 * np.pi * whole)
    return {
        "surge_speed": lambda: r.state[:, 7] - _water(setting, truth)[:, 0],
        "speed_over_ground": lambda: np.sqrt(np.sum(r.state[:, 7:10] ** 2, axis=1)),
        "cable_tension": lambda: np.sqrt(np.sum(truth.pull**2, axis=1)),
        "cable_length": lambda: truth.length,
        "rudder_angle": lambda: scale * r.fins[:, 0],
        "battery_voltage": lambda: r.voltage,
    }[name]()


def _water(setting: Setting, truth: Truth) -> np.ndarray:
    """Return the velocity of the water at the hull, body axes (n, 3). [m/s]"""
    r, times = truth.run.recording, truth.run.times
    changes = [0.0, *(time - 1e-6 for time, _ in setting.later)]
    models = [setting.model, *(model for _, model in setting.later)]
    waters = [water_of(model) for model in models]
    rows = np.searchsorted(changes, times, side="right") - 1
    north_east_down = [
        waters[max(row, 0)].at(place, time)
        for row, place, time in zip(rows, r.state[:, :3], times, strict=True)
    ]
    return np.einsum("nji,nj->ni", r.rotation, np.array(north_east_down))


def _sensor(sensor: Sensing, grid: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return what a sensor shows of a truth (n,) on an even grid: Heun's method in tenths of a step for the lag; for a
    lag far shorter than a step, what was true that much earlier.
    """
    shown, short = truth.copy(), SHORT * (grid[1] - grid[0])
    if 0.0 < sensor.lag < short:
        shown = np.interp(grid - sensor.lag, grid, truth)
    elif sensor.lag > 0.0:
        parts = int(np.ceil(10.0 * max(1.0, (grid[1] - grid[0]) / sensor.lag)))
        h = (grid[1] - grid[0]) / parts / sensor.lag
        y = truth[0]
        for k in range(1, truth.size):
            slope = (truth[k] - truth[k - 1]) / parts
            for part in range(parts):
                x = truth[k - 1] + slope * part
                y += 0.5 * h * (x - y + x + slope - (y + h * (x - y)))
            shown[k] = y
    return (1.0 + sensor.scale) * shown + sensor.bias
