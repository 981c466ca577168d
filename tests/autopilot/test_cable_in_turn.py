"""How a cable lies behind a vehicle that turns, from four sums, is how the cable itself lies.

Verifies: `autopilot.feed_forward.CableInTurn` against `cable.pull_out` along straight and circular ways. Tolerance:
1e-12 for the straight pull of equation (37); in a turn 8 % of the angle and 15 % of the tension: the sums leave out the
change of V_n along the cable, which is an eighth of ψ' here, and weight and acceleration of the cable.
"""

import numpy as np
import pytest

import cable
import subzero
from subzero.autopilot.feed_forward import CableInTurn

STEP, DURATION = 0.1, 30.0


@pytest.fixture(scope="module")
def model():
    return subzero.Model.of(subzero.load_scenario("fig6"))


def behind(model):
    return CableInTurn(model.cable, model.drum.friction_torque / model.drum.radius)


def test_on_a_straight_way_it_pulls_as_equation_37_says(model):
    straight = behind(model)
    for _ in range(50):
        straight.move(STEP, 1.2, 0.0, 0.0)
    assert straight.angle == 0.0
    friction = model.drum.friction_torque / model.drum.radius
    asked = friction + model.cable.tangential_drag * 1.2**2 * 20.0
    assert straight.pull(20.0, 1.2, 1.2, 0.0) == pytest.approx(asked, rel=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("degrees", [4.0, 8.0, 12.0])
def test_in_a_turn_it_lies_and_pulls_like_the_cable_itself(model, degrees, side):
    rate = side * np.radians(degrees)

    def velocity(t):
        return np.array([np.cos(rate * t), np.sin(rate * t), 0.0])

    run = cable.pull_out(
        velocity, DURATION, cable=model.cable, drum=model.drum, scheme=cable.MovingEnd(time_step=STEP)
    )
    seen, length = behind(model), run.length
    for i in range(1, length.size):
        seen.move(STEP, 1.0, 0.0, rate)
        seen.pull(length[i], (length[i] - length[i - 1]) / STEP, 1.0, 0.0)
        if i in (100, 200, 299):
            c, s = np.cos(rate * run.time[i]), np.sin(rate * run.time[i])
            forward, starboard = (np.array([[c, s], [-s, c]]) @ run.tow_force[i, :2]).tolist()
            assert seen.angle == pytest.approx(np.arctan2(-starboard, -forward), rel=0.08)
            assert seen.tension == pytest.approx(np.hypot(forward, starboard), rel=0.15)


def test_after_a_turn_it_comes_back_behind_the_vehicle(model):
    seen = behind(model)
    for _ in range(200):
        seen.move(STEP, 1.0, 0.0, 0.2)
        seen.pull(15.0, 0.8, 1.0, 0.0)
    turned = seen.angle
    for _ in range(300):
        seen.move(STEP, 1.0, 0.0, 0.0)
        seen.pull(15.0, 0.9, 1.0, 0.0)
    assert turned < -0.2
    assert 0.0 > seen.angle > 0.1 * turned
