"""Nature has no favourite direction: turned or mirrored manoeuvres give turned or mirrored forces.

Verifies: heading, any rotation and any mirror for the neutral cable, heading and port/starboard for a heavy one with
current, drum inertia and friction; independence of when a run begins. Configuration: random three-dimensional
manoeuvres of three harmonics about a steady course, 0.5 m, 0.1 s. Tolerance: 1e-9 N, what the issue asks, of forces
near 0.3 N; rounding alone is 1e-13 (measured), because the equations are vectors.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import cable

TOLERANCE = 1e-9
HEAVY = cable.CableProperties(mass_per_length=0.02)
DRUM = cable.DrumProperties(inertia=1e-4, friction_torque=0.01)
numbers = st.floats(-1.0, 1.0, allow_nan=False)
angles = st.floats(-3.1, 3.1, allow_nan=False)
amplitudes = arrays(float, (3, 3), elements=numbers)


def manoeuvre(course, climb, amplitude):
    """Return a smooth motion at about 1 m/s along a course, swaying in all directions."""
    ahead = np.array([np.cos(course) * np.cos(climb), np.sin(course) * np.cos(climb), -np.sin(climb)])
    rates, phases = np.array([0.2, 0.37, 0.53]), np.array([0.3, 1.1, 2.0])
    return lambda t: ahead + 0.2 * amplitude @ np.sin(rates * t + phases)


def turned(matrix, motion):
    return lambda t: matrix @ motion(t)


def about_down(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation(angle_1, angle_2, angle_3):
    """Return any rotation, by three turns about down, north, down."""
    c, s = np.cos(angle_2), np.sin(angle_2)
    about_north = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return about_down(angle_1) @ about_north @ about_down(angle_3)


def assert_follows(matrix, motion, **kwargs):
    """Assert that the manoeuvre seen through `matrix` gives forces, lengths and shapes seen through it."""
    plain = cable.pull_out(motion, 8.0, **kwargs)
    if "current" in kwargs:
        kwargs["current"] = matrix @ kwargs["current"]
    other = cable.pull_out(turned(matrix, motion), 8.0, **kwargs)
    assert plain.outcome.completed, plain.outcome.message
    np.testing.assert_allclose(other.tow_force, plain.tow_force @ matrix.T, rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(other.length, plain.length, rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(other.shape(8.0), plain.shape(8.0) @ matrix.T, rtol=0, atol=TOLERANCE)


@pytest.mark.long
@given(course=angles, climb=angles, amplitude=amplitudes, turn=angles)
@settings(max_examples=25, deadline=None, derandomize=True)
def test_turning_the_heading_turns_the_force(course, climb, amplitude, turn):
    assert_follows(about_down(turn), manoeuvre(course, climb, amplitude))


@given(amplitude=amplitudes, turns=st.tuples(angles, angles, angles))
@settings(max_examples=25, deadline=None, derandomize=True)
def test_a_neutral_cable_in_still_water_knows_neither_up_nor_north(amplitude, turns):
    assert_follows(rotation(*turns), manoeuvre(0.3, 0.2, amplitude))


@pytest.mark.parametrize("axis", [0, 1, 2], ids=["fore and aft", "port and starboard", "up and down"])
@given(course=angles, climb=angles, amplitude=amplitudes)
@settings(max_examples=10, deadline=None, derandomize=True)
def test_mirroring_a_manoeuvre_of_the_neutral_cable_mirrors_the_force(axis, course, climb, amplitude):
    mirror = np.eye(3)
    mirror[axis, axis] = -1.0
    assert_follows(mirror, manoeuvre(course, climb, amplitude))


@given(course=angles, amplitude=amplitudes, turn=angles)
@settings(max_examples=15, deadline=None, derandomize=True)
def test_a_heavy_cable_in_a_current_turns_and_mirrors_with_everything_else(course, amplitude, turn):
    mirror = about_down(turn) @ np.diag([1.0, -1.0, 1.0])
    stream = np.array([0.1, -0.05, 0.0])
    motion = manoeuvre(course, 0.1, amplitude)
    assert_follows(mirror, motion, cable=HEAVY, drum=DRUM, current=stream)


def test_a_heavy_cable_knows_where_down_is():
    motion = manoeuvre(0.0, 0.0, np.zeros((3, 3)))
    down = cable.pull_out(motion, 8.0, cable=HEAVY, drum=DRUM).tow_force[-1, 2]
    assert down > 0.1  # it hangs on the vehicle and pulls it down
    light = cable.CableProperties(mass_per_length=0.001)
    assert cable.pull_out(motion, 8.0, cable=light, drum=DRUM).tow_force[-1, 2] < -0.01


def test_a_run_does_not_depend_on_when_it_begins():
    """The same motion later on the clock, from a tow point that waits (no cable comes out while it does)."""
    motion = manoeuvre(0.4, 0.3, np.full((3, 3), 0.5))
    prompt = cable.pull_out(motion, 8.0)
    late = cable.pull_out(lambda t: motion(t - 4.0) if t > 4.0 - 1e-9 else (0.0, 0.0, 0.0), 12.0)
    assert np.abs(late.tow_force[:40]).max() < 1e-6
    # The jolt of a start at speed settles in two steps; the histories of the difference formula differ there.
    np.testing.assert_allclose(late.tow_force[45:], prompt.tow_force[5:], rtol=0, atol=1e-4)


def test_a_vehicle_that_drifts_with_the_water_feels_no_cable():
    """Galilean invariance, where the drum allows it: nothing moves through the water, nothing pulls."""
    stream = np.array([0.3, -0.2, 0.1])
    run = cable.pull_out(lambda _: stream, 10.0, current=stream)
    assert run.outcome.completed
    assert run.tow_tension.max() < 1e-5
    straight = cable.pull_out(lambda _: stream, 10.0)
    assert straight.tow_tension.max() > 0.02


def test_water_that_streams_against_the_course_pulls_as_a_faster_vehicle_does_beyond_the_drum():
    """Of 10 m of cable at 0.8 m/s in a stream of −0.2 m/s: drag of 1 m/s, length of 0.8 m/s."""
    against = cable.pull_out(lambda _: (0.8, 0.0, 0.0), 12.5, current=(-0.2, 0.0, 0.0))
    still = cable.pull_out(lambda _: (1.0, 0.0, 0.0), 10.0)
    assert against.tow_tension[-1] == pytest.approx(still.tow_tension[-1], rel=1e-6)
