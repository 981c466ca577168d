"""Drag of the hull along its axis.

    X = −½ ρ (π/4) D² C_D u |u|                                        (Hoerner 1965, on frontal area)

Friction, form, joints and screws together; the profile drag of the fins is theirs (`fins`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from subzero.jit import inlined
from vehicle.parameters import Section, parameter


@dataclass(frozen=True, kw_only=True)
class AxialDrag(Section):
    """Axial drag of the hull without fins."""

    drag_coefficient: float = parameter("axial drag coefficient on frontal area, C_D", "1", low=0.0)

    def numbers(self, diameter: float, density: float) -> float:
        """Return −X_uu = ½ρ(π/4)D² C_D [kg/m]."""
        return density * math.pi / 8.0 * diameter**2 * self.drag_coefficient


@inlined
def axial_drag(nu_r: np.ndarray, quadratic: float, out: np.ndarray) -> None:
    """Fill out (6,) with the axial drag [N]; `quadratic` is −X_uu [kg/m], nu_r relative to the water."""
    out[0] = -quadratic * nu_r[0] * abs(nu_r[0])
    for i in range(1, 6):
        out[i] = 0.0
