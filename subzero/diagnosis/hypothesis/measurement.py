"""What sensors make of the track of a simulation, without their noise.

The record's `surge_speed` is what a speed log shows: through the water.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from subzero.channels import DEGREE, HEADING, turned
from vehicle.state import QUATERNION, SHAFT, STATE_SIZE, VELOCITY

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Sensing, Setting

RUDDER, VOLTAGE, TENSION, LENGTH, WATER = (STATE_SIZE + i for i in range(5))
"""Columns of a track behind the state: rudder [rad], battery [V], tension at the tow point [N], wet length [m], and the
velocity of the water in earth axes (three). [m/s]"""
COLUMNS = STATE_SIZE + 7


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
