"""An effect as data: an id, a sentence, its parameters, and how it changes a setting; throughout, or from an onset
on.

θ = θ₀ + z                                          throughout; z = 0 is the nominal model, exactly
θ(t) = θ₀ for t < t₀,   θ₀ + z from t₀ on           with an onset: a fin struck at 12 s, the cable caught at 20 s
θ(t) = θ₀ + z max(t − t₀, 0)                        one that grows from its onset on: a hull that floods
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from subzero.arguments import checked_arguments
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.model import Model

Apply = Callable[..., Setting]
"""(setting, *deviations) → the setting with them."""


def nothing(setting: Setting) -> float:
    """Return the nominal value of a parameter that a model without the effect does not have."""
    return 0.0


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A number that an effect changes, as a deviation from the nominal model.

    Attributes:
        name: short, such as "time_constant".
        unit: as it is shown; "1" for a share.
        tolerance: τ, deviation of a healthy vehicle from its nominal model (one standard deviation). [unit]
        scale: s, deviation when something is wrong (one standard deviation). [unit]
        low, high: bounds of possible deviations. [unit]
        nominal: value in the nominal model, so that the whole value can be reported. [unit]
        step: of a sensitivity, if not a share of the tolerance. [unit]
        least: the whole value cannot be less, or not less than the nominal model's if that is less already. [unit]
        begins: time of the trial before which it changes nothing. [s]
        also_of: another effect that can do the same: a jammed rudder's angle is also an offset.
    """

    name: str
    unit: str
    tolerance: float
    scale: float
    low: float = -float("inf")
    high: float = float("inf")
    nominal: Callable[[Setting], float] = nothing
    step: float = 0.0
    least: float = -float("inf")
    begins: float = 0.0
    also_of: str = ""

    def within(self, setting: Setting) -> Parameter:
        """Return the parameter with the bounds that a nominal model leaves it."""
        low = max(self.low, min(self.least - self.nominal(setting), 0.0))
        return replace(self, low=low)


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A cause that a diagnosis can name.

    Attributes:
        id: such as "rudder_lag" or "sensor_bias:heading".
        sentence: its description in words: "the rudder servo lags".
        slot: where it acts: hull, propulsion, thrusters, fins, cable, drum, water, start, sensors, clock.
        parameters: one or two.
        apply: changes a setting.
        sudden: it can begin in the middle of a trial ("<id>@t").
        channel: the only channel that it changes, for effects of a sensor.
        grows: id of the effect that grows from an onset on; its deviations are per minute then. "" for none.
    """

    id: str
    sentence: str
    slot: str
    parameters: tuple[Parameter, ...]
    apply: Apply
    sudden: bool = False
    channel: str = ""
    grows: str = ""


MINUTE_S = 60.0
"""Growth is reported per minute. [s]"""
USUAL_GROWTH_S = 15.0
"""A growing effect usually reaches the size of a usual effect in about this time. [s]"""
GROWTH_STEP_S = 1.0
"""Interval between changes of a growing model: with 0.1 s instead no channel of fig6 changes by a twentieth of its
noise. [s]
"""


def growing(effect: Effect, id: str, sentence: str) -> Effect:
    """Return the effect that grows in proportion to the time since an onset; its deviations are per minute."""
    faster = MINUTE_S / USUAL_GROWTH_S
    rates = tuple(
        replace(
            parameter,
            unit=f"{parameter.unit}/min",
            tolerance=faster * parameter.tolerance,
            scale=faster * parameter.scale,
            low=faster * parameter.low,
            high=faster * parameter.high,
            nominal=nothing,
            least=-np.inf,
        )
        for parameter in effect.parameters
    )
    apply = partial(_within_bounds, effect)
    return replace(
        effect, id=id, sentence=sentence, parameters=rates, apply=apply, sudden=True, grows=effect.id
    )


def _within_bounds(effect: Effect, setting: Setting, *deviations: float) -> Setting:
    """Return a setting with deviations of an effect that have grown, limited to their bounds."""
    values = (min(max(z, p.low), p.high) for z, p in zip(deviations, effect.parameters, strict=True))
    return effect.apply(setting, *values)


MIN_MARGIN_S, ONSET_STEP_S = 1.0, 0.4
"""Least distance of an onset from the ends of a record; step of the sensitivity to the onset: whole steps of the
cable. [s]
"""
ONSET_LINEAR_WITHIN_S = 0.5
"""Sensitivities hold while the onset moves by less than this. [s]"""


@checked_arguments
def with_onset(effect: Effect, time: float) -> Effect:
    """Return the effect with an onset [s]: id "<id>@<time>". To be applied after all that hold throughout."""
    return replace(
        effect,
        id=f"{effect.id}@{time:g}",
        sentence=f"from {time:g} s on {effect.sentence}",
        apply=partial(_from_then_on, effect, time),
        sudden=False,
    )


def plain_id(name: str) -> str:
    """Return the id of an effect without its onset: ``hull_drag@12`` → hull_drag."""
    return name.partition("@")[0]


@checked_arguments
def with_free_onset(effect: Effect, time: float, end: float) -> Effect:
    """Return the effect with an onset near a time [s] of a trial until `end`: the onset is its last parameter, with a
    uniform prior.
    """
    begins = Parameter(
        name="start_time",
        unit="s",
        tolerance=ONSET_LINEAR_WITHIN_S,
        scale=end / np.sqrt(2.0 * np.pi),
        low=MIN_MARGIN_S - time,
        high=end - MIN_MARGIN_S - time,
        step=ONSET_STEP_S,
    )
    at = with_onset(effect, time)
    return replace(at, parameters=(*effect.parameters, begins), apply=partial(_from_about, effect, time))


def _from_about(effect: Effect, time: float, setting: Setting, *deviations: float) -> Setting:
    return _from_then_on(effect, time + deviations[-1], setting, *deviations[:-1])


def _from_then_on(effect: Effect, time: float, setting: Setting, *deviations: float) -> Setting:
    """Return a setting that has an effect from a time on, added to all other changes in mid-trial.

    Models change between two exchanges only: in the exchange that the effect begins in, it has the remaining share.
    """
    if effect.grows:
        return _growing_from(effect, time, setting, *deviations)
    if time <= 0.0:
        return effect.apply(setting, *deviations)
    step = setting.trial.cable_step
    first = step * np.floor(time / step + 1e-6)
    share = min(1.0 - (time - first) / step, 1.0)
    base = [setting.model, *(model for begin, model in setting.later if begin <= first)][-1]
    before = [pair for pair in setting.later if pair[0] < first]
    after = [pair for pair in setting.later if pair[0] > first]
    if share < 1.0 - 1e-6:
        before += [(first, _changed(effect, setting, base, *(share * deviation for deviation in deviations)))]
        first += step
    changed = [
        (when, _changed(effect, setting, model, *deviations)) for when, model in [(first, base), *after]
    ]
    return replace(setting, later=(*before, *changed))


def _growing_from(effect: Effect, time: float, setting: Setting, *rates: float) -> Setting:
    """Return a setting in which an effect grows from a time on, added to all other changes in mid-trial.

    In each interval between two changes the model has the mean of what has grown by then, which keeps the order of
    accuracy of a simulation whose models change in steps, and makes it smooth in the onset.
    """
    exchange, end = setting.trial.cable_step, setting.trial.duration
    step = exchange * max(round(GROWTH_STEP_S / exchange), 1)
    grid = step * np.arange(np.floor(max(time, 0.0) / step + 1e-6), np.ceil(end / step - 1e-6))
    before = (
        [pair for pair in setting.later if pair[0] < grid[0] - 1e-9] if grid.size else list(setting.later)
    )
    begins = sorted({*np.round(grid, 9).tolist(), *(when for when, _ in setting.later[len(before) :])})
    changed = []
    for begin, next_one in zip(begins, [*begins[1:], end], strict=True):
        grown = _mean_growth(begin - time, next_one - time) / MINUTE_S
        base = [setting.model, *(model for when, model in setting.later if when <= begin + 1e-9)][-1]
        changed.append((begin, _changed(effect, setting, base, *(grown * rate for rate in rates))))
    first = [model for when, model in changed if when <= 0.0]
    later = (*before, *((when, model) for when, model in changed if when > 0.0))
    return replace(setting, later=later, model=first[-1] if first else setting.model)


def _mean_growth(start: float, end: float) -> float:
    """Return the mean of max(t, 0) between two times after an onset. [s]"""
    return 0.5 * (max(end, 0.0) ** 2 - max(start, 0.0) ** 2) / max(end - start, 1e-9)


def _changed(effect: Effect, setting: Setting, model: Model, *deviations: float) -> Model:
    """Return a model with an effect."""
    return effect.apply(replace(setting, model=model), *deviations).model
