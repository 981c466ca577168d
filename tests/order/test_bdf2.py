"""BDF2 on uneven steps: its weights differentiate every quadratic exactly, in a first step and in all others.

Verifies: `backward_weights` of `cable.moving_end.bdf2`, as Python, with a quadratic whose derivative is known; and the
order of the error of a cubic. Configuration: ratios of a step to the one before from 1/50 to 50. Tolerance: rounding,
as a share of the sum of the sizes of all terms; for the order, 0.02.
"""

import numpy as np
import pytest

from cable.moving_end import bdf2

backward_weights = getattr(bdf2.backward_weights, "py_func", bdf2.backward_weights)

RATIOS = (0.02, 0.3, 0.5, 1.0, 1.7, 2.0, 50.0)
QUADRATIC = np.polynomial.Polynomial([0.7, -1.3, 2.1])


def rate(weights, values):
    """Return the weighted sum of new, present and former values, and the sum of the sizes of its terms."""
    terms = np.array(weights) * values
    return terms.sum(), np.abs(terms).sum()


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("names", [("a0", "a1", "a2"), ("b0", "b1", "b2")])
def test_the_derivative_of_a_quadratic_is_exact(ratio, names):
    now, before = 0.4, 0.1
    new, step = now + ratio * before, ratio * before
    weights = backward_weights(step, before)
    found, size = rate(
        [getattr(weights, name) for name in names], QUADRATIC(np.array([new, now, now - before]))
    )
    assert found == pytest.approx(QUADRATIC.deriv()(new), abs=1e-14 * size)
    assert weights.b_now == 0.0


def test_the_first_step_has_exact_velocities_of_a_quadratic_motion_and_rates_of_first_order():
    now, step = 0.4, 0.3
    weights, new = backward_weights(step, 0.0), 0.4 + 0.3
    velocity = weights.b0 * QUADRATIC(new) + weights.b1 * QUADRATIC(now)
    assert velocity + weights.b_now * QUADRATIC.deriv()(now) == pytest.approx(
        QUADRATIC.deriv()(new), rel=1e-13
    )
    slope = weights.a0 * QUADRATIC(new) + weights.a1 * QUADRATIC(now)
    assert slope == pytest.approx((QUADRATIC(new) - QUADRATIC(now)) / step, rel=1e-13)
    assert (weights.a2, weights.b2, weights.first) == (0.0, 0.0, pytest.approx(1.0 / step))


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.7])
def test_the_error_of_a_cubic_falls_with_the_square_of_the_step(ratio):
    steps = 0.1 * 0.5 ** np.arange(5)
    errors = []
    for before in steps:
        w = backward_weights(ratio * before, before)
        new = 1.0 + ratio * before
        errors.append(abs(w.a0 * new**3 + w.a1 * 1.0 + w.a2 * (1.0 - before) ** 3 - 3.0 * new**2))
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.02)
