"""A cable of fixed length with a free tail: steady states with closed forms, kept to rounding at every step.

Verifies `cable.tow`: the straight tow T(s) = (½ρπdC_t (L − s) + ½ρC_dA) U² and, for a cable with weight, the critical
angle ½ρdC_n U² sin²φ = |w_c| cosφ with dT/ds = −(½ρπdC_t U² cos²φ + w_c sinφ). These are exact solutions of the
discrete equations too (straight, uniform), so what is left is the tolerance of Newton's method, 1e-9 of the tension in
every balance, summed up over sixty nodes.
"""

import numpy as np
import pytest

import cable

TABLE_1 = cable.CableProperties()
HEAVY = cable.CableProperties(mass_per_length=0.0098)
LIGHT = cable.CableProperties(mass_per_length=0.0035)
TOLERANCE = 1e-7


def northward(speed):
    return lambda t: (speed, 0.0, 0.0)


@pytest.mark.parametrize("speed", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("segment_length", [0.5, 0.7])
def test_a_straight_tow_stays_what_it_is_at_every_step(speed, segment_length):
    run = cable.tow(northward(speed), 30.0, 5.0, scheme=cable.MovingEnd(segment_length=segment_length))
    exact = TABLE_1.tangential_drag * speed**2 * 30.0
    np.testing.assert_allclose(run.tow_tension, exact, rtol=TOLERANCE)
    np.testing.assert_allclose(run.length, 30.0, rtol=1e-12)
    assert (run.tow_force[1:, 0] < 0.0).all(), "the cable pulls back"
    assert np.abs(run.tow_force[:, 1:]).max() == 0.0


def test_tension_falls_linearly_to_nothing_at_the_free_tail():
    run = cable.tow(northward(1.0), 12.0, 2.0)
    along = np.linalg.norm(run.shapes[-1] - run.shapes[-1][0], axis=1)
    exact = TABLE_1.tangential_drag * (12.0 - along)
    np.testing.assert_allclose(run.tensions[-1], exact, atol=TOLERANCE)


def test_a_drogue_adds_its_own_drag_everywhere():
    run = cable.tow(northward(1.5), 10.0, 3.0, drogue_drag_area=0.01)
    drogue = 0.5 * 1000.0 * 0.01 * 1.5**2
    np.testing.assert_allclose(run.drum_tension[1:], drogue, rtol=TOLERANCE)
    np.testing.assert_allclose(
        run.tow_tension, drogue + TABLE_1.tangential_drag * 1.5**2 * 10.0, rtol=TOLERANCE
    )


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(("properties", "side"), [(HEAVY, 1.0), (LIGHT, -1.0)])
def test_a_cable_with_weight_tows_at_the_critical_angle(speed, properties, side):
    """Below the tow point when it sinks, above it when it floats; the angle by its own equation, solved here."""
    run = cable.tow(northward(speed), 30.0, 10.0, cable=properties)
    x, z = run.shapes[-1][-1, [0, 2]] - run.shapes[-1][0, [0, 2]]
    phi = np.arctan2(side * z, -x)
    across = properties.normal_drag * speed**2 * np.sin(phi) ** 2
    assert across == pytest.approx(abs(properties.weight_in_water) * np.cos(phi), rel=1e-7)
    slope = properties.tangential_drag * (speed * np.cos(phi)) ** 2 + abs(
        properties.weight_in_water
    ) * np.sin(phi)
    np.testing.assert_allclose(run.tow_tension[1:], 30.0 * slope, rtol=1e-7)
    assert side * run.tow_force[-1, 2] > 0.0, "what sinks pulls down, what floats pulls up"


def test_the_critical_angle_is_found_from_another_one():
    """Start at 2 m/s, slow down to 1 m/s within a second, wait: the cable forgets."""
    run = cable.tow(
        lambda t: (2.0 - min(t, 1.0), 0.0, 0.0),
        20.0,
        120.0,
        cable=HEAVY,
        scheme=cable.MovingEnd(time_step=0.2),
    )
    assert run.outcome.completed, run.outcome.message
    away = run.shapes[-1][10] - run.shapes[-1][0]  # far from the tail
    assert np.arctan2(away[2], -away[0]) == pytest.approx(HEAVY.critical_angle(1.0), rel=1e-3)


def test_a_moored_cable_in_a_current_is_a_towed_one():
    towed = cable.tow(northward(1.0), 15.0, 3.0, cable=HEAVY)
    moored = cable.tow(northward(0.0), 15.0, 3.0, cable=HEAVY, current=(-1.0, 0.0, 0.0))
    np.testing.assert_allclose(moored.tow_force[1:], towed.tow_force[1:], rtol=1e-8, atol=1e-10)


def test_impossible_lengths_are_refused():
    with pytest.raises(ValueError, match=r"length is -1\.0; it must be a finite number, more than 0"):
        cable.tow(northward(1.0), -1.0, 3.0)
