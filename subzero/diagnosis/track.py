"""The compiled loop behind every response: exchange after exchange, keeping only what sensors see.

As `subzero.loop`, without forces, energies and shapes, but with the hull's states on the way of an exchange: a rudder
moves faster than cable and hull exchange their forces.
"""

from __future__ import annotations

import numpy as np

import vehicle
from subzero.coupling import FINE, exchange, hull_steps
from subzero.jit import compiled, inner
from subzero.loop import NO_ROOM, SPARE
from subzero.run_state import Live, Setup
from subzero.vehicle_step import feel_current, row_at
from vehicle import STATE_SIZE

RUDDER, VOLTAGE, TENSION, LENGTH, WATER = (STATE_SIZE + i for i in range(5))
"""Columns of a track behind the state: rudder [rad], battery [V], tension at the tow point [N], wet length [m], and the
velocity of the water in earth axes (three). [m/s]"""
COLUMNS = STATE_SIZE + 7


@compiled
def follow(
    setup: Setup, live: Live, times: np.ndarray, first: int, last: int, track: np.ndarray
) -> tuple[int, int]:
    """Fill the rows of a track that belong to the exchanges first … last − 1.

    Args:
        setup: what stays.
        live: what changes; at times[first − 1] when called.
        times: of the exchanges, evenly spaced (n,). [s]
        first: exchange to begin with, from 1.
        last: exchange to end before.
        track: (1 + (n − 1) · hull steps, COLUMNS); row 0 is filled when first is 1.

    Returns:
        exchanges that are done, and how it ended (`coupling.FINE` …).
    """
    steps = hull_steps(setup, times[1] - times[0])
    if first == 1:
        _write(setup, live, 0.0, live.state, track[0])
    for row in range(first, last):
        if live.line.ends.count + 1 + SPARE > live.line.length.size:
            return row, NO_ROOM
        span = times[row] - times[row - 1]
        ending = exchange(setup, live, times[row - 1], span)
        if ending != FINE:
            return row, ending
        whole, pull, length = (
            live.now.last_step > 0.999 * span,
            track[(row - 1) * steps, TENSION],
            track[(row - 1) * steps, LENGTH],
        )
        for i in range(1, steps + 1):
            at, share = track[(row - 1) * steps + i], i / steps
            _write(setup, live, times[row - 1] + share * span, live.path[i] if whole else live.state, at)
            at[TENSION] = share * at[TENSION] + (1.0 - share) * pull
            at[LENGTH] = share * at[LENGTH] + (1.0 - share) * length
            if not whole:
                for j in range(STATE_SIZE):
                    at[j] = share * live.state[j] + (1.0 - share) * track[(row - 1) * steps, j]
    return last, FINE


@inner
def _write(setup: Setup, live: Live, time: float, state: np.ndarray, out: np.ndarray) -> None:
    """Write a state and what else sensors see; tension and length as they are at the end of the exchange."""
    command, force = setup.orders.values[row_at(setup.orders.time, time)], live.now.force
    feel_current(setup, state, time, live.now.hull)
    for j in range(STATE_SIZE):
        out[j] = state[j]
    for j in range(3):
        out[WATER + j] = live.now.hull.current[j]
    out[RUDDER] = vehicle.deflections(state, command, setup.fixed.vehicle)[0]
    out[VOLTAGE] = vehicle.battery_voltage(state, command, live.now.hull.current, setup.fixed.vehicle)
    out[TENSION] = np.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    out[LENGTH] = live.now.length
