"""Effects of propeller, motor and battery."""

from __future__ import annotations

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter, growing

CHARGE = 60.0
"""Charge that 2 A draw from the battery in 30 s: sag is stated for this charge. [C]"""


def propeller_thrust_gain(setting: Setting, share: float) -> Setting:
    """K_T0 (1 + share)."""
    return setting.with_vehicle(propeller__thrust_constant=lambda old: old * (1.0 + share))


def propeller_thrust_slope(setting: Setting, share: float) -> Setting:
    """K_T1 (1 + share)."""
    return setting.with_vehicle(propeller__thrust_slope=lambda old: old * (1.0 + share))


def motor_lag(setting: Setting, seconds: float) -> Setting:
    """Time constant of the shaft + seconds."""
    return setting.with_vehicle(motor__lag=lambda old: max(old + seconds, 0.0))


def battery_sag(setting: Setting, share: float) -> Setting:
    """Speed lost per charge + share/60 C."""
    return setting.with_vehicle(battery__speed_loss_per_charge=lambda old: old + share / CHARGE)


def propeller_torque(setting: Setting, share: float) -> Setting:
    """K_Q (1 + share) as far as it rolls the hull."""
    return setting.with_vehicle(propeller__reaction_torque_factor=lambda old: old * (1.0 + share))


def _lag(setting: Setting) -> float:
    return setting.model.vehicle.motor.lag


EFFECTS = (
    Effect(
        id="propeller_thrust_gain",
        sentence="the propeller gives another thrust at rest",
        slot="propulsion",
        parameters=(Parameter(name="share", unit="1", tolerance=0.03, scale=0.20, low=-0.9, high=3.0),),
        apply=propeller_thrust_gain,
        sudden=True,
    ),
    Effect(
        id="propeller_thrust_slope",
        sentence="the thrust falls differently with speed",
        slot="propulsion",
        parameters=(Parameter(name="share", unit="1", tolerance=0.04, scale=0.40, low=-2.0, high=4.0),),
        apply=propeller_thrust_slope,
    ),
    Effect(
        id="motor_lag",
        sentence="the motor reaches its speed later or sooner",
        slot="propulsion",
        parameters=(
            Parameter(
                name="time_constant",
                unit="s",
                tolerance=0.03,
                scale=0.6,
                low=-0.24,
                high=5.0,
                least=0.06,
                nominal=_lag,
            ),
        ),
        apply=motor_lag,
    ),
    Effect(
        id="battery_sag",
        sentence="the battery sags, and the shaft with it",
        slot="propulsion",
        parameters=(
            Parameter(name="share_per_60_C", unit="1", tolerance=0.005, scale=0.10, low=0.0, high=0.8),
        ),
        apply=battery_sag,
    ),
    Effect(
        id="propeller_torque",
        sentence="the propeller twists the hull more or less",
        slot="propulsion",
        parameters=(Parameter(name="share", unit="1", tolerance=0.05, scale=0.60, low=-2.0, high=5.0),),
        apply=propeller_torque,
    ),
)
"""To add one: a function (setting, deviation) → setting, and a line here."""

_BY_ID = {effect.id: effect for effect in EFFECTS}
ONSETS = (
    growing(_BY_ID["propeller_thrust_gain"], "fading_thrust", "the thrust of the propeller fades or grows"),
)
"""Effects that grow from an onset on."""
