"""Mirrors and turns: port and starboard, any heading, nose and keel."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import vehicle

MIRROR = np.array([1, -1, 1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, 1, 1, -1, 1, 1], dtype=float)
"""Signs of the state seen in a mirror (y → −y): even north, depth, pitch; odd east, roll, heading, rudder."""


def mirrored(states):
    """Swap port and starboard in states (..., STATE_SIZE)."""
    swapped = states * MIRROR
    swapped[..., [15, 16, 19, 20]] = swapped[..., [16, 15, 20, 19]]
    return swapped


def test_port_and_starboard_are_mirror_images(subzero2):
    """With a left-handed propeller in the mirror, every run is its mirror image, to rounding."""
    left = subzero2.with_parameter("propeller.reaction_torque_factor", -1.0)
    start = vehicle.initial_state(roll=0.3, pitch=0.2, heading=0.4, velocity=(1.0, 0.2, -0.1, 0.3, 0.1, -0.2))
    run = vehicle.free_run(subzero2, start, (25.0, 0.2, 0.1, -0.15), 20.0)
    image = vehicle.free_run(left, mirrored(start), (25.0, -0.2, -0.15, 0.1), 20.0)
    assert_allclose(mirrored(image.states), run.states, rtol=0, atol=1e-10)


@pytest.mark.parametrize("turn", [0.7, np.pi, -2.5])
def test_physics_does_not_know_where_north_is(subzero2, turn):
    start = {"pitch": 0.2, "velocity": (1.0, 0.2, -0.1, 0.3, 0.1, -0.2)}
    a = vehicle.free_run(subzero2, vehicle.initial_state(**start), (25.0, 0.2, 0.1, -0.1), 20.0)
    b = vehicle.free_run(subzero2, vehicle.initial_state(heading=turn, **start), (25.0, 0.2, 0.1, -0.1), 20.0)
    c, s = np.cos(turn), np.sin(turn)
    north, east = a.states[:, 0], a.states[:, 1]
    turned = np.column_stack([c * north - s * east, s * north + c * east, a.states[:, 2]])
    assert_allclose(b.states[:, :3], turned, rtol=0, atol=1e-9)
    assert_allclose(b.states[:, 7:], a.states[:, 7:], rtol=0, atol=1e-9)


def test_a_dive_on_its_side_is_a_turn(subzero2):
    """Without righting moment (BG = 0) and propeller torque, planes pitch as the rudder yaws."""
    hull = subzero2.with_parameter("rigid_body.centre_of_gravity_z", 0.0)
    hull = hull.with_parameter("propeller.reaction_torque_factor", 0.0)
    start = vehicle.initial_state(velocity=(1.0, 0, 0, 0, 0, 0), propeller_speed=24.0)
    turn = vehicle.free_run(hull, start, (24.0, 0.1, 0.0, 0.0), 10.0).states
    loop = vehicle.free_run(hull, start, (24.0, 0.0, 0.1, 0.1), 10.0).states
    assert_allclose(loop[:, 11], turn[:, 12], rtol=0, atol=1e-10)  # q of the loop is r of the turn
    assert_allclose(loop[:, 9], -turn[:, 8], rtol=0, atol=1e-10)
    assert_allclose(-loop[:, 2], turn[:, 1], rtol=0, atol=1e-9)


def test_the_attitude_passes_through_the_vertical_without_a_jump(subzero2):
    """A looping: pitch goes through 90 degrees, where Euler angles fail; the quaternion has length one."""
    hull = subzero2.with_parameter("rigid_body.centre_of_gravity_z", 0.0)
    hull = hull.with_parameter("propeller.reaction_torque_factor", 0.0)
    start = vehicle.initial_state(velocity=(1.0, 0, 0, 0, 0, 0), propeller_speed=30.0)
    states = vehicle.free_run(hull, start, (30.0, 0.0, 0.3, 0.3), 40.0).states
    norm = np.linalg.norm(states[:, 3:7], axis=1)
    assert_allclose(norm, 1.0, rtol=0, atol=4e-15)
    assert states[:, 2].max() - states[:, 2].min() > 2.0
    forward_down = 2 * (states[:, 4] * states[:, 6] - states[:, 3] * states[:, 5])
    assert forward_down.min() < -0.999  # straight up at some time
    assert np.abs(np.diff(states[:, 10:13], axis=0)).max() < 0.1
    assert np.all(np.isfinite(states))
