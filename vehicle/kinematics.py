"""Attitude and motion: unit quaternion inside, Euler angles outside.

    p_n' = R_nb v_b,    q' = ½ q ⊗ (0, ω_b)                            (Fossen 2021, section 2.2)

The quaternion (w, x, y, z) takes body components to earth components and has no singular attitude. `rotation`
divides by |q|², so the small drift of the norm inside a Runge-Kutta step never stretches a vector;
`normalise` removes the drift after a step. Heading is counted from north, clockwise seen from above; pitch is
positive nose up; roll is positive starboard side down.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from subzero.jit import allocating, compiled, gated_inlined, inlined
from vehicle.state import SHAFT, STATE_SIZE


@gated_inlined
def rotation(quaternion: np.ndarray, R: np.ndarray) -> None:
    """Fill R_nb (3, 3), which takes body components to earth components."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    R[0, 0] = 1.0 - s * (y * y + z * z)
    R[0, 1] = s * (x * y - w * z)
    R[0, 2] = s * (x * z + w * y)
    R[1, 0] = s * (x * y + w * z)
    R[1, 1] = 1.0 - s * (x * x + z * z)
    R[1, 2] = s * (y * z - w * x)
    R[2, 0] = s * (x * z - w * y)
    R[2, 1] = s * (y * z + w * x)
    R[2, 2] = 1.0 - s * (x * x + y * y)


@compiled
def euler_angles(quaternion: np.ndarray) -> tuple[float, float, float]:
    """Return roll, pitch and heading [rad]; heading in (-π, π]. At pitch ±90 degrees roll and heading mix."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    norm2 = w * w + x * x + y * y + z * z
    roll = math.atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z)
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - x * z) / norm2)))
    heading = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return roll, pitch, heading


@allocating
def quaternion_from_euler(roll: float, pitch: float, heading: float) -> np.ndarray:
    """Return the unit quaternion (w, x, y, z) of heading, then pitch, then roll [rad]."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    ch, sh = math.cos(0.5 * heading), math.sin(0.5 * heading)
    quaternion = np.empty(4)
    quaternion[0] = cr * cp * ch + sr * sp * sh
    quaternion[1] = sr * cp * ch - cr * sp * sh
    quaternion[2] = cr * sp * ch + sr * cp * sh
    quaternion[3] = cr * cp * sh - sr * sp * ch
    return quaternion


@inlined
def motion(state: np.ndarray, R: np.ndarray, out: np.ndarray) -> None:
    """Fill out[0:7] with the rates of position [m/s] and quaternion [1/s]; R is R_nb of the state."""
    u, v, w = state[7], state[8], state[9]
    for i in range(3):
        out[i] = R[i, 0] * u + R[i, 1] * v + R[i, 2] * w
    a, b, c, d = state[3], state[4], state[5], state[6]
    p, q, r = state[10], state[11], state[12]
    out[3] = -0.5 * (b * p + c * q + d * r)
    out[4] = 0.5 * (a * p + c * r - d * q)
    out[5] = 0.5 * (a * q + d * p - b * r)
    out[6] = 0.5 * (a * r + b * q - c * p)


@compiled
def normalise(state: np.ndarray) -> None:
    """Scale the quaternion of a state back to length one, in place."""
    norm2 = state[3] * state[3] + state[4] * state[4] + state[5] * state[5] + state[6] * state[6]
    scale = 1.0 / math.sqrt(norm2)
    for i in range(3, 7):
        state[i] *= scale


def initial_state(
    *,
    position: Sequence[float] = (0.0, 0.0, 0.0),
    roll: float = 0.0,
    pitch: float = 0.0,
    heading: float = 0.0,
    velocity: Sequence[float] = (0.0,) * 6,
    propeller_speed: float = 0.0,
) -> np.ndarray:
    """Return a state with central fins and a full battery.

    Args:
        position: of the hull centre, north, east, depth (positive down). [m]
        roll: starboard side down is positive. [rad]
        pitch: nose up is positive. [rad]
        heading: from north, clockwise seen from above. [rad]
        velocity: u, v, w, p, q, r over ground in body axes. [m/s, rad/s]
        propeller_speed: n. [rev/s]
    """
    state = np.zeros(STATE_SIZE)
    state[0:3] = position
    state[3:7] = quaternion_from_euler(float(roll), float(pitch), float(heading))
    state[7:13] = velocity
    state[SHAFT] = propeller_speed
    return state
