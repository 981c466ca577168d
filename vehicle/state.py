"""The state of the vehicle: one table of names, symbols, units and places in the array.

Position and attitude are of the hull centre in earth axes (north, east, down); the velocities are those of
the hull over ground in body axes (forward, starboard, down). The linkages hold the fins' positions inside
their backlash; without backlash they only repeat the servo angles.

If you add an entry, also look at `dynamics.derivative` and `kinematics.initial_state`.
"""

from __future__ import annotations

from typing import NamedTuple

STATE_SIZE = 21
POSITION, QUATERNION, VELOCITY = 0, 3, 7
SHAFT, SERVO, CHARGE, LINKAGE = 13, 14, 17, 18

QUICKEST = 0.01
"""Shortest lag of a state [s]: an explicit Runge-Kutta step of 0.02 s is stable down to a lag of 0.0072 s."""


class StateEntry(NamedTuple):
    """One entry of the state: its name and its place."""

    name: str
    symbol: str
    unit: str
    slice: slice


STATE = (
    StateEntry("position (north, east, down)", "x, y, z", "m", slice(0, 3)),
    StateEntry("attitude quaternion, body to earth", "q_w, q_x, q_y, q_z", "1", slice(3, 7)),
    StateEntry("velocity (surge, sway, heave)", "u, v, w", "m/s", slice(7, 10)),
    StateEntry("angular velocity (roll, pitch, yaw rate)", "p, q, r", "rad/s", slice(10, 13)),
    StateEntry("propeller speed", "n", "rev/s", slice(13, 14)),
    StateEntry("rudder servo angle", "δ_r", "rad", slice(14, 15)),
    StateEntry("port stern-plane servo angle", "δ_sp", "rad", slice(15, 16)),
    StateEntry("starboard stern-plane servo angle", "δ_ss", "rad", slice(16, 17)),
    StateEntry("charge drawn from the battery", "q_e", "C", slice(17, 18)),
    StateEntry("linkages (rudder, port, starboard)", "δ_l", "rad", slice(18, 21)),
)
