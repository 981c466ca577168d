"""A calibration of a linear vehicle is that of the textbook.

Verifies: fit, covariance, held-out prediction, profile and undetermined directions (`subzero.calibration`).
Configuration: a residual y − J z of drawn numbers, so that no run is made. Tolerance: that of the arithmetic, as a step
on a parabola ends in its minimum; 2 % where blocks begin a sample late.

    z = M Jᵀ y,  M = (JᵀJ + D⁻¹)⁻¹,  −2 log posterior rises by x²/M_kk where z_k is held x away (Rasmussen 2006, 2.8)
"""

from dataclasses import dataclass

import numpy as np
import pytest

from subzero.calibration.assessment import _without, directions
from subzero.calibration.fit import Fitted, covariance, held_at
from subzero.calibration.numbers import Number
from subzero.diagnosis import Effect, Parameter
from subzero.diagnosis.inference import Fit, Noise, Observed, Problem, entries_of, refit

ROWS, SAMPLES = 60, 30


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear(Problem):
    """Two records of one channel whose residuals are y − J z."""

    J: np.ndarray
    y: np.ndarray

    def residual(self, z):
        return self.y - self.J @ z

    def jacobian(self, z):
        return self.J

    def central_jacobian(self, z):
        return self.J


def observed(name, step=0.1):
    time = step * np.arange(SAMPLES)
    noise = Noise(white=1.0, used=np.ones(SAMPLES, dtype=bool), time=time)
    return Observed(name=name, time=time, values={}, noise={"heading": noise}, setting=None)


def linear(J, y, records=None):
    def nothing(setting, size):
        return setting

    wide = Parameter(name="size", unit="1", tolerance=1.0, scale=1.0, low=-100.0, high=100.0)
    effects = [Effect(id=f"e{k}", sentence="it is another", slot="hull", apply=nothing, parameters=(wide,))
               for k in range(J.shape[1])]  # fmt: skip
    records = records or (observed("one"), observed("other"))
    return Linear(records=records, entries=entries_of(effects, (), 1), J=J, y=y)


@pytest.fixture
def drawn():
    rng = np.random.default_rng(5)
    J = rng.normal(size=(ROWS, 3))
    J[:, 2] *= 0.1
    return J, J @ [1.5, -2.0, 3.0] + rng.normal(size=ROWS), np.array([1.0, 4.0, 0.5])


def fit_of(problem, D, start=0.0):
    fit = refit(problem, np.full(D.size, start), D, precise=True)
    assert fit.converged
    return fit


@pytest.mark.parametrize("start", [0.0, -3.0])
def test_the_fit_is_the_mean_of_the_posterior_wherever_it_begins(drawn, start):
    J, y, D = drawn
    M = np.linalg.inv(J.T @ J + np.diag(1.0 / D))
    assert fit_of(linear(J, y), D, start).z == pytest.approx(M @ J.T @ y, rel=1e-9)


def test_a_number_held_elsewhere_costs_what_its_variance_says(drawn):
    J, y, D = drawn
    M, problem = np.linalg.inv(J.T @ J + np.diag(1.0 / D)), linear(J, y)
    for k in range(3):
        _, rise = held_at(problem, fit_of(problem, D), k, 0.7)
        assert rise == pytest.approx(0.49 / M[k, k], rel=1e-9)


def test_a_record_is_predicted_by_the_others_alone(drawn):
    J, y, D = drawn
    y[:SAMPLES] += 5.0
    problem = linear(J, y)
    work = Fitted(problem=problem, fit=fit_of(problem, D), M=np.eye(3), settled=True)
    rest, own = slice(SAMPLES, None), slice(SAMPLES)
    alone = np.linalg.solve(J[rest].T @ J[rest] + np.diag(1.0 / D), J[rest].T @ y[rest])
    assert _without(work, 0)[own] == pytest.approx(y[own] - J[own] @ alone, rel=1e-9)


def test_what_lasts_through_blocks_widens_by_the_root_of_their_length():
    """A mean of n samples that agree m at a time has the variance m/n, and not 1/n."""
    length, count = 20, 100
    time = 0.1 * np.arange(count * length)
    noise = Noise(white=1.0, used=np.ones(time.size, dtype=bool), time=time + 1e-6)
    record = Observed(name="one", time=time, values={}, noise={"heading": noise}, setting=None)
    r = np.repeat(np.resize([1.0, -1.0], count), length)
    J, D = np.ones((time.size, 1)), np.array([1e12])
    fit = Fit(z=np.zeros(1), r=r, J=J, D=D, objective=0.5 * float(r @ r), converged=True)
    found = covariance(linear(J, r, (record,)), fit)
    assert found[0, 0] == pytest.approx(length / time.size, rel=0.02)


def test_a_direction_that_is_hardly_shown_keeps_the_share_that_its_information_says():
    """Information s along a direction, in units of the prior, leaves 1/√(1 + s) of the standard deviation."""
    numbers = [Number(name=f"vehicle.hull.n{k}", unit="1", nominal=1.0, prior_sd=sd, tolerance=0.1, step=0.1,
                      low=-9.0, high=9.0)
               for k, sd in enumerate((0.5, 2.0))]  # fmt: skip
    prior, seen, hidden = np.diag([2.0, 0.5]), np.array([0.6, 0.8]), np.array([0.8, -0.6])
    information = prior @ (np.eye(2) + 1e4 * np.outer(seen, seen) + 1.25 * np.outer(hidden, hidden)) @ prior
    (found,) = directions(numbers, np.linalg.inv(information))
    assert found.left == pytest.approx(1.0 / 1.5)
    assert found.parts["vehicle.hull.n0"] == pytest.approx(0.8 * 0.5 / 1.5)
    assert found.parts["vehicle.hull.n1"] == pytest.approx(-0.6 * 2.0 / 1.5)
