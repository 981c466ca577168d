"""Effects of a single record.

Errors of its sensors and their clock: an effect per channel and kind, made from one table. And the vehicle's state at
the start, never a cause, always free within its tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from math import radians
from typing import NamedTuple

from subzero.channels import BY_NAME
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter
from subzero.errors import chosen


class Spec(NamedTuple):
    """A usual sensor: noise, tolerance of bias, in the display unit; words."""

    noise: float
    bias: float
    words: str


SPECS: dict[str, Spec] = {
    "surge_speed": Spec(0.015, 0.005, "speed log"),
    "heading": Spec(0.4, 0.3, "compass"),
    "yaw_rate": Spec(0.3, 0.05, "yaw gyro"),
    "pitch": Spec(0.2, 0.1, "pitch sensor"),
    "roll_angle": Spec(0.3, 0.15, "roll sensor"),
    "depth": Spec(0.015, 0.01, "depth gauge"),
    "roll_rate": Spec(0.3, 0.05, "roll gyro"),
    "pitch_rate": Spec(0.3, 0.05, "pitch gyro"),
    "sway_speed": Spec(0.015, 0.005, "sway log"),
    "heave_speed": Spec(0.015, 0.005, "heave log"),
    "cable_tension": Spec(0.02, 0.01, "tension cell"),
    "cable_length": Spec(0.05, 0.02, "length counter"),
    "propeller_speed": Spec(0.1, 0.03, "shaft counter"),
    "rudder_angle": Spec(0.2, 0.1, "rudder feedback"),
    "battery_voltage": Spec(0.02, 0.02, "voltmeter"),
    "north": Spec(0.2, 0.1, "northward position"),
    "east": Spec(0.2, 0.1, "eastward position"),
    "speed_over_ground": Spec(0.015, 0.005, "speed over ground"),
}
"""Channel → sensor. A channel that is not in the table cannot be used in a diagnosis."""

NOISE = {name: spec.noise for name, spec in SPECS.items()}
SCALE, LAG = (0.01, 0.10), (0.02, 0.20)
"""Tolerance and effect scale of a sensor's scale [1] and lag [s]; a bias can be ten times its tolerance."""


def _more(kind: str, channel: str, setting: Setting, amount: float) -> Setting:
    """Add to a number of a channel's sensor."""
    sensor = setting.sensing.get(channel)
    old = getattr(sensor, kind) if sensor else 0.0
    return setting.with_sensor(channel, **{kind: old + amount})


def _clock(setting: Setting, seconds: float) -> Setting:
    """Offset of the clock + seconds."""
    from dataclasses import replace

    return replace(setting, clock_offset=setting.clock_offset + seconds)


def sensor_effects(channels: Iterable[str]) -> tuple[Effect, ...]:
    """Return scale, bias and lag of every channel."""
    return tuple(
        effect for channel in channels for effect in _of(channel, chosen(SPECS, channel, "sensor of"))
    )


def _of(channel: str, spec: Spec) -> tuple[Effect, ...]:
    unit = BY_NAME[channel].unit
    rows = (
        (
            "scale",
            "shows too much or too little",
            Parameter(name="share", unit="1", tolerance=SCALE[0], scale=SCALE[1], low=-0.9, high=9.0),
        ),
        (
            "bias",
            "is shifted",
            Parameter(name="shift", unit=unit, tolerance=spec.bias, scale=10.0 * spec.bias),
        ),
        (
            "lag",
            "lags",
            Parameter(name="time_constant", unit="s", tolerance=LAG[0], scale=LAG[1], low=0.0, high=10.0),
        ),
    )
    return tuple(
        Effect(
            id=f"sensor_{kind}:{channel}",
            sentence=f"the {spec.words} {words}",
            slot="sensors",
            parameters=(parameter,),
            apply=partial(_more, kind, channel),
            channel=channel,
        )
        for kind, words, parameter in rows
    )


CLOCK = Effect(
    id="clock_offset",
    sentence="the clocks of commands and sensors differ",
    slot="clock",
    parameters=(Parameter(name="late", unit="s", tolerance=0.01, scale=0.5, low=-3.0, high=3.0),),
    apply=_clock,
)


def _sampled(setting: Setting, share: float) -> Setting:
    """Share of its interval by which a measurement was taken later than its time + share."""
    from dataclasses import replace

    return replace(setting, sampled=setting.sampled + share)


SAMPLED = Effect(
    id="start:sampled",
    sentence="measurements are means over their interval",
    slot="clock",
    parameters=(
        Parameter(name="share", unit="1", tolerance=12.0**-0.5, scale=12.0**-0.5, low=-0.5, high=0.5),
    ),
    apply=_sampled,
)
"""Time within its interval at which a measurement was taken that a logger held, interpolated, or averaged: uniform,
so that the variance is 1/12. Each record has its own, never named.
"""


def _turned(key: str) -> Callable[[Setting, float], Setting]:
    def apply(setting: Setting, angle: float) -> Setting:
        return setting.with_start(**{key: getattr(setting.trial.start, key) + radians(angle)})

    return apply


def _moved(key: str) -> Callable[[Setting, float], Setting]:
    def apply(setting: Setting, amount: float) -> Setting:
        return setting.with_start(**{key: getattr(setting.trial.start, key) + amount})

    return apply


def _nuisance(key: str, unit: str, tolerance: float) -> Effect:
    make = _turned if unit == "degree" else _moved
    parameter = Parameter(name=key, unit=unit, tolerance=tolerance, scale=tolerance)
    return Effect(
        id=f"start:{key}",
        sentence=f"another {key.replace('_', ' ')} at the start",
        slot="start",
        parameters=(parameter,),
        apply=make(key),
    )


START = (
    _nuisance("heading", "degree", 0.3),
    _nuisance("pitch", "degree", 0.2),
    _nuisance("roll", "degree", 0.3),
    _nuisance("depth", "m", 0.01),
    _nuisance("surge_speed", "m/s", 0.005),
)
"""Effects of the start that are free in every trial, with values of its own, and never named."""
