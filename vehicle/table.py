"""The breakdown of forces for people: a dictionary of named six-component arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vehicle.dynamics import breakdown
from vehicle.terms import BREAKDOWN
from vehicle.vehicle import Vehicle

NO_COMMAND, NO_CURRENT, NO_WRENCH = (0.0,) * 4, (0.0,) * 3, (0.0,) * 6


def breakdown_table(
    vehicle: Vehicle,
    state: Sequence[float] | np.ndarray,
    command: Sequence[float] = NO_COMMAND,
    *,
    current_n: Sequence[float] = NO_CURRENT,
    wrench_b: Sequence[float] = NO_WRENCH,
) -> dict[str, np.ndarray]:
    """Return every named force on the vehicle: name → (X, Y, Z, K, M, N) in body axes [N, N m].

    Args:
        vehicle: whose forces.
        state: as in `vehicle.STATE`, for example from `initial_state`.
        command: propeller [rev/s], rudder, port plane, starboard plane [rad].
        current_n: velocity of the water, earth axes. [m/s]
        wrench_b: external force and moment about the hull centre. [N, N m]
    """
    out = np.empty((len(BREAKDOWN), 6))
    inputs = [np.asarray(values, dtype=float) for values in (state, command, current_n, wrench_b)]
    breakdown(inputs[0], inputs[1], inputs[2], inputs[3], vehicle.numbers(), out)
    return dict(zip(BREAKDOWN, out, strict=True))
