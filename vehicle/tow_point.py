"""Where something outside may pull on the hull: the tow point r_c of the paper, section 2.3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vehicle.parameters import Section, parameter


@dataclass(frozen=True, kw_only=True)
class TowPoint(Section):
    """The point of the hull that a cable is fastened to, from the hull centre in body axes."""

    x: float = parameter("forward", "m")
    y: float = parameter("to starboard", "m")
    z: float = parameter("down", "m")

    def position(self) -> np.ndarray:
        """Return r_c (3,). [m]"""
        return np.array([self.x, self.y, self.z])
