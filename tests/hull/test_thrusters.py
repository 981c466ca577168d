"""Thrusters, their allocation, and hulls stated by derivatives.

Verifies: signs in words and moments as r × F; the steady speed of a BlueROV2 in closed form; the allocation against a
minimum-norm problem solved otherwise, and at its limits; that REMUS 100's damping and added mass, written as a table of
derivatives, give its trajectories again (1e-9: sums in another order).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import subzero
from scenarios.parameters import with_vehicle
from vehicle import Vehicle, VehicleError, breakdown_table, free_run, from_mapping, initial_state, to_mapping
from vehicle.derivatives import Derivatives, place_of
from vehicle.thrusters import Thruster, allocation, commands_of_wrench, table_of, unheld_axes


def shipped(name: str) -> Vehicle:
    return from_mapping(with_vehicle(subzero.load_scenario("fig6"), name)[0].vehicle)


ROV = shipped("bluerov2_heavy")
NAMES = [name for name, _ in ROV.thrusters]


def pushed(**commands: float) -> np.ndarray:
    """The wrench of the thrusters, after their lag, at rest."""
    state = np.concatenate([initial_state(), [commands.get(name, 0.0) for name in NAMES]])
    return breakdown_table(ROV, state, np.zeros(4 + len(NAMES)))["propeller"]


def test_each_thruster_pushes_where_it_points_and_turns_about_its_arm():
    for name, thruster in ROV.thrusters:
        wrench = pushed(**{name: 1.0})
        force = thruster.thrust_ahead * thruster.direction
        np.testing.assert_allclose(wrench[:3], force, atol=1e-12)
        np.testing.assert_allclose(
            wrench[3:], np.cross([thruster.x, thruster.y, thruster.z], force), atol=1e-12
        )
        np.testing.assert_allclose(pushed(**{name: -1.0}), -wrench, atol=1e-12)  # as strong astern


def test_signs_in_words():
    ahead = pushed(front_starboard=1.0, front_port=1.0, aft_starboard=-1.0, aft_port=-1.0)
    assert ahead[0] > 80.0
    np.testing.assert_allclose(ahead[[1, 2, 3, 5]], 0.0, atol=1e-12)
    up = pushed(**{name: 0.5 for name in NAMES if name.startswith("vertical")})
    assert up[2] < -40.0
    starboard_up = pushed(vertical_front_starboard=1.0, vertical_aft_starboard=1.0)
    assert starboard_up[3] < 0.0  # the port side goes down
    assert pushed(front_port=1.0, aft_starboard=1.0)[5] > 0.0  # the nose goes to starboard


def test_a_dead_band_a_lag_and_an_inflow_take_what_they_say():
    row = {"x": 0.0, "y": 0.0, "z": 0.0, "direction_x": 2.0, "direction_y": 0.0, "direction_z": 0.0}
    row |= {"thrust_ahead": 50.0, "thrust_astern": 40.0, "curve_exponent": 2.0, "dead_band": 0.1}
    row |= {"loss_per_inflow": 10.0, "reaction_arm": 0.02, "lag": 0.5, "lost_command": 0.0}
    one = replace(ROV, thrusters=(("t", Thruster(**row)),))

    def force(share: float, speed: float = 0.0) -> np.ndarray:
        state = np.append(initial_state(velocity=(speed, 0, 0, 0, 0, 0)), share)
        return breakdown_table(one, state, np.zeros(5))["propeller"]

    assert not force(0.1).any()
    assert force(1.0)[0] == pytest.approx(50.0)  # the direction is a unit vector, however long it was written
    assert force(0.55)[0] == pytest.approx(12.5)
    assert force(-1.0)[0] == pytest.approx(-40.0)
    assert force(1.0, 2.0)[0] == pytest.approx(30.0)
    assert force(1.0)[3] == pytest.approx(1.0)
    held = free_run(one, initial_state(), (0.0, 0.0, 0.0, 0.0, 1.0), 1.0, 0.01)
    assert held.states[-1, 21] == pytest.approx(1.0 - np.exp(-2.0), rel=1e-6)


def test_full_ahead_a_bluerov2_goes_as_fast_as_its_published_damping_allows():
    """141 u² + 13.7 u = 4 · 30.4 N cos 45°."""
    neutral = replace(ROV, buoyancy=replace(ROV.buoyancy, net_buoyancy=0.0, centre_of_buoyancy_z=-1.0))
    level = [(name, replace(thruster, z=0.0)) for name, thruster in neutral.thrusters]
    run = free_run(
        replace(neutral, thrusters=tuple(level)),
        initial_state(),
        (0, 0, 0, 0, 1, 1, -1, -1, 0, 0, 0, 0),
        30.0,
    )
    thrust = 4.0 * 30.4 / np.sqrt(2.0)
    speed = (-13.7 + np.sqrt(13.7**2 + 4.0 * 141.0 * thrust)) / (2.0 * 141.0)
    assert run.states[-1, 7] == pytest.approx(speed, rel=1e-6)


def test_an_allocation_makes_the_wrench_with_the_least_weighted_thrust():
    """Against Lagrange's conditions, solved as one linear system; weights unlike on purpose."""
    weak = [replace(t, thrust_ahead=10.0 + i, thrust_astern=12.0) for i, t in enumerate(ROV.thruster_list)]
    B = np.column_stack([thruster.wrench for thruster in weak])
    weight = np.diag([1.0 / min(t.thrust_ahead, t.thrust_astern) ** 2 for t in weak])
    conditions = np.block([[weight, B.T], [B, np.zeros((6, 6))]])
    for wrench in np.random.default_rng(57).normal(size=(5, 6)):
        best = np.linalg.solve(conditions, np.concatenate([np.zeros(8), wrench]))[:8]
        np.testing.assert_allclose(allocation(tuple(weak)) @ wrench, best, rtol=1e-9, atol=1e-12)


def test_a_wrench_beyond_the_limits_keeps_its_direction():
    table, allocate = table_of(ROV.thruster_list), allocation(ROV.thruster_list)
    asked, command = np.array([300.0, 100.0, -50.0, 0.0, 0.0, 5.0]), np.zeros(12)
    share = commands_of_wrench(asked, allocate, table, 8, command)
    assert 0.0 < share < 1.0
    assert abs(command).max() == pytest.approx(1.0)
    made = pushed(**dict(zip(NAMES, command[4:], strict=True)))
    np.testing.assert_allclose(made, share * asked, atol=1e-9 * abs(asked).max())


def test_axes_that_thrusters_cannot_push_along_are_named():
    by_name = dict(ROV.thrusters)
    assert unheld_axes(ROV.thruster_list, ("surge", "sway", "heave", "roll", "pitch", "yaw")) == []
    flat = tuple(by_name[name] for name in NAMES if not name.startswith("vertical"))
    assert unheld_axes(flat, ("surge", "sway", "heave", "yaw")) == [
        "surge",
        "sway",
        "heave",
    ]  # they pitch and roll, too
    assert unheld_axes((), ("surge", "yaw")) == ["surge", "yaw"]


def test_a_table_of_derivatives_in_and_the_shipped_remus_out():
    remus = shipped("remus100")
    numbers = to_mapping(remus)
    added, linear, square = (numbers[name] for name in ("added_mass", "linear_damping", "quadratic_damping"))
    axes = dict(
        zip(
            ("surge", "sway", "heave", "roll", "pitch", "yaw"),
            zip("XYZKMN", "uvwpqr", strict=True),
            strict=True,
        )
    )
    table = {f"{F}_{s}dot": -added[axis] for axis, (F, s) in axes.items()}
    table |= {f"{F}_{s}": linear[axis] for axis, (F, s) in axes.items()}
    table |= {f"{F}_{s}dot": -added["sway_yaw"] for F, s in ("Yr", "Nv")}
    table |= {f"{F}_{s}dot": -added["heave_pitch"] for F, s in ("Zq", "Mw")}
    by_name = {
        "Y_vv": "sway_per_sway",
        "Y_r|r|": "sway_per_yaw",
        "N_vv": "yaw_per_sway",
        "N_rr": "yaw_per_yaw",
    }
    by_name |= {"Z_ww": "heave_per_heave", "Z_qq": "heave_per_pitch", "M_ww": "pitch_per_heave"}
    by_name |= {"M_qq": "pitch_per_pitch", "K_pp": "roll_per_roll"}
    table |= {name: square[key] for name, key in by_name.items()}
    bare = numbers | {"derivatives": table}
    for name in ("linear_damping", "quadratic_damping"):
        bare[name] = dict.fromkeys(numbers[name], 0.0)
    bare["added_mass"] = dict.fromkeys(added, 0.0) | {"munk_factor": 1.0}
    start, command = initial_state(velocity=(1.5, 0, 0, 0, 0, 0)), (20.0, 0.1, 0.05, 0.02)
    runs = [free_run(from_mapping(each), start, command, 30.0).states for each in (numbers, bare)]
    np.testing.assert_allclose(runs[1], runs[0], rtol=1e-9, atol=1e-9)
    assert to_mapping(from_mapping(bare))["derivatives"]["Y_rr"] == square["sway_per_yaw"]


@pytest.mark.parametrize(
    "table, said",
    [
        ((("X_a", -1.0),), "no such derivative"),
        ((("X_uuu", -1.0),), "no such derivative"),
        ((("X_u", 1.0),), "it would drive the hull"),
        ((("X_u", "much"),), "not a finite number"),
        ((("Y_rdot", 1.0),), "added mass is symmetric"),
    ],
)
def test_derivatives_that_cannot_be_are_refused(table, said):
    with pytest.raises(VehicleError, match=said):
        Derivatives(table)


def test_names_of_derivatives():
    assert place_of("X_u") == ("linear", 0, 0)
    assert place_of("N_v|v|") == place_of("N_vv") == ("quadratic", 5, 1)
    assert place_of("M_wdot") == ("added_mass", 4, 2)
    assert place_of("X_uw") is None  # of no matrix: a product


def test_a_thruster_without_direction_and_too_many_of_them_are_refused():
    numbers = to_mapping(ROV)
    still = dict(numbers["thrusters"]["aft_port"], direction_x=0.0, direction_y=0.0)
    with pytest.raises(VehicleError, match="it pushes nowhere"):
        from_mapping(numbers | {"thrusters": {"t": still}})
    many = {f"t{i}": numbers["thrusters"]["aft_port"] for i in range(13)}
    with pytest.raises(VehicleError, match="up to 12"):
        from_mapping(numbers | {"thrusters": many})
