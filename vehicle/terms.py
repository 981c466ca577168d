"""The forces on the hull: one visible table, and one line of code for each.

    M ν' = Σ terms,      M = M_RB + M_A                                (Fossen 2021, eq. 6.5, in components)

All hydrodynamic terms see ν_r = ν − (R_nbᵀ v_c, 0), the velocity relative to the water. A steady, uniform
current v_c carries an inertial frame with it, in which the vehicle moves with ν_r and M ν_r' = Σ (all terms
at ν_r). Over ground ν' = ν_r' + d/dt(R_nbᵀ v_c, 0) = ν_r' − (ω × R_nbᵀ v_c, 0), hence one more term,
"turning_current" = −M (ω × R_nbᵀ v_c, 0), for a hull that turns in a current. This is exact, with G anywhere
and M_RB full: no Coriolis matrix has to be chosen for the trick.

To add a force: a small file with a compiled function that fills six components, one line in TERMS, one line
at the same place in `fill_terms`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.jit import inlined, scratch
from vehicle.body_lift import add_flow_axes, body_lift
from vehicle.buoyancy_engine import add_engines
from vehicle.cross_flow import add_section_drag, cross_flow_drag
from vehicle.damping import axial_drag, linear_damping, quadratic_damping
from vehicle.derivatives import add_damping
from vehicle.fin_list import MOST_FINS, add_fins, listed_angle
from vehicle.fins import rudder, stern_plane
from vehicle.moving_mass import add_moving_masses
from vehicle.products import add_products
from vehicle.propeller import propeller
from vehicle.restoring import restoring
from vehicle.rigid_body import coriolis, munk_correction
from vehicle.thrusters import add_thrusters

if TYPE_CHECKING:
    from vehicle.vehicle import VehicleNumbers

INERTIAL, PROPULSION, LOSS, RESTORING, EXTERNAL = -1, 0, 1, 2, 3
"""Energy of a term: none, or the entry of `energy.POWERS` that its power belongs to."""


class Term(NamedTuple):
    """A named force: its name, its meaning, and the power that it belongs to."""

    name: str
    meaning: str
    power: int


TERMS = (
    Term("rigid_body_coriolis", "-C_RB(nu_r) nu_r, centripetal forces of the hull", INERTIAL),
    Term("added_mass_coriolis", "-C_A(nu_r) nu_r, Munk moment included", INERTIAL),
    Term("munk_correction", "(munk_factor - 1) times the Munk moment", LOSS),
    Term("turning_current", "-M (omega x v_c, 0), the current seen from a turning hull", INERTIAL),
    Term("body_lift", "viscous lift of the hull and its moment; forces in flow axes", LOSS),
    Term("cross_flow_drag", "strips of the hull across the flow", LOSS),
    Term("axial_drag", "drag of the hull along its axis", LOSS),
    Term("linear_damping", "further damping, linear, derivatives among it", LOSS),
    Term("quadratic_damping", "further damping, quadratic, derivatives among it", LOSS),
    Term("restoring", "weight and buoyancy", RESTORING),
    Term("propeller", "thrust and torque, of thrusters too; buoyancy engines, moved masses", PROPULSION),
    Term("rudder", "upper and lower rudder, and the fins of a list", LOSS),
    Term("stern_plane_port", "port stern-plane", LOSS),
    Term("stern_plane_starboard", "starboard stern-plane", LOSS),
    Term("cable", "force and moment from outside: the pull of the cable", EXTERNAL),
)

BREAKDOWN = tuple(term.name for term in TERMS)
POWER_OF_TERM = tuple(term.power for term in TERMS)
TERM_COUNT = len(TERMS)


@inlined
def turning_current(nu: np.ndarray, nu_r: np.ndarray, mass_matrix: np.ndarray, out: np.ndarray) -> None:
    """Fill out (6,) with −M (ω × v_c, 0) [N, N m]; v_c = ν − ν_r in body axes."""
    # All other terms belong to M ν̇_r, and the state is ν: a current that is steady on earth turns in body axes,
    # v̇_c = −ω × v_c, so M ν̇ = M ν̇_r + M (v̇_c, 0).
    a, b, c = nu[0] - nu_r[0], nu[1] - nu_r[1], nu[2] - nu_r[2]
    p, q, r = nu[3], nu[4], nu[5]
    x, y, z = q * c - r * b, r * a - p * c, p * b - q * a
    for i in range(6):
        out[i] = -(mass_matrix[i, 0] * x + mass_matrix[i, 1] * y + mass_matrix[i, 2] * z)


@inlined
def fill_terms(
    state: np.ndarray,
    nu_r: np.ndarray,
    R: np.ndarray,
    n: float,
    angles: tuple[float, float, float],
    wrench_b: np.ndarray,
    numbers: VehicleNumbers,
    out: np.ndarray,
) -> None:
    """Fill out (terms, 6) with every term of TERMS, in that order [N, N m].

    Args:
        state: of the vehicle.
        nu_r: velocity relative to the water, body axes. [m/s, rad/s]
        R: R_nb.
        n: shaft speed. [rev/s]
        angles: rudder, port plane, starboard plane in the water. [rad]
        wrench_b: external force and moment about the hull centre, body axes. [N, N m]
        numbers: VehicleNumbers.
        out: the terms.
    """
    nu = state[7:13]
    coriolis(numbers.rigid_body, nu_r, out[0])
    coriolis(numbers.added_mass, nu_r, out[1])
    munk_correction(nu_r, numbers.added_mass, numbers.munk_excess, out[2])
    turning_current(nu, nu_r, numbers.mass_matrix, out[3])
    body_lift(nu_r, numbers.body_lift, out[4])
    if numbers.winged:
        add_flow_axes(nu_r, numbers.flow_axes, out[4])
    cross_flow_drag(nu_r, numbers.strips, out[5])
    if numbers.has_sections:
        add_section_drag(nu_r, numbers.section_strips, out[5])
    axial_drag(nu_r, numbers.axial_drag, out[6])
    linear_damping(nu_r, numbers.linear_damping, out[7])
    quadratic_damping(nu_r, numbers.quadratic_damping, out[8])
    if numbers.tabled:
        add_damping(nu_r, numbers.linear_table, numbers.quadratic_table, out[7], out[8])
    restoring(R, numbers.restoring, out[9])
    propeller(nu_r, n, numbers.propeller, out[10])
    if numbers.thruster_count > 0:
        add_thrusters(state, nu_r, numbers.thrusters, numbers.thruster_count, out[10])
    if numbers.engine_count > 0:
        add_engines(state, R, numbers.engines, numbers.engine_count, out[10])
    rudder(nu_r, angles[0], numbers.rudder, out[11])
    if numbers.fin_count > 0:
        add_fins(state, nu_r, angles, numbers.fins, numbers.fin_count, out[11])
    stern_plane(nu_r, angles[1], -1.0, numbers.stern_planes, out[12])
    stern_plane(nu_r, angles[2], 1.0, numbers.stern_planes, out[13])
    if numbers.product_count > 0:
        own = scratch(1, MOST_FINS)[0]
        for i in range(numbers.fin_count):
            own[i] = listed_angle(state, angles, numbers.fins[i])
        add_products(nu_r, n, angles, own, numbers, out)
    for i in range(6):
        out[14, i] = wrench_b[i]
    if numbers.mass_count > 0:
        add_moving_masses(state, R, numbers.masses, numbers.mass_count, numbers.mass_matrix, out, out[10])
