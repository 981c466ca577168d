"""The configuration of a trial is a value, a `Setting`: trial, model and sensors. Effects make new settings from it.

`sensed` gives the readings of the sensors along the track of its simulation, without their noise. A record's
`surge_speed` is what a speed log shows: through the water.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

import scenarios
from scenarios.heading import turned
from subzero.channels import DEGREE, HEADING
from subzero.jit import compiled
from subzero.model import Model
from vehicle.state import QUATERNION, SHAFT, STATE_SIZE, VELOCITY

Value = TypeVar("Value")


def _changed(value: Value, changes: Mapping[str, Any]) -> Value:
    """Return a frozen dataclass with some of its fields changed: `dataclasses.replace` for values without checks, in
    a fifth of the time; a diagnosis makes a hundred thousand of them.
    """
    made, own = object.__new__(type(value)), value.__dict__
    made.__dict__.update(own)
    made.__dict__.update(changes)
    if len(made.__dict__) != len(own):
        unknown = ", ".join(sorted(changes.keys() - own.keys()))
        raise TypeError(f"A {type(value).__name__} has no {unknown}; it has {', '.join(own)}.")
    return made


@dataclass(frozen=True, kw_only=True)
class Sensing:
    """How a sensor's channel differs from what it measures: measured = (1 + scale) × lagged truth + bias.

    Attributes:
        scale: relative excess of the reading. [1]
        bias: in the channel's display unit.
        lag: time constant of a first-order delay. [s]
    """

    scale: float = 0.0
    bias: float = 0.0
    lag: float = 0.0


RIGHT = Sensing()
"""A sensor without error."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Everything that determines the measurements of a trial, but for the noise.

    Attributes:
        trial: commands, start, steps.
        model: vehicle, cable, drum, water.
        sensing: channel → error of its sensor; channels without an entry have none.
        clock_offset: the sensors' clock is late by this: a sample logged at t was taken at t − offset. [s]
        intervals: channel → time between two measurements, where a logger filled in the samples between them. [s]
        sampled: such a measurement was taken later than its time by this share of its interval: ½ if it is the mean
            over the interval that begins there, −½ over the one that ends there. [-]
        tethered: with the cable.
        later: (time [s], model) from which on another model holds, in the order of time.
        most_work: limit of the iterations of the cable's solver times nodes for an exchange of a simulation, on
            average; None for no limit.
    """

    trial: scenarios.Trial
    model: Model
    sensing: Mapping[str, Sensing] = field(default_factory=dict)
    clock_offset: float = 0.0
    intervals: Mapping[str, float] = field(default_factory=dict)
    sampled: float = 0.0
    tethered: bool = True
    later: tuple[tuple[float, Model], ...] = ()
    most_work: float | None = None

    def happened(self, times: np.ndarray, channel: str) -> np.ndarray:
        """Return the true times of a channel's measurements that are logged at some times (n,). [s]"""
        return times - self.clock_offset + self.sampled * self.intervals.get(channel, 0.0)

    def with_vehicle(self, **changes: float | Callable[[float], float]) -> Setting:
        """Return the setting with numbers of the vehicle changed: ``section__key=value or function``."""
        vehicle = self.model.vehicle
        for key, change in changes.items():
            section, name = key.split("__")
            part = getattr(vehicle, section)
            value = change(getattr(part, name)) if callable(change) else change
            vehicle = _changed(vehicle, {section: _changed(part, {name: value})})
        return self.with_model(vehicle=vehicle)

    def with_listed(self, section: str, name: str, **changes: float) -> Setting:
        """Return the setting with numbers of one of a vehicle's list changed, such as of a thruster."""
        vehicle = self.model.vehicle
        rows = tuple(
            (row, _changed(part, changes) if row == name else part) for row, part in getattr(vehicle, section)
        )
        return self.with_model(vehicle=_changed(vehicle, {section: rows}))

    def with_derivative(self, key: str, factor: float) -> Setting:
        """Return the setting with a derivative of the vehicle times a factor."""
        vehicle = self.model.vehicle
        table = tuple(
            (name, factor * value if name == key else value) for name, value in vehicle.derivatives.table
        )
        derivatives = dataclasses.replace(vehicle.derivatives, table=table)  # its matrices are made anew
        return self.with_model(vehicle=_changed(vehicle, {"derivatives": derivatives}))

    def with_cable(self, **changes: float) -> Setting:
        """Return the setting with numbers of the cable changed."""
        return self.with_model(cable=dataclasses.replace(self.model.cable, **changes))

    def with_drum(self, **changes: float) -> Setting:
        """Return the setting with numbers of the drum changed."""
        return self.with_model(drum=dataclasses.replace(self.model.drum, **changes))

    def with_model(self, **changes: Any) -> Setting:
        """Return the setting with parts of the model changed."""
        return _changed(self, {"model": _changed(self.model, changes)})

    def with_start(self, **changes: float) -> Setting:
        """Return the setting with another start."""
        return _changed(self, {"trial": _changed(self.trial, {"start": _changed(self.trial.start, changes)})})

    def with_sensor(self, channel: str, **changes: float) -> Setting:
        """Return the setting with a channel's sensor changed."""
        sensor = _changed(self.sensing.get(channel, RIGHT), changes)
        return _changed(self, {"sensing": {**self.sensing, channel: sensor}})


RUDDER, VOLTAGE, TENSION, LENGTH, WATER = (STATE_SIZE + i for i in range(5))
"""Columns of a track after the state: rudder [rad], battery [V], tension at the tow point [N], wet length [m], and
the velocity of the water in earth axes (three). [m/s]
"""
COLUMNS = STATE_SIZE + 7


def truth(setting: Setting, track: np.ndarray, channel: str) -> np.ndarray:
    """Return the true values of a channel along a setting's track (n,); a heading as it is counted from the start."""
    found = TRUTHS[channel](track)
    return turned(found, DEGREE * setting.trial.start.heading) if channel == HEADING else found


def sensed(sensor: Sensing | None, grid: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the readings of a sensor from the true values on an even grid."""
    if sensor is None:
        return truth
    lagged = _lagged(truth, sensor.lag / (grid[1] - grid[0])) if sensor.lag > 0.0 else truth
    return (1.0 + sensor.scale) * lagged + sensor.bias


def _lagged(truth: np.ndarray, lag: float) -> np.ndarray:
    """Return a first-order delay of values that are linear between samples, exactly; the lag in samples."""
    late = np.array(truth, dtype=float)
    follow(late, lag)
    return late


@compiled
def follow(values: np.ndarray, lag: float) -> None:
    """Replace values (n,) by a first-order delay of them; the lag in samples."""
    keep = np.exp(-1.0 / lag)
    old, new = lag * (1.0 - keep) - keep, 1.0 - lag * (1.0 - keep)
    before = values[0]
    for i in range(1, values.size):
        now = values[i]
        values[i] = keep * values[i - 1] + new * now + old * before
        before = now


def _roll(track: np.ndarray) -> np.ndarray:
    w, x, y, z = track[:, QUATERNION : QUATERNION + 4].T
    return DEGREE * np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


def _pitch(track: np.ndarray) -> np.ndarray:
    w, x, y, z = track[:, QUATERNION : QUATERNION + 4].T
    return DEGREE * np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))


def _heading(track: np.ndarray) -> np.ndarray:
    """Return the heading without its jumps at south, but for whole turns. [degree]"""
    w, x, y, z = track[:, QUATERNION : QUATERNION + 4].T
    found = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    found[1:] -= 2.0 * np.pi * np.cumsum(np.round(np.diff(found) / (2.0 * np.pi)))
    return DEGREE * found


def _surge_through_water(track: np.ndarray) -> np.ndarray:
    """Return u − (Rᵀ J)_x. [m/s]"""
    w, x, y, z = track[:, QUATERNION : QUATERNION + 4].T
    north, east, down = track[:, WATER : WATER + 3].T
    along = (
        (1.0 - 2.0 * (y * y + z * z)) * north + 2.0 * (x * y + w * z) * east + 2.0 * (x * z - w * y) * down
    )
    return track[:, VELOCITY] - along


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
"""Channel → its true values from a track, in its display unit; a heading but for whole turns."""
