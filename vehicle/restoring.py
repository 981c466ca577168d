"""Weight and buoyancy.

    F = (W − B) k_b,    M = (r_G W − r_B B) × k_b,    k_b = third row of R_nb        (Fossen 2021, eq. 4.6)

W = m g; B = W + net_buoyancy, so that a vehicle trimmed neutral remains neutral when its mass is changed. With
G below B the moment rights the hull: it is positive starboard-down for a hull heeled to port. Derived from
the potential −W z(G) + B z(B), hence free of loss.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from subzero.jit import Record, compiled, inlined
from vehicle.parameters import Section, parameter

if TYPE_CHECKING:
    from vehicle.rigid_body import RigidBody


class RestoringNumbers(Record):
    """W − B [N] and the three arms of r_G W − r_B B [N m]; W, B, r_G, r_B for the potential."""

    net_weight: float
    arm_x: float
    arm_y: float
    arm_z: float


@dataclass(frozen=True, kw_only=True)
class Buoyancy(Section):
    """Buoyancy in excess of weight, and where it acts, from the hull centre."""

    net_buoyancy: float = parameter("buoyancy minus weight, B - W", "N")
    centre_of_buoyancy_x: float = parameter("centre of buoyancy, forward, x_B", "m")
    centre_of_buoyancy_y: float = parameter("centre of buoyancy, to starboard, y_B", "m")
    centre_of_buoyancy_z: float = parameter("centre of buoyancy, downward, z_B", "m")

    def numbers(self, body: RigidBody, gravity: float) -> RestoringNumbers:
        """Return the net weight and the arms of weight and buoyancy together."""
        weight = body.mass * gravity
        centre = np.array([self.centre_of_buoyancy_x, self.centre_of_buoyancy_y, self.centre_of_buoyancy_z])
        arm = weight * (body.centre_of_gravity - centre) - self.net_buoyancy * centre
        return RestoringNumbers(-self.net_buoyancy, float(arm[0]), float(arm[1]), float(arm[2]))


@inlined
def restoring(R: np.ndarray, numbers: RestoringNumbers, out: np.ndarray) -> None:
    """Fill out (6,) with weight plus buoyancy [N, N m]; R is R_nb."""
    kx, ky, kz = R[2, 0], R[2, 1], R[2, 2]
    out[0] = numbers.net_weight * kx
    out[1] = numbers.net_weight * ky
    out[2] = numbers.net_weight * kz
    out[3] = numbers.arm_y * kz - numbers.arm_z * ky
    out[4] = numbers.arm_z * kx - numbers.arm_x * kz
    out[5] = numbers.arm_x * ky - numbers.arm_y * kx


@compiled
def potential(depth: float, R: np.ndarray, numbers: RestoringNumbers) -> float:
    """Return the potential energy of weight and buoyancy [J], zero with the hull centre at depth zero."""
    arms = numbers.arm_x * R[2, 0] + numbers.arm_y * R[2, 1] + numbers.arm_z * R[2, 2]
    return -numbers.net_weight * depth - arms
