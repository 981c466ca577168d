"""Where the energy of a moving cable goes, per unit time.

In axes that move with the steady, uniform water (V' = V − J; still water: V), the balance of `element` times V' gives

    −F·V'(0) = dE/dt + L − G + D_S + M

with F the force on the vehicle, E = ∫(½mV'² + ½ρA V'_⊥² + ½eT²) ds the energy in the water, L = ∫D·V' ds the loss to
drag, G = ∫w_c V'_k ds the work of gravity, and

    D_S = T(S) (U + t·J) − U e(S)        work on the drum, less the energy that enters with new cable; U = dS/dt
    M   = −ρA ∫ V'_t V'_⊥·(∂t/∂t) ds     (the paper's added mass is no gradient of an energy when the cable turns)

M is the vector form of −(m1 − m)∫V_t V_n β̇ ds. It follows from V'·∂(P V')/∂t = ∂(½V'_⊥²)/∂t − V'_t V'_⊥·∂t/∂t, because
V'_⊥ has no component along t; and ∂t/∂t = ∂V/∂s across.
"""

from __future__ import annotations

import numpy as np

from subzero.compiled import compiled, inner

from .element import Load, evaluate_load
from .line import NOW, Line
from .properties import CableNumbers

LOSS, STORED, GRAVITY_WORK, AT_DRUM, ADDED_MASS = range(5)
"""What `energy_flow` fills: L [W], E [J], G [W], D_S [W], M [W]."""


@inner
def energy_flow(line: Line, J: np.ndarray, c: CableNumbers, work: Load, out: np.ndarray) -> None:
    """Fill out (5,) with the powers and the stored energy of the cable at level NOW."""
    N, t, across, V = line.ends.count, work.tangent, work.across, work.velocity
    for i in range(5):
        out[i] = 0.0
    for j in range(1, N + 1):
        length = line.ends.last_length[NOW] if j == N else line.length[j]
        T = line.tension[NOW, j]
        for i in range(3):
            V[i] = 0.5 * (line.velocity[NOW, j - 1, i] + line.velocity[NOW, j, i])
            work.chord[i] = line.position[NOW, j, i] - line.position[NOW, j - 1, i]
        evaluate_load(V, J, work.chord, length, T, line.slip[j], line.normal_gain[j], 0.0, c, work)
        square, side, along, turn = 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            speed = V[i] - J[i]
            out[LOSS] += length * work.drag[i] * speed
            square += speed * speed
            side += across[i] * across[i]
            along += speed * t[i]
            turn += across[i] * (line.velocity[NOW, j, i] - line.velocity[NOW, j - 1, i])
        out[STORED] += 0.5 * length * (c.mass * square + c.added_mass * side + c.compliance * T * T)
        out[GRAVITY_WORK] += length * c.weight * (V[2] - J[2])
        out[ADDED_MASS] -= c.added_mass * along * turn
    _drum_flow(line, J, c, t, out)


@compiled
def _drum_flow(line: Line, J: np.ndarray, c: CableNumbers, t: np.ndarray, out: np.ndarray) -> None:
    """Fill D_S; `t` is the tangent of the last segment."""
    U, T, N = line.ends.payout[NOW], max(line.ends.drum_pull, 0.0), line.ends.count
    Jt, square, side = 0.0, 0.0, 0.0
    for i in range(3):
        Jt += J[i] * t[i]
        square += (line.velocity[NOW, N, i] - J[i]) ** 2
    for i in range(3):
        side += (J[i] - Jt * t[i]) ** 2
    entering = 0.5 * (c.mass * square + c.added_mass * side + c.compliance * T * T)
    out[AT_DRUM] = T * (U + Jt) - U * entering
