"""Means over an interval, logged as values at its begin or end, are no error of the clock.

Verifies: a sensor that shows means over the second that follows is a sensor read half a second later, to the second
order of the second; a healthy record of such means has nothing wrong, and a clock 2 s late in held values is found.
Configuration: fig6 with a rudder amidships, white noise. Tolerance: ten noise levels would be seen, a tenth is asked.
"""

import dataclasses

import numpy as np
import pytest

import subzero
from benchmarks.diagnosis.headings import NOISE, measured, scenario
from benchmarks.diagnosis.sampled import filled_in
from subzero.diagnosis import SAMPLED, Setting
from subzero.diagnosis.inference import respond
from subzero.model import Model
from subzero.records.record import Record

ROWS = 10
"""Rows of 0.1 s in an interval."""


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    return scenario(tmp_path_factory.mktemp("trial"), 27.0, 0.0)


@pytest.fixture(scope="module")
def clean(trial):
    return measured(subzero.simulate(trial), np.random.default_rng([0, 2]), with_rate=True)


def logged(record, kind):
    values = {name: filled_in(column, kind, ROWS) for name, column in record.values.items()}
    return Record(source="record", time=record.time, values=values)


def setting_of(trial, channels):
    """A trial in which a logger held some channels for a second."""
    loaded = subzero.load_scenario(trial)
    return Setting(trial=loaded, model=Model.of(loaded), intervals=dict.fromkeys(channels, 0.1 * ROWS))


@pytest.mark.parametrize(("share", "first"), [(0.5, 0), (-0.5, -ROWS)])
def test_a_mean_over_an_interval_is_a_sample_of_its_middle(share, first, trial, clean):
    """A mean over the second that begins at its time (share ½), or that ends there (−½)."""
    held = setting_of(trial, NOISE)
    setting, time = SAMPLED.apply(held, share), np.arange(5.0, 25.0)
    rows = 0.1 * (np.arange(ROWS + 1) + first)
    fine = respond(held, np.add.outer(time, rows).ravel(), NOISE)
    for name, shown in respond(setting, time, NOISE).items():
        means = np.trapezoid(fine[name].reshape(time.size, -1), axis=1) / ROWS
        assert np.sqrt(np.mean((shown - means) ** 2)) < 0.1 * NOISE[name]


def test_no_other_channel_is_read_at_another_time(trial, clean):
    held = setting_of(trial, NOISE.keys() - {"depth"})
    shown = respond(SAMPLED.apply(held, 0.5), clean.time, NOISE)
    at_once = respond(held, clean.time, NOISE)
    np.testing.assert_array_equal(shown["depth"], at_once["depth"])
    assert np.abs(shown["surge_speed"] - at_once["surge_speed"]).max() > NOISE["surge_speed"]


@pytest.mark.long
def test_a_healthy_record_of_means_has_nothing_wrong(trial, clean):
    assert subzero.diagnose(logged(clean, "averaged"), trial, budget="screen").verdict == "nothing_wrong"


@pytest.mark.slow
def test_a_late_clock_is_found_in_held_values(trial, clean):
    late = {name: np.interp(clean.time - 2.0, clean.time, column) for name, column in clean.values.items()}
    verdict = subzero.diagnose(
        logged(dataclasses.replace(clean, values=late), "held"), trial, budget="screen"
    )
    assert [error.id for error in verdict.data_errors] == ["late_clock"]
