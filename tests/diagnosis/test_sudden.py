"""An effect that begins in mid-trial: it changes nothing before, stands beside other changes, and its time is found."""

import dataclasses

import numpy as np
import pytest

from subzero.diagnosis.begun import begun_at
from subzero.diagnosis.effects import catalogue
from subzero.diagnosis.response import respond
from subzero.diagnosis.sudden import scan, times_of, with_begun

EFFECTS = catalogue(("heading",))


@pytest.fixture(scope="module")
def struck(plant):
    return plant(lambda setting: begun_at(EFFECTS["hull_drag"], 12.4).apply(setting, 0.9))


def test_before_it_begins_nothing_is_changed(struck):
    setting, times = struck.problem.records[0].setting, np.arange(0.0, 30.0, 0.2)
    plain = respond(setting, times, ("surge_speed",))["surge_speed"]
    sudden = begun_at(EFFECTS["hull_drag"], 12.4).apply(setting, 0.9)
    seen = respond(sudden, times, ("surge_speed",))["surge_speed"]
    assert np.array_equal(seen[times < 12.3], plain[times < 12.3])
    assert seen[-1] < plain[-1] - 0.05


def test_its_id_and_words_say_when():
    effect = begun_at(EFFECTS["rudder_offset"], 12.5)
    assert effect.id == "rudder_offset@12.5"
    assert effect.sentence == "from 12.5 s on the rudder is off its centre"
    assert not effect.sudden


def test_other_changes_in_mid_trial_are_kept(struck):
    setting = struck.problem.records[0].setting
    other = dataclasses.replace(setting.model, current=(0.1, 0.0, 0.0))
    both = begun_at(EFFECTS["hull_drag"], 12.0).apply(
        dataclasses.replace(setting, later=((6.0, other), (20.0, setting.model))), 0.5
    )
    drag = 1.5 * setting.model.vehicle.axial_drag.drag_coefficient
    assert [time for time, _ in both.later] == [6.0, 12.0, 20.0]
    assert [model.current[0] for _, model in both.later] == [0.1, 0.1, 0.0]
    drags = [model.vehicle.axial_drag.drag_coefficient for _, model in both.later]
    assert drags == pytest.approx([drag / 1.5, drag, drag])
    assert begun_at(EFFECTS["hull_drag"], 0.0).apply(setting, 0.5).later == ()


def test_the_scan_finds_what_began_and_when(struck):
    fit = struck.fit()
    effects = [EFFECTS[name] for name in ("hull_drag", "rudder_offset", "net_buoyancy", "hull_drag")]
    found = scan(struck.problem, fit, fit.D, effects, best=1)
    assert found[0].effect.id == "hull_drag"
    assert abs(found[0].time - 12.4) <= 1.0
    assert found[0].mean[0] == pytest.approx(0.9, abs=0.35)
    assert found[0].log_gain > 20.0
    more = with_begun(struck.problem, found[0])
    assert more.entries[-1].effect.id.startswith("hull_drag@")


def test_times_stay_clear_of_the_ends(struck):
    times = times_of(struck.problem, 0)
    assert times[0] == 2.0
    assert times[-1] <= 29.0
