"""Motions whose answer is known without stepping: rest, small oscillations, terminal speed, steady turn."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import root

import vehicle


def test_a_neutral_vehicle_left_alone_stays_at_rest_exactly(subzero2):
    run = vehicle.free_run(subzero2, vehicle.initial_state(heading=0.0), (0, 0, 0, 0), 20.0)
    moving = np.delete(run.states, 17, axis=1)  # all but the charge that sensors draw
    assert np.array_equal(moving, np.tile(moving[0], (len(moving), 1)))


def test_a_heavy_vehicle_sinks_and_a_light_one_rises(subzero2):
    for net, sign in ((-0.3, 1.0), (0.3, -1.0)):
        hull = subzero2.with_parameter("buoyancy.net_buoyancy", net)
        assert sign * vehicle.free_run(hull, vehicle.initial_state(), (0, 0, 0, 0), 5.0).states[-1, 2] > 0.05


def period_of(signal, time):
    """Mean time between upward zero crossings, by straight lines between samples."""
    before = np.flatnonzero((signal[:-1] < 0) & (signal[1:] >= 0))
    crossings = time[before] - signal[before] * np.diff(time)[before] / (signal[before + 1] - signal[before])
    return np.diff(crossings).mean()


@pytest.mark.parametrize("angle,direction", [("roll", 3), ("pitch", 4)])
def test_small_oscillations_have_the_frequency_of_the_linear_theory(subzero2, angle, direction):
    """At rest M ν' = −W·BG (φ, θ): ω² = W·BG (M⁻¹)_ii, sway and yaw free to follow.

    Damping is quadratic, so it changes ω by the amplitude (0.1 degree) squared; samples are 0.01 s apart.
    """
    body = subzero2.rigid_body
    stiffness = body.mass * subzero2.water.gravity * body.centre_of_gravity_z
    omega = np.sqrt(stiffness * np.linalg.inv(subzero2.numbers().mass_matrix)[direction, direction])
    state = vehicle.initial_state(**{angle: np.radians(0.1)})
    run = vehicle.free_run(subzero2, state, (0, 0, 0, 0), 60.0, 0.01)
    index = {"roll": 0, "pitch": 1}[angle]
    signal = np.array([vehicle.euler_angles(row[3:7].copy())[index] for row in run.states])
    assert 2 * np.pi / period_of(signal, run.time) == pytest.approx(omega, rel=2e-4)


def test_terminal_speed_is_the_root_of_the_algebraic_balance(subzero2):
    """(1−t) ρ n² D⁴ K_T(J) = ½ρ (A C_D + 4 S C_D0) u², a quadratic equation in u."""
    n, P, rho = 24.0, subzero2.propeller, subzero2.water.density
    frontal = np.pi / 4 * subzero2.hull.diameter**2 * subzero2.axial_drag.drag_coefficient
    fins = 2 * sum(f.area * f.profile_drag_coefficient for f in (subzero2.rudder, subzero2.stern_planes))
    k, a = (1 - P.thrust_deduction) * rho * P.diameter**2, 1 - P.wake_fraction
    quadratic = [
        -k * P.thrust_curvature * a**2 - 0.5 * rho * (frontal + fins),
        -k * P.thrust_slope * n * P.diameter * a,
        k * P.thrust_constant * n**2 * P.diameter**2,
    ]
    speed = max(np.roots(quadratic))
    run = vehicle.free_run(subzero2, vehicle.initial_state(), (n, 0, 0, 0), 120.0)
    assert run.states[-1, 7] == pytest.approx(speed, rel=1e-10)  # 120 s are some forty time constants
    assert 0.95 < speed < 1.05
    assert np.all(np.diff(run.states[:, 7]) > -1e-9)  # no peak without a cable


@pytest.mark.parametrize("rudder_deg", [2.0, 5.0, 10.0, 20.0])
def test_a_steady_turn_is_the_root_of_the_algebraic_balance(subzero2, textbook, rudder_deg):
    """Six balances for u, v, w, roll, pitch, turn rate, from the independent writing of the equations."""
    n, angles = 24.0, (np.radians(rudder_deg), 0.0, 0.0)

    def balance(x):
        u, v, w, roll, pitch, turn = x
        down = np.array([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
        return textbook((u, v, w, *(turn * down)), down, n, angles)[0]

    found = root(balance, [0.8, -0.1, 0.0, 0.0, 0.0, 0.2], tol=1e-13)
    assert np.abs(found.fun).max() < 1e-12  # forces of order one, to rounding
    run = vehicle.free_run(
        subzero2, vehicle.initial_state(velocity=(0.9, 0, 0, 0, 0, 0)), (n, *angles), 120.0
    )
    last = run.states[-1]
    roll, pitch, _ = vehicle.euler_angles(last[3:7].copy())
    turn = np.linalg.norm(last[10:13])
    assert_allclose([*last[7:10], roll, pitch, turn], found.x, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    "rudder_deg,low,high", [(2, 3.3, 4.9), (5, 6.9, 10.3), (10, 10.7, 17.0), (20, 15, 23)]
)
def test_turn_rates_are_those_expected_from_the_geometry(subzero2, rudder_deg, low, high):
    """hull_parameters section 6 at 1 m/s: 4.2, 8.6, 13.4, 18.7 deg/s at 2, 5, 10, 20 degrees; ±20 %."""
    command = (24.0, np.radians(rudder_deg), 0.0, 0.0)
    run = vehicle.free_run(subzero2, vehicle.initial_state(velocity=(1, 0, 0, 0, 0, 0)), command, 60.0)
    assert low < np.degrees(run.states[-1, 12]) < high


def test_the_hull_keeps_its_course_by_itself(subzero2):
    """Yaw is stable, C = Y_v N_r − N_v (Y_r − m u) > 0, and a kick dies out without a rudder."""
    state = vehicle.initial_state(velocity=(1.0, 0.05, 0, 0, 0, 0.1), propeller_speed=24.0)
    run = vehicle.free_run(subzero2, state, (24, 0, 0, 0), 20.0)
    assert abs(run.states[-1, 12]) < 1e-4
