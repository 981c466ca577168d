"""A cause that begins in mid-trial is as probable as its own fit says, found along the run of a force that nobody
explains; and what is told of it.

Configuration: fig6, 30 s, six channels with coloured noise; a rudder that is off its centre by 3 degrees from 13.1 s
on, so far from the nominal model that nothing is linear between the two.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from subzero.diagnosis.hypothesis.catalogue import catalogue
from subzero.diagnosis.hypothesis.effect import with_onset
from subzero.diagnosis.hypothesis.hypotheses import columns_of, variances
from subzero.diagnosis.inference.basis import one_terms
from subzero.diagnosis.inference.change_point_fit import _worth, fit_change_points, linearised_at
from subzero.diagnosis.inference.change_point_scan import RankedChangePoint
from subzero.diagnosis.inference.input_estimation import relinearised_force
from subzero.diagnosis.inference.latent_force import FINE_SPACING_S, history, knots_of, without_force
from subzero.diagnosis.inference.map_fit import is_poor_fit, refit
from subzero.diagnosis.inference.model_average import MIN_DISCRIMINATION, ChangePointSummary, decide
from subzero.diagnosis.inference.model_search import Search
from subzero.diagnosis.inference.out_of_catalogue import (
    DECISIVE_LOG_POSTERIOR,
    OutOfCatalogue,
    _nothing_again,
    is_explained,
)
from subzero.diagnosis.results import CAUSE_NAMED, NOTHING_WRONG, OUTSIDE, UNDECIDED
from subzero.diagnosis.verdict.conclude import (
    calibration_from_onset,
    cause_of,
    closest,
    closest_rival,
    fitted,
    is_large,
    names_of,
    remaining_models,
    rival_of,
    trial_ahead,
    with_closest,
)

EFFECTS = catalogue(("heading",))
ABLE = [effect for effect in EFFECTS.values() if effect.sudden]
BEGINS = 13.1


def hit(plant, degrees):
    """Return what is found when the rudder is hit."""
    return asked(plant(lambda setting: with_onset(EFFECTS["rudder_offset"], BEGINS).apply(setting, degrees)))


def forced(planted, axis="N"):
    """Return a record's problem, and the force that explains it."""
    problem, D = planted.problem, variances(planted.problem.entries, (), 4.0)
    wide = refit(problem, np.zeros(D.size), planted.J, D, most_fresh=2)
    knots = knots_of(problem, FINE_SPACING_S)
    return problem, relinearised_force(
        problem, wide, f"unknown_force:{axis}", 1.0, knots, one_terms(problem, wide.z, knots)
    )


def asked(planted, axis="N"):
    """Return the same, and the sudden causes that are fitted there."""
    problem, force = forced(planted, axis)
    with ThreadPoolExecutor(2) as side:
        return problem, force, fit_change_points(problem, [force.place], ABLE, 0, force.log_posterior, side)


@pytest.fixture(scope="module")
def found(plant):
    return hit(plant, 3.0)


@pytest.fixture(scope="module")
def work(found):
    problem, _, (one, *_) = found
    foreign = [OutOfCatalogue(beside=(), what=one, log_posterior=one.log_posterior)]
    return SimpleNamespace(problem=problem, foreign=foreign)


def test_what_began_is_found_with_its_size_and_its_time(found):
    _, force, (one, *others) = found
    assert one.change_point.effect.id == "rudder_offset"
    assert one.change_point.time == pytest.approx(BEGINS, abs=0.2)
    assert one.change_point.mean[0] == pytest.approx(3.0, abs=0.3)
    assert not is_poor_fit(one.fit)
    assert one.log_posterior > force.log_posterior + 5.0, (
        "a cause of the catalogue explains more by less than a force"
    )
    assert all(other.log_posterior < one.log_posterior - 10.0 for other in others)


def test_a_rudder_to_the_other_side_has_the_other_sign(plant):
    _, _, (one, *_) = hit(plant, -3.0)
    assert one.change_point.effect.id == "rudder_offset"
    assert one.change_point.mean[0] == pytest.approx(-3.0, abs=0.3)


def test_a_force_that_comes_and_goes_is_no_sudden_cause(plant):
    """Nothing is fitted that has no hope to be as probable as the force."""
    time = np.linspace(0.0, 30.0, 301)
    bump = 0.05 * np.sin(np.pi * np.clip((time - 10.0) / 5.0, 0.0, 1.0)) ** 2
    planted = plant(lambda setting: without_force(setting, history("N", time, bump)))
    _, force, others = asked(planted)
    assert all(one.log_posterior < force.log_posterior - 10.0 for one in others)


def a_hope(name, log_posterior, gain):
    """Return a hope of a sudden cause, in no place."""
    begun = SimpleNamespace(effect=EFFECTS[name], log_gain=gain, between=0.0)
    return RankedChangePoint(log_posterior, begun, None)


def test_what_gains_most_is_fitted_whatever_it_hopes_and_others_if_they_are_close():
    drag, rudder = a_hope("hull_drag", -60.0, 200.0), a_hope("rudder_offset", -90.0, 100.0)
    assert _worth([rudder, drag], {}, least=0.0) == [drag], "0.75 × 200 may be more than 60"
    near = a_hope("rudder_offset", -62.0, 100.0)
    assert _worth([near, drag], {}, least=-70.0) == [drag, near]
    assert _worth([drag], {}, least=-60.0 + 0.75 * 200.0 + 7.0) == []


def test_what_is_known_is_fitted_again_only_for_a_better_promise():
    drag = a_hope("hull_drag", -60.0, 20.0)
    for known, asked in ((-70.0, [drag]), (-61.0, [])):
        assert _worth([drag], {"hull_drag": SimpleNamespace(log_posterior=known)}, least=-70.0) == asked


def test_in_its_place_the_records_lack_what_it_explains(found):
    problem, _, (one, *_) = found
    n, place = len(problem.entries), linearised_at(problem, one)
    assert place.fit.z.size == n
    assert np.allclose(place.fit.r - one.fit.r, one.fit.J[:, n] * one.change_point.mean[0])
    assert np.linalg.norm(place.fit.r) > 5.0 * np.linalg.norm(one.fit.r)


def test_it_ends_the_search_only_if_it_leaves_noise_and_is_far_before_the_rest(found):
    _, force, (one, *_) = found
    there = [OutOfCatalogue(beside=(), what=one, log_posterior=0.0)]

    def best(log):
        return SimpleNamespace(best=lambda: SimpleNamespace(log_posterior=log))

    assert is_explained(best(-DECISIVE_LOG_POSTERIOR - 1.0), there)
    assert not is_explained(best(-DECISIVE_LOG_POSTERIOR + 1.0), there)
    lost = replace(one, fit=replace(one.fit, r=2.0 * one.fit.r))
    assert not is_explained(
        best(-DECISIVE_LOG_POSTERIOR - 1.0), [OutOfCatalogue(beside=(), what=lost, log_posterior=0.0)]
    )
    assert not is_explained(
        best(-DECISIVE_LOG_POSTERIOR - 1.0), [OutOfCatalogue(beside=(), what=force.what, log_posterior=0.0)]
    )
    assert not is_explained(best(-DECISIVE_LOG_POSTERIOR - 1.0), [])


def test_nothing_wrong_is_fitted_again_where_a_sudden_cause_of_no_size_explains_the_records(plant):
    """Fits of a rough record may end in a hollow, and whatever begins elsewhere then explains more."""
    problem, force = forced(plant())
    good = force.place
    search = Search(problem=problem, progress=lambda share, words: None)
    search.wide = good.fit
    search.only_nothing()
    right = search.best()
    before = right.log_posterior - 40.0
    search.candidates[()] = replace(right, log_posterior=before)
    _nothing_again(search, OutOfCatalogue(beside=(), what=force.what, log_posterior=before + 40.0))
    _nothing_again(search, OutOfCatalogue(beside=(), what=force.what, log_posterior=before - 1.0, place=good))
    assert search.best().log_posterior == before, "only if it explains the records, and more"
    _nothing_again(
        search, OutOfCatalogue(beside=(), what=force.what, log_posterior=before + 40.0, place=good)
    )
    assert search.best().log_posterior == pytest.approx(right.log_posterior, abs=2.0)


def test_it_is_told_in_words_and_numbers(work):
    (one,) = fitted(work)
    cause = cause_of(work, one, 0.9)
    angle = cause.parameters["angle"]
    assert (cause.id, cause.sentence, cause.probability) == (
        "rudder_offset",
        "the rudder is off its centre",
        0.9,
    )
    assert cause.start_time == one.change_point.time
    assert 0.0 < cause.start_sd < 0.2
    assert angle.low < 3.0 < angle.high
    rival = rival_of(work, one, 0.3)
    assert rival.ids == (f"rudder_offset@{one.change_point.time:g}",)
    assert rival.sentence == f"from {one.change_point.time:g} s on the rudder is off its centre"
    assert is_large(one)
    D, rival = closest(work, one)
    assert D > 100.0
    assert rival[0].partition("@")[0] in EFFECTS


def test_more_drag_and_less_thrust_from_the_same_time_on_are_not_told_apart(plant):
    """On the straight end of fig6; what holds throughout is far off. (A drum that rubs is as probable.)"""
    planted = plant(lambda setting: with_onset(EFFECTS["hull_drag"], 20.4).apply(setting, 0.35))
    problem, _, late = asked(planted, "X")
    pair = {"hull_drag", "propeller_thrust_gain"}
    told = SimpleNamespace(problem=problem, foreign=[OutOfCatalogue(beside=(), what=one,
                                                                    log_posterior=one.log_posterior)
                                                     for one in late if one.change_point.effect.id in pair])  # fmt: skip
    one = fitted(told)[0]
    assert one.change_point.effect.id in pair
    D, (rival,) = closest(told, one)
    assert D < MIN_DISCRIMINATION
    assert {one.change_point.effect.id, rival.partition("@")[0]} == pair
    assert {each.change_point.effect.id for each in with_closest(told, one)} == pair
    words = closest_rival(told, {})
    assert (words.ids, words.discrimination) == ((rival,), D)
    assert words.sentence.startswith(f"from {one.change_point.time:g} s on ")


def test_what_began_holds_throughout_in_trials_to_come(work):
    (one,) = fitted(work)
    (k,) = columns_of(work.problem.entries, ("rudder_offset",))
    trial_ahead = calibration_from_onset(work, one)
    assert trial_ahead.ids == (one.id,)
    assert trial_ahead.fit.z[k] == one.change_point.mean[0]
    assert np.array_equal(trial_ahead.fit.J[:, k], one.fit.J[:, len(work.problem.entries)])
    assert trial_ahead.fit.D[k] == EFFECTS["rudder_offset"].parameters[0].scale ** 2


def test_the_next_trial_is_not_asked_whether_what_is_broken_broke_in_mid_trial(work):
    """In a trial to come the two are one."""
    (one,) = fitted(work)
    throughout = {("rudder_offset",): "throughout", ("hull_drag",): "another"}
    asked = SimpleNamespace(problem=work.problem, search=SimpleNamespace(candidates=throughout))
    assert trial_ahead(asked, [("rudder_offset",)], [one]) == ["throughout"]
    (another, late) = trial_ahead(asked, [("hull_drag",)], [one])
    assert (another, late.ids) == ("another", (one.id,))


def test_sudden_causes_that_are_left_are_rivals_and_need_no_others(work):
    (one,) = fitted(work)
    key, inside = (one.id,), {(): 0.3, ("hull_drag",): 0.01}
    assert remaining_models(work, UNDECIDED, None, inside, [key, ()]) == ([()], [one], [])
    assert remaining_models(work, UNDECIDED, None, inside, [key]) == ([], [one], [])
    among = [key, ("unknown_force:N",), ("sensor_drift:heading",)]
    assert remaining_models(work, UNDECIDED, None, inside, among).strange == [
        "unknown_force:N",
        "sensor_drift:heading",
    ]
    assert names_of([key, ()], [rival_of(work, one, 0.6)]) == [one.id, "none"]


@pytest.mark.parametrize(
    ("late", "verdict"),
    [
        (ChangePointSummary(0.85, True, 20.0), CAUSE_NAMED),
        (ChangePointSummary(0.75, True, 20.0), UNDECIDED),
        (ChangePointSummary(0.85, False, 20.0), UNDECIDED),
        (ChangePointSummary(0.85, True, 5.0), UNDECIDED),
        (ChangePointSummary(0.3, True, 20.0), NOTHING_WRONG),
    ],
)
def test_it_is_named_only_if_it_is_probable_large_and_apart(late, verdict):
    inside = {(): 0.7 if late.probability < 0.5 else 0.1, ("a",): 0.05}
    assert decide(inside, 0.0, True, 20.0, late) == verdict
    assert decide(inside, 0.85, True, 20.0, late) == OUTSIDE
