"""Backward differences of second order on uneven steps (BDF2): the time derivative of everything in the cable.

    df/dt (t_new) ≈ a₀ f_new + a₁ f_now + a₂ f_before

Exact for quadratic polynomials. It damps the stiff part completely (the cable's sideways motion settles in
milliseconds, far below a step) and gives the tension, which has no time derivative of its own, anew at every step:
no staircase. The first step, and a step after a break in the motion, may use the first-order form a₂ = 0.
"""

from __future__ import annotations

from subzero.compiled import compiled


@compiled
def backward_weights(step: float, previous_step: float) -> tuple[float, float, float]:
    """Return a₀, a₁, a₂ of the backward difference. [1/s].

    Args:
        step: t_new − t_now. [s]
        previous_step: t_now − t_before; 0 when there is no earlier value (first order). [s]
    """
    if previous_step <= 0.0:
        return 1.0 / step, -1.0 / step, 0.0
    ratio = step / previous_step
    a0 = (1.0 + 2.0 * ratio) / (step * (1.0 + ratio))
    a2 = ratio * ratio / (step * (1.0 + ratio))
    return a0, -(a0 + a2), a2
