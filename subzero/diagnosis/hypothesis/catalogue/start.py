"""How the vehicle may lie at the start: never a cause, always free within its tolerance."""

from __future__ import annotations

from collections.abc import Callable
from math import radians

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter


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
    return Effect(id=f"start:{key}", sentence=f"another {key.replace('_', ' ')} at the start", slot="start",
                  parameters=(parameter,), apply=make(key))  # fmt: skip


EFFECTS = (
    _nuisance("heading", "degree", 0.3),
    _nuisance("pitch", "degree", 0.2),
    _nuisance("roll", "degree", 0.3),
    _nuisance("depth", "m", 0.01),
    _nuisance("surge_speed", "m/s", 0.005),
)
"""Each trial has its own."""
