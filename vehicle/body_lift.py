"""Viscous lift of the bare hull and its moment, linear in incidence.

    Y = Y_uv |u| v + Y_ur u r        N = N_uv u v + N_ur |u| r
    Z = Z_uw |u| w + Z_uq u q        M = M_uw u w + M_uq |u| q          (Prestero 2001, sections 4.3 to 4.5)

Only the hull: the fins bring their own lift (`fins`), the Munk moment comes with the added mass. Flow
separates on the lee side of the after body, so the force acts behind the centre; N_uv > 0 turns the nose into
the flow. For the hull moving astern the force keeps its sign, |u|, and acts at the other end. The force
stands across the hull, so it always brakes; a set is dissipative if 4 Y_uv N_ur ≥ (Y_ur + N_uv)².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.jit import inlined
from vehicle.parameters import Section, parameter


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
