"""Probabilities from evidence: what was fitted, given up, or never tried; and when a cause is named.

Verifies: further causes are reported only if they are needed; nothing that was given up or never tried comes first by
a guess; the thresholds of the decision rule.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from subzero.diagnosis import (
    CALIBRATED,
    CAUSE_NAMED,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUTSIDE,
    UNDECIDED,
    catalogue,
)
from subzero.diagnosis.inference import (
    UNTRIED_LOG_POSTERIOR,
    Added,
    Beliefs,
    Candidate,
    ChangePointSummary,
    Screening,
    decide,
    is_near,
    occam_folded,
    practical_causes,
    qualified,
)


def fitted(**log_posteriors):
    """Return candidates of single causes, and of nothing as `none`."""
    found = {}
    for name, value in log_posteriors.items():
        ids = () if name == "none" else tuple(name.split("__"))
        found[ids] = Candidate(ids=ids, fit=None, log_evidence={}, log_posterior=value)
    return found


def screen(far=False, **log_posteriors):
    names = {
        () if name == "none" else tuple(name.split("__")): value for name, value in log_posteriors.items()
    }
    return Screening(log_posterior=names, count=30, far=far)


def test_a_further_cause_is_told_only_if_it_is_needed():
    assert occam_folded({("a",): 0.11, ("a", "b"): 0.89}) == {("a",): 1.0}
    needed = occam_folded({("a",): 0.09, ("a", "b"): 0.91})
    assert list(needed) == [("a", "b"), ("a",)]
    assert sum(needed.values()) == pytest.approx(1.0)


def test_what_was_given_up_stays_behind():
    beliefs = Beliefs(candidates=fitted(none=-50.0, a=-10.0), screen=screen(none=0.0, a=5.0, b=99.0), one_more={},
                      behind={("b",): -30.0})  # fmt: skip
    assert beliefs.log_posteriors()[("b",)] == -40.0, "not what the screen said"


def test_what_was_never_tried_comes_no_closer_than_a_guess_may():
    beliefs = Beliefs(
        candidates=fitted(none=-50.0, a=-10.0), screen=screen(none=0.0, a=5.0, b=99.0), one_more={}
    )
    assert beliefs.log_posteriors()[("b",)] == -10.0 - UNTRIED_LOG_POSTERIOR
    assert beliefs.log_total() == pytest.approx(
        -10.0 + math.log1p(math.exp(-UNTRIED_LOG_POSTERIOR)), abs=1e-6
    )


def test_a_pair_is_estimated_from_the_better_of_its_parts():
    seen = screen(none=0.0, a=5.0, b=1.0, a__b=3.0)
    beliefs = Beliefs(candidates=fitted(none=-50.0, a=-10.0), screen=seen, one_more={})
    assert beliefs.log_posteriors()[("a", "b")] == -12.0
    one_more = {("a", "b"): Added(("a",), -7.0)}
    beside = Beliefs(candidates=fitted(none=-50.0, a=-10.0), screen=seen, one_more=one_more)
    assert beside.log_posteriors()[("a", "b")] == -17.0, "estimated at a fit, that counts more"
    noisier = Beliefs(candidates=fitted(none=-70.0, a=-30.0), screen=seen, one_more=one_more)
    assert noisier.log_posteriors()[("a", "b")] == -37.0, "under another noise everything has moved"


def test_what_the_fit_of_a_cause_refutes_comes_back_in_no_pair():
    """A screen that has a cause 10 before nothing, whose fit is 20 behind it, was wrong by 30, beside others, too."""
    seen = screen(none=0.0, a=10.0, b=-5.0, a__b=4.0)
    beliefs = Beliefs(
        candidates=fitted(none=-50.0, b=-55.0), screen=seen, one_more={}, behind={("a",): -20.0}
    )
    assert beliefs.log_posteriors()[("a", "b")] == -50.0 + 4.0 - 30.0
    kept = Beliefs(candidates=fitted(none=-50.0, a=-30.0), screen=seen, one_more={})
    assert kept.log_posteriors()[("a", "b")] == -36.0, (
        "a fit that keeps more than was promised takes nothing away"
    )


def test_only_causes_beyond_four_tolerances_are_large():
    effects = [catalogue(("heading",))[name] for name in ("rudder_offset", "rudder_lag")]
    entries = [SimpleNamespace(effect=one, record=-1, parameter=one.parameters[0]) for one in effects]
    tolerance = np.array([one.parameters[0].tolerance for one in effects])
    ids = ("rudder_lag", "rudder_offset")
    assert practical_causes(entries, ids, tolerance * [-5.0, 3.0], 1.0) == ("rudder_offset",)
    assert practical_causes(entries, ids, tolerance * [-5.0, 3.0], 2.0) == (), "tolerances twice as wide"


@pytest.mark.parametrize(
    ("tolerances", "kappa", "excess", "said", "verdict"),
    [
        (3.9, 2.0, 1.0, NOTHING_WRONG, NOTHING_WRONG),
        (-4.1, 1.0, 1.0, NOTHING_WRONG, CALIBRATED),
        (0.5, 4.0, 1.0, NOTHING_WRONG, CALIBRATED),
        (0.5, 1.0, 1.5, NOTHING_WRONG, NOTHING_NEAR),
        (0.5, 1.0, 1.5, UNDECIDED, NOTHING_NEAR),
        (9.0, 4.0, 1.0, UNDECIDED, UNDECIDED),
        (9.0, 4.0, 1.5, CAUSE_NAMED, CAUSE_NAMED),
        (9.0, 4.0, 1.5, OUTSIDE, OUTSIDE),
    ],
)
def test_nothing_is_wrong_only_where_the_vehicle_stayed_what_it_was_and_noise_is_left(
    tolerances, kappa, excess, said, verdict
):
    effect = catalogue(("heading",))["rudder_offset"]
    tolerance = effect.parameters[0].tolerance
    entries = [SimpleNamespace(record=-1, parameter=effect.parameters[0]),
               SimpleNamespace(record=0, parameter=effect.parameters[0])]  # fmt: skip
    r = np.full(2000, np.sqrt(excess))
    fit = SimpleNamespace(z=tolerance * np.array([tolerances, 50.0]), r=r)
    assert qualified(said, entries, SimpleNamespace(fit=fit, kappa=kappa)) == verdict


@pytest.mark.parametrize(
    ("late", "verdict"),
    [
        (ChangePointSummary(0.95, True, 20.0), CAUSE_NAMED),
        (ChangePointSummary(0.85, True, 20.0), UNDECIDED),
        (ChangePointSummary(0.95, False, 20.0), UNDECIDED),
        (ChangePointSummary(0.95, True, 5.0), UNDECIDED),
        (ChangePointSummary(0.3, True, 20.0), NOTHING_WRONG),
    ],
)
def test_it_is_named_only_if_it_is_probable_large_and_apart(late, verdict):
    inside = {(): 0.7 if late.probability < 0.5 else 0.1, ("a",): 0.05}
    assert decide(inside, 0.0, True, 20.0, late) == verdict
    assert decide(inside, 0.95, True, 20.0, late) == OUTSIDE


@pytest.mark.parametrize(
    ("named", "z", "near"),
    [
        ((), {"sensor_bias:heading": 10.0}, True),
        ((), {"sensor_bias:heading": 483.0}, False),
        (("rudder_offset",), {"rudder_offset": 500.0}, True),
        (("rudder_offset",), {"rudder_offset": 500.0, "roll_stiffness": -42.0}, False),
        (("sensor_scale:heading",), {"sensor_scale:heading": 20.0}, True),
        (("sensor_scale:heading",), {"sensor_scale:heading": 900.0}, False),
        (("sensor_scale:heading",), {"sensor_scale:heading": -90.0}, False),
    ],
)
def test_an_explanation_is_near_unless_it_bends_what_it_does_not_name_or_is_no_sensor(named, z, near):
    """In tolerances; 3.4 is the most of records with known answers, 42 and 483 are foreign logs."""
    effects = [catalogue(("heading",))[id] for id in ("sensor_bias:heading", "sensor_scale:heading", "rudder_offset",
                                                      "roll_stiffness")]  # fmt: skip
    entries = [SimpleNamespace(record=-1, effect=one, parameter=one.parameters[0]) for one in effects]
    values = np.array([z.get(one.effect.id, 0.0) * one.parameter.tolerance for one in entries])
    assert is_near(entries, values, named) == near
