"""Signs in words: what a person at the controls would see."""

import numpy as np
import pytest

import vehicle


@pytest.fixture
def after(subzero2):
    """Run three seconds ahead at 1 m/s with given commands; return north, east, depth, roll, pitch,
    heading.
    """

    def call(*, rudder=0.0, port=0.0, starboard=0.0, n=24.0, seconds=3.0, torque=0.0, **start):
        hull = subzero2.with_parameter("propeller.reaction_torque_factor", torque)
        state = vehicle.initial_state(velocity=(1.0, 0, 0, 0, 0, 0), propeller_speed=n, **start)
        last = vehicle.free_run(hull, state, (n, rudder, port, starboard), seconds).states[-1]
        return (*last[:3], *vehicle.euler_angles(last[3:7].copy()))

    return call


def test_positive_rudder_turns_to_starboard(after):
    north, east, *_, heading = after(rudder=0.1)
    assert heading > 0.1
    assert east > 0.1
    assert north > 2.0


def test_negative_rudder_turns_to_port(after):
    assert after(rudder=-0.1)[5] < -0.1


def test_positive_stern_planes_raise_the_nose_and_the_vehicle_climbs(after):
    north, _, depth, _, pitch, heading = after(port=0.1, starboard=0.1)
    assert pitch > 0.1
    assert depth < 0.0
    assert abs(heading) < 1e-12
    assert north > 2.0


def test_negative_stern_planes_dive(after):
    _, _, depth, _, pitch, _ = after(port=-0.1, starboard=-0.1)
    assert pitch < -0.1
    assert depth > 0.0


def test_starboard_plane_above_port_plane_rolls_to_starboard(after):
    roll = after(port=-0.05, starboard=0.05)[3]
    assert 0.02 < roll < 0.5
    assert after(port=0.05, starboard=-0.05)[3] == pytest.approx(-roll)


def test_a_right_handed_propeller_heels_the_hull_to_port_by_a_few_degrees(after):
    assert -4.0 < np.degrees(after(torque=1.0, seconds=20.0)[3]) < -1.0


def test_differential_planes_can_trim_the_heel_away(after):
    heel = after(torque=1.0, seconds=20.0)[3]
    assert abs(after(torque=1.0, seconds=20.0, port=-0.02, starboard=0.02)[3]) < 0.9 * abs(heel)


def test_a_nose_down_attitude_takes_the_vehicle_deeper(after):
    assert after(pitch=-0.2, seconds=0.5)[2] > 0.05


def test_a_heading_of_ninety_degrees_is_east(after):
    north, east, *_ = after(heading=np.pi / 2)
    assert east > 2.0
    assert abs(north) < 1e-9


def test_a_hull_heeled_to_port_is_righted_and_a_nose_raised_comes_down(subzero2):
    heeled = vehicle.breakdown_table(subzero2, vehicle.initial_state(roll=-0.2))["restoring"]
    assert heeled[3] > 0.05
    raised = vehicle.breakdown_table(subzero2, vehicle.initial_state(pitch=0.2))["restoring"]
    assert raised[4] < -0.05


def test_turning_the_propeller_astern_stops_and_backs_the_vehicle(after):
    assert after(n=-24.0, seconds=20.0)[0] < 0.0


def test_a_hull_drifting_to_starboard_feels_drag_to_port_everywhere(subzero2):
    table = vehicle.breakdown_table(subzero2, vehicle.initial_state(velocity=(1.0, 0.2, 0, 0, 0, 0)))
    for name in ("body_lift", "cross_flow_drag", "rudder"):
        assert table[name][1] < 0.0, name
    assert table["added_mass_coriolis"][5] < 0.0  # Munk: the nose falls further off to port of the drift
    assert table["rudder"][5] > 0.0  # the fins, like an arrow's, turn the nose into the drift
    assert table["body_lift"][5] > 0.0
