"""Effects of the cable, the drum and the water."""

from __future__ import annotations

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter

GRAVITY = 9.81


def cable_tangential_drag(setting: Setting, share: float) -> Setting:
    """C_t (1 + share)."""
    old = setting.model.cable.tangential_drag_coefficient
    return setting.with_cable(tangential_drag_coefficient=old * (1.0 + share))


def cable_normal_drag(setting: Setting, share: float) -> Setting:
    """C_n (1 + share)."""
    old = setting.model.cable.normal_drag_coefficient
    return setting.with_cable(normal_drag_coefficient=old * (1.0 + share))


def cable_initial_length(setting: Setting, metres: float) -> Setting:
    """S(0) + metres."""
    return setting.with_start(wet_length=max(setting.trial.start.wet_length + metres, 0.0))


def cable_weight(setting: Setting, weight: float) -> Setting:
    """Mass per length + weight/g."""
    old = setting.model.cable.mass_per_length
    return setting.with_cable(mass_per_length=max(old + weight / GRAVITY, 0.1 * old))


def drum_friction(setting: Setting, force: float) -> Setting:
    """Friction torque + force · R."""
    drum = setting.model.drum
    return setting.with_drum(friction_torque=max(drum.friction_torque + force * drum.radius, 0.0))


def drum_inertia(setting: Setting, mass: float) -> Setting:
    """I_d + mass · R²."""
    drum = setting.model.drum
    return setting.with_drum(inertia=max(drum.inertia + mass * drum.radius**2, 0.0))


def current(setting: Setting, north: float, east: float) -> Setting:
    """A uniform current, northward and eastward."""
    old = setting.model.current
    return setting.with_model(current=(old[0] + north, old[1] + east, old[2]))


def _wet_length(setting: Setting) -> float:
    return setting.trial.start.wet_length


def _friction(setting: Setting) -> float:
    return setting.model.drum.friction_torque / setting.model.drum.radius


def _inertia(setting: Setting) -> float:
    return setting.model.drum.inertia / setting.model.drum.radius**2


def _weight(setting: Setting) -> float:
    cable = setting.model.cable
    return (cable.mass_per_length - cable.water_density * cable.cross_section_area) * GRAVITY


def _velocity(name: str) -> Parameter:
    return Parameter(name=name, unit="m/s", tolerance=0.005, scale=0.2, low=-1.5, high=1.5)


EFFECTS = (
    Effect(
        id="cable_tangential_drag",
        sentence="the cable drags more or less along itself",
        slot="cable",
        parameters=(Parameter(name="share", unit="1", tolerance=0.05, scale=0.60, low=-0.95, high=10.0),),
        apply=cable_tangential_drag,
        sudden=True,
    ),
    Effect(
        id="cable_normal_drag",
        sentence="the cable drags more or less across itself",
        slot="cable",
        parameters=(Parameter(name="share", unit="1", tolerance=0.10, scale=0.80, low=-0.95, high=10.0),),
        apply=cable_normal_drag,
    ),
    Effect(
        id="cable_initial_length",
        sentence="more cable was in the water at the start",
        slot="cable",
        parameters=(
            Parameter(
                name="length",
                unit="m",
                tolerance=0.3,
                scale=12.0,
                low=0.0,
                high=60.0,
                step=3.0,
                nominal=_wet_length,
            ),
        ),
        apply=cable_initial_length,
    ),
    Effect(
        id="drum_friction",
        sentence="the drum rubs",
        slot="drum",
        parameters=(
            Parameter(
                name="force", unit="N", tolerance=0.02, scale=0.4, low=0.0, high=5.0, nominal=_friction
            ),
        ),
        apply=drum_friction,
        sudden=True,
    ),
    Effect(
        id="drum_inertia",
        sentence="the drum is heavy to turn",
        slot="drum",
        parameters=(
            Parameter(name="mass", unit="kg", tolerance=0.2, scale=4.0, low=0.0, high=40.0, nominal=_inertia),
        ),
        apply=drum_inertia,
    ),
    Effect(
        id="cable_weight",
        sentence="the cable sinks or floats",
        slot="cable",
        parameters=(
            Parameter(
                name="weight", unit="N/m", tolerance=0.0005, scale=0.02, low=-0.03, high=0.3, nominal=_weight
            ),
        ),
        apply=cable_weight,
    ),
    Effect(
        id="current",
        sentence="the water moves",
        slot="water",
        parameters=(_velocity("north"), _velocity("east")),
        apply=current,
    ),
)
"""To add one: a function (setting, deviation) → setting, and a line here."""
