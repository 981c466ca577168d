"""Readings that repeat a value: a stuck sensor, or a logger that writes a value where it has no measurement.

Verifies: values that are held, zeros, and −999 here and there are named as one error, and what they hide is found
beside them, also where right readings are equal for longer; a short run of readings that are not rounded is enough; a
sensor that rounds, one that stands still, and one that is slower than its logger have no error.
Truth is exact: a first-order lag. Tolerance: 3 standard deviations of the verdict.
"""

import numpy as np
import pytest

import subzero.diagnosis as sd
from tests.marks import LONG

STEP, NOISE = 0.1, 0.05


def lag(p, u, t):
    """Return the exact solution of T x' = k u − x for an input that is held."""
    keep, x, shown = np.exp(-(t[1] - t[0]) / p["time"]), np.zeros_like(p["time"]), []
    for value in u["u"]:
        shown.append(x)
        x = p["gain"] * value + (x - p["gain"] * value) * keep
    return {"x": np.array(shown)}


def model():
    return sd.Model(
        lag,
        channels={"x": sd.Sensor(noise=NOISE, unit="m")},
        inputs=["u"],
        parameters=[sd.Number("time", 1.5, tolerance=0.03), sd.Number("gain", 1.0, tolerance=0.02)],
        causes=[sd.Cause("gain", "the gain is another", changes={"gain": 0.3})],
        batch=True,
    )


def record(*, gain=1.0, resolution=0.0, samples=300, seed=0, rest=0):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-2.0, 0.0, 1.0, 3.0], samples // 20), 20)
    u[:rest] = 0.0
    x = lag({"time": np.full(1, 1.5), "gain": np.full(1, gain)}, {"u": u[:, None]}, STEP * np.arange(samples))
    x = x["x"][:, 0] + NOISE * rng.standard_normal(samples)
    return sd.Record(
        STEP * np.arange(samples), {"x": np.round(x / resolution) * resolution if resolution else x, "u": u}
    )


def with_lost(made, value):
    """Return a record in which six stretches of 3 to 12 readings show a value, or hold the one before."""
    rng, x = np.random.default_rng(3), made.columns["x"].copy()
    for begin in rng.choice(np.arange(10, x.size - 30, 25), 6, replace=False):
        x[begin : begin + rng.integers(3, 13)] = x[begin - 1] if value is None else value
    return sd.Record(made.time, {**made.columns, "x": x})


@pytest.mark.parametrize("value", [None, LONG(0.0), LONG(-999.0)])
@pytest.mark.parametrize("gain", [1.0, 1.6])
def test_a_value_in_place_of_measurements_is_named_beside_a_cause(gain, value):
    verdict = sd.diagnose(with_lost(record(gain=gain), value), model())
    assert {each.id for each in verdict.named} == {"lost:x@0", *(["gain"] if gain > 1.0 else [])}
    sizes = {e.name: e for each in verdict.named for e in each.estimates}
    assert all(abs(e.value - gain) < 3.0 * e.sd for e in sizes.values())


def test_a_value_in_place_of_measurements_is_named_where_right_readings_are_equal_for_longer():
    made = record(resolution=0.5, rest=80, seed=1)
    x = made.columns["x"].copy()
    for begin in (20, 50):
        x[begin : begin + 12] = 5.0
    (named,) = sd.diagnose(sd.Record(made.time, {**made.columns, "x": x}), model()).named
    assert named.id == "lost:x@0"
    assert "2 times from 2 to 6.1 s" in named.sentence


def test_a_sensor_that_is_stuck_for_a_short_time_is_named():
    made = record(samples=60)
    x = made.columns["x"].copy()
    x[-8:] = x[-9]
    (named,) = sd.diagnose(sd.Record(made.time, {**made.columns, "x": x}), model()).named
    assert named.id == "stuck:x@0"
    assert named.sentence == "x is stuck from 5.1 to 5.9 s"


@pytest.mark.parametrize("resolution", [0.1, 0.5])
def test_equal_readings_of_a_sensor_that_rounds_are_measurements(resolution):
    verdict = sd.diagnose(record(resolution=resolution, rest=80), model())
    assert verdict.verdict == "nothing_wrong"


def test_equal_readings_at_rest_are_measurements():
    made = record(rest=100)
    x = np.where(np.arange(300) < 100, 0.0, made.columns["x"])
    assert sd.diagnose(sd.Record(made.time, {**made.columns, "x": x}), model()).verdict == "nothing_wrong"


def test_readings_of_a_logger_that_is_faster_than_its_sensor_are_measurements():
    made = record()
    x = np.repeat(made.columns["x"][2::4], 4)  # each shown about its own time
    assert sd.diagnose(sd.Record(made.time, {**made.columns, "x": x}), model()).verdict == "nothing_wrong"


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_coarse_sensor_of_what_moves_quickly_at_first_and_slowly_then_has_no_error(seed):
    """Forty steps of the sensor in the first quarter, six in the rest, so that most readings there are equal."""
    rng, time = np.random.default_rng(seed), 0.1 * np.arange(400)
    u = np.where(time < 10.0, 1.0 - np.cos(2.0 * np.pi * time / 5.0), 0.02 * (time - 10.0))
    model = sd.Model(
        lambda p, u, t: {"x": p["gain"] * u["u"]},
        {"x": sd.Sensor(noise=0.02, unit="m", resolution=0.1)},
        inputs=["u"],
        parameters=[sd.Number("gain", 1.0, tolerance=0.02)],
    )
    x = 0.1 * np.round((u + 0.005 * rng.standard_normal(400)) / 0.1)
    verdict = sd.diagnose(sd.Record(time, {"x": x, "u": u}), model)
    assert (verdict.verdict, verdict.named) == ("nothing_wrong", ())
