"""A line of several sections with bodies on it: a tow cable with an array and a drogue, a mooring with a clump weight.

    >>> line = SectionedCable(
    ...     sections=[Section(200.0, line_type("wire", 0.01)), Section(50.0, line_type("array", 0.03))],
    ...     bodies=[Body(250.0, mass=2.0, drag_area=0.05)],
    ... )
    >>> line.length, [round(section.cable.mass_per_length, 3) for section in line.sections]
    (250.0, [0.399, 0.725])

Sections and places of bodies are counted from the first end, the tow point. A body is a point of mass m, volume V, drag
area C_dA, lift area C_LA and added mass C_a:

    m a + ρ C_a V (a − dJ/dt) + ½ρ C_dA |U| U = pull of the line + (m − ρV) g k + ½ρ C_LA (|U|² k − U_k U)

With a positive C_LA it is pulled down, square to its way through the water, as by a depressor; a float has ρV > m; a
drogue has nothing but its drag area. All sections are in the same water. Bending stiffness is left out.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from cable.clamps import Clamps
from cable.properties import (
    GRAVITY,
    CableNumbers,
    CableProperties,
    FloatingCableNumbers,
    SectionedCableNumbers,
    numbers_of,
)
from cable.sea_bed import SeaBed
from subzero.errors import BadValueError, checked, short, suggestion

MOST = 16
"""So many sections, and so many bodies, a line can have: compiled code keeps space for them."""
COLUMNS = (
    *("mass", "added_mass", "weight", "compliance", "retardation", "tangential_drag", "normal_drag"),
    *("bed_stiffness", "bed_damping", "mass_along", "buoyancy", "diameter"),
)
"""Columns of `SectionedCableNumbers.section`."""
NO_BED = SeaBed(depth=1e9)


@cache
def _library() -> dict[str, Any]:
    """Return the library of line types."""
    return tomllib.loads(Path(__file__).with_name("line_types.toml").read_text(encoding="utf-8"))


def line_types() -> tuple[str, ...]:
    """Return the names in the library `cable/line_types.toml`, where each value has its range and source."""
    return tuple(_library())


def line_type(name: str, diameter: float, *, water_density: float = 1025.0) -> CableProperties:
    """Return the properties of a usual line of a given diameter [m].

    Raises:
        subzero.UserError: a type that does not exist.
    """
    if name not in _library():
        known = ", ".join(line_types())
        raise BadValueError(
            f"There is no line type {short(name)}; there are {known}.{suggestion(name, line_types())}"
        )
    d = checked("line_type", "diameter", diameter, above=0.0, unit="m")
    values = {key: float(entry["value"]) for key, entry in _library()[name].items()}
    return CableProperties(
        water_density=water_density,
        mass_per_length=values.pop("mass_per_area") * d * d,
        cross_section_area=values.pop("volume_per_area") * d * d,
        compliance=1.0 / (values.pop("stiffness_per_area") * d * d),
        diameter=d,
        **values,
    )


@dataclass(frozen=True)
class Section:
    """A piece of a line.

    Attributes:
        length: unstretched. [m]
        cable: its properties, of the caller's own or from `line_type`.
        strumming_factor: on the drag across; 2 to 2.5 was measured on bare wires that strum, 1 is none. [-]
    """

    length: float
    cable: CableProperties
    strumming_factor: float = 1.0

    def __post_init__(self) -> None:
        """Raise an error for a length or a factor that makes no sense; apply the factor to the drag across."""
        object.__setattr__(self, "length", checked("Section", "length", self.length, above=0.0, unit="m"))
        factor = checked("Section", "strumming_factor", self.strumming_factor, least=1.0, most=5.0)
        if not isinstance(self.cable, CableProperties):
            raise BadValueError(
                f"Section: cable is {short(self.cable)}; give CableProperties, or a line_type."
            )
        if self.cable.bending_stiffness > 0.0:
            raise BadValueError(
                "Section: a line of several sections has no bending_stiffness. Leave it at 0."
            )
        drag = factor * self.cable.normal_drag_coefficient
        object.__setattr__(self, "cable", replace(self.cable, normal_drag_coefficient=drag))


@dataclass(frozen=True)
class Body:
    """A point mass, float, clump, drogue or towed body on a line.

    Attributes:
        place: distance from the first end along the unstretched line. [m]
        mass: m. [kg]
        volume: V. [m³]
        drag_area: C_dA. [m²]
        lift_area: C_LA; positive pulls down. [m²]
        added_mass_coefficient: C_a; 0.5 is a sphere. [-]
    """

    place: float
    _: KW_ONLY
    mass: float = 0.0
    volume: float = 0.0
    drag_area: float = 0.0
    lift_area: float = 0.0
    added_mass_coefficient: float = 0.5

    def __post_init__(self) -> None:
        """Raise an error if the fields do not describe a body."""
        for each in fields(self):
            limits: dict[str, Any] = {} if each.name == "lift_area" else {"least": 0.0}
            object.__setattr__(
                self, each.name, checked("Body", each.name, getattr(self, each.name), **limits)
            )


@dataclass(frozen=True, kw_only=True)
class SectionedCable:
    """A line of sections, from the first end (the tow point) on, and the bodies on it.

    Raises:
        subzero.UserError: no section, too many, different water, a body beyond the line, or one that is heavier than
            the section that carries it may pull.
    """

    sections: Sequence[Section]
    bodies: Sequence[Body] = ()

    def __post_init__(self) -> None:
        """Raise an error if the parts do not make a line."""
        object.__setattr__(self, "sections", tuple(self.sections))
        object.__setattr__(self, "bodies", tuple(sorted(self.bodies, key=lambda body: body.place)))
        for name, parts, least in (("sections", self.sections, 1), ("bodies", self.bodies, 0)):
            if not least <= len(parts) <= MOST:
                raise BadValueError(f"SectionedCable: {len(parts)} {name}; a line has {least} to {MOST}.")
        if len({section.cable.water_density for section in self.sections}) > 1:
            raise BadValueError(
                "SectionedCable: the sections have different water_density; all are in one water."
            )
        for body in self.bodies:
            self._check(body)

    def _check(self, body: Body) -> None:
        """Raise an error for a body that is not on the line, or that the line cannot carry."""
        if not 0.0 < body.place <= self.length * (1.0 + 1e-9):
            raise BadValueError(
                f"SectionedCable: a body is at {body.place:g} m; the line is {self.length:g} m long, and its first end"
                " is no place for one."
            )
        weight = (body.mass - self.water_density * body.volume) * GRAVITY
        end = 0.0
        for section in self.sections:
            end += section.length
            if body.place <= end + 1e-9:
                break
        if 0.0 < section.cable.strength < abs(weight):
            raise BadValueError(
                f"SectionedCable: the body at {body.place:g} m weighs {weight:.4g} N in water, and its section may"
                f" carry {section.cable.strength:.4g} N (strength). Take a lighter body, or a stronger line."
            )

    @property
    def length(self) -> float:
        """The sum of all sections. [m]."""
        return float(sum(section.length for section in self.sections))

    @property
    def water_density(self) -> float:
        """ρ of the one water. [kg/m³]."""
        return self.sections[0].cable.water_density

    @property
    def compliance(self) -> float:
        """1/(EA) of the stiffest section; 0 if one of them cannot stretch. [1/N]."""
        return min(section.cable.compliance for section in self.sections)

    @property
    def internal_damping(self) -> float:
        """Largest B of the sections. [N s]."""
        return max(section.cable.internal_damping for section in self.sections)

    bending_stiffness = 0.0

    @property
    def diameter(self) -> float:
        """Largest diameter. [m]."""
        return max(section.cable.diameter for section in self.sections)

    @property
    def weight_in_water(self) -> float:
        """Mean weight per length, with the bodies. [N/m]."""
        lines = sum(section.length * section.cable.weight_in_water for section in self.sections)
        bodies = sum((body.mass - self.water_density * body.volume) * GRAVITY for body in self.bodies)
        return (lines + bodies) / self.length

    def divided(self, each: float) -> np.ndarray:
        """Return the lengths of segments of about `each` [m], with nodes at all ends of sections and at bodies."""
        cuts = np.cumsum([section.length for section in self.sections])
        cuts = np.unique(np.round([0.0, *cuts, *(body.place for body in self.bodies)], 9))
        cuts = cuts[np.diff(cuts, prepend=-1.0) > 1e-9]
        counts = np.maximum(np.ceil(np.diff(cuts) / each - 1e-9), 1.0).astype(int)
        return np.repeat(np.diff(cuts) / counts, counts)

    def numbers(
        self, bed: SeaBed | None = None, clamps: Clamps | None = None, surface: float | None = None
    ) -> CableNumbers:
        """Return the plain numbers that compiled code takes; those of the first section are selected."""
        if clamps is not None:
            clamps.numbers(self)  # refuses
        rows = np.zeros((MOST, len(COLUMNS)))
        ends = np.full(MOST, np.inf)
        points = np.zeros((MOST, 6))
        places = np.zeros(MOST)
        radii = np.zeros(MOST)
        ground = NO_BED if bed is None else bed
        for k, section in enumerate(self.sections):
            c: Any = section.cable.numbers(ground)
            more = {"mass_along": 0.0, "buoyancy": section.cable.buoyancy, "diameter": section.cable.diameter}
            rows[k] = [c[name] if name in c.names else more[name] for name in COLUMNS]
        ends[: len(self.sections) - 1] = np.cumsum([section.length for section in self.sections])[:-1]
        half = 0.5 * self.water_density
        for k, body in enumerate(self.bodies):
            added = self.water_density * body.added_mass_coefficient * body.volume
            weight = (body.mass - self.water_density * body.volume) * GRAVITY
            lifted = self.water_density * body.volume * GRAVITY
            points[k] = body.mass, added, weight, half * body.drag_area, half * body.lift_area, lifted
            radii[k] = np.cbrt(0.75 * body.volume / np.pi)
            places[k] = body.place
        first = replace(self.sections[0].cable, diameter=self.diameter)
        values: dict[str, Any] = {name: rows[0, k] for k, name in enumerate(COLUMNS[:10])}
        kind: Any = SectionedCableNumbers
        if surface is not None:
            kind = numbers_of((FloatingCableNumbers, SectionedCableNumbers))
            level = checked("", "surface", surface, unit="m, its depth")
            values |= {"surface_level": level, "whole": np.zeros(7), "softness": 1.0}
        made: CableNumbers = kind(
            **ground.numbers(first) | values,
            section=rows,
            section_end=ends,
            section_now=0,
            section_segment=0,
            section_along=0.0,
            body=points,
            body_radius=radii,
            body_place=places,
            body_count=len(self.bodies),
        )
        return made


def check_length(cable: SectionedCable, length: float) -> None:
    """Raise an error if sections do not add up to a length. [m]."""
    if abs(cable.length - length) > 1e-6 * cable.length:
        parts = " + ".join(f"{section.length:g}" for section in cable.sections)
        raise BadValueError(
            f"length is {length:g} m, and the sections do not add up to it: {parts} = {cable.length:g} m. Give that."
        )


AnyCable = CableProperties | SectionedCable
"""What `cable.hold`, `cable.tow`, `cable.pull_out` and `cable.Tether` take for a cable."""
