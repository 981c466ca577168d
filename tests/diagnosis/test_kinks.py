"""Where a drum stops, a cable falls slack or a gear has play, runs have kinks, and slopes say little.

Verifies: a fit goes on beside a kink; causes without a slope are found by real runs at some sizes; a fit that ended in
a hollow is made again from where its rival is, or from off its kinks; a pair is found beside a cause that is not the
best by itself, and one cause that is far away in the place of two.
"""

import dataclasses
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from subzero.diagnosis.hypothesis.catalogue import catalogue
from subzero.diagnosis.hypothesis.hypotheses import columns_of, variances
from subzero.diagnosis.inference import map_fit, model_search
from subzero.diagnosis.inference.laplace import Candidate, candidate_of
from subzero.diagnosis.inference.map_fit import (
    RESTART_TOLERANCES,
    STRAYED_TOLERANCES,
    Fit,
    at_bad_minimum,
    non_smooth,
    refit,
    restarted_where_smooth,
    with_own_jacobian,
)
from subzero.diagnosis.inference.model_fits import HOPELESS_LOG_POSTERIOR
from subzero.diagnosis.inference.model_search import Search
from subzero.diagnosis.inference.screening import with_one_added, with_sizes_tried

SLACK, DRUM = ("cable_initial_length",), ("drum_inertia",)
DRUM_TOLERANCE = 0.2
"""What a drum may weigh more. [kg]"""


def begun(planted):
    """Return a search with its first fits."""
    search = Search(problem=planted.problem, progress=lambda share, words: None)
    search.begin()
    return search


@pytest.mark.parametrize("low", [0.0, -9.0])
def test_a_fit_goes_on_beside_a_kink(low):
    """Of r = (3 − x, 5 + 40 |y − 0.1|) and the prior the least is at x = 1.5 and y = 0.1, a kink, where the slope to
    the left promises more of a larger y. Only what is possible on one side has kinks: otherwise the step is spoiled.
    """
    problem = SimpleNamespace(
        entries=[SimpleNamespace(parameter=SimpleNamespace(low=bound, high=9.0)) for bound in (-9.0, low)],
        residual=lambda z: np.array([3.0 - z[0], 5.0 + 40.0 * abs(z[1] - 0.1)]),
    )
    J = np.array([[1.0, 0.0], [0.0, 40.0]])
    fit = refit(problem, np.array([0.0, 0.1]), J, np.ones(2), most_fresh=0)
    assert fit.z[0] == pytest.approx(1.5 if low == 0.0 else 0.0)
    assert fit.converged is (low == 0.0)
    assert fit.z[1] == 0.1


def test_a_slack_cable_is_found_by_real_runs(plant):
    """As long as the model has none, the slope at nothing says nothing of it."""
    search = begun(
        plant(lambda setting: catalogue(("heading",))[SLACK[0]].apply(setting, 9.0), duration=16.0)
    )
    search.fit(())
    nothing = search.best()
    sizes = with_sizes_tried(search.problem, nothing, (), non_smooth(search.problem, ()))
    best = max(sizes, key=lambda ids: sizes[ids].log_posterior)
    assert best == SLACK
    assert sizes[SLACK].log_posterior > with_one_added(search.problem, nothing)[SLACK] + 5.0
    search.grow()
    fit = search.candidates[SLACK].fit
    assert fit.z[columns_of(search.problem.entries, SLACK)] == pytest.approx(9.0, abs=2.0)
    assert search.best().ids == SLACK


def test_sizes_are_tried_of_what_has_kinks_and_is_not_there(plant):
    search = begun(plant(duration=6.0))
    search.fit(SLACK)
    tried = with_sizes_tried(
        search.problem, search.candidates[SLACK], SLACK, non_smooth(search.problem, SLACK)
    )
    assert all(set(SLACK) < set(ids) for ids in tried)
    more = {one for ids in tried for one in ids} - set(SLACK)
    assert more == {"drum_friction", "drum_inertia", "rudder_backlash", "rudder_rate_limit", "battery_sag"}


def test_a_fit_in_a_hollow_is_made_again_from_where_its_rival_is(plant):
    search, ids, rival = begun(plant(duration=8.0)), ("rudder_offset",), ("hull_drag",)
    search.fit_all([ids, rival])
    good = search.candidates[ids]
    z = good.fit.z + 0.5 * np.array([entry.parameter.tolerance for entry in search.problem.entries])
    behind = search.candidates[rival].log_posterior - HOPELESS_LOG_POSTERIOR / 2
    hollow = dataclasses.replace(good, fit=dataclasses.replace(good.fit, z=z), log_posterior=behind)
    search.candidates[ids] = hollow
    search.cross()
    assert search.candidates[ids].log_posterior == pytest.approx(good.log_posterior, abs=0.3)


def astray(problem):
    """Return a fit of "nothing is wrong" that a heavy drum has led astray."""
    z = np.zeros(len(problem.entries))
    z[columns_of(problem.entries, DRUM)] = 5.0 * DRUM_TOLERANCE
    r, J, D = problem.residual(z), problem.jacobian(z), variances(problem.entries, (), 4.0)
    objective = 0.5 * float(r @ r + np.sum(z * z / D))
    return Fit(z=z, r=r, J=J, D=D, objective=objective, converged=False, predicted_gain=0.0, fresh=0)


def test_a_fit_that_bends_a_kink_far_has_gone_astray(plant):
    problem = plant(duration=8.0).problem
    fit, (k,) = astray(problem), columns_of(problem.entries, DRUM)
    assert at_bad_minimum(problem, fit, ())
    assert not at_bad_minimum(problem, fit, DRUM), "a cause may be as large as it is"
    for bent, far in ((0.9, False), (1.1, True)):
        fit.z[k] = bent * STRAYED_TOLERANCES * DRUM_TOLERANCE
        assert at_bad_minimum(problem, fit, ()) is far


def test_a_fit_astray_is_begun_again_from_a_usual_drum(plant):
    problem = plant(duration=8.0).problem
    fit, D = astray(problem), variances(problem.entries, (), 1.0)
    again = restarted_where_smooth(problem, fit, (), D)
    assert again.objective < fit.objective
    assert not at_bad_minimum(problem, again, ())


def test_a_fit_on_a_kink_comes_out_of_its_hollow():
    """The residual is 1 at a resting drum, 2 behind its kink and 0 at the truth: no slope leads there from the kink."""
    columns_of, residuals = [0.0, 0.2, 0.8, 2.0], [1.0, 2.0, 0.0, 1.2]

    def residual(z):
        return np.interp(z, columns_of, residuals)

    entry = SimpleNamespace(record=-1, effect=SimpleNamespace(slot="drum", id="drum_friction"),
                            parameter=SimpleNamespace(low=0.0, high=2.0, tolerance=1.0))  # fmt: skip
    problem = SimpleNamespace(entries=[entry], residual=residual,
                              jacobian=lambda z: (residual(z) - residual(z + 1e-6))[:, None] / 1e-6)  # fmt: skip
    z = np.zeros(1)
    fit = refit(problem, z, problem.jacobian(z), np.ones(1))
    assert fit.z == 0.0
    again = restarted_where_smooth(problem, fit, ())
    assert 0.6 < again.z[0] <= 0.8
    assert again.objective < 0.4 < fit.objective


@pytest.mark.parametrize("ids", [(), DRUM, ("hull_drag",)])
def test_a_fit_is_begun_again_off_its_kinks_and_where_all_else_is_best_for_that(plant, monkeypatch, ids):
    """Best in the linear problem: the slope of the objective is 0 in all that is neither held nor at a bound."""
    problem, begins = plant(duration=8.0).problem, []
    fit, D = astray(problem), variances(problem.entries, ids, 1.0)
    monkeypatch.setattr(map_fit, "refit", lambda problem, z, *others, **more: begins.append(z))
    restarted_where_smooth(problem, fit, ids, D)
    (z,), at = begins, non_smooth(problem, ids)
    tolerance = np.array([entry.parameter.tolerance for entry in problem.entries])
    assert {"drum_friction", "cable_initial_length"} <= {problem.entries[k].effect.id for k in at}
    assert ("drum_inertia" in {problem.entries[k].effect.id for k in at}) is (ids != DRUM)
    assert z[at] == pytest.approx(RESTART_TOLERANCES * tolerance[at])
    slope = fit.J.T @ (fit.r - fit.J @ (z - fit.z)) - z / D
    free = [k for k, entry in enumerate(problem.entries)
            if k not in at and entry.parameter.low < z[k] < entry.parameter.high]  # fmt: skip
    assert len(free) > 20
    assert slope[free] * tolerance[free] == pytest.approx(
        0.0, abs=1e-6 * np.abs(fit.J.T @ fit.r * tolerance).max()
    )


def test_a_fit_is_begun_again_within_bounds(plant):
    """What the linear problem makes of a record that nothing fits: less than no drag, which cannot be run."""
    problem = plant(duration=8.0).problem
    fit, (k,) = astray(problem), columns_of(problem.entries, ("cable_normal_drag",))
    fit = dataclasses.replace(fit, r=fit.r - 1e4 * fit.J[:, k])
    again = restarted_where_smooth(problem, fit, ())
    assert again.z[k] >= problem.entries[k].parameter.low


@pytest.mark.parametrize(("away", "same"), [(0.0, True), (0.9, True), (1.1, False), (None, False)])
def test_sensitivities_are_made_again_where_a_fit_has_moved(plant, away, same):
    problem = plant(duration=4.0).problem
    tolerance = np.array([entry.parameter.tolerance for entry in problem.entries])
    z, r = np.zeros(tolerance.size), problem.residual(np.zeros(tolerance.size))
    fit = Fit(z=z, r=r, J=np.zeros((r.size, z.size)), D=tolerance**2, objective=0.5 * float(r @ r), converged=True,
              predicted_gain=0.0, fresh=0, made_at=None if away is None else z + away * tolerance)  # fmt: skip
    again = with_own_jacobian(problem, fit)
    assert (again is fit) is same
    assert np.any(again.J) == (not same)


def test_the_wide_fit_comes_back_from_astray(plant, monkeypatch):
    problem, fits = plant(duration=8.0).problem, []

    def first_astray(problem, *others, **more):
        fits.append(refit(problem, *others, **more) if fits else astray(problem))
        return fits[-1]

    monkeypatch.setattr(map_fit, "refit", first_astray)
    _, fit, _ = map_fit.fit_wide(problem, lambda share, words: None)
    assert fit.z[columns_of(problem.entries, DRUM)] < 2.0 * DRUM_TOLERANCE


def test_the_best_comes_back_from_astray_before_it_is_looked_beside_and_so_does_it_without_its_cause(plant):
    search = begun(plant(duration=8.0))
    lost = candidate_of(search.problem, (), astray(search.problem))
    search.candidates = {(): lost}
    assert search.restart(lost).log_posterior > lost.log_posterior + 5.0
    search.candidates = {(): lost, DRUM: candidate_of(search.problem, DRUM, lost.fit)}
    search._parts_again(search.candidates[DRUM])
    assert search.candidates[()].log_posterior > lost.log_posterior + 5.0


def test_the_first_that_are_close_are_fitted_from_off_their_kinks_before_they_are_told(monkeypatch):
    search, again = Search(problem=None, progress=lambda share, words: None), []
    for name, log in zip("abcde", (-10.0, -11.0, -15.9, -10.5, -17.0), strict=True):
        search.candidates[(name,)] = Candidate(ids=(name,), fit=None, log_evidence={}, log_posterior=log)
    monkeypatch.setattr(search, "restart", lambda one: again.append(one.ids[0]))
    for name in ("_is_open", "cross", "_nothing"):
        monkeypatch.setattr(search, name, lambda *asked: None)
    search.settle()
    assert again == ["a", "d", "b"], f"the first {model_search.MAX_RESTARTED}"
    again.clear()
    search.candidates = {ids: one for ids, one in search.candidates.items() if ids[0] in "ace"}
    search.settle()
    assert again == ["a", "c"], "no more than 6 behind"
    again.clear()
    search.restarted.add(("a",))
    search.settle()
    assert again == ["c"], "once"


def test_the_best_gets_the_chances_of_its_rivals_too(plant):
    search, ids, rival = begun(plant(duration=8.0)), ("rudder_offset",), ("hull_drag",)
    search.fit_all([ids, rival])
    good = search.candidates[rival]
    search.candidates[ids] = dataclasses.replace(
        search.candidates[ids], log_posterior=good.log_posterior - 1.0
    )
    search.candidates[rival] = dataclasses.replace(good, log_posterior=good.log_posterior - 0.9)
    search.cross()
    assert search.candidates[rival].log_posterior == pytest.approx(good.log_posterior, abs=0.3)


def test_a_pair_is_looked_for_beside_what_is_not_the_best(monkeypatch):
    """A wrong cause may be better than either of two right ones by itself."""
    search, fits = Search(problem=None, progress=lambda share, words: None), {}
    for name, log in (("wrong", -50.0), ("right", -60.0), ("other", -61.0)):
        search.candidates[(name,)] = Candidate(ids=(name,), fit=name, log_evidence={}, log_posterior=log)
    found = {
        "right": {("other", "right"): -41.0},
        "other": {("other", "right"): -44.0, ("other", "wrong"): -51.0},
    }
    monkeypatch.setattr(model_search, "with_one_added", lambda problem, one: found.get(one.ids[0], {}))
    monkeypatch.setattr(search, "fit", lambda ids, start: fits.setdefault(ids, start))
    search._beside_others(search.best())
    assert fits == {("other", "right"): "right"}, "from the better of the two; not what is behind the best"


def test_one_cause_that_is_far_away_is_found_in_the_place_of_two(plant, monkeypatch):
    """Clocks that differ by half a second look like a lag of the motor and one of the rudder."""
    search = begun(
        plant(lambda setting: catalogue(("heading",))["clock_offset"].apply(setting, 0.6), duration=16.0)
    )
    search.fit_all([(), ("motor_lag", "rudder_lag")])
    assert search.best().ids == ("motor_lag", "rudder_lag")
    refined = []
    monkeypatch.setattr(search, "race", refined.append)
    search._simpler()
    assert search.best().ids == ("clock_offset",)
    assert search.best().fit.made_at is not None, "with sensitivities from out there"
    assert refined == [2]
    (late,) = columns_of(search.problem.entries, ("clock_offset",))
    assert search.best().fit.z[late] == pytest.approx(0.6, abs=0.1)


@pytest.mark.parametrize(
    ("promises", "legs"), [([100.0, 50.0, 20.0], 2), ([100.0] * 9, map_fit.MAX_RESTARTS), ([5.0], 0)]
)
def test_a_cause_that_is_far_away_is_fitted_on_while_much_is_promised(plant, monkeypatch, promises, legs):
    search, asked = begun(plant(duration=4.0)), []

    def leg(problem, z, J, D, **more):
        asked.append(z)
        return SimpleNamespace(z=z + 1.0, r=None, D=D, predicted_gain=promises[len(asked) - 1])

    for module in (model_search, map_fit):
        monkeypatch.setattr(module, "refit", leg)
    monkeypatch.setattr(type(search.problem), "jacobian", lambda self, z: None)
    search._alone(("hull_drag",))
    assert len(asked) == 1 + legs
    assert all(np.array_equal(after, before + 1.0) for before, after in pairwise(asked))
