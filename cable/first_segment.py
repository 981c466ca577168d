"""The start of a run: while there is one segment only, it is a straight line between tow point and drum.

Its shape leaves nothing to solve for, and a slack one cannot lie anywhere. So the drum gives what the chord asks
for and takes nothing back, and the segment pulls or does not:

    ℓ = max(|d|, ℓ_now),     T = max(T(S) − ½ t·Q, 0)

both rounded off (`CORNER`) so that Newton's method passes. A current that is faster than the vehicle would drag cable
off a frictionless drum by its own; with one segment, it does not.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.line import DIAGONAL, LOWER, NEW, NOW, RESIDUAL, Line
from subzero.jit import compiled, inner

CORNER = 1e-9
"""Size of the rounding of both maxima. [m], [N]"""


@inner
def write_single_segment(line: Line, d: np.ndarray) -> None:
    """Replace both rows of the only block, whose second row holds the drum's equation (11)."""
    D, L = line.blocks[DIAGONAL, 1], line.blocks[LOWER, 1]
    r, T = line.rows[RESIDUAL, 1], line.tension[NEW, 1]
    chord = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + CORNER * CORNER)
    longer, by_chord = _maximum(chord, line.ends.last_length[NOW])
    r[0] = line.ends.last_length[NEW] - longer
    D[0, 0], D[0, 1] = 0.0, 1.0
    pull, by_pull = _maximum(T - r[1], 0.0)
    r[1] = T - pull
    D[1, 0] = 1.0 - by_pull * (1.0 - D[1, 0])
    D[1, 1] *= by_pull
    for i in range(3):
        L[0, 1 + i] = by_chord * d[i] / chord
        L[1, 1 + i] *= by_pull


@compiled
def _maximum(a: float, b: float) -> tuple[float, float]:
    """Return max(a, b), rounded off over `CORNER`, and its derivative by a."""
    s = sqrt((a - b) * (a - b) + CORNER * CORNER)
    return 0.5 * (a + b + s), 0.5 * (1.0 + (a - b) / s)
