"""Bending: a cable with a bending stiffness EI resists curvature, also where it is slack.

The bending energy of a chain of straight segments with tangents t_j, and the force in segment j that follows from it:

    E_B = Σ ½ EI |t_{j+1} − t_j|²/ℓ̄_j,   M_j = EI (t_{j+1} − t_j)/ℓ̄_j,   q_j = P_j (M_j − M_{j−1})/|d_j|

with ℓ̄_j = ½(ℓ_j + ℓ_{j+1}) and no moment at the two ends (hinges at the vehicle and at the drum). Then f_j becomes
T_j t_j − q_j wherever `cable.assembly` uses it; q_j is the shear force, EI ∂³x/∂s³ for a gently bent cable.

q reaches over five nodes where the rest of the equations reaches over three. So it is taken at the prediction of the
step, and a brace S_j (d_j − d_j*) with S = 4EI/ℓ³ holds the chord d to its prediction d*: with S at least as stiff as
bending is between neighbours (and it is: 4(1 − cos θ)² ≤ 8(1 − cos θ)) the step is stable for any EI and Δt. The price is an
error S ½Δt² ∂²d/∂t², of second order, and none at rest. A layer of thickness √(EI/T) at a clamped end is not modelled.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from subzero.compiled import compiled, inner

from .line import NEW, Line
from .properties import CableNumbers


@inner
def bend(line: Line, c: CableNumbers) -> None:
    """Fill line.shear with q_j + S_j d_j* and line.bracing with S_j, from the prediction on level NEW."""
    near, far = np.zeros(3), np.zeros(3)
    for j in range(1, line.ends.count + 1):
        for i in range(3):
            near[i] = far[i]
        _moment(line, j, c.bending_stiffness, far)
        shortest = min(_length(line, j), _length(line, max(j - 1, 1)), _length(line, j + 1))
        line.bracing[j] = 4.0 * c.bending_stiffness / shortest**3
        along, square = 0.0, 0.0
        for i in range(3):
            d = line.position[NEW, j, i] - line.position[NEW, j - 1, i]
            along += d * (far[i] - near[i])
            square += d * d
        r = sqrt(max(square, 1e-30))
        for i in range(3):
            d = line.position[NEW, j, i] - line.position[NEW, j - 1, i]
            q = (far[i] - near[i] - along * d / (r * r)) / r
            line.shear[j, i] = q + line.bracing[j] * d


@compiled
def _moment(line: Line, j: int, stiffness: float, out: np.ndarray) -> None:
    """Fill out (3,) with M_j = EI (t_{j+1} − t_j)/ℓ̄_j at node j, none at the ends. [N m]."""
    for i in range(3):
        out[i] = 0.0
    if j == line.ends.count:
        return
    spread = 0.5 * (_length(line, j) + _length(line, j + 1))
    for side in range(2):
        square = 0.0
        for i in range(3):
            square += (line.position[NEW, j + side, i] - line.position[NEW, j + side - 1, i]) ** 2
        weight = (2 * side - 1) * stiffness / (spread * sqrt(max(square, 1e-30)))
        for i in range(3):
            out[i] += weight * (line.position[NEW, j + side, i] - line.position[NEW, j + side - 1, i])


@compiled
def _length(line: Line, j: int) -> float:
    """Return the predicted length of segment j; of the last one for any j beyond. [m]."""
    return line.length[j] if j < line.ends.count else line.ends.last_length[NEW]
