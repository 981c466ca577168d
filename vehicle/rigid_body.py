"""The dry hull as a rigid body: mass, centre of gravity, inertia.

    M_RB = [ m I          −m S(r_G)
             m S(r_G)   I_G − m S(r_G)² ]                              (Fossen 2021, eq. 3.47)

about the hull centre; inertias are given about the centre of gravity, so that every positive set is a
possible body. Products of inertia are left out: a torpedo with its battery amidships has none worth naming.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vehicle.parameters import Section, parameter


def skew(vector: np.ndarray) -> np.ndarray:
    """Return the matrix S(a) with S(a) b = a × b."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass(frozen=True, kw_only=True)
class RigidBody(Section):
    """Mass, centre of gravity from the hull centre, and inertias about the centre of gravity."""

    mass: float = parameter("mass with everything inside, m", "kg", above=0.0)
    roll_inertia: float = parameter("inertia about the longitudinal axis through G, I_x", "kg m2", above=0.0)
    pitch_inertia: float = parameter("inertia about the transverse axis through G, I_y", "kg m2", above=0.0)
    yaw_inertia: float = parameter("inertia about the vertical axis through G, I_z", "kg m2", above=0.0)
    centre_of_gravity_x: float = parameter("centre of gravity, forward, x_G", "m")
    centre_of_gravity_y: float = parameter("centre of gravity, to starboard, y_G", "m")
    centre_of_gravity_z: float = parameter("centre of gravity, downward, z_G", "m")

    @property
    def centre_of_gravity(self) -> np.ndarray:
        """r_G in body axes [m]."""
        return np.array([self.centre_of_gravity_x, self.centre_of_gravity_y, self.centre_of_gravity_z])

    def matrix(self) -> np.ndarray:
        """Return M_RB about the hull centre, (6, 6) [kg, kg m, kg m2]."""
        S = skew(self.centre_of_gravity)
        matrix = np.zeros((6, 6))
        matrix[:3, :3] = self.mass * np.eye(3)
        matrix[:3, 3:] = -self.mass * S
        matrix[3:, :3] = self.mass * S
        inertia = np.diag([self.roll_inertia, self.pitch_inertia, self.yaw_inertia])
        matrix[3:, 3:] = inertia - self.mass * S @ S
        return matrix
