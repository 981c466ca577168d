"""A heavy cable at rest between the drum and the vehicle hangs in a catenary.

Verifies: weight and tension of equation (7), T β' = w_c cosβ, T' = w_c sinβ, at rest: horizontal pull H from
S = 2a sinh(L/2a), a = H/w_c, for ends at one level; the same turned over for a cable that floats up. Configuration: a
rubbing drum gives S = 10 m and then holds; the vehicle comes back to a span of L = 9 m and waits until all is still.
Tolerance: the polygon's second order, 1/24 (Δs/a)² in a radius of 5.6 m: 1e-3 at half a metre, a quarter at a quarter.
"""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import cable

HOLDING = cable.DrumProperties(friction_torque=0.5)


def out_and_back(t):
    """North 10 m in 20 s, back 1 m in 4 s, then rest; without jolts."""
    if t < 20.0:
        return 0.5 * (1.0 - np.cos(0.1 * np.pi * t)), 0.0, 0.0
    if t < 24.0:
        return -0.25 * (1.0 - np.cos(0.5 * np.pi * (t - 20.0))), 0.0, 0.0
    return 0.0, 0.0, 0.0


@cache
def hanging(mass_per_length, segment_length):
    properties = cable.CableProperties(mass_per_length=mass_per_length)
    run = cable.pull_out(
        out_and_back,
        60.0,
        cable=properties,
        drum=HOLDING,
        scheme=cable.MovingEnd(segment_length=segment_length),
    )
    assert run.outcome.completed, run.outcome.message
    return run, properties.weight_in_water


@pytest.mark.parametrize("mass_per_length", [0.02, 0.001], ids=["sinking", "floating"])
@pytest.mark.parametrize(("segment_length", "tolerance"), [(0.5, 2e-3), (0.25, 5e-4)])
def test_a_cable_at_rest_hangs_in_a_catenary(mass_per_length, segment_length, tolerance):
    run, weight = hanging(mass_per_length, segment_length)
    S, L = run.length[-1], np.linalg.norm(run.tow_point[-1])
    a = brentq(lambda a: 2.0 * a * np.sinh(L / (2.0 * a)) - S, 0.3 * L, 30.0 * L)
    scale = abs(weight) * S
    expected = [
        -abs(weight) * a,
        0.0,
        0.5 * weight * S,
    ]  # towards the drum; half of the weight hangs on the vehicle
    np.testing.assert_allclose(run.tow_force[-1], expected, rtol=0, atol=tolerance * scale)
    line = run.shape(60.0)
    depth = a * (np.cosh(0.5 * L / a) - np.cosh((line[:, 0] - 0.5 * L) / a))
    np.testing.assert_allclose(line[:, 2], np.sign(weight) * depth, rtol=0, atol=tolerance * S)
    np.testing.assert_allclose(line[:, 1], 0.0, atol=1e-12)


def test_a_sinking_cable_pulls_the_vehicle_down_and_a_floating_one_up():
    assert hanging(0.02, 0.5)[0].tow_force[-1, 2] > 0.0
    assert hanging(0.001, 0.5)[0].tow_force[-1, 2] < 0.0


def test_the_drum_carries_the_other_half_of_the_weight():
    run, weight = hanging(0.02, 0.25)
    assert run.drum_tension[-1] == pytest.approx(run.tow_tension[-1], rel=1e-3)
    assert run.tow_tension[-1] > 0.5 * weight * run.length[-1]
