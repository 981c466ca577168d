"""Propeller in four quadrants and fins at every incidence: finite, continuous, and what the open water
says.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from vehicle.fins import rudder, section_force, stern_plane
from vehicle.propeller import propeller, thrust, torque


@pytest.fixture(scope="module")
def screw(subzero2):
    return subzero2.propeller.numbers(subzero2.water.density)


@pytest.fixture(scope="module")
def fin(subzero2):
    return subzero2.rudder.numbers(subzero2.water.density)


def test_ahead_the_propeller_has_its_open_water_curve(subzero2, screw):
    P = subzero2.propeller
    for n, u in ((24.0, 1.0), (30.0, 0.5), (15.0, 0.9)):
        J = (1 - P.wake_fraction) * u / (n * P.diameter)
        KT = P.thrust_constant - P.thrust_slope * J - P.thrust_curvature * J**2
        KQ = P.torque_constant - P.torque_slope * J - P.torque_curvature * J**2
        assert thrust(n, u, screw) == pytest.approx(
            (1 - P.thrust_deduction) * 1000 * n**2 * P.diameter**4 * KT
        )
        assert torque(n, u, screw) == pytest.approx(1000 * n**2 * P.diameter**5 * KQ)


def test_the_curves_stay_within_five_percent_of_the_tabled_straight_lines(subzero2):
    """hull_parameters 5.4, B2-38, P/D 1: K_T 0.366 − 0.31 J, K_Q 0.0532 − 0.043 J for J from 0 to 0.6."""
    P, J = subzero2.propeller, np.linspace(0, 0.6, 13)
    KT = P.thrust_constant - P.thrust_slope * J - P.thrust_curvature * J**2
    KQ = P.torque_constant - P.torque_slope * J - P.torque_curvature * J**2
    assert_allclose(KT, 0.366 - 0.31 * J, rtol=0.05)
    assert_allclose(KQ, 0.0532 - 0.043 * J, rtol=0.05)


def test_thrust_and_torque_are_finite_and_continuous_across_all_quadrants(screw):
    """Around a circle in the (n, u) plane, through n = 0 where J is infinite: no jump in 0.1 degree."""
    around = np.linspace(0, 2 * np.pi, 3601)
    for law in (thrust, torque):
        values = np.array([law(25 * np.cos(a), 1.5 * np.sin(a), screw) for a in around])
        assert np.all(np.isfinite(values))
        assert np.abs(np.diff(values)).max() < 0.01 * np.abs(values).max()
        assert_allclose(values[:1801], -values[1800:], atol=1e-9)  # odd: astern mirrors ahead


def test_a_windmilling_a_stopped_and_a_reversed_propeller_brake_ever_harder(screw):
    windmill, stopped, astern = (thrust(n, 1.0, screw) for n in (12.0, 0.0, -12.0))
    assert astern < stopped < 0.0
    assert windmill < 0.0
    assert torque(4.0, 1.0, screw) < 0.0  # the water drives the windmill


def test_a_resting_propeller_in_still_water_does_nothing(screw):
    out = np.full(6, np.nan)
    propeller(np.zeros(6), 0.0, screw, out)
    assert np.array_equal(np.abs(out), np.zeros(6))


def test_small_rudder_angles_have_the_tabled_force(fin):
    """hull_parameters section 6: Y_uu_dr 6.1 kg/(m rad) of the pair, N_uu_dr 2.55 kg/rad, to starboard."""
    out, angle = np.empty(6), 0.01
    rudder(np.array([1.0, 0, 0, 0, 0, 0]), angle, fin, out)
    assert out[1] / angle == pytest.approx(-6.1, rel=0.01)
    assert out[5] / angle == pytest.approx(2.55, rel=0.01)


def test_each_plane_has_half_of_it_and_rolls(fin):
    """Section 6: −3.04 kg/(m rad), 1.28 kg/rad in pitch and 0.15 in roll each."""
    for side in (-1.0, 1.0):
        out, angle = np.empty(6), 0.01
        stern_plane(np.array([1.0, 0, 0, 0, 0, 0]), angle, side, fin, out)
        assert out[2] / angle == pytest.approx(3.04, rel=0.01)
        assert out[4] / angle == pytest.approx(1.28, rel=0.01)
        assert out[3] / angle == pytest.approx(side * 0.152, rel=0.01)


def test_fins_damp_roll_as_tabled(fin):
    """K_up = −0.03 kg m2 from four fins, each seeing p times its arm."""
    nu, out, total = np.array([1.0, 0, 0, 0.01, 0, 0]), np.empty(6), 0.0
    rudder(nu, 0.0, fin, out)
    total += out[3]
    for side in (-1.0, 1.0):
        stern_plane(nu, 0.0, side, fin, out)
        total += out[3]
    assert total / 0.01 == pytest.approx(-0.03, rel=0.05)


def test_lift_rises_falls_with_stall_and_nothing_jumps(fin):
    incidence = np.radians(np.arange(0.0, 180.0, 0.1))
    forces = np.array([section_force(1.0, 0.0, a, fin) for a in incidence])
    lift, drag = forces[:, 1] / fin.half_density_area, -forces[:, 0] / fin.half_density_area
    stall = lift[:250].argmax()  # within 25 degrees; at 45 a plate lifts again
    assert 90 < stall < 180
    assert lift[200] < 0.85 * lift[stall]
    assert np.abs(np.diff(forces, axis=0)).max() < 0.01 * np.abs(forces).max()
    assert drag.min() > 0.0
    assert drag[900] == pytest.approx(fin.plate + fin.profile, rel=1e-3)  # square to the flow: a plate


def test_a_fin_works_in_reversed_flow_and_rests_in_none(fin):
    assert section_force(0.0, 0.0, 0.3, fin) == (0.0, 0.0)
    ahead, astern = section_force(1.0, 0.0, 0.1, fin), section_force(-1.0, 0.0, 0.1, fin)
    assert ahead[1] > 0.0
    assert astern[1] < 0.0  # the rudder works the other way when backing
    assert astern[0] > 0.0  # drag still opposes the motion
    tiny = section_force(1e-9, 1e-9, 0.1, fin)
    assert np.all(np.isfinite(tiny))
    assert max(np.abs(tiny)) < 1e-15


def test_each_fin_feels_its_own_flow(fin):
    """Rolling turns the upper rudder one way and the lower the other: a moment, no side force."""
    out = np.empty(6)
    rudder(np.array([1.0, 0, 0, 0.5, 0, 0]), 0.0, fin, out)
    assert abs(out[1]) < 1e-15
    assert out[3] < -1e-3
    rudder(np.array([1.0, 0, 0, 0, 0, 0.2]), 0.0, fin, out)
    assert out[1] > 0.0  # the stern swings to port; the fin resists
    assert out[5] < 0.0
    inner, outer = np.empty(6), np.empty(6)
    stern_plane(np.array([1.0, 0, 0, 0, 0, 1.0]), 0.1, 1.0, fin, inner)
    stern_plane(np.array([1.0, 0, 0, 0, 0, 1.0]), 0.1, -1.0, fin, outer)
    assert outer[2] > 1.1 * inner[2]  # the outer plane of a turn is faster
