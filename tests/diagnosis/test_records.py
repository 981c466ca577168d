"""What a user measured is taken as it comes, or refused in one message that says what to do."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero import read_trials
from subzero.errors import UserError

TIME = np.arange(0.0, 30.01, 0.1)
SHAPE = {
    "surge_speed": 1.1 * (1.0 - np.exp(-TIME / 2.0)),
    "heading": 27.0 + 8.0 / (1.0 + np.exp(-(TIME - 3.0))),
    "yaw_rate": 4.0 * np.exp(-((TIME - 3.0) ** 2)),
    "pitch": 3.0 * np.sin(TIME),
    "roll_angle": 2.0 * np.exp(-TIME / 3.0),
    "depth": 1.0 + 0.02 * TIME,
    "speed_over_ground": 1.1 * (1.0 - np.exp(-TIME / 2.0)),
    "cable_tension": 0.3 * TIME,
    "propeller_speed": 25.0 * (1.0 - np.exp(-TIME / 0.3)),
}
"""What a trial like fig6 does, near enough, without a simulation."""

COLUMN = {
    "surge_speed": "surge_speed_m_s", "heading": "heading_deg", "yaw_rate": "yaw_rate_deg_s", "pitch": "pitch_deg",
    "roll_angle": "roll_deg", "depth": "depth_m", "speed_over_ground": "speed_over_ground_m_s",
    "cable_tension": "cable_tension_N", "propeller_speed": "propeller_speed_rps",
}  # fmt: skip


def simulated(setting, times, channels):
    return {name: np.interp(times, TIME, SHAPE[name]) for name in channels}


def columns(*names, time=TIME, seed=1, **changed):
    """Return a record's columns: the shapes with some noise; `changed` replaces them."""
    rng = np.random.default_rng(seed)
    noisy = {name: np.interp(time, TIME, SHAPE[name]) + 0.005 * rng.normal(size=time.size) for name in names}
    return {"time_s": time, **{COLUMN.get(name, name): one for name, one in {**noisy, **changed}.items()}}


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Write columns as record.csv, and a sidecar if there is one, into the working folder."""
    monkeypatch.chdir(tmp_path)

    def put(table, sidecar=None, name="record"):
        rows = np.column_stack(list(table.values()))
        text = [",".join(table), *(",".join("" if x != x else f"{x:.10g}" for x in row) for row in rows)]
        (tmp_path / f"{name}.csv").write_text("\n".join(text) + "\n")
        if sidecar is not None:
            (tmp_path / f"{name}.toml").write_text(sidecar)
        return f"{name}.csv"

    return put


def read(path, scenario="fig6", **more):
    return read_trials(path, scenario=scenario, simulated=simulated, **more)


def refusal(path, **more):
    """Return what is said, on one line."""
    with pytest.raises(UserError) as refused:
        read(path, **more)
    return re.sub(r"\s+", " ", str(refused.value))


def test_a_record_keeps_its_gaps_and_brings_the_trial_and_the_nominal_model(write):
    table = columns("surge_speed", "heading")
    table["heading_deg"][5:9] = np.nan
    (logged,) = read(write(table))
    assert logged.name == "record"
    assert set(logged.record.values) == {"surge_speed", "heading"}
    assert np.isnan(logged.record.values["heading"][5:9]).all()
    assert logged.setting.trial.name == "fig6"
    assert logged.setting.tethered
    assert logged.setting.model.cable.diameter > 0.0


def test_a_short_record_makes_the_trial_as_short(write):
    (logged,) = read(write(columns("surge_speed", time=TIME[:101])))
    assert_allclose(logged.setting.trial.duration, 10.0)


def test_a_folder_holds_several_trials_each_with_its_own_scenario(write, tmp_path):
    write(columns("surge_speed"), 'scenario = "zigzag"', name="b")
    write(columns("heading"), name="a")
    first, second = read(tmp_path)
    assert (first.name, second.name) == ("a", "b")
    assert (first.setting.trial.name, second.setting.trial.name) == ("fig6", "zigzag")


def test_a_sidecar_that_names_another_trial_is_followed_and_said(write):
    file = write(columns("surge_speed"), 'scenario = "fig6"')
    (one,) = read(file, scenario="zigzag")
    assert one.setting.trial.name == "fig6"
    assert any("zigzag is not taken" in note for note in one.notes)
    (same,) = read(file, scenario="fig6")
    assert not same.notes


def test_the_sidecar_tells_noise_and_rates_and_what_the_speed_log_shows(write):
    sidecar = """
        source = "basin"
        tethered = false
        surge_speed = "ground"
        [noise]
        heading_deg = 0.7
        [rate_hz]
        heading_deg = 2.0
    """
    (logged,) = read(write(columns("surge_speed", "heading"), sidecar))
    assert not logged.setting.tethered
    assert logged.noise == {"heading": 0.7}
    assert set(logged.record.values) == {"speed_over_ground", "heading"}
    assert np.isfinite(logged.record.values["heading"]).sum() == 61  # twice a second, for 30 s
    assert any("over ground" in note for note in logged.notes)


def test_a_heading_told_from_minus_180_to_180_stands_beside_the_trials(write):
    (logged,) = read(write(columns(heading=SHAPE["heading"] + 360.0)))
    assert abs(logged.record.values["heading"][0] - 27.0) < 1.0


def test_what_no_sensor_shows_is_left_out_and_said(write):
    (logged,) = read(write(columns("surge_speed", energy_hull_loss_J=TIME)))
    assert set(logged.record.values) == {"surge_speed"}
    assert any("energy_hull_loss_J" in note for note in logged.notes)


def test_commands_that_agree_are_taken_and_commands_that_differ_are_refused_with_place_and_numbers(write):
    same = columns("surge_speed", propeller_command_rps=np.full(TIME.size, 25.0))
    (logged,) = read(write(same))
    assert_allclose(logged.setting.trial.commands.values[0, 0], 25.0)
    other = columns("surge_speed", propeller_command_rps=np.where(TIME < 3.15, 25.0, 18.0))
    said = refusal(write(other))
    assert "the propeller command of the record differs from the scenario's (fig6) from t = 3.2 s on" in said
    assert "18 against 25 rev/s" in said
    assert "--commands record" in said


def test_the_records_commands_replace_the_scenarios_when_that_is_said(write):
    rudder = np.where((TIME > 4.95) & (TIME < 7.0), -6.0, 0.0)
    (logged,) = read(write(columns("surge_speed", rudder_command_deg=rudder)), commands="record")
    commands = logged.setting.trial.commands
    assert_allclose(np.degrees(commands.values[:, 1]).min(), -6.0)
    assert commands.time[0] == 0.0
    assert_allclose(
        np.degrees(commands.at(TIME)[:, 1]), rudder, atol=1e-12
    )  # at every sample what it says then
    rudder[TIME < 0.25] = np.nan  # a gap at the start; the next one holds what was before it
    rudder[(TIME > 6.0) & (TIME < 8.0)] = np.nan
    (logged,) = read(write(columns("surge_speed", rudder_command_deg=rudder)), commands="record")
    held = np.degrees(logged.setting.trial.commands.at(np.array([0.0, 5.9, 7.9, 8.1]))[:, 1])
    assert_allclose(held, [0.0, -6.0, -6.0, 0.0], atol=1e-12)
    assert_allclose(commands.values[:, 0], 25.0)  # a column that the record lacks stays the scenario's


def test_a_switch_within_one_sample_is_no_difference(write):
    rudder = np.where((TIME > 1.05) & (TIME < 3.05), 4.8, 0.0)  # logged a sample late
    read(write(columns("surge_speed", rudder_command_deg=rudder)))


@pytest.mark.parametrize(
    ("table", "says"),
    [
        (columns("surge_speed", sped_m_s=TIME), "unknown column 'sped_m_s'"),
        (columns(surge_sped_m_s=TIME), "Did you mean 'surge_speed_m_s'?"),
        (columns("surge_speed", time=TIME[::-1]), "time must increase"),
        (columns(heading=np.full(TIME.size, np.nan)), "holds no number at all"),
        (columns(heading=np.full(TIME.size, 27.0)), "is 27 in every sample, while the simulation moves it by 7.62"),
        (columns(heading=np.radians(SHAPE["heading"])), "heading_deg looks like radians (1/57.3 times the simulation)"),
        (columns(yaw_rate=np.radians(SHAPE["yaw_rate"])), "yaw_rate_deg_s looks like radians per second"),
        (columns(surge_speed=1.944 * SHAPE["surge_speed"]), "looks like knots (1.94 times the simulation)"),
        (columns(depth=3.281 * SHAPE["depth"]), "depth_m looks like feet (3.28 times the simulation)"),
        (columns(depth=-SHAPE["depth"]), "depth_m has the opposite sign"),
        (columns(propeller_speed=60.0 * SHAPE["propeller_speed"]), "looks like revolutions per minute"),
        (columns("surge_speed", time=np.arange(0.0, 30.1, 5.5)), "sampled every 5.5 s, slower than the vehicle moves"),
        (columns("surge_speed", time=TIME[:40]), "it lasts 3.9 s; a diagnosis needs at least 5 s"),
        (columns("surge_speed", time=1.5 * TIME), "it lasts until 45 s, but the trial fig6 ends at 30 s"),
        (columns("surge_speed", time=TIME + 1000.0), "time_s counts from the start of the trial"),
        (columns(rudder_command_deg=0.0 * TIME), "differs from the scenario's (fig6) from t = 1 s on"),
        (columns(energy_hull_loss_J=TIME), "has no channel that can be diagnosed"),
    ],
)  # fmt: skip
def test_a_record_that_cannot_be_used_is_refused_in_words(write, table, says):
    assert says in refusal(write(table))


def test_odd_units_are_asked_about_once_and_believed_when_confirmed(write):
    knots = columns(surge_speed=1.944 * SHAPE["surge_speed"])
    assert 'units_checked = ["surge_speed_m_s"]' in refusal(write(knots))
    read(write(knots, 'units_checked = ["surge_speed_m_s"]'))
    read(write(knots, "units_checked = true"))


def test_a_vehicle_that_is_merely_wrong_is_not_asked_about(write):
    for share in (0.7, 1.3, 1.5):
        read(write(columns(surge_speed=share * SHAPE["surge_speed"], roll_angle=-0.4 * SHAPE["roll_angle"])))


def test_a_trial_without_commands_and_a_record_without_scenario_are_refused(write):
    assert "prescribes the motion" in refusal(write(columns("surge_speed", time=TIME[:80])), scenario="fig4")
    assert "Which trial is record.csv? Give --scenario" in refusal("record.csv", scenario=None)


@pytest.mark.parametrize(
    ("sidecar", "says"),
    [
        ("sauce = 1", "there is no such key. Did you mean 'source'?"),
        ("tethered = 1", "line 1, tethered: found 1, but this is not true or false"),
        ('surge_speed = "air"', "Allowed: 'water' or 'ground'"),
        ("[noise]\nheading = 1.0", "there is no column 'heading'. Did you mean 'heading_deg'?"),
        ("[noise]\nheading_deg = -1.0", "this is not a number above 0"),
        ('units_checked = ["heading"]', "there is no column 'heading'"),
        ("source = ", "this is not valid TOML"),
    ],
)
def test_a_sidecar_that_cannot_be_used_is_refused_in_words(write, sidecar, says):
    assert says in refusal(write(columns("surge_speed"), sidecar))
