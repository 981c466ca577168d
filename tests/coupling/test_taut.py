"""A cable that comes taut against the vehicle: how hard it pulls, with what impulse, and where the energy goes.

Verifies: the peak of a mass on a spring, F = T + √(T² + k M v²) with k = EA/L, the mass M of the hull in surge with its
added mass, its speed v at the last sample before, and the pull T of its propeller on the taut cable; the impulse of a
plastic impact, M v, of a cable that does not stretch. Configuration: Subzero II at 0.85 m/s on 12 m of cable, 10 m from
a drum whose brake is on, propeller as for 0.85 m/s with the cable behind it. Tolerances: the closed form leaves out the
cable's mass, 0.06 kg of 6.7 kg (a rod that is struck adds up to √(m/M) of it, 9 %, for the instant of a wave; a cable
that straightens in water much less), and the drag between the sample and the snap: 3 %. Impulses contain the
propeller's within the window of 0.1 s samples: 12 %.
"""

import dataclasses
import json

import numpy as np
import pytest

import cable
import scenarios
import subzero
from subzero.engine.recording import Grid
from subzero.simulation.run import run_trial

SPEED, LENGTH, AWAY, PROPELLER = 0.85, 12.0, 10.0, 22.0
BRAKE = scenarios.Winch(control="brake")
REEL_IN = scenarios.Winch(control="pay_out_rate", time=(0.0,), setpoint=(-0.3,))


def surge_mass():
    """Return the mass of Subzero II with its added mass in surge. [kg]"""
    vehicle = subzero.Model.of(subzero.load_scenario("fig6")).vehicle
    return 1.0 / vehicle.own_numbers.inverse_mass[0, 0]


@pytest.fixture(scope="module")
def snapping(trial_of):
    """Return a trial in which the cable comes taut, of a stiffness EA [N], None for one that does not stretch."""

    def call(stiffness, *, heading=0.0, propeller=PROPELLER, duration=4.0, **fields):
        start = {
            "heading": heading,
            "surge_speed": SPEED,
            "propeller_speed": propeller,
            "wet_length": LENGTH,
            "drum_north": -AWAY * np.cos(heading),
            "drum_east": -AWAY * np.sin(heading),
            "depth": 5.0,
        } | fields.pop("start", {})
        properties = {"compliance": 1.0 / stiffness if stiffness else 0.0} | fields.pop("cable", {})
        held = (propeller, 0.0, 0.0, 0.0)
        return trial_of(
            cable=properties,
            start=start,
            held=held,
            duration=duration,
            **{"winch": BRAKE} | fields,
        )

    return call


@pytest.fixture(scope="module")
def snap_of(simulate):
    """Return the numbers of the snap of a trial, and its run."""

    def call(trial):
        run = simulate(trial)
        return json.loads(run.attrs["snap"]), run

    return call


def spring_peak(found, run, stiffness, thrust):
    """Return the peak of a mass on a spring, of its speed before the cable pulls with more than 1 N. [N]"""
    pulls = run["cable_tension"].values > 1.0
    peak = int(np.argmin(np.abs(run["time"].values - found["time_of_peak_s"])))
    before = float(run["surge_speed"].values[(int(pulls.argmax()) if pulls[:peak].any() else peak) - 1])
    return thrust + np.sqrt(thrust**2 + stiffness / LENGTH * surge_mass() * before**2)


@pytest.mark.parametrize("stiffness", [1e4, 1e5, 1e6])
def test_the_peak_is_that_of_a_mass_on_a_spring(snapping, snap_of, stiffness):
    found, run = snap_of(snapping(stiffness))
    # The propeller pulls the taut cable with 1.5 to 2.1 N at 22 rev/s, as a cable that does not stretch shows below.
    assert found["peak_tension_N"] == pytest.approx(spring_peak(found, run, stiffness, 1.8), rel=0.03)


def test_the_peak_hardly_changes_with_the_steps(snapping):
    peaks = []
    for parts in (1, 4, 16):
        trial = snapping(1e5, hull_step=0.02 / parts)
        run = run_trial(trial, subzero.Model.of(trial), True, grid=Grid(trial.times(), parts))
        assert run.completed
        peaks.append(run.snap["peak_tension_N"])
    # The speed errs by 1 mm/s in a part at most, of 0.85 m/s: some parts at the onset make half a per cent.
    np.testing.assert_allclose(peaks, peaks[-1], rtol=5e-3)


def test_energy_closes_through_the_snap(snapping, snap_of):
    _, run = snap_of(snapping(1e5))
    moving = 0.5 * surge_mass() * SPEED**2
    # What an exchange leaves is of second order in it; the check of a run allows 1 %.
    assert np.abs(run["energy_residual"].values).max() < 0.01 * moving


def test_a_cable_that_comes_taut_pulls_the_vehicle_back(snapping, snap_of):
    _, run = snap_of(snapping(1e5))
    assert float(run["cable_force_forward"].min()) < -20.0
    assert float(run["cable_force_forward"].max()) < 1.0
    assert float(run["surge_speed"].min()) < -0.5, "a spring without loss throws it back"


def test_a_snap_is_the_same_on_another_heading(snapping, snap_of):
    north, _ = snap_of(snapping(1e5))
    east, _ = snap_of(snapping(1e5, heading=0.5 * np.pi))
    # The start hangs in rounding errors of other axes: the parts of the exchanges differ.
    assert east["peak_tension_N"] == pytest.approx(north["peak_tension_N"], rel=5e-3)


def test_port_and_starboard_are_mirror_images(snapping, snap_of):
    aside = {"drum_east": 3.0}
    port, _ = snap_of(snapping(1e5, start=aside))
    starboard, _ = snap_of(snapping(1e5, start={"drum_east": -3.0}))
    assert port["peak_tension_N"] == pytest.approx(starboard["peak_tension_N"], rel=5e-3)


def test_a_cable_that_does_not_stretch_stops_the_vehicle(snapping, snap_of):
    found, run = snap_of(snapping(None))
    u, mass = run["surge_speed"].values, surge_mass()
    taut = int(np.argmax(run["cable_tension"].values > 1.0))
    assert set(found) == {"impulse_N_s"}, "it has an impulse, and no peak"
    assert found["impulse_N_s"] == pytest.approx(mass * u[taut - 2], rel=0.12)
    assert np.abs(u[-10:]).max() < 0.02
    lost = run["energy_cable_loss"].values
    assert lost[taut + 3] - lost[taut - 2] == pytest.approx(0.5 * mass * u[taut - 2] ** 2, rel=0.12)


def test_stiff_cables_tend_to_the_impulse_of_one_that_does_not_stretch(snapping, snap_of):
    rigid, _ = snap_of(snapping(None))
    gaps = []
    for stiffness in (1e3, 1e4, 1e5):
        # Critical damping: b = 2 √(k M), B = b L, so that hardly anything is thrown back.
        damping = 2.0 * LENGTH * np.sqrt(stiffness / LENGTH * surge_mass())
        found, _ = snap_of(snapping(stiffness, cable={"internal_damping": 1.5 * damping}))
        gaps.append(abs(found["impulse_N_s"] - rigid["impulse_N_s"]) / rigid["impulse_N_s"])
    assert gaps[-1] < 0.1
    assert gaps[-1] < gaps[0]


def test_internal_damping_lowers_the_throw_and_its_loss_is_booked(snapping, snap_of):
    stiffness = 1e4
    damping = 0.6 * LENGTH * np.sqrt(stiffness / LENGTH * surge_mass())  # 0.3 of critical
    _, free = snap_of(snapping(stiffness))
    damped, run = snap_of(snapping(stiffness, cable={"internal_damping": damping}))
    assert float(run["surge_speed"].min()) > 0.7 * float(free["surge_speed"].min()), "it is thrown back less"
    more = float(run["energy_cable_loss"].values[-1] - free["energy_cable_loss"].values[-1])
    back = 0.5 * surge_mass() * (free["surge_speed"].values.min() ** 2 - run["surge_speed"].values.min() ** 2)
    assert more > 0.5 * back > 0.0
    assert np.abs(run["energy_residual"].values).max() < 0.02 * 0.5 * surge_mass() * SPEED**2
    # With damping ratio 0.3 the peak of a spring and a dashpot falls: e^(−ζ…) makes it 0.78 of that without, and the
    # dashpot adds what it pulls with: together below.
    peak, _ = snap_of(snapping(stiffness))
    assert damped["peak_tension_N"] < peak["peak_tension_N"]


def test_the_time_above_the_strength_is_that_of_half_a_sine(snapping, snap_of):
    stiffness, share = 1e4, 0.5
    peak = snap_of(snapping(stiffness))[0]["peak_tension_N"]
    found, run = snap_of(snapping(stiffness, cable={"strength": share * peak}))
    omega = np.sqrt(stiffness / LENGTH / surge_mass())
    # A sine is above half of its peak for π − 2 asin(½) of its phase.
    assert found["time_above_strength_s"] == pytest.approx((np.pi - 2.0 * np.arcsin(share)) / omega, rel=0.05)
    assert any("snaps taut" in each["message"] for each in json.loads(run.attrs["warnings"]))


@pytest.mark.parametrize("stiffness", [1e3, 1e5, 1e7, None])
def test_a_vehicle_is_reeled_in(snapping, simulate, stiffness):
    start = {"surge_speed": 0.0, "wet_length": 40.0, "drum_north": -39.9}
    run = simulate(snapping(stiffness, propeller=0.0, start=start, winch=REEL_IN, duration=60.0))
    # The tow point has to come as near as the cable is long.
    place = (
        run["cable_position"].values[-1, 0] - run["cable_position"].values[-1, int(run["node_count"][-1]) - 1]
    )
    assert np.linalg.norm(place) < float(run["cable_length"][-1]) * (1.0 + 5.0 / (stiffness or 1e5)) + 0.01
    assert float(run["cable_length"][-1]) == pytest.approx(40.0 - 0.3 * 60.0)


def test_a_snap_leaves_no_doubt_about_the_numbers(snapping, simulate):
    run = simulate(dataclasses.replace(snapping(1e5), rtol=0.02))
    assert json.loads(run.attrs["warnings"]) == []
    (note,) = json.loads(run.attrs["notes"])
    assert note["check"] == "slack_shape", "the shape of a slack cable means nothing; its force is proved"


def test_what_cannot_snap_has_no_snap(simulate, trial_of):
    assert "snap" not in simulate(trial_of(duration=2.0)).attrs


@pytest.mark.parametrize("value", [-1.0, np.nan])
def test_internal_damping_has_to_be_a_number_that_is_not_negative(value):
    with pytest.raises(ValueError, match="internal_damping is") as caught:
        cable.CableProperties(compliance=1e-5, internal_damping=value)
    assert "\n" not in str(caught.value)


def test_what_does_not_stretch_damps_nothing():
    with pytest.raises(subzero.UserError, match="what does not stretch damps nothing"):
        cable.CableProperties(internal_damping=10.0)


def test_a_scheme_that_knows_no_internal_damping_says_so():
    elastic = cable.CableProperties(compliance=1e-5, internal_damping=10.0)
    with pytest.raises(subzero.UserError, match="does not know internal damping"):
        cable.pull_out(lambda _: (1.0, 0.0, 0.0), 1.0, cable=elastic, scheme="lumped")
