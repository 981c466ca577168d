"""Change points: a cause that begins in mid-trial is found with its size and its onset, and is as probable as its fit.

Configuration: fig6, 30 s, six channels with coloured noise. A rudder that is off its centre by 3 degrees from 13.1 s
on, so far from the nominal model that nothing is linear between the two: candidates are scanned along the simulation
with a latent force. A cable that from 9 s on drags along itself by 12 % of what it did. Tolerance: onsets within one
exchange of hull and cable, 0.2 s (0.3 s for the cable); sizes within the tolerance of the parameter.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import subzero
from subzero.diagnosis import catalogue, with_onset
from subzero.diagnosis.inference import (
    BaseRun,
    LinearisationPoint,
    candidate_of,
    fit_change_points,
    history,
    is_poor_fit,
    knots_of,
    linearised_at,
    one_terms,
    refit,
    relinearised_force,
    scan,
    times_of,
    variances,
    without_force,
)
from subzero.records.record import Record

EFFECTS = catalogue(("heading",))
ABLE = [effect for effect in EFFECTS.values() if effect.sudden]
BEGINS = 13.1
DRAG, SHARE, DRAG_BEGINS = "cable_tangential_drag", -0.88, 9.0


def hit(plant, degrees):
    """Return what is found when the rudder is hit."""
    return asked(plant(lambda setting: with_onset(EFFECTS["rudder_offset"], BEGINS).apply(setting, degrees)))


def forced(planted, axis="N"):
    """Return a record's problem, and the force that explains it."""
    problem, D = planted.problem, variances(planted.problem.entries, (), 4.0)
    wide = refit(problem, np.zeros(D.size), planted.J, D, most_fresh=2)
    knots = knots_of(problem, 1.0)
    return problem, relinearised_force(
        problem, wide, f"unknown_force:{axis}", 1.0, knots, one_terms(problem, wide.z, knots)
    )


def asked(planted, axis="N"):
    """Return the same, and the change points that are fitted there."""
    problem, force = forced(planted, axis)
    with ThreadPoolExecutor(2) as side:
        return problem, force, fit_change_points(problem, [force.point], ABLE, 0, force.log_posterior, side)


@pytest.fixture(scope="module")
def found(plant):
    return hit(plant, 3.0)


@pytest.mark.long
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


@pytest.mark.long
def test_a_rudder_to_the_other_side_has_the_other_sign(plant):
    _, _, (one, *_) = hit(plant, -3.0)
    assert one.change_point.effect.id == "rudder_offset"
    assert one.change_point.mean[0] == pytest.approx(-3.0, abs=0.3)


@pytest.mark.slow
def test_a_force_that_comes_and_goes_is_no_sudden_cause(plant):
    """Nothing is fitted that cannot be as probable as the force."""
    time = np.linspace(0.0, 30.0, 301)
    bump = 0.05 * np.sin(np.pi * np.clip((time - 10.0) / 5.0, 0.0, 1.0)) ** 2
    planted = plant(lambda setting: without_force(setting, history("N", time, bump)))
    _, force, others = asked(planted)
    assert all(one.log_posterior < force.log_posterior - 10.0 for one in others)


def test_linearised_without_it_the_records_lack_what_it_explains(found):
    problem, _, (one, *_) = found
    n, point = len(problem.entries), linearised_at(problem, one)
    assert point.fit.z.size == n
    assert np.allclose(point.fit.r - one.fit.r, one.fit.J[:, n] * one.change_point.mean[0])
    assert np.linalg.norm(point.fit.r) > 5.0 * np.linalg.norm(one.fit.r)


@pytest.fixture(scope="module")
def dragging(plant):
    return plant(lambda setting: with_onset(EFFECTS["hull_drag"], 12.4).apply(setting, 0.9))


def point_of(problem, fit):
    return LinearisationPoint(fit=fit, along=BaseRun(problem, fit.z))


def test_the_scan_finds_what_began_and_when(dragging):
    fit = dragging.fit()
    effects = [EFFECTS[name] for name in ("hull_drag", "rudder_offset", "net_buoyancy", "hull_drag")]
    found = scan(point_of(dragging.problem, fit), fit.D, effects, best=1)
    assert found[0].effect.id == "hull_drag"
    assert abs(found[0].time - 12.4) <= 1.0
    assert found[0].mean[0] == pytest.approx(0.9, abs=0.35)
    assert found[0].log_gain > 20.0


def test_of_a_healthy_record_no_change_point_is_worth_a_fit(plant):
    """It gains nothing, so whatever else is known, a fit could not make it probable."""
    healthy = plant(lambda setting: setting)
    fit = healthy.fit()
    effects = [EFFECTS[name] for name in ("hull_drag", "rudder_offset", "net_buoyancy")]
    with ThreadPoolExecutor(2) as side:
        assert not fit_change_points(
            healthy.problem, [point_of(healthy.problem, fit)], effects, 0, -1e9, side
        )


def test_times_stay_clear_of_the_ends(dragging):
    times = times_of(dragging.problem, 0)
    assert times[0] == 2.0
    assert times[-1] == 28.0


def test_what_would_have_to_be_negative_and_cannot_explains_nothing(plant):
    """From 14 s on the hull drags less; a drum that rubs less than not at all would look like it."""
    planted = plant(lambda setting: with_onset(EFFECTS["hull_drag"], 14.0).apply(setting, -0.4))
    fit = planted.fit()
    found = scan(point_of(planted.problem, fit), fit.D, [EFFECTS["hull_drag"], EFFECTS["drum_friction"]])
    gains = {one.effect.id: one.log_gain for one in found}
    assert gains["hull_drag"] > gains["drum_friction"] + 20.0


@pytest.fixture(scope="module")
def hanging(plant):
    """Return a record's problem and the fit of a cable that drags less all the time."""
    planted = plant(lambda setting: with_onset(EFFECTS[DRAG], DRAG_BEGINS).apply(setting, SHARE))
    problem = planted.problem
    D = variances(problem.entries, (DRAG,), 1.0)
    return problem, candidate_of(
        problem, (DRAG,), refit(problem, np.zeros(D.size), planted.J, D, most_fresh=2)
    )


def test_what_nearly_stops_is_found_by_simulations_as_large_as_it_is(hanging):
    problem, throughout = hanging
    with ThreadPoolExecutor(2) as side:
        (one,) = fit_change_points(problem, [], ABLE, 0, throughout.log_posterior, side, [throughout])[:1]
    assert one.change_point.effect.id == DRAG
    assert one.change_point.time == pytest.approx(DRAG_BEGINS, abs=0.3)
    assert one.change_point.mean[0] == pytest.approx(SHARE, abs=0.05)
    assert one.log_posterior > throughout.log_posterior + 10.0


@pytest.mark.long
def test_it_is_reported_with_its_onset_and_its_size(plant):
    """A record in, a verdict out, at the public face."""
    planted = plant(lambda setting: with_onset(EFFECTS["rudder_offset"], BEGINS).apply(setting, 3.0))
    (seen,) = planted.problem.records
    record = Record(source="planted", time=seen.time, values=seen.values)
    logged = subzero.Logged(record=record, setting=seen.setting, name="planted")
    verdict = subzero.diagnose(logged, budget="verdict")
    (cause,) = verdict.causes
    assert (verdict.verdict, cause.id) == ("cause_named", "rudder_offset")
    assert cause.start_time == pytest.approx(BEGINS, abs=0.2)
    assert 0.0 < cause.start_sd < 0.2
    angle = cause.parameters["angle"]
    assert angle.low < 3.0 < angle.high
    assert verdict.sentence == f"From {cause.start_time:g} s on, the rudder is off its centre."
    assert verdict.extended.start_times == {"rudder_offset": cause.start_time}
    assert all("rudder_offset" not in one.ids[0] for one in verdict.rivals if one.ids)
