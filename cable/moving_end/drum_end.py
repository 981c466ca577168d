"""The drum's equation (11), the last row of a step, and the loose cable in front of a drum that overruns.

The drum gives cable at the rate U_d, the water takes it at U = dℓ_N/dt, and L = ∫(U_d − U) dt lies loose:

    turning    T_N + ½ t_N·Q_N = (I_d/R_d²) dU_d/dt + C_f/R_d,     L = 0
    spinning   T_N + ½ t_N·Q_N = 0,     (I_d/R_d²) dU_d/dt + C_f/R_d = 0,     L > 0
    standing   U = 0; the drum coasts, if it turned

Where L = 0 for some steps, rates are differenced as all others, and U_d = U. Else to first order, with U_d from the
lengths of two levels: the step in which L runs out takes U_d part of the way from the drum's speed to that of the
cable, the next one the rest, and the impulse is (I_d/R_d²) ΔU_d. Differences of second order overshoot at that corner.
This is not possible with a cable of one segment: its drum gives the length that the chord requires (`assembly`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cable.drum import LENGTH, SPINNING, STANDING, TENSION, TURNING, DrumNumbers, coasting, friction
from cable.moving_end.slack_law import fading_rate, turning_rate
from cable.moving_end.state import BEFORE, DIAGONAL, KNOWN_STEPS, LOWER, NEW, NOW, RESIDUAL, Line
from subzero.jit import compiled, inner

if TYPE_CHECKING:
    from cable.moving_end.bdf2 import Weights
    from cable.moving_end.segment_load import Load


@inner
def drum_row(line: Line, w: Weights, drum: DrumNumbers, work: Load, slopes: bool) -> None:
    """Write the drum's equation (11), the second row of the last block; `work` still holds the last segment."""
    N, t, r = line.ends.count, work.tangent, line.rows[RESIDUAL, line.ends.count]
    Qt = line.load[N, 0] * t[0] + line.load[N, 1] * t[1] + line.load[N, 2] * t[2]
    line.ends.drum_pull = line.tension[NEW, N] + 0.5 * Qt
    # T t + ½Q: the last node carries half of the load of the last segment.
    for i in range(3):
        line.ends.drum_force[i] = line.tension[NEW, N] * t[i] + 0.5 * line.load[N, i]
    turn_drum(line, w, drum)
    pulled, by_length = drum.control != LENGTH and line.ends.drum_mode != STANDING, 1.0
    if not pulled:
        r[1] = line.ends.last_length[NEW] - _length_wanted(line, drum)
    elif drum.control == TENSION:
        r[1], by_length = -drum.setpoint, 0.0
    elif line.ends.drum_mode == SPINNING:
        r[1], by_length = 0.0, 0.0  # loose cable pulls at nothing
    else:
        U, (alpha, beta, past) = line.ends.payout[NEW] + line.ends.ahead[NEW], drum_history(line, w)
        held, slope = friction(drum, U)
        r[1] = -held - drum.inertia * (alpha * U + past)
        # ∂U/∂ℓ = β: the rate is differenced from the length.
        by_length = -(slope + drum.inertia * alpha) * beta
    if pulled:
        r[1] += line.ends.drum_pull
    if slopes:
        _differentiate_drum(line, by_length, pulled, Qt, work)


@inner
def drum_history(line: Line, w: Weights) -> tuple[float, float, float]:
    """Return the weights of the drum's new speed in its acceleration and of the new length in its speed [1/s], and
    the part of the acceleration that the speeds before give [m/s²]. They are of first order while cable is loose, and
    until two steps after the jerk that ends that.
    """
    U, ahead = line.ends.payout, line.ends.ahead
    if line.ends.since_loose < KNOWN_STEPS:
        return w.first, w.first, -w.first * (U[NOW] + ahead[NOW])
    now, before = U[NOW] + ahead[NOW], U[BEFORE] + ahead[BEFORE]
    return w.a0, w.b0, w.a1 * now + w.a2 * before


@inner
def rate_taken(line: Line, first: float) -> float:
    """Return the rate at which the water takes cable, as `drum_history` differences it; `first` is 1/Δt. [m/s]"""
    if line.ends.since_loose < KNOWN_STEPS:
        return first * (line.ends.last_length[NEW] - line.ends.last_length[NOW])
    return line.ends.payout[NEW]


@inner
def turn_drum(line: Line, w: Weights, drum: DrumNumbers) -> None:
    """Fill what lies loose at level NEW, and how far the drum is ahead of what the water takes: nothing of both where
    the cable pulls it; where nothing does it coasts.
    """
    ends = line.ends
    alpha, beta, past = drum_history(line, w)
    taken = rate_taken(line, w.first)
    if ends.drum_mode == TURNING:
        ends.loose[NEW] = 0.0
        ends.ahead[NEW] = taken - beta * ends.loose[NOW] - ends.payout[NEW]
        return
    U = coasting(drum, alpha, past)
    ends.loose[NEW] = ends.loose[NOW] + (U - taken) / beta
    ends.ahead[NEW] = U - ends.payout[NEW]


@compiled
def _differentiate_drum(line: Line, by_length: float, pulled: bool, Qt: float, work: Load) -> None:
    """Write the derivatives of the drum's equation; of the pull Q_N·t + T_N only if the drum is `pulled`."""
    N, t, by_near, by_far = line.ends.count, work.tangent, work.by_near, work.by_far
    D, L = line.blocks[DIAGONAL, N], line.blocks[LOWER, N]
    D[1, 1], D[2, 2], D[3, 3] = by_length, 1.0, 1.0  # the last block has two unknowns: the others are 0 = 0
    if not pulled:
        return
    D[1, 0] = 1.0
    size, length = work.chord_length, line.ends.last_length[NEW]
    g, fading = turning_rate(work.square), fading_rate(work.square, length, size)
    for i in range(3):
        D[1, 0] += 0.5 * t[i] * by_far[i, 0]
        D[1, 1] += 0.5 * t[i] * (by_far[i, 1] - fading * line.load[N, i])
        for k in range(3):
            L[1, 1 + k] += 0.5 * t[i] * by_near[i, k]
    for k in range(3):
        L[1, 1 + k] -= 0.5 * (line.load[N, k] - g * Qt * t[k]) / size


@compiled
def _length_wanted(line: Line, drum: DrumNumbers) -> float:
    """Return how long the last segment has to be: as long as it is, or as a winch requires. [m]."""
    if drum.control != LENGTH:
        return line.ends.last_length[NOW]
    return drum.setpoint - line.ends.settled
