"""Commands of listed actuators by name: columns of a trial, of a CSV file, and of commands made in Python.

Verifies: columns agree with `vehicle.channels` of every shipped vehicle and of one with all kinds; a column that is
left out is zero; refusals name the nearest and all that the vehicle has.
"""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np
import pytest

import scenarios
import subzero
from scenarios.command_columns import actuator_of, command_columns, listed_columns
from scenarios.files import shipped
from scenarios.parts import nested, part_of, read_toml, shipped_path
from subzero.model import load
from subzero.results.netcdf_csv import write_csv
from vehicle import from_mapping

HEAD = """
description = "thrusters by name"
vehicle = "bluerov2_heavy"
cable = "rov_tether"
[run]
duration_s = 2.0
[start]
depth_m = 10.0
[commands]
"""
FIN = {"area": 0.004, "lift_slope": 3.0, "aspect_ratio": 2.0, "span_efficiency": 0.9, "profile_drag_coefficient": 0.01,
       "normal_force_coefficient": 1.2, "stall_angle": 0.4, "x": -0.7, "y": 0.0, "z": 0.1, "span_angle": 1.0,
       "rudder_share": 0.0, "plane_share": 0.0, "roll_share": 0.0, "lag": 0.1, "rate_limit": 1.0, "offset": 0.0,
       "deflection_limit": radians(20.0), "lost_command": 0.0}  # fmt: skip


def vehicle(name: str) -> dict:
    return nested(part_of(read_toml(shipped_path("vehicles", name), name), "vehicle")[0].values)


@pytest.fixture
def trial_of(tmp_path):
    def made(commands: str, csv: str = ""):
        (tmp_path / "trial.toml").write_text(HEAD + commands)
        (tmp_path / "log.csv").write_text(csv)
        return load(tmp_path / "trial.toml")

    return made


def with_fin(numbers: dict) -> dict:
    return numbers | {"fins": numbers.get("fins", {}) | {"upper": FIN}}


@pytest.mark.parametrize("name", shipped("vehicles"))
def test_columns_are_the_channels_of_the_vehicle_with_their_units_and_limits(name):
    numbers = with_fin(vehicle(name))
    columns, channels = listed_columns(numbers), from_mapping(numbers).channels
    assert [actuator_of(column) for column in columns] == [channel.name for channel in channels]
    for column, channel in zip(columns, channels, strict=True):
        assert {"degree": "rad"}.get(column.unit, column.unit) == channel.unit
        np.testing.assert_allclose(column.inner_limits, [channel.low, channel.high], rtol=1e-9)


def test_an_angle_is_in_degrees_and_its_limit_can_be_given():
    (fin,) = (column for column in listed_columns(with_fin(vehicle("subzero2"))))
    assert (fin.name, fin.high) == ("upper_deg", 20.0)


def test_a_vehicle_commands_what_it_has():
    needed = [column.name for column in command_columns(vehicle("subzero2")) if column.default is None]
    assert needed == [row.name for row in scenarios.quantities.COMMANDS]
    rov = [column.name for column in command_columns(vehicle("bluerov2_heavy")) if column.default is None]
    assert rov == ["time_s"]


def test_thrusters_are_commanded_by_name_and_others_stand_still(trial_of):
    trial = trial_of("time_s = [0.0, 1.0]\naft_port = [0.3, -0.2]\n")
    assert trial.commands.listed == ("aft_port",)
    np.testing.assert_array_equal(trial.commands.values, [[0.0] * 4 + [0.3], [0.0] * 4 + [-0.2]])
    run = subzero.simulate(trial, tethered=False)
    commanded = run["aft_port_command"].values
    np.testing.assert_array_equal(commanded, np.where(run["time"].values < 1.0 - 1e-9, 0.3, -0.2))
    assert run["aft_port_state"].values[9] == pytest.approx(0.3 * (1.0 - np.exp(-0.9 / 0.1)), rel=1e-3)
    assert not run["front_port_state"].values.any()
    assert run["surge_speed"].values[10] < -1e-3  # aft thrusters push astern


def test_a_file_of_commands_has_the_same_columns_and_may_be_that_of_a_run(trial_of, tmp_path):
    inline = trial_of("time_s = [0.0, 1.0]\naft_port = [0.3, -0.2]\n")
    run = subzero.simulate(inline, tethered=False)
    write_csv(run, tmp_path / "run.csv")
    header = (tmp_path / "run.csv").read_text().splitlines()[0].split(",")
    assert {"aft_port_state", "aft_port_command", "front_port_state"} <= set(header)
    again = load(tmp_path / "trial.toml", commands_csv=tmp_path / "run.csv")
    second = subzero.simulate(again, tethered=False)
    np.testing.assert_allclose(second["surge_speed"].values, run["surge_speed"].values, atol=1e-12)


@pytest.mark.parametrize(("commands", "said"), [
    ("time_s = [0.0]\naft_prt = [0.3]\n", r"aft_prt.*no such command. Did you mean 'aft_port'\? .*front_starboard"),
    ("time_s = [0.0]\naft_port = [1.3]\n", r"aft_port\[0\]: found 1.3, but this is outside its limits. .*-1 to 1"),
    ('file = "log.csv"\n', r"log.csv, line 1, header: found 'aft', .* Allowed: .*aft_port"),
])  # fmt: skip
def test_what_the_vehicle_has_not_or_cannot_is_one_message(trial_of, commands, said):
    with pytest.raises(scenarios.ScenarioError, match=r"\(1 problem\)(.|\n)*" + said):
        trial_of(commands, "time_s,aft\n0,0\n2,0\n")


def test_commands_made_in_python_are_held_against_the_vehicle(trial_of):
    trial = trial_of("time_s = [0.0]\naft_port = [0.3]\n")

    def given(name, value):
        values = np.array([[0.0, 0.0, 0.0, 0.0, value]])
        return replace(trial, commands=scenarios.Commands(time=np.zeros(1), values=values, listed=(name,)))

    assert given("aft_port", 0.5).commands.values[0, 4] == 0.5
    with pytest.raises(scenarios.ScenarioError, match=r"Did you mean 'aft_port'\? Allowed: front_starboard"):
        given("aft_prt", 0.5)
    with pytest.raises(scenarios.ScenarioError, match=r"commands.aft_port: found '2', .* limits"):
        given("aft_port", 2.0)
    with pytest.raises(subzero.UserError, match="commands 'aft_port', and this vehicle has no such actuator"):
        subzero.simulate(trial, model=subzero.Model.of(subzero.load_scenario("fig6")))


def test_a_stepped_run_takes_names_or_numbers_and_gives_the_same_bits(trial_of):
    trial = trial_of("time_s = [0.0]\naft_port = [0.3]\nfront_port = [-0.1]\n")
    whole = subzero.simulate(replace(trial, rtol=0.0), tethered=False)
    names = [channel.name for channel in subzero.Model.of(trial).vehicle.channels]
    numbers = [0.0] * 4 + [{"aft_port": 0.3, "front_port": -0.1}.get(name, 0.0) for name in names]
    for command in (None, {"aft_port": 0.3, "front_port": -0.1}, numbers):
        stepped = subzero.Simulator(trial, tethered=False)
        while stepped.time < 2.0 - 1e-9:
            stepped.step(command)
        np.testing.assert_array_equal(stepped.result()["north"].values, whole["north"].values)
    with pytest.raises(subzero.UserError, match=r"'aft_prt', .*Did you mean 'aft_port'"):
        stepped.step({"aft_prt": 0.3})
    with pytest.raises(subzero.UserError, match="keep the station of 'rov_hover'"):
        subzero.Simulator("rov_hover").step({"aft_port": 0.3})
