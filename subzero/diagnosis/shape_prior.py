"""The shapes of a missing force that are tried, and how probable each is along an axis before a record is seen."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from subzero.diagnosis.shapes import SWITCHED, Shape, decaying, plain_shapes, waves, windowed

SENSIBLE: Mapping[str, tuple[str, ...]] = {
    "X": ("u|u|", "constant", "n|n|", "n u", "wet_length*u2", "wet_length", "time*u2"),
    "Y": ("uv", "ur", "constant", "rudder_angle*u2", "v|v|", "u|u|"),
    "Z": ("constant", "time", "uw", "uq", "stern_plane*u2", "w|w|", "u|u|", "depth"),
    "K": ("n|n|", "constant", "p|p|", "u|u|"),
    "M": ("uw", "uq", "constant", "stern_plane*u2", "q|q|", "u|u|"),
    "N": ("uv", "ur", "rudder_angle*u2", "r|r|", "constant", "u|u|", "n|n|"),
}
"""What usually acts along an axis, and what is therefore more probable beforehand."""
ODD = 0.25
"""Prior of another feature beside a sensible one."""


def all_shapes(factors: np.ndarray, times: np.ndarray) -> list[Shape]:
    """Return every shape that is tried, from the factors of features at times."""
    plain = plain_shapes(factors)
    edges = np.arange(0.0, times[-1], 1.0 if times[-1] < 40.0 else 2.0)
    able = [one for one in plain if one.feature in SWITCHED]
    parts = [[*windowed(one, times, edges), *decaying(one, times, edges)] for one in able]
    return plain + [shape for part in parts for shape in part] + waves(times)


def size_of(shape: Shape) -> float:
    """Return the size of a shape where it is not 0."""
    inside = np.any(shape.columns != 0.0, axis=1)
    return float(np.sqrt(np.mean(shape.columns[inside] ** 2)))


def shape_weight(shape: Shape, axis: str) -> float:
    """Return how probable a shape is along an axis beforehand, as a logarithm, but for a common constant."""
    return shape.log_prior + (0.0 if shape.feature in SENSIBLE[axis] else float(np.log(ODD)))
