"""What is believed before a record is seen; that what is measured stays as it was."""

from math import comb
from types import SimpleNamespace

import numpy as np
import pytest

from subzero.diagnosis import catalogue
from subzero.diagnosis.inference import (
    PRIOR,
    Fit,
    Observed,
    Quadratic,
    candidate_of,
    entries_of,
    log_prior,
    objective,
    posterior,
    variances,
)
from subzero.diagnosis.inference.linear_gaussian import log_beyond
from subzero.diagnosis.inference.screening import with_one_added


def test_prior_probabilities_sum_to_one():
    """Those of the kinds, and those of every hypothesis within the kinds that have a list."""
    assert sum(PRIOR.values()) == pytest.approx(1.0)
    count = 30
    for size, kind in enumerate(("none", "single", "pair", "more")):
        one = np.exp(log_prior(tuple(map(str, range(size))), count))
        assert one * comb(count, size) == pytest.approx(PRIOR[kind])


def test_a_correction_of_the_simulation_leaves_what_was_measured():
    values = {"depth": np.array([1.0, 2.0])}
    record = Observed(name="x", time=np.arange(2.0), values=values, noise={}, setting=None)
    twice = record.corrected({"depth": np.array([0.5, 0.0])}).corrected({"depth": np.array([0.25, 1.0])})
    assert twice.values["depth"].tolist() == [1.0, 2.0]
    assert twice.correction["depth"].tolist() == [0.75, 1.0]


def test_the_evidence_of_causes_beyond_calibration_is_its_integral():
    """By quadrature over two causes, beside what is within its tolerance."""
    rng = np.random.default_rng(1)
    Q, _ = np.linalg.qr(rng.standard_normal((30, 3)))  # so that the causes are independent, given the data
    J, D, within = Q * [1.0, 4.0, 9.0], np.array([0.01, 0.5, 0.3]), np.array([0.02, 0.01])
    r = J @ np.array([0.1, 0.4, -0.1]) + rng.standard_normal(30)
    S = np.eye(30) + D[0] * np.outer(J[:, 0], J[:, 0])
    at = np.linspace(-6.0, 6.0, 1201)
    z = np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1).reshape(-1, 2)
    A, b = (J[:, 1:].T @ np.linalg.solve(S, part) for part in (J[:, 1:], r))
    log = (
        -0.5 * (r @ np.linalg.solve(S, r) - 2.0 * z @ b + np.sum(z @ A * z, axis=1))
        - 0.5 * np.linalg.slogdet(S)[1]
    )
    normal = np.prod(np.exp(-0.5 * z**2 / D[1:]) / np.sqrt(2.0 * np.pi * D[1:]), axis=1)
    beyond = np.prod(-np.expm1(-0.5 * z**2 / within), axis=1)
    exact = np.log(np.sum(np.exp(log) * normal * beyond) / np.sum(normal * beyond))
    said = posterior(Quadratic.at(np.zeros(3), r, J), D)
    found = said.log_evidence + log_beyond(said.z[1:], np.diag(said.M)[1:], D[1:], within, [1, 1])
    assert found == pytest.approx(exact, abs=1e-6)


@pytest.mark.parametrize(
    ("mean", "variance", "least", "most"),
    [(0.0, 1e-6, -20.0, -8.0), (0.0, 1.0, 0.0, 0.0), (5.0, 1e-4, 0.0, 0.5)],
)
def test_only_a_cause_that_surely_does_next_to_nothing_is_less_probable(mean, variance, least, most):
    """Not one that is not seen, nor one that is large."""
    found = log_beyond(np.array([mean]), np.array([variance]), np.array([1.0]), np.array([0.09]), [1])
    assert least - 1e-9 <= found <= most + 1e-9


def test_a_fitted_cause_and_one_that_is_freed_in_the_linear_problem_have_the_same_evidence():
    """Two formulas: around the fit of the cause, and from that of none; causes with one parameter and with two."""
    names = ("rudder_offset", "stern_plane_offset", "rudder_lift_slope")
    entries = entries_of([catalogue(())[name] for name in names], (), 1)
    problem, rng = SimpleNamespace(entries=entries), np.random.default_rng(3)
    J = rng.standard_normal((60, len(entries))) / np.sqrt(variances(entries, (), 4.0))
    whole = J @ (0.3 * np.sqrt(variances(entries, (), 4.0))) + rng.standard_normal(60)

    def fitted(ids):
        D = variances(entries, ids, 1.0)
        z = posterior(Quadratic.at(np.zeros(len(entries)), whole, J), D).z
        r = whole - J @ z
        fit = Fit(
            z=z,
            r=r,
            J=J,
            D=D,
            objective=objective(r, z, D),
            converged=True,
            predicted_gain=0.0,
            fresh=0,
            made_at=z,
        )
        return candidate_of(problem, ids, fit)

    freed = with_one_added(problem, fitted(()))
    for name in names:
        assert fitted((name,)).log_posterior == pytest.approx(freed[(name,)], abs=1e-6)
