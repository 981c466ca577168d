"""Cases (ii) and (iii) of section 4.1: the dive of Fig. 5 and its mirror image, the turn.

Verifies: the signs that the paper describes in words, the tow tension and length that two independent codes give,
and that a turn is a dive seen from the side. Configuration: u = 1 m/s, pitch 0 to 10 s, then −6 °/s to −60°; Table 1,
0.5 m, 0.1 s. Tolerance: the last printed digit of the prototype (cable_equations 6: S 28.239 m, T 0.977 N at 30 s).
"""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
import subzero


@cache
def run(name):
    result = subzero.simulate(name)
    assert result.attrs["outcome"] == "completed", result.attrs["outcome_message"]
    return result


def channel(name, of):
    return run(of)[name].values


def tow_point_of_the_dive(t):
    """Velocity of the tow point, half a metre behind the centre: V + Ω × r_c, north, east, down. [m/s]"""
    rate = np.radians(-6.0) if 10.0 <= t < 20.0 else 0.0
    pitch = np.radians(-6.0) * np.clip(t - 10.0, 0.0, 10.0)
    lever = 0.5 * rate  # nose down lifts the tail
    return np.cos(pitch) + lever * np.sin(pitch), 0.0, -np.sin(pitch) + lever * np.cos(pitch)


def test_the_vehicle_dives_and_the_cable_gets_longer():
    assert (np.diff(channel("depth", "fig5"))[101:] > 0.0).all()
    assert (np.diff(channel("cable_length", "fig5")) > 0.0).all()


def test_tension_at_the_tow_point_rises_and_is_zero_at_the_drum():
    tension = channel("cable_tension", "fig5")
    assert tension[200] > tension[100] > tension[50]
    assert tension[300] > 0.95 * tension.max()
    assert np.abs(channel("drum_tension", "fig5")).max() < 1e-9


def test_length_and_tension_after_half_a_minute_are_those_of_the_independent_prototype():
    assert channel("cable_length", "fig5")[-1] == pytest.approx(28.239, abs=2e-3)
    assert channel("cable_tension", "fig5")[-1] == pytest.approx(0.977, abs=1e-3)


def test_the_cable_holds_the_vehicle_back_more_than_it_does_anything_else():
    """F_cX < 0 throughout and dominant: larger than F_cZ at every time, several times the moment per half length."""
    forward, down = channel("cable_force_forward", "fig5"), channel("cable_force_down", "fig5")
    assert (forward[1:] < 0.0).all()
    assert (np.abs(forward[1:]) > np.abs(down[1:])).all()


def test_the_cable_pushes_the_tail_down_while_diving_so_the_nose_up():
    """F_cZ > 0 (in the direction of heave) and M_cY > 0 (nose up) from the beginning of the dive on."""
    down, pitch_moment = channel("cable_force_down", "fig5"), channel("cable_moment_pitch", "fig5")
    assert np.abs(down[:100]).max() < 1e-12  # straight ahead: nothing
    assert (down[105:] > 0.0).all()
    assert (pitch_moment[105:] > 0.0).all()
    assert_allclose(pitch_moment, 0.5 * down, rtol=1e-12, atol=1e-15)  # (13): the lever is half a metre


def test_a_dive_in_a_vertical_plane_has_no_sideways_force_nor_roll_nor_yaw_moment():
    for name in ("cable_force_starboard", "cable_moment_roll", "cable_moment_yaw"):
        assert np.abs(channel(name, "fig5")).max() < 1e-12


def test_the_tow_point_moves_along_the_cable_towards_growing_length_as_in_panel_d():
    """V_t = −1 m/s straight ahead and on the straight dive; V_n shows the turn; V_b is zero."""
    tangential = channel("tow_velocity_tangential", "fig5")
    assert_allclose(tangential[1:100], -1.0, atol=1e-9)
    assert (tangential[1:] < -0.85).all()
    assert np.abs(channel("tow_velocity_binormal", "fig5")).max() < 1e-9
    assert np.abs(channel("tow_velocity_normal", "fig5")[150]) > 0.01


def test_the_turn_is_the_dive_seen_from_the_side():
    """Exchange down and east: side force for heave force, minus the yaw moment for the pitch moment, east for depth."""
    pairs = {
        "cable_length": ("cable_length", 1.0),
        "cable_tension": ("cable_tension", 1.0),
        "north": ("north", 1.0),
        "cable_force_forward": ("cable_force_forward", 1.0),
        "cable_force_starboard": ("cable_force_down", 1.0),
        "cable_force_down": ("cable_force_starboard", 1.0),
        "cable_moment_yaw": ("cable_moment_pitch", -1.0),
        "cable_moment_pitch": ("cable_moment_yaw", -1.0),
        "heading": ("pitch", -1.0),
    }
    for turning, (diving, sign) in pairs.items():
        assert_allclose(channel(turning, "fig5_turn"), sign * channel(diving, "fig5"), rtol=0, atol=1e-9)
    assert_allclose(channel("east", "fig5_turn"), channel("depth", "fig5") - 1.0, rtol=0, atol=1e-9)


def test_turning_to_starboard_the_cable_pulls_the_tail_to_starboard_so_the_nose_to_port():
    assert (channel("cable_force_starboard", "fig5_turn")[105:] > 0.0).all()
    assert (channel("cable_moment_yaw", "fig5_turn")[105:] < 0.0).all()


def test_the_force_in_body_axes_is_the_force_in_earth_axes_turned_by_pitch():
    """Equation (12), by hand from `cable.pull_out` with the same motion: 1e-9 N for rounding and quadrature."""
    history = cable.pull_out(tow_point_of_the_dive, 30.0, scheme=cable.MovingEnd(run_in=2.0))
    pitch = np.radians(channel("pitch", "fig5"))
    north, down = history.tow_force[:, 0], history.tow_force[:, 2]
    forward = north * np.cos(pitch) - down * np.sin(pitch)
    heave = north * np.sin(pitch) + down * np.cos(pitch)
    assert_allclose(channel("cable_force_forward", "fig5")[1:], forward[1:], rtol=0, atol=1e-9)
    assert_allclose(channel("cable_force_down", "fig5")[1:], heave[1:], rtol=0, atol=1e-9)
    assert_allclose(channel("cable_length", "fig5"), history.length, rtol=0, atol=1e-9)


def test_the_cable_cuts_the_corner_that_the_vehicle_went_round():
    """At the same distance north it lies as deep as the tow point went or deeper, by metres; it rises to the drum."""
    history = cable.pull_out(tow_point_of_the_dive, 30.0)
    line = run("fig5")["cable_position"].isel(time=-1).dropna("node").values
    below = line[:, 2] - np.interp(line[:, 0], history.tow_point[:, 0], history.tow_point[:, 2])
    assert below.min() > -1e-3  # chords of 0.5 m on the straight part
    assert 1.0 < below.max() < 4.0
    assert (np.diff(line[:, 2]) < 1e-12).all()
    assert_allclose(line[[0, -1]], [history.tow_point[-1], np.zeros(3)], rtol=0, atol=1e-9)
