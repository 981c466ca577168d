"""Actuators of a list: fins anywhere, moving masses, buoyancy engines, and forces in flow axes.

Verifies: a cross of four listed fins gives the forces of the rudder and the stern-planes; signs in words; a tail in X
has the authority of the cross; the mass matrix of a moved mass against its parallel-axis formula and a body built with
the mass there; energy closes while a mass slides and a bladder fills; forces in flow axes against rotation matrices.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import subzero
from scenarios.parameters import with_vehicle
from scenarios.vehicle_lists import FLOW_AXES as FILE_AXES
from scenarios.vehicle_lists import LISTS as FILE_LISTS
from vehicle import (
    Vehicle,
    VehicleError,
    breakdown_table,
    derivative,
    free_run,
    from_mapping,
    initial_state,
    kinetic_energy,
    potential_energy,
    to_mapping,
)
from vehicle.body_lift import FlowAxes
from vehicle.buoyancy_engine import BuoyancyEngine
from vehicle.fin_list import Fin
from vehicle.lists import LISTS
from vehicle.moving_mass import MovingMass


def shipped(name: str) -> Vehicle:
    return from_mapping(with_vehicle(subzero.load_scenario("fig6"), name)[0].vehicle)


AUV = shipped("subzero2")
FRAME = shipped("open_frame")
HALF_TURN = np.pi
DIRECTIONS = {"starboard": 0.0, "lower": HALF_TURN / 2, "port": HALF_TURN, "upper": -HALF_TURN / 2}


def fin_of(hull: Vehicle, angle: float, **changes: float) -> Fin:
    """One of the fins of a hull's tail, its span turned by an angle [rad]; the planes lie at 0 and π."""
    was = hull.stern_planes if abs(np.cos(angle)) > 0.5 else hull.rudder
    shape = was.by_name()
    station, arm = shape.pop("station"), shape.pop("arm")
    place = {"x": station, "y": arm * np.cos(angle), "z": arm * np.sin(angle), "span_angle": angle}
    servo = {"lag": 0.0, "rate_limit": 10.0, "offset": 0.0, "deflection_limit": 0.6, "lost_command": 0.0}
    return Fin(
        **shape | place | servo | {"rudder_share": 1.0, "plane_share": 1.0, "roll_share": 1.0} | changes
    )


def without_fins(hull: Vehicle, **lists: tuple) -> Vehicle:
    bare = {"rudder": replace(hull.rudder, area=0.0), "stern_planes": replace(hull.stern_planes, area=0.0)}
    return replace(hull, **bare, **lists)


def cross_of(hull: Vehicle) -> Vehicle:
    """The same tail as a list: upper and lower fin do not follow a difference of the planes."""
    shares = {"starboard": 1.0, "lower": 0.0, "port": 1.0, "upper": 0.0}
    fins = {name: fin_of(hull, angle, roll_share=shares[name]) for name, angle in DIRECTIONS.items()}
    return without_fins(hull, fins=tuple(fins.items()))


CROSS = cross_of(AUV)
TAIL = ("rudder", "stern_plane_port", "stern_plane_starboard")


def deflected(*angles: float, nu: tuple[float, ...] = (1.2, 0.1, -0.05, 0.3, 0.1, -0.2)) -> np.ndarray:
    """A state with rudder, port and starboard plane at angles [rad]."""
    state = np.zeros(21)
    state[3], state[7:13], state[14:17], state[18:21] = 1.0, nu, angles, angles
    return state


def tail_force(vehicle: Vehicle, state: np.ndarray, command: tuple[float, ...]) -> np.ndarray:
    rows = breakdown_table(vehicle, state, command)
    return sum(rows[name] for name in TAIL)


@pytest.mark.parametrize("angles", [(0.1, 0.0, 0.0), (0.0, 0.1, 0.1), (0.0, -0.1, 0.1), (0.2, 0.05, -0.1)])
def test_a_cross_of_listed_fins_has_the_forces_of_rudder_and_planes(angles):
    state, command = deflected(*angles), (0.0, *angles)
    expected = tail_force(AUV, state, command)
    got = tail_force(CROSS, np.append(state, np.zeros(4)), (*command, 0.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-13)


def steady(angles: tuple[float, float, float], vehicle: Vehicle) -> np.ndarray:
    nu = (1.2, 0.0, 0.0, 0.0, 0.0, 0.0)
    return tail_force(vehicle, np.append(deflected(*angles, nu=nu), np.zeros(4)), (0.0, *angles, *[0.0] * 4))


def test_a_tail_in_x_steers_in_words_and_with_the_authority_of_the_cross():
    # Fins of one shape, turned by 45 degrees: four at sin 45° push where two pushed before.
    round_hull = replace(AUV, rudder=AUV.stern_planes)
    fins = tuple((f"fin_{i}", fin_of(round_hull, np.radians(45.0 + 90.0 * i))) for i in range(4))
    x_tail = without_fins(round_hull, fins=fins)
    cross_tail, small = cross_of(round_hull), 1e-4
    for angles, component in (((small, 0, 0), 5), ((0, small, small), 4), ((0, -small, small), 3)):
        at_rest = steady((0, 0, 0), x_tail)
        turn = (steady(angles, x_tail) - at_rest)[component]
        was = (steady(angles, cross_tail) - steady((0, 0, 0), cross_tail))[component]
        assert turn > 0.0  # to starboard, nose up, to starboard
        share = 2.0 if component == 3 else 1.0  # all four roll, two planes did
        assert turn == pytest.approx(share * was, rel=1e-6)


def test_own_commands_of_fins_in_words():
    pushed = {}
    for i, name in enumerate(DIRECTIONS):
        state = np.append(deflected(0, 0, 0, nu=(1.0, 0, 0, 0, 0, 0)), np.zeros(4))
        state[21 + i] = 0.1
        pushed[name] = tail_force(CROSS, state, (0.0,) * 8)
    assert pushed["starboard"][2] > 0.0  # pushed down
    assert pushed["port"][2] < 0.0
    assert pushed["lower"][1] < 0.0  # the stern goes to port
    assert pushed["upper"][1] > 0.0
    assert all(wrench[3] > 0.0 for wrench in pushed.values())  # each rolls the hull to starboard


def test_a_jammed_fin_follows_nothing_and_a_limit_holds_it():
    jammed = fin_of(AUV, 0.0, lost_command=1.0, offset=0.2)
    hull = without_fins(AUV, fins=(("jammed", jammed),))
    end = free_run(hull, initial_state(), [0.0, 0.0, 0.3, 0.3, 0.4], 2.0).states[-1]
    assert end[21] == pytest.approx(0.2, abs=1e-6)
    still = tail_force(hull, np.append(deflected(0, 0, 0), 0.2), (0.0,) * 5)
    np.testing.assert_array_equal(tail_force(hull, np.append(deflected(0, 0.3, 0.3), 0.2), (0.0,) * 5), still)
    limited = without_fins(AUV, fins=(("fin", fin_of(AUV, 0.0, deflection_limit=0.1)),))
    np.testing.assert_array_equal(
        tail_force(limited, np.append(deflected(0, 0.3, 0.3), 0.0), (0.0,) * 5),
        tail_force(limited, np.append(deflected(0, 0.1, 0.1), 0.0), (0.0,) * 5),
    )


def test_a_servo_of_a_fin_lags_and_turns_no_faster_than_it_can():
    hull = without_fins(AUV, fins=(("fin", fin_of(AUV, 0.0, lag=0.5)),))
    states = free_run(hull, initial_state(), [0.0, 0.0, 0.0, 0.0, 0.3], 1.0).states
    assert states[-1, 21] == pytest.approx(0.3 * (1.0 - np.exp(-2.0)), rel=1e-6)
    slow = without_fins(AUV, fins=(("fin", fin_of(AUV, 0.0, rate_limit=0.05)),))
    states = free_run(slow, initial_state(), [0.0, 0.0, 0.0, 0.0, 0.3], 1.0).states
    assert states[-1, 21] == pytest.approx(0.05, rel=1e-6)


SLIDER = MovingMass(
    mass=4.0,
    x=0.1,
    y=0.0,
    z=0.02,
    travel_aft=0.2,
    travel_forward=0.2,
    slide_rate=0.05,
    turn_limit=1.5,
    turn_rate=0.2,
    lag=0.1,
    lost_command=0.0,
)
BLADDER = BuoyancyEngine(
    x=0.3, y=0.0, z=0.0, least_volume=-5e-4, most_volume=5e-4, pump_rate=5e-5, lag=0.1, lost_command=0.0
)


def with_mass(vehicle: Vehicle, at: MovingMass = SLIDER) -> Vehicle:
    return replace(vehicle, moving_masses=(("battery", at),))


def rate_at(vehicle: Vehicle, state: np.ndarray) -> np.ndarray:
    out = np.empty(state.size)
    derivative(state, np.zeros(4 + state.size - 21), np.zeros(3), np.zeros(6), vehicle.numbers(), out)
    return out


def moving_state(*behind: float) -> np.ndarray:
    """A state that rolls, pitches and turns, with those of the channels behind it."""
    state = initial_state(pitch=0.2, heading=0.4, velocity=(0.8, 0.1, -0.05, 0.2, -0.3, 0.25))
    return np.append(state, behind)


def test_a_moved_mass_accelerates_as_a_body_that_was_built_so():
    """The same masses in other places: the rigid body of a hull whose mass was always there."""
    slid, turned = 0.15, 0.8
    c, s = np.cos(turned), np.sin(turned)
    m, was = SLIDER.mass, np.array([SLIDER.x, SLIDER.y, SLIDER.z])
    now = np.array([was[0] + slid, was[1] * c - was[2] * s, was[1] * s + was[2] * c])
    body = AUV.rigid_body
    total, centre = body.mass, body.centre_of_gravity
    shell = total * centre - m * was  # moment of all else
    new_centre = (shell + m * now) / total
    places = ("centre_of_gravity_x", "centre_of_gravity_y", "centre_of_gravity_z")
    built = replace(AUV, rigid_body=replace(body, **dict(zip(places, new_centre, strict=True))))
    numbers = with_mass(AUV).numbers()
    # Inertia about the hull's centre: that at rest, less the point at rest, plus the point where it is now.
    point = lambda r: m * (r @ r * np.eye(3) - np.outer(r, r))  # noqa: E731
    inertia = AUV.rigid_body.matrix()[3:, 3:] - point(was) + point(now)
    rigid = built.rigid_body.matrix()
    rigid[3:, 3:] = inertia
    state = moving_state(slid, turned)
    got = rate_at(with_mass(AUV), state)[7:13]
    other = built.numbers()
    other.rigid_body[:] = rigid
    other.mass_matrix[:] = rigid + other.added_mass
    other.inverse_mass[:] = np.linalg.inv(other.mass_matrix)
    out = np.empty(21)
    derivative(state[:21].copy(), np.zeros(4), np.zeros(3), np.zeros(6), other, out)
    np.testing.assert_allclose(got, out[7:13], rtol=1e-9, atol=1e-12)
    assert numbers.mass_count == 1


def test_a_mass_at_rest_changes_nothing():
    state = moving_state(0.0, 0.0)
    np.testing.assert_allclose(rate_at(with_mass(AUV), state)[:21], rate_at(AUV, state[:21]), atol=1e-14)


def test_moving_masses_in_words():
    level = initial_state()
    ahead = rate_at(with_mass(AUV), np.append(level, [0.1, 0.0]))
    assert ahead[11] < 0.0  # forward: the nose sinks
    turned = rate_at(with_mass(AUV), np.append(level, [0.0, 0.5]))
    # the mass hangs below the axis; its starboard side goes down, so it swings to port and heels the hull to port
    assert turned[10] < 0.0


def test_a_bladder_lifts_where_it_stands():
    buoyant = replace(FRAME, buoyancy_engines=(("bladder", BLADDER),))
    wrench = breakdown_table(buoyant, np.append(initial_state(), 3e-4), (0.0,) * 5)["propeller"]
    lift = FRAME.water.density * FRAME.water.gravity * 3e-4
    np.testing.assert_allclose(wrench, [0, 0, -lift, 0, BLADDER.x * lift, 0], atol=1e-12)  # up, nose up
    states = free_run(buoyant, initial_state(), [0, 0, 0, 0, 3e-4], 4.0).states
    assert states[-1, 21] == pytest.approx(4.0 * BLADDER.pump_rate, rel=1e-6)  # the pump's rate
    assert states[-1, 2] < 0.0


def test_energy_closes_while_a_mass_slides_and_a_bladder_fills():
    glider = replace(with_mass(AUV), buoyancy_engines=(("bladder", BLADDER),))
    numbers = glider.numbers()
    run = free_run(
        glider,
        initial_state(position=(0, 0, 10.0), velocity=(0.5, 0, 0, 0, 0, 0)),
        [0, 0.1, 0.1, 0, 0.1, 0.8, -3e-4],
        20.0,
        0.01,
    )

    def energy(state: np.ndarray) -> float:
        return kinetic_energy(state, np.zeros(3), numbers) + potential_energy(state, numbers)

    gained = energy(run.states[-1]) - energy(run.states[0])
    assert run.work[-1, 0] > 1.0  # pushed on by bladder and mass [J]
    works = run.work[-1, 0] + run.work[-1, 1] + run.work[-1, 3]  # propulsion, losses, outside
    assert gained == pytest.approx(works, abs=1e-4)


COEFFICIENTS = dict(
    zip(
        FlowAxes.__dataclass_fields__,
        (7.0, 300.0, -110.0, -0.4, 400.0, -50.0, -20.0, 0.3, -60.0, -200.0, 30.0, -300.0),
        strict=True,
    )
)


def test_forces_in_flow_axes_against_rotation_matrices():
    winged = replace(FRAME, flow_axes=FlowAxes(**COEFFICIENTS))
    state = moving_state()
    u, v, w, p, q, r = state[7:13]
    k, V2 = list(COEFFICIENTS.values()), u * u + v * v + w * w
    alpha, beta = np.arctan2(w, u), np.arcsin(v / np.sqrt(V2))
    turn = Rotation.from_euler("y", -alpha).as_matrix() @ Rotation.from_euler("z", beta).as_matrix()
    np.testing.assert_allclose(turn @ [np.sqrt(V2), 0, 0], [u, v, w], atol=1e-12)
    force = turn @ [-(k[0] + k[1] * alpha**2), k[2] * beta, -(k[3] + k[4] * alpha)] * V2
    moment = turn @ [k[5] * beta + k[6] * p, k[7] + k[8] * alpha + k[9] * q, k[10] * beta + k[11] * r] * V2
    got = breakdown_table(winged, state)["body_lift"]
    np.testing.assert_allclose(got, np.concatenate([force, moment]), rtol=1e-12)


def test_a_wing_lifts_and_brakes_in_words():
    winged = replace(FRAME, flow_axes=FlowAxes(**COEFFICIENTS))
    sinking = initial_state(velocity=(0.5, 0.0, 0.05, 0.0, 0.0, 0.0))  # nose-up incidence
    wrench = breakdown_table(winged, sinking)["body_lift"]
    assert wrench[0] < 0.0
    assert wrench[2] < 0.0  # up
    assert wrench[4] < 0.0  # nose down, into the flow


def test_mappings_carry_the_lists_and_flow_axes():
    whole = replace(
        with_mass(CROSS), buoyancy_engines=(("bladder", BLADDER),), flow_axes=FlowAxes(**COEFFICIENTS)
    )
    again = from_mapping(to_mapping(whole))
    assert again == whole
    assert [channel.name for channel in again.channels] == [
        *DIRECTIONS,
        "battery_slide",
        "battery_turn",
        "bladder",
    ]
    assert again.state_size == 21 + 7
    changed = whole.with_parameter("fins.upper.area", 0.5)
    assert dict(changed.fins)["upper"].area == 0.5


@pytest.mark.parametrize(
    ("section", "rows", "said"),
    [
        ("fins", (("rudder", CROSS.fins[0][1]),), "another command has this name"),
        (
            "fins",
            tuple((f"fin_{i}", CROSS.fins[0][1]) for i in range(9)),
            "more than the compiled equations hold",
        ),
        ("moving_masses", (("battery", BLADDER),), "this is no such part"),
        ("buoyancy_engines", BLADDER, "this is no such part"),
    ],
)
def test_lists_that_cannot_be_are_refused(section, rows, said):
    with pytest.raises(VehicleError, match=said):
        replace(AUV, **{section: rows})


def test_units_of_files_are_those_of_the_sections():
    tables = {name: table.units for name, table in FILE_LISTS.items()} | {"flow_axes": FILE_AXES}
    for name, kind in {**{name: kind for name, (kind, _) in LISTS.items()}, "flow_axes": FlowAxes}.items():
        assert tables[name] == {key: made.metadata["unit"] for key, made in kind.__dataclass_fields__.items()}
