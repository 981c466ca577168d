"""The scenarios we ship: they load, they say what the paper says, and they explain themselves."""

import tomllib

import numpy as np
import pytest

import scenarios
from scenarios.quantities import SECTIONS

REQUIRED = {
    "fig4", "fig5", "fig5_turn", "fig6", "wide_turn", "zigzag",
    "turning_circle", "dive", "spiral", "stop_and_drift", "current", "rov_umbilical",
}  # fmt: skip


def test_every_scenario_of_the_issue_is_shipped():
    assert set(scenarios.names()) >= REQUIRED


@pytest.mark.parametrize("name", scenarios.names())
def test_every_shipped_scenario_loads_and_describes_itself_in_one_line(name):
    trial = scenarios.load(name)
    assert trial.name == trial.source == name
    assert trial.description == scenarios.describe(name)
    assert "\n" not in trial.description
    assert trial.text == scenarios.path(name).read_text(encoding="utf-8")
    assert sum(each is not None for each in (trial.commands, trial.motion, trial.station)) == 1


@pytest.mark.parametrize("name", scenarios.names())
def test_a_copy_of_a_shipped_scenario_loads_from_any_folder(name, tmp_path):
    copy = tmp_path / "mine.toml"
    copy.write_text(scenarios.path(name).read_text(encoding="utf-8"), encoding="utf-8")
    trial, original = scenarios.load(copy), scenarios.load(name)
    assert trial.name == "mine"
    assert (trial.start, trial.vehicle, trial.cable) == (original.start, original.vehicle, original.cable)


def test_fig4_runs_straight_at_one_metre_a_second():
    motion = scenarios.load("fig4").motion
    assert set(motion.surge_speed) == {1.0}
    assert not motion.pitch.any()
    assert not motion.heading.any()


def test_fig5_dives_nose_down_by_six_degrees_a_second():
    """The paper's case (ii), with the minus signs that its text lost."""
    motion = scenarios.load("fig5").motion
    pitch = np.degrees(np.interp([0.0, 10.0, 11.0, 15.0, 20.0, 30.0], motion.time, motion.pitch))
    np.testing.assert_allclose(pitch, [0.0, 0.0, -6.0, -30.0, -60.0, -60.0], atol=1e-12)  # rounding only
    assert not motion.heading.any()


def test_fig5_turn_is_fig5_with_down_and_east_exchanged():
    """Nose down becomes nose to starboard: the forward axis (cosθ, 0, -sinθ) becomes (cosψ, sinψ, 0)."""
    dive, turn = scenarios.load("fig5").motion, scenarios.load("fig5_turn").motion
    np.testing.assert_array_equal(turn.time, dive.time)
    np.testing.assert_array_equal(turn.surge_speed, dive.surge_speed)
    np.testing.assert_array_equal(turn.heading, -dive.pitch)
    np.testing.assert_array_equal(turn.pitch, dive.heading)
    assert scenarios.load("fig5_turn").start.depth == scenarios.load("fig5").start.depth


def test_fig6_starts_from_rest_at_27_degrees_with_constant_propeller_and_central_stern_planes():
    trial = scenarios.load("fig6")
    assert np.degrees(trial.start.heading) == pytest.approx(27.0, rel=1e-15)
    assert trial.start.surge_speed == 0.0
    assert trial.start.wet_length == 0.0
    assert trial.duration == 30.0
    propeller, rudder, *planes = trial.commands.values.T
    assert len(set(propeller)) == 1
    assert rudder.max() > 0.0, "a positive rudder turns to starboard, from 27 to 35 degrees"
    assert rudder[0] == rudder[-1] == 0.0
    assert not np.any(planes)


def test_fig6_says_that_its_commands_are_not_the_papers():
    assert "paper prints NEITHER the propeller speed NOR the rudder angles" in scenarios.load("fig6").text


def test_fig6_and_rov_umbilical_show_every_key_that_a_trial_can_hold():
    fig6, umbilical = (scenarios.load(name).text for name in ("fig6", "rov_umbilical"))
    for section in ("run", "start", "commands"):
        assert {quantity.name for quantity in SECTIONS[section]} <= set(tomllib.loads(fig6)[section])
    assert "changes" in tomllib.loads(fig6)
    for section in ("water", "winch", "vessel", "motion"):
        for quantity in SECTIONS[section]:
            assert quantity.name in umbilical, quantity.name
    assert "rov_umbilical.toml" in fig6


def test_stop_and_drift_stops_the_propeller_at_half_time():
    trial = scenarios.load("stop_and_drift")
    assert trial.commands.time[-1] == trial.duration / 2.0
    assert trial.commands.values[-1, 0] == 0.0


def test_the_current_is_across_the_heading():
    trial = scenarios.load("current")
    assert trial.start.heading == 0.0
    assert trial.current == (0.0, 0.2, 0.0)


def test_the_cable_is_table_1_and_the_drum_that_of_section_4():
    trial = scenarios.load("fig6")
    assert trial.cable == {
        "water_density": 1000.0,
        "mass_per_length": 0.0049,
        "cross_section_area": 4.9e-6,
        "diameter": 0.0025,
        "tangential_drag_coefficient": 0.01,
        "normal_drag_coefficient": 1.0,
        "added_mass_coefficient": 1.0,
        "tangential_added_mass_coefficient": 0.0,
        "compliance": 0.0,
        "internal_damping": 0.0,
        "bending_stiffness": 0.0,
        "strength": 0.0,
        "minimum_bend_radius": 0.0,
    }
    assert trial.drum == {"radius": 0.1, "inertia": 0.0, "friction_torque": 0.0}


def test_the_umbilical_weighs_a_few_newtons_a_metre_in_water():
    cable = scenarios.load("rov_umbilical").cable
    displaced = cable["water_density"] * cable["cross_section_area"]
    assert 1.0 < 9.81 * (cable["mass_per_length"] - displaced) < 5.0
    assert cable["cross_section_area"] == pytest.approx(np.pi * cable["diameter"] ** 2 / 4.0, rel=1e-3)


@pytest.mark.parametrize("part", ["cables/table1.toml", "cables/umbilical.toml", "vehicles/subzero2.toml"])
def test_every_number_of_a_part_has_unit_range_and_provenance(part):
    root = scenarios.path("fig6").parent.parent
    sections = tomllib.loads((root / part).read_text(encoding="utf-8"))
    for section, keys in sections.items():
        for key, leaf in keys.items():
            low, high = leaf["range"]
            assert low <= leaf["value"] <= high, f"{section}.{key}"
            assert leaf["unit"], f"{section}.{key}"
            assert leaf["source"].startswith(("paper", "geometry formula", "estimate")), f"{section}.{key}"
