"""The pull of the cable in steady motion, as a formula.

    F_c = −(½ρπdC_t |V|² S + C_f/R_d) V/|V|,   M_c = r_c × F_c          (37), with the drum's friction

V is the velocity of the tow point through the water, v + ω × r_c. The cable lies along the way that the tow point
came: exact for a straight way (the discrete cable has this solution at every step); in a turn it is the limit of a
cable that cannot be dragged sideways, C_n ≫ C_t, and the real one cuts the corner. A cable with weight is not in the
formula. Where that matters, `subzero.steady_motion.trim` pulls the cable itself along the way.

A vehicle that speeds up takes its cable along: m S more of mass at the tow point, along V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.model import Model

NO_WAY = 1e-9
"""Below this speed of the tow point there is no direction to pull against. [m/s]"""


@dataclass(frozen=True, kw_only=True)
class SteadyPull:
    """The cable of a model at a fixed length.

    Attributes:
        drag: ½ρπdC_t S. [kg/m]
        friction: C_f/R_d. [N]
        mass: m S. [kg]
        tow_point: r_c, body axes (3,). [m]
    """

    drag: float
    friction: float
    mass: float
    tow_point: np.ndarray

    @classmethod
    def of(cls, model: Model, wet_length: float) -> SteadyPull:
        """Return the cable of a model with `wet_length` metres in the water; none pulls with none."""
        pulls = 1.0 if wet_length > 0.0 else 0.0
        return cls(
            drag=model.cable.tangential_drag * wet_length,
            friction=pulls * model.drum.friction_torque / model.drum.radius,
            mass=model.cable.mass_per_length * wet_length,
            tow_point=model.vehicle.tow_point.position(),
        )

    def wrench(self, nu: np.ndarray) -> np.ndarray:
        """Return force and moment on the hull (6,), body axes [N, N m], at nu (6,) through the water."""
        V = nu[:3] + np.cross(nu[3:], self.tow_point)
        speed = float(np.linalg.norm(V))
        if speed < NO_WAY:
            return np.zeros(6)
        F = -(self.drag * speed + self.friction / speed) * V
        return np.concatenate([F, np.cross(self.tow_point, F)])
