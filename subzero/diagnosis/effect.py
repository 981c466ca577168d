"""What an effect is: data. One value with an id, a sentence, its parameters, and how it changes a setting.

All parameters are deviations from the nominal model, so that 0 is the model as it stands, exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from subzero.diagnosis.setting import Setting

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
        tolerance: τ, how far a healthy vehicle may be from its nominal model (one standard deviation). [unit]
        scale: s, how far when something is wrong (one standard deviation). [unit]
        low, high: deviations that make sense. [unit]
        nominal: what the nominal model has, so that the value can be named as a whole. [unit]
        step: of a sensitivity, if not a share of the tolerance. [unit]
        least: the whole value cannot be less, or not less than the nominal model's if that is less already. [unit]
        begins: nothing is any different before this time of the trial. [s]
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

    def within(self, setting: Setting) -> Parameter:
        """Return the parameter with the bounds that a nominal model leaves it."""
        low = max(self.low, min(self.least - self.nominal(setting), 0.0))
        return replace(self, low=low)


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A cause that a diagnosis can name.

    Attributes:
        id: such as "rudder_lag" or "sensor_bias:heading".
        sentence: what is wrong, in words: "the rudder servo lags".
        slot: where it acts: hull, propulsion, fins, cable, drum, water, start, sensors, clock.
        parameters: one or two.
        apply: what it does to a setting.
        sudden: it can begin in the middle of a trial ("<id>@t").
        channel: the only channel that it can be seen in, for effects of a sensor.
    """

    id: str
    sentence: str
    slot: str
    parameters: tuple[Parameter, ...]
    apply: Apply
    sudden: bool = False
    channel: str = ""
