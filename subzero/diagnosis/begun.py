"""An effect that begins in the middle of a trial: a fin struck at 12 s, the cable caught at 20 s.

θ(t) = θ₀ for t < t₀,  θ₀ + z from t₀ on
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from subzero.diagnosis.effect import Effect, Parameter
from subzero.diagnosis.setting import Setting
from subzero.model import Model

EDGE, STEP = 1.0, 0.4
"""Nothing begins closer to the ends of a record; step of the sensitivity to the time: whole steps of the cable. [s]"""
CLOSE = 0.5
"""Sensitivities hold as long as the time moves less than this. [s]"""


def begun_at(effect: Effect, time: float) -> Effect:
    """Return the effect as it begins at a time [s]: id "<id>@<time>". To be applied after all that hold throughout."""
    return replace(
        effect,
        id=f"{effect.id}@{time:g}",
        sentence=f"from {time:g} s on {effect.sentence}",
        apply=partial(_from_then_on, effect, time),
        sudden=False,
    )


def beginning(effect: Effect, time: float, end: float) -> Effect:
    """Return the effect as it begins at about a time [s] of a trial until `end`: when exactly is its last parameter, as
    likely at any time.
    """
    begins = Parameter(name="start_time", unit="s", tolerance=CLOSE, scale=end / np.sqrt(2.0 * np.pi),
                       low=EDGE - time, high=end - EDGE - time, step=STEP)  # fmt: skip
    at = begun_at(effect, time)
    return replace(at, parameters=(*effect.parameters, begins), apply=partial(_from_about, effect, time))


def _from_about(effect: Effect, time: float, setting: Setting, *deviations: float) -> Setting:
    return _from_then_on(effect, time + deviations[-1], setting, *deviations[:-1])


def _from_then_on(effect: Effect, time: float, setting: Setting, *deviations: float) -> Setting:
    """Return a setting that has an effect from a time on, beside all other changes in mid-trial.

    Models change between two exchanges only: in the one that the effect begins in, it has the share that is left.
    """
    if time <= 0.0:
        return effect.apply(setting, *deviations)
    step = setting.trial.cable_step
    first = step * np.floor(time / step + 1e-6)
    share = min(1.0 - (time - first) / step, 1.0)
    base = [setting.model, *(model for begin, model in setting.later if begin <= first)][-1]
    before = [pair for pair in setting.later if pair[0] < first]
    after = [pair for pair in setting.later if pair[0] > first]
    if share < 1.0 - 1e-6:
        before += [(first, _changed(effect, setting, base, *(share * one for one in deviations)))]
        first += step
    changed = [
        (when, _changed(effect, setting, model, *deviations)) for when, model in [(first, base), *after]
    ]
    return replace(setting, later=(*before, *changed))


def _changed(effect: Effect, setting: Setting, model: Model, *deviations: float) -> Model:
    """Return a model with an effect."""
    return effect.apply(replace(setting, model=model), *deviations).model
