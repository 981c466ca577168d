"""A sea bed: a plane that a cable lies on, slides over, and is lifted from.

Per length of cable, with the depth p of its axis below the plane, n the normal that points into the bed and P the
projection on the plane,

    pressure    N = max(k R(p) + c R′(p) dp/dt, 0),   R = p²/2δ up to δ = d/4, then p − δ/2
    friction    N s,  |s_axial| ≤ μ_axial,  |s_lateral| ≤ μ_lateral;  below that ds/dt = −κ P V: it sticks

k = E d, with the modulus E of the ground per depth and the diameter d: a round cable touches with a width that grows
to its diameter while it sinks in by a quarter of that. c = 2ζ √(k m1) is the share ζ of critical damping. κ = μ/u, with
the larger μ: friction is full after a displacement u. The ground does not pull, and holds nothing but what lies on it:
it has no trench, and no suction.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.errors import BadValueError, checked

if TYPE_CHECKING:
    from cable.properties import CableProperties

ROUNDED = 0.25
"""Share of its diameter that a cable sinks in before it touches with its whole width. [-]"""
STEEPEST = 1.0
"""Slopes beyond 45 degrees are a cliff, not a sea bed. [-]"""


@dataclass(frozen=True, kw_only=True)
class SeaBed:
    """A flat or sloping sea bed.

    Attributes:
        depth: of the bed at north = east = 0, in the axes of the cable's ends, positive down. [m]
        slope_north, slope_east: by how much it gets deeper per metre north and east. [-]
        modulus: E, pressure of the ground per depth of sinking. The default is usual for analyses of lines on sand;
            concrete has 3e9. [N/m³]
        damping_ratio: ζ, share of critical damping while the cable sinks in. [-]
        slip: u, displacement until friction is full, in diameters; soils take 0.01 to 0.1 along a pipe and up to 0.5
            across it. [-]
        axial_friction, lateral_friction: μ along the cable and across it; 0.2 to 1 for cables on sand. [-]

    Raises:
        subzero.UserError: a value that is not a finite number, or not in its physical range (a ValueError, too).
    """

    depth: float
    slope_north: float = 0.0
    slope_east: float = 0.0
    modulus: float = 1e5
    damping_ratio: float = 1.0
    slip: float = 0.1
    axial_friction: float = 0.3
    lateral_friction: float = 0.3

    def __post_init__(self) -> None:
        """Raise an error if the fields do not describe a sea bed."""
        for each in fields(self):
            if each.name == "depth":
                limits: dict[str, Any] = {}
            elif each.name.startswith("slope"):
                limits = {"least": -STEEPEST, "most": STEEPEST}
            else:
                limits = {"above": 0.0} if each.name in ("modulus", "slip") else {"least": 0.0}
            value = checked("SeaBed", each.name, getattr(self, each.name), **limits)
            object.__setattr__(self, each.name, value)

    @property
    def normal(self) -> np.ndarray:
        """The unit vector into the bed, north, east, down (3,)."""
        n = np.array([-self.slope_north, -self.slope_east, 1.0])
        unit: np.ndarray = n / np.linalg.norm(n)
        return unit

    def below(self, places: np.ndarray) -> np.ndarray:
        """Return how deep places (n, 3) are below the bed, square to it; negative above. [m]."""
        depth: np.ndarray = (np.atleast_2d(places) - np.array([0.0, 0.0, self.depth])) @ self.normal
        return depth

    def sinkage(self, cable: CableProperties) -> float:
        """Return how deep a cable sinks in by its own weight, at rest: k R(p) = w_c. [m]."""
        soft, k = ROUNDED * cable.diameter, self.modulus * cable.diameter
        share = max(cable.weight_in_water, 0.0) / k
        return sqrt(2.0 * soft * share) if share < 0.5 * soft else share + 0.5 * soft

    def refuse_below(self, ends: np.ndarray, owner: str) -> None:
        """Raise an error if one of the ends (n, 3) is below the bed: a cable cannot be held there."""
        deepest = int(np.argmax(self.below(ends)))
        by = float(self.below(ends)[deepest])
        if by > 1e-6 * max(1.0, abs(self.depth)):
            raise BadValueError(
                f"{owner}: end {deepest} is {by:.4g} m below the sea bed, whose depth is {self.depth:g} m at north ="
                " east = 0: a bed above an end holds no cable. Lift that end, or make depth larger."
            )

    def numbers(self, cable: CableProperties) -> dict[str, Any]:
        """Return the fields that `cable.properties.LaidCableNumbers` has for a cable on this bed."""
        n, k = self.normal, self.modulus * cable.diameter
        return {
            "bed_normal": n,
            "bed_level": float(n[2] * self.depth),
            "bed_stiffness": k,
            "bed_damping": 2.0 * self.damping_ratio * sqrt(k * cable.virtual_mass_per_length),
            "bed_rounding": ROUNDED * cable.diameter,
            "axial_friction": self.axial_friction,
            "lateral_friction": self.lateral_friction,
            "friction_rate": max(self.axial_friction, self.lateral_friction) / (self.slip * cable.diameter),
            "is_at_rest": False,
        }
