"""REMUS 100 as data alone: Prestero's table (2001, adjusted set) put into a vehicle comes out of it again.

Card: coefficients as listed in hull_parameters 3.1, rho 1030; hull lift and fins split as printed there; the
pair of fins has Y_uu_dr 9.64 kg/(m rad) at x -0.638 m. Tolerance 2 %: the table is printed to three digits
and its M_rp, N_pq (4.86) carry a rounding of their own (4.88 and 0.0704 make 4.81).
"""

import copy

import numpy as np
import pytest

import vehicle

CHANGES = {
    "water": {"density": 1030.0},
    "hull": {"length": 1.33, "diameter": 0.191, "nose_station": 0.61,
             "nose_length": 0.191, "tail_length": 0.541},
    "rigid_body": {"mass": 30.48, "roll_inertia": 0.165, "pitch_inertia": 3.44, "yaw_inertia": 3.45,
                   "centre_of_gravity_x": 0.0, "centre_of_gravity_z": 0.0196},
    "buoyancy": {"net_buoyancy": 7.0, "centre_of_buoyancy_x": 0.0},
    "added_mass": {"surge": 0.93, "sway": 35.5, "heave": 35.5, "roll": 0.0704, "pitch": 4.88, "yaw": 4.88,
                   "sway_yaw": -1.93, "heave_pitch": 1.93},
    "axial_drag": {"drag_coefficient": 1.62 / (0.5 * 1030 * np.pi / 4 * 0.191**2)},
    "body_lift": {"sway_per_sway": -18.96, "yaw_per_sway": 4.47, "yaw_per_yaw": 0.0,
                  "heave_per_heave": -18.96, "pitch_per_heave": -4.47, "pitch_per_pitch": 0.0},
    "cross_flow_drag": {"drag_coefficient": 0.0},
    "quadratic_damping": {"sway_per_sway": -1310.0, "sway_per_yaw": 0.632, "yaw_per_sway": -3.18,
                          "yaw_per_yaw": -94.0,
                          "heave_per_heave": -131.0, "heave_per_pitch": -0.632, "pitch_per_heave": 3.18,
                          "pitch_per_pitch": -188.0, "roll_per_roll": -0.130},
    "rudder": {"area": 0.00665, "lift_slope": 9.64 / (1030 * 0.00665), "station": -0.638,
               "profile_drag_coefficient": 0.0},
    "stern_planes": {"area": 0.00665, "lift_slope": 9.64 / (1030 * 0.00665), "station": -0.638,
                     "profile_drag_coefficient": 0.0},
}  # fmt: skip

AXES = "XYZKMN"
SPEEDS = "uvwpqr"


@pytest.fixture(scope="module")
def remus(mapping):
    values = copy.deepcopy(mapping)
    for section, changes in CHANGES.items():
        values[section].update(changes)
    return vehicle.from_mapping(values)


@pytest.fixture(scope="module")
def coefficient(remus):
    """Return a function: how much of a force two velocities make together, ("N", "uv") → N_uv.

    The mixed second difference of the sum of the hydrodynamic terms, at velocities so small beside surge that
    the quadratic damping (odd in each) drops out.
    """

    def total(nu, leave_out):
        table = vehicle.breakdown_table(remus, vehicle.initial_state(velocity=tuple(nu)))
        out = ("restoring", "propeller", "rigid_body_coriolis", *leave_out)
        return sum(values for name, values in table.items() if name not in out)

    def call(axis, pair, leave_out=("quadratic_damping",)):
        first, second = (SPEEDS.index(letter) for letter in pair)
        nu, h = np.zeros((4, 6)), (1.0 if first == 0 else 1e-3, 1e-3)
        for row, (a, b) in zip(nu, ((1, 1), (1, -1), (-1, 1), (-1, -1)), strict=True):
            row[first] += a * h[0]
            row[second] += b * h[1]
        if first == second:
            return total(nu[0], leave_out)[AXES.index(axis)] / (4 * h[0] ** 2 if first else h[0] ** 2)
        if first == 0:  # the hull moves ahead; astern is another flow
            forces = total(nu[0], leave_out) - total(nu[1], leave_out)
            return forces[AXES.index(axis)] / (2 * h[0] * h[1])
        forces = [total(row, leave_out) for row in nu]
        return (forces[0] - forces[1] - forces[2] + forces[3])[AXES.index(axis)] / (4 * h[0] * h[1])

    return call


LISTED = {
    "X_wq": -35.5, "X_vr": 35.5, "X_qq": -1.93, "X_rr": -1.93, "Y_wp": 35.5, "Z_vp": -35.5,
    "Y_pq": 1.93, "Z_rp": 1.93,
    "M_rp": 4.86, "N_pq": -4.86, "M_vp": -1.93, "N_wp": -1.93,
    "Y_uv": -28.6, "Z_uw": -28.6, "Y_ur": 5.22, "Z_uq": -5.22, "M_uw": 24.0, "N_uv": -24.0,
    "M_uq": -2.0, "N_ur": -2.0,
}  # fmt: skip


@pytest.mark.parametrize("name", LISTED)
def test_products_of_velocities_have_the_listed_coefficients(coefficient, name):
    fins = ("rudder", "stern_plane_port", "stern_plane_starboard")
    without = (
        "quadratic_damping",
        *(fins if "u" not in name else ()),
    )  # listed cross terms are added mass alone
    assert coefficient(name[0], name[2:], without) == pytest.approx(LISTED[name], rel=0.02)


def test_the_axial_drag_is_the_listed_one(remus):
    table = vehicle.breakdown_table(remus, vehicle.initial_state(velocity=(1.54, 0, 0, 0, 0, 0)))
    assert table["axial_drag"][0] == pytest.approx(-1.62 * 1.54**2)


def test_quadratic_damping_is_the_listed_one(remus):
    velocity = (0.0, 0.3, -0.2, 0.4, -0.5, 0.6)
    force = vehicle.breakdown_table(remus, vehicle.initial_state(velocity=velocity))["quadratic_damping"]
    _, v, w, p, q, r = (x * abs(x) for x in velocity)
    expected = [
        0.0,
        -1310 * v + 0.632 * r,
        -131 * w - 0.632 * q,
        -0.13 * p,
        3.18 * w - 188 * q,
        -3.18 * v - 94 * r,
    ]
    assert force == pytest.approx(expected)


def test_linear_damping_brakes_each_motion_by_its_own_derivative(subzero2):
    hull, velocity = subzero2, (0.5, -0.3, 0.2, 0.4, -0.5, 0.6)
    values = {"surge": -1.0, "sway": -2.0, "heave": -3.0, "roll": -0.4, "pitch": -0.5, "yaw": -0.6}
    for name, value in values.items():
        hull = hull.with_parameter(f"linear_damping.{name}", value)
    force = vehicle.breakdown_table(hull, vehicle.initial_state(velocity=velocity))["linear_damping"]
    assert force == pytest.approx(np.array(list(values.values())) * velocity)


@pytest.mark.parametrize("factor", [0.0, 0.6, 1.4])
def test_the_munk_factor_scales_the_munk_moment_and_nothing_else(subzero2, factor):
    state = vehicle.initial_state(velocity=(1.0, 0.2, -0.3, 0, 0, 0))
    plain = vehicle.breakdown_table(subzero2, state)
    scaled = vehicle.breakdown_table(subzero2.with_parameter("added_mass.munk_factor", factor), state)
    assert np.array_equal(np.abs(plain["munk_correction"]), np.zeros(6))
    moment = scaled["added_mass_coriolis"] + scaled["munk_correction"]
    assert moment[3:] == pytest.approx(factor * plain["added_mass_coriolis"][3:])
    assert moment[:3] == pytest.approx(plain["added_mass_coriolis"][:3])
