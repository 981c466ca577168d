"""What is in a file is what comes out: units, commands from CSV, changes, own vehicles, defaults."""

import dataclasses
import doctest
import math
import pickle
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import scenarios
import vehicle

COMMANDS = """
[commands]
time_s = [0.0, 5]
propeller_rps = [20.0, 27.0]
rudder_deg = [0.0, 90.0]
stern_plane_port_deg = [0.0, -45.0]
stern_plane_starboard_deg = [0.0, 45.0]
"""
SHORT = f"""
description = "As short as can be"
vehicle = "subzero2"
cable = "table1"
run.duration_s = 10.0
{COMMANDS}
"""
HEADER = "time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n"


@pytest.fixture
def write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def writer(text, name="mine.toml"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return name

    return writer


def test_the_example_of_the_package_works():
    result = doctest.testmod(scenarios)
    assert (result.failed, result.attempted) == (0, 4)


def test_what_is_not_said_takes_its_default(write):
    trial = scenarios.load(write(SHORT))
    assert (trial.hull_step, trial.cable_step, trial.segment_length) == (0.02, 0.1, 0.5)
    assert trial.scheme == scenarios.SCHEMES[0] == "moving_end"
    assert trial.start == scenarios.Start()
    assert trial.current == (0.0, 0.0, 0.0)
    assert trial.source == "mine.toml", "as the user gave it"


def test_every_number_of_a_trial_arrives_where_it_belongs(write):
    sections = """
[run]
duration_s = 12.0
hull_step_s = 0.05
cable_step_s = 0.25
segment_length_m = 0.3
scheme = "paper_drum"
[start]
heading_deg = 90.0
pitch_deg = -45.0
roll_deg = 30.0
depth_m = 2.0
surge_speed_m_s = 0.7
wet_length_m = 6.0
[water]
current_north_m_s = 0.1
current_east_m_s = 0.2
current_down_m_s = 0.3
"""
    trial = scenarios.load(write(SHORT.replace("run.duration_s = 10.0", sections)))
    assert (trial.duration, trial.hull_step, trial.cable_step) == (12.0, 0.05, 0.25)
    assert (trial.segment_length, trial.scheme, trial.current) == (0.3, "paper_drum", (0.1, 0.2, 0.3))
    angles = [trial.start.heading, trial.start.pitch, trial.start.roll]
    np.testing.assert_allclose(angles, [math.pi / 2, -math.pi / 4, math.pi / 6], rtol=1e-15)  # rounding only
    assert (trial.start.depth, trial.start.surge_speed, trial.start.wet_length) == (2.0, 0.7, 6.0)


def test_degrees_become_radians_and_rev_per_second_stay(write):
    trial = scenarios.load(write(SHORT))
    expected = [[20.0, 0.0, 0.0, 0.0], [27.0, math.pi / 2, -math.pi / 4, math.pi / 4]]
    np.testing.assert_allclose(trial.commands.values, expected, rtol=1e-15)  # rounding only
    np.testing.assert_array_equal(trial.commands.time, [0.0, 5.0])


def test_commands_from_a_csv_file_are_those_of_the_same_lists(write):
    log = "\ufeff# a remark\n" + HEADER + "\n0,20,0,0,0\r\n5,27,90,-45,45\n10,27,90,-45,45\n"
    write(log, "log.csv")
    own = scenarios.load(write(SHORT)).commands
    text = SHORT.replace(COMMANDS, '[commands]\nfile = "log.csv"\n')
    for trial in (
        scenarios.load(write(text, "by_file.toml")),
        scenarios.load("mine.toml", commands_csv="log.csv"),
    ):
        np.testing.assert_array_equal(trial.commands.time[:2], own.time)
        np.testing.assert_array_equal(trial.commands.values[:2], own.values)


def test_columns_of_a_csv_file_may_stand_in_any_order(write):
    rows = [line.split(",") for line in (HEADER + "0,20,1,2,3\n10,27,4,5,6\n").splitlines()]
    write("\n".join(",".join(reversed(row)) for row in rows), "log.csv")
    trial = scenarios.load(write(SHORT), commands_csv="log.csv")
    np.testing.assert_allclose(np.degrees(trial.commands.values[:, 1:]), [[1, 2, 3], [4, 5, 6]], rtol=1e-15)


def test_a_log_may_end_one_sampling_interval_before_the_run_does(write):
    rows = "".join(f"{time},27,0,0,0\n" for time in range(10))
    trial = scenarios.load(write(SHORT), commands_csv=write(HEADER + rows, "log.csv"))
    assert trial.commands.time[-1] == 9.0


def test_a_csv_file_is_looked_for_beside_the_scenario_that_names_it(write, tmp_path):
    folder = tmp_path / "trials"
    folder.mkdir()
    (folder / "log.csv").write_text(HEADER + "0,20,0,0,0\n10,27,0,0,0\n")
    (folder / "mine.toml").write_text(SHORT.replace(COMMANDS, '[commands]\nfile = "log.csv"\n'))
    assert scenarios.load("trials/mine.toml").commands.time[-1] == 10.0


def test_a_motion_may_stand_in_a_csv_file_too(write):
    write("time_s,surge_speed_m_s,pitch_deg,heading_deg\n0,1,-30,10\n10,2,0,0\n", "motion.csv")
    start = "start = { depth_m = 2.0, wet_length_m = 6.0 }\n"
    text = SHORT.replace(COMMANDS, start + '[motion]\nfile = "motion.csv"\n')
    trial = scenarios.load(write(text))
    assert (trial.start.depth, trial.start.wet_length) == (2.0, 6.0)
    assert trial.commands is None
    assert trial.start.surge_speed == 1.0
    assert trial.start.pitch == pytest.approx(-math.pi / 6, rel=1e-15)
    assert trial.start.heading == pytest.approx(math.pi / 18, rel=1e-15)


@pytest.mark.parametrize("quote", ['"', ""])
def test_changes_replace_single_values(write, quote):
    changes = "[changes]\n" + "".join(
        f"{quote}{key}{quote} = {value}\n"
        for key, value in (("vehicle.rigid_body.mass", 7), ("cable.diameter", 0.003), ("drum.inertia", 1e-4))
    )
    trial, base = scenarios.load(write(SHORT + changes)), scenarios.load("fig6")
    assert trial.vehicle["rigid_body"] == {**base.vehicle["rigid_body"], "mass": 7.0}
    assert trial.cable == {**base.cable, "diameter": 0.003}
    assert trial.drum == {**base.drum, "inertia": 1e-4}


@pytest.mark.parametrize("kind", ["vehicle", "cable"])
def test_an_own_vehicle_or_cable_is_a_path_from_the_scenario(write, kind):
    root = scenarios.path("fig6").parent.parent
    shipped = {"vehicle": "vehicles/subzero2.toml", "cable": "cables/table1.toml"}[kind]
    name = {"vehicle": "subzero2", "cable": "table1"}[kind]
    text = (root / shipped).read_text(encoding="utf-8").replace("value = 1000.0", "value = 1025.0")
    write(text, "own.toml")
    trial = scenarios.load(write(SHORT.replace(f'"{name}"', '"own.toml"')))
    density = trial.vehicle["water"]["density"] if kind == "vehicle" else trial.cable["water_density"]
    assert density == 1025.0


def test_what_a_vehicle_finds_wrong_with_its_numbers_joins_the_problems(write):
    def grumble(vehicle):
        assert vehicle["rigid_body"]["mass"] == 7.0
        said = {"found": "1", "why": "it is not so", "allowed": "another"}
        return [SimpleNamespace(key=key, **said) for key in ("rigid_body.mass", "hull.length")]

    text = SHORT + '[changes]\n"vehicle.rigid_body.mass" = 7.0\n'
    with pytest.raises(scenarios.ScenarioError) as caught:
        scenarios.load(write(text), check_vehicle=grumble)
    changed, own = caught.value.problems
    assert (changed.file, changed.key) == ("mine.toml", "changes.vehicle.rigid_body.mass")
    assert text.splitlines()[changed.line - 1].endswith("= 7.0")
    assert (own.file, own.key, own.found, own.why) == ("subzero2", "hull.length", "1", "it is not so")


def test_the_vehicles_own_complaints_fit(write):
    def complaints(numbers):
        try:
            vehicle.from_mapping(numbers)
        except vehicle.VehicleError as error:
            return error.problems
        return ()

    scenarios.load("fig6", check_vehicle=complaints)
    text = SHORT + "[changes]\nvehicle.hull.nose_length = 0.9\n"
    with pytest.raises(scenarios.ScenarioError, match="but together they are longer"):
        scenarios.load(write(text), check_vehicle=complaints)


def test_a_trial_can_be_varied_and_sent_to_another_process():
    trial = dataclasses.replace(scenarios.load("fig6"), duration=60.0)
    back = pickle.loads(pickle.dumps(trial))
    assert back.duration == 60.0
    np.testing.assert_array_equal(back.commands.values, trial.commands.values)


def test_an_error_can_be_sent_to_another_process():
    with pytest.raises(scenarios.ScenarioError) as caught:
        scenarios.load("nothing like it")
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_loading_twice_gives_the_same_numbers():
    first, second = scenarios.load("spiral"), scenarios.load("spiral")
    assert first.vehicle == second.vehicle
    np.testing.assert_array_equal(first.commands.values, second.commands.values)


def test_a_trial_that_is_changed_in_place_changes_none_that_is_loaded_later():
    """Files are parsed once while they are the same: what a reader gets of them is its own."""
    first = scenarios.load("fig6")
    first.vehicle["rigid_body"]["mass"] = first.cable["diameter"] = first.drum["radius"] = 0.0
    again = scenarios.load("fig6")
    assert min(again.vehicle["rigid_body"]["mass"], again.cable["diameter"], again.drum["radius"]) > 0.0


def test_a_file_that_has_been_edited_is_read_again(write):
    before = scenarios.load(write(SHORT))
    edited = scenarios.load(write(SHORT + '[changes]\n"cable.diameter" = 0.0123\n'))
    assert edited.cable["diameter"] == 0.0123 != before.cable["diameter"]


def test_names_and_help_do_not_wait_for_the_schema_library():
    use = "scenarios.names(); scenarios.describe('fig6')"
    code = f"import sys, scenarios; {use}; print('pydantic' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
