"""A vehicle as a value: sections of numbers, checked, and made ready for the compiled equations.

A `Vehicle` is frozen and has no defaults: its numbers come from a file (`scenarios/vehicles`) through
`from_mapping`. To try another number, make a new one with `dataclasses.replace`, or `with_parameter`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import lru_cache
from math import isfinite
from typing import Any, get_type_hints

import numpy as np

from subzero.errors import short
from subzero.jit import Record
from vehicle.actuators import Servo, Servos
from vehicle.body_lift import NO_FLOW_AXES, BodyLift, FlowAxes
from vehicle.buoyancy_engine import BuoyancyEngine, EngineNumbers
from vehicle.channels import Channel
from vehicle.cross_flow import CrossFlowDrag, HullSection, strips_of
from vehicle.damping import AxialDrag, LinearDamping, QuadraticDamping
from vehicle.derivatives import NO_DERIVATIVES, Derivatives
from vehicle.fin_list import Fin, ListedFinNumbers
from vehicle.fins import FinNumbers, Fins
from vehicle.geometry import Hull, TowPoint
from vehicle.lists import (
    DERIVATIVES,
    FLOW_AXES,
    FURTHER,
    HULL_SECTIONS,
    LISTS,
    OPTIONAL,
    further_problems,
    list_problems,
    listed_numbers,
    listed_parts,
    read_optional,
)
from vehicle.motor import Battery, Motor, MotorNumbers, motor_numbers
from vehicle.moving_mass import MovingMass, MovingMassNumbers
from vehicle.parameters import Problem, Section, VehicleError, nearest, parameter, read_section
from vehicle.products import NO_RACE, Race, RaceNumbers, count_of
from vehicle.products import table_of as product_table_of
from vehicle.propeller import Propeller, PropellerNumbers
from vehicle.restoring import Buoyancy, RestoringNumbers
from vehicle.rigid_body import AddedMass, ProductsOfInertia, RigidBody
from vehicle.state import STATE_SIZE
from vehicle.thrusters import Thruster, table_of


class VehicleNumbers(Record):
    """Everything the compiled equations need, derived once from a Vehicle."""

    mass_matrix: np.ndarray
    inverse_mass: np.ndarray
    rigid_body: np.ndarray
    added_mass: np.ndarray
    munk_excess: float
    body_lift: np.ndarray
    strips: np.ndarray
    axial_drag: float
    linear_damping: np.ndarray
    quadratic_damping: np.ndarray
    restoring: RestoringNumbers
    propeller: PropellerNumbers
    rudder: FinNumbers
    stern_planes: FinNumbers
    servos: Servos
    motor: MotorNumbers
    tabled: bool
    linear_table: np.ndarray
    quadratic_table: np.ndarray
    products: np.ndarray
    product_count: int
    race: RaceNumbers
    has_sections: bool
    section_strips: np.ndarray
    thrusters: np.ndarray
    thruster_count: int
    channels: np.ndarray
    channel_count: int
    fins: tuple[ListedFinNumbers, ...]
    fin_count: int
    engines: tuple[EngineNumbers, ...]
    engine_count: int
    masses: tuple[MovingMassNumbers, ...]
    mass_count: int
    winged: bool
    flow_axes: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Water(Section):
    """The water and the gravity it lies in."""

    density: float = parameter("density, rho", "kg/m3", above=0.0)
    gravity: float = parameter("acceleration of gravity, g", "m/s2", low=0.0)


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """All numbers of a vehicle; each field is a section (a table of its file).

    Attributes:
        derivatives: further damping and added mass, as a table; none for most.
        flow_axes: forces in flow axes, of a glider; none for most.
        thrusters: by name, as all lists; none for a vehicle of one propeller, rudder and stern-planes.
        fins: further fins, such as a tail in X.
        moving_masses: such as a battery that slides and turns.
        buoyancy_engines: such as an oil bladder.
        sections: by name, of a hull that is no body of revolution, for its cross-flow drag; none for a Myring hull.
        products_of_inertia: None for none.
        race: of the propeller, as a factor of derivatives; None where none has it.
    """

    water: Water
    hull: Hull
    rigid_body: RigidBody
    buoyancy: Buoyancy
    added_mass: AddedMass
    axial_drag: AxialDrag
    body_lift: BodyLift
    cross_flow_drag: CrossFlowDrag
    linear_damping: LinearDamping
    quadratic_damping: QuadraticDamping
    propeller: Propeller
    motor: Motor
    battery: Battery
    rudder: Fins
    stern_planes: Fins
    rudder_servo: Servo
    stern_plane_port_servo: Servo
    stern_plane_starboard_servo: Servo
    tow_point: TowPoint
    derivatives: Derivatives = NO_DERIVATIVES
    flow_axes: FlowAxes = NO_FLOW_AXES
    thrusters: tuple[tuple[str, Thruster], ...] = ()
    fins: tuple[tuple[str, Fin], ...] = ()
    moving_masses: tuple[tuple[str, MovingMass], ...] = ()
    buoyancy_engines: tuple[tuple[str, BuoyancyEngine], ...] = ()
    sections: tuple[tuple[str, HullSection], ...] = ()
    products_of_inertia: ProductsOfInertia | None = None
    race: Race | None = None

    def __post_init__(self) -> None:
        """Raise VehicleError for parts that are not valid, or do not fit."""
        problems = [
            Problem(
                key=name, found=short(getattr(self, name)), why="this is no such part", allowed=kind.__name__
            )
            for name, kind in {**SECTIONS, FLOW_AXES: FlowAxes, DERIVATIVES: Derivatives}.items()
            if not isinstance(getattr(self, name), kind)
        ]
        problems = problems or inconsistencies(
            self.hull, self.added_mass, self.derivatives, self.water.density
        )
        problems += list_problems(self) or further_problems(self)
        if problems:
            raise VehicleError(tuple(problems))

    @property
    def thruster_list(self) -> tuple[Thruster, ...]:
        """The thrusters, in the order of their commands."""
        return tuple(thruster for _, thruster in self.thrusters)

    @property
    def has_rudder(self) -> bool:
        """Whether a fin, or a derivative, answers the rudder's command."""
        listed = any(fin.rudder_share and fin.area for _, fin in self.fins)
        return self.rudder.area > 0.0 or listed or "rudder" in self.derivatives.factors

    @property
    def has_stern_planes(self) -> bool:
        """Whether a fin, or a derivative, answers the commands of the stern-planes."""
        listed = any(fin.plane_share and fin.area for _, fin in self.fins)
        return self.stern_planes.area > 0.0 or listed or "stern_plane_port" in self.derivatives.factors

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The commands of its listed actuators, in the order of commands and states behind those of `vehicle.STATE`."""
        return tuple(channel for part in listed_parts(self) for channel in part)

    @property
    def state_size(self) -> int:
        """Entries of its state: those of `vehicle.STATE`, and one for each channel."""
        return STATE_SIZE + len(self.channels)

    def numbers(self) -> VehicleNumbers:
        """Return the numbers of the compiled equations, a copy that may be changed.

        Raises:
            VehicleError: numbers so large or so small that what follows from them is not finite.
        """
        return self.own_numbers.copy()

    @property
    def own_numbers(self) -> VehicleNumbers:
        """The numbers of the compiled equations, made once: for callers that copy it themselves, as a record does of
        another.

        Raises:
            VehicleError: as of `numbers`.
        """
        return _numbers_of(self)  # not kept as an attribute: a copy with other values would take it along

    def _numbers(self) -> VehicleNumbers:
        density, length = self.water.density, self.hull.length
        rigid_body, added_mass = self.rigid_body.matrix(), self.added_mass.matrix()
        if self.products_of_inertia:
            rigid_body = rigid_body + self.products_of_inertia.matrix()
        if self.derivatives:
            added_mass = added_mass + self.derivatives.matrix("added_mass", density, length)
        mass_matrix = rigid_body + added_mass
        rows = self.derivatives.with_dimensions(density, length)
        return VehicleNumbers(
            mass_matrix=mass_matrix,
            inverse_mass=np.linalg.inv(mass_matrix),
            rigid_body=rigid_body,
            added_mass=0.0 * added_mass if self.derivatives.is_complete else added_mass,
            munk_excess=self.added_mass.munk_factor - 1.0,
            body_lift=self.body_lift.numbers(),
            strips=self.cross_flow_drag.numbers(self.hull, density),
            axial_drag=self.axial_drag.numbers(self.hull.diameter, density),
            linear_damping=self.linear_damping.numbers(),
            quadratic_damping=self.quadratic_damping.numbers(),
            restoring=self.buoyancy.numbers(self.rigid_body, self.water.gravity),
            propeller=self.propeller.numbers(density),
            rudder=self.rudder.numbers(density),
            stern_planes=self.stern_planes.numbers(density),
            servos=(
                self.rudder_servo.numbers(),
                self.stern_plane_port_servo.numbers(),
                self.stern_plane_starboard_servo.numbers(),
            ),
            motor=motor_numbers(self.motor, self.battery),
            tabled=bool(self.derivatives),
            linear_table=self.derivatives.matrix("linear", density, length),
            quadratic_table=self.derivatives.matrix("quadratic", density, length),
            products=product_table_of(rows, self.derivatives.named),
            product_count=count_of(rows),
            race=self.race.numbers() if self.race else NO_RACE,
            has_sections=bool(self.sections),
            section_strips=strips_of(tuple(section for _, section in self.sections), density),
            thrusters=table_of(self.thruster_list),
            thruster_count=len(self.thrusters),
            winged=self.flow_axes != NO_FLOW_AXES,
            flow_axes=self.flow_axes.numbers(),
            **listed_numbers(self),
        )

    def with_parameter(self, key: str, value: float) -> Vehicle:
        """Return a new vehicle with one number changed, named "section.parameter"; raises VehicleError."""
        *sections, name = key.split(".")
        mapping: dict[str, Any] = {s: dict(values) for s, values in to_mapping(self).items()}
        table = mapping
        for section in sections:
            table = table.setdefault(section, {})
        table[name] = value
        return from_mapping(mapping)


@lru_cache(maxsize=4)
def _numbers_of(vehicle: Vehicle) -> VehicleNumbers:
    """Return the numbers of one of the last few vehicles: each run of a sweep makes an equal one again."""
    try:
        with np.errstate(all="ignore"):
            numbers = vehicle._numbers()
        plain = all(isfinite(part) if part.ndim == 0 else np.isfinite(part).all() for part in _parts(numbers))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        plain = False
    if not plain:
        why = "some are so large or so small that masses, areas or forces are not finite"
        problem = Problem(key="vehicle", found="its numbers", why=why, allowed="those of a real vehicle")
        raise VehicleError((problem,))
    return numbers


def _parts(numbers: VehicleNumbers) -> list[Any]:
    """Return the parts that follow from several numbers and have no infinite value that means something."""
    return [part for part in numbers if part.dtype.kind == "f"] + [
        *numbers.restoring,
        *numbers.propeller,
        *numbers.rudder,
        *numbers.stern_planes,
    ]


_KINDS = get_type_hints(Vehicle)
SECTIONS: dict[str, type] = {
    each.name: _KINDS[each.name] for each in fields(Vehicle) if each.default is MISSING
}
"""Every section of a vehicle and the dataclass that reads it."""


def to_mapping(vehicle: Vehicle) -> dict[str, dict[str, Any]]:
    """Return the plain numbers of a vehicle, section by section, as `from_mapping` takes them."""
    mapping = {section: getattr(vehicle, section).by_name() for section in SECTIONS}
    if vehicle.derivatives:
        mapping[DERIVATIVES] = dict(vehicle.derivatives.table)
    if vehicle.flow_axes != NO_FLOW_AXES:
        mapping[FLOW_AXES] = vehicle.flow_axes.by_name()
    for section in (*LISTS, HULL_SECTIONS):
        if rows := getattr(vehicle, section):
            mapping[section] = {name: part.by_name() for name, part in rows}
    for section in FURTHER:
        if part := getattr(vehicle, section):
            mapping[section] = part.by_name()
    return mapping


def from_mapping(mapping: Mapping[str, object]) -> Vehicle:
    """Make a vehicle from plain numbers: section → key → value in SI units.

    Raises:
        VehicleError: with every problem found: unknown or missing keys, text for a number, values outside the
            hard limits, a hull whose parts do not fit, an added mass that is no mass.
    """
    known, problems = [*SECTIONS, *OPTIONAL], []
    for name in mapping:
        if name not in known:
            key, allowed = str(name), nearest(name, known)
            problems.append(Problem(key=key, found="this table", why="no such section", allowed=allowed))
    sections: dict[str, Any] = read_optional(mapping, problems)
    for name, kind in SECTIONS.items():
        if name in mapping:
            sections[name] = read_section(kind, name, mapping[name], problems)
        else:
            why, allowed = "this table is missing", f"a table [{name}]"
            problems.append(Problem(key=name, found="nothing", why=why, allowed=allowed))
    if problems:
        raise VehicleError(tuple(problems))
    return Vehicle(**sections)


def inconsistencies(
    hull: Hull, added_mass: AddedMass, derivatives: Derivatives, density: float
) -> list[Problem]:
    """Return the inconsistencies between numbers that are valid by themselves."""
    problems = []
    tabled = derivatives.matrix("added_mass", density, hull.length) if derivatives else np.zeros((6, 6))
    if derivatives and np.linalg.eigvalsh(added_mass.matrix() + tabled)[0] < -1e-9:
        why = "the added mass would give negative kinetic energy"
        allowed = "a matrix without negative eigenvalues"
        problems.append(Problem(key=DERIVATIVES, found="its couplings", why=why, allowed=allowed))
    if hull.nose_length + hull.tail_length > hull.length:
        parts = f"nose {hull.nose_length:g} m and tail {hull.tail_length:g} m"
        why = f"together they are longer than the hull, {hull.length:g} m"
        problems.append(
            Problem(key="hull.tail_length", found=parts, why=why, allowed="a sum up to the length")
        )
    for key, coupling, mass, inertia in (
        ("sway_yaw", added_mass.sway_yaw, added_mass.sway, added_mass.yaw),
        ("heave_pitch", added_mass.heave_pitch, added_mass.heave, added_mass.pitch),
    ):
        if coupling * coupling > mass * inertia:  # a power would raise where this overflows
            limit = (mass * inertia) ** 0.5
            why = "the added mass would give negative kinetic energy"
            problems.append(
                Problem(key=f"added_mass.{key}", found=f"{coupling:g}", why=why, allowed=f"within ±{limit:g}")
            )
    return problems
