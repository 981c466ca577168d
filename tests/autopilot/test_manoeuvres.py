"""Manoeuvres and the numbers that are read off them.

Verifies: every index on a made-up run whose index is known in closed form; every manoeuvre on the vehicle, with signs
and mirror symmetry. Tolerance: 1 % for indices read off 0.1 s samples of a closed form; 1e-6 for a mirrored manoeuvre
of a mirrored vehicle (one without reaction torque).
"""

import dataclasses

import numpy as np
import pytest

import subzero
from scenarios import Start
from scenarios.files import shipped
from scenarios.parameters import with_vehicle
from subzero import autopilot
from subzero.autopilot import indices
from subzero.autopilot.manoeuvres import MANOEUVRES, RUN_IN

TIME = np.arange(0.0, 100.0, 0.1)


def test_the_crossing_is_interpolated_and_waits_for_its_start():
    assert indices.crossing_time(TIME, 2.0 * TIME, 7.77) == pytest.approx(3.885)
    assert indices.crossing_time(TIME, np.cos(TIME), 0.0, start=2.0) == pytest.approx(1.5 * np.pi, abs=1e-3)
    assert np.isnan(indices.crossing_time(TIME, np.zeros(TIME.size), 1.0))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("psi0", [0.0, 1.1])
def test_a_circle_has_its_own_radius(side, psi0):
    """Straight at 1 m/s for 20 s, then a circle of 5 m: advance R, transfer R, tactical and final diameter 2 R."""
    R, start = 5.0, 20.0
    turned = side * np.maximum(TIME - start, 0.0) / R
    along = np.minimum(TIME, start) + R * np.sin(np.abs(turned))
    across = side * R * (1.0 - np.cos(turned))
    north = along * np.cos(psi0) - across * np.sin(psi0)
    east = along * np.sin(psi0) + across * np.cos(psi0)
    found = indices.turning_circle(TIME, north, east, psi0 + turned, start)
    assert found["advance_m"] == pytest.approx(R, rel=0.01)
    assert found["transfer_m"] == pytest.approx(R, rel=0.01)
    assert found["tactical_diameter_m"] == pytest.approx(2 * R, rel=0.01)
    assert found["final_diameter_m"] == pytest.approx(2 * R, rel=0.01)
    assert found["final_turn_rate_deg_s"] == pytest.approx(side * np.degrees(1 / R), rel=0.01)
    assert found["speed_loss"] == pytest.approx(0.0, abs=0.01)


def test_a_swing_beyond_the_limit_is_the_overshoot():
    """The angle swings by ±0.3 rad in 4π s, and the fin is reversed at ±0.2 rad: overshoots of 0.1 rad."""
    angle = 0.3 * np.sin(0.5 * np.maximum(TIME - 1.0, 0.0))
    command, side = np.zeros(TIME.size), 1.0
    for k in np.flatnonzero(TIME >= 1.0 - 1e-9):
        if side * angle[k] >= 0.2:
            side = -side
        command[k] = side
    found = indices.zigzag(TIME, angle, command, 0.2, 1.0)
    assert found["overshoot_1_deg"] == pytest.approx(np.degrees(0.1), rel=0.01)
    assert found["overshoot_2_deg"] == pytest.approx(np.degrees(0.1), rel=0.01)
    assert found["initial_turning_time_s"] == pytest.approx(np.arcsin(2 / 3) / 0.5, abs=0.1)
    assert found["period_s"] == pytest.approx(4 * np.pi, abs=0.15)


def test_a_first_order_step_has_its_rise_and_settling_time():
    """1 − e^(−t/T): rise T ln 9, settled within 5 % after T ln 20, no overshoot."""
    T = 2.0
    values = 3.0 + 4.0 * np.where(TIME > 10.0, 1.0 - np.exp(-(TIME - 10.0) / T), 0.0)
    found = indices.step_response(TIME, values, 7.0, 10.0)
    assert found["rise_time_s"] == pytest.approx(T * np.log(9.0), rel=0.01)
    assert found["settling_time_s"] == pytest.approx(T * np.log(20.0), abs=0.1)
    assert found["overshoot"] == 0.0
    assert found["steady_error"] == pytest.approx(0.0, abs=1e-9)


def test_a_second_order_step_has_its_overshoot():
    """e^(−πζ/√(1−ζ²))."""
    z, w = 0.3, 1.0
    wd = w * np.sqrt(1 - z * z)
    values = 1.0 - np.exp(-z * w * TIME) * (np.cos(wd * TIME) + z / np.sqrt(1 - z * z) * np.sin(wd * TIME))
    found = indices.step_response(TIME, values, 1.0, 0.0)
    assert found["overshoot"] == pytest.approx(np.exp(-np.pi * z / np.sqrt(1 - z * z)), rel=0.01)


def test_a_spiral_of_a_linear_hull_has_its_slope_and_no_loop():
    shares = np.array([1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0, 0.5, 1.0])
    rudder = np.radians(4.0) * shares[np.minimum((TIME / 10.0).astype(int), 8)]
    found = indices.spiral(TIME, 1.7 * rudder + 0.01, rudder, 10.0, 0.0)
    assert found["slope_per_s"] == pytest.approx(1.7)
    assert found["loop_height_deg_s"] == pytest.approx(0.0, abs=1e-9)
    assert found["residual_deg_s"] == pytest.approx(np.degrees(0.01))


def test_a_constant_deceleration_stops_after_half_the_way():
    """With u = U − a t it stops after U/a, in U²/2a."""
    U, a = 2.0, 0.25
    t = np.maximum(TIME - 5.0, 0.0)
    u = U - a * t
    way = np.where(TIME < 5.0, U * TIME, U * 5.0 + U * t - 0.5 * a * t * t)
    found = indices.crash_stop(TIME, way * np.cos(0.4), way * np.sin(0.4), u, np.full(TIME.size, 0.4), 5.0)
    assert found["stopping_time_s"] == pytest.approx(U / a, rel=0.01)
    assert found["head_reach_m"] == pytest.approx(U * U / (2 * a), rel=0.01)
    assert found["track_reach_m"] == pytest.approx(U * U / (2 * a), rel=0.01)
    assert found["side_reach_m"] == pytest.approx(0.0, abs=1e-9)


def assert_measured(name, tethered):
    run, found = autopilot.manoeuvre(name, tethered=tethered)
    assert run.attrs["outcome"] == "completed"
    assert all(np.isfinite(value) for value in found.values()), found


@pytest.mark.parametrize("name", MANOEUVRES)
def test_every_manoeuvre_runs_to_its_end_and_has_its_indices(name):
    assert_measured(name, tethered=False)


def test_a_zigzag_on_the_cable_has_its_indices():
    assert_measured("zigzag", tethered=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", MANOEUVRES)
def test_every_manoeuvre_on_the_cable_has_its_indices(name):
    assert_measured(name, tethered=True)


@pytest.fixture(scope="module")
def tuning():
    return autopilot.tune(subzero.Model.of(subzero.load_scenario("fig6")))


@pytest.fixture(scope="module")
def mirrored():
    model = subzero.Model.of(subzero.load_scenario("fig6"))
    hull = model.vehicle.with_parameter("propeller.reaction_torque_factor", 0.0)
    return dataclasses.replace(model, vehicle=hull)


def test_a_turn_to_port_mirrors_the_turn_to_starboard(mirrored):
    starboard, port = (
        autopilot.manoeuvre("turning_circle", size=size, model=mirrored, tethered=False)[1]
        for size in (10.0, -10.0)
    )
    assert port.pop("final_turn_rate_deg_s") == pytest.approx(
        -starboard.pop("final_turn_rate_deg_s"), rel=1e-6
    )
    assert port == pytest.approx(starboard, rel=1e-6)


def test_the_straight_run_is_straight_at_its_speed(mirrored):
    run, _ = autopilot.manoeuvre("zigzag", speed=0.8, tethered=False, model=mirrored)
    before = run.isel(time=run["time"].values < RUN_IN)
    assert float(before["surge_speed"][-1]) == pytest.approx(0.8, abs=0.01)
    assert np.ptp(before["heading"].values) < 1e-6


def test_the_spiral_of_the_bare_hull_is_that_of_its_linear_model(mirrored):
    """The slope at small rudders is the steady yaw rate per rudder: a stable hull, no loop."""
    _, found = autopilot.manoeuvre("spiral", tethered=False, model=mirrored, size=0.5)
    rudder_per_yaw = float(autopilot.tune(mirrored, speeds=(1.0,)).rudder_per_yaw.at(1.0))
    assert found["slope_per_s"] == pytest.approx(1.0 / rudder_per_yaw, rel=0.2), (
        "5 degrees are not small: cross-flow"
    )
    assert found["loop_height_deg_s"] == pytest.approx(0.0, abs=0.05)


@pytest.mark.long
@pytest.mark.parametrize("name", autopilot.STEPS)
def test_a_step_settles_without_a_cable_and_with_one_that_is_fed_forward(name, tuning):
    for tethered, feed_forward in ((False, "none"), (True, "formula")):
        pilot = autopilot.Pilot(feed_forward=feed_forward, tuning=tuning)
        _, found = autopilot.step(name, pilot=pilot, tethered=tethered)
        assert found["settling_time_s"] < 30.0
        line = autopilot.STEPS[name]
        assert abs(found[f"steady_error{line.ending}"]) < 0.01 * abs(line.size)
        assert found["overshoot"] < 0.5


@pytest.mark.parametrize(
    "call,words",
    [
        (lambda: autopilot.manoeuvre("zig-zag"), "Did you mean 'zigzag'"),
        (lambda: autopilot.manoeuvre("zigzag", size=40.0), "up to 20 degrees, not 0"),
        (lambda: autopilot.manoeuvre("zigzag", size=0.0), "not 0"),
        (lambda: autopilot.manoeuvre("turning_circle", speed=9.0), "propeller would need"),
        (lambda: autopilot.step("heading"), "Did you mean 'heading_step'"),
        (lambda: autopilot.step("heading_step", size=0.0), "not 0"),
    ],
)
def test_what_cannot_be_done_is_told(call, words):
    with pytest.raises(subzero.UserError, match=words):
        call()


WITHOUT_A_PROPELLER = ("open_frame", "seawing")
LONG = ("nps_auv2",)
"""Hulls of several metres, for which the manoeuvres are too short to have all indices."""
SLOW = ("bluerov2_heavy",)
VEHICLES = [
    pytest.param(name, marks=pytest.mark.long) if name in SLOW else name
    for name in [*shipped("vehicles"), "auv.toml"]
]


@pytest.mark.parametrize("name", list(MANOEUVRES))
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_every_vehicle_flies_what_its_actuators_allow_and_says_why_not(tmp_path, name, vehicle):
    """REMUS 100 needs 1.58 m/s to be held level; a torpedo from four numbers flies at 1 m/s as Subzero does."""
    if vehicle == "auv.toml":
        known = "length_m = 2.0\ndiameter_m = 0.2\nmass_kg = 45\nspeed_m_s = 1.8"
        vehicle = tmp_path / "auv.toml"
        vehicle.write_text(f'base = "torpedo"\n[known]\n{known}\n')
    trial = subzero.load_scenario("fig6")
    trial = dataclasses.replace(with_vehicle(trial, vehicle)[0], start=Start(depth=20.0))
    if vehicle in WITHOUT_A_PROPELLER:
        with pytest.raises(subzero.UserError, match=f"{name} needs a propeller.* and this vehicle has none"):
            autopilot.manoeuvre(name, trial)
        return
    run, measured = autopilot.manoeuvre(name, trial, tethered=False)
    assert run.attrs["outcome"] == "completed"
    assert vehicle in LONG or all(np.isfinite(value) for value in measured.values())
    assert "contradictory_numbers" not in run.attrs["warnings"]
    if name == "zigzag":
        assert {"forces"} < subzero.figures.draw(run).keys()


@pytest.mark.long
def test_thrusters_turn_to_either_side_alike_and_those_that_do_not_pitch_say_so():
    """The overshoots of a zigzag by moments: a rudder to starboard turns the heading to starboard."""
    trial = with_vehicle(subzero.load_scenario("fig6"), "bluerov2_heavy")[0]
    run, measured = autopilot.manoeuvre("turning_circle", trial, tethered=False, size=5.0)
    other, mirrored = autopilot.manoeuvre("turning_circle", trial, tethered=False, size=-5.0)
    assert measured["final_turn_rate_deg_s"] > 20.0
    assert mirrored["final_turn_rate_deg_s"] == pytest.approx(-measured["final_turn_rate_deg_s"], rel=1e-6)
    np.testing.assert_allclose(other["surge_speed"].values, run["surge_speed"].values, atol=1e-9)
    hull = subzero.Model.of(trial).vehicle
    level = tuple(row for row in hull.thrusters if not row[0].startswith("vertical"))
    up = dataclasses.replace(dict(hull.thrusters)["vertical_front_port"], x=0.0, y=0.0)
    model = dataclasses.replace(
        subzero.Model.of(trial), vehicle=dataclasses.replace(hull, thrusters=(*level, ("up", up)))
    )
    with pytest.raises(subzero.UserError, match="needs thrusters that pitch the vehicle, and its own do not"):
        autopilot.manoeuvre("vertical_zigzag", trial, model=model)
    assert autopilot.manoeuvre("zigzag", trial, model=model, tethered=False)[1]["period_s"] > 0.0
