"""Effects of a vehicle's own: of its listed actuators (thrusters, fins, moving masses, buoyancy engines), of the
damping of a hull that thrusters drive, and of its tether.

A vehicle without a list has none of these, and its catalogue is as it was. Station keeping knows nothing of a lost
command: it is the actuator that does less than commanded.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter
from subzero.external_force import MissingForce, Term
from vehicle import Vehicle
from vehicle.lists import LISTS

KINDS = {
    "thrusters": "thruster",
    "fins": "fin",
    "moving_masses": "moving_mass",
    "buoyancy_engines": "buoyancy_engine",
}
"""List of a vehicle → one of it; causes are called ``thruster:front_port``."""
DAMPED = {"surge": "X_uu", "sway": "Y_vv", "heave": "Z_ww", "yaw": "N_rr"}
"""Axis → the derivative of its drag, quadratic in the speed."""


def effects_of(vehicle: Vehicle) -> tuple[Effect, ...]:
    """Return the causes that follow from a vehicle: none for one of propeller, rudder and stern-planes alone."""
    lost = tuple(
        _lost_command(section, name, part) for section in LISTS for name, part in getattr(vehicle, section)
    )
    if not vehicle.thrusters:
        return lost
    table = dict(vehicle.derivatives.table) if vehicle.derivatives else {}
    damped = tuple(_damping(axis, key) for axis, key in DAMPED.items() if table.get(key))
    return (*lost, *damped, TETHER_PULL)


def _description(kind: str, name: str) -> dict[str, str]:
    """Return sentence and slot of a cause that is called ``kind:name``."""
    if kind == "damping":
        return {"sentence": f"the hull drags more or less in {name}", "slot": "hull"}
    sentence = f"the {kind.replace('_', ' ')} {name} does less than it is commanded"
    return {"sentence": sentence, "slot": "thrusters" if kind == "thruster" else "fins"}


def description_of(effect_id: str) -> dict[str, str]:
    """Return sentence and slot of a cause by its id alone, where the vehicle is not at hand; empty for another id."""
    if effect_id == TETHER_PULL.id:
        return {"sentence": TETHER_PULL.sentence, "slot": TETHER_PULL.slot}
    kind, colon, name = effect_id.partition(":")
    return _description(kind, name) if colon and kind in (*KINDS.values(), "damping") else {}


def _lost_command(section: str, name: str, part: Any) -> Effect:
    """Return the effect of an actuator that follows a part of its command alone: 1 is dead, or jammed."""
    lost = float(part.lost_command)
    kind = KINDS[section]
    share = Parameter(
        name="lost_share",
        unit="1",
        tolerance=0.03,
        scale=0.4,
        low=-0.3 - lost,
        high=1.0 - lost,
        nominal=lambda setting: float(dict(getattr(setting.model.vehicle, section))[name].lost_command),
    )
    return Effect(
        id=f"{kind}:{name}",
        **_description(kind, name),
        parameters=(share,),
        apply=partial(_with_lost_command, section, name),
        sudden=True,
    )


def _with_lost_command(section: str, name: str, setting: Setting, share: float) -> Setting:
    """C + share, of one actuator."""
    old = dict(getattr(setting.model.vehicle, section))[name].lost_command
    return setting.with_listed(section, name, lost_command=old + share)


def _damping(axis: str, key: str) -> Effect:
    """Return the effect of a hull that drags more or less along an axis."""
    share = Parameter(name="share", unit="1", tolerance=0.05, scale=0.4, low=-0.9, high=5.0)
    return Effect(
        id=f"damping:{axis}",
        **_description("damping", axis),
        parameters=(share,),
        apply=partial(_with_damping, key),
        sudden=True,
    )


def _with_damping(key: str, setting: Setting, share: float) -> Setting:
    """The derivative (1 + share)."""
    return setting.with_derivative(key, 1.0 + share)


def tether_pull(setting: Setting, forward: float, starboard: float) -> Setting:
    """A force at the tow point, along the body's axes, that the model's tether does not have."""
    arm = setting.model.vehicle.tow_point.position()
    moment = np.cross(arm, [forward, starboard, 0.0])
    wrench = {"X": forward, "Y": starboard, **dict(zip("KMN", moment.tolist(), strict=True))}
    pull = MissingForce(terms=tuple(Term(axis, "constant", size) for axis, size in wrench.items() if size))
    return setting.with_model(missing=pull + setting.model.missing)


def _force(name: str) -> Parameter:
    return Parameter(name=name, unit="N", tolerance=0.1, scale=4.0, low=-60.0, high=60.0)


TETHER_PULL = Effect(
    id="tether_pull",
    sentence="the tether pulls otherwise than it should: snagged, or held by something",
    slot="cable",
    parameters=(_force("forward"), _force("starboard")),
    apply=tether_pull,
    sudden=True,
)
