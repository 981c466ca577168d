"""A verdict is concluded from findings alone, and is as sure as its fits are.

Configuration: 12 s of fig6 with a rudder that is off its centre; and linear problems made by hand. Tolerance: none for
the verdict; linear algebra to 1e-8.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero.diagnosis import START, catalogue
from subzero.diagnosis.inference import (
    Candidate,
    Findings,
    Problem,
    Quadratic,
    entries_of,
    posterior,
    variances,
)
from subzero.diagnosis.inference.model_search import Search
from subzero.diagnosis.inference.out_of_catalogue import shares
from subzero.diagnosis.verdict.conclude import conclude, decided, remaining_models
from subzero.diagnosis.verdict.estimates import deviations
from subzero.diagnosis.verdict.follow_up import follow_up, ranked

OFFSET = 3.0
"""Of the rudder. [degree]"""


@pytest.fixture(scope="module")
def found(plant):
    """Return findings, their explanations by probability, and what simulations said of them."""
    planted = plant(
        lambda setting: catalogue(("heading",))["rudder_offset"].apply(setting, OFFSET), duration=12.0
    )
    search = Search(problem=planted.problem, progress=lambda share, words: None)
    search.begin()
    search.screen_causes()
    search.fit_all([(), ("rudder_offset",), ("yaw_damping",)])
    search.refine()
    findings = Findings(search=search, budget="verdict")
    known = ranked(findings)
    return findings, known, follow_up(findings, known)


@pytest.fixture
def no_simulation(monkeypatch):
    """Let every simulation, and every fit, which needs some or kept ones, be an error."""

    def simulated(*_args, **_options):
        raise AssertionError("a conclusion simulates nothing")

    monkeypatch.setattr("subzero.diagnosis.inference.simulator._run", simulated)
    monkeypatch.setattr(Problem, "tracks", simulated)


@pytest.mark.long
def test_a_verdict_needs_no_simulation_behind_its_findings(found, no_simulation):
    findings, known, more = found
    with pytest.raises(AssertionError, match="simulates nothing"):
        findings.problem.residual(np.zeros(len(findings.problem.entries)))
    verdict = conclude(findings, known, more)
    (cause,) = verdict.causes
    assert (verdict.verdict, cause.id) == ("cause_named", "rudder_offset")
    angle = cause.parameters["angle"]
    assert angle.low < OFFSET < angle.high
    assert decided(findings, known) == verdict.verdict
    assert ("rudder_offset",) in remaining_models(known).hypotheses


def test_a_verdict_is_the_same_however_often_it_is_concluded(found, no_simulation):
    findings, known, more = found
    one, other = conclude(findings, known, more), conclude(findings, known, more)
    assert (one.sentence, one.probabilities, one.causes) == (
        other.sentence,
        other.probabilities,
        other.causes,
    )
    assert one.rivals == other.rivals
    assert one.deviations == other.deviations


@pytest.mark.parametrize("sure", [1.0, 4.0])
def test_an_interval_is_that_of_the_scale_that_is_believed(sure):
    random, entries = np.random.default_rng(4), entries_of(tuple(catalogue(("heading",)).values()), START, 1)
    J, r = random.normal(size=(90, len(entries))), random.normal(size=90)
    ids = ("rudder_offset",)
    found = posterior(Quadratic.at(np.zeros(len(entries)), r, J), variances(entries, ids, sure))
    fit = SimpleNamespace(z=found.z, quadratic=Quadratic.at(found.z, r - J @ found.z, J))
    log = {kappa: 0.0 if kappa == sure else -500.0 for kappa in (1.0, 2.0, 4.0)}
    one = Candidate(ids=ids, fit=fit, log_evidence=log, log_posterior=0.0)
    reported = deviations(SimpleNamespace(problem=SimpleNamespace(entries=entries)), one)
    tolerance = np.array([entry.parameter.tolerance for entry in entries])
    assert_allclose([sd for _, sd in reported.values()] * tolerance, np.sqrt(np.diag(found.M)), rtol=1e-8)


def test_a_drift_is_told_with_the_cause_beside_it_that_it_needs_and_without_one_that_it_does_not():
    """By itself the first explains nothing; the second explains by itself what it does beside a cause."""
    beliefs = SimpleNamespace(probabilities=lambda problem: {("roll_stiffness",): 1.0}, log_total=lambda: 0.0)
    log = {
        ("roll_stiffness", "sensor_drift:surge_speed"): -1.0,
        ("sensor_drift:surge_speed",): -50.0,
        ("roll_stiffness", "unknown_force:X"): -1.0,
        ("unknown_force:X",): -2.0,
    }
    outside = [
        SimpleNamespace(causes=ids[:-1], id=ids[-1], log_posterior=value) for ids, value in log.items()
    ]
    inside, found = shares(SimpleNamespace(beliefs=beliefs, problem=None), outside)
    assert list(found)[:2] == [("unknown_force:X",), ("roll_stiffness", "sensor_drift:surge_speed")]
    assert ("roll_stiffness", "unknown_force:X") not in found
    assert sum(inside.values()) + sum(found.values()) == pytest.approx(1.0, abs=1e-12)
