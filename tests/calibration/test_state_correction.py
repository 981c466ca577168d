"""Simulations are led along what was measured, without a trace where the vehicle is the true one.

Verifies: `subzero.calibration.state_correction`. Configuration: fig6, six channels, no noise; a body that turns at a
constant rate about one axis, over all angles.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import subzero
from subzero.calibration.state_correction import led, velocities
from subzero.channels import DEGREE
from subzero.diagnosis import Logged, Setting
from subzero.diagnosis.inference import pose, respond
from subzero.model import Model
from subzero.records.record import Record

CHANNELS = ("surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth")
TIME = np.arange(0.0, 20.01, 0.1)


def problem_of(factor):
    """The problem of a record of fig6, posed with a vehicle whose rudder lifts more by a factor."""
    trial = replace(subzero.load_scenario("fig6"), duration=20.0)
    setting = Setting(trial=trial, model=Model.of(trial))
    values = respond(setting, TIME, CHANNELS)
    other = setting.with_vehicle(
        rudder__lift_slope=lambda old: factor * old, axial_drag__drag_coefficient=lambda old: factor * old
    )
    record = Record(source="made", time=TIME, values=values)
    return pose([Logged(record=record, setting=other, name="made")])


def misfit(problem):
    return float(np.sqrt(np.mean(problem.residual(np.zeros(len(problem.entries))) ** 2)))


def test_the_true_vehicle_is_led_nowhere():
    assert misfit(led(problem_of(1.0), 0.3)) < 0.3


def test_a_wrong_vehicle_stays_close_when_it_is_led_the_closer_the_sooner():
    problem = problem_of(1.4)
    free, slowly, soon = (misfit(one) for one in (problem, led(problem, 1.5), led(problem, 0.3)))
    assert soon < slowly < free
    assert soon < 0.5 * free


@pytest.mark.parametrize(("axis", "rate"), [("K", 0.9), ("M", -0.4), ("N", 0.5)])
def test_rates_are_those_of_the_body_and_know_no_whole_turns(axis, rate):
    vector = np.zeros((TIME.size, 3))
    vector[:, "KMN".index(axis)] = rate * TIME
    first = Rotation.from_euler("ZYX", [0.3, 0.2, -0.4])
    heading, pitch, roll = DEGREE * (first * Rotation.from_rotvec(vector)).as_euler("ZYX").T
    values = {"heading": heading, "pitch": pitch, "roll_angle": roll}
    used = np.ones(TIME.size, bool)
    noise = {name: SimpleNamespace(used=used) for name in values}
    found = velocities(SimpleNamespace(time=TIME, values=values, noise=noise), TIME)
    for name in "KMN":
        assert found[name] == pytest.approx(np.full(TIME.size, rate if name == axis else 0.0), abs=1e-3)


def test_what_was_not_measured_is_not_led():
    noise = {"heading": SimpleNamespace(used=np.ones(TIME.size, bool)),
             "surge_speed": SimpleNamespace(used=np.arange(TIME.size) < 3)}  # fmt: skip
    values = {"heading": 2.0 * TIME, "surge_speed": np.ones(TIME.size)}
    found = velocities(SimpleNamespace(time=TIME, values=values, noise=noise), TIME)
    assert set(found) == {"N"}
    assert found["N"] == pytest.approx(np.full(TIME.size, 2.0 / DEGREE), abs=1e-6)
