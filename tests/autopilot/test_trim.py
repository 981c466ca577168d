"""A trim is a motion that the simulation itself keeps, and what cannot be trimmed is told with the limit in its way.

Verifies: steady motions of `autopilot.trim` against runs of the nonlinear hull and of the coupled simulation; the
pull of the cable against (37). Tolerance: 1e-6 of the motion over 20 s for the hull (the trim leaves 1e-9 of
acceleration, and the motion is stable); 1e-6 for cable model against formula on a straight way, whose discrete solution
is exact.
"""

import dataclasses
import itertools

import numpy as np
import pytest

import subzero
import vehicle
from subzero import autopilot
from subzero.steady_motion.hull_state_space import from_vehicle, to_vehicle


@pytest.fixture(scope="module")
def model():
    return subzero.Model.of(subzero.load_scenario("fig6"))


def changed(model, **numbers):
    hull = model.vehicle
    for key, value in numbers.items():
        hull = hull.with_parameter(key.replace("__", "."), value)
    return dataclasses.replace(model, vehicle=hull)


MOTIONS = [
    {"speed": 1.0},
    {"speed": 0.5, "depth_rate": 0.05},
    {"speed": 1.2, "turn_rate": 0.2},
    {"speed": 1.0, "depth_rate": -0.3, "turn_rate": -0.1},
    {"speed": 1.0, "roll": 0.05},
]


@pytest.mark.parametrize("asked", MOTIONS, ids=str)
def test_the_hull_stays_in_a_steady_motion(model, asked):
    steady = autopilot.trim(model, **asked)
    run = vehicle.free_run(model.vehicle, to_vehicle(steady.state), steady.command, 20.0)
    end = from_vehicle(run.states[-1], heading_near=20.0 * steady.turn_rate)
    assert end[6:12] == pytest.approx(steady.state[6:12], abs=1e-6)
    assert end[3:5] == pytest.approx(steady.state[3:5], abs=1e-6)
    assert end[2] == pytest.approx(20.0 * steady.depth_rate, abs=2e-5)
    assert end[5] == pytest.approx(20.0 * steady.turn_rate, abs=2e-5)
    assert steady.state[6] == asked["speed"]


def test_a_constant_pull_is_held_like_the_one_of_the_trim(model):
    steady = autopilot.trim(model, speed=1.0, turn_rate=0.1, wet_length=20.0)
    start = to_vehicle(steady.state)
    run = vehicle.free_run(model.vehicle, start, steady.command, 10.0, wrench_b=steady.wrench)
    assert run.states[-1, 7:13] == pytest.approx(start[7:13], abs=1e-6)


def test_the_pull_is_that_of_equation_37_with_the_drums_friction(model):
    drum = dataclasses.replace(model.drum, friction_torque=0.02)
    steady = autopilot.trim(dataclasses.replace(model, drum=drum), speed=0.8, wet_length=25.0)
    expected = -(0.5 * 1000.0 * np.pi * 0.0025 * 0.01 * 0.8**2 * 25.0 + 0.02 / 0.1)
    assert steady.wrench == pytest.approx([expected, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-9)


def test_formula_and_cable_model_agree_on_a_straight_way(model):
    asked = {"speed": 1.0, "depth_rate": 0.2, "wet_length": 10.0}
    formula, pulled = autopilot.trim(model, **asked), autopilot.trim(model, **asked, cable="model")
    assert pulled.wrench == pytest.approx(formula.wrench, abs=1e-6)
    assert pulled.state == pytest.approx(formula.state, abs=1e-5)


def test_a_cable_in_a_turn_pulls_the_stern_inwards_and_cuts_the_corner(model):
    """Turning to starboard the cable lies to starboard of the track; the real one more so than the formula's."""
    asked = {"speed": 1.0, "turn_rate": 0.15, "wet_length": 10.0}
    formula, pulled = autopilot.trim(model, **asked), autopilot.trim(model, **asked, cable="model")
    assert formula.wrench[1] > 0.0 > formula.wrench[5]
    inward = [one.wrench[1] / -one.wrench[0] for one in (formula, pulled)]
    assert inward[1] > inward[0]


def test_the_coupled_run_starts_in_the_steady_motion(model):
    """The pull grows with the length that is paid out: 0.2 m more on 20 m changes the speed by less than 1e-3."""
    steady = autopilot.trim(model, speed=1.0, wet_length=20.0)
    trial = subzero.load_scenario("fig6")
    start = dataclasses.replace(trial.start, surge_speed=1.0, wet_length=20.0)
    commands = dataclasses.replace(trial.commands, time=np.zeros(1), values=steady.command[None])
    run = subzero.simulate(dataclasses.replace(trial, start=start, commands=commands, duration=3.0))
    free = changed(model, motor__lag=0.0)
    at_once = subzero.simulate(
        dataclasses.replace(trial, start=start, commands=commands, duration=0.2), model=free
    )
    assert float(at_once["surge_speed"][-1]) == pytest.approx(1.0, abs=1e-3)
    assert float(run["surge_speed"][-1]) < 1.0


@pytest.mark.parametrize("feedback,lost", [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (0.0, 0.3), (0.5, 0.3)])
def test_commands_undo_offset_dead_band_loss_and_sag(model, feedback, lost):
    crooked = changed(
        model,
        rudder_servo__lost_command=lost,
        stern_plane_port_servo__lost_command=lost,
        rudder_servo__position_feedback=feedback,
        stern_plane_port_servo__position_feedback=feedback,
        rudder_servo__offset=0.02,
        stern_plane_port_servo__dead_band=0.01,
        motor__voltage_sensitivity=1.0,
    )
    plain, steady = (autopilot.trim(one, speed=1.0, turn_rate=0.1) for one in (model, crooked))
    assert steady.state == pytest.approx(plain.state, abs=1e-9)
    start = to_vehicle(steady.state)
    start[13:17] = 0.0
    run = vehicle.free_run(crooked.vehicle, start, steady.command, 40.0)
    assert run.states[-1, 7:13] == pytest.approx(start[7:13], abs=1e-3), "the battery runs down a little"


def test_a_turn_with_a_jammed_rudder_is_refused(model):
    jammed = changed(model, rudder_servo__lost_command=1.0)
    with pytest.raises(autopilot.NoTrimError, match="jammed rudder"):
        autopilot.trim(jammed, speed=1.0, turn_rate=0.1)


@pytest.mark.parametrize(
    "asked,reported",
    [
        ({"speed": 3.0}, "propeller would need"),
        ({"speed": 1.0, "turn_rate": 0.5}, "rudder would need"),
        ({"speed": 1.0, "depth_rate": 1.5}, "pitch angle would pass 80 degrees"),
        ({"speed": 0.1, "depth_rate": 0.05}, "they stall"),
        ({"speed": 1.0, "wet_length": 5000.0}, "propeller would need"),
    ],
)
def test_what_cannot_be_trimmed_is_told_with_its_limit(model, asked, reported):
    with pytest.raises(autopilot.NoTrimError, match=reported):
        autopilot.trim(model, **asked)


@pytest.mark.parametrize(
    "asked,reported",
    [
        ({"speed": 0.0}, "above 0"),
        ({"speed": float("nan")}, "finite"),
        ({"speed": 1.0, "wet_length": -1.0}, "0 or more"),
        ({"speed": 1.0, "cable": "magic"}, "formula, model"),
    ],
)
def test_numbers_that_mean_nothing_are_refused(model, asked, reported):
    with pytest.raises(subzero.UserError, match=reported):
        autopilot.trim(model, **asked)


def test_the_limit_is_where_the_message_says(model):
    """Just inside the rudder's limit there is a trim, just outside there is none."""
    inside = {rate: autopilot.trim(model, speed=1.0, turn_rate=rate) for rate in (0.1, 0.2, 0.3)}
    angles = [trim.state[13] for trim in inside.values()]
    assert all(a < b < model.vehicle.rudder_servo.deflection_limit for a, b in itertools.pairwise(angles))
    servo = dataclasses.replace(model.vehicle.rudder_servo, deflection_limit=0.5 * (angles[1] + angles[2]))
    tight = dataclasses.replace(model, vehicle=dataclasses.replace(model.vehicle, rudder_servo=servo))
    autopilot.trim(tight, speed=1.0, turn_rate=0.2)
    with pytest.raises(autopilot.NoTrimError):
        autopilot.trim(tight, speed=1.0, turn_rate=0.3)
