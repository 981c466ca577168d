"""What only begins in mid-trial: jams and slow changes, as effects, and hidden in records of the other formulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero import diagnose
from subzero.diagnosis import SPECS, Setting, all_effects, with_onset
from subzero.diagnosis.inference import (
    respond,
)
from subzero.model import Model
from subzero.synthetic.reference_run import simulate_reference

CHANNELS = ("surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth")
SAMPLES = np.arange(0.0, 30.01, 0.1)


@pytest.fixture(scope="module")
def setting():
    trial = subzero.load_scenario("fig6")
    return Setting(trial=trial, model=Model.of(trial))


def started(setting, name, time, *values):
    return with_onset(all_effects()[name], time).apply(setting, *values)


def test_a_jammed_rudder_stands_where_it_is_told_from_its_time_on():
    trial = subzero.load_scenario("zigzag")
    setting = Setting(trial=trial, model=Model.of(trial))
    jammed = started(setting, "rudder_jam", 12.0, 1.0, -3.0)
    angle = respond(jammed, SAMPLES, ("rudder_angle",))["rudder_angle"]
    before = respond(setting, SAMPLES, ("rudder_angle",))["rudder_angle"]
    assert_allclose(angle[SAMPLES < 12.0], before[SAMPLES < 12.0], atol=1e-9)
    assert_allclose(angle[SAMPLES > 14.0], -3.0, atol=1e-3)
    assert np.ptp(before[SAMPLES > 14.0]) > 9.0  # a rudder that follows moves by then


def test_water_that_comes_in_weighs_as_much_as_has_come_in(setting):
    """Two newtons a minute from 6 s on: in each interval the model has the mean of what has come in by then."""
    flooded = started(setting, "flooding", 6.0, -2.0)
    nominal = setting.model.vehicle.buoyancy.net_buoyancy
    times = np.array([time for time, _ in flooded.later])
    force = np.array([model.vehicle.buoyancy.net_buoyancy - nominal for _, model in flooded.later])
    middle = times + 0.5 * np.diff(times, append=setting.trial.duration)
    assert_allclose(force, -2.0 / 60.0 * np.maximum(middle - 6.0, 0.0), atol=2e-4)
    assert times[0] <= 6.0


def test_growth_in_steps_is_growth(setting, monkeypatch):
    """A run whose model changes every second is that whose model changes with every exchange, but for little."""
    grown = started(setting, "fading_thrust", 7.3, -0.8)
    monkeypatch.setattr("subzero.diagnosis.hypothesis.effect.GROWTH_STEP_S", 0.1)
    finely = started(setting, "fading_thrust", 7.3, -0.8)
    assert len(finely.later) > 2 * len(grown.later)
    shown, finer = (respond(one, SAMPLES, CHANNELS) for one in (grown, finely))
    for name in CHANNELS:
        assert np.abs(shown[name] - finer[name]).max() < 0.05 * SPECS[name].noise


def test_growth_is_beside_what_else_begins_in_mid_trial(setting):
    """In either order: a rudder struck at 10 s, and weed from 5 s on."""
    drag = setting.model.vehicle.axial_drag.drag_coefficient
    one = started(started(setting, "fouling", 5.0, 1.0), "rudder_offset", 10.0, 2.0)
    other = started(started(setting, "rudder_offset", 10.0, 2.0), "fouling", 5.0, 1.0)
    for both in (one, other):
        last = both.later[-1][1].vehicle
        assert last.rudder_servo.offset == pytest.approx(np.radians(2.0))
        assert last.axial_drag.drag_coefficient == pytest.approx(drag * (1.0 + 24.5 / 60.0), rel=0.02)
        at_eight = [model for time, model in both.later if time <= 8.0][-1]
        assert at_eight.vehicle.rudder_servo.offset == 0.0


@pytest.mark.parametrize(
    "name, values, trial",
    [("rudder_jam", (1.0, 4.0), "zigzag"), ("flooding", (-3.0,), "dive")],
)
@pytest.mark.slow
def test_it_is_named_for_what_it_is(name, values, trial):
    rng, time = np.random.default_rng([5, len(name)]), 12.0
    flown = subzero.load_scenario(trial)
    nominal = Setting(trial=flown, model=Model.of(flown))
    longer = replace(nominal, trial=replace(flown, duration=flown.duration + 1.0))
    times = np.arange(0.0, flown.duration + 1e-9, 0.1)
    shown = simulate_reference(started(longer, name, time, *values), times, CHANNELS)
    noisy = {
        channel: column + SPECS[channel].noise * rng.standard_normal(times.size)
        for channel, column in shown.items()
    }
    record = subzero.Record(source="planted", time=times, values=noisy)
    verdict = diagnose(subzero.Logged(record=record, setting=nominal, name=trial), budget="verdict")
    (cause,) = verdict.causes
    assert (verdict.verdict, cause.id) == ("cause_named", name)
    assert cause.start_time == pytest.approx(time, abs=1.0)
    for number, value in zip(cause.parameters.values(), values, strict=True):
        assert number.low <= number.value <= number.high
        assert number.deviation == pytest.approx(value, rel=0.2)
