"""Trim: the steady motion that holds the requested speeds and turn, with the cable as a formula or as the cable
itself.

The formula is that of `subzero.steady_motion.trim_point`. Where the cable is heavy, or cuts the corner of a turn, the
cable itself is pulled along the way that the tow point came, and hull and cable are solved in turn.
"""

from __future__ import annotations

from functools import partial
from math import cos, sin

import numpy as np

from cable import MovingEnd, pull_out
from subzero.errors import UserError, short
from subzero.model import Model
from subzero.steady_motion.asked import Asked
from subzero.steady_motion.hull_state_space import VELOCITY, to_vehicle
from subzero.steady_motion.trim_point import Trim, steady_motion
from vehicle import rotation

CABLES = ("formula", "model")


def trim(
    model: Model,
    *,
    speed: float,
    depth_rate: float = 0.0,
    turn_rate: float = 0.0,
    wet_length: float = 0.0,
    roll: float = 0.0,
    sway_speed: float = 0.0,
    cable: str = "formula",
) -> Trim:
    """Return the steady motion of a model at a speed.

    Args:
        model: vehicle and cable.
        speed: u, forward speed through the water. [m/s]
        depth_rate: z', positive down. [m/s]
        turn_rate: ψ', positive to starboard. [rad/s]
        wet_length: cable in the water; its pull is taken as steady although it grows. [m]
        roll: φ, held by unlike stern-planes, or by thrusters. [rad]
        sway_speed: v, to starboard through the water, held by thrusters. [m/s]
        cable: "formula", ½ρπdC_t U² S and friction along the way of the tow point; or "model", the cable itself,
            pulled along a way of that length. (In a turn less of it remains in the water: it cuts the corner.)

    Raises:
        NoTrimError: there is none: which limit is hit, and how far one can go.
        UserError: a number that means nothing here; the cable could not be solved along this way.
    """
    motion = {"speed": speed, "depth_rate": depth_rate, "turn_rate": turn_rate, "sway_speed": sway_speed}
    asked = Asked(**motion, wet_length=wet_length, roll=roll)
    if not isinstance(cable, str) or cable not in CABLES:
        raise UserError(f"trim: cable is {short(cable)}; it must be one of {', '.join(CABLES)}.")
    return steady_motion(model, asked, partial(cable_pull, model) if cable == "model" else None)


def cable_pull(model: Model, x: np.ndarray, asked: Asked) -> np.ndarray:
    """Return the pull of the cable itself at the end of a steady way of the tow point, as long as the cable is.

    Args:
        model: whose cable, drum and tow point.
        x: state (16,) of the steady motion.
        asked: which motion it is.

    Returns:
        wrench on the hull (6,), body axes. [N, N m]

    Raises:
        UserError: the cable could not be solved along this way.
    """
    nu, r_c = x[VELOCITY], model.vehicle.tow_point.position()
    V, R = nu[:3] + np.cross(nu[3:], r_c), np.empty((3, 3))
    duration = asked.wet_length / float(np.linalg.norm(V))
    rotation(to_vehicle(x)[3:7], R)

    def attitude(time: float) -> np.ndarray:
        c, s = cos(asked.turn_rate * time), sin(asked.turn_rate * time)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ R

    scheme = MovingEnd(time_step=min(0.1, duration / 20.0))
    way = pull_out(lambda t: attitude(t) @ V, duration, cable=model.cable, drum=model.drum, scheme=scheme)
    if not way.outcome.completed:
        raise UserError(f"The cable has no steady pull along this way. {way.outcome.message}")
    F = attitude(duration).T @ way.tow_force[-1]
    return np.concatenate([F, np.cross(r_c, F)])
