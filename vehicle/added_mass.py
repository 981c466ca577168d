"""The water that has to be moved along: added mass, and a correction of its Munk moment.

A body of revolution with a cruciform tail has the matrix M_A with A11 … A66 on the diagonal and the couplings
A26 = ∫ x a(x) dx and A35 = −∫ x a(x) dx of its lateral strips. Used in `coriolis` it gives the full C_A(ν),
with

    N = −(A22 − A11) u v,   M = (A33 − A11) u w,   K = −(A33 − A22) v w      (Munk 1924)

which turns a slender hull across the stream. Real boundary layers weaken it: viscous lift (`body_lift`)
carries that. `munk_factor` scales the moment as it stands, for a diagnosis; at 1 the correction is exactly
zero. A factor other than 1 is an empirical moment, no longer free of work, and is booked with the hull's
losses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.jit import inlined
from vehicle.parameters import Section, parameter


@dataclass(frozen=True, kw_only=True)
class AddedMass(Section):
    """Added masses A_ij = −(SNAME acceleration derivatives) about the hull centre."""

    surge: float = parameter("axial added mass, A11 = -X_udot", "kg", low=0.0)
    sway: float = parameter("lateral added mass, A22 = -Y_vdot", "kg", low=0.0)
    heave: float = parameter("vertical added mass, A33 = -Z_wdot", "kg", low=0.0)
    roll: float = parameter("added roll inertia, A44 = -K_pdot", "kg m2", low=0.0)
    pitch: float = parameter("added pitch inertia, A55 = -M_qdot", "kg m2", low=0.0)
    yaw: float = parameter("added yaw inertia, A66 = -N_rdot", "kg m2", low=0.0)
    sway_yaw: float = parameter("sway-yaw coupling, A26 = -Y_rdot = -N_vdot", "kg m")
    heave_pitch: float = parameter("heave-pitch coupling, A35 = -Z_qdot = -M_wdot", "kg m")
    munk_factor: float = parameter("factor on the Munk moment, 1 as computed", "1", low=0.0, high=10.0)

    def matrix(self) -> np.ndarray:
        """Return M_A about the hull centre, (6, 6) [kg, kg m, kg m2]."""
        matrix = np.diag([self.surge, self.sway, self.heave, self.roll, self.pitch, self.yaw])
        matrix[1, 5] = matrix[5, 1] = self.sway_yaw
        matrix[2, 4] = matrix[4, 2] = self.heave_pitch
        return matrix


@inlined
def munk_correction(nu_r: np.ndarray, added_mass: np.ndarray, excess: float, out: np.ndarray) -> None:
    """Fill out (6,) with (munk_factor − 1) times the Munk moment [N, N m]; `excess` is munk_factor − 1."""
    u, v, w = nu_r[0], nu_r[1], nu_r[2]
    A11, A22, A33 = added_mass[0, 0], added_mass[1, 1], added_mass[2, 2]
    # The signs of `coriolis`: drifting to starboard, v > 0, turns the nose to port while A22 > A11, further across the
    # flow. Fins and lift of the hull have to outweigh that.
    out[0] = out[1] = out[2] = 0.0
    out[3] = -excess * (A33 - A22) * v * w
    out[4] = excess * (A33 - A11) * u * w
    out[5] = -excess * (A22 - A11) * u * v
