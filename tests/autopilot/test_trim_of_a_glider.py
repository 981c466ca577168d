"""Steady glides: Seawing, straight and in a spiral.

Verifies: the trim of the published spiral finds its battery and ballast; a run from a trim stays there; a dive and a
climb in words; the linear model has the glider's commands and is stable; refusals in words.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
import vehicle
from subzero import autopilot
from subzero.steady_motion.asked import NoTrimError
from subzero.steady_motion.hull_state_space import from_vehicle, to_vehicle

MODEL = subzero.Model.of(subzero.load_scenario("glider_sawtooth"))
PITCH, INCIDENCE, SIDESLIP, ROLL = np.radians((-35.641, 1.267, -1.283, -13.703))
SPEED, TURN = 0.490, 0.0039
"""The spiral that Zhang et al. (2013) print. [rad, m/s, rad/s]"""


def test_the_published_spiral_is_found_with_its_battery_and_ballast():
    u, v, w = SPEED * np.array(
        [np.cos(INCIDENCE) * np.cos(SIDESLIP), np.sin(SIDESLIP), np.sin(INCIDENCE) * np.cos(SIDESLIP)]
    )
    across = v * np.sin(ROLL) + w * np.cos(ROLL)
    sinking = -u * np.sin(PITCH) + across * np.cos(PITCH)
    steady = autopilot.trim(MODEL, speed=u, depth_rate=sinking, turn_rate=TURN)
    found = dict(zip(steady.listed, steady.command[4:], strict=True))
    rest = dict(MODEL.vehicle.moving_masses)["battery"].x
    # Printed with three digits: 0.1 mm of a slide of 20 mm, and a turn rate of two digits.
    assert rest + found["battery_slide"] == pytest.approx(0.4216, abs=2e-4)
    assert np.degrees(found["battery_turn"]) == pytest.approx(45.0, rel=0.01)
    assert -found["bladder"] * MODEL.vehicle.water.density == pytest.approx(0.3, rel=0.01)
    assert np.degrees(steady.named()["roll"]) == pytest.approx(-13.703, rel=0.01)


@pytest.mark.parametrize("turn_rate", [0.0, 0.003, -0.003])
@pytest.mark.parametrize("depth_rate", [0.2, -0.2])
def test_a_run_from_the_trim_stays_there(depth_rate, turn_rate):
    steady = autopilot.trim(MODEL, speed=0.4, depth_rate=depth_rate, turn_rate=turn_rate)
    run = vehicle.free_run(MODEL.vehicle, to_vehicle(steady.state), steady.command, 20.0)
    end = from_vehicle(run.states[-1], heading_near=20.0 * turn_rate, channels=3)
    assert_allclose(end[3:5], steady.state[3:5], atol=1e-6)
    assert_allclose(end[6:], steady.state[6:], atol=1e-6)
    assert end[2] == pytest.approx(20.0 * depth_rate, abs=1e-5)


def test_dive_climb_and_turn_in_words():
    dive, climb = (autopilot.trim(MODEL, speed=0.4, depth_rate=rate) for rate in (0.2, -0.2))
    assert dive.named()["pitch"] < 0.0 < climb.named()["pitch"]
    assert dive.named()["bladder_state"] < 0.0 < climb.named()["bladder_state"]  # heavy, light
    assert dive.named()["battery_slide_state"] > 0.0 > climb.named()["battery_slide_state"]  # forward, aft
    starboard = autopilot.trim(MODEL, speed=0.4, depth_rate=0.2, turn_rate=0.003)
    assert starboard.named()["roll"] < 0.0  # on the way down it turns away from the lower wing


def test_the_linear_model_has_the_commands_of_the_glider():
    linear = autopilot.linearise(MODEL, autopilot.trim(MODEL, speed=0.4, depth_rate=0.2))
    assert {"battery_slide_command", "battery_turn_command", "bladder_command"} <= set(linear.input_labels)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"speed": 0.4}, "its weight drives it"),
        ({"speed": 0.4, "depth_rate": 0.5}, "its weight drives it"),
        ({"speed": 0.4, "depth_rate": 0.2, "roll": 0.1}, "roll and sway follow from the turn"),
        ({"speed": 1.5, "depth_rate": 0.5}, "bladder would need .* m3, its limit is 0.0005"),
    ],
)
def test_glides_that_cannot_be_are_refused(asked, said):
    with pytest.raises(NoTrimError, match=said):
        autopilot.trim(MODEL, **asked)
