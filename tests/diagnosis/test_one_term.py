"""Formulas of one term: their evidence is that of a normal distribution; they tell what grows from a free force.

Configuration: fig6, 30 s, six channels with coloured noise, all parameters nominal but free within their tolerances.
"""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal

from subzero.diagnosis.inference import (
    FORCE,
    ForceInformation,
    Scale,
    Terms,
    candidate_of,
    force_columns,
    knots_of,
    latent_force_candidates,
    log_evidence_term,
    mixed,
    one_terms,
)
from subzero.external_force import AXES, MissingForce, Term


def heeled(setting):
    """Return a setting that heels more and more."""
    grows = MissingForce(terms=(Term("K", "time*u2", 0.02 / 30.0),))
    return setting.with_model(missing=grows)


@pytest.fixture(scope="module")
def planted(plant):
    return plant(heeled, seed=3)


def test_the_evidence_of_a_term_is_that_of_a_normal_distribution():
    random = np.random.default_rng(4)
    columns, r, phi = (
        random.standard_normal((30, 6)),
        random.standard_normal(30),
        random.standard_normal((6, 2, 2)),
    )
    phi[:, 0, 1] = 0.0  # of the two terms one has a phase
    data, a = ForceInformation(columns.T @ columns, columns.T @ r), 0.8

    def exact(term):
        both = columns @ phi[:, term]
        with_it = multivariate_normal(np.zeros(30), np.eye(30) + a**2 * both @ both.T)
        return with_it.logpdf(r) - multivariate_normal(np.zeros(30), np.eye(30)).logpdf(r)

    terms = Terms(phi, np.log([0.3, 0.7]))
    wanted = np.log(0.3 * np.exp(exact(0)) + 0.7 * np.exp(exact(1)))
    assert_allclose(log_evidence_term(data, terms, [a]), wanted, rtol=1e-9)


def test_a_mixture_over_kappa_weighs_what_each_says():
    scales = {1.0: Scale(np.log(0.2), np.ones(1)), 2.0: Scale(np.log(0.8), np.ones(1))}
    gain, best = mixed(scales, {1.0: 5.0, 2.0: 1.0})
    assert_allclose(gain, np.log(0.2 * np.exp(5.0) + 0.8 * np.exp(1.0)), rtol=1e-12)
    assert best == 1.0, "what is missing may be what asked for wide tolerances"


def test_the_weights_of_kappa_are_probabilities(planted):
    none = candidate_of(planted.problem, (), planted.fit())
    scales = none.scales(planted.problem)
    assert_allclose(sum(np.exp(one.log_weight) for one in scales.values()), 1.0, rtol=1e-12)
    assert_allclose(scales[2.0].D[0], 4.0 * scales[1.0].D[0], rtol=1e-12)


def test_terms_are_probable_in_all_and_of_size_one(planted):
    knots = knots_of(planted.problem)
    terms = one_terms(planted.problem, np.zeros(len(planted.problem.entries)), knots)
    assert set(terms) == set(AXES)
    for one in terms.values():
        assert_allclose(np.sum(np.exp(one.log_prior)), 1.0, rtol=1e-9)
        assert one.phi.shape[0] == knots.time.size
    phi = terms["X"].phi
    single = ~np.any(phi[:, :, 1] != 0.0, axis=0)
    assert np.median(np.abs(phi[:, single, 0]).max(axis=0)) == pytest.approx(1.0, abs=0.3)
    assert 1.0 - single.mean() < 0.1, "waves"


def test_a_growing_heel_is_seen_as_a_term_where_a_free_force_is_not(planted):
    fit, knots = planted.fit(), knots_of(planted.problem)
    columns = {FORCE + a: C for a, C in force_columns(planted.problem, fit.z, ("K", "N"), knots).items()}
    scales, terms = {1.0: Scale(0.0, fit.D)}, one_terms(planted.problem, fit.z, knots)
    free = latent_force_candidates(planted.problem, columns, fit, scales, knots)
    reported = latent_force_candidates(planted.problem, columns, fit, scales, knots, terms)
    assert reported[0].id == "unknown_force:K"
    assert reported[0].log_gain > free[0].log_gain + 3.0, (
        "one number in the place of a knot every two seconds"
    )


def test_two_records_have_terms_of_their_own(planted):
    record = planted.problem.records[0]
    both = dataclasses.replace(planted.problem, records=(record, record))
    knots = knots_of(both)
    phi = one_terms(both, np.zeros(len(both.entries)), knots)["X"].phi
    first = np.any(phi[knots.record == 0] != 0.0, axis=(0, 2))
    second = np.any(phi[knots.record == 1] != 0.0, axis=(0, 2))
    assert not np.any(first & second)
    assert first.sum() == second.sum() == phi.shape[1] // 2


def test_a_swell_is_seen_as_a_wave_where_a_free_force_is_not(planted):
    """A push to and fro of any phase, in one term of two numbers; of half the size a free force tells as much of it."""
    problem, fit, knots = planted.problem, planted.fit(), knots_of(planted.problem)
    (C,) = force_columns(problem, fit.z, ("X",), knots).values()
    push = 0.8 * np.sin(2.0 * np.pi * knots.time / 4.0 + 2.0)
    pushed = dataclasses.replace(fit, r=fit.r + C @ push)
    scales, terms = {1.0: Scale(0.0, fit.D)}, one_terms(problem, fit.z, knots)
    free, reported = (latent_force_candidates(problem, {FORCE + "X": C}, pushed, scales, knots, some)[0].log_gain
                  for some in (None, terms))  # fmt: skip
    assert reported > free + 3.0
