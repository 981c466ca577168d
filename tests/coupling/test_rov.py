"""A remotely operated vehicle on its tether, coupled both ways: BlueROV2 Heavy keeps its station in a current.

Verifies: the thrust of a hover against drag by hand and the static cable of `cable.hold`, another solver (1 %, of which
half is that the run still creeps); the energy balance (0.1 % of the work: of second order in the steps); that a tether
at the stern disturbs a turn; a lost thruster; refusals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import subzero
from cable import hold
from subzero.model import Model
from vehicle import rotation

LINEAR, QUADRATIC = np.array([13.7, 0.0, 33.0]), np.array([141.0, 217.0, 190.0])
"""Damping of surge, sway and heave, von Benzon et al. 2022, table A1. [kg/s, kg/m]"""


def at_end(run, name: str) -> float:
    return float(run[name].values[-1])


def earth_axes(run) -> np.ndarray:
    """R_nb at the end of a run, from its angles."""
    roll, pitch, heading = (np.radians(at_end(run, name)) for name in ("roll_angle", "pitch", "heading"))
    from vehicle import quaternion_from_euler

    R = np.empty((3, 3))
    rotation(quaternion_from_euler(roll, pitch, heading), R)
    return R


def test_a_hover_takes_the_drag_of_the_hull_and_the_pull_of_the_static_cable():
    trial = replace(
        subzero.load_scenario("rov_hover"), current=(-0.5, 0.0, 0.0), profile=None, duration=240.0
    )
    run, model = subzero.simulate(trial), Model.of(trial)
    assert at_end(run, "speed_over_ground") < 2e-3
    R = earth_axes(run)
    thrust = R @ run["force_breakdown"].sel(term="propeller").values[-1, :3]
    flow = R.T @ np.array([0.5, 0.0, 0.0])
    drag = R @ (LINEAR * flow + QUADRATIC * np.abs(flow) * flow)
    place = np.array([at_end(run, name) for name in ("north", "east", "depth")])
    tow = place + R @ model.vehicle.tow_point.position()
    start = np.array([0.0, 0.0, 40.0]) + model.vehicle.tow_point.position()
    drum = start + np.array(trial.start.drum)
    still = hold(np.array([tow, drum]), 60.0, model.water(), cable=model.cable, segment_length=0.5)
    wanted = drag - still.tow_force - np.array([0.0, 0.0, -model.vehicle.buoyancy.net_buoyancy])
    assert thrust[0] == pytest.approx(wanted[0], rel=0.01)
    assert thrust[2] == pytest.approx(wanted[2], abs=0.01 * thrust[0])
    assert -still.tow_force[0] > 0.2 * drag[0]  # the tether counts


@pytest.mark.parametrize("name", ["rov_hover", "rov_turn", "rov_launch"])
def test_the_energy_of_thrusters_hull_and_tether_closes_and_nothing_is_doubted(name):
    run = subzero.simulate(name)
    assert run.attrs["outcome"] == "completed"
    assert run.attrs["warnings"] == "[]"
    work = at_end(run, "energy_propeller_work")
    assert abs(run["energy_residual"].values).max() < 1e-3 * work
    assert work > 100.0


def test_a_tether_at_the_stern_disturbs_a_turn_which_ends_where_it_was_asked_for():
    """360 degrees over port, begun at 85 s: both end at -180 degrees; on the way the tether takes its toll."""
    runs = {tethered: subzero.simulate("rov_turn", tethered=tethered) for tethered in (True, False)}
    off = {}
    for tethered, run in runs.items():
        assert at_end(run, "heading") == pytest.approx(-180.0, abs=0.5)
        assert np.hypot(at_end(run, "north"), at_end(run, "east")) < 0.1
        time = run["time"].values
        wanted = np.interp(time, [0.0, 40.0, 55.0, 85.0, 115.0], [0.0, 0.0, 180.0, 180.0, -180.0])
        off[tethered] = np.sqrt(np.mean((run["heading"].values - wanted)[time > 40.0] ** 2))
    assert off[True] > 1.5 * off[False]
    work = [at_end(runs[tethered], "energy_propeller_work") for tethered in (True, False)]
    assert work[0] > 1.1 * work[1]


def test_a_station_is_kept_on_seven_thrusters_and_the_others_take_over():
    trial = subzero.load_scenario("rov_hover")
    lost = trial.with_changes({"vehicle.thrusters.front_port.lost_command": 1.0})
    run = subzero.simulate(replace(lost, duration=200.0))
    dead = run["thruster_command"].sel(thruster="front_port").values
    assert not dead.any()
    assert np.hypot(at_end(run, "north"), at_end(run, "east")) < 0.1
    assert abs(at_end(run, "heading")) < 1.0
    whole = subzero.simulate(trial)["thruster_command"].values[-1]
    assert abs(run["thruster_command"].values[-1]).max() > 1.2 * abs(whole).max()


def test_the_same_to_the_last_bit_step_by_step():
    """A simulator that is stepped keeps the station that the trial asks for."""
    trial = replace(subzero.load_scenario("rov_turn"), duration=5.0, rtol=0.0)
    whole, stepped = subzero.simulate(trial), subzero.Simulator(trial)
    while stepped.time < 5.0 - 1e-9:
        stepped.step()
    for name in ("north", "depth", "heading", "cable_tension"):
        np.testing.assert_array_equal(whole[name].values, stepped.result()[name].values)


def test_a_vehicle_without_thrusters_keeps_no_station(tmp_path):
    text = subzero.load_scenario("rov_hover").text.replace('"bluerov2_heavy"', '"subzero2"')
    (tmp_path / "trial.toml").write_text(text)
    with pytest.raises(subzero.UserError, match="but it has no thrusters"):
        subzero.simulate(tmp_path / "trial.toml")


def test_a_station_stands_in_place_of_commands(tmp_path):
    text = subzero.load_scenario("rov_hover").text + "\n[commands]\ntime_s = [0.0]\n"
    (tmp_path / "trial.toml").write_text(text)
    with pytest.raises(subzero.UserError, match=r"Keep one of \[station\], \[commands\] and \[motion\]"):
        subzero.load_scenario(tmp_path / "trial.toml")


def test_every_figure_of_a_vehicle_on_station_is_drawn():
    run = subzero.simulate(replace(subzero.load_scenario("rov_turn"), duration=3.0))
    figures = subzero.figures.draw(run)
    assert {"station", "cable", "forces", "deployment"} <= figures.keys()
    assert "fig6" not in figures
    legend = figures["station"].axes[5].get_legend()
    assert [text.get_text() for text in legend.get_texts()][1] == "front port"
