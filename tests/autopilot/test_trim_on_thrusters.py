"""Steady motion and linear models of a vehicle on thrusters, BlueROV2 Heavy.

Verifies: thrust against drag by hand at steady surge (closed form); that a run from the trim stays there; the linear
model against differences of nonlinear runs; a hover in a current on 60 m of tether against drag by hand, the static
cable, and the end of the coupled run; refusals with the limit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
import vehicle
from cable import hold
from subzero import autopilot
from subzero.steady_motion.hull_state_space import from_vehicle, to_vehicle

LINEAR, QUADRATIC = np.array([13.7, 0.0, 33.0]), np.array([141.0, 217.0, 190.0])
"""Damping of surge, sway and heave, von Benzon et al. 2022, table A1. [kg/s, kg/m]"""
HOVER = subzero.load_scenario("rov_hover")
ROV = subzero.Model.of(HOVER)
CHANNELS = len(ROV.vehicle.channels)


def wrench_of(steady) -> np.ndarray:
    """The wrench of the thrusters at rest, by hand: T = T_max c^e, c the share behind the dead band. [N, N m]"""
    total = np.zeros(6)
    for each, s in zip(ROV.vehicle.thruster_list, steady.command[4:], strict=True):
        c = max(0.0, abs(s) - each.dead_band) / (1.0 - each.dead_band)
        most = each.thrust_ahead if s > 0 else -each.thrust_astern
        total += each.wrench * most * c**each.curve_exponent
    return total


@pytest.mark.parametrize("speed", [0.2, 0.5, 0.7])
def test_at_steady_surge_the_thrust_is_the_drag(speed):
    steady = autopilot.trim(ROV, speed=speed)
    drag = LINEAR[0] * speed + QUADRATIC[0] * speed**2
    buoyancy = ROV.vehicle.buoyancy.net_buoyancy
    inflow = sum(each.loss_per_inflow for each in ROV.vehicle.thruster_list)
    assert inflow == 0.0  # else the thrust at rest is more than the drag
    assert_allclose(wrench_of(steady)[:3], [drag, 0.0, buoyancy], atol=1e-7)


@pytest.mark.parametrize("asked", [
    {"speed": 0.0}, {"speed": 0.6}, {"speed": -0.3, "sway_speed": 0.2, "depth_rate": 0.1, "turn_rate": 0.2},
    {"speed": 0.3, "turn_rate": -0.4}, {"speed": 0.2, "roll": 0.05},
])  # fmt: skip
def test_a_run_from_the_trim_stays_there(asked):
    steady = autopilot.trim(ROV, **asked)
    run = vehicle.free_run(ROV.vehicle, to_vehicle(steady.state), steady.command, 5.0)
    end = from_vehicle(run.states[-1], heading_near=5.0 * steady.turn_rate, channels=CHANNELS)
    assert_allclose(end[3:5], steady.state[3:5], atol=1e-6)
    assert_allclose(end[6:], steady.state[6:], atol=1e-6)
    assert end[2] == pytest.approx(5.0 * asked.get("depth_rate", 0.0), abs=1e-5)


def test_inflow_is_made_up_for():
    """Thrusters that lose 5 kg/s of thrust per speed of the inflow need more command, and the speed is held."""
    rows = tuple((name, replace(each, loss_per_inflow=5.0)) for name, each in ROV.vehicle.thrusters)
    model = replace(ROV, vehicle=replace(ROV.vehicle, thrusters=rows))
    steady, before = (autopilot.trim(each, speed=0.5) for each in (model, ROV))
    assert steady.command[4] > 1.05 * before.command[4]
    run = vehicle.free_run(model.vehicle, to_vehicle(steady.state), steady.command, 5.0)
    assert run.states[-1, 7] == pytest.approx(0.5, abs=1e-6)


def test_a_dead_thruster_is_left_out_and_a_weak_one_is_commanded_more():
    weak = replace(ROV, vehicle=ROV.vehicle.with_parameter("thrusters.front_port.lost_command", 0.4))
    dead = replace(ROV, vehicle=ROV.vehicle.with_parameter("thrusters.front_port.lost_command", 1.0))
    whole, less, none = (autopilot.trim(each, speed=0.3).command for each in (ROV, weak, dead))
    assert less[5] == pytest.approx(whole[5] / 0.6, rel=1e-9)
    assert none[5] == 0.0
    steady = autopilot.trim(dead, speed=0.3)
    run = vehicle.free_run(dead.vehicle, to_vehicle(steady.state), steady.command, 5.0)
    assert run.states[-1, 7] == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("name", [f"{each.name}_command" for each in ROV.vehicle.channels])
def test_the_linear_model_is_the_difference_of_two_runs(name):
    """Steps of ±0.0002 for a second; drag that grows with the square of a speed is left, a tenth of a per cent."""
    steady, push, duration = autopilot.trim(ROV, speed=0.4), 2e-4, 1.0
    linear = autopilot.linearise(ROV, steady)
    at = list(linear.input_labels).index(name)
    ends = []
    for sign in (1.0, -1.0):
        command = steady.command.copy()
        command[at] += sign * push
        run = vehicle.free_run(ROV.vehicle, to_vehicle(steady.state), command, duration, 0.005)
        ends.append(from_vehicle(run.states[-1], channels=CHANNELS)[2:])
    measured = 0.5 * (ends[0] - ends[1])
    A, b = np.asarray(linear.A), np.asarray(linear.B)[:, at] * push
    held = np.zeros((A.shape[0] + 1, A.shape[0] + 1))
    held[:-1, :-1], held[:-1, -1] = A, b
    from scipy.linalg import expm

    predicted = expm(duration * held)[:-1, -1]
    moved = np.abs(predicted).max()
    assert moved > 5 * push  # the thruster has reached its command
    assert_allclose(measured, predicted, atol=5e-3 * moved)
    assert {"front_port_state", "surge_speed"} <= set(linear.state_labels)


def test_a_hover_in_a_current_holds_the_drag_and_the_tether():
    trial = replace(HOVER, current=(-0.5, 0.0, 0.0), profile=None)
    steady, model = autopilot.station_trim(trial), subzero.Model.of(trial)
    arm, place = model.vehicle.tow_point.position(), np.array([0.0, 0.0, 40.0])
    drum = place + arm + np.array(trial.start.drum)
    still = hold(np.array([place + arm, drum]), 60.0, model.water(), cable=model.cable, segment_length=0.5)
    drag = LINEAR * [0.5, 0.0, 0.0] + QUADRATIC * [0.25, 0.0, 0.0]
    wanted = drag - still.tow_force + [0.0, 0.0, model.vehicle.buoyancy.net_buoyancy]
    assert_allclose(wrench_of(steady)[:3], wanted, atol=0.01 * drag[0])
    assert -still.tow_force[0] > 0.2 * drag[0]  # the tether counts


def test_the_coupled_run_ends_at_its_trim_on_station():
    run = subzero.simulate(replace(HOVER, duration=240.0))
    steady = autopilot.station_trim(HOVER)
    thrust = run["force_breakdown"].sel(term="propeller").values[-1]
    pitch = np.radians(float(run["pitch"].values[-1]))  # held level by no integral: the moments leave some
    ahead, down = (
        thrust[0] * np.cos(pitch) + thrust[2] * np.sin(pitch),
        thrust[2] * np.cos(pitch) - thrust[0] * np.sin(pitch),
    )
    assert_allclose([ahead, down], wrench_of(steady)[[0, 2]], atol=0.02 * abs(thrust[0]))
    assert np.abs(steady.command[4:]).max() > 0.2
    bare = autopilot.station_trim(HOVER, tethered=False)
    assert np.abs(bare.command[4:8]).max() < 0.9 * np.abs(steady.command[4:8]).max()


def test_what_cannot_be_held_is_refused_with_the_limit():
    with pytest.raises(
        autopilot.NoTrimError, match=r"the thruster \w+ would need .* of full command, its limit is 1"
    ):
        autopilot.trim(ROV, speed=2.0)
    with pytest.raises(autopilot.NoTrimError, match=r"Straight ahead the hull holds 0\.73\d m/s at most"):
        autopilot.trim(ROV, speed=2.0)
    rows = tuple(row for row in ROV.vehicle.thrusters if "vertical" not in row[0])
    flat = replace(ROV, vehicle=replace(ROV.vehicle, thrusters=rows))
    with pytest.raises(autopilot.NoTrimError, match="its 4 working thrusters cannot push along heave"):
        autopilot.trim(flat, speed=0.3)
    with pytest.raises(subzero.UserError, match=r"'fig6' has no trim on station: it has no \[station\]"):
        autopilot.station_trim(subzero.load_scenario("fig6"))


def test_a_vehicle_that_cannot_pitch_itself_finds_its_pitch():
    """Four horizontal thrusters below the centre and one vertical: surge pitches the hull until its weight holds it."""
    rows = dict(ROV.vehicle.thrusters)
    up = replace(rows["vertical_front_port"], x=0.0, y=0.0)
    kept = tuple((name, each) for name, each in rows.items() if "vertical" not in name)
    model = replace(ROV, vehicle=replace(ROV.vehicle, thrusters=(*kept, ("up", up))))
    steady = autopilot.trim(model, speed=0.15)
    assert abs(steady.named()["pitch"]) > 0.01
    run = vehicle.free_run(model.vehicle, to_vehicle(steady.state), steady.command, 5.0)
    assert_allclose(run.states[-1, 7:13], steady.state[6:12], atol=1e-5)
