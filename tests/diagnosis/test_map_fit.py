"""One fit: it goes on beside non-smooth points, comes out of local minima, and keeps its Jacobian true along a step.

Configuration: residuals made by hand, whose minima are known, and 8 s of fig6 with a fit that a heavy drum holds in a
local minimum. Tolerance: the closed form; on fig6 any gain.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero.diagnosis.inference import (
    Fit,
    at_bad_minimum,
    broyden_update,
    columns_of,
    refit,
    restarted_where_smooth,
    variances,
)

DRUM = ("drum_inertia",)
DRUM_TOLERANCE = 0.2
"""What a drum may weigh more. [kg]"""


def test_an_update_explains_the_step_and_leaves_other_directions():
    random = np.random.default_rng(1)
    J, step, change = random.normal(size=(9, 4)), random.normal(size=4), random.normal(size=9)
    D = np.array([1.0, 4.0, 0.01, 9.0])
    new = broyden_update(J, step, change, D)
    assert_allclose(new @ step, -change, atol=1e-12, err_msg="a residual falls by J times the step")
    other = np.array([step[1] * D[0], -step[0] * D[1], 0.0, 0.0])
    assert abs(step @ (other / D)) < 1e-12
    assert_allclose(new @ other, J @ other, atol=1e-12)


@pytest.mark.parametrize("low", [0.0, -9.0])
def test_a_fit_goes_on_beside_a_non_smooth_point(low):
    """Of r = (3 − x, 5 + 40 |y − 0.1|) and the prior the least is at x = 1.5 and y = 0.1, where r is not smooth: the
    slope to the left predicts more of a larger y. Only what is possible on one side may be so: else it spoils the step.
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


def test_a_fit_at_a_non_smooth_point_comes_out_of_its_local_minimum():
    """The residual is 1 at a resting drum, 2 behind it and 0 at the truth: no slope leads there from rest."""
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


def held_by_a_drum(problem):
    """Return a fit of "nothing is wrong" that a heavy drum holds in a local minimum."""
    z = np.zeros(len(problem.entries))
    z[columns_of(problem.entries, DRUM)] = 5.0 * DRUM_TOLERANCE
    r, J, D = problem.residual(z), problem.jacobian(z), variances(problem.entries, (), 4.0)
    objective = 0.5 * float(r @ r + np.sum(z * z / D))
    return Fit(z=z, r=r, J=J, D=D, objective=objective, converged=False, predicted_gain=0.0, fresh=0)


def test_a_fit_in_a_local_minimum_is_restarted_from_a_usual_drum(plant):
    problem = plant(duration=8.0).problem
    fit, D = held_by_a_drum(problem), variances(problem.entries, (), 1.0)
    again = restarted_where_smooth(problem, fit, (), D)
    assert again.objective < fit.objective
    assert not at_bad_minimum(problem, again, ())
