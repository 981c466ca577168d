"""Every number of a trial has one name, by which it can be looked at and changed.

Verifies: `scenarios.parameters` against what the reader makes of an edited file. Configuration: shipped trials.
Tolerance: none, the numbers are the same to the last bit.
"""

import dataclasses
import tomllib

import numpy as np
import pytest

import scenarios
from scenarios.parameters import declared_ranges, parameter, parameter_names, parameter_unit, with_parameters


@pytest.fixture(scope="module")
def fig6():
    return scenarios.load("fig6")


@pytest.fixture(scope="module")
def umbilical():
    return scenarios.load("rov_umbilical")


EDITS = {
    "run.duration_s": ("duration_s = 30.0 ", "duration_s = 12.0 ", 12.0),
    "start.heading_deg": ("heading_deg = 27.0", "heading_deg = -31.7", -31.7),
    "start.wet_length_m": ("wet_length_m = 0.0", "wet_length_m = 7.3", 7.3),
    "water.current_east_m_s": ("current_east_m_s = 0.0", "current_east_m_s = 0.13", 0.13),
    "water.sea_bed_m": ("sea_bed_m = 0.0", "sea_bed_m = 9.0", 9.0),
    "commands.rudder_deg[1]": ("4.8,  0.0]", "3.3,  0.0]", 3.3),
    "commands.propeller_rps": ("[25.0, 25.0, 25.0]", "[19.0, 19.0, 19.0]", 19.0),
    "vehicle.rigid_body.mass": ('# "vehicle.rigid_body.mass" = 7.0', '"vehicle.rigid_body.mass" = 7.0', 7.0),
    "cable.normal_drag_coefficient": ('# "cable.normal_drag_coefficient"', '"cable.normal_drag_coefficient"', 1.2),
    "drum.inertia": ('# "drum.inertia" = 1e-4', '"drum.inertia" = 1e-4', 1e-4),
}  # fmt: skip
"""Name → what stands in fig6.toml, what stands there instead, and the value that this is."""


@pytest.mark.parametrize("name", EDITS)
def test_a_changed_number_is_what_the_reader_makes_of_an_edited_file(name, fig6, tmp_path):
    old, new, value = EDITS[name]
    text = scenarios.path("fig6").read_text(encoding="utf-8")
    assert text.count(old) == 1
    (tmp_path / "fig6.toml").write_text(text.replace(old, new), encoding="utf-8")
    read = scenarios.load(tmp_path / "fig6.toml")
    changed = with_parameters(fig6, {name: value})
    for field in dataclasses.fields(scenarios.Trial):
        if field.name in ("text", "source"):
            continue
        mine, files = getattr(changed, field.name), getattr(read, field.name)
        if field.name == "commands":
            assert np.array_equal(mine.time, files.time)
            assert np.array_equal(mine.values, files.values)
        else:
            assert mine == files, field.name
    assert parameter(read, name) == pytest.approx(value, rel=1e-15)


def test_what_is_changed_was_something_else_before(fig6):
    before = {name: parameter(fig6, name) for name in EDITS}
    assert all(before[name] != value for name, (_, _, value) in EDITS.items())


def test_lists_of_winch_vessel_profile_and_motion_have_names_too(umbilical):
    changed = with_parameters(
        umbilical,
        {
            "winch.pay_out_rate_m_s[3]": 0.2,
            "vessel.velocity_east_m_s[2]": 0.1,
            "water.profile_east_m_s[0]": 0.4,
            "motion.pitch_deg[0]": -45.0,
        },
    )
    assert changed.winch.setpoint[3] == 0.2
    assert changed.vessel.velocity[2] == (0.031, 0.1, 0.0)
    assert changed.profile.velocity[0] == (0.0, 0.4, 0.0)
    assert changed.motion.pitch[0] == pytest.approx(np.radians(-45.0), rel=1e-15)
    assert changed.motion.given == umbilical.motion.given
    assert umbilical.winch.setpoint[3] == 0.191  # the one that was changed stays as it is


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("start.headin_deg", "Did you mean 'start.heading_deg'?"),
        ("cable.diamter", "Did you mean 'cable.diameter'?"),
        ("vehicle.mass", "Did you mean 'vehicle.rigid_body.mass'?"),
        ("commands.rudder_deg[3]", "this list has 3 values"),
        ("winch.tension_N", "the trial has no such number"),
        ("start.at_trim", "the trial has no such number"),
        ("nothing", "Write section.key"),
    ],
)
def test_a_name_that_is_none_is_answered_with_the_nearest(name, said, fig6):
    with pytest.raises(scenarios.ScenarioError) as caught:
        with_parameters(fig6, {name: 1.0})
    assert said in str(caught.value)
    assert name in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("start.pitch_deg", 91.0),
        ("cable.diameter", 0.0),
        ("water.current_east_m_s", np.nan),
        ("run.rtol", "x"),
    ],
)
def test_a_value_that_a_file_refuses_is_refused(name, value, fig6):
    with pytest.raises(scenarios.ScenarioError, match="Allowed"):
        with_parameters(fig6, {name: value})


def test_values_that_do_not_fit_together_are_refused(fig6):
    with pytest.raises(scenarios.ScenarioError):
        with_parameters(fig6, {"commands.time_s[1]": 5.0})  # behind the third


def test_declared_ranges_are_those_of_the_files(fig6, umbilical):
    ranges = declared_ranges(fig6)
    file = tomllib.loads(
        (scenarios.path("fig6").parents[1] / "vehicles/subzero2.toml").read_text(encoding="utf-8")
    )
    assert ranges["vehicle.axial_drag.drag_coefficient"] == tuple(
        file["axial_drag"]["drag_coefficient"]["range"]
    )
    assert ranges["cable.diameter"] == (0.0024, 0.0026)
    assert declared_ranges(umbilical)["cable.diameter"] == (0.02, 0.03)
    assert all(name in parameter_names(fig6) for name in ranges)
    assert parameter_unit(fig6, "cable.diameter") == "m"


def test_the_numbers_of_a_station_have_names():
    """What a sweep of `station.…` changes: a bandwidth, a whole list, an element of one."""
    turn = scenarios.load("rov_turn")
    changes = {"station.bandwidth_rad_s": 0.5, "station.depth_m": 30.0, "station.heading_deg[2]": 90.0}
    changed = with_parameters(turn, changes).station
    assert changed.bandwidth == 0.5
    assert [place[2] for place in changed.place] == [30.0] * 5
    assert changed.heading == pytest.approx(np.radians([0.0, 0.0, 90.0, 180.0, -180.0]))
    assert changed.time == turn.station.time
    assert parameter(turn, "station.bandwidth_rad_s") == turn.station.bandwidth
    assert parameter_unit(turn, "station.heading_deg") == "degree"
    with pytest.raises(scenarios.ScenarioError, match=r"Did you mean 'station\.bandwidth_rad_s'\?"):
        with_parameters(turn, {"station.bandwith_rad_s": 0.5})
    with pytest.raises(scenarios.ScenarioError, match="the trial has no such number"):
        with_parameters(scenarios.load("fig6"), {"station.depth_m": 3.0})
