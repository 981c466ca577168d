"""The search's bookkeeping: what is known of hypotheses that were fitted, given up, or never tried.

Verifies: secants keep sensitivities true along a step; further causes are told only if they are needed; nothing that
was given up or never tried comes first by a guess.
"""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.diagnosis.hypothesis.catalogue import START, catalogue
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Parameter
from subzero.diagnosis.hypothesis.hypotheses import columns_of, entries_of, log_prior, nameable
from subzero.diagnosis.inference.laplace import Candidate
from subzero.diagnosis.inference.map_fit import broyden_update
from subzero.diagnosis.inference.model_average import (
    UNTRIED_LOG_POSTERIOR,
    Beliefs,
    occam_folded,
    practical_causes,
)
from subzero.diagnosis.inference.model_fits import MAX_RUNS_PER_RECORD
from subzero.diagnosis.inference.model_search import Search
from subzero.diagnosis.inference.problem import JACOBIAN_STEP, JACOBIAN_STEP_SHARE, Problem
from subzero.diagnosis.inference.screening import (
    MAX_STRAINED,
    STRAINED_TOLERANCES,
    Screening,
    is_close,
    screening_of,
    with_one_swapped,
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


def test_secants_explain_the_step_and_leave_other_directions():
    random = np.random.default_rng(1)
    J, step, change = random.normal(size=(9, 4)), random.normal(size=4), random.normal(size=9)
    D = np.array([1.0, 4.0, 0.01, 9.0])
    new = broyden_update(J, step, change, D)
    assert_allclose(new @ step, -change, atol=1e-12, err_msg="a residual falls by J times the step")
    other = np.array([step[1] * D[0], -step[0] * D[1], 0.0, 0.0])
    assert abs(step @ (other / D)) < 1e-12
    assert_allclose(new @ other, J @ other, atol=1e-12)


def racing(runs, records=1, **hopes):
    """Return the hypotheses that a race fits again, in turn: those with a hope above their log posterior of -9."""
    search = Search(
        problem=SimpleNamespace(kept=SimpleNamespace(asked=runs), records=records * [None]),
        progress=lambda share, words: None,
    )
    again = []

    def fit_again(one):
        again.append(one.ids[0])
        search.refined.add(one.ids)

    search._again = fit_again
    for name, hope in hopes.items():
        fit = SimpleNamespace(
            converged=hope is None, moved=lambda problem: np.inf, predicted_gain=(hope or -9.0) + 9.0
        )
        search.candidates[(name,)] = Candidate(ids=(name,), fit=fit, log_evidence={}, log_posterior=-9.0)
    search.refined |= {("best",), ("second",)}
    search.refine()
    return again


def test_a_race_ends_with_the_first_that_is_hopeless():
    hopes = {"best": None, "second": None, "near": -9.0, "far": -8.0}
    assert racing(0, **hopes) == ["far", "near"]


def test_after_many_runs_what_hopes_to_be_the_best_is_still_fitted_again():
    """A right pair whose first fit went nowhere is not lost because others have used up the runs."""
    hopes = {"best": None, "second": None, "hopes": 30.0}
    assert racing(MAX_RUNS_PER_RECORD + 1, **hopes) == ["hopes"]


def test_two_records_have_twice_the_runs():
    hopes = {"best": None, "second": None, "near": -12.0}
    assert racing(MAX_RUNS_PER_RECORD + 1, **hopes) == []
    assert racing(MAX_RUNS_PER_RECORD + 1, records=2, **hopes) == ["near"]


def test_steps_of_sensitivities_grow_with_what_is_there(plant):
    problem = plant(duration=6.0).problem
    k = next(k for k, one in enumerate(problem.entries) if one.effect.id == "rudder_offset")
    z, tolerance = np.zeros(len(problem.entries)), problem.entries[k].parameter.tolerance
    assert problem._moved(z, k)[k] == pytest.approx(JACOBIAN_STEP * tolerance)
    z[k] = -20.0 * tolerance
    assert abs(problem._moved(z, k)[k] - z[k]) == pytest.approx(20.0 * JACOBIAN_STEP_SHARE * tolerance)


def test_a_further_cause_is_told_only_if_it_is_needed():
    assert occam_folded({("a",): 0.21, ("a", "b"): 0.79}) == {("a",): 1.0}
    needed = occam_folded({("a",): 0.19, ("a", "b"): 0.81})
    assert list(needed) == [("a", "b"), ("a",)]
    assert sum(needed.values()) == pytest.approx(1.0)


def test_what_was_given_up_stays_behind():
    beliefs = Beliefs(candidates=fitted(none=-50.0, a=-10.0), screen=screen(none=0.0, a=5.0, b=99.0), beside={},
                      behind={("b",): -30.0})  # fmt: skip
    assert beliefs.log_posteriors()[("b",)] == -40.0, "not what the screen hoped"


def test_what_was_never_tried_comes_no_closer_than_a_guess_may():
    beliefs = Beliefs(
        candidates=fitted(none=-50.0, a=-10.0), screen=screen(none=0.0, a=5.0, b=99.0), beside={}
    )
    assert beliefs.log_posteriors()[("b",)] == -10.0 - UNTRIED_LOG_POSTERIOR
    assert beliefs.log_total() == pytest.approx(
        -10.0 + math.log1p(math.exp(-UNTRIED_LOG_POSTERIOR)), abs=1e-6
    )


def test_a_pair_is_estimated_from_the_better_of_its_parts():
    seen = screen(none=0.0, a=5.0, b=1.0, a__b=3.0)
    beliefs = Beliefs(candidates=fitted(none=-50.0, a=-10.0), screen=seen, beside={})
    assert beliefs.log_posteriors()[("a", "b")] == -12.0
    beside = Beliefs(candidates=fitted(none=-50.0, a=-10.0), screen=seen, beside={("a", "b"): -17.0})
    assert beside.log_posteriors()[("a", "b")] == -17.0, "estimated at a fit, that counts more"


def test_from_afar_a_further_cause_adds_nothing_but_its_prior():
    far = screen(far=True, none=0.0, a=5.0, b=1.0, a__b=99.0)
    added = log_prior(("a", "b"), 30) - log_prior(("a",), 30)
    assert far.adds(("a", "b"), ("a",)) == added < -3.0


def test_the_screen_keeps_the_best_of_a_size():
    seen = screen(none=0.0, a=5.0, b=1.0, c=-20.0, a__b=3.0)
    assert seen.best(1, 7, 12.0) == [("a",), ("b",)]
    assert seen.best(2, 7, 12.0) == [("a", "b")]


def test_only_causes_beyond_four_tolerances_are_large():
    effects = [catalogue(("heading",))[name] for name in ("rudder_offset", "rudder_lag")]
    entries = [SimpleNamespace(effect=one, record=-1, parameter=one.parameters[0]) for one in effects]
    tolerance = np.array([one.parameters[0].tolerance for one in effects])
    ids = ("rudder_lag", "rudder_offset")
    assert practical_causes(entries, ids, tolerance * [-5.0, 3.0], 1.0) == ("rudder_offset",)
    assert practical_causes(entries, ids, tolerance * [-5.0, 3.0], 2.0) == (), "tolerances twice as wide"


def test_a_bound_on_the_whole_value_follows_the_nominal_model():
    trial = subzero.load_scenario("fig6")
    setting = Setting(trial=trial, model=subzero.Model.of(trial))
    made = Parameter(
        name="x", unit="s", tolerance=0.1, scale=1.0, low=-9.0, nominal=lambda _: 0.15, least=0.06
    )
    assert made.within(setting).low == pytest.approx(-0.09)
    quick = dataclasses.replace(made, nominal=lambda _: 0.02)
    assert quick.within(setting).low == 0.0, "a model below the least stays as it is"


def test_a_large_effect_is_seen_from_afar_in_two_records(plant):
    """Even wide tolerances are not close: every cause is tried at some sizes, in both records side by side."""
    planted = plant(
        lambda setting: catalogue(("heading",))["roll_stiffness"].apply(setting, -0.6), duration=12.0
    )
    effects = list(dict.fromkeys(one.effect for one in planted.problem.entries if one.record < 0))
    both = Problem(records=planted.problem.records * 2, entries=entries_of(effects, START, 2))
    zero = np.zeros(len(both.entries))
    nominal = both.residual(zero), both.jacobian(zero)
    seen = screening_of(both, SimpleNamespace(r=nominal[0], z=zero, J=nominal[1]), nominal, far=True)
    assert seen.far
    assert seen.best(1, 1, np.inf) == [("roll_stiffness",)]
    assert seen.count == len(nameable(both.entries))


def test_several_residuals_are_those_of_each(plant):
    problem = plant(duration=6.0).problem
    random = np.random.default_rng(2)
    several = [0.01 * random.normal(size=len(problem.entries)) for _ in range(3)]
    several = [np.where([one.parameter.low == 0.0 for one in problem.entries], abs(z), z) for z in several]
    for z, r in zip(several, problem.residuals(several), strict=True):
        assert np.array_equal(r, problem.residual(z))


def test_a_cause_that_does_nothing_when_small_is_fitted_where_it_acts(plant):
    """With its slope at the nominal model, 0, the prior alone would draw a slow servo back to nothing."""
    slow = catalogue(("heading",))["rudder_rate_limit"]
    planted = plant(lambda setting: slow.apply(setting, 0.16), duration=16.0)
    search = Search(problem=planted.problem, progress=lambda share, words: None)
    search.begin()
    search.look()
    search.fit(("rudder_rate_limit",))
    fit = search.candidates[("rudder_rate_limit",)].fit
    assert fit.z[columns_of(planted.problem.entries, ("rudder_rate_limit",))] == pytest.approx(0.16, abs=0.03)


def test_a_fit_that_went_astray_is_made_again_from_where_another_is(plant):
    """What was tried from afar may have ended anywhere: the linear problem at a good fit says when to begin again."""
    planted = plant(
        lambda setting: catalogue(("heading",))["rudder_offset"].apply(setting, 0.5), duration=8.0
    )
    search = Search(problem=planted.problem, progress=lambda share, words: None)
    search.begin()
    ids = ("rudder_offset",)
    search.fit(ids)
    good = search.candidates[ids]
    search.candidates[ids] = dataclasses.replace(good, log_posterior=good.log_posterior - 600.0)
    search.refined.add(ids)
    search.screen.starts[ids] = np.full(len(planted.problem.entries), np.nan)
    assert search._unknown({ids: good.log_posterior}) == {ids: good.log_posterior}
    search.fit(ids, good.fit)
    assert search.candidates[ids].log_posterior == pytest.approx(good.log_posterior, abs=0.5)
    assert ids not in search.refined
    assert search._unknown({ids: good.log_posterior}) == {}
    better = dataclasses.replace(good, log_posterior=good.log_posterior + 600.0)
    search.candidates[ids] = better
    search.fit(ids, good.fit)
    assert search.candidates[ids] is better, "what is better is kept"


def test_what_another_cause_would_do_instead_is_on_the_scale_of_real_fits(plant):
    """Prior and all: a fit is taken for astray by comparing the two. A healthy record is linear enough for 2 nats; the
    prior of a cause is worth 3.
    """
    search = Search(problem=plant(duration=8.0).problem, progress=lambda share, words: None)
    search.begin()
    search.fit(("rudder_offset",))
    one = search.candidates[("rudder_offset",)]
    for other in ("rudder_lift_slope", "hull_drag", "yaw_inertia"):
        search.fit((other,), one.fit)
        real = search.candidates[(other,)].log_posterior
        assert with_one_swapped(search.problem, one, ())[(other,)] == pytest.approx(real, abs=2.0), other


def test_a_fit_that_bends_many_parameters_is_not_close():
    effects = list(catalogue(("heading",)).values())
    entries = [SimpleNamespace(record=-1, parameter=one.parameters[0]) for one in effects[: 2 * MAX_STRAINED]]
    problem, quiet = SimpleNamespace(entries=entries), np.ones(50)
    tolerance = np.array([one.parameter.tolerance for one in entries])

    def bent(count):
        return np.where(np.arange(tolerance.size) < count, -1.1 * STRAINED_TOLERANCES, 0.5) * tolerance

    assert is_close(problem, SimpleNamespace(r=quiet, z=bent(MAX_STRAINED - 1)))
    assert not is_close(problem, SimpleNamespace(r=quiet, z=bent(MAX_STRAINED)))
    assert not is_close(problem, SimpleNamespace(r=1.1 * quiet, z=bent(0)))


def test_a_fit_has_settled_only_close_to_where_its_sensitivities_were_made(plant):
    """Far away slopes are others, and what counts as settled is not fitted again."""
    search = Search(problem=plant(duration=6.0).problem, progress=lambda share, words: None)
    search.begin()
    search.fit(())
    fit = dataclasses.replace(search.candidates[()].fit, converged=True)
    tolerance = np.array([entry.parameter.tolerance for entry in search.problem.entries])
    for away, settled in ((0.5, True), (5.0, False)):
        assert search._settled(dataclasses.replace(fit, made_at=fit.z + away * tolerance)) is settled
    assert not search._settled(dataclasses.replace(fit, made_at=fit.z + 0.5 * tolerance, converged=False))
    assert search._settled(dataclasses.replace(fit, made_at=fit.z, converged=False)), (
        "the same would come out"
    )
    assert not search._settled(dataclasses.replace(fit, made_at=None))
