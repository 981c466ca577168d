"""Waves and vessel motion: dispersion, spectrum, kinematics, response operators, records, messages.

Verifies: ω² = g k tanh kh, its deep and shallow limits; ∫S = H_s²/16, and that components have that variance and the
spectrum's second moment; kinematics by differences of the surface, no flow through the bed, no divergence; that a
vessel with heave 1 follows the surface, the signs of lever arms in words, a lag in time, and the frequency at which a
vessel under way meets waves; that velocities are derivatives of places. Tolerance: rounding, or said.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
from cable.properties import GRAVITY
from cable.waves import jonswap, wave_number
from subzero.errors import UserError

HEAVE, ROLL, PITCH, YAW = 2, 3, 4, 5
WAVE = cable.Waves.regular(2.0, 7.0, direction=0.7, depth=30.0)


def responding(column, size=1.0, lag=0.0):
    """Return the response in one degree of freedom, the same at all frequencies."""
    amplitude, phase = np.zeros((2, 6)), np.zeros((2, 6))
    amplitude[:, column], phase[:, column] = size, lag
    return cable.VesselResponse(frequency=[0.1, 10.0], amplitude=amplitude, phase=phase)


@pytest.mark.parametrize("depth", [0.3, 5.0, 60.0, 4000.0])
def test_wave_numbers_solve_the_dispersion_relation(depth):
    omega = np.geomspace(0.05, 8.0, 40)
    k = wave_number(omega, depth)
    assert_allclose(GRAVITY * k * np.tanh(k * depth), omega**2, rtol=1e-12)
    assert_allclose(wave_number(omega, np.inf), omega**2 / GRAVITY)
    assert_allclose(wave_number(1e-3, 1.0), 1e-3 / np.sqrt(GRAVITY), rtol=1e-6)  # shallow: c = √(gh)


@pytest.mark.parametrize("gamma", [1.0, 3.3])
def test_a_sea_has_the_variance_and_the_period_of_its_spectrum(gamma):
    height, period = 3.0, 9.0
    peak = 2.0 * np.pi / period
    omega = np.linspace(0.2 * peak, 40.0 * peak, 200_001)
    S = jonswap(omega, height, period, gamma)
    assert np.trapezoid(S, omega) == pytest.approx(height**2 / 16.0)
    if gamma == 1.0:
        assert_allclose(
            S,
            5.0 / 16.0 * height**2 * peak**4 / omega**5 * np.exp(-1.25 * (peak / omega) ** 4),
            rtol=1e-5,
            atol=1e-300,
        )
    assert omega[S.argmax()] == pytest.approx(peak, rel=1e-3)
    waves = cable.Waves.jonswap(height, period, seed=4, gamma=gamma, components=100)
    m = [0.5 * (waves.amplitude**2 * waves.frequency**n).sum() for n in (0, 2)]
    assert m[0] == pytest.approx(height**2 / 16.0)
    assert m[1] == pytest.approx(np.trapezoid(S * omega**2, omega), rel=0.05)  # the cut-off tail
    surface = [waves.elevation(0.0, 0.0, t) for t in np.arange(0.0, 6000.0, 0.5)]
    assert np.var(surface) == pytest.approx(m[0], rel=0.05)
    assert waves.elevation(3.0, 1.0, 7.0) == cable.Waves.jonswap(
        height, period, seed=4, gamma=gamma, components=100
    ).elevation(3.0, 1.0, 7.0)


def test_water_moves_with_the_surface_and_along_the_bed_and_keeps_its_volume():
    at, step = (3.0, 5.0, 4.0), 1e-4
    rise = (WAVE.elevation(1.0, 2.0, 3.0 + step) - WAVE.elevation(1.0, 2.0, 3.0 - step)) / (2.0 * step)
    assert WAVE.velocity(1.0, 2.0, 0.0, 3.0)[2] == pytest.approx(-rise, rel=1e-6)
    assert WAVE.velocity(1.0, 2.0, 30.0, 3.0)[2] == pytest.approx(0.0, abs=1e-12)
    sides = [
        np.subtract(WAVE.velocity(*(at + e), 2.0), WAVE.velocity(*(at - e), 2.0))[i]
        for i, e in enumerate(step * np.eye(3))
    ]
    assert abs(sum(sides)) < 1e-6 * np.abs(sides).max()
    deep = cable.Waves.regular(2.0, 7.0)
    assert np.hypot(*np.array(deep.velocity(0.0, 0.0, 10.0, 0.3))[[0, 2]]) == pytest.approx(
        2 * np.pi / 7 * np.exp(-10 * (2 * np.pi / 7) ** 2 / GRAVITY)
    )


def test_a_vessel_with_heave_1_follows_the_surface_where_it_is():
    motion = responding(HEAVE).motion(WAVE, place=(4.0, 2.0, 0.0), velocity=(1.0, 0.0, 0.0))
    for t in (0.0, 1.3, 9.0):
        assert_allclose(motion.place(t), [4.0 + t, 2.0, -WAVE.elevation(4.0 + t, 2.0, t)], atol=1e-12)


@pytest.mark.parametrize(
    ("column", "hang_off", "moves"),
    [
        (PITCH, (10.0, 0.0, 0.0), (0.0, 0.0, -1.0)),  # bow up lifts what hangs ahead
        (ROLL, (0.0, 10.0, 0.0), (0.0, 0.0, 1.0)),  # starboard down lowers what hangs there
        (YAW, (10.0, 0.0, 0.0), (0.0, 1.0, 0.0)),  # bow to starboard takes what hangs ahead there
        (PITCH, (0.0, 0.0, -10.0), (-1.0, 0.0, 0.0)),  # bow up takes the top of a mast astern
        (ROLL, (0.0, 0.0, -10.0), (0.0, 1.0, 0.0)),  # starboard down takes it to starboard
    ],
)
def test_a_lever_arm_moves_the_hang_off_as_words_say(column, hang_off, moves):
    """At a crest, 1 m high, of an operator of 0.01 rad/m without lag; heading north, and then east."""
    wave = cable.Waves.regular(2.0, 8.0)
    for heading, turned in ((0.0, moves), (np.pi / 2, (-moves[1], moves[0], moves[2]))):
        place = (
            responding(column, 0.01).motion(wave, hang_off=hang_off, heading=heading, place=np.zeros(3)).place
        )
        back = np.array([-hang_off[0] * np.cos(heading) + hang_off[1] * np.sin(heading)])
        crest = (
            float(wave_number(wave.frequency, np.inf)[0] * back[0] / wave.frequency[0]) % 8.0
        )  # it passes the reference
        assert_allclose(place(crest), 0.1 * np.array(turned), atol=1e-9)


def test_a_lag_delays_the_answer_and_velocities_are_derivatives():
    wave = cable.Waves.regular(2.0, 8.0)
    prompt, late = (responding(HEAVE, 1.0, lag).motion(wave) for lag in (0.0, np.pi / 2))
    assert_allclose(late.place(5.0), prompt.place(3.0), atol=1e-12)
    sea = cable.Waves.jonswap(2.0, 8.0, seed=2, depth=20.0)
    motion = responding(PITCH, 0.02, 0.3).motion(
        sea, hang_off=(9.0, 2.0, 1.0), heading=0.4, velocity=(2.0, 1.0, 0.0), ramp=10.0
    )
    for t in (2.0, 9.9, 30.0):
        assert_allclose(motion(t), (motion.place(t + 1e-4) - motion.place(t - 1e-4)) / 2e-4, atol=1e-6)
    assert_allclose(motion.state(0.0), [[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]])


def test_a_recorded_motion_is_a_smooth_one(tmp_path):
    t = np.linspace(0.0, 10.0, 101)
    place = np.column_stack([t, np.sin(t), 0.1 * t**2])
    velocity = np.column_stack([np.ones(101), np.cos(t), 0.2 * t])
    (tmp_path / "log.csv").write_text(
        "t,north,east,down\n" + "\n".join(",".join(map(str, row)) for row in np.c_[t, place])
    )
    for motion in (cable.Motion.read(tmp_path / "log.csv"), cable.Motion.of_record(t, place, velocity)):
        assert_allclose(motion.place(3.33), [3.33, np.sin(3.33), 0.1 * 3.33**2], atol=1e-6)
        assert_allclose(motion(3.33), [1.0, np.cos(3.33), 0.666], atol=1e-5)


@pytest.mark.long
def test_a_towed_line_goes_as_its_vessel_does():
    wave = cable.Waves.regular(1.0, 6.0)
    motion = responding(HEAVE).motion(wave, velocity=(1.0, 0.0, 0.0), ramp=6.0)
    run = cable.tow(motion, 5.0, 12.0)
    assert_allclose(run.tow_point[-1] - run.tow_point[0], motion.place(12.0), atol=1e-6)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: cable.Waves.regular(1.0, 0.0), "period is 0"),
        (lambda: cable.Waves.jonswap(1.0, 8.0, seed=1, gamma=12.0), "gamma is 12"),
        (lambda: cable.Waves.regular(1.0, 5.0, depth=-2.0), "depth is -2"),
        (
            lambda: cable.VesselResponse(
                frequency=[1.0, 0.5], amplitude=np.zeros((2, 6)), phase=np.zeros((2, 6))
            ),
            "frequencies that increase",
        ),
        (
            lambda: cable.VesselResponse(frequency=[1.0], amplitude=np.zeros((1, 3)), phase=np.zeros((1, 6))),
            r"must be \(1, 6\)",
        ),
        (lambda: responding(HEAVE).motion(WAVE, hang_off=(1.0, 2.0)), "three numbers each"),
        (lambda: cable.Motion.of_record([0.0, 1.0, 1.0, 2.0], np.zeros((4, 3))), "4 times that increase"),
        (
            lambda: cable.Motion.of_record(np.arange(4.0), np.zeros((4, 3)))(9.0),
            "covers 0 to 3 s, and 9 s was asked for",
        ),
        (lambda: cable.Motion.read("no_such.csv"), "no_such.csv is no table of numbers"),
    ],
)
def test_what_makes_no_sense_is_refused(call, words):
    with pytest.raises(UserError, match=words):
        call()
