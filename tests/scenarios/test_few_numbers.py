"""A vehicle from few numbers: what follows from length, diameter and mass is what the geometry formulas of the package
`vehicle` give, a second formulation (there: slices of the shape; here: powers and moments, relative to a base).
Tolerances of 0.2 %: the base's own numbers are rounded to three digits, and midpoint slices err by less.
"""

from __future__ import annotations

import numpy as np
import pytest

import scenarios
from scenarios.contents import contents
from scenarios.parameters import part_file, ranges_in, with_vehicle
from scenarios.parts import nested
from scenarios.similar_vehicle import speed_command
from subzero.model import Model, load
from vehicle import Vehicle, free_run, from_mapping, initial_state
from vehicle.consistency import contradictions
from vehicle.geometry import (
    centre_of_volume,
    displaced_volume,
    homogeneous_inertia,
    lamb_factors,
    lateral_added_mass,
)

HEAD = 'base = "torpedo"\n[known]\n'


def numbers_of(path) -> dict[str, float]:
    return {number.name.removeprefix("vehicle."): number.values[0] for number in contents(str(path)).numbers}


def command_numbers(path):
    """What `speed_command` takes: 0 for a derivative that the file does not have."""
    return lambda key: numbers_of(path).get(key, 0.0)


def made(tmp_path, known: str, more: str = "", base: str = "torpedo") -> Vehicle:
    file = tmp_path / "auv.toml"
    file.write_text(f'base = "{base}"\n[known]\n{known}\n{more}')
    return from_mapping(nested(numbers_of(file)))


def by_geometry(hull: Vehicle) -> dict[str, float]:
    """Numbers that the shape of a hull gives."""
    shape, rho = hull.hull, hull.water.density
    mass = rho * displaced_volume(shape)
    filled = homogeneous_inertia(shape, hull.rigid_body.mass / displaced_volume(shape))
    lateral = lateral_added_mass(shape, rho)
    return {
        "mass": mass,
        "roll_inertia": filled[0],
        "pitch_inertia": filled[1],
        "surge": lamb_factors(shape.length / shape.diameter).k1 * mass,
        "sway": lateral[0],
        "yaw": lateral[2],
    }


def stated(hull: Vehicle) -> dict[str, float]:
    body, added = hull.rigid_body, hull.added_mass
    names = {"mass": body.mass, "roll_inertia": body.roll_inertia, "pitch_inertia": body.pitch_inertia}
    return names | {"surge": added.surge, "sway": added.sway, "yaw": added.yaw}


@pytest.mark.parametrize(
    "known",
    [
        "length_m = 2.0\ndiameter_m = 0.2",
        "length_m = 2.0\ndiameter_m = 0.35",
        "length_m = 2.0\ndiameter_m = 0.2\nmass_kg = 45",
        "length_m = 5.0\ndiameter_m = 0.3\nmass_kg = 300",
        "diameter_m = 0.12",
    ],
)
def test_what_follows_from_the_shape_is_what_the_geometry_formulas_give(tmp_path, known):
    """As many times the formula as in the base: its fins, not in the formula, count to the same share."""
    base = from_mapping(load("fig6").vehicle)
    made_here = made(tmp_path, known)
    share = {name: stated(base)[name] / value for name, value in by_geometry(base).items()}
    for name, value in by_geometry(made_here).items():
        assert stated(made_here)[name] == pytest.approx(share[name] * value, rel=2e-3), name
    assert contradictions(made_here) == []


STRIPS = {
    "linear_damping.sway": (0, 1),
    "linear_damping.yaw": (2, 1),
    "linear_damping.roll": (0, 3),
    "quadratic_damping.sway_per_sway": (0, 1),
    "quadratic_damping.yaw_per_sway": (1, 1),
    "quadratic_damping.sway_per_yaw": (2, 1),
    "quadratic_damping.yaw_per_yaw": (3, 1),
    "quadratic_damping.roll_per_roll": (0, 4),
    "body_lift.sway_per_sway": (0, 1),
    "body_lift.yaw_per_sway": (1, 1),
    "body_lift.yaw_per_yaw": (2, 1),
}
"""Number → n, m of the integral ∫ |x|ⁿ Rᵐ dx along the hull that strip theory gives it (docs/hull.md)."""
PLACES = {"rudder.station": (1, 0), "tow_point.x": (1, 0), "rudder.arm": (0, 1), "rudder.area": (0, 2)}
"""Number → powers of length and diameter."""


def strip(long: float, wide: float, n: int, m: int) -> float:
    x = np.linspace(-0.5 * long, 0.5 * long, 4001)
    R = 0.5 * wide * np.sqrt(np.maximum(1.0 - (2.0 * x / long) ** 2, 0.0))
    return float(np.sum(np.abs(x) ** n * R**m) * (x[1] - x[0]))


def test_damping_lift_and_fins_of_a_longer_and_thinner_hull_follow_strip_theory(tmp_path):
    base = numbers_of("torpedo")
    long, wide = 1.5, 0.8
    sizes = (long * base["hull.length"], wide * base["hull.diameter"])
    made(tmp_path, "length_m = {!r}\ndiameter_m = {!r}".format(*sizes))
    found = numbers_of(tmp_path / "auv.toml")
    for name, (n, m) in STRIPS.items():
        ratio = strip(long, wide, n, m) / strip(1.0, 1.0, n, m)
        assert found[name] == pytest.approx(ratio * base[name], rel=1e-5), name  # six digits are written
    for name, (along, across) in PLACES.items():
        assert found[name] == pytest.approx(long**along * wide**across * base[name], rel=1e-5), name


def test_a_lighter_hull_of_the_same_size_is_leaner_and_displaces_its_weight_and_buoyancy(tmp_path):
    light = made(tmp_path, "length_m = 2.0\ndiameter_m = 0.2\nmass_kg = 45\nnet_buoyancy_N = 20")
    assert light.water.density * displaced_volume(light.hull) == pytest.approx(45.0 + 20.0 / 9.81, rel=1e-3)
    full = made(tmp_path, "length_m = 2.0\ndiameter_m = 0.2")
    assert light.hull.nose_length > full.hull.nose_length
    moved = centre_of_volume(light.hull) - centre_of_volume(full.hull)
    assert light.buoyancy.centre_of_buoyancy_x - full.buoyancy.centre_of_buoyancy_x == pytest.approx(
        moved, rel=1e-2
    )
    assert light.rigid_body.centre_of_gravity_x == light.buoyancy.centre_of_buoyancy_x  # trimmed still


def test_a_speed_is_reached_straight_ahead_at_the_command_that_is_given_for_it(tmp_path):
    """4 %: fins at an angle against the reaction torque of the propeller brake a little more."""
    known = "length_m = 2.0\ndiameter_m = 0.2\nmass_kg = 45\nspeed_m_s = 1.8"
    hull = made(tmp_path, known)
    rps = speed_command(command_numbers(tmp_path / "auv.toml"), 1.8)
    run = free_run(hull, initial_state(velocity=(1.0, 0, 0, 0, 0, 0)), (rps, 0.0, 0.0, 0.0), 60.0)
    assert run.states[-1, 7] == pytest.approx(1.8, rel=0.04)


@pytest.mark.parametrize("propeller", ["", "\npropeller_diameter_m = 0.15"])
def test_a_speed_and_its_command_are_met_by_the_propeller_or_by_the_drag_if_that_is_known(
    tmp_path, propeller
):
    hull = made(tmp_path, f"length_m = 2.0\ndiameter_m = 0.2\nspeed_m_s = 1.5\npropeller_rps = 15{propeller}")
    found = speed_command(command_numbers(tmp_path / "auv.toml"), 1.5)
    assert found == pytest.approx(15.0, rel=1e-4)
    assert (hull.propeller.diameter == 0.15) == bool(propeller)
    assert (hull.axial_drag.drag_coefficient == 0.28) != bool(propeller)


def test_a_number_of_the_file_stands_and_another_base_gives_others(tmp_path):
    own = '[rudder]\narea = { value = 0.01, unit = "m2", source = "measured" }'
    hull = made(tmp_path, "length_m = 1.6", own, base="remus100")
    remus = from_mapping(with_vehicle(load("fig6"), "remus100")[0].vehicle)
    assert hull.rudder.area == 0.01
    assert hull.rudder.lift_slope == remus.rudder.lift_slope
    assert hull.stern_planes.area == pytest.approx(remus.stern_planes.area * (1.6 / 1.33) ** 2, rel=1e-5)


def test_what_is_derived_has_half_of_its_range_as_tolerance_and_what_is_guessed_or_measured_has_none(
    tmp_path,
):
    file = tmp_path / "auv.toml"
    file.write_text(f"{HEAD}length_m = 2.0\nmass_kg = 120")
    trial, source = with_vehicle(load("fig6"), file)
    low, high = ranges_in(source)["added_mass.sway"]
    assert trial.tolerances["vehicle.added_mass.sway"] == pytest.approx(0.5 * (high - low), rel=1e-5)
    assert "vehicle.rigid_body.mass" not in trial.tolerances
    assert "vehicle.rudder_servo.lag" not in trial.tolerances
    origins = {number.name: number.origin for number in contents(str(file)).numbers}
    assert origins["vehicle.rigid_body.mass"] == origins["vehicle.hull.length"] == "measured"
    assert origins["vehicle.added_mass.sway"] == origins["vehicle.tow_point.x"] == "derived"
    assert origins["vehicle.rudder_servo.lag"] == origins["vehicle.axial_drag.drag_coefficient"] == "guessed"


def test_a_trial_takes_such_a_file_and_gives_it_whole_to_a_calibration(tmp_path):
    (tmp_path / "auv.toml").write_text(f"{HEAD}length_m = 2.0\ndiameter_m = 0.2\n")
    text = load("fig6").text.replace('vehicle = "subzero2"', 'vehicle = "auv.toml"')
    (tmp_path / "trial.toml").write_text(text)
    trial = load(tmp_path / "trial.toml")
    whole = tmp_path / "whole.toml"
    whole.write_text(part_file(trial, "vehicle").text)  # a file that says every number itself
    again = from_mapping(nested(numbers_of(whole)))
    assert again == Model.of(trial).vehicle


@pytest.mark.parametrize(
    "text, said",
    [
        ('base = "torpede"', "Did you mean 'torpedo'?"),
        ("base = 3", "we ship no such vehicle"),
        (f"{HEAD}lenght_m = 2.0", "Did you mean 'length_m'?"),
        (f"{HEAD}mass_kg = -1", "mass with everything inside"),
        (f"{HEAD}speed_m_s = 1.8\npropeller_rps = 1", "its drag is"),
        (f"{HEAD}speed_m_s = 1.8\npropeller_rps = 9\npropeller_diameter_m = 0.05", "contradict one another"),
        (f'{HEAD}length_m = 2\n[ruder]\narea = {{ value = 1, unit = "m2" }}', "Did you mean 'rudder.area'?"),
        ('[hull]\nlength = { value = 2.0, unit = "m" }', "111 of the 118 numbers of a vehicle are missing"),
    ],
)
def test_numbers_that_cannot_be_are_one_short_message(tmp_path, text, said):
    file = tmp_path / "auv.toml"
    file.write_text(text)
    with pytest.raises(scenarios.ScenarioError) as caught:
        contents(str(file))
    message = str(caught.value)
    assert said.lower() in message.lower()
    assert message.count("\n") == 1
    assert len(message) < 450


def test_a_copy_of_subzero_with_another_length_and_mass_is_doubted_and_real_vehicles_are_not():
    for name in ("subzero2", "remus100"):
        assert contradictions(from_mapping(with_vehicle(load("fig6"), name)[0].vehicle)) == []
    hull = from_mapping(load("fig6").vehicle)
    typed_in = hull.with_parameter("hull.length", 2.0).with_parameter("rigid_body.mass", 45.0)
    said = " ".join(contradictions(typed_in))
    for word in ("displaces", "shorter hull", "pitch_inertia", "added_mass.sway", "added_mass.yaw"):
        assert word in said
    assert not np.isnan(typed_in.rigid_body.mass)


ROUND = "length_m = 2.0\ndiameter_m = 0.2\nmass_kg = 45.0\nspeed_m_s = 1.8\n"


def test_a_tail_in_x_reaches_the_same_speed_and_turns_as_the_cross(tmp_path):
    """Fins of one shape: the torpedo's rudders and stern-planes are alike."""
    cross = made(tmp_path, ROUND)
    rps = speed_command(command_numbers(tmp_path / "auv.toml"), 1.8)
    turned = made(tmp_path, ROUND + "tail_angle_deg = 45")
    assert speed_command(command_numbers(tmp_path / "auv.toml"), 1.8) == pytest.approx(rps, rel=1e-12)
    assert [name for name, _ in turned.fins] == [
        "lower_starboard",
        "lower_port",
        "upper_port",
        "upper_starboard",
    ]
    assert all(np.hypot(fin.y, fin.z) == pytest.approx(cross.rudder.arm) for _, fin in turned.fins)
    for rudder, planes in ((0.05, 0.0), (0.0, 0.05)):
        ends = []
        for hull in (cross, turned):
            start = initial_state(velocity=(1.8, 0, 0, 0, 0, 0), propeller_speed=rps)
            ends.append(free_run(hull, start, [rps, rudder, planes, planes], 3.0).states[-1])
        component = 12 if rudder else 11  # yaw or pitch rate
        assert ends[1][component] == pytest.approx(ends[0][component], rel=0.02)
        assert ends[0][component] > 0.01


def test_own_numbers_of_a_fin_stand_and_a_vehicle_of_ten_numbers_ships(tmp_path):
    jammed = 'lost_command = { value = 1.0, unit = "1" }\noffset = { value = 0.1, unit = "rad" }'
    hull = made(tmp_path, ROUND + "tail_angle_deg = 45", f"[fins.upper_port]\n{jammed}")
    fins = dict(hull.fins)
    assert fins["upper_port"].lost_command == 1.0 != fins["upper_starboard"].lost_command
    assert fins["upper_port"].offset == 0.1
    shipped = with_vehicle(load("fig6"), "xfin_auv")[0].vehicle
    assert len(shipped["fins"]) == 4
    assert contradictions(from_mapping(shipped)) == []
