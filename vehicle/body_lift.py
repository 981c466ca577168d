"""Viscous lift of the bare hull and its moment, linear in incidence.

    Y = Y_uv |u| v + Y_ur u r        N = N_uv u v + N_ur |u| r
    Z = Z_uw |u| w + Z_uq u q        M = M_uw u w + M_uq |u| q          (Prestero 2001, sections 4.3 to 4.5)

Only the hull: the fins bring their own lift (`fins`), the Munk moment comes with the added mass. Flow
separates on the lee side of the after body, so the force acts behind the centre; N_uv > 0 turns the nose into
the flow. For the hull moving astern the force keeps its sign, |u|, and acts at the other end. The force
stands across the hull, so it always brakes; a set is dissipative if 4 Y_uv N_ur ≥ (Y_ur + N_uv)².

Or, of a winged body, forces in flow axes, as gliders are measured: drag, side force, lift and three moments.

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

from subzero.jit import compiled, inlined
from vehicle.parameters import Section, parameter

STILL = 1e-16
"""Square of a speed below which nothing is felt [m2/s2]."""


@dataclass(frozen=True, kw_only=True)
class BodyLift(Section):
    """Derivatives of the bare hull per metre a second of surge; force_per_velocity, SNAME signs."""

    sway_per_sway: float = parameter("Y_uv", "kg/m", high=0.0)
    sway_per_yaw: float = parameter("Y_ur", "kg")
    yaw_per_sway: float = parameter("N_uv, without the Munk moment", "kg")
    yaw_per_yaw: float = parameter("N_ur", "kg m", high=0.0)
    heave_per_heave: float = parameter("Z_uw", "kg/m", high=0.0)
    heave_per_pitch: float = parameter("Z_uq", "kg")
    pitch_per_heave: float = parameter("M_uw, without the Munk moment", "kg")
    pitch_per_pitch: float = parameter("M_uq", "kg m", high=0.0)

    def numbers(self) -> np.ndarray:
        """Return Y_uv, Y_ur, N_uv, N_ur, Z_uw, Z_uq, M_uw, M_uq."""
        lateral = (self.sway_per_sway, self.sway_per_yaw, self.yaw_per_sway, self.yaw_per_yaw)
        vertical = (self.heave_per_heave, self.heave_per_pitch, self.pitch_per_heave, self.pitch_per_pitch)
        return np.array(lateral + vertical)


@inlined
def body_lift(nu_r: np.ndarray, lift: np.ndarray, out: np.ndarray) -> None:
    """Fill out (6,) with the lift and its moment [N, N m]; nu_r through the water, `lift` from numbers()."""
    u, v, w, q, r = nu_r[0], nu_r[1], nu_r[2], nu_r[4], nu_r[5]
    speed = abs(u)
    out[0] = out[3] = 0.0
    out[1] = lift[0] * speed * v + lift[1] * u * r
    out[5] = lift[2] * u * v + lift[3] * speed * r
    out[2] = lift[4] * speed * w + lift[5] * u * q
    out[4] = lift[6] * u * w + lift[7] * speed * q


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
