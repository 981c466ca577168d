"""Forces of a winged body in flow axes, as gliders are measured: drag, side force, lift and three moments.

    D = (K_D0 + K_D α²) V²      S = K_β β V²           L = (K_L0 + K_α α) V²
    T_1 = (K_MR β + K_p p) V²   T_2 = (K_M0 + K_M α + K_q q) V²   T_3 = (K_MY β + K_r r) V²

    F = R_BW (−D, S, −L),   M = R_BW (T_1, T_2, T_3),   α = atan2(w, u),   β = asin(v/V)

    R_BW = [ cos α cos β   −cos α sin β   −sin α
             sin β          cos β           0
             sin α cos β   −sin α sin β    cos α ]                     (Graver 2005; Zhang et al. 2013)

The Munk moment comes with the added mass and is not in K_M, K_MY. The vehicle must not fly backwards: α near 180°
gives a drag of its square.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from subzero.jit import compiled
from vehicle.parameters import Section, parameter

STILL = 1e-16
"""Square of a speed below which nothing is felt [m2/s2]."""


@dataclass(frozen=True, kw_only=True)
class FlowAxes(Section):
    """Coefficients of forces and moments over V², in flow axes; angles in rad."""

    drag: float = parameter("K_D0", "kg/m", low=0.0)
    drag_per_incidence_squared: float = parameter("K_D", "kg/m", low=0.0)
    side_force_per_sideslip: float = parameter("K_beta", "kg/m", high=0.0)
    lift: float = parameter("K_L0", "kg/m")
    lift_per_incidence: float = parameter("K_alpha", "kg/m", low=0.0)
    roll_per_sideslip: float = parameter("K_MR", "kg")
    roll_per_roll_rate: float = parameter("K_p", "kg s", high=0.0)
    pitch: float = parameter("K_M0", "kg")
    pitch_per_incidence: float = parameter("K_M", "kg")
    pitch_per_pitch_rate: float = parameter("K_q", "kg s", high=0.0)
    yaw_per_sideslip: float = parameter("K_MY", "kg")
    yaw_per_yaw_rate: float = parameter("K_r", "kg s", high=0.0)

    def numbers(self) -> np.ndarray:
        """Return all coefficients, in the order of the fields (12,)."""
        return np.array(self.values())


@compiled
def add_flow_axes(nu_r: np.ndarray, k: np.ndarray, out: np.ndarray) -> None:
    """Add force and moment in flow axes to out (6,) [N, N m]; nu_r through the water, k from `FlowAxes.numbers`."""
    u, v, w = nu_r[0], nu_r[1], nu_r[2]
    V2 = u * u + v * v + w * w
    if V2 < STILL:
        return
    alpha, beta = math.atan2(w, u), math.asin(max(-1.0, min(1.0, v / math.sqrt(V2))))
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    force = (-(k[0] + k[1] * alpha * alpha) * V2, k[2] * beta * V2, -(k[3] + k[4] * alpha) * V2)
    moment = (
        (k[5] * beta + k[6] * nu_r[3]) * V2,
        (k[7] + k[8] * alpha + k[9] * nu_r[4]) * V2,
        (k[10] * beta + k[11] * nu_r[5]) * V2,
    )
    for first, a in ((0, force), (3, moment)):
        out[first] += ca * cb * a[0] - ca * sb * a[1] - sa * a[2]
        out[first + 1] += sb * a[0] + cb * a[1]
        out[first + 2] += sa * cb * a[0] - sa * sb * a[1] + ca * a[2]


NO_FLOW_AXES = FlowAxes(**dict.fromkeys(FlowAxes.__dataclass_fields__, 0.0))
"""Of a vehicle that is not described so."""
