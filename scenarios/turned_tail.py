"""A tail turned about the axis: a cross of rudder and stern-planes made a list of four fins, in X at 45 degrees.

Each fin keeps area, coefficients, station and arm of the one that it was, and follows rudder, mean and difference of
the stern-planes, behind their servos (`vehicle.fin_list`). At 45 degrees four fins of one shape turn and pitch as
the two of the cross did, as 4 sin² 45° = 2, and roll twice as much.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

Leaf = Mapping[str, Any]
Table = dict[str, dict[str, Any]]

CORNERS = {
    "lower_starboard": ("stern_planes", 0.0),
    "lower_port": ("rudder", 90.0),
    "upper_port": ("stern_planes", 180.0),
    "upper_starboard": ("rudder", -90.0),
}
"""Name of a fin → the section that it was in, and the direction of its span in the cross [degree]."""
SHAPE = (
    *("area", "lift_slope", "aspect_ratio", "span_efficiency"),
    *("profile_drag_coefficient", "normal_force_coefficient", "stall_angle"),
)
SHARES = ("rudder_share", "plane_share", "roll_share")


def turn_tail(table: Table, degrees: float) -> None:
    """Put four listed fins, turned by an angle from the cross, in the place of rudder and stern-planes.

    Args:
        table: section → key → inline table of a complete vehicle; changed, but for numbers of these fins that it has.
        degrees: how far the tail is turned, starboard down. [degree]
    """
    source = f"derived: of the cross, turned by {degrees:g} degrees"
    for name, (section, cross) in CORNERS.items():
        was, angle = table[section], math.radians(cross + degrees)
        servo = table["rudder_servo" if section == "rudder" else "stern_plane_port_servo"]
        arm = float(was["arm"]["value"])
        place = {"y": arm * math.cos(angle), "z": arm * math.sin(angle)}
        fin: dict[str, Any] = {key: was[key] for key in SHAPE} | {"x": was["station"]}
        fin |= {
            key: {"value": round(value, 9), "unit": "m", "source": source} for key, value in place.items()
        }
        fin["span_angle"] = {"value": round(angle, 9), "unit": "rad", "source": source}
        fin |= {
            key: {"value": 1.0, "unit": "1", "source": "derived: it follows as a tail does"} for key in SHARES
        }
        fin |= {key: servo[key] for key in ("lag", "rate_limit", "deflection_limit")}
        table[f"fins.{name}"] = fin | table.get(f"fins.{name}", {})
    for section in ("rudder", "stern_planes"):
        table[section]["area"] = {"value": 0.0, "unit": "m2", "source": "its fins are listed: [fins]"}
