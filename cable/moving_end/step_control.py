"""How long a step may be: an estimate of its error, and the step that would just be allowed.

A backward difference of second order errs by h(h + h')/6 x‴ in the velocity V, that is by h(h + h')/6 V̈. The tow force
goes about with the square of the velocity, so it errs by h(h + h')/6 F̈ or so, while the force that is extrapolated from
the two steps before is off by h(h + h')/2 F̈. A third of that gap, as a share of the largest force so far, is what is
taken for the error.
"""

from __future__ import annotations

from math import sqrt

from cable.moving_end.state import Line
from subzero.jit import inner

SAFETY = 0.8
LARGEST_GROWTH, LARGEST_CUT = 2.0, 0.2


@inner
def estimate_error(line: Line, step: float) -> float:
    """Return the relative error of the tow force on level NEW; 0 when there is no history to tell. [-]."""
    if line.ends.previous_step <= 0.0:
        return 0.0
    ratio, F, past = step / line.ends.previous_step, line.ends.tow_force, line.ends.past_force
    gap, size = 0.0, line.ends.largest_force * line.ends.largest_force
    for i in range(3):
        gap += (F[i] - past[0, i] - ratio * (past[0, i] - past[1, i])) ** 2
    return sqrt(gap / max(size, 1e-30)) / 3.0


@inner
def note_force(line: Line) -> None:
    """Remember the tow force of an accepted step."""
    square, F = 0.0, line.ends.tow_force
    for i in range(3):
        line.ends.past_force[1, i] = line.ends.past_force[0, i]
        line.ends.past_force[0, i] = F[i]
        square += F[i] * F[i]
    line.ends.largest_force = max(line.ends.largest_force, sqrt(square))


@inner
def next_step(step: float, error: float, rtol: float) -> float:
    """Return the step that would err by a little less than `rtol`, given that `step` errs by `error`. [s]."""
    if error <= 0.0 or rtol <= 0.0:
        return LARGEST_GROWTH * step
    return step * min(max(SAFETY * sqrt(rtol / error), LARGEST_CUT), LARGEST_GROWTH)
