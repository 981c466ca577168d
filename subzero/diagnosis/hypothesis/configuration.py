"""The configuration of a trial is a value, a `Setting`: trial, model and sensors. Effects make new settings from it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import scenarios
from subzero.model import Model

Value = TypeVar("Value")


def _changed(value: Value, changes: Mapping[str, Any]) -> Value:
    """Return a frozen dataclass with some of its fields changed: `dataclasses.replace` for values that check nothing,
    in a fifth of the time; a diagnosis makes a hundred thousand of them.
    """
    if not changes.keys() <= value.__dict__.keys():
        unknown = ", ".join(sorted(changes.keys() - value.__dict__.keys()))
        raise TypeError(f"A {type(value).__name__} has no {unknown}; it has {', '.join(value.__dict__)}.")
    made = object.__new__(type(value))
    made.__dict__.update(value.__dict__, **changes)
    return made


@dataclass(frozen=True, kw_only=True)
class Sensing:
    """How a sensor's channel differs from what it measures: measured = (1 + scale) × lagged truth + bias.

    Attributes:
        scale: share that is shown too much. [1]
        bias: in the channel's display unit.
        lag: time constant of a first-order delay. [s]
    """

    scale: float = 0.0
    bias: float = 0.0
    lag: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Everything that decides what is measured in a trial, but for the noise.

    Attributes:
        trial: commands, start, steps.
        model: vehicle, cable, drum, water.
        sensing: channel → how its sensor is wrong; channels without an entry are right.
        clock_offset: the sensors' clock is late by this: what is logged at t happened at t − offset. [s]
        tethered: with the cable.
        later: (time [s], model) from which on another model holds, in the order of time.
    """

    trial: scenarios.Trial
    model: Model
    sensing: Mapping[str, Sensing] = field(default_factory=dict)
    clock_offset: float = 0.0
    tethered: bool = True
    later: tuple[tuple[float, Model], ...] = ()

    def with_vehicle(self, **changes: float | Callable[[float], float]) -> Setting:
        """Return the setting with numbers of the vehicle changed: ``section__key=value or function``."""
        vehicle = self.model.vehicle
        for key, change in changes.items():
            section, name = key.split("__")
            part = getattr(vehicle, section)
            value = change(getattr(part, name)) if callable(change) else change
            vehicle = _changed(vehicle, {section: _changed(part, {name: value})})
        return self.with_model(vehicle=vehicle)

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
        sensor = dataclasses.replace(self.sensing.get(channel, Sensing()), **changes)
        return _changed(self, {"sensing": {**self.sensing, channel: sensor}})
