"""The hull as an ordinary system x' = f(x, u): one table of its states and inputs, and f.

    x = (x, y, z, φ, θ, ψ, u, v, w, p, q, r, n, δ_r, δ_p, δ_s),   u = (n_c, δ_rc, δ_pc, δ_sc)

    φ' = p + tan θ (q sin φ + r cos φ),   θ' = q cos φ − r sin φ,   ψ' = (q sin φ + r cos φ)/cos θ

with the forces of `vehicle.derivative`. A control engineer's state: Euler angles for the quaternion (pitch stays
away from ±90°), a full battery, and no play in the linkages, which is an event and no differential equation.
"""

from __future__ import annotations

from math import cos, pi, sin, tan
from typing import NamedTuple

import numpy as np

import vehicle
from vehicle.state import LINKAGE, SERVO, SHAFT


class Signal(NamedTuple):
    """A state or an input: its name (a channel of `subzero.channels`), symbol and unit."""

    name: str
    symbol: str
    unit: str


STATES = (
    Signal("north", "x", "m"),
    Signal("east", "y", "m"),
    Signal("depth", "z", "m"),
    Signal("roll", "φ", "rad"),
    Signal("pitch", "θ", "rad"),
    Signal("heading", "ψ", "rad"),
    Signal("surge_speed", "u", "m/s"),
    Signal("sway_speed", "v", "m/s"),
    Signal("heave_speed", "w", "m/s"),
    Signal("roll_rate", "p", "rad/s"),
    Signal("pitch_rate", "q", "rad/s"),
    Signal("yaw_rate", "r", "rad/s"),
    Signal("propeller_speed", "n", "rev/s"),
    Signal("rudder_angle", "δ_r", "rad"),
    Signal("stern_plane_port_angle", "δ_p", "rad"),
    Signal("stern_plane_starboard_angle", "δ_s", "rad"),
)
INPUTS = (
    Signal("propeller_command", "n_c", "rev/s"),
    Signal("rudder_command", "δ_rc", "rad"),
    Signal("stern_plane_port_command", "δ_pc", "rad"),
    Signal("stern_plane_starboard_command", "δ_sc", "rad"),
)
STATE_NAMES = tuple(signal.name for signal in STATES)
INPUT_NAMES = tuple(signal.name for signal in INPUTS)

MIXED = (
    Signal("stern_planes_angle", "δ_e", "rad"),
    Signal("stern_planes_difference", "δ_d", "rad"),
    Signal("stern_planes_command", "δ_ec", "rad"),
    Signal("stern_planes_difference_command", "δ_dc", "rad"),
)
"""The planes together, (port + starboard)/2, and unlike, (starboard − port)/2: positive rolls to starboard."""

UNITS = {signal.name: signal.unit for signal in (*STATES, *INPUTS, *MIXED)}
"""Name of a state or input → its unit."""

PLACE = {name: i for i, name in enumerate(STATE_NAMES)}
DEPTH, ROLL, PITCH, HEADING, SURGE = 2, 3, 4, 5, 6
VELOCITY, ACTUATORS = slice(6, 12), slice(12, 16)

NO_CURRENT, NO_WRENCH = np.zeros(3), np.zeros(6)


def to_vehicle(x: np.ndarray) -> np.ndarray:
    """Return the state of `vehicle.STATE` for a state x (16,)."""
    state = np.zeros(vehicle.STATE_SIZE)
    state[:3] = x[:3]
    state[3:7] = vehicle.quaternion_from_euler(float(x[ROLL]), float(x[PITCH]), float(x[HEADING]))
    state[7:13] = x[VELOCITY]
    state[SHAFT : SHAFT + 4] = x[ACTUATORS]
    state[LINKAGE : LINKAGE + 3] = state[SERVO : SERVO + 3]
    return state


def from_vehicle(state: np.ndarray, heading_near: float = 0.0) -> np.ndarray:
    """Return x (16,) for a state of `vehicle.STATE`; the heading within half a turn of `heading_near` [rad]."""
    roll, pitch, heading = vehicle.euler_angles(state[3:7])
    turns = round((heading_near - heading) / (2.0 * pi))
    angles = (roll, pitch, heading + 2.0 * pi * turns)
    return np.concatenate([state[:3], angles, state[7:13], state[SHAFT : SHAFT + 4]])


def rate(
    x: np.ndarray,
    command: np.ndarray,
    numbers: vehicle.VehicleNumbers,
    wrench_b: np.ndarray = NO_WRENCH,
    current_n: np.ndarray = NO_CURRENT,
) -> np.ndarray:
    """Return x' (16,).

    Args:
        x: state, as in `STATES`.
        command: propeller [rev/s], rudder, port and starboard plane [rad].
        numbers: of the vehicle.
        wrench_b: external force and moment about the hull centre, body axes (6,). [N, N m]
        current_n: velocity of the water, earth axes (3,). [m/s]
    """
    out = np.empty(vehicle.STATE_SIZE)
    vehicle.derivative(to_vehicle(x), command, current_n, wrench_b, numbers, out)
    p, q, r = x[9:12]
    sr, cr = sin(x[ROLL]), cos(x[ROLL])
    turning = q * sr + r * cr
    angles = (p + tan(x[PITCH]) * turning, q * cr - r * sr, turning / cos(x[PITCH]))
    return np.concatenate([out[:3], angles, out[7:13], out[SHAFT : SHAFT + 4]])
