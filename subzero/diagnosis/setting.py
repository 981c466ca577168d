"""A setting is a value: a trial, a model, and the sensors that look at it. Effects make new settings from it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import scenarios
from subzero.model import Model


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
            vehicle = dataclasses.replace(vehicle, **{section: dataclasses.replace(part, **{name: value})})
        return self.with_model(vehicle=vehicle)

    def with_cable(self, **changes: float) -> Setting:
        """Return the setting with numbers of the cable changed."""
        return self.with_model(cable=dataclasses.replace(self.model.cable, **changes))

    def with_drum(self, **changes: float) -> Setting:
        """Return the setting with numbers of the drum changed."""
        return self.with_model(drum=dataclasses.replace(self.model.drum, **changes))

    def with_model(self, **changes: Any) -> Setting:
        """Return the setting with parts of the model changed."""
        return dataclasses.replace(self, model=dataclasses.replace(self.model, **changes))

    def with_start(self, **changes: float) -> Setting:
        """Return the setting with another start."""
        start = dataclasses.replace(self.trial.start, **changes)
        return dataclasses.replace(self, trial=dataclasses.replace(self.trial, start=start))

    def with_sensor(self, channel: str, **changes: float) -> Setting:
        """Return the setting with a channel's sensor changed."""
        sensor = dataclasses.replace(self.sensing.get(channel, Sensing()), **changes)
        return dataclasses.replace(self, sensing={**self.sensing, channel: sensor})
