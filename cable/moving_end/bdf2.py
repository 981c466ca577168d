"""Backward differences of second order on uneven steps (BDF2): the time derivative of everything in the cable.

    df/dt (t_new) ≈ a₀ f_new + a₁ f_now + a₂ f_before

Exact for quadratic polynomials. It damps the stiff part completely (the cable's sideways motion settles in
milliseconds, far below a step) and gives the tension, which has no time derivative of its own, again at every step:
no staircase. The first step has no f_before. There velocities follow from positions by the trapezoidal rule, which
needs the velocity at the start (known) and is exact for quadratic motions too,

    V_new = 2 (x_new − x_now)/Δt − V_now

and momenta are differenced to first order, in that one step.
"""

from __future__ import annotations

from typing import NamedTuple

from subzero.jit import inner


class Weights(NamedTuple):
    """Weights of the new value, the present one and the one before. [1/s]

    Attributes:
        a0, a1, a2: for rates of momenta and of the pay-out.
        b0, b1, b2: for velocities from positions.
        b_now: weight of the present velocity in the new one. [-]
        first: of first order, 1/Δt.
    """

    a0: float
    a1: float
    a2: float
    b0: float
    b1: float
    b2: float
    b_now: float
    first: float


@inner
def backward_weights(step: float, previous_step: float) -> Weights:
    """Return the weights for a step.

    Args:
        step: t_new − t_now. [s]
        previous_step: t_now − t_before; 0 when there is no earlier value. [s]
    """
    # Without a past: a trapezoidal rule for positions, 2Δx/Δt − V, and a first-order rate for momenta.
    if previous_step <= 0.0:
        slope = 1.0 / step
        return Weights(slope, -slope, 0.0, 2.0 * slope, -2.0 * slope, 0.0, -1.0, slope)
    # Variable steps: the weights of the parabola through three points.
    ratio = step / previous_step
    a0 = (1.0 + 2.0 * ratio) / (step * (1.0 + ratio))
    a2 = ratio * ratio / (step * (1.0 + ratio))
    return Weights(a0, -(a0 + a2), a2, a0, -(a0 + a2), a2, 0.0, 1.0 / step)
