"""Random truths: every nuisance from its tolerance, and the sizes of hidden effects."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter

from .manoeuvres import effects

Values = Mapping[str, tuple[float, ...]]
"""Effect id → deviations of its parameters."""
SMALLEST, LARGEST, TOLERANCES = 0.6, 1.8, 5.0
"""Sizes of hidden effects in effect scales, and at least so many tolerances."""


def nuisances(rng: np.random.Generator, spread: float = 1.0) -> Values:
    """Return a deviation of every parameter, from `spread` times its tolerance."""
    return {name: tuple(_within(p, spread * p.tolerance * rng.standard_normal()) for p in effect.parameters)
            for name, effect in effects().items()}  # fmt: skip


def _within(p: Parameter, value: float) -> float:
    """Return a value on the side where it can be."""
    return float(np.clip(abs(value) if p.low == 0.0 else value, p.low, p.high))


def hidden(rng: np.random.Generator, one: str, sign: int = 0) -> tuple[float, ...]:
    """Return the deviations of a hidden effect: one parameter of its size, another anywhere within its scale.

    Args:
        rng: random numbers.
        one: the effect.
        sign: of the main parameter, +1 or −1; 0 for any.
    """
    parameters = effects()[one].parameters
    which = int(rng.integers(len(parameters)))
    found = [rng.uniform(-1.0, 1.0) * p.scale for p in parameters]
    found[which] = _size(rng, parameters[which], sign)
    return tuple(float(np.clip(x, p.low, p.high)) for x, p in zip(found, parameters, strict=True))


def _size(rng: np.random.Generator, p: Parameter, sign: int) -> float:
    """Return a size, of a sign that the bounds allow."""
    sides = [side for side in (1, -1) if room(p, side) > 0.0 and sign in (0, side)]
    sides = sides or [side for side in (1, -1) if room(p, side) > 0.0]
    side = int(rng.choice(sides))
    most = room(p, side)
    least = min(max(SMALLEST * p.scale, TOLERANCES * p.tolerance), 0.8 * most)
    return side * float(rng.uniform(least, most))


def room(p: Parameter, side: int) -> float:
    """Return the largest hidden deviation of a parameter on a side; 0 if none is large enough there."""
    most = min(LARGEST * p.scale, 0.95 * (p.high if side > 0 else -p.low))
    return most if most >= TOLERANCES * p.tolerance else 0.0


def with_values(setting: Setting, values: Values, table: Mapping[str, Effect] | None = None) -> Setting:
    """Return a setting with deviations."""
    table = table or effects()
    for name, numbers in values.items():
        if any(numbers):
            setting = table[name].apply(setting, *numbers)
    return setting
