"""One fit: it goes on beside non-smooth points, and keeps its Jacobian true along a step.

Configuration: residuals made by hand, whose minima are known. Tolerance: the closed form.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero.diagnosis.inference import (
    broyden_update,
    refit,
)


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
