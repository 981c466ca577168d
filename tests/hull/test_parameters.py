"""The numbers of Subzero II: from the shape where they say so, in range, with a source; and bad ones are
refused.
"""

import copy
import dataclasses

import numpy as np
import pytest

import vehicle
from vehicle import geometry
from vehicle.geometry import lamb_factors, lateral_added_mass

TIP, CHORD = 0.073, 0.0475
"""Fin tips (tail cone radius 0.0255 m at the fins plus a span of 0.0475 m) and chord (area over span) [m]."""


def fin_added_mass(hull, density, station, chord, tip):
    """Return the parts of a pair of fins in A22 [kg], A26 [kg m], A66 [kg m2], and of four of them in A44 [kg m2].

    A slice of hull radius R with a pair of fins up to the radius a_f moves πρ(a_f² − R² + R⁴/a_f²) sideways
    (Blevins, in Prestero 2001), where the bare hull has πρR²; four fins add (2/π)ρ a_f⁴ about the axis.
    """
    x = station + chord * (np.arange(200) + 0.5) / 200 - 0.5 * chord
    R2 = geometry.hull_radius(hull, x) ** 2
    strip = np.pi * density * (tip**2 - 2.0 * R2 + R2**2 / tip**2) * chord / 200
    roll = 2.0 / np.pi * density * tip**4 * chord
    return float(np.sum(strip)), float(np.sum(x * strip)), float(np.sum(x**2 * strip)), roll


def whicker_fehlner(aspect_ratio):
    """Lift slope of an unswept fin [1/rad] (Whicker and Fehlner, DTMB 933)."""
    return 1.8 * np.pi * aspect_ratio / (np.sqrt(aspect_ratio**2 + 4.0) + 1.8)


def from_shape(hull):
    """Every number of the file that calls itself a geometry formula."""
    rho = 1000.0
    A22, _, A66 = lateral_added_mass(hull, rho)
    fin22, _, fin66, fin44 = fin_added_mass(hull, rho, -0.42, CHORD, TIP)
    mass = rho * geometry.displaced_volume(hull)
    roll, pitch = geometry.homogeneous_inertia(hull, rho)
    return {
        "rigid_body.mass": mass,
        "rigid_body.roll_inertia": roll,
        "rigid_body.pitch_inertia": pitch,
        "rigid_body.yaw_inertia": pitch,
        "added_mass.surge": lamb_factors(hull.length / hull.diameter).k1 * mass,
        "added_mass.sway": A22 + fin22,
        "added_mass.heave": A22 + fin22,
        "added_mass.roll": fin44,
        "added_mass.pitch": A66 + fin66,
        "added_mass.yaw": A66 + fin66,
    }


def test_every_value_that_says_geometry_formula_is_made_by_it(entries, subzero2):
    """Three printed digits: within half a percent."""
    claimed = {
        f"{section}.{key}": entry["value"]
        for section, keys in entries.items()
        for key, entry in keys.items()
        if entry["source"].startswith("geometry formula")
    }
    assert claimed == pytest.approx(from_shape(subzero2.hull), rel=5e-3)


def test_lamb_factors_of_a_spheroid_of_ten_diameters():
    """Lamb (1932): k1 0.0207, k2 0.960, k' 0.884 (hull_parameters 5.1)."""
    assert lamb_factors(10.0) == pytest.approx((0.0207, 0.960, 0.884), rel=1e-3)


def test_lamb_factors_of_a_near_sphere_are_one_half():
    assert lamb_factors(1.005)[:2] == pytest.approx((0.5, 0.5), abs=0.01)


@pytest.mark.parametrize(
    "nose,tail,angle_deg,litres,centre",
    [(0.12, 0.25, 20, 6.59, 0.039), (0.10, 0.20, 25, 6.84, 0.031)],
)
def test_the_hull_has_the_tabled_volume_and_centre(subzero2, nose, tail, angle_deg, litres, centre):
    """hull_parameters 5.1, to the last digit printed there."""
    angle = np.radians(angle_deg)
    hull = dataclasses.replace(subzero2.hull, nose_length=nose, tail_length=tail, tail_angle=angle)
    assert geometry.displaced_volume(hull) * 1e3 == pytest.approx(litres, rel=0.005)
    assert geometry.centre_of_volume(hull) == pytest.approx(centre, abs=0.002)


def test_a_cylinder_is_a_cylinder(subzero2):
    hull = dataclasses.replace(subzero2.hull, nose_length=1e-6, tail_length=1e-6)
    assert geometry.displaced_volume(hull) == pytest.approx(np.pi * 0.05**2, rel=1e-3)
    assert geometry.homogeneous_inertia(hull, 1000.0)[1] == pytest.approx(
        1000 * np.pi * 0.05**2 * (0.05**2 / 4 + 1 / 12), rel=1e-3
    )


def test_the_lift_slope_lies_between_two_formulas(subzero2):
    """Whicker and Fehlner below, Prestero's above (hull_parameters 5.3: 2.44 and 2.98)."""
    aspect = subzero2.rudder.aspect_ratio
    assert whicker_fehlner(aspect) == pytest.approx(2.44, abs=0.01)
    above = 1 / (1 / (1.8 * np.pi) + 1 / (np.pi * aspect))
    assert whicker_fehlner(aspect) < subzero2.rudder.lift_slope < above


def test_every_value_has_its_unit_a_range_around_it_and_a_source(entries):
    for section, kind in vehicle.SECTIONS.items():
        for field in dataclasses.fields(kind):
            entry = entries[section][field.name]
            where = f"{section}.{field.name}"
            assert set(entry) - {"limits"} == {"value", "unit", "range", "source"}, where
            assert entry["unit"] == field.metadata["unit"], where
            low, high = entry["range"]
            assert low <= entry["value"] <= high, where
            assert field.metadata["low"] <= low, where
            assert high <= field.metadata["high"], where
            assert entry["source"].startswith(("paper", "geometry formula: ", "estimate: ")), where


def test_mappings_return(subzero2, mapping):
    assert vehicle.to_mapping(subzero2) == mapping


def test_numbers_do_not_depend_on_when_they_are_made(subzero2):
    a, b = subzero2.numbers(), subzero2.numbers()
    assert np.array_equal(a.inverse_mass, b.inverse_mass)
    assert np.array_equal(a.strips, b.strips)


def test_all_mistakes_of_a_vehicle_are_told_at_once(mapping):
    bad = copy.deepcopy(mapping)
    bad["rigid_body"]["mass"] = -1.0
    bad["hull"]["lenght"] = bad["hull"].pop("length")
    bad["propeller"]["diameter"] = "six"
    bad["motor"]["lag"] = float("nan")
    bad["ruder"] = bad.pop("rudder")
    with pytest.raises(vehicle.VehicleError) as caught:
        vehicle.from_mapping(bad)
    reported = {problem.key: problem for problem in caught.value.problems}
    assert set(reported) == {
        "rigid_body.mass", "hull.lenght", "hull.length", "propeller.diameter", "motor.lag", "ruder", "rudder",
    }  # fmt: skip
    assert reported["hull.lenght"].allowed == "did you mean 'length'"
    assert reported["ruder"].allowed == "did you mean 'rudder'"
    assert reported["rigid_body.mass"].allowed == "a number above 0 [kg]"
    assert "not a number" in reported["propeller.diameter"].why
    assert reported["motor.lag"].found == "nan"
    assert "NaN is not a number" in reported["motor.lag"].why
    assert str(caught.value).count("\n") == 6


@pytest.mark.parametrize(
    "key,value", [("hull.diameter", 0.0), ("added_mass.sway_yaw", 5.0), ("hull.tail_length", 0.95)]
)
def test_impossible_vehicles_are_refused(subzero2, key, value):
    with pytest.raises(vehicle.VehicleError) as caught:
        subzero2.with_parameter(key, value)
    assert key in str(caught.value)


def test_true_is_not_a_number(subzero2):
    with pytest.raises(vehicle.VehicleError):
        subzero2.with_parameter("motor.lag", True)
