"""A prescribed motion whose rates change at once jolts its tow point: the cable takes that as an impulse.

The motion is linear between its times, so speed and attitude have kinks there, and the rates of pitch and heading jump:
the tow point, r_c from the centre, changes its velocity by R (ΔΩ × r_c). See `cable.moving_end.jolt`. A smooth motion
has none.
"""

from __future__ import annotations

import numpy as np

import vehicle
from cable.moving_end import STORED, energy_flow, take_jolt
from subzero.energy import KINETIC, PROPELLER
from subzero.jit import allocating, inner
from subzero.run_state import HEADING, LINEAR_ROWS, PITCH, TIME, Live, Setup
from subzero.vehicle_step import row_at

AT_KNOT = 1e-9
"""A time this near to one of the motion's is that time. [s]"""


@allocating
def take_jolt_of_motion(setup: Setup, live: Live, start: float) -> None:
    """Give the cable the velocities just after `start`, if the motion jolts there; its work goes into the ledger."""
    row, track = row_at(setup.track[TIME], start), setup.track
    if track.shape[0] != LINEAR_ROWS:
        return
    if row == 0 or abs(track[TIME, row] - start) > AT_KNOT or live.now.last_step <= 0.0:
        return
    change, impulse, ledger = np.zeros(3), np.zeros(3), live.now.ledger
    _jump_of_tow_point(setup, live, row, change)
    if take_jolt(live.line, change, setup.fixed.cable, setup.fixed.drum, live.load, impulse):
        stored = ledger.cable_old[STORED]
        energy_flow(live.line, setup.fixed.cable, live.load, ledger.cable_old)
        ledger.total[PROPELLER] += ledger.cable_old[STORED] - stored
        ledger.total[KINETIC] += ledger.cable_old[STORED] - stored


@inner
def _rate(track: np.ndarray, angle: int, row: int) -> float:
    """Return the rate of pitch or heading from a row to the next, 0 behind the last. [rad/s]."""
    if row >= track.shape[1] - 1:
        return 0.0
    return (track[angle, row + 1] - track[angle, row]) / (track[TIME, row + 1] - track[TIME, row])


@inner
def _jump_of_tow_point(setup: Setup, live: Live, row: int, out: np.ndarray) -> None:
    """Fill out (3,) with R (ΔΩ × r_c) at a row of the motion, earth axes. [m/s]."""
    track, r, R = setup.track, setup.fixed.r_c, live.now.hull.rotation
    dive = _rate(track, PITCH, row) - _rate(track, PITCH, row - 1)
    turn = _rate(track, HEADING, row) - _rate(track, HEADING, row - 1)
    p, q, yaw = -turn * np.sin(track[PITCH, row]), dive, turn * np.cos(track[PITCH, row])
    x, y, z = q * r[2] - yaw * r[1], yaw * r[0] - p * r[2], p * r[1] - q * r[0]
    vehicle.rotation(live.state[3:7], R)
    for i in range(3):
        out[i] = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z
