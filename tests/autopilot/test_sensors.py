"""Sensors do to the truth what they say, each stage alone, and the same again with the same seed.

Verifies: `autopilot.Sensors` on a known truth. Tolerance: exact for period, delay, bias and quantum; four standard
errors of the estimate, with fixed seeds, for what is random.
"""

import numpy as np
import pytest

import subzero
from subzero import autopilot
from subzero.autopilot import Sensor, Sensors
from subzero.autopilot.sensors import UNKNOWN

STEP = 0.1


def reported(sensor, truth, seed=0):
    """Return what a sensor tells of a truth that is given every 0.1 s."""
    sensors = Sensors([sensor], seed=seed)
    readings = [
        sensors.read(UNKNOWN._replace(time=k * STEP, **{sensor.channel: value}))
        for k, value in enumerate(truth)
    ]
    return np.array([getattr(reading, sensor.channel) for reading in readings])


RAMP = np.arange(50.0)


def test_a_perfect_sensor_tells_the_truth():
    assert np.array_equal(reported(Sensor(channel="depth"), RAMP), RAMP)


def test_a_period_holds_samples():
    held = reported(Sensor(channel="depth", period=0.3), RAMP)
    assert np.array_equal(held, 3.0 * np.floor(RAMP / 3.0))


def test_a_delay_tells_late_and_the_first_sample_at_once():
    late = reported(Sensor(channel="heading", delay=0.5), RAMP)
    assert np.array_equal(late, np.maximum(RAMP - 5.0, 0.0))


def test_bias_and_quantum():
    assert np.array_equal(reported(Sensor(channel="roll", bias=0.25), RAMP), RAMP + 0.25)
    coarse = reported(Sensor(channel="roll", quantum=4.0), RAMP)
    assert np.all(np.abs(coarse - RAMP) <= 2.0)
    assert np.array_equal(coarse % 4.0, np.zeros(50))


def test_noise_is_white_with_its_standard_deviation():
    noise = reported(Sensor(channel="yaw_rate", noise=0.3), np.zeros(20_000))
    assert np.std(noise) == pytest.approx(0.3, rel=4 / np.sqrt(2 * 20_000))
    assert abs(np.mean(noise)) < 4 * 0.3 / np.sqrt(20_000)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 4 / np.sqrt(20_000)


def test_drift_grows_with_the_square_root_of_time():
    ends = np.array(
        [reported(Sensor(channel="yaw_rate", drift=0.2), np.zeros(41), seed)[-1] for seed in range(600)]
    )
    assert np.std(ends) == pytest.approx(0.2 * np.sqrt(4.0), rel=4 / np.sqrt(2 * 600))


def test_lost_samples_leave_the_last_one_standing():
    kept = reported(Sensor(channel="depth", drop_out=0.3), np.arange(10_000.0))
    lost = np.mean(np.diff(kept) == 0.0)
    assert lost == pytest.approx(0.3, abs=4 * np.sqrt(0.21 / 10_000))
    assert set(kept) <= set(np.arange(10_000.0))


def test_the_same_seed_is_the_same_run_and_sensors_do_not_disturb_one_another():
    speed, depth = Sensor(channel="surge_speed", noise=0.1), Sensor(channel="depth", noise=0.1, drop_out=0.2)
    truth = UNKNOWN._replace(time=0.0, surge_speed=1.0, depth=3.0)

    def read(sensors, times=20):
        return [sensors.read(truth._replace(time=k * STEP)) for k in range(times)]

    together = Sensors([speed, depth], seed=5)
    first = read(together)
    alone = [one.depth for one in read(Sensors([depth], seed=5))]
    assert [one.depth for one in first] == alone
    assert [one.depth for one in read(Sensors([depth], seed=6))] != alone
    together.reset()
    again = read(together)
    assert [(a.depth, a.surge_speed) for a in again] == [(a.depth, a.surge_speed) for a in first]


def test_what_no_sensor_measures_is_not_a_number():
    sim = subzero.Simulator("fig6")
    reading = Sensors(autopilot.ESTIMATED, seed=1).read(sim.step())
    measured = {sensor.channel for sensor in autopilot.ESTIMATED} | {"time"}
    for name, value in reading._asdict().items():
        assert np.isnan(value) == (name not in measured), name


@pytest.mark.parametrize(
    "make,words",
    [
        (lambda: Sensor(channel="sway"), "Did you mean 'sway_speed'"),
        (lambda: Sensor(channel="depth", noise=-1.0), "noise is -1.0. Allowed: 0 to inf"),
        (lambda: Sensor(channel="depth", drop_out=1.5), "Allowed: 0 to 1"),
        (lambda: Sensors([Sensor(channel="depth")] * 2), "two of depth"),
    ],
)
def test_impossible_sensors_are_refused(make, words):
    with pytest.raises(subzero.UserError, match=words):
        make()


def test_a_sample_of_more_steps_than_can_be_counted_stays_as_it_is():
    sensors = Sensors([Sensor(channel="depth", quantum=1e-2, bias=1e308)])
    assert sensors.read(UNKNOWN._replace(time=0.0, depth=1.0)).depth == 1e308
