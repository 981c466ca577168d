"""How long a step may be: an estimate of its error, and the step that would just be allowed.

A backward difference of second order errs by h(h + h')/6 x‴ in the velocity, and the velocity that is extrapolated from
the two steps before errs by h(h + h')/2 V̈. A third of the gap between the two is the error of the new velocity; drag
goes with its square, so relative to the fastest node twice that share is the error of the tension.
"""

from __future__ import annotations

from math import sqrt

from subzero.compiled import inner

from .line import BEFORE, NEW, NOW, Line

SAFETY = 0.8
LARGEST_GROWTH, LARGEST_CUT = 2.0, 0.2


@inner
def estimate_error(line: Line, step: float) -> float:
    """Return the relative error of the step on level NEW; 0 when there is no history to tell. [-]."""
    if line.ends.previous_step <= 0.0:
        return 0.0
    ratio, V = step / line.ends.previous_step, line.velocity
    total, fastest = 0.0, 1e-30
    for j in range(line.ends.count):
        gap, speed = 0.0, 0.0
        for i in range(3):
            expected = V[NOW, j, i] + ratio * (V[NOW, j, i] - V[BEFORE, j, i])
            gap += (V[NEW, j, i] - expected) ** 2
            speed += V[NEW, j, i] ** 2
        total, fastest = total + gap, max(fastest, speed)
    return 2.0 / 3.0 * sqrt(total / (line.ends.count * fastest))


@inner
def next_step(step: float, error: float, rtol: float) -> float:
    """Return the step that would err by a little less than `rtol`, given that `step` errs by `error`. [s]."""
    if error <= 0.0 or rtol <= 0.0:
        return LARGEST_GROWTH * step
    return step * min(max(SAFETY * sqrt(rtol / error), LARGEST_CUT), LARGEST_GROWTH)
