"""Where a drum goes, and what its winch is asked for: given at times, cubic (places) and linear in between."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from subzero.compiled import inner

from .properties import DrumNumbers


class DrumPath(NamedTuple):
    """How the drum is led; beyond the last time it stands still.

    Attributes:
        times: increasing, two at least (n,). [s]
        place, velocity: of the drum, relative to its place at the start, earth axes (n, 3). [m], [m/s]
        setpoints: what a winch is asked for (n,), length [m] or tension [N].
    """

    times: np.ndarray
    place: np.ndarray
    velocity: np.ndarray
    setpoints: np.ndarray


def resting(times: np.ndarray, setpoints: np.ndarray | None = None) -> DrumPath:
    """Return the path of a drum that stays where it is."""
    n = times.size
    return DrumPath(
        times, np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n) if setpoints is None else setpoints
    )


@inner
def lead_drum(path: DrumPath, time: float, drum: DrumNumbers) -> None:
    """Fill place, velocity and setpoint of the drum at a time."""
    low, high = 0, path.times.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if path.times[middle] < time:
            low = middle
        else:
            high = middle
    whole = path.times[high] - path.times[low]
    x = min(max((time - path.times[low]) / whole, 0.0), 1.0)
    hermite(path.place, path.velocity, high, whole, x, drum.place)
    for i in range(3):
        drum.velocity[i] = path.velocity[low, i] + x * (path.velocity[high, i] - path.velocity[low, i])
    drum.setpoint = path.setpoints[low] + x * (path.setpoints[high] - path.setpoints[low])


@inner
def hermite(place: np.ndarray, velocity: np.ndarray, k: int, whole: float, x: float, out: np.ndarray) -> None:
    """Fill out (3,) with the place a fraction x from row k−1 to row k, cubic between places and velocities. [m]."""
    a, b = (1.0 - x) * (1.0 - x), x * x
    for i in range(3):
        out[i] = (1.0 + 2.0 * x) * a * place[k - 1, i] + (3.0 - 2.0 * x) * b * place[k, i]
        out[i] += whole * (x * a * velocity[k - 1, i] - (1.0 - x) * b * velocity[k, i])
