"""The equations of the far end: cable that enters at the drum, the drum's own equation (11), or a drogue.

What enters carries momentum p(S) per length into the last segment, which ends at a fixed place where material passes:

    Q_N = d/dt(ℓ_N p_N) − U p(S) + ℓ_N (D − w_c k),   velocity of the material at the drum V_d − U d_N/ℓ_N
"""

from __future__ import annotations

import numpy as np

from cable.drum import LENGTH, SPINNING, STANDING, TENSION, friction
from cable.moving_end.bdf2 import Weights
from cable.moving_end.segment_load import Load, fading_rate, turning_rate
from cable.moving_end.state import BEFORE, DIAGONAL, LOWER, NEW, NOW, RESIDUAL, Line
from cable.properties import CableNumbers, DrumNumbers
from subzero.jit import compiled, inner


@inner
def add_drogue(line: Line, w: Weights, slopes: bool) -> None:
    """Add the drag of a drogue, ½ρC_dA |U| U, to the balance of the free end."""
    N, k, square = line.ends.count, line.ends.tail_drag, 0.0
    J = line.water[NEW, N]
    for i in range(3):
        square += (line.velocity[NEW, N, i] - J[i]) ** 2
    size = np.sqrt(square)
    line.ends.drum_pull = k * square
    for i in range(3):
        U = line.velocity[NEW, N, i] - J[i]
        line.rows[RESIDUAL, N, 1 + i] += k * size * U
        if not slopes:
            continue
        line.blocks[DIAGONAL, N, 1 + i, 1 + i] += k * size * w.b0
        for m in range(3):
            slope = U * (line.velocity[NEW, N, m] - J[m]) / max(size, 1e-12)
            line.blocks[DIAGONAL, N, 1 + i, 1 + m] += k * slope * w.b0


@inner
def add_influx(line: Line, c: CableNumbers, work: Load) -> None:
    """Complete Q of the last segment by the momentum that enters at the drum, where `work.water` is from here on."""
    N, U, t, J = line.ends.count, line.ends.payout[NEW], work.tangent, work.water
    for i in range(3):  # the water at the drum, as the drum sees it
        J[i] = line.water[NEW, N, i] - line.ends.drum_velocity[i]
    Jt = J[0] * t[0] + J[1] * t[1] + J[2] * t[2]
    for i in range(3):
        entering = c.mass * line.velocity[NEW, N, i] - c.added_mass * (J[i] - Jt * t[i])
        line.load[N, i] -= U * entering


@inner
def differentiate_influx(
    line: Line, length: float, w: Weights, T: float, c: CableNumbers, work: Load
) -> None:
    """Fill ∂Q/∂x_{N−1} and ∂Q/∂(T, ℓ) of the last segment."""
    N, U, t, d = line.ends.count, line.ends.payout[NEW], work.tangent, work.chord
    by_near, by_far, J, r = work.by_near, work.by_far, work.water, work.chord_length
    g, fading = turning_rate(d, length), fading_rate(d, length, r)
    Jt = J[0] * t[0] + J[1] * t[1] + J[2] * t[2]
    dU = 0.0 if line.ends.drum_mode == STANDING else w.b0
    stretch = 0.5 * c.compliance / (1.0 + c.compliance * T)
    for i in range(3):
        entering = c.mass * line.velocity[NEW, N, i] - c.added_mass * (J[i] - Jt * t[i])
        by_far[i, 0] = length * stretch * work.drag[i]
        by_far[i, 1] = work.q[i] - dU * entering - U * c.mass * (U / length - dU) * d[i] / length
        by_far[i, 1] -= fading * (length * work.q_tt[i] - 2.0 * U * c.added_mass * Jt * t[i])
        by_far[i, 2] = 0.0
        by_far[i, 3] = 0.0
        for k in range(3):
            B = ((1.0 if i == k else 0.0) - g * t[i] * t[k]) / r
            across_k = J[k] - g * Jt * t[k]
            by_far[i, 1] += 0.5 * work.q_V[i, k] * (U / length - dU) * d[k]
            by_near[i, k] = length * (0.5 * (w.b0 + U / length) * work.q_V[i, k] - work.q_d[i, k])
            by_near[i, k] += U * c.added_mass * (Jt * B + t[i] * across_k / r)
        by_near[i, i] -= U * c.mass * U / length


@inner
def drum_row(line: Line, w: Weights, drum: DrumNumbers, work: Load, slopes: bool) -> None:
    """Write the drum's equation (11), the second row of the last block; `work` still holds the last segment."""
    N, t, r = line.ends.count, work.tangent, line.rows[RESIDUAL, line.ends.count]
    Qt = line.load[N, 0] * t[0] + line.load[N, 1] * t[1] + line.load[N, 2] * t[2]
    line.ends.drum_pull = line.tension[NEW, N] + 0.5 * Qt
    for i in range(3):
        line.ends.drum_force[i] = line.tension[NEW, N] * t[i] + 0.5 * line.load[N, i]
    U, by_length = line.ends.payout, 1.0
    pulled = drum.control != LENGTH and line.ends.drum_mode != STANDING
    if not pulled:
        r[1] = line.ends.last_length[NEW] - _length_wanted(line, drum)
    elif drum.control == TENSION:
        r[1], by_length = -drum.setpoint, 0.0
    else:
        held, slope = friction(drum, U[NEW])
        r[1] = -held - drum.inertia * (w.a0 * U[NEW] + w.a1 * U[NOW] + w.a2 * U[BEFORE])
        by_length = -(slope + drum.inertia * w.a0) * w.b0
    pulled = pulled and line.ends.drum_mode != SPINNING
    if pulled:
        r[1] += line.ends.drum_pull
    if slopes:
        _differentiate_drum(line, by_length, pulled, Qt, work)


@compiled
def _differentiate_drum(line: Line, by_length: float, pulled: bool, Qt: float, work: Load) -> None:
    """Write the derivatives of the drum's equation; of the pull Q_N·t + T_N only if the drum is `pulled`."""
    N, t, by_near, by_far = line.ends.count, work.tangent, work.by_near, work.by_far
    D, L = line.blocks[DIAGONAL, N], line.blocks[LOWER, N]
    D[1, 1], D[2, 2], D[3, 3] = by_length, 1.0, 1.0
    if not pulled:
        return
    D[1, 0] = 1.0
    size, length = work.chord_length, line.ends.last_length[NEW]
    g, fading = turning_rate(work.chord, length), fading_rate(work.chord, length, size)
    for i in range(3):
        D[1, 0] += 0.5 * t[i] * by_far[i, 0]
        D[1, 1] += 0.5 * t[i] * (by_far[i, 1] - fading * line.load[N, i])
        for k in range(3):
            L[1, 1 + k] += 0.5 * t[i] * by_near[i, k]
    for k in range(3):
        L[1, 1 + k] -= 0.5 * (line.load[N, k] - g * Qt * t[k]) / size


@compiled
def _length_wanted(line: Line, drum: DrumNumbers) -> float:
    """Return how long the last segment has to be: as long as it is, or what a winch asks for. [m]."""
    if drum.control != LENGTH:
        return line.ends.last_length[NOW]
    return drum.setpoint - line.ends.settled
