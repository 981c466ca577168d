"""The motion of a drum, and the setpoint of its winch: a table over time, cubic (places) and linear in between.

Columns: time [s], place and velocity of the drum relative to its place at the start, earth axes [m], [m/s], and what a
winch is asked for, length [m] or tension [N]. One array, for few arguments compile sooner.
"""

from __future__ import annotations

import numpy as np

from cable.drum import DrumNumbers
from subzero.jit import inner

PLACE, VELOCITY, SETPOINT = 1, 4, 7
"""First columns of the place, the velocity and the setpoint in the table; column 0 is the time."""


def drum_path(
    times: np.ndarray, place: np.ndarray, velocity: np.ndarray, setpoints: np.ndarray
) -> np.ndarray:
    """Return the table (n, 8) from times (n,), places and velocities (n, 3) and setpoints (n,); two rows at least."""
    return np.ascontiguousarray(np.column_stack([times, place, velocity, setpoints]), dtype=float)


def resting(times: np.ndarray, setpoints: np.ndarray | None = None) -> np.ndarray:
    """Return the table of a drum that does not move."""
    still = np.zeros((times.size, 3))
    return drum_path(times, still, still, np.zeros(times.size) if setpoints is None else setpoints)


@inner
def lead_drum(table: np.ndarray, time: float, drum: DrumNumbers) -> None:
    """Fill place, velocity and setpoint of the drum at a time; beyond the last one it stands still."""
    low, high = 0, table.shape[0] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle, 0] < time:
            low = middle
        else:
            high = middle
    whole = table[high, 0] - table[low, 0]
    x = min(max((time - table[low, 0]) / whole, 0.0), 1.0)
    near, far = table[low], table[high]
    hermite(near[PLACE:], far[PLACE:], near[VELOCITY:], far[VELOCITY:], whole, x, drum.place)
    for i in range(3):
        before, after = table[low, VELOCITY + i], table[high, VELOCITY + i]
        drum.velocity[i] = before + x * (after - before)
    drum.setpoint = table[low, SETPOINT] + x * (table[high, SETPOINT] - table[low, SETPOINT])


@inner
def hermite(
    near: np.ndarray,
    far: np.ndarray,
    near_velocity: np.ndarray,
    far_velocity: np.ndarray,
    whole: float,
    x: float,
    out: np.ndarray,
) -> None:
    """Fill out (3,) with the place a fraction x of `whole` [s] between two places, cubic by their velocities. [m]."""
    a, b = (1.0 - x) * (1.0 - x), x * x
    for i in range(3):
        out[i] = (1.0 + 2.0 * x) * a * near[i] + (3.0 - 2.0 * x) * b * far[i]
        out[i] += whole * (x * a * near_velocity[i] - (1.0 - x) * b * far_velocity[i])
