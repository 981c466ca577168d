"""Effects of the hull."""

from __future__ import annotations

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter, growing
from vehicle import Vehicle


def _share(tolerance: float, scale: float, name: str = "share") -> tuple[Parameter, ...]:
    return (Parameter(name=name, unit="1", tolerance=tolerance, scale=scale, low=-0.9, high=5.0),)


def hull_drag(setting: Setting, share: float) -> Setting:
    """C_D (1 + share)."""
    return setting.with_vehicle(axial_drag__drag_coefficient=lambda old: old * (1.0 + share))


def surge_added_mass(setting: Setting, share: float) -> Setting:
    """−X_u̇ + share · m."""
    more = share * setting.model.vehicle.rigid_body.mass
    return setting.with_vehicle(added_mass__surge=lambda old: old + more)


def yaw_inertia(setting: Setting, share: float) -> Setting:
    """I_z + share (I_z − N_ṙ)."""
    body, water = setting.model.vehicle.rigid_body, setting.model.vehicle.added_mass
    more = share * (body.yaw_inertia + water.yaw)
    return setting.with_vehicle(rigid_body__yaw_inertia=lambda old: old + more)


def yaw_damping(setting: Setting, share: float) -> Setting:
    """N_ur + share · (N_ur with the fins)."""
    more = share * (setting.model.vehicle.body_lift.yaw_per_yaw - _fins(setting.model.vehicle, 2))
    return setting.with_vehicle(body_lift__yaw_per_yaw=lambda old: old + more)


def sway_damping(setting: Setting, share: float) -> Setting:
    """Y_uv + share · (Y_uv with the fins)."""
    more = share * (setting.model.vehicle.body_lift.sway_per_sway - _fins(setting.model.vehicle, 0))
    return setting.with_vehicle(body_lift__sway_per_sway=lambda old: old + more)


def _fins(vehicle: Vehicle, power: int) -> float:
    """Return the contribution of the two rudders to Y_uv (power 0) or N_ur (power 2): ρ S C_Lα x_fᵖ. [kg/m, kg m]."""
    fin = vehicle.rudder
    return vehicle.water.density * fin.area * fin.lift_slope * fin.station**power


def munk_moment(setting: Setting, share: float) -> Setting:
    """Munk's moment (1 + share)."""
    return setting.with_vehicle(added_mass__munk_factor=lambda old: old * (1.0 + share))


def net_buoyancy(setting: Setting, force: float) -> Setting:
    """B − W + force."""
    return setting.with_vehicle(buoyancy__net_buoyancy=lambda old: old + force)


def cg_offset(setting: Setting, millimetres: float) -> Setting:
    """x_g + offset, forward."""
    return setting.with_vehicle(rigid_body__centre_of_gravity_x=lambda old: old + 1e-3 * millimetres)


def roll_stiffness(setting: Setting, share: float) -> Setting:
    """z_b + (z_g − z_b)(1 + share) instead of z_g."""
    low = setting.model.vehicle.rigid_body.centre_of_gravity_z
    arm = low - setting.model.vehicle.buoyancy.centre_of_buoyancy_z
    return setting.with_vehicle(rigid_body__centre_of_gravity_z=low + share * arm)


def _net(setting: Setting) -> float:
    return setting.model.vehicle.buoyancy.net_buoyancy


EFFECTS = (
    Effect(
        id="hull_drag",
        sentence="the hull has another drag",
        slot="hull",
        parameters=_share(0.03, 0.30),
        apply=hull_drag,
        sudden=True,
    ),
    Effect(
        id="surge_added_mass",
        sentence="the hull carries another mass of water forward",
        slot="hull",
        parameters=(
            Parameter(name="share_of_mass", unit="1", tolerance=0.03, scale=0.25, low=-0.5, high=3.0),
        ),
        apply=surge_added_mass,
    ),
    Effect(
        id="yaw_inertia",
        sentence="the hull has another inertia in yaw",
        slot="hull",
        parameters=_share(0.03, 0.40),
        apply=yaw_inertia,
    ),
    Effect(
        id="yaw_damping",
        sentence="the hull has another damping in yaw",
        slot="hull",
        parameters=_share(0.03, 0.40),
        apply=yaw_damping,
    ),
    Effect(
        id="sway_damping",
        sentence="the hull has another damping in sway",
        slot="hull",
        parameters=_share(0.03, 0.40),
        apply=sway_damping,
    ),
    Effect(
        id="munk_moment",
        sentence="the hull has another Munk moment",
        slot="hull",
        parameters=_share(0.03, 0.40),
        apply=munk_moment,
    ),
    Effect(
        id="net_buoyancy",
        sentence="the vehicle is not as buoyant as said",
        slot="hull",
        parameters=(
            Parameter(name="force", unit="N", tolerance=0.03, scale=0.5, low=-10.0, high=10.0, nominal=_net),
        ),
        apply=net_buoyancy,
        sudden=True,
    ),
    Effect(
        id="cg_offset",
        sentence="the centre of gravity lies further forward or aft",
        slot="hull",
        parameters=(Parameter(name="forward", unit="mm", tolerance=0.3, scale=4.0, low=-50.0, high=50.0),),
        apply=cg_offset,
    ),
    Effect(
        id="roll_stiffness",
        sentence="the vehicle is stiffer or softer in roll",
        slot="hull",
        parameters=_share(0.03, 0.40),
        apply=roll_stiffness,
    ),
)
"""To add one: a function (setting, deviation) → setting, and a line here."""

_BY_ID = {effect.id: effect for effect in EFFECTS}
ONSETS = (
    growing(
        _BY_ID["net_buoyancy"],
        "flooding",
        "the vehicle grows heavier or lighter: water comes in, or goes out",
    ),
    growing(
        _BY_ID["hull_drag"], "fouling", "the drag of the hull grows or falls: it gathers weed, or sheds it"
    ),
)
"""Effects that grow from an onset on."""
