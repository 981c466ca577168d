"""Winch, vessel and sheared water in a coupled run: each does what its words say.

Verifies: the way from a `Trial` to the cable's drum and water, with signs. Configuration: a vehicle at rest or at a
steady speed, a neutral cable (Table 1) or one that sinks. Tolerance: lengths and ways are exact integrals, 1e-9 m;
tensions of a steady straight pull to 1e-4, of a cable at rest as said.
"""

import dataclasses
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import scenarios
import subzero

DRAG = 0.5 * 1000.0 * np.pi * 0.0025 * 0.01
"""½ρπdC_t of Table 1. [N s²/m³]"""
HEAVY = {"mass_per_length": 0.02, "cross_section_area": 4.9e-6, "diameter": 0.0025}


@pytest.fixture(scope="module")
def trial_of():
    """Return a trial with a steady prescribed motion, a wet length laid straight behind, and what is around it."""
    base = subzero.load_scenario("fig4")

    def call(*, speed=0.0, pitch=0.0, wet=20.0, depth=1.0, duration=20.0, cable=None, **fields):
        one = np.zeros(1)
        motion = scenarios.Motion(time=one, surge_speed=one + speed, pitch=one + pitch, heading=one)
        start = scenarios.Start(pitch=pitch, depth=depth, surge_speed=speed, wet_length=wet)
        return dataclasses.replace(
            base, motion=motion, start=start, duration=duration, cable=base.cable | (cable or {}), **fields
        )

    return call


@pytest.fixture(scope="module")
def simulate():
    def call(trial):
        run = subzero.simulate(trial)
        assert run.attrs["outcome"] == "completed", run.attrs["outcome_message"]
        return run

    return call


def winch(control, *points):
    time, values = zip(*points, strict=True) if points else ((), ())
    return scenarios.Winch(control=control, time=time, setpoint=values)


def vessel(*points):
    time, velocity = zip(*points, strict=True)
    return scenarios.Vessel(time=time, velocity=velocity)


def test_a_winch_that_pays_out_makes_the_cable_longer_by_its_rate(trial_of, simulate):
    """1.05 m/s for 10 s, then slower and slower until it stands at 10.55 s; the vehicle is slower all the time."""
    rate = winch("pay_out_rate", (0.0, 1.05), (10.0, 1.05), (10.55, 0.0))
    run = simulate(trial_of(speed=0.5, wet=5.0, winch=rate))
    time, S = run["time"].values, run["cable_length"].values
    assert_allclose(S[time <= 10.0], 5.0 + 1.05 * time[time <= 10.0], atol=1e-9)
    assert_allclose(S[time >= 10.6], 15.5 + 0.5 * 1.05 * 0.55, atol=1e-9)


def test_a_winch_that_reels_in_makes_the_cable_shorter_by_its_rate(trial_of, simulate):
    """The vehicle is drawn back a little more slowly, so the cable, which stretches, stays taut: 2 cm in 10 m."""
    elastic, time = {"compliance": 1e-3}, np.linspace(0.0, 20.0, 201)
    run = simulate(trial_of(speed=-0.499, cable=elastic, winch=winch("pay_out_rate", (0.0, -0.5))))
    assert_allclose(run["cable_length"].values, 20.0 - 0.5 * time, atol=1e-9)
    assert run["cable_tension"].values[-1] == pytest.approx(0.02 / 10.0 / 1e-3, rel=0.05)  # and some drag


def test_a_winch_carries_from_the_first_row_on_what_hangs_below_it(trial_of, simulate):
    """20 m of cable of w_c = 0.148 N/m straight below the drum, the vehicle on its end carries nothing."""
    elastic = HEAVY | {"compliance": 1e-6}
    run = simulate(trial_of(pitch=-np.radians(89.0), cable=elastic, winch=winch("brake"), duration=0.2))
    weight = (0.02 - 1000.0 * 4.9e-6) * 9.81 * 20.0 * np.sin(np.radians(89.0))
    assert run["drum_tension"].values[0] == pytest.approx(weight, rel=1e-12)
    assert run["cable_tension"].values[0] == 0.0


def test_a_brake_keeps_the_length(trial_of, simulate):
    run = simulate(trial_of(winch=winch("brake"), vessel=vessel((0.0, (0.3, 0.0, 0.0)))))
    assert_allclose(run["cable_length"].values, 20.0, atol=1e-9)


def test_a_vessel_that_moves_away_pulls_the_cable_off_a_free_drum(trial_of, simulate):
    """The vehicle rests, the vessel goes south at 0.5 m/s, away from it: the cable is laid and does not move.

    So it has no drag: the drum's friction, C_f/R_d = 0.01 N, is all that pulls at the vehicle, backwards.
    """
    drum = {"radius": 0.1, "inertia": 0.0, "friction_torque": 1e-3}
    run = simulate(trial_of(drum=drum, vessel=vessel((0.0, (-0.5, 0.0, 0.0)))))
    assert_allclose(run["cable_length"].values, 20.0 + 0.5 * run["time"].values, atol=1e-6)
    assert_allclose(run["cable_force_forward"].values[1:], -0.01, rtol=1e-4)


def test_a_vessel_that_moves_away_on_the_brake_pulls_at_its_vehicle(trial_of, simulate):
    """A stretching cable, whose far end goes south: its pull on the vehicle points south, that is, backward."""
    elastic = {"compliance": 1e-3}
    run = simulate(
        trial_of(
            winch=winch("brake"), cable=elastic, vessel=vessel((0.0, (0.0,) * 3), (20.0, (-0.1, 0.0, 0.0)))
        )
    )
    pulled = 0.5 * 0.1 / 20.0 * 20.0**2  # 1 m
    assert run["cable_force_forward"].values[-1] == pytest.approx(-pulled / 20.0 / 1e-3, rel=1e-2)


def test_vehicle_and_vessel_side_by_side_are_a_tow_of_fixed_length(trial_of, simulate):
    """Both go north at 1 m/s: no cable comes off a free drum, and T(0) = ½ρπdC_t U² S of the cable between them."""
    run = simulate(trial_of(speed=1.0, vessel=vessel((0.0, (1.0, 0.0, 0.0)))))
    assert_allclose(run["cable_length"].values, 20.0, atol=1e-6)
    assert run["cable_tension"].values[-1] == pytest.approx(DRAG * 20.0, rel=1e-4)


def test_a_winch_that_keeps_a_tension_keeps_it(trial_of, simulate):
    keep = winch("constant_tension", (0.0, 2.0), (5.0, 2.0), (10.0, 3.0))
    run = simulate(trial_of(speed=1.0, winch=keep))
    time = run["time"].values
    asked = np.interp(time, [0.0, 5.0, 10.0], [2.0, 2.0, 3.0])
    assert_allclose(run["drum_tension"].values[1:], asked[1:], rtol=1e-6)
    expected = 3.0 + DRAG * run["cable_length"].values[-1]
    assert run["cable_tension"].values[-1] == pytest.approx(expected, rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("top, bends", [(0.0, True), (30.0, False)])
def test_water_that_moves_east_only_near_the_surface_bends_the_upper_cable_east(
    top, bends, trial_of, simulate
):
    """A cable hangs 20 m down from a drum at depth `top`; the water moves above 8 m, of the sea and not of the drum."""
    pitch = -np.radians(89.0)
    profile = scenarios.Profile(depth=(7.0, 8.0), velocity=((0.0, 0.5, 0.0), (0.0, 0.0, 0.0)))
    trial = trial_of(
        pitch=pitch, depth=top + 20.5, cable=HEAVY, profile=profile, duration=60.0,
        winch=winch("pay_out_rate", (0.0, 0.05), (10.0, 0.0)),
    )  # fmt: skip
    run = simulate(trial)
    place = run["cable_position"].values[-1][: int(run["node_count"][-1])]
    east, down = place[:, 1], place[:, 2]
    if not bends:
        assert np.abs(east).max() < 1e-3
        return
    assert east[down < 8.0].max() > 0.3
    assert down[east.argmax()] < 10.0
    straight = np.interp(down, [8.0, down[0]], [east[np.abs(down - 8.0).argmin()], 0.0])
    below = down > 10.0
    assert np.abs(east - straight)[below].max() < 0.1 * east.max()  # below it hangs straight


def test_a_winch_that_is_too_slow_is_told_in_its_own_words(trial_of):
    run = subzero.simulate(trial_of(speed=1.0, wet=5.0, winch=winch("pay_out_rate", (0.0, 1.1), (20.0, 0.0))))
    assert run.attrs["outcome"] == "stopped"
    reported = re.fullmatch(
        r"The cable is too short beyond t = 3\.6 s: the winch has paid out ([0-9.]+) m, "
        r"the vehicle is ([0-9.]+) m away\. Try control = \"constant_tension\", or a higher pay_out_rate_m_s\.",
        run.attrs["outcome_message"],
    )
    assert reported, run.attrs["outcome_message"]
    # 5 + 1.1 t − 0.0275 t² = 5 + t  at  t = 3.636 s; the last step tried ends near it
    assert [float(number) for number in reported.groups()] == pytest.approx([8.636, 8.636], abs=2e-3)


def test_the_courant_number_of_a_straight_pull_is_that_of_its_first_segment(trial_of, simulate):
    """√(T/m1) Δt/ℓ with T = ½ρπdC_t U² (S − ℓ/2) in the first segment, m1 = 9.8 g/m, Δt = 0.1 s, ℓ = 0.5 m."""
    run = simulate(trial_of(speed=1.0))
    T = DRAG * (run["cable_length"].values - 0.25)
    assert_allclose(run["courant_number"].values[1:], (np.sqrt(T / 0.0098) * 0.1 / 0.5)[1:], rtol=1e-4)
    iterations = np.diff(run["newton_iterations"].values)
    assert (iterations >= 0).all(), "a count never falls"
    assert iterations.sum() > 50, "a straight pull is nearly foreseen, but not where a node is new"
