"""The page of vehicles, run as a stranger would in an empty folder: its commands, and its files put together."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import subzero
from scenarios.contents import contents
from subzero.cli.app import main

PAGE = (Path(__file__).parents[2] / "docs" / "vehicles.md").read_text(encoding="utf-8")
TOML = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


def block(start):
    """Return the file on the page that begins so."""
    return next(text for text in TOML if text.startswith(start))


ROV = block('base = "open_frame"') + block("[thrusters")


def test_the_commands_of_a_torpedo_from_four_numbers(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for line in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)[0:2]:
        for command in line.strip().splitlines():
            assert main(tuple(command.split()[1:])) == 0, command
    said = capsys.readouterr().out
    assert "3 measured, 58 derived, 57 guessed" in said
    assert "It goes 1.8 m/s at 21.8 rev/s." in said
    assert (tmp_path / "zigzag" / "tethered.csv").exists()


def test_a_torpedo_that_cannot_be_leaves_nothing_behind(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(("new", "auv.toml", "--torpedo", "lenght=2.0")) == 2
    assert main(("new", "auv.toml", "--torpedo", "length=2.0", "speed=1.8", "propeller_rps=1")) == 2
    assert "Did you mean 'length'?" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_files_of_the_page_are_files(tmp_path):
    few, station = block('base = "torpedo"'), block("[station]")
    (tmp_path / "few.toml").write_text(few)
    (tmp_path / "rov.toml").write_text(ROV)
    assert len(contents(str(tmp_path / "few.toml")).numbers) == 118
    names = {number.name for number in contents(str(tmp_path / "rov.toml")).numbers}
    assert {"vehicle.derivatives.N_v", "vehicle.thrusters.front_port.lag"} <= names
    text = subzero.load_scenario("rov_turn").text
    (tmp_path / "trial.toml").write_text(text[: text.index("\n[station]")] + "\n" + station)
    trial = subzero.load_scenario(tmp_path / "trial.toml")
    assert trial.station is not None
    assert trial.station.heading[-1] == pytest.approx(3.14159, abs=1e-4)


def test_products_primed_derivatives_and_sections_of_the_page_are_a_vehicle(tmp_path):
    text = 'base = "open_frame"\n' + block("[derivatives]") + block("[sections")
    (tmp_path / "box.toml").write_text(text)
    names = {number.name: number.unit for number in contents(str(tmp_path / "box.toml")).numbers}
    assert names["vehicle.derivatives.Y_v'"] == "1"
    assert names["vehicle.derivatives.X_uu_rudder2"] == "kg/m"
    assert names["vehicle.sections.bow.height"] == "m"
    assert main(("validate", str(tmp_path / "box.toml"))) == 0


@pytest.mark.parametrize(
    "change, said",
    [
        (("base = ", "bose = "), "numbers of a vehicle are missing"),
        (("X_u = ", "X_q7 = "), "no such derivative"),
        (('unit = "kg/s"', 'unit = "kg"'), 'unit = "kg/s"'),
        (("thrust_ahead = ", "thrust_forward = "), "Did you mean 'thrusters.front_port."),
        (("thrust_ahead = { value = 30.4", "thrust_ahead = { value = -1.0"), "thrust at full command ahead"),
    ],
)
def test_a_slip_in_a_table_is_said_with_its_line(tmp_path, capsys, change, said):
    (tmp_path / "rov.toml").write_text(ROV.replace(*change))
    assert main(("validate", str(tmp_path / "rov.toml"))) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") <= 11


def test_fins_masses_engines_and_commands_of_the_page_are_a_vehicle_and_a_trial(tmp_path):
    text = 'base = "open_frame"\n' + block("[fins") + block("[moving_masses")
    (tmp_path / "glider.toml").write_text(text)
    names = {number.name for number in contents(str(tmp_path / "glider.toml")).numbers}
    assert {
        "vehicle.fins.foreplane_port.span_angle",
        "vehicle.moving_masses.battery.turn_limit",
        "vehicle.buoyancy_engines.bladder.pump_rate",
    } <= names
    trial = subzero.load_scenario("glider_sawtooth").text
    (tmp_path / "trial.toml").write_text(trial[: trial.index("\n[commands]")] + "\n" + block("[commands]"))
    assert subzero.load_scenario(tmp_path / "trial.toml").commands.listed == (
        "battery_slide",
        "battery_turn",
        "bladder",
    )


def test_the_python_of_the_page_runs():
    first, second = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict = {}
    exec(first, names)
    drifting = names["subzero"].Simulator(names["rov"].trial)
    drifting.step({})
    # The current carries both; the two front thrusters push the commanded vehicle ahead.
    assert names["rov"].observation.surge_speed > drifting.observation.surge_speed + 0.01
    exec(second, names)
    assert names["steady"].state[7] == 0.1
    assert "front_port_command" in names["linear"].input_labels
    assert names["hover"].wet_length == 60.0
