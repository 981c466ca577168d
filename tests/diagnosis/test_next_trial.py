"""The next trial: what tells the confounded causes of fig6 apart, within safe limits, and how surely."""

from typing import NamedTuple

import numpy as np
import pytest

from subzero.diagnosis import catalogue
from subzero.diagnosis.assessment import (
    LIBRARY,
    PLANE_AMPLITUDE,
    RUDDER_AMPLITUDE,
    Belief,
    cruise,
    fastest,
    next_trial,
    outlook,
)
from subzero.diagnosis.inference import Fit


class Survivor(NamedTuple):
    ids: tuple[str, ...]
    fit: Fit


def survivors(planted, *names):
    return [Survivor((name,), planted.fit(name)) for name in names]


def hidden(name, *size):
    return lambda setting: catalogue(("heading",))[name].apply(setting, *size)


@pytest.fixture(scope="module")
def lagging(plant):
    planted = plant(hidden("rudder_lag", 0.4))
    return planted, survivors(planted, "rudder_lag", "yaw_inertia")


@pytest.mark.long
def test_a_rudder_lag_or_a_yaw_inertia_asks_for_rudder_doublets(lagging):
    planted, left = lagging
    advice = next_trial(planted.problem, left, seed=1)
    assert advice is not None
    assert advice.name == "rudder_doublets"
    assert advice.discrimination > 16.0
    assert advice.decides > 0.8


def test_cable_drag_or_a_current_asks_for_the_way_back_or_for_ground_speed(plant):
    planted = plant(hidden("cable_tangential_drag", 1.2))
    advice = next_trial(planted.problem, survivors(planted, "cable_tangential_drag", "current"), seed=1)
    assert advice is not None
    assert advice.name == "reversed_heading" or advice.channel == "speed_over_ground"
    assert advice.discrimination > 16.0


def test_with_one_cause_left_there_is_nothing_to_tell_apart(lagging):
    planted, left = lagging
    assert next_trial(planted.problem, left[:1]) is None


@pytest.mark.parametrize("name", LIBRARY)
def test_every_trial_stays_within_limits(lagging, name):
    setting = lagging[0].problem.records[0].setting
    words, make = LIBRARY[name]
    trial = make(setting).trial
    commands = trial.commands
    assert np.all(np.diff(commands.time) > 0.0)
    assert commands.time[0] == 0.0
    assert commands.time[-1] < trial.duration <= 80.0
    assert np.abs(commands.values[:, 0]).max() <= fastest(setting)
    assert np.abs(commands.values[:, 1]).max() <= RUDDER_AMPLITUDE + 1e-9
    assert np.abs(commands.values[:, 2:]).max() <= 2.0 * PLANE_AMPLITUDE + 1e-9
    assert words.endswith(".")
    assert cruise(setting) > 0.0


def test_the_probability_of_deciding_grows_with_the_distance():
    """Two hypotheses a distance √D apart, nothing else free: D 1 decides seldom, D 40 nearly always."""
    held = [Belief(z=np.zeros(1), M=np.zeros((1, 1)))] * 2
    found = []
    for distance in (1.0, 4.0, 16.0, 40.0):
        shown = np.zeros((2, 10))
        shown[1, 3] = np.sqrt(distance)
        view = outlook(shown, np.zeros((10, 1)), held)
        assert view.discrimination() == pytest.approx(distance)
        found.append(view.decides(np.array([0.5, 0.5]), seed=0))
    assert found == sorted(found)
    assert found[0] < 0.2
    assert found[-1] > 0.95


def test_what_tolerances_could_do_as_well_does_not_count():
    shown, J = np.zeros((2, 10)), np.zeros((10, 1))
    shown[1, 3], J[3, 0] = 5.0, 1.0
    free = outlook(shown, J, [Belief(z=np.zeros(1), M=np.array([[99.0]]))] * 2)
    assert free.discrimination() == pytest.approx(0.25)
