"""Products of velocities, angles, shaft speed and race in a table of derivatives: sizes by hand, and signs in words.

Verifies: each kind of product against its formula, the term that it is booked with, primed derivatives against their
dimensional forms (SNAME), mirror symmetry, the cross-flow drag of sections, products of inertia, a complete table.
Configuration: an open frame on which nothing else acts. Tolerance: rounding (1e-12), but where it is said.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.files import read_toml, shipped_path
from scenarios.parts import nested, part_of
from subzero.derivative_names import complaint, parsed
from vehicle import (
    BREAKDOWN,
    VehicleError,
    breakdown_table,
    derivative,
    from_mapping,
    initial_state,
    to_mapping,
)
from vehicle.derivatives import factor_names
from vehicle.products import TERMS, race_excess

FRAME = nested(part_of(read_toml(shipped_path("vehicles", "open_frame"), "open_frame"), "vehicle")[0].values)
NU = (1.5, -0.3, 0.2, 0.4, -0.5, 0.6)
ANGLES = (0.1, -0.2, 0.15)
RPS = 7.0
RHO, LENGTH = 1025.0, 0.5
RACE = {"advance": 0.3, "thrust_loading": 0.8}


def hull(table, **more):
    """Return the open frame with a table of derivatives, and fins that follow their commands at once."""
    servos = ("rudder_servo", "stern_plane_port_servo", "stern_plane_starboard_servo")
    free = {name: FRAME[name] | {"deflection_limit": 1.0} for name in servos}
    return from_mapping(FRAME | free | {"derivatives": table, "race": RACE} | more)


def forces(table, nu=NU, angles=ANGLES, rps=RPS, **more):
    """Return the forces of a table by term, at velocities [m/s, rad/s], angles [rad] and shaft speed [rev/s]."""
    state = initial_state(velocity=nu)
    state[13], state[14:17], state[18:21] = rps, angles, angles
    return breakdown_table(hull(table, **more), state, (rps, *angles))


def eta():
    return RACE["advance"] * RPS / NU[0]


def excess():
    return (np.sqrt(1 + 0.8 * eta() ** 2) - 1) / (np.sqrt(1.8) - 1) - 1


U, V, W, P, Q, R = NU
SPEED = np.sqrt(U**2 + V**2 + W**2)
CASES = {
    "Y_uv": (1, U * V, "quadratic_damping"),
    "Y_ur": (1, U * R, "quadratic_damping"),
    "N_vr": (5, V * R, "quadratic_damping"),
    "K_pq": (3, P * Q, "quadratic_damping"),
    "X_qq": (0, Q * abs(Q), "quadratic_damping"),
    "X_q2": (0, Q * Q, "quadratic_damping"),
    "Y_v|r|": (1, V * abs(R), "quadratic_damping"),
    "Z_Uw": (2, SPEED * W, "quadratic_damping"),
    "M_uwq": (4, U * W * Q, "quadratic_damping"),
    "Y_uu_rudder": (1, U * abs(U) * 0.1, "rudder"),
    "Z_uu_stern_plane_port": (2, U * abs(U) * -0.2, "stern_plane_port"),
    "X_uq_stern_plane_starboard": (0, U * Q * 0.15, "stern_plane_starboard"),
    "X_uu_rudder2": (0, U * abs(U) * 0.01, "rudder"),
    "K_uu_|stern_plane_port|": (3, U * abs(U) * 0.2, "stern_plane_port"),
    "X_nn": (0, RPS * abs(RPS), "propeller"),
    "X_n|n|": (0, RPS * abs(RPS), "propeller"),
    "X_nu": (0, RPS * U, "propeller"),
    "Z_uq_race": (2, U * Q * excess(), "propeller"),
    "M_uu_stern_plane_port_race": (4, U * abs(U) * -0.2 * excess(), "stern_plane_port"),
    "Y_rudder": (1, 0.1, "rudder"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_product_is_its_coefficient_times_its_factors(name):
    axis, factor, term = CASES[name]
    value = -3.0
    found = forces({name: value})
    expected = np.zeros(6)
    expected[axis] = value * factor
    np.testing.assert_allclose(found[term], expected, rtol=1e-12)
    others = [key for key in found if key not in (term, "rigid_body_coriolis", "restoring")]
    assert not any(found[key].any() for key in others)


SIGNS = [
    (
        "Y_uv",
        -1.0,
        {"v": 1.0},
        1,
        -1,
        "a hull that drifts to starboard while it goes ahead is pushed to port",
    ),
    ("N_ur", -1.0, {"r": 1.0}, 5, -1, "a turn to starboard is braked while the hull goes ahead"),
    ("N_uu_rudder", 1.0, {"rudder": 0.1}, 5, 1, "a positive rudder turns the nose to starboard"),
    ("M_uu_stern_plane_port", 1.0, {"port": 0.1}, 4, 1, "a positive stern-plane raises the nose"),
    ("X_uu_rudder2", -1.0, {"rudder": -0.1}, 0, -1, "a rudder to either side brakes"),
    ("X_v2", -1.0, {"v": -1.0}, 0, -1, "a drift to either side brakes"),
]


@pytest.mark.parametrize("name, value, motion, axis, sign, words", SIGNS, ids=[row[-1] for row in SIGNS])
def test_signs(name, value, motion, axis, sign, words):
    del words
    nu = np.array([1.0, *(motion.get(letter, 0.0) for letter in "vwpqr")])
    angles = tuple(motion.get(fin, 0.0) for fin in ("rudder", "port", "starboard"))
    total = sum(
        force for key, force in forces({name: value}, nu, angles, 0.0).items() if "coriolis" not in key
    )
    assert np.sign(total[axis]) == sign


PRIMED = {
    # name' → the same in SI: its name, and what a primed value is times, from ½ρL² of a force
    "Y_v": ("Y_Uv", 0), "Y_r": ("Y_Ur", 1), "N_v": ("N_Uv", 1), "N_r": ("N_Ur", 2), "K_p": ("K_Up", 2),
    "Y_uv": ("Y_uv", 0), "Y_ur": ("Y_ur", 1), "M_uq": ("M_uq", 2), "K_pq": ("K_pq", 3), "X_q2": ("X_q2", 2),
    "X_uu": ("X_uu", 0), "N_rr": ("N_rr", 3), "Y_uu_rudder": ("Y_uu_rudder", 0), "X_nn": ("X_nn", 2),
    "N_uu_rudder": ("N_uu_rudder", 1), "Z_uq_race": ("Z_uq_race", 1), "X_udot": ("X_udot", 1), "N_rdot": ("N_rdot", 3),
    "Y_rdot": ("Y_rdot", 2),
}  # fmt: skip


@pytest.mark.parametrize("name", PRIMED)
def test_a_primed_derivative_is_its_dimensional_one(name):
    same, lengths = PRIMED[name]
    scale = 0.5 * RHO * LENGTH ** (2 + lengths)
    mirrors = {"Y_rdot": "N_vdot"}
    primed, plain = {f"{name}'": -0.02}, {same: -0.02 * scale}
    if name in mirrors:  # with masses that make it a mass matrix
        primed |= {f"{mirrors[name]}'": -0.02, "Y_vdot'": -0.1, "N_rdot'": -0.1}
        plain |= {
            mirrors[name]: -0.02 * scale,
            "Y_vdot": -0.05 * RHO * LENGTH**3,
            "N_rdot": -0.05 * RHO * LENGTH**5,
        }
    numbers = [hull(table).numbers() for table in (primed, plain)]
    np.testing.assert_allclose(numbers[0].mass_matrix, numbers[1].mass_matrix, rtol=1e-12)
    for one, other in zip(forces(primed).values(), forces(plain).values(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_a_primed_linear_derivative_grows_with_the_speed_and_a_primed_force_with_its_square():
    slow, fast = (forces({"Y_v'": -0.1, "N_rudder'": 0.01}, scale * np.array(NU)) for scale in (1.0, 2.0))
    np.testing.assert_allclose(fast["quadratic_damping"], 4.0 * slow["quadratic_damping"])
    np.testing.assert_allclose(fast["rudder"], 4.0 * slow["rudder"])
    assert slow["quadratic_damping"][1] == pytest.approx(0.5 * RHO * LENGTH**2 * -0.1 * SPEED * V)


def test_a_mirrored_motion_has_mirrored_forces():
    """Port and starboard exchanged: sway, roll and yaw, the rudder and the two planes change sides."""
    table = {
        "X_vr": 2.0,
        "X_w2": 1.0,
        "Y_ur": 3.0,
        "Y_v|r|": -4.0,
        "Z_uq": -2.0,
        "Z_v2": 1.5,
        "K_uv": 0.7,
        "N_v|v|": 2.0,
    }
    table |= {"M_pr": 0.4, "N_uu_rudder": -5.0, "X_uu_rudder2": -1.0}
    for side in ("port", "starboard"):
        table |= {f"Z_uu_stern_plane_{side}": -3.0, f"X_uq_stern_plane_{side}_race": 0.4}
    flip = np.array([1, -1, 1, -1, 1, -1])
    one = sum(forces(table).values())
    other = sum(forces(table, flip * NU, (-ANGLES[0], ANGLES[2], ANGLES[1])).values())
    np.testing.assert_allclose(other, flip * one, rtol=1e-12, atol=1e-12)


def test_the_race_is_none_in_self_propulsion_minus_one_without_a_propeller_and_finite_at_rest():
    numbers = hull({}).numbers().race
    assert race_excess(1.0 / 0.3, 1.0, numbers) == pytest.approx(0.0, abs=1e-15)
    assert race_excess(0.0, 1.0, numbers) == race_excess(0.0, -1.0, numbers) == -1.0
    assert (
        race_excess(2.0 / 0.3, 1.0, numbers) > 0.0
    )  # it speeds up the stern of a hull that the propeller pushes hard
    assert all(np.isfinite(force).all() for force in forces({"Z_uq_race": -1.0}, np.zeros(6)).values())


def test_sections_of_a_round_width_have_the_drag_of_the_cross_flow_of_a_cylinder():
    """½ρ C d ∫ |V| V dx of a box of 0.5 m, by 20 000 slices; 20 strips miss 0.32 %."""
    section = {
        "breadth": 0.1,
        "height": 0.1,
        "lateral_drag_coefficient": 1.1,
        "vertical_drag_coefficient": 1.1,
    }
    rows = {"stern": section | {"x": -0.25}, "bow": section | {"x": 0.25}}
    found = forces({}, sections=rows)["cross_flow_drag"]
    x = (np.arange(20_000) + 0.5) / 40_000 - 0.25
    across = np.array([V + x * R, W - x * Q])
    dF = -0.5 * RHO * 1.1 * 0.1 * np.hypot(*across) * across * 0.5 / 20_000
    expected = [0, dF[0].sum(), dF[1].sum(), 0, -(x * dF[1]).sum(), (x * dF[0]).sum()]
    np.testing.assert_allclose(found, expected, rtol=3.5e-3, atol=1e-9)


def test_a_box_feels_the_side_by_its_height_and_the_bottom_by_its_breadth_and_is_braked():
    section = {
        "breadth": 0.3,
        "height": 0.1,
        "lateral_drag_coefficient": 0.5,
        "vertical_drag_coefficient": 0.6,
    }
    rows = {"stern": section | {"x": -0.25}, "bow": section | {"x": 0.25}}
    side = forces({}, (0, 2.0, 0, 0, 0, 0), sections=rows)["cross_flow_drag"]
    below = forces({}, (0, 0, 2.0, 0, 0, 0), sections=rows)["cross_flow_drag"]
    assert side[1] == pytest.approx(-0.5 * RHO * 0.5 * 0.1 * 0.5 * 4.0)
    assert below[2] == pytest.approx(-0.5 * RHO * 0.6 * 0.3 * 0.5 * 4.0)
    for nu in np.random.default_rng(4).normal(size=(20, 6)):
        assert forces({}, nu, sections=rows)["cross_flow_drag"] @ nu < 0.0


def test_a_body_with_products_of_inertia_turns_as_eulers_equations_say():
    """I ω' = −ω × I ω, about the centre of gravity."""
    body = FRAME["rigid_body"]
    inertia = np.diag([body[f"{axis}_inertia"] for axis in ("roll", "pitch", "yaw")])
    inertia += np.array([[0, -0.1, -0.05], [-0.1, 0, -0.02], [-0.05, -0.02, 0]])
    turning = hull({}, products_of_inertia={"xy": 0.1, "xz": 0.05, "yz": 0.02})
    omega, rates = np.array(NU[3:]), np.empty(21)
    derivative(
        initial_state(velocity=(0, 0, 0, *omega)),
        np.zeros(4),
        np.zeros(3),
        np.zeros(6),
        turning.numbers(),
        rates,
    )
    np.testing.assert_allclose(
        rates[10:13], np.linalg.solve(inertia, -np.cross(omega, inertia @ omega)), rtol=1e-12
    )
    with pytest.raises(VehicleError, match="the inertia would be negative"):
        hull({}, products_of_inertia={"xy": 5.0, "xz": 0.0, "yz": 0.0})


def test_a_complete_table_leaves_the_coriolis_forces_of_added_mass_to_its_products():
    table = {"X_udot": -3.0, "Y_vdot": -20.0}
    own, complete = forces(table), forces(table | {"complete": 1.0})
    assert own["added_mass_coriolis"][0] == pytest.approx(
        20.0 * V * R
    )  # A22 v r pushes a drifting, turning hull ahead
    assert not complete["added_mass_coriolis"].any()
    said = forces(table | {"complete": 1.0, "X_vr": 20.0, "Y_ur": -3.0, "N_uv": -17.0})
    ours = own["added_mass_coriolis"]
    np.testing.assert_allclose(said["quadratic_damping"][[0, 5]], [ours[0], ours[5]], rtol=1e-12)
    np.testing.assert_allclose(
        hull(table).numbers().mass_matrix, hull(table | {"complete": 1.0}).numbers().mass_matrix
    )


@pytest.mark.parametrize(
    "table, said",
    [
        ({"Y_uu_ruder": 1.0}, "no factor is called 'ruder'. Allowed: Y_uu_rudder; "),
        ({"Y_uvw'": 1.0}, "has at most two velocities"),
        ({"Y_v'": -1.0, "Y_v": -1.0}, "the same derivative stands there with a unit"),
        ({"Y_v'": 1.0}, "it would drive the hull"),
        ({"complete": 0.5}, "0 or 1"),
        ({f"Y_{a}{b}{c}": 1.0 for a in "uvwpqr" for b in "uvwpqr" for c in "uvwpqr" if len({a, b, c}) > 1},
         "more than the compiled equations hold"),
    ],
)  # fmt: skip
def test_tables_that_cannot_be_are_refused_in_one_message(table, said):
    with pytest.raises(VehicleError) as caught:
        hull(table).numbers()
    assert said in str(caught.value)
    assert len(caught.value.problems) == 1


def test_a_race_that_nobody_described_is_refused():
    numbers = {
        name: section for name, section in to_mapping(hull({"Z_uq_race": 1.0})).items() if name != "race"
    }
    with pytest.raises(VehicleError, match=r"\[race\] with advance and thrust_loading"):
        from_mapping(numbers)


FIN = dict.fromkeys(("area", "lift_slope", "profile_drag_coefficient", "normal_force_coefficient"), 0.0)
FIN |= dict.fromkeys(("aspect_ratio", "span_efficiency", "stall_angle", "rate_limit"), 1.0)
FIN |= dict.fromkeys(("x", "y", "z", "span_angle", "rudder_share", "plane_share", "roll_share"), 0.0)
FIN |= {"lag": 0.1, "offset": 0.0, "deflection_limit": 0.5, "lost_command": 0.0}


def test_the_angle_of_a_listed_fin_is_a_factor_by_its_name():
    """Two bow planes without lift of their own: what they do stands in the table."""
    fins = {"bow_port": FIN, "bow_starboard": FIN}
    bows = hull({"Z_uu_bow_port": -4.0, "M_uu_bow_starboard": 3.0, "X_uu_bow_port2": -1.0}, fins=fins)
    state = np.append(initial_state(velocity=NU), (0.2, -0.9))
    found = breakdown_table(bows, state, np.zeros(6))["rudder"]
    expected = (
        np.array([-1.0 * 0.2**2, 0, -4.0 * 0.2, 0, 3.0 * -0.5, 0]) * U * abs(U)
    )  # the second is at its limit
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    with pytest.raises(VehicleError, match=r"no factor is called 'bow_left'\. Allowed: Z_uu_bow_"):
        hull({"Z_uu_bow_left": -4.0}, fins=fins)
    with pytest.raises(VehicleError, match="this vehicle has no fin of this name"):
        replace(bows, fins=bows.fins[1:])


UNITS = {"X_u": "kg/s", "X_uu": "kg/m", "X_udot": "kg", "Y_rdot": "kg m", "K_pp": "kg m2", "N_ur": "kg m",
         "X_nn": "kg m", "Y_uu_rudder": "kg/m", "N_rudder": "N m", "M_uwq": "kg s", "Y_uvw": "kg s/m2", "X_n": "kg m/s",
         "Y_v'": "1", "N_rdot'": "1"}  # fmt: skip


@pytest.mark.parametrize("name", UNITS)
def test_the_unit_of_a_derivative_follows_from_its_name(name):
    found = parsed(name, factor_names())
    assert found is not None
    assert found.unit == UNITS[name]


def test_a_fin_of_a_name_that_begins_with_another_is_that_fin():
    fins = factor_names(("plane", "plane_bow", "plane2"))
    assert parsed("Z_uu_plane_bow", fins).factors == ("u", "|u|", "plane_bow")
    assert parsed("Z_uu_plane2", fins).factors == ("u", "|u|", "plane2")
    assert parsed("Z_uu_plane_race", fins).factors == ("u", "|u|", "plane", "race")
    assert complaint("Z_uu_bow", fins)[0] == "no factor is called 'bow'"


FILE = """
base = "open_frame"
[race]
advance = { value = 0.3, unit = "m" }
thrust_loading = { value = 0.8, unit = "1" }
[sections.bow]
x = { value = 0.25, unit = "m" }
breadth = { value = 0.3, unit = "m" }
height = { value = 0.2, unit = "m" }
lateral_drag_coefficient = { value = 0.5, unit = "1" }
vertical_drag_coefficient = { value = 0.6, unit = "1" }
[sections.stern]
x = { value = -0.25, unit = "m" }
breadth = { value = 0.3, unit = "m" }
height = { value = 0.2, unit = "m" }
lateral_drag_coefficient = { value = 0.5, unit = "1" }
vertical_drag_coefficient = { value = 0.6, unit = "1" }
[derivatives]
complete = { value = 1, unit = "1" }
Y_v = { value = -0.1, unit = "1" }
Y_uv = { value = -2.0, unit = "kg/m" }
"N_v|r|" = { value = -2.0, unit = "kg m" }
N_uu_rudder = { value = -1.3e-2, unit = "1" }
Z_uq_race = { value = -2.9e-3, unit = "1" }
"""


def read(text, tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(text)
    return part_of(read_toml(path, "own.toml"), "vehicle")


def test_a_file_says_what_is_primed_by_its_unit(tmp_path):
    part, problems = read(FILE, tmp_path)
    assert problems == []
    table = dict(from_mapping(nested(part.values)).derivatives.table)
    assert table == {
        "complete": 1.0,
        "Y_v'": -0.1,
        "Y_uv": -2.0,
        "N_v|r|": -2.0,
        "N_uu_rudder'": -0.013,
        "Z_uq_race'": -0.0029,
    }


@pytest.mark.parametrize(
    "change, said",
    [
        (("N_uu_rudder", "N_uu_ruder"), "no factor is called 'ruder'. Allowed: N_uu_rudder; "),
        (("Y_uv =", "Y_ux ="), "no such derivative. Allowed: a name such as X_u"),
        (('"kg m"', '"kg"'), 'Allowed: unit = "kg m"'),
        (("height = { value = 0.2", "hight = { value = 0.2"), "Did you mean 'sections.bow.height'?"),
        (("advance = ", "advanced = "), "Did you mean 'race.advance'?"),
    ],
)
def test_a_file_that_cannot_be_is_refused_with_the_line_and_the_nearest_name(change, said, tmp_path):
    _, problems = read(FILE.replace(*change, 1), tmp_path)
    assert any(
        said.replace("'ruder'. Allowed: N_uu_rudder'", "'ruder'. Allowed: N_uu_rudder") in str(each)
        for each in problems
    )
    assert all("line " in str(each) for each in problems)


def test_products_are_booked_with_the_terms_of_these_names():
    assert {name: BREAKDOWN.index(name) for name in TERMS} == TERMS
