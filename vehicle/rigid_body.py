"""The dry hull as a rigid body: mass, centre of gravity, inertia; the Coriolis forces of any mass matrix; and the
water that has to be moved along: added mass, and a correction of its Munk moment.

    M_RB = [ m I          −m S(r_G)
             m S(r_G)   I_G − m S(r_G)² ]                              (Fossen 2021, eq. 3.47)

about the hull centre; inertias are given about the centre of gravity, so that every positive set is a
possible body. Products of inertia are zero unless a file has a section of them: a torpedo with its battery amidships
has none worth naming.

Coriolis and centripetal forces follow from the mass matrix alone, by Kirchhoff's equations. With the momenta
P = M₁₁ v + M₁₂ ω  and  L = M₂₁ v + M₂₂ ω,

    C(ν) ν = [ ω × P ;  v × P + ω × L ]                                (Fossen 2021, theorem 3.2)

which is skew in ν for every M, so νᵀ C(ν) ν = 0: these forces move energy about and never make any. Used with
the rigid-body matrix it gives centripetal forces, with the added mass it gives the Munk moment and its
companions.

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

from subzero.errors import short
from subzero.jit import gated_inlined, inlined
from vehicle.parameters import Problem, Section, parameter


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


@dataclass(frozen=True, kw_only=True)
class ProductsOfInertia(Section):
    """Products of inertia about axes through the centre of gravity, I_xy = ∫ x y dm; −I_xy stands in the matrix."""

    xy: float = parameter("I_xy", "kg m2")
    xz: float = parameter("I_xz", "kg m2")
    yz: float = parameter("I_yz", "kg m2")

    def matrix(self) -> np.ndarray:
        """Return what they add to M_RB, (6, 6). [kg m2]"""
        matrix = np.zeros((6, 6))
        for (i, j), value in zip(((3, 4), (3, 5), (4, 5)), self.values(), strict=True):
            matrix[i, j] = matrix[j, i] = -value
        return matrix


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


def inertia_problems(body: RigidBody, products: ProductsOfInertia | None) -> list[Problem]:
    """Return the problem of products of inertia that no body of these inertias has."""
    if products is None:
        return []
    if not isinstance(products, ProductsOfInertia):
        why, allowed = "this is no such part", "ProductsOfInertia, or None"
        return [Problem(key="products_of_inertia", found=short(products), why=why, allowed=allowed)]
    inertias = np.diag([body.roll_inertia, body.pitch_inertia, body.yaw_inertia])
    if np.linalg.eigvalsh(inertias + products.matrix()[3:, 3:])[0] > 0.0:
        return []
    why = "about some axis the inertia would be negative"
    allowed = "products that are small compared with the inertias of the rigid body"
    return [Problem(key="products_of_inertia", found=short(products.values()), why=why, allowed=allowed)]


@gated_inlined
def coriolis(mass_matrix: np.ndarray, nu: np.ndarray, out: np.ndarray) -> None:
    """Fill out (6,) with the force −C(ν)ν on the body [N, N m], of a symmetric mass matrix (6, 6)."""
    P0 = P1 = P2 = L0 = L1 = L2 = 0.0
    for j in range(6):
        P0 += mass_matrix[0, j] * nu[j]
        P1 += mass_matrix[1, j] * nu[j]
        P2 += mass_matrix[2, j] * nu[j]
        L0 += mass_matrix[3, j] * nu[j]
        L1 += mass_matrix[4, j] * nu[j]
        L2 += mass_matrix[5, j] * nu[j]
    # On the right-hand side of M ν̇ = Σ stands −C(ν)ν = [P × ω ; P × v + L × ω]. P of the added mass is not along v: its
    # P × v is Munk's moment, and no term for it is added anywhere else.
    u, v, w, p, q, r = nu[0], nu[1], nu[2], nu[3], nu[4], nu[5]
    out[0] = r * P1 - q * P2
    out[1] = p * P2 - r * P0
    out[2] = q * P0 - p * P1
    out[3] = w * P1 - v * P2 + r * L1 - q * L2
    out[4] = u * P2 - w * P0 + p * L2 - r * L0
    out[5] = v * P0 - u * P1 + q * L0 - p * L1


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
