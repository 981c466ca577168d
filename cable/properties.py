"""The properties of a cable: values with units, and the plain numbers that compiled code takes.

Symbols are those of Feng & Allen (2004), section 2.2; defaults are their Table 1.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from math import acos, isfinite, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.errors import BadValueError, checked
from subzero.jit import Record

if TYPE_CHECKING:
    from cable.clamps import Clamps
    from cable.sea_bed import SeaBed

GRAVITY = 9.81
"""Gravitational acceleration g, as printed in section 2.2 of the source. [m/s²]"""


class CableNumbers(Record):
    """The cable as compiled code sees it: m, ρA C_a, w_c, e, B e, the drag constants ½ρdπC_t and ½ρdC_n.

    With an added mass along the cable, `mass` is m + ρA C_at and `added_mass` ρA (C_a − C_at).
    """

    mass: float
    added_mass: float
    weight: float
    compliance: float
    retardation: float
    tangential_drag: float
    normal_drag: float


class StiffCableNumbers(CableNumbers):
    """The same of a cable that resists bending, with EI [N m²]."""

    bending_stiffness: float


class ClampedCableNumbers(StiffCableNumbers):
    """The same with clamped ends: their tangents (2, 3), zeros at a hinge."""

    clamp: np.ndarray


class AlongCableNumbers(CableNumbers):
    """The same of a cable with added mass along it, with ρA C_at [kg/m]."""

    mass_along: float


class LaidCableNumbers(CableNumbers):
    """The same of a cable above a sea bed: its plane, k, c, δ, μ and κ, see `cable.sea_bed`."""

    bed_normal: np.ndarray
    bed_level: float
    bed_stiffness: float
    bed_damping: float
    bed_rounding: float
    axial_friction: float
    lateral_friction: float
    friction_rate: float
    is_at_rest: bool


class FloatingCableNumbers(AlongCableNumbers):
    """The same of a cable in water with a free surface, see `moving_end.surface`.

    Attributes:
        surface_level: depth of the surface. [m]
        whole: m, ρA (C_a − C_at), ρA C_at, ½ρπdC_t, ½ρdC_n, ρAg and d of the segment that the record describes, if it
            were all in water (7,).
        softness: radii are so many times as large; 1 but in a search for rest.
    """

    surface_level: float
    whole: np.ndarray
    softness: float


class SectionedCableNumbers(LaidCableNumbers, AlongCableNumbers):
    """The same of a line of sections and bodies: always of one section, and all of them, see `cable.sections`.

    Attributes:
        section: numbers of each (sections, columns), `sections.COLUMNS`.
        section_end: where each ends, from the tow point; the last is endless (sections,). [m]
        section_now, section_segment, section_along: the section that the record describes, of which segment, and
            where that ends. [-], [-], [m]
        body: m, ρC_aV, weight in water, ½ρC_dA, ½ρC_LA, ρVg of each body (bodies, 6).
        body_radius: of a sphere of its volume (bodies,). [m]
        body_place: distance from the tow point (bodies,). [m]
        body_count: how many there are.
    """

    section: np.ndarray
    section_end: np.ndarray
    section_now: int
    section_segment: int
    section_along: float
    body: np.ndarray
    body_radius: np.ndarray
    body_place: np.ndarray
    body_count: int


@cache
def numbers_of(kinds: tuple[type[CableNumbers], ...]) -> type[CableNumbers]:
    """Return the class of the numbers of a cable that is of several kinds at once."""
    if len(kinds) < 2:
        return kinds[0] if kinds else CableNumbers
    return type("".join(kind.__name__.removesuffix("CableNumbers") for kind in kinds), kinds, {})


ABOVE_ZERO = ("water_density", "mass_per_length", "cross_section_area", "diameter")
"""Without these it is no cable; everything else may be zero."""


@dataclass(frozen=True, kw_only=True)
class CableProperties:
    """A thin flexible cable in water; every value per unit length of unstretched cable.

    Attributes:
        water_density: ρ. [kg/m³]
        mass_per_length: m. [kg/m]
        cross_section_area: A, of the unstretched cable. [m²]
        diameter: d. [m]
        tangential_drag_coefficient: C_t, on the wetted surface π d. [-]
        normal_drag_coefficient: C_n, on the projected area d. [-]
        added_mass_coefficient: C_a, added mass across the cable as a share of ρA; 1 for a round cylinder. [-]
        tangential_added_mass_coefficient: C_at, the same along it; 0 for a smooth cable, some 0.5 for chain. [-]
        compliance: e = 1/(E A); 0 is an inextensible cable. [1/N]
        internal_damping: B, of stretch, T = E A ε + B dε/dt; see `moving_end.slack_law`. [N s]
        bending_stiffness: E I; see `moving_end.bending`. [N m²]
        strength: the load that it may carry, working or breaking; 0 is not known. Nothing is computed with it. [N]
        minimum_bend_radius: the tightest bend that it may take; 0 is not known. Nothing is computed with it. [m]

    Raises:
        subzero.UserError: a value that is not a finite number, or not in its physical range (a ValueError, too).
    """

    water_density: float = 1000.0
    mass_per_length: float = 0.0049
    cross_section_area: float = 4.9e-6
    diameter: float = 0.0025
    tangential_drag_coefficient: float = 0.01
    normal_drag_coefficient: float = 1.0
    added_mass_coefficient: float = 1.0
    tangential_added_mass_coefficient: float = 0.0
    compliance: float = 0.0
    internal_damping: float = 0.0
    bending_stiffness: float = 0.0
    strength: float = 0.0
    minimum_bend_radius: float = 0.0

    def __post_init__(self) -> None:
        """Raise an error if the fields do not describe a possible cable."""
        for each in fields(self):
            above = 0.0 if each.name in ABOVE_ZERO else None
            value = checked(type(self).__name__, each.name, getattr(self, each.name), least=0.0, above=above)
            object.__setattr__(self, each.name, value)
        if self.internal_damping > 0.0 and self.compliance == 0.0:
            raise BadValueError(
                f"CableProperties: internal_damping is {self.internal_damping:g} N s, with compliance = 0: what does "
                "not stretch damps nothing. Give the cable its compliance, 1/(E A), or leave internal_damping at 0."
            )

    @property
    def virtual_mass_per_length(self) -> float:
        """m1 = m + C_a ρA. [kg/m]."""
        return (
            self.mass_per_length + self.added_mass_coefficient * self.water_density * self.cross_section_area
        )

    @property
    def weight_in_water(self) -> float:
        """w_c = (m − ρA) g, positive for a cable that sinks. [N/m]."""
        return (self.mass_per_length - self.water_density * self.cross_section_area) * GRAVITY

    @property
    def buoyancy(self) -> float:
        """ρAg. [N/m]."""
        return self.water_density * self.cross_section_area * GRAVITY

    @property
    def tangential_drag(self) -> float:
        """½ρπdC_t, the drag per metre at 1 m/s along the cable: 0.03927 for Table 1. [N s²/m³]."""
        return 0.5 * self.water_density * pi * self.diameter * self.tangential_drag_coefficient

    @property
    def normal_drag(self) -> float:
        """½ρdC_n, the drag per metre at 1 m/s across the cable. [N s²/m³]."""
        return 0.5 * self.water_density * self.diameter * self.normal_drag_coefficient

    def critical_angle(self, speed: float) -> float:
        """Angle to the flow φ of a long heavy cable towed at a steady speed: ½ρdC_nU² sin²φ = w_c cosφ. [rad]."""
        ratio = abs(self.weight_in_water) / (2.0 * self.normal_drag * speed * speed)
        return acos(sqrt(1.0 + ratio * ratio) - ratio)

    def numbers(
        self, bed: SeaBed | None = None, clamps: Clamps | None = None, surface: float | None = None
    ) -> CableNumbers:
        """Return the plain numbers that compiled code takes: clamped, above a bed, below a surface."""
        along = self.tangential_added_mass_coefficient * self.water_density * self.cross_section_area
        values: dict[str, Any] = {
            "mass": self.mass_per_length + along,
            "added_mass": self.added_mass_coefficient * self.water_density * self.cross_section_area - along,
            "weight": self.weight_in_water,
            "compliance": self.compliance,
            "retardation": self.internal_damping * self.compliance,
            "tangential_drag": self.tangential_drag,
            "normal_drag": self.normal_drag,
        }
        if not all(isfinite(number) for number in values.values()):
            raise BadValueError(
                "CableProperties: its numbers are so large that masses, weights or drags are not finite."
            )
        special: dict[type[CableNumbers], dict[str, Any]] = {}
        if clamps is not None:
            special[ClampedCableNumbers] = clamps.numbers(self)
        elif self.bending_stiffness > 0.0:
            special[StiffCableNumbers] = {"bending_stiffness": self.bending_stiffness}
        if surface is not None:
            parts = (self.mass_per_length, values["added_mass"], along, self.tangential_drag)
            whole = np.array([*parts, self.normal_drag, self.buoyancy, self.diameter])
            level = checked("", "surface", surface, unit="m, its depth")
            floating = {"surface_level": level, "whole": whole, "softness": 1.0, "mass_along": along}
            special[FloatingCableNumbers] = floating
        elif along > 0.0:
            special[AlongCableNumbers] = {"mass_along": along}
        if bed is not None:
            special[LaidCableNumbers] = bed.numbers(self)
        for more in special.values():
            values |= more
        return numbers_of(tuple(special))(**values)
