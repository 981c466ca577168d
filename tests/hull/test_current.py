"""A steady, uniform current is a moving frame: the same run, carried along."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import vehicle

CURRENT = np.array([0.35, -0.5, 0.15])
COMMAND = (26.0, 0.25, 0.1, -0.05)


@pytest.mark.parametrize("off_centre", [{}, {"x": 0.08, "y": 0.01, "z": 0.02}])
def test_a_uniform_current_equals_a_moving_frame(subzero2, off_centre):
    """Also with the centre of gravity far off centre, where the Coriolis matrices would betray a wrong one.

    One state: the rates over ground are those of still water, plus the drift, less ω × v_c in body axes.
    """
    hull = subzero2
    for axis, value in off_centre.items():
        hull = hull.with_parameter(f"rigid_body.centre_of_gravity_{axis}", value)
    state = vehicle.initial_state(roll=0.2, pitch=-0.4, heading=1.0, velocity=(0.8, 0.1, -0.1, 0.3, 0.2, 0.4))
    numbers, R = hull.numbers(), np.empty((3, 3))
    vehicle.rotation(state[3:7].copy(), R)
    rates = np.empty((2, vehicle.STATE_SIZE))
    vehicle.derivative(state, np.array(COMMAND), np.zeros(3), np.zeros(6), numbers, rates[0])
    carried = state.copy()
    carried[7:10] += R.T @ CURRENT
    vehicle.derivative(carried, np.array(COMMAND), CURRENT, np.zeros(6), numbers, rates[1])
    # d/dt of v = v_r + R^T v_c: the carried frame adds −ω × R^T v_c.
    expected = rates[0].copy()
    expected[0:3] += CURRENT
    expected[7:10] -= np.cross(state[10:13], R.T @ CURRENT)
    assert_allclose(rates[1], expected, rtol=0, atol=1e-12)


def test_a_whole_manoeuvre_is_carried_along(subzero2):
    """Twenty seconds of hard turning: 1e-9 in speed, attitude and position against the still-water run.

    Runge-Kutta integrates v instead of v_r here, so the runs differ by truncation; the step is refined until
    that is below the tolerance, and the difference falls with its fourth power.
    """
    still = vehicle.initial_state(heading=1.0, velocity=(1.0, 0, 0, 0, 0, 0), propeller_speed=24.0)
    R = np.empty((3, 3))
    vehicle.rotation(still[3:7].copy(), R)
    carried = still.copy()
    carried[7:10] += R.T @ CURRENT
    command = (24.0, 0.1, 0.05, 0.05)
    a = vehicle.free_run(subzero2, still, command, 20.0, 0.002)
    b = vehicle.free_run(subzero2, carried, command, 20.0, 0.002, current_n=CURRENT)
    assert_allclose(b.states[:, 0:3], a.states[:, 0:3] + np.outer(a.time, CURRENT), rtol=0, atol=1e-9)
    assert_allclose(b.states[:, 3:7], a.states[:, 3:7], rtol=0, atol=1e-9)
    assert_allclose(b.states[:, 10:17], a.states[:, 10:17], rtol=0, atol=1e-9)


def test_a_hull_adrift_in_a_current_is_carried_at_its_speed(subzero2):
    run = vehicle.free_run(
        subzero2, vehicle.initial_state(), (0, 0, 0, 0), 600.0, 0.05, current_n=(0.0, 0.5, 0.0)
    )
    R = np.empty((3, 3))
    vehicle.rotation(run.states[-1, 3:7].copy(), R)
    assert_allclose(R @ run.states[-1, 7:10], [0.0, 0.5, 0.0], atol=0.01)  # quadratic drag: creeps as 1/t
