"""The dry hull as a rigid body: mass, centre of gravity, inertia; and the Coriolis forces of any mass matrix.

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
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.errors import short
from subzero.jit import gated_inlined
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
