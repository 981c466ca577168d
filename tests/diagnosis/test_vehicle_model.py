"""The tethered vehicle as a model of any kind: simulations that are taken up in the middle are the whole ones.

Tolerance: none. What is the same until some time is computed by the same steps after it.
"""

import numpy as np
import pytest

import subzero
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.vehicle_model import vehicle_model
from subzero.model import Model
from subzero.records.record import Record

CHANNELS = ("surge_speed", "heading", "depth")


@pytest.fixture
def model_and_record():
    trial = subzero.load_scenario("fig6")
    time = np.arange(0.0, 30.0, 0.5)
    values = {name: np.zeros(time.size) for name in CHANNELS}
    logged = Logged(
        record=Record(source="test", time=time, values=values),
        setting=Setting(trial=trial, model=Model.of(trial)),
        name="fig6",
    )
    model, (record,) = vehicle_model([logged], axes="X")
    return model, record


def readings(model, record, since=None, push=None, **numbers):
    from subzero.identification.simulation import nested

    p = {name: value for name, value in model.nominal().items() if not isinstance(value, dict)} | numbers
    if since is not None:
        p["hull_drag.since"], p["hull_drag.hull_drag:share"] = since
    u = {name: record.columns[name] for name in model.inputs}
    u["X"] = np.zeros(record.time.size) if push is None else push
    return model.simulate(nested(p), u, record.time)


def test_a_simulation_that_is_taken_up_at_an_onset_is_the_whole_one(model_and_record):
    model, record = model_and_record
    fresh = readings(model, record, since=(17.3, 0.4))  # nothing to take up yet
    again, _ = model_and_record
    readings(model, record)  # the nominal one is kept
    for name in CHANNELS:
        np.testing.assert_array_equal(readings(again, record, since=(17.3, 0.4))[name], fresh[name])
    assert np.ptp(fresh["surge_speed"] - readings(model, record)["surge_speed"]) > 0.02


def test_a_force_from_some_time_on_changes_nothing_before_it(model_and_record):
    model, record = model_and_record
    push = np.where(record.time > 20.0, -0.5, 0.0)
    fresh = readings(model, record, push=push)
    nominal = readings(model, record)
    before = record.time <= 20.0
    np.testing.assert_array_equal(fresh["surge_speed"][before], nominal["surge_speed"][before])
    np.testing.assert_array_equal(readings(model, record, push=push)["heading"], fresh["heading"])
    assert fresh["surge_speed"][-1] < nominal["surge_speed"][-1] - 0.02  # a force astern slows it down


def test_a_force_goes_on_where_a_cause_begins(model_and_record):
    model, record = model_and_record
    push = np.where(record.time > 20.0, -0.5, 0.0)
    begins = {"since": (10.0, 0.4)}
    both = readings(model, record, push=push, **begins)["surge_speed"]
    drag = readings(model, record, **begins)["surge_speed"]
    np.testing.assert_array_equal(both[record.time <= 20.0], drag[record.time <= 20.0])
    assert both[-1] < drag[-1] - 0.02  # after the drag has changed, the force still slows it down


def test_another_drag_throughout_is_another_simulation(model_and_record):
    model, record = model_and_record
    nominal = readings(model, record)
    more = readings(model, record, **{"hull_drag:share": 0.4})
    assert more["surge_speed"][-1] < nominal["surge_speed"][-1] - 0.02


def test_the_drift_of_a_sensor_is_added_to_its_readings_alone(model_and_record):
    model, record = model_and_record
    nominal = readings(model, record)
    u = {name: record.columns[name] for name in model.inputs}
    u |= {"X": np.zeros(record.time.size), "sensor_drift:heading": np.linspace(0.0, 3.0, record.time.size)}
    from subzero.identification.simulation import nested

    p = {name: value for name, value in model.nominal().items() if not isinstance(value, dict)}
    shown = model.simulate(nested(p), u, record.time)
    assert np.allclose(shown["heading"] - nominal["heading"], u["sensor_drift:heading"])
    assert np.array_equal(shown["depth"], nominal["depth"])
