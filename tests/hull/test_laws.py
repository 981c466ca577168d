"""Laws that hold for every motion: no work by Coriolis forces, no energy from drag, a sum that is M ν'."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose

import vehicle
from vehicle.rigid_body import coriolis

speeds = arrays(float, 6, elements=st.floats(-3.0, 3.0))
angles = arrays(float, 3, elements=st.floats(-1.5, 1.5))
attitudes = st.tuples(st.floats(-3.1, 3.1), st.floats(-1.57, 1.57), st.floats(-3.1, 3.1))
quick = settings(max_examples=150, deadline=None)


def state_of(nu, fins=(0.0, 0.0, 0.0), attitude=(0.0, 0.0, 0.0), n=0.0):
    roll, pitch, heading = attitude
    state = vehicle.initial_state(
        roll=roll, pitch=pitch, heading=heading, velocity=tuple(nu), propeller_speed=n
    )
    state[14:17] = state[18:21] = fins
    return state


@quick
@given(arrays(float, (6, 6), elements=st.floats(-10.0, 10.0)), speeds)
def test_coriolis_forces_of_any_symmetric_mass_do_no_work(root, nu):
    mass, out = root @ root.T, np.empty(6)
    coriolis(mass, nu, out)
    scale = 1.0 + np.abs(mass).max() * np.abs(nu).max() ** 3
    assert abs(out @ nu) <= 1e-13 * 36 * scale  # rounding of 36 products


def test_the_mass_matrices_are_symmetric_and_positive_definite(subzero2):
    numbers = subzero2.numbers()
    for matrix in (numbers.rigid_body, numbers.added_mass, numbers.mass_matrix):
        assert_allclose(matrix, matrix.T, atol=0.0, rtol=0.0)
        assert np.linalg.eigvalsh(matrix).min() > 0.0
    assert_allclose(numbers.mass_matrix @ numbers.inverse_mass, np.eye(6), atol=1e-12)


def test_the_munk_moment_is_that_of_the_added_masses(subzero2):
    u, v, w = 1.2, 0.3, -0.2
    added = subzero2.added_mass
    moment = vehicle.breakdown_table(subzero2, state_of((u, v, w, 0, 0, 0)))["added_mass_coriolis"][3:]
    expected = [-(added.heave - added.sway) * v * w, (added.heave - added.surge) * u * w,
                -(added.sway - added.surge) * u * v]  # fmt: skip
    assert_allclose(moment, expected, rtol=1e-12, atol=1e-14)


@quick
@given(nu=speeds, fins=angles)
def test_every_loss_takes_energy_out_however_the_hull_moves_and_the_fins_stand(subzero2, nu, fins):
    table = vehicle.breakdown_table(subzero2, state_of(nu, fins))
    for term in vehicle.TERMS:
        if vehicle.POWERS[term.power] == "loss" and term.power >= 0:
            power = table[term.name] @ nu
            assert power <= 1e-12 * np.abs(table[term.name]).max(), term.name


@quick
@given(nu=speeds, attitude=attitudes)
def test_weight_and_buoyancy_only_trade_with_their_potential(subzero2, nu, attitude):
    heavy = subzero2.with_parameter("buoyancy.net_buoyancy", -0.7)
    heavy = heavy.with_parameter("rigid_body.centre_of_gravity_y", 0.002).numbers()
    state, step = state_of(nu, attitude=attitude), 1e-4
    out, rate = np.empty(4), np.empty(vehicle.STATE_SIZE)
    rest = (np.zeros(4), np.zeros(3), np.zeros(6), heavy)
    vehicle.power(state, *rest, out)
    vehicle.derivative(state, *rest, rate)
    rate[7:] = 0.0
    later, before = state + step * rate, state - step * rate
    slope = (vehicle.potential_energy(later, heavy) - vehicle.potential_energy(before, heavy)) / (2 * step)
    assert_allclose(
        out[2], -slope, atol=1e-5
    )  # central difference: step² times a third derivative of order 100


@quick
@given(nu=speeds, fins=angles, attitude=attitudes, n=st.floats(-50, 50))
def test_the_breakdown_adds_up_to_mass_times_acceleration(subzero2, rate, nu, fins, attitude, n):
    state, current, wrench = (
        state_of(nu, fins, attitude, n),
        (0.4, -0.3, 0.1),
        (1.0, -2.0, 0.5, 0.1, 0.2, -0.3),
    )
    table = vehicle.breakdown_table(subzero2, state, current_n=current, wrench_b=wrench)
    total = np.sum(list(table.values()), axis=0)
    acceleration = rate(subzero2, state, current=current, wrench=wrench)[7:13]
    scale = 1.0 + max(np.abs(values).max() for values in table.values())
    assert_allclose(subzero2.numbers().mass_matrix @ acceleration, total, rtol=0, atol=1e-12 * scale)
    assert tuple(table) == vehicle.BREAKDOWN
    assert_allclose(table["cable"], wrench)


@quick
@given(attitude=attitudes)
def test_rotations_are_orthogonal_and_angles_return(attitude):
    roll, pitch, heading = attitude
    quaternion, R = vehicle.quaternion_from_euler(roll, pitch, heading), np.empty((3, 3))
    vehicle.rotation(1.3 * quaternion, R)
    assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) == pytest.approx(1.0)
    again, R2 = vehicle.quaternion_from_euler(*vehicle.euler_angles(quaternion)), np.empty((3, 3))
    vehicle.rotation(again, R2)
    assert_allclose(R2, R, atol=1e-7)  # asin loses half the digits at pitch 90 degrees
    if abs(pitch) < 1.5:
        assert_allclose(vehicle.euler_angles(quaternion), attitude, atol=1e-12)


def test_the_rotation_is_the_papers_matrix():
    """Equation (2) of Feng and Allen: yaw, then pitch, then roll."""
    phi, theta, psi = 0.3, -0.5, 2.0
    c, s, R = np.cos, np.sin, np.empty((3, 3))
    vehicle.rotation(vehicle.quaternion_from_euler(phi, theta, psi), R)
    assert_allclose(R[:, 0], [c(psi) * c(theta), s(psi) * c(theta), -s(theta)], atol=1e-15)
    assert_allclose(R[2], [-s(theta), c(theta) * s(phi), c(theta) * c(phi)], atol=1e-15)
