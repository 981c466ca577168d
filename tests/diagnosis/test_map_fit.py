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


def test_a_fit_goes_on_beside_a_non_smooth_point():
    """Of r = (3 − x, 5 + 40 |y − 0.1|) and the prior the least is at x = 1.5 and y = 0.1, where r is not smooth: the
    slope to the left predicts more of a larger y, which is possible on one side only: else it spoils the step.
    """
    J = np.array([[1.0, 0.0], [0.0, 40.0]])
    problem = SimpleNamespace(
        entries=[
            SimpleNamespace(parameter=SimpleNamespace(low=low, high=9.0, tolerance=1.0))
            for low in (-9.0, 0.0)
        ],
        residual=lambda z: np.array([3.0 - z[0], 5.0 + 40.0 * abs(z[1] - 0.1)]),
        jacobian=lambda z: J,
    )
    fit = refit(problem, np.array([0.0, 0.1]), np.ones(2))
    assert fit.z[0] == pytest.approx(1.5)
    assert fit.z[1] == pytest.approx(0.1)
