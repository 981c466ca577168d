"""Drag of the hull along its axis, and further damping, for what that, strips and lift leave out: linear, and quadratic
by component.

    X = −½ ρ (π/4) D² C_D u |u|                                        (Hoerner 1965, on frontal area)
    F_i = D_i ν_i,      e.g.  K = K_p p                                 (linear)
    Y = Y_vv v|v| + Y_rr r|r|,   N = N_vv v|v| + N_rr r|r|, …           (quadratic; SNAME)

The axial drag is friction, form, joints and screws together; the profile drag of the fins is theirs (`fins`). Of
further damping Subzero II uses the quadratic roll term only; everything else is zero there and switched off exactly.
Vehicles known by such tables (REMUS 100, LAUV) put their numbers here instead of, or in addition to, the cross-flow
strips.
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


@dataclass(frozen=True, kw_only=True)
class LinearDamping(Section):
    """Force per velocity of the same direction; negative brakes."""

    surge: float = parameter("X_u", "kg/s", high=0.0)
    sway: float = parameter("Y_v", "kg/s", high=0.0)
    heave: float = parameter("Z_w", "kg/s", high=0.0)
    roll: float = parameter("K_p", "kg m2/s", high=0.0)
    pitch: float = parameter("M_q", "kg m2/s", high=0.0)
    yaw: float = parameter("N_r", "kg m2/s", high=0.0)

    def numbers(self) -> np.ndarray:
        """Return the six derivatives in the order of ν."""
        return np.array(self.values())


@dataclass(frozen=True, kw_only=True)
class QuadraticDamping(Section):
    """Force per velocity times its size; force_per_velocity, SNAME signs."""

    sway_per_sway: float = parameter("Y_vv", "kg/m", high=0.0)
    sway_per_yaw: float = parameter("Y_rr", "kg m")
    yaw_per_sway: float = parameter("N_vv", "kg")
    yaw_per_yaw: float = parameter("N_rr", "kg m2", high=0.0)
    heave_per_heave: float = parameter("Z_ww", "kg/m", high=0.0)
    heave_per_pitch: float = parameter("Z_qq", "kg m")
    pitch_per_heave: float = parameter("M_ww", "kg")
    pitch_per_pitch: float = parameter("M_qq", "kg m2", high=0.0)
    roll_per_roll: float = parameter("K_pp", "kg m2", high=0.0)

    def numbers(self) -> np.ndarray:
        """Return Y_vv, Y_rr, N_vv, N_rr, Z_ww, Z_qq, M_ww, M_qq, K_pp."""
        return np.array(self.values())


@inlined
def axial_drag(nu_r: np.ndarray, quadratic: float, out: np.ndarray) -> None:
    """Fill out (6,) with the axial drag [N]; `quadratic` is −X_uu [kg/m], nu_r relative to the water."""
    out[0] = -quadratic * nu_r[0] * abs(nu_r[0])
    for i in range(1, 6):
        out[i] = 0.0


@inlined
def linear_damping(nu_r: np.ndarray, linear: np.ndarray, out: np.ndarray) -> None:
    """Fill out (6,) with the linear damping [N, N m]; nu_r relative to the water."""
    for i in range(6):
        out[i] = linear[i] * nu_r[i]


@inlined
def quadratic_damping(nu_r: np.ndarray, quadratic: np.ndarray, out: np.ndarray) -> None:
    """Fill out (6,) with the quadratic damping by component [N, N m]; nu_r relative to the water."""
    vv, ww = nu_r[1] * abs(nu_r[1]), nu_r[2] * abs(nu_r[2])
    qq, rr = nu_r[4] * abs(nu_r[4]), nu_r[5] * abs(nu_r[5])
    out[0] = 0.0
    out[1] = quadratic[0] * vv + quadratic[1] * rr
    out[5] = quadratic[2] * vv + quadratic[3] * rr
    out[2] = quadratic[4] * ww + quadratic[5] * qq
    out[4] = quadratic[6] * ww + quadratic[7] * qq
    out[3] = quadratic[8] * nu_r[3] * abs(nu_r[3])
