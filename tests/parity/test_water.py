"""The water as compiled code sees it and as Python sees it, and currents that are the same in two descriptions.

Verifies: `Current.at` against `water_velocity` at random places and times, on the grid, between and outside; a profile
that is constant, and a profile felt at one depth only, against the uniform current.
Tolerance: 1e-14 m/s for two ways to interpolate numbers near 1 m/s; nothing at all for a constant profile of
powers of two (shares of them add up without rounding), 1e-12 of the force where the depth itself is rounded.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import cable
from cable.current import water_velocity
from subzero.jit import compiled

HEAVY = cable.CableProperties(mass_per_length=0.0098)
STREAM = np.array([0.125, -0.25, 0.0625])
"""Powers of two: shares of them are exact, and two shares that make one give the number itself."""
AXES = ("time", "north", "east", "down")


@compiled
def felt(water, north, east, down, time):
    return water_velocity(water, north, east, down, time)


def grid(sizes, seed):
    """Return a random current on a random grid, and the generator."""
    rng = np.random.default_rng(seed)
    points = {name: np.cumsum(rng.uniform(0.1, 5.0, n)) - 5.0 for name, n in zip(AXES, sizes, strict=True)}
    return cable.Current(**points, velocity=rng.uniform(-1.0, 1.0, (*sizes, 3))), rng


@given(sizes=st.tuples(*[st.integers(1, 4)] * 4), seed=st.integers(0, 10**6))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_compiled_and_python_agree_everywhere(sizes, seed):
    current, rng = grid(sizes, seed)
    origin = rng.uniform(-3.0, 3.0, 3)
    water = current.numbers(origin)
    for _ in range(20):
        place, time = rng.uniform(-15.0, 20.0, 3), rng.uniform(-15.0, 20.0)
        assert_allclose(felt(water, *(place - origin), time), current.at(place, time), rtol=0, atol=1e-14)


@given(sizes=st.tuples(*[st.integers(1, 4)] * 4), seed=st.integers(0, 10**6))
@settings(max_examples=30, deadline=None, derandomize=True)
def test_at_its_points_the_grid_is_what_was_given(sizes, seed):
    current, rng = grid(sizes, seed)
    row = tuple(int(rng.integers(n)) for n in sizes)
    time, *place = (getattr(current, name)[k] for name, k in zip(AXES, row, strict=True))
    assert_allclose(current.at(place, time), current.velocity[row], rtol=0, atol=1e-15)
    assert_allclose(felt(current.numbers(), *place, time), current.velocity[row], rtol=0, atol=1e-15)


def test_a_linear_current_is_held_exactly_inside_the_grid_and_at_its_edge_beyond():
    """The value between the points by hand: 0.3 + 0.02 d − 0.1 t, whose edges are at 10 m and 4 s."""
    current = cable.Current.sampled(
        lambda n, e, d, t: (0.3 + 0.02 * d - 0.1 * t, 0.0, 0.01 * n),
        north=[0.0, 2.0],
        down=[0.0, 10.0],
        time=[0.0, 4.0],
    )
    for place, time, expected in [
        ((1.0, 99.0, 5.0), 1.0, (0.3, 0.0, 0.01)),
        ((3.0, -7.0, 40.0), 9.0, (0.1, 0.0, 0.02)),
        ((-1.0, 0.0, -4.0), -2.0, (0.3, 0.0, 0.0)),
    ]:
        assert_allclose(current.at(place, time), expected, rtol=0, atol=1e-15)
        assert_allclose(felt(current.numbers(), *place, time), expected, rtol=0, atol=1e-15)


def swaying(t):
    return (1.0 + 0.2 * np.sin(0.5 * t), 0.3 * np.sin(0.3 * t), 0.1 * np.sin(0.4 * t))


@pytest.mark.parametrize("rate", [0.0, 1e-3], ids=["given steps", "chosen steps"])
def test_a_constant_profile_is_the_uniform_current_to_the_bit(rate):
    profile = cable.Current.profile(down=[-0.3, 0.1, 0.7], velocity=[STREAM, STREAM, STREAM])
    uniform, layered = (
        cable.pull_out(swaying, 6.0, cable=HEAVY, current=J, scheme=cable.MovingEnd(rtol=rate))
        for J in (STREAM, profile)
    )
    assert_array_equal(layered.tow_force, uniform.tow_force)
    assert_array_equal(layered.shapes[-1], uniform.shapes[-1])


def test_a_level_tow_feels_the_profile_at_its_depth():
    profile = cable.Current.profile(
        down=[-10.0, 2.0, 10.0], velocity=[[1.0, 1.0, 0.0], [0.2, 0.1, 0.0], [0.0, -1.0, 0.0]]
    )
    at_depth = profile.at((0.0, 0.0, 0.0))
    assert np.abs(at_depth - (0.2, 0.1, 0.0)).max() > 0.1, "between the points, not on one"
    layered, uniform = (
        cable.tow(lambda _: (1.0, 0.0, 0.0), 20.0, 5.0, current=J) for J in (profile, at_depth)
    )
    assert_allclose(layered.tow_force, uniform.tow_force, rtol=1e-12, atol=1e-12)


def test_the_grid_of_a_pulled_cable_is_relative_to_the_drum_and_of_a_towed_one_to_the_tow_point():
    """A front at 5 m north, still water before it and a stream across behind it: who is where feels what."""
    front = cable.Current(
        north=np.array([5.0, 5.001]), velocity=np.array([[0, 0, 0], [0, 0.5, 0]])[None, :, None, None]
    )
    pulled = cable.pull_out(lambda _: (1.0, 0.0, 0.0), 8.0, current=front)
    before = pulled.time < 4.9
    assert np.abs(pulled.tow_force[before, 1]).max() < 1e-12
    assert pulled.tow_force[-1, 1] > 1e-3
    towed = cable.tow(lambda _: (1.0, 0.0, 0.0), 10.0, 8.0, current=front)
    assert np.abs(towed.tow_force[before, 1]).max() < 1e-12
    assert towed.tow_force[-1, 1] > 1e-3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: cable.Current.uniform([1.0, 0.0]), r"three finite numbers \(north, east, down\)"),
        (lambda: cable.Current.uniform([np.nan, 0.0, 0.0]), "current must be finite numbers"),
        (lambda: cable.Current.profile([0.0, 0.0], np.zeros((2, 3))), "down must be numbers that increase"),
        (lambda: cable.Current.profile([5.0, 1.0], np.zeros((2, 3))), "down must be numbers that increase"),
        (lambda: cable.Current.profile([0.0, np.inf], np.zeros((2, 3))), "down is .*each a finite number"),
        (lambda: cable.Current.profile([0.0, 1.0], np.zeros((3, 3))), r"must be \(1, 1, 1, 2, 3\) \(time, north"),
        (lambda: cable.Current.profile([0.0, 1.0], np.full((2, 3), np.nan)), "velocity is .*each a finite number"),
        (lambda: cable.Current.sampled(lambda *_: (0.0, 0.0), time=[0.0, 1.0]), r"must be \(2, 1, 1, 1, 3\)"),
        (lambda: cable.Current.sampled(lambda *_: (0.0,) * 3, time=[1.0, 0.0]), "time must be numbers that increase"),
        (lambda: cable.pull_out(swaying, 1.0, current=[0.1, 0.2]), "current must be three finite numbers"),
        (lambda: cable.tow(swaying, 5.0, 1.0, current=[0.1, np.inf, 0.0]), "current must be finite numbers"),
    ],
)  # fmt: skip
def test_what_is_no_current_is_refused_with_its_name(make, message):
    with pytest.raises(ValueError, match=message):
        make()
