"""An effect that begins in mid-trial: it changes nothing before, stands beside other changes, begins at any time."""

import dataclasses

import numpy as np
import pytest

from subzero.diagnosis import catalogue, with_free_onset, with_onset
from subzero.diagnosis.inference import respond

EFFECTS = catalogue(("heading",))
DRAG = EFFECTS["hull_drag"]
TIMES = np.arange(0.0, 30.0, 0.2)


@pytest.fixture(scope="module")
def setting(plant):
    return plant().problem.records[0].setting


def speed(setting):
    return respond(setting, TIMES, ("surge_speed",))["surge_speed"]


def drag(model):
    return model.vehicle.axial_drag.drag_coefficient


def test_before_it_begins_nothing_is_changed(setting):
    plain, seen = speed(setting), speed(with_onset(DRAG, 12.4).apply(setting, 0.9))
    assert np.array_equal(seen[TIMES < 12.3], plain[TIMES < 12.3])
    assert seen[-1] < plain[-1] - 0.05, "more drag from then on: slower"


def test_its_id_and_words_say_when():
    effect = with_onset(EFFECTS["rudder_offset"], 12.5)
    assert effect.id == "rudder_offset@12.5"
    assert effect.sentence == "from 12.5 s on the rudder is off its centre"
    assert not effect.sudden


def test_other_changes_in_mid_trial_are_kept(setting):
    other = dataclasses.replace(setting.model, current=(0.1, 0.0, 0.0))
    both = with_onset(DRAG, 12.0).apply(
        dataclasses.replace(setting, later=((6.0, other), (20.0, setting.model))), 0.5
    )
    assert [time for time, _ in both.later] == [6.0, 12.0, 20.0]
    assert [model.current[0] for _, model in both.later] == [0.1, 0.1, 0.0]
    assert [drag(model) / drag(setting.model) for _, model in both.later] == pytest.approx([1.0, 1.5, 1.5])
    assert with_onset(DRAG, 0.0).apply(setting, 0.5).later == ()


def test_what_changes_at_the_same_time_is_kept(setting):
    other = dataclasses.replace(setting.model, current=(0.1, 0.0, 0.0))
    ((time, model),) = (
        with_onset(DRAG, 12.0).apply(dataclasses.replace(setting, later=((12.0, other),)), 0.5).later
    )
    assert (time, model.current[0]) == (12.0, 0.1)
    assert drag(model) == pytest.approx(1.5 * drag(setting.model))


def test_between_two_exchanges_it_has_the_share_that_is_left(setting):
    step = setting.trial.cable_step
    later = with_onset(DRAG, 12.0 + 0.75 * step).apply(setting, 0.8).later
    assert [time for time, _ in later] == pytest.approx([12.0, 12.0 + step])
    assert [drag(model) / drag(setting.model) for _, model in later] == pytest.approx([1.2, 1.8])


def test_the_response_goes_evenly_with_the_time(setting):
    """Otherwise no slope leads to it: halfway between two exchanges the speed is halfway, to 2 % of the change."""
    begins, step = with_free_onset(DRAG, 12.0, 30.0), setting.trial.cable_step
    early, half, late = (speed(begins.apply(setting, 0.8, share * step)) for share in (0.0, 0.5, 1.0))
    change = late - early
    assert change[65] > 0.0, "begun later, it has slowed it less by 13 s"
    assert np.max(np.abs(half - 0.5 * (early + late))) < 0.02 * np.max(change)


def test_its_time_is_a_parameter_that_is_as_likely_anywhere(setting):
    begins = with_free_onset(DRAG, 12.0, 30.0)
    time = begins.parameters[-1]
    assert [p.name for p in begins.parameters] == ["share", "start_time"]
    assert 1.0 / (np.sqrt(2.0 * np.pi) * time.scale) == pytest.approx(1.0 / 30.0), (
        "density of 30 s, at its height"
    )
    assert (12.0 + time.low, 12.0 + time.high) == (1.0, 29.0)
    at = with_onset(DRAG, 13.4).apply(setting, 0.8).later
    assert [when for when, _ in begins.apply(setting, 0.8, 1.4).later] == pytest.approx(
        [when for when, _ in at]
    )
