"""The cable's effect from measured vehicle states: section 3 of the paper, steps 1 and 2.

Verifies: a run that follows another run's own record gives the same forces (12) and moments (13); a smooth motion
against a circle that is known; a start from all states; a start in steady motion. Tolerance: 0.5 % of the largest force
and moment is what is asked; 1e-4 is held where the record has the places (ten digits of them, divided by a step of
0.1 s and squared in the drag, are 1e-6), for a cubic is exact at its samples.
"""

from __future__ import annotations

import csv
import dataclasses
from math import cos, degrees, radians, sin

import numpy as np
import pytest
from numpy.testing import assert_allclose

import scenarios
import subzero
from subzero import autopilot
from subzero.channels import RENAMED_CHANNELS
from subzero.results.netcdf_csv import write_csv

FORCES = [f"cable_force_{axis}" for axis in ("forward", "starboard", "down")]
MOMENTS = [f"cable_moment_{axis}" for axis in ("roll", "pitch", "yaw")]
COUPLED = [name for name in scenarios.names() if scenarios.load(name).motion is None]
RATES = {"roll_rate_deg_s", "pitch_rate_deg_s", "yaw_rate_deg_s"}
PLACES = {"north_m", "east_m", "depth_m"}


def differences(one, other):
    """Return the largest difference of the forces and of the moments, as shares of the largest of each."""
    shares = []
    for names in (FORCES, MOMENTS):
        a, b = (np.stack([run[name].values for name in names]) for run in (one, other))
        shares.append(np.abs(a - b).max() / np.abs(a).max())
    return shares


@pytest.fixture
def replay(simulate, tmp_path):
    """Return a trial's run, and the one that follows its record: of every so many rows, without some columns."""

    def call(name, *, every=1, without=(), only=None, **changes):
        trial = dataclasses.replace(subzero.load_scenario(name), **changes)
        run, path = simulate(trial), tmp_path / "tethered.csv"
        write_csv(run.isel(time=slice(None, None, every)), path)
        with open(path, encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        keep = [
            i
            for i, column in enumerate(rows[0])
            if column not in without and (only is None or column in only)
        ]
        with open(path, "w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([row[i] for i in keep] for row in rows)
        again = subzero.load_scenario(name, motion_csv=path)
        return run, simulate(dataclasses.replace(again, **changes))

    return call


def test_fig6_replayed_from_its_own_record_pulls_alike(replay):
    run, again = replay("fig6")
    assert max(differences(run, again)) < 1e-4
    for name in (
        "north",
        "east",
        "depth",
        "roll_angle",
        "pitch",
        "heading",
        "surge_speed",
        "sway_speed",
        "heave_speed",
    ):
        assert_allclose(again[name], run[name], atol=1e-7, err_msg=name)
    for name in ("roll_rate", "pitch_rate", "yaw_rate"):
        assert_allclose(again[name], run[name], atol=1e-6, err_msg=name)
    assert again.attrs["motion"].startswith("smooth, from surge_speed, pitch, heading, sway_speed")
    assert abs(float(again["energy_residual"][-1])) < 1e-4 * float(again["energy_propeller_work"][-1])


def test_speed_pitch_and_heading_alone_miss_the_lateral_pull(replay):
    """The reason for the other six states: sway carries the tow point sideways in a turn."""
    run, again = replay("fig6", only={"time_s", "surge_speed_m_s", "pitch_deg", "heading_deg"})
    assert differences(run, again)[1] > 0.1


@pytest.mark.parametrize("without", [PLACES, RATES, PLACES | RATES], ids=["no places", "no rates", "neither"])
def test_what_a_record_lacks_follows_from_what_it_has(replay, without):
    assert max(differences(*replay("fig6", without=without))) < 5e-3


def test_a_record_at_10_hz_is_enough_for_a_run_in_finer_steps(replay):
    run, again = replay("fig6", every=5, cable_step=0.02)
    assert max(differences(run, again)) < 5e-3
    run, again = replay("fig6", every=5, without=PLACES | RATES, cable_step=0.02)
    assert max(differences(run, again)) < 5e-3


def test_a_replay_that_starts_with_cable_in_the_water_pulls_alike(replay):
    start = dataclasses.replace(
        subzero.load_scenario("fig6").start, wet_length=10.0, surge_speed=0.8, sway_speed=0.1, yaw_rate=0.1
    )
    run, again = replay("fig6", start=start)
    assert max(differences(run, again)) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", COUPLED)
def test_every_coupled_scenario_replayed_from_its_own_record_pulls_alike(replay, name):
    assert max(differences(*replay(name))) < 1e-4


TURN = radians(12.0)
"""Rate of the circle, to starboard at 1 m/s. [rad/s]"""


def circle(step, *, with_places):
    """Return a level circle as a record, a sample every `step` seconds: x = (u/r) sin rt, y = (u/r)(1 − cos rt)."""
    time = np.linspace(0.0, 30.0, round(30.0 / step) + 1)
    one, turn, radius = np.ones(time.size), TURN, 1.0 / TURN
    places = {
        "north": radius * np.sin(turn * time),
        "east": radius * (1.0 - np.cos(turn * time)),
        "depth": 3.0 * one,
    }
    return scenarios.Motion(
        time=time,
        surge_speed=one,
        pitch=0.0 * one,
        heading=turn * time,
        sway_speed=0.0 * one,
        heave_speed=0.0 * one,
        **(places if with_places else {}),
    )


@pytest.mark.parametrize("with_places", [True, False], ids=["with places", "without"])
def test_a_smooth_motion_goes_around_the_circle_that_was_measured(simulate, with_places):
    """A cubic errs by h⁴/384 of the fourth derivative, u r³: 5e-5 m every second; its integral at the ends likewise."""
    trial = dataclasses.replace(subzero.load_scenario("fig5"), motion=circle(1.0, with_places=with_places))
    run, turn = simulate(trial, tethered=False), TURN
    time = run["time"].values
    assert_allclose(run["north"], np.sin(turn * time) / turn, atol=5e-3)
    assert_allclose(run["east"], (1.0 - np.cos(turn * time)) / turn, atol=5e-3)
    assert_allclose(run["surge_speed"], 1.0, atol=2e-3)
    assert_allclose(run["sway_speed"], 0.0, atol=5e-3)
    assert_allclose(run["yaw_rate"], 12.0, rtol=1e-9)
    assert_allclose(run["depth"], 3.0 if with_places else 1.0, atol=1e-12)


def test_a_banked_turn_has_the_rates_and_the_way_of_its_angles_and_speeds(simulate):
    """Heeled and nose down, turning at ψ': p = −ψ' sin θ, q = ψ' cos θ sin φ, r = ψ' cos θ cos φ; R V turns with ψ."""
    time, roll, pitch = np.linspace(0.0, 30.0, 61), 0.3, -0.2
    one, body = np.ones(time.size), np.array([1.0, 0.2, -0.1])
    names = ("surge_speed", "sway_speed", "heave_speed")
    motion = scenarios.Motion(
        time=time, pitch=pitch * one, roll=roll * one, heading=TURN * time,
        **{name: value * one for name, value in zip(names, body, strict=True)},
    )  # fmt: skip
    trial = dataclasses.replace(subzero.load_scenario("fig5"), motion=motion)
    run = simulate(trial, tethered=False).isel(time=slice(None, None, 5))  # at the samples
    bank = np.array([[1.0, 0.0, 0.0], [0.0, cos(roll), -sin(roll)], [0.0, sin(roll), cos(roll)]])
    dive = np.array([[cos(pitch), 0.0, sin(pitch)], [0.0, 1.0, 0.0], [-sin(pitch), 0.0, cos(pitch)]])
    ahead, aside, down = dive @ bank @ body
    s, c = np.sin(TURN * time) / TURN, (1.0 - np.cos(TURN * time)) / TURN
    assert_allclose(run["north"], ahead * s - aside * c, atol=2e-3)
    assert_allclose(run["east"], ahead * c + aside * s, atol=2e-3)
    assert_allclose(run["depth"], 1.0 + down * time, atol=1e-9)
    for name, value in zip(names, body, strict=True):
        assert_allclose(run[name], value, rtol=1e-9, err_msg=name)
    rates = (-sin(pitch), cos(pitch) * sin(roll), cos(pitch) * cos(roll))
    for name, value in zip(("roll_rate", "pitch_rate", "yaw_rate"), rates, strict=True):
        assert_allclose(run[name], 12.0 * value, rtol=1e-9, err_msg=name)


def test_the_samples_of_a_smooth_motion_do_not_jolt_the_cable(simulate):
    """Sampled twice and four times as finely, the pull is the same: a jolt at every sample would come as often."""
    trial = subzero.load_scenario("fig5")
    runs = [
        simulate(dataclasses.replace(trial, motion=circle(step, with_places=True)))
        for step in (1.0, 0.5, 0.25)
    ]
    for finer in runs[1:]:
        assert max(differences(runs[0], finer)) < 2e-3


def test_places_that_contradict_the_speeds_are_refused():
    motion = circle(0.5, with_places=True)
    for wrong in (
        {"north": -motion.north},
        {"east": 3.28 * motion.east},
        {"depth": np.resize([3.0, 4.0], 61)},
    ):
        trial = dataclasses.replace(
            subzero.load_scenario("fig5"), motion=dataclasses.replace(motion, **wrong)
        )
        (name,) = wrong
        with pytest.raises(subzero.UserError, match=f"its {name} moves otherwise than speeds and angles say"):
            subzero.simulate(trial)


def test_a_run_starts_in_every_state_that_its_start_names(simulate, trial_of):
    start = {
        "heading": 0.5, "pitch": -0.1, "roll": 0.05, "depth": 4.0, "surge_speed": 0.9, "sway_speed": -0.1,
        "heave_speed": 0.05, "roll_rate": 0.2, "pitch_rate": -0.1, "yaw_rate": 0.3, "propeller_speed": 22.0,
        "rudder_angle": 0.1, "stern_plane_port_angle": 0.02, "stern_plane_starboard_angle": -0.03,
    }  # fmt: skip
    first = simulate(trial_of(start=start, duration=0.2)).isel(time=0)
    for name, value in start.items():
        channel = first[RENAMED_CHANNELS.get(name, name)]
        in_degrees = channel.attrs["units"].startswith("degree")
        assert float(channel) == pytest.approx(degrees(value) if in_degrees else value, abs=1e-9), name


def test_a_fin_cannot_start_where_its_servo_does_not_reach(trial_of):
    with pytest.raises(
        subzero.UserError, match=r"rudder_angle at 28.65 degrees; its servo reaches 20 degrees"
    ):
        subzero.simulate(trial_of(start={"rudder_angle": 0.5}))


def test_a_cable_at_the_start_lies_behind_the_tow_point_on_its_way(simulate, trial_of):
    """So it pulls against the velocity of the tow point, v + Ω × r_c, half a metre behind the centre."""
    start = {"surge_speed": 1.0, "sway_speed": 0.2, "yaw_rate": -0.2, "wet_length": 20.0}
    first = simulate(trial_of(start=start, duration=0.2)).isel(time=0)
    forward, starboard = float(first["cable_force_forward"]), float(first["cable_force_starboard"])
    assert forward < 0.0
    assert starboard / forward == pytest.approx(0.2 + 0.2 * 0.5, rel=1e-9)


def steady_commands(model, **asked):
    return scenarios.Commands(time=np.zeros(1), values=autopilot.trim(model, **asked).command[None])


def test_a_start_in_trim_goes_on_as_it_began(simulate, trial_of):
    """Without a cable for ever; the vehicle floats up, so it is the pitch and the planes that hold its depth."""
    trial = trial_of(start={"at_trim": True, "surge_speed": 1.0}, duration=10.0)
    light = subzero.Model.of(trial)
    light = dataclasses.replace(light, vehicle=light.vehicle.with_parameter("buoyancy.net_buoyancy", 0.5))
    trial = dataclasses.replace(trial, commands=steady_commands(light, speed=1.0))
    run = simulate(trial, tethered=False, model=light)
    assert_allclose(run["surge_speed"], 1.0, atol=1e-6)
    assert_allclose(run["depth"], 1.0, atol=1e-5)
    assert_allclose(run["heading"], 27.0, atol=1e-4)
    assert float(run["stern_plane_port_angle"][0]) < -1.0, "pushes the nose down"
    assert float(run["propeller_speed"][0]) > 20.0


def test_a_start_in_trim_with_wet_cable_slows_down_only_as_that_grows(simulate, trial_of):
    """½ρπdC_t U³ t more of drag after t, on mass and added mass: 0.0393 N/s, 6.73 kg, −0.0029 m/s after a second."""
    trial = trial_of(start={"at_trim": True, "surge_speed": 1.0, "wet_length": 10.0}, duration=1.0)
    commands = steady_commands(subzero.Model.of(trial), speed=1.0, wet_length=10.0)
    run = simulate(dataclasses.replace(trial, commands=commands))
    lost = 1.0 - float(run["surge_speed"][-1])
    assert 0.0 < lost < 0.5 * 0.0393 / 6.73
    assert_allclose(run["propeller_speed"], commands.values[0, 0], rtol=1e-9)


def test_the_commands_of_a_start_in_trim_stay_those_of_the_trial(simulate, trial_of):
    run = simulate(trial_of(start={"at_trim": True, "surge_speed": 1.0}, duration=3.0))
    assert float(run["propeller_command"][0]) == 25.0
    assert float(run["propeller_speed"][-1]) == pytest.approx(25.0, abs=1e-3)


def test_a_start_in_trim_has_its_speed_over_ground_whatever_the_water_does(simulate, trial_of):
    trial = trial_of(
        start={"at_trim": True, "surge_speed": 1.0, "heading": 0.5}, current=(0.2, 0.1, 0.0), duration=5.0
    )
    along, across = 0.2 * cos(0.5) + 0.1 * sin(0.5), 0.1 * cos(0.5) - 0.2 * sin(0.5)
    model = subzero.Model.of(trial)
    trial = dataclasses.replace(trial, commands=steady_commands(model, speed=1.0 - along))
    run = simulate(trial, tethered=False)
    assert_allclose(run["surge_speed"], 1.0, atol=1e-6)
    assert_allclose(run["sway_speed"], across, atol=1e-6)


@pytest.mark.long
def test_the_papers_scheme_starts_in_the_same_steady_motion(simulate, trial_of):
    start = {"at_trim": True, "surge_speed": 1.0, "wet_length": 10.0}
    ours, printed = (
        simulate(trial_of(start=start, duration=0.5, scheme=scheme, cable_step=0.1)).isel(time=0)
        for scheme in ("moving_end", "paper_tangent")
    )
    assert float(printed["propeller_speed"]) == float(ours["propeller_speed"]) > 25.0


def test_a_speed_that_cannot_be_held_is_told_with_what_is_in_its_way(trial_of):
    with pytest.raises(
        autopilot.NoTrimError, match=r"'fig6' cannot start in trim at 5 m/s .* propeller would need"
    ):
        subzero.simulate(trial_of(start={"at_trim": True, "surge_speed": 5.0}))
