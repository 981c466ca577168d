"""Measured states in files: a start with all nine states and the actuators, and a motion with any of them over time.

Verifies: every column arrives in its field and unit; a run's own columns are passed over knowingly; each way in which a
record can be wrong is told with its file, line, reason and remedy, word by word.
"""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import scenarios
from subzero.channels import BY_COLUMN, CHANNELS

DEGREE = math.pi / 180.0
HEAD = """\
description = "A short run"
vehicle = "subzero2"
cable = "table1"
run.duration_s = 10.0
"""
HELD = """
[commands]
time_s = [0.0]
propeller_rps = [20.0]
rudder_deg = [0.0]
stern_plane_port_deg = [0.0]
stern_plane_starboard_deg = [0.0]
"""
START = {
    "heading_deg": ("heading", 30.0, DEGREE),
    "pitch_deg": ("pitch", -5.0, DEGREE),
    "roll_deg": ("roll", 4.0, DEGREE),
    "surge_speed_m_s": ("surge_speed", 1.1, 1.0),
    "sway_speed_m_s": ("sway_speed", -0.2, 1.0),
    "heave_speed_m_s": ("heave_speed", 0.1, 1.0),
    "roll_rate_deg_s": ("roll_rate", 3.0, DEGREE),
    "pitch_rate_deg_s": ("pitch_rate", -2.0, DEGREE),
    "yaw_rate_deg_s": ("yaw_rate", 6.0, DEGREE),
    "propeller_speed_rps": ("propeller_speed", 24.0, 1.0),
    "rudder_angle_deg": ("rudder_angle", 3.0, DEGREE),
    "stern_plane_port_angle_deg": ("stern_plane_port_angle", 1.0, DEGREE),
    "stern_plane_starboard_angle_deg": ("stern_plane_starboard_angle", -1.0, DEGREE),
}
MOTION = {
    "time_s": ("time", [0.0, 5.0, 10.0], 1.0),
    "surge_speed_m_s": ("surge_speed", [1.0, 1.2, 1.1], 1.0),
    "pitch_deg": ("pitch", [0.0, 5.0, -5.0], DEGREE),
    "heading_deg": ("heading", [10.0, 20.0, 30.0], DEGREE),
    "sway_speed_m_s": ("sway_speed", [0.0, 0.1, -0.1], 1.0),
    "heave_speed_m_s": ("heave_speed", [0.0, 0.2, 0.1], 1.0),
    "roll_deg": ("roll", [0.0, 3.0, -3.0], DEGREE),
    "roll_rate_deg_s": ("roll_rate", [0.0, 1.0, 2.0], DEGREE),
    "pitch_rate_deg_s": ("pitch_rate", [0.0, -1.0, -2.0], DEGREE),
    "yaw_rate_deg_s": ("yaw_rate", [2.0, 2.0, 2.0], DEGREE),
    "north_m": ("north", [0.0, 5.0, 10.0], 1.0),
    "east_m": ("east", [0.0, 1.0, 3.0], 1.0),
    "depth_m": ("depth", [2.0, 2.5, 2.0], 1.0),
}


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Write files beside each other, and go there."""
    monkeypatch.chdir(tmp_path)

    def writer(toml, csv=None):
        (tmp_path / "mine.toml").write_text(toml, encoding="utf-8")
        if csv is not None:
            (tmp_path / "log.csv").write_text(csv, encoding="utf-8")
        return "mine.toml"

    return writer


@pytest.fixture
def complaints(write):
    """Return what is said of a trial, line by line below the headline."""

    def complain(toml, csv=None):
        with pytest.raises(scenarios.ScenarioError) as caught:
            scenarios.load(write(toml, csv))
        return [line.removeprefix("  ") for line in str(caught.value).splitlines()[1:]]

    return complain


def table(columns, rows=None):
    """Return a CSV file of columns name → values, with single cells replaced."""
    names = list(columns)
    cells = [[f"{value:.10g}" for value in row] for row in zip(*columns.values(), strict=True)]
    for (row, name), text in (rows or {}).items():
        cells[row][names.index(name)] = text
    return "\n".join([",".join(names), *(",".join(row) for row in cells)]) + "\n"


def log(count=101, **columns):
    """Return columns of a record at 10 Hz, straight ahead and level unless said otherwise."""
    names = ("surge_speed_m_s", "sway_speed_m_s", "pitch_deg", "heading_deg")
    return {"time_s": 0.1 * np.arange(count)} | {name: np.zeros(count) for name in names} | columns


FROM_FILE = '[motion]\nfile = "log.csv"\n'


def test_states_are_called_as_the_channels_of_a_run_are():
    assert set(START) | set(MOTION) <= set(BY_COLUMN)


def test_every_state_of_a_start_arrives_in_its_field_and_unit(write):
    keys = "".join(f"{key} = {value}\n" for key, (_, value, _) in START.items())
    start = scenarios.load(write(HEAD + "[start]\n" + keys + HELD)).start
    for name, value, scale in START.values():
        assert getattr(start, name) == pytest.approx(value * scale, rel=1e-12), name
    assert start.at_trim is False


def test_every_column_of_a_motion_arrives_in_its_field_and_unit(write):
    csv = table({key: values for key, (_, values, _) in MOTION.items()})
    trial = scenarios.load(write(HEAD + FROM_FILE, csv))
    for name, values, scale in MOTION.values():
        assert_allclose(getattr(trial.motion, name), np.array(values) * scale, rtol=1e-12, err_msg=name)
        if name in ("pitch", "roll_rate", "sway_speed", "depth"):
            assert getattr(trial.start, name) == pytest.approx(values[0] * scale)
    assert trial.motion.is_smooth


def test_the_same_lists_may_stand_in_the_trial_itself(write):
    lists = "".join(f"{key} = {values}\n" for key, (_, values, _) in MOTION.items())
    motion = scenarios.load(write(HEAD + "[motion]\n" + lists)).motion
    assert motion.is_smooth
    assert_allclose(motion.yaw_rate, 2.0 * DEGREE)


def test_the_channels_of_a_run_that_say_nothing_of_the_motion_are_passed_over(write):
    columns = log() | {
        channel.column: np.full(101, 0.5) for channel in CHANNELS if channel.column not in MOTION
    }
    trial = scenarios.load(write(HEAD + FROM_FILE, table(columns)))
    assert set(trial.motion.given) == {"surge_speed", "pitch", "heading", "sway_speed"}


def test_the_motion_of_a_file_can_replace_the_commands_of_any_scenario(write):
    write(HEAD, table(log(301, surge_speed_m_s=np.full(301, 0.7))))
    trial = scenarios.load("fig6", motion_csv="log.csv")
    assert trial.commands is None
    assert trial.start.surge_speed == 0.7
    assert trial.start.heading == 0.0, "not that of fig6"
    assert trial.start.depth == 1.0, "that of fig6"


@pytest.mark.parametrize("columns", [{}, {"sway_speed_m_s": np.zeros(101)}], ids=["linear", "smooth"])
def test_a_compass_that_jumps_by_a_turn_goes_on(write, columns):
    heading = np.mod(350.0 + 3.0 * np.arange(101), 360.0)
    record = {name: values for name, values in log(heading_deg=heading).items() if name != "sway_speed_m_s"}
    motion = scenarios.load(write(HEAD + FROM_FILE, table(record | columns))).motion
    assert_allclose(np.diff(motion.heading), 3.0 * DEGREE, rtol=1e-9)


def test_speed_pitch_and_heading_alone_are_linear_unless_asked(write):
    record = {name: values for name, values in log().items() if name != "sway_speed_m_s"}
    assert not scenarios.load(write(HEAD + FROM_FILE, table(record))).motion.is_smooth
    asked = HEAD + FROM_FILE + 'interpolation = "smooth"\n'
    assert scenarios.load(write(asked, table(record))).motion.is_smooth


LATE = log() | {"time_s": np.append(0.1 * np.arange(51), 0.1 * np.arange(51, 101) + 3.0)}
MISTAKES = {
    "unknown column": (
        table(log() | {"jaw_rate_deg_s": np.zeros(101)}),
        ["log.csv, line 1, header: found 'jaw_rate_deg_s', but there is no such column. "
         "Did you mean 'yaw_rate_deg_s'?"],
    ),
    "missing column": (
        table({name: values for name, values in log().items() if name != "pitch_deg"}),
        ["log.csv, line 1, pitch_deg: this column is missing. "
         "Needed: time_s, surge_speed_m_s, pitch_deg, heading_deg."],
    ),
    "gap in a cell": (
        table(log(), {(3, "sway_speed_m_s"): ""}),
        ["log.csv, line 5, sway_speed_m_s: this cell is empty. Allowed: -20 to 20 m/s (speed to starboard)."],
    ),
    "NaN": (
        table(log(), {(3, "heading_deg"): "nan"}),
        ["log.csv, line 5, heading_deg: found 'nan', but this is not a finite number. "
         "Allowed: -36000 to 36000 degree (heading, clockwise from north)."],
    ),
    "absurd speed": (
        table(log(), {(3, "surge_speed_m_s"): "97"}),
        ["log.csv, line 5, surge_speed_m_s: found '97', but this is outside its limits. "
         "Allowed: -20 to 20 m/s (forward speed)."],
    ),
    "times that go back": (
        table(log(), {(3, "time_s"): "0.1"}),
        ["log.csv, line 5, time_s: found 0.1, but the time before it is 0.2. "
         "Times must increase from sample to sample."],
    ),
    "a time twice": (
        table(log(), {(3, "time_s"): "0.2"}),
        ["log.csv, line 5, time_s: found 0.2, but the time before it is 0.2. "
         "Times must increase from sample to sample."],
    ),
    "a row of other length": (
        table(log(), {(3, "pitch_deg"): "0,0"}),
        ["log.csv, line 5: found 6 cells, but the header has 5 columns. Give every column one cell."],
    ),
    "rows that are missing": (
        table(LATE),
        ["log.csv, line 53, time_s: found 8.1, but nothing is known for 3.1 s before it, in a record with a "
         "sample every 0.1 s. Fill the gap, or end the run before it."],
    ),
    "shorter than the run": (
        table(log(91)),
        ["log.csv, line 92, time_s: found 9.0, but the motion is known until then, and the run lasts 10 s. "
         "Give samples to the end of the run, or shorten the duration to the last of them."],
    ),
    "a roll rate without a roll": (
        table(log() | {"roll_rate_deg_s": np.zeros(101)}),
        ["log.csv, roll_rate_deg_s: a roll rate is given, and no roll. Give both, or neither."],
    ),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_record_that_cannot_be_followed_is_told_with_its_line(mistake, complaints):
    csv, expected = MISTAKES[mistake]
    assert complaints(HEAD + FROM_FILE, csv) == expected


def test_a_linear_motion_refuses_what_it_would_not_follow(complaints):
    (reported,) = complaints(HEAD + FROM_FILE + 'interpolation = "linear"\n', table(log()))
    assert reported == (
        "log.csv, interpolation: a linear motion has speed, pitch and heading alone, and here is sway_speed too. "
        'Leave out the others, or take "smooth".'
    )
    (reported,) = complaints(HEAD + FROM_FILE + 'interpolation = "cubic"\n', table(log()))
    assert reported == (
        "mine.toml, line 7, motion.interpolation: found 'cubic', but a motion is not interpolated so. "
        "Allowed: linear, smooth."
    )


def test_a_motion_with_depths_and_a_start_with_one_contradict_each_other(complaints):
    csv = table(log() | {"depth_m": np.full(101, 2.0)})
    said = "but the prescribed motion says how the run starts. Leave it out, and set it in [motion]."
    start = "[start]\ndepth_m = 3.0\nrudder_angle_deg = 1.0\nat_trim = true\nsurge_speed_m_s = 1.0\n"
    assert complaints(HEAD + start + FROM_FILE, csv) == [
        f"mine.toml, line 6, start.depth_m: found 3.0, {said}",
        f"mine.toml, line 7, start.rudder_angle_deg: found 1.0, {said}",
        f"mine.toml, line 8, start.at_trim: found True, {said}",
        f"mine.toml, line 9, start.surge_speed_m_s: found 1.0, {said}",
    ]


def test_a_start_in_trim_refuses_what_it_finds_itself_and_needs_a_speed(complaints):
    start = "[start]\nat_trim = true\npropeller_speed_rps = 20.0\npitch_deg = 1.0\n"
    found = "but a start with at_trim finds it. Leave it out."
    assert complaints(HEAD + start + HELD) == [
        "mine.toml, line 5, start.surge_speed_m_s: found 0.0, but a start with at_trim holds a forward speed: "
        "fins need a flow. Above 0 m/s.",
        f"mine.toml, line 7, start.propeller_speed_rps: found 20.0, {found}",
        f"mine.toml, line 8, start.pitch_deg: found 1.0, {found}",
    ]
    (reported,) = complaints(HEAD + "[start]\nat_trim = 1\n" + HELD)
    assert reported.startswith(
        "mine.toml, line 6, start.at_trim: found 1, but this is neither true nor false."
    )


def test_a_motion_made_in_python_is_checked_like_one_of_a_file():
    trial = scenarios.load("fig5")
    time, one = np.linspace(0.0, 30.0, 301), np.ones(301)
    good = {"time": time, "surge_speed": one, "pitch": 0.0 * one, "heading": 0.0 * one}
    motion = scenarios.Motion(**good, sway_speed=0.1 * one, roll=0.0 * one)
    assert dataclasses.replace(trial, motion=motion).motion.given == (
        "surge_speed", "pitch", "heading", "sway_speed", "roll",
    )  # fmt: skip
    for wrong, words in (
        ({"sway_speed": one[:-1]}, "sway_speed: its shape is 300. Allowed: 301."),
        ({"roll": np.full(301, np.nan)}, "roll: found nan, but this is not a finite number"),
        ({"yaw_rate": 99.0 * one}, "outside its limits. Allowed: -720 to 720 degree/s"),
        ({"roll_rate": one}, "a roll rate is given, and no roll"),
        ({"heave_speed": one, "interpolation": "linear"}, "and here is heave_speed too"),
        ({"interpolation": "cubic"}, "a motion knows no interpolation 'cubic'"),
        ({"interpolation": np.array([1, "a", None], dtype=object)}, "a motion knows no interpolation"),
        (
            {"sway_speed": one, "time": np.where(time > 20.0, time + 5.0, time)},
            "nothing is known for 5.1 s before it",
        ),
    ):
        with pytest.raises(scenarios.ScenarioError) as caught:
            scenarios.Motion(**good | wrong)
        assert words in str(caught.value)
    with pytest.raises(scenarios.ScenarioError, match="known until then, and the run lasts 31 s"):
        dataclasses.replace(trial, motion=motion, duration=31.0)
