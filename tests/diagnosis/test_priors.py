"""What is believed before a record is seen and how sure it is behind it; that what is measured stays as it was."""

from math import comb
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero.diagnosis.hypothesis.catalogue import START, catalogue
from subzero.diagnosis.hypothesis.hypotheses import PRIOR, entries_of, log_prior, variances
from subzero.diagnosis.inference import Candidate, Observed, Quadratic, posterior
from subzero.diagnosis.verdict.estimates import deviations


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


@pytest.mark.parametrize("sure", [1.0, 4.0])
def test_an_interval_is_that_of_the_scale_that_is_believed(sure):
    random, entries = np.random.default_rng(4), entries_of(tuple(catalogue(("heading",)).values()), START, 1)
    J, r = random.normal(size=(90, len(entries))), random.normal(size=90)
    ids = ("rudder_offset",)
    found = posterior(Quadratic.at(np.zeros(len(entries)), r, J), variances(entries, ids, sure))
    fit = SimpleNamespace(z=found.z, quadratic=Quadratic.at(found.z, r - J @ found.z, J))
    log = {kappa: 0.0 if kappa == sure else -500.0 for kappa in (1.0, 2.0, 4.0)}
    one = Candidate(ids=ids, fit=fit, log_evidence=log, log_posterior=0.0)
    told = deviations(SimpleNamespace(problem=SimpleNamespace(entries=entries)), one)
    tolerance = np.array([entry.parameter.tolerance for entry in entries])
    assert_allclose([sd for _, sd in told.values()] * tolerance, np.sqrt(np.diag(found.M)), rtol=1e-8)
