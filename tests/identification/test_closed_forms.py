"""Noise, evidence and estimates against closed forms.

Tolerance: rounding errors, 1e-8; Laplace is exact for a linear problem, whose covariances are summed in another order,
1e-6.
"""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

import subzero.diagnosis as sd
from subzero.identification.fit import Levels, linearised
from subzero.identification.noise import Filter, Noise, NoisePrior, level_of, resolution_of
from subzero.identification.problem import Problem


def line(p, u, t):
    """A model that is linear in its numbers."""
    return {"y": p["a"] + p["b"] * t + u["push"]}


@pytest.fixture
def problem():
    rng = np.random.default_rng(3)
    time = np.sort(rng.uniform(0.0, 10.0, 40))
    record = sd.Record(time, {"y": 1.0 + 0.5 * time + 0.1 * rng.standard_normal(40)})
    numbers = [sd.Number("a", 0.8, tolerance=0.3), sd.Number("b", 0.6, tolerance=0.2)]
    unknown = [sd.Unknown("push", size=0.2, time=3.0)]
    sensor = sd.Sensor(noise=0.1, resolution=0.0)
    return Problem(sd.Model(line, {"y": sensor}, parameters=numbers, unknown=unknown), [record])


def covariance(noise, time):
    return noise.white**2 * np.eye(time.size) + noise.slow**2 * np.exp(
        -np.abs(np.subtract.outer(time, time)) / noise.time
    )


def test_the_filter_whitens_as_the_dense_covariance_does():
    rng = np.random.default_rng(1)
    time, noise = np.cumsum(rng.uniform(0.05, 0.4, 60)), Noise(0.3, 0.7, 1.5)
    values = rng.standard_normal((60, 2))
    filtered = Filter.of(noise, 0.0, time, np.ones(time.size))
    dense = covariance(noise, time)
    squares = np.sum(filtered.whiten(values) ** 2, axis=0)
    np.testing.assert_allclose(
        squares, np.einsum("ij,ij->j", values, np.linalg.solve(dense, values)), rtol=1e-8
    )
    assert filtered.log_scale == pytest.approx(0.5 * np.linalg.slogdet(dense)[1], rel=1e-8)


def test_the_evidence_of_a_linear_model_is_the_density_of_its_record(problem):
    noise = Noise(0.1, 0.05, 0.7)
    entries = problem.entries(())
    centre = np.array([entry.centre for entry in entries])
    levels = Levels({"y": noise}, {"push": 1.7})
    linear = linearised(problem, (), entries, centre + 0.01, levels)
    record = problem.records[0]
    knots = problem.knots[0]["push"]
    hats = np.array([np.interp(record.time, knots, row) for row in np.eye(knots.size)])
    spread = covariance(noise, record.time) + 0.3**2 + 0.2**2 * np.outer(record.time, record.time)
    spread += (1.7 * 0.2) ** 2 * hats.T @ hats
    exact = multivariate_normal.logpdf(record.columns["y"], 0.8 + 0.6 * record.time, spread)
    found = linear.evidence(problem)[1] - prior_of(problem, linear)
    assert found == pytest.approx(exact, abs=1e-6)


def prior_of(problem, linear):
    """Return the log prior of noise and sizes, as its definition says."""
    prior = problem.channels["y"].prior
    return prior.log_density(linear.levels.noise["y"]) - 0.5 * np.log(1.7) ** 2


def test_the_evidence_does_not_depend_on_where_a_linear_model_is_linearised(problem):
    entries = problem.entries(())
    levels = Levels({"y": Noise(0.1, 0.05, 0.7)}, {"push": 1.0})
    found = [
        linearised(problem, (), entries, np.full(len(entries), at), levels).evidence(problem)[1]
        for at in (0.0, 0.5, 1.0)
    ]
    assert np.ptp(found) < 1e-6


def test_a_step_goes_to_the_mean_of_the_posterior(problem):
    entries = problem.entries(())
    noise = Noise(0.1, 0.05, 0.7)
    linear = linearised(problem, (), entries, np.zeros(len(entries)), Levels({"y": noise}, {"push": 1.0}))
    mean = linear.x + linear.evidence(problem)[0]
    time, y = problem.records[0].time, problem.records[0].columns["y"]
    hats = np.array([np.interp(time, problem.knots[0]["push"], row) for row in np.eye(len(entries) - 2)])
    J = np.column_stack([np.ones(40), time, hats.T])
    D = np.diag([0.3**2, 0.2**2, *np.full(len(entries) - 2, 0.2**2)])
    centre = np.array([entry.centre for entry in entries])
    gain = D @ J.T @ np.linalg.inv(J @ D @ J.T + covariance(noise, time))
    np.testing.assert_allclose(mean, centre + gain @ (y - J @ centre), atol=1e-6)


def test_a_linearisation_shows_the_derivatives_of_the_model(problem):
    entries = problem.entries(())
    J = problem.jacobian((), entries, np.array([entry.centre for entry in entries]))["y"]
    np.testing.assert_allclose(J[:, 0], 1.0, atol=1e-8)
    np.testing.assert_allclose(J[:, 1], problem.records[0].time, atol=1e-8)


@pytest.mark.parametrize("step", [0.1, 0.25, 1.0])
def test_what_readings_are_rounded_to_is_read_off_them(step):
    values = np.random.default_rng(0).normal(0.0, 3.0, 400)
    assert resolution_of(step * np.rint(values / step)) == pytest.approx(step)
    assert resolution_of(values) == 0.0


def test_the_level_of_white_noise_on_a_slow_signal_is_read_off_a_record():
    t = np.arange(0.0, 60.0, 0.1)
    values = np.sin(0.3 * t) + 0.05 * np.random.default_rng(0).standard_normal(t.size)
    # 600 samples: the median of second differences has a standard deviation of about 6 %.
    assert level_of(values, 0.0) == pytest.approx(0.05, rel=0.2)


def test_a_declared_level_binds():
    prior = NoisePrior(level=0.1, resolution=0.0, interval=0.1, spread=0.1)
    assert prior.log_density(Noise(0.3, 0.03, 1.0)) == -np.inf
    assert prior.log_density(Noise(0.11, 0.03, 1.0)) > -2.0
