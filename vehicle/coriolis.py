"""Coriolis and centripetal forces of any symmetric mass matrix, by Kirchhoff's equations.

With the momenta  P = M₁₁ v + M₁₂ ω  and  L = M₂₁ v + M₂₂ ω,

    C(ν) ν = [ ω × P ;  v × P + ω × L ]                                (Fossen 2021, theorem 3.2)

which is skew in ν for every M, so νᵀ C(ν) ν = 0: these forces move energy about and never make any. Used with
the rigid-body matrix it gives centripetal forces, with the added mass it gives the Munk moment and its
companions.
"""

from __future__ import annotations

import numpy as np

from subzero.jit import compiled


@compiled
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
    u, v, w, p, q, r = nu[0], nu[1], nu[2], nu[3], nu[4], nu[5]
    out[0] = r * P1 - q * P2
    out[1] = p * P2 - r * P0
    out[2] = q * P0 - p * P1
    out[3] = w * P1 - v * P2 + r * L1 - q * L2
    out[4] = u * P2 - w * P0 + p * L2 - r * L0
    out[5] = v * P0 - u * P1 + q * L0 - p * L1
