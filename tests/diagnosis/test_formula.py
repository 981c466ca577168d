"""The formula of a missing force: the right feature, coefficient and window, from what data say of the force.

Configuration: 30 s of fig6, where data measure the force at knots directly, to 20 mN; and six noisy channels. What
features are along the run is taken from a simulation of the trial as it is, whose steps are finer.
"""

import dataclasses

import numpy as np
import pytest

import subzero
from subzero.diagnosis.inference import (
    ForceInformation,
    describe,
    estimate_force,
    with_missing_force,
)
from subzero.external_force import FEATURES, MissingForce, Term

from .conftest import nominal

TIMES = np.linspace(0.0, 30.0, 301)


@pytest.fixture(scope="module")
def estimated(plant):
    """Return a force that was estimated where there is none, on a nominal run."""
    planted = plant()
    found = estimate_force(planted.problem, planted.fit(), "X")
    return dataclasses.replace(found, fit=dataclasses.replace(found.fit, z=np.zeros_like(found.fit.z)))


@pytest.fixture(scope="module")
def features():
    """Return the features that are asked for along the nominal run, at TIMES."""
    return along(nominal(30.0))


def along(setting):
    run = subzero.simulate(setting.trial, model=setting.model)
    shown = {name: np.interp(TIMES, run.time, run[name])
             for name in ("surge_speed", "propeller_speed", "cable_length", "rudder_angle")}  # fmt: skip
    u = shown["surge_speed"]
    return {
        "u|u|": u * np.abs(u),
        "wet_length": shown["cable_length"],
        "time*u2": TIMES * u**2,
        "n u": shown["propeller_speed"] * u,
        "rudder_angle*u2": np.radians(shown["rudder_angle"]) * u**2,
    }


def reported(estimated, force, axis="X", sd=0.02):
    """Return the formula of a force (n,) that data measure at knots, with noise."""
    knots = estimated.unknown.time
    hats = np.maximum(1.0 - np.abs(np.subtract.outer(TIMES, knots)) / (knots[1] - knots[0]), 0.0)
    at_knots = np.linalg.lstsq(hats, force, rcond=None)[0]
    noisy = at_knots + sd * np.random.default_rng(0).standard_normal(knots.size)
    data = ForceInformation(np.eye(knots.size) / sd**2, noisy / sd**2)
    unknown = dataclasses.replace(estimated.unknown, axis=axis)
    return describe(dataclasses.replace(estimated, data=data, unknown=unknown))


@pytest.mark.long
@pytest.mark.parametrize("feature", ["u|u|", "wet_length", "time*u2", "n u"])
def test_the_feature_is_found_with_its_coefficient(estimated, features, feature):
    c = -0.5 / np.abs(features[feature]).max()
    found = reported(estimated, c * features[feature])
    words, name, best, low, high = found.terms()[0]
    assert name == feature
    assert words == FEATURES[feature].words
    assert low < c < high or abs(best / c - 1.0) < 0.1
    assert next(iter(found.features)) == feature


def test_a_window_is_found(estimated, features):
    force = -0.6 * features["u|u|"] * ((TIMES >= 9.0) & (TIMES < 17.0))
    found = reported(estimated, force)
    assert (found.shapes[0].start, found.shapes[0].end) == (9.0, 17.0)
    assert "from 9 to 17 s" in found.terms()[0][0]
    assert np.sqrt(np.mean((found.force() - force) ** 2)) < 0.1 * 0.6


def test_a_window_is_never_moved_to_where_its_feature_does_nothing(estimated):
    """The rudder is out from 4.3 s on, and does something up to 5 s: a window that ends at 4.2 s holds nothing."""
    problem, setting = estimated.problem, nominal(30.0)
    values = np.array([[25.0, 0.0, 0.0, 0.0], [25.0, 0.1, 0.0, 0.0], [25.0, 0.0, 0.0, 0.0]])
    commands = dataclasses.replace(setting.trial.commands, time=np.array([0.0, 4.3, 6.0]), values=values)
    setting = dataclasses.replace(setting, trial=dataclasses.replace(setting.trial, commands=commands))
    record = dataclasses.replace(problem.records[0], setting=setting)
    other = dataclasses.replace(estimated, problem=dataclasses.replace(problem, records=(record,)))
    force = 3.0 * along(setting)["rudder_angle*u2"] * (TIMES < 5.0)
    found = reported(other, force, "N", sd=0.001)
    assert found.terms()[0][1] == "rudder_angle*u2"
    assert np.isfinite(found.log_gain)
    assert found.shapes[0].end == pytest.approx(5.0, abs=0.3)


def test_a_wave_is_called_a_wave(estimated):
    found = reported(estimated, 0.3 * np.sin(2.0 * np.pi * TIMES / 5.0 + 1.0), "Y")
    words, name, amplitude, *_ = found.terms()[0]
    assert (found.axis, name, words) == ("Y", "wave", "a wave with a period of 5 s")
    assert amplitude == pytest.approx(0.3, rel=0.1)


@pytest.mark.long
def test_the_drag_that_the_model_lacks_is_found_in_a_record(plant, features):
    """X = −0.02 · wet length, far beyond the tolerances, from six noisy channels."""
    force = MissingForce(terms=(Term("X", "wet_length", -0.02),))
    planted = plant(lambda setting: with_missing_force(setting, force))
    found = describe(estimate_force(planted.problem, planted.fit(), "X"))
    known = -0.02 * features["wet_length"]
    assert "wet_length" in list(found.features)[:2]
    assert np.sqrt(np.mean((found.force() - known) ** 2)) < 0.3 * np.abs(known).max()


@pytest.mark.long
def test_a_push_that_rises_and_falls_is_no_box(estimated):
    """Half a sine squared, which is neither of the two: a box in its place would act before and behind it."""
    inside = np.clip((TIMES - 9.0) / 6.0, 0.0, 1.0)
    push = 0.3 * np.sin(np.pi * inside) ** 2
    found = reported(estimated, push, "Y")
    (shape,) = found.shapes
    assert shape.is_gradual
    assert "rising and falling from" in shape.words
    assert (shape.start, shape.end) == pytest.approx((9.0, 15.0), abs=1.0)
    assert np.abs(found.force() - push).max() < 0.06
    box = reported(estimated, np.where((TIMES >= 9.0) & (TIMES < 15.0), 0.3, 0.0), "Y").shapes[0]
    assert not box.is_gradual
