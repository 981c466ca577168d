"""A missing force is as probable as it is around a fit of its own, not where the model bends to do without it.

Configuration: fig6, 30 s, six channels with coloured noise, all parameters nominal but free within their tolerances.
"""

import numpy as np
import pytest

from subzero.diagnosis.inference import (
    candidate_of,
    force_columns,
    knots_of,
    latent_force_candidates,
    one_terms,
    refit,
    relinearised_force,
    variances,
    without_force,
)
from subzero.external_force import MissingForce, Term


def weed(coefficient):
    """Drag that grows all the time: as the drag of a cable does that gets longer."""
    return lambda setting: without_force(setting, MissingForce(terms=(Term("X", "time*u2", coefficient),)))


def both_ways(planted):
    """Return the log posterior of a force on X where nothing else is bent, and from the best fit without it."""
    problem, D = planted.problem, {}
    for kappa in (1.0, 4.0):
        D[kappa] = variances(problem.entries, (), kappa)
    fit = refit(problem, np.zeros(D[4.0].size), planted.J, D[4.0], most_fresh=2)
    none = candidate_of(problem, (), refit(problem, fit.z, fit.J, D[1.0], most_fresh=1))
    none = max(none, candidate_of(problem, (), fit), key=lambda one: one.log_posterior)
    knots = knots_of(problem)
    terms = one_terms(problem, fit.z, knots)
    here = relinearised_force(problem, fit, "unknown_force:X", 1.0, knots, terms).log_posterior
    columns = {"unknown_force:X": force_columns(problem, none.fit.z, ("X",), knots)["X"]}
    (there,) = latent_force_candidates(problem, columns, none.fit, none.scales(problem), knots, terms)
    return here, none.log_posterior + there.log_gain


@pytest.mark.long
def test_both_ways_agree_where_the_model_hardly_bends(plant):
    here, there = both_ways(plant(weed(-0.004)))
    assert here == pytest.approx(there, abs=1.0), "a nat: what is not linear in so small a force"


@pytest.mark.long
def test_weed_is_far_more_probable_where_the_model_is_not_bent_to_do_without_it(plant):
    here, there = both_ways(plant(weed(-0.08)))
    assert here > there + 5.0


@pytest.mark.long
def test_a_compass_that_wanders_is_more_probable_than_any_force_that_turns_the_vehicle(plant):
    planted = plant(
        drift={"heading": lambda time: 4.0 * np.sin(np.pi * np.clip((time - 5.0) / 15.0, 0.0, 1.0)) ** 2}
    )
    problem = planted.problem
    fit = refit(problem, np.zeros(planted.J.shape[1]), planted.J, variances(problem.entries, (), 4.0))
    knots = knots_of(problem)
    terms = one_terms(problem, fit.z, knots)
    log = {name: relinearised_force(problem, fit, name, 1.0, knots, terms).log_posterior
           for name in ("sensor_drift:heading", "unknown_force:N", "unknown_force:Y")}  # fmt: skip
    assert log["sensor_drift:heading"] > max(log["unknown_force:N"], log["unknown_force:Y"]) + 10.0
