"""What a missing force does at an instant: added to the wrench on the hull, in the loop."""

from __future__ import annotations

import numpy as np

import vehicle
from subzero.jit import allocating, compiled, inner
from subzero.missing_force import FACTORS, fill_factors
from subzero.run_state import HullWork, Live, Setup
from vehicle.dynamics import relative_velocity
from vehicle.motor import shaft_speed
from vehicle.state import CHARGE, SHAFT


@inner
def add_missing(
    setup: Setup, live: Live, state: np.ndarray, command: np.ndarray, time: float, work: HullWork
) -> None:
    """Add the missing force at a state to work.wrench (6,); rotation and current stand in `work`. [N, N m]."""
    if setup.added.shape[1] > 0:
        _add_history(setup.added, time, work.wrench)
    if setup.terms.shape[0] > 0:
        _add_terms(setup, live, state, command, time, work)


@compiled
def _add_history(added: np.ndarray, time: float, wrench: np.ndarray) -> None:
    """Add the history (7, n) at a time, linear between its times, 0 outside."""
    low, high = 0, added.shape[1] - 1
    if not added[0, low] <= time <= added[0, high]:
        return
    while high - low > 1:
        middle = (low + high) // 2
        if added[0, middle] <= time:
            low = middle
        else:
            high = middle
    span = added[0, high] - added[0, low]
    x = (time - added[0, low]) / span if span > 0.0 else 1.0
    for i in range(6):
        wrench[i] += added[1 + i, low] + x * (added[1 + i, high] - added[1 + i, low])


@allocating
def _add_terms(
    setup: Setup, live: Live, state: np.ndarray, command: np.ndarray, time: float, work: HullWork
) -> None:
    """Add the terms (m, 5) at a state."""
    numbers, terms = setup.fixed.vehicle, setup.terms
    nu_r, factors = np.empty(6), np.empty(len(FACTORS))
    relative_velocity(state, work.rotation, work.current, nu_r)
    n = shaft_speed(state[SHAFT], state[CHARGE], command[0], nu_r[0], numbers.motor, numbers.propeller)
    rudder, port, starboard = vehicle.deflections(state, command, numbers)
    fill_factors(nu_r, n, rudder, 0.5 * (port + starboard), live.now.length, time, state[2], factors)
    for i in range(terms.shape[0]):
        a, b, c = int(terms[i, 1]), int(terms[i, 2]), int(terms[i, 3])
        work.wrench[int(terms[i, 0])] += terms[i, 4] * factors[a] * factors[b] * factors[c]
