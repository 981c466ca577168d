"""What hardly acts any more from some time on is found, although a small change of it says little where it is small.

Verifies: `inference.change_point_scan.ranked_by_runs`, and what `fit_change_points` makes of it. Configuration:
fig6, 30 s, six channels
with coloured noise; a cable that from 9 s on drags along itself by 12 % of what it did. Tolerance: a step of the times
that are tried, 2 s, before the fit; behind it a step and a half of the runs, 0.3 s, and the drag's own tolerance, 0.05.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from subzero.diagnosis.hypothesis.catalogue import catalogue
from subzero.diagnosis.hypothesis.effect import with_onset
from subzero.diagnosis.hypothesis.hypotheses import variances
from subzero.diagnosis.inference.change_point_fit import fit_change_points
from subzero.diagnosis.inference.change_point_scan import (
    BaseRun,
    LinearisationPoint,
    ranked_by_runs,
    ranked_in,
)
from subzero.diagnosis.inference.laplace import candidate_of
from subzero.diagnosis.inference.map_fit import refit

EFFECTS = catalogue(("heading",))
ABLE = [effect for effect in EFFECTS.values() if effect.sudden]
DRAG, SHARE, BEGINS = "cable_tangential_drag", -0.88, 9.0


@pytest.fixture(scope="module")
def hanging(plant):
    """Return a record's problem and the fit of a cable that drags less all the time."""
    planted = plant(lambda setting: with_onset(EFFECTS[DRAG], BEGINS).apply(setting, SHARE))
    problem = planted.problem
    D = variances(problem.entries, (DRAG,), 1.0)
    return problem, candidate_of(
        problem, (DRAG,), refit(problem, np.zeros(D.size), planted.J, D, most_fresh=2)
    )


def test_it_has_hope_from_about_then_on(hanging):
    problem, throughout = hanging
    (hope,) = ranked_by_runs(problem, throughout, ABLE, 0)
    assert abs(hope.change_point.time - BEGINS) <= 2.0
    assert hope.change_point.mean[0] < -0.6
    assert hope.log_posterior > throughout.log_posterior
    assert hope.start[-1] == hope.change_point.mean[0], "its fit begins with it as large"
    assert hope.start.size == len(problem.entries) + 1


def test_a_small_change_promises_less(hanging):
    problem, throughout = hanging
    (large,) = ranked_by_runs(problem, throughout, ABLE, 0)
    place = LinearisationPoint(throughout.fit, BaseRun(problem, throughout.fit.z))
    small = {one.change_point.effect.id: one for one in ranked_in(problem, place, ABLE, 0)}
    assert small[DRAG].log_posterior < large.log_posterior - 20.0


def test_it_is_fitted_from_there(hanging):
    problem, throughout = hanging
    with ThreadPoolExecutor(2) as side:
        (one,) = fit_change_points(problem, [], ABLE, 0, throughout.log_posterior, side, [throughout])[:1]
    assert one.change_point.effect.id == DRAG
    assert one.change_point.time == pytest.approx(BEGINS, abs=0.3)
    assert one.change_point.mean[0] == pytest.approx(SHARE, abs=0.05)
    assert one.log_posterior > throughout.log_posterior + 10.0


def test_only_what_can_begin_late_is_tried(hanging):
    problem, throughout = hanging
    assert ranked_by_runs(problem, throughout, [effect for effect in ABLE if effect.id != DRAG], 0) == []
