"""The formula of a missing force: the right feature, coefficient and window, from what data say of the force."""

import numpy as np
import pytest

from subzero.diagnosis.inference import ForceInformation, estimate_force, without_force
from subzero.diagnosis.inference.basis import (
    Shape,
    all_shapes,
    at_knots,
    factors_along,
    samples_of,
    shifted,
    size_of,
    windowed,
)
from subzero.diagnosis.inference.force_formula import as_missing, choose, describe
from subzero.external_force import FEATURES, MissingForce, Term, feature_value, history_at

TIMES, KNOTS = samples_of(30.0), np.linspace(0.0, 30.0, 31)


@pytest.fixture(scope="module")
def track(plant):
    planted = plant()
    factors = factors_along(planted.problem.records[0].setting, TIMES)
    return planted, factors, all_shapes(factors, TIMES)


def seen_of(force, sd=0.02, seed=0):
    """What data would say that measure the force at knots directly, with noise."""
    to_knots = at_knots(TIMES, KNOTS)
    noisy = to_knots @ force + sd * np.random.default_rng(seed).standard_normal(KNOTS.size)
    return ForceInformation(np.eye(KNOTS.size) / sd**2, noisy / sd**2)


def chosen(shapes, force, axis):
    return choose(shapes, seen_of(force), at_knots(TIMES, KNOTS), axis, [0.05, 0.2, 1.0])


@pytest.mark.parametrize("feature", ["u|u|", "wet_length", "time*u2", "n u"])
def test_the_feature_is_found_with_its_coefficient(track, feature):
    _, factors, shapes = track
    value = feature_value(feature, factors)
    c = -0.5 / np.abs(value).max()
    found = chosen(shapes, c * value, "X")
    words, name, best, low, high = found.terms()[0]
    assert name == feature
    assert words == FEATURES[feature].words
    assert low < c < high or abs(best / c - 1.0) < 0.1
    assert next(iter(found.features)) == feature


def test_a_plain_formula_becomes_terms_and_a_window_a_history(track):
    _, factors, shapes = track
    force = -0.6 * feature_value("u|u|", factors)
    plain, window = chosen(shapes, force, "X"), chosen(shapes, force * (TIMES >= 12.0), "X")
    assert as_missing(plain).terms == (Term("X", "u|u|", plain.terms()[0][2]),)
    assert as_missing(plain).time == ()
    assert not as_missing(window).terms
    assert np.abs(history_at(as_missing(window), TIMES)[:, 0] - window.force()).max() < 1e-9


def test_a_window_is_found(track):
    _, factors, shapes = track
    force = -0.6 * feature_value("u|u|", factors) * ((TIMES >= 9.0) & (TIMES < 17.0))
    found = chosen(shapes, force, "X")
    assert (found.shapes[0].start, found.shapes[0].end) == (9.0, 17.0)
    assert "from 9 to 17 s" in found.terms()[0][0]
    assert np.sqrt(np.mean((found.force() - force) ** 2)) < 0.1 * 0.6


def test_a_short_window_is_moved_but_never_away_and_never_to_where_its_feature_does_nothing():
    rudder = np.where((TIMES > 4.9) & (TIMES < 5.5), 0.1, 0.0)[:, None]  # out for half a second
    plain = Shape(feature="rudder_angle*u2", words="the rudder", columns=rudder)
    window = next(
        one for one in windowed(plain, TIMES, np.arange(4.0, 7.0)) if (one.start, one.end) == (5.0, 6.0)
    )
    tried = shifted(window, plain, TIMES)
    assert len(tried) > 10
    assert all(np.isfinite(size_of(one)) and size_of(one) > 0.0 for one in tried)


def test_a_wave_is_called_a_wave(track):
    _, _, shapes = track
    found = chosen(shapes, 0.3 * np.sin(2.0 * np.pi * TIMES / 5.0 + 1.0), "Y")
    words, name, amplitude, *_ = found.terms()[0]
    assert (name, words) == ("wave", "a wave with a period of 5 s")
    assert amplitude == pytest.approx(0.3, rel=0.1)


def test_the_drag_that_the_model_lacks_is_found_in_a_record(plant):
    """X = −0.02 · wet length, far beyond the tolerances, from six noisy channels."""
    force = MissingForce(terms=(Term("X", "wet_length", -0.02),))
    planted = plant(lambda setting: without_force(setting, force))
    found = describe(estimate_force(planted.problem, planted.fit(), "X"))
    assert "wet_length" in list(found.features)[:2]
    known = np.interp(TIMES, KNOTS, -0.02 * _length(planted))
    assert np.sqrt(np.mean((found.force() - known) ** 2)) < 0.3 * np.abs(known).max()


def _length(planted):
    factors = factors_along(planted.problem.records[0].setting, KNOTS[:-1])
    length = feature_value("wet_length", factors)
    return np.append(length, length[-1])
