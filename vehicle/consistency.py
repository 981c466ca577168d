"""Numbers of a vehicle that are valid one by one, and contradict one another: a hull with the fins of a shorter one.

Nothing here is an error: a vehicle may flood, carry foam, or have wings. Each doubt says both sides of a comparison
with what the shape of the hull gives (`geometry`). The margins are wide: real vehicles (REMUS 100) raise
none, and a hull of twice the length raises all.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from vehicle.geometry import Hull, displaced_volume, homogeneous_inertia, lamb_factors, lateral_added_mass
from vehicle.vehicle import Vehicle

BUOYANCY_MARGIN = 0.15
"""Share by which the buoyancy may differ from the weight of the water in the hull's shape: flooded ends, foam. [-]"""
INERTIA_RATIO = 2.0
"""An inertia is within this ratio of that of a hull filled evenly: batteries amidships or at both ends. [-]"""
ADDED_MASS_RATIO, ADDED_INERTIA_RATIO = 1.7, 2.5
"""An added mass and inertia are within these ratios of those of the bare hull: fins and shrouds at its end bring up
to as much again to the inertia (REMUS 100). [-]"""


class Shape(NamedTuple):
    """What follows from the shape of a hull, in water of density 1: volume, pitch inertia, added masses."""

    volume: float
    pitch_inertia: float
    along: float
    across: float
    turned: float


@lru_cache(maxsize=8)
def shape_of(hull: Hull) -> Shape:
    """Return what follows from the shape of a hull. [m3, m5, m3, m3, m5]"""
    volume, lateral = displaced_volume(hull), lateral_added_mass(hull, 1.0)
    along = lamb_factors(hull.length / hull.diameter).k1 * volume
    return Shape(volume, homogeneous_inertia(hull, 1.0)[1], along, lateral[0], lateral[2])


def contradictions(vehicle: Vehicle) -> list[str]:
    """Return sentences about numbers of a vehicle that contradict one another; none for a consistent one.

    Compared are the buoyancy with the hull's volume, fins and tow point with its ends, inertia and added mass with
    those of its shape.

    Args:
        vehicle: to look at.
    """
    if vehicle.derivatives or vehicle.hull.length <= 1.01 * vehicle.hull.diameter:
        return []  # a table has no shape, and Lamb's spheroid is longer than wide
    return [*_buoyancy(vehicle), *_misplaced(vehicle), *_inertias(vehicle)]


def _buoyancy(vehicle: Vehicle) -> list[str]:
    """Compare the buoyancy, (m g + net)/(ρ g), with the volume of the hull."""
    water, mass = vehicle.water, vehicle.rigid_body.mass
    held = water.density * shape_of(vehicle.hull).volume
    floats = mass + (vehicle.buoyancy.net_buoyancy / water.gravity if water.gravity else 0.0)
    if abs(floats / held - 1.0) <= BUOYANCY_MARGIN:
        return []
    return [
        f"the hull displaces {held:.3g} kg of water, and mass with net buoyancy says {floats:.3g} kg: check "
        "hull.length, hull.diameter and rigid_body.mass"
    ]


def _misplaced(vehicle: Vehicle) -> list[str]:
    """Compare the stations of fins and tow point with nose and tail."""
    hull, said = vehicle.hull, []
    nose, tail = hull.nose_station, hull.nose_station - hull.length
    places = {
        "rudder.station": vehicle.rudder.station,
        "stern_planes.station": vehicle.stern_planes.station,
        "tow_point.x": vehicle.tow_point.x,
    }
    slack = 0.1 * hull.length
    for key, x in places.items():
        if not tail - slack <= x <= nose + slack:
            said.append(
                f"{key} is {x:.3g} m, and the hull reaches from {tail:.3g} to {nose:.3g} m: it is outside"
            )
    aft, behind = max(places["rudder.station"], places["stern_planes.station"]), tail + 0.4 * hull.length
    if not said and aft > behind and vehicle.rudder.area > 0.0:
        said.append(
            f"the fins stand at {aft:.3g} m, and the tail begins behind {behind:.3g} m: they belong to a shorter hull"
        )
    return said


def _inertias(vehicle: Vehicle) -> list[str]:
    """Compare inertia and added mass with those of the shape."""
    shape, body, rho = shape_of(vehicle.hull), vehicle.rigid_body, vehicle.water.density
    filled = body.mass * shape.pitch_inertia / shape.volume
    across, turned = rho * shape.across, rho * shape.turned
    rows = (
        ("rigid_body.pitch_inertia", body.pitch_inertia, filled, INERTIA_RATIO, "kg m2"),
        ("rigid_body.yaw_inertia", body.yaw_inertia, filled, INERTIA_RATIO, "kg m2"),
        ("added_mass.surge", vehicle.added_mass.surge, rho * shape.along, ADDED_MASS_RATIO, "kg"),
        ("added_mass.sway", vehicle.added_mass.sway, across, ADDED_MASS_RATIO, "kg"),
        ("added_mass.heave", vehicle.added_mass.heave, across, ADDED_MASS_RATIO, "kg"),
        ("added_mass.pitch", vehicle.added_mass.pitch, turned, ADDED_INERTIA_RATIO, "kg m2"),
        ("added_mass.yaw", vehicle.added_mass.yaw, turned, ADDED_INERTIA_RATIO, "kg m2"),
    )
    return [sentence for row in rows for sentence in _compared(*row)]


def _compared(key: str, value: float, shape: float, ratio: float, unit: str) -> list[str]:
    """Return a sentence if a value is not within a ratio of what the hull's shape gives."""
    if shape / ratio <= value <= shape * ratio:
        return []
    return [
        f"{key} is {value:.3g} {unit}, and the shape of the hull gives {shape:.3g} {unit}: it belongs to another hull"
    ]
