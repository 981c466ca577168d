"""External forces on the hull: the pull of the cable, the water that it goes through, a force the model lacks.

    F_c = Rᵀ F,    M_c = r_c × F_c                                                                        (12)-(13)

The cable's pull F is in earth axes and acts at the tow point r_c, η + R r_c in earth axes (8). A missing force
(`subzero.external_force`) is a history, linear between its times, and a formula of the vehicle's state. All of them
fill or add to a wrench about the hull's centre, in body axes.
"""

from __future__ import annotations

import numpy as np

from cable.current import water_velocity
from subzero.engine.run_state import HullWork, Live, Setup
from subzero.external_force import FACTORS, fill_factors
from subzero.jit import allocating, compiled, inlined, inner
from vehicle import deflections, relative_velocity, rotation
from vehicle.motor import shaft_speed
from vehicle.state import CHARGE, SHAFT


@inner
def row_at(time: np.ndarray, t: float) -> int:
    """Return the last row whose time is not later than t (with a nanosecond of grace for rounding)."""
    low, high = 0, time.size - 1
    while low < high:
        middle = (low + high + 1) // 2
        if time[middle] <= t + 1e-9:
            low = middle
        else:
            high = middle - 1
    return low


@inner
def tow_wrench(state: np.ndarray, F: np.ndarray, r_c: np.ndarray, work: HullWork) -> None:
    """Fill work.wrench (6,) with the force (12) and the moment (13) of a pull F in earth axes (3,). [N, N m]."""
    R, w = work.rotation, work.wrench
    rotation(state[3:7], R)
    for i in range(3):
        w[i] = R[0, i] * F[0] + R[1, i] * F[1] + R[2, i] * F[2]
    w[3] = r_c[1] * w[2] - r_c[2] * w[1]
    w[4] = r_c[2] * w[0] - r_c[0] * w[2]
    w[5] = r_c[0] * w[1] - r_c[1] * w[0]


@inlined
def sample_current(setup: Setup, state: np.ndarray, time: float, work: HullWork) -> None:
    """Fill work.current (3,) with the water's velocity at the hull's centre. [m/s].

    Departs from source: where the water changes along the vehicle's way, the hull takes every instant as steady and
    uniform; the pressure of the accelerating water, (m + M_A) dJ/dt, is left out.
    """
    drum, J = setup.fixed.drum_place, work.current
    place = state[0] - drum[0], state[1] - drum[1], state[2] - drum[2]
    J[0], J[1], J[2] = water_velocity(setup.water, place[0], place[1], place[2], time)


@compiled
def tow_point(state: np.ndarray, r_c: np.ndarray, R: np.ndarray, out: np.ndarray) -> None:
    """Fill out (3,) with the place of the tow point in earth axes, η + R r_c. [m]."""
    rotation(state[3:7], R)
    for i in range(3):
        out[i] = state[i] + R[i, 0] * r_c[0] + R[i, 1] * r_c[1] + R[i, 2] * r_c[2]


@compiled
def tow_direction(state: np.ndarray, r_c: np.ndarray, R: np.ndarray, out: np.ndarray) -> float:
    """Fill out (3,) with the unit vector along which the tow point goes, forward where it goes straight or rests.

    R is R_nb of the state. Returns its speed along that vector, negative astern. [m/s]
    """
    x = state[7] + state[11] * r_c[2] - state[12] * r_c[1]
    y = state[8] + state[12] * r_c[0] - state[10] * r_c[2]
    z = state[9] + state[10] * r_c[1] - state[11] * r_c[0]
    if y == 0.0 and z == 0.0:
        for i in range(3):
            out[i] = R[i, 0]
        return x
    speed = np.sqrt(x * x + y * y + z * z)
    speed = -speed if x < 0.0 else speed
    for i in range(3):
        out[i] = (R[i, 0] * x + R[i, 1] * y + R[i, 2] * z) / speed
    return speed


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
    rudder, port, starboard = deflections(state, command, numbers)
    fill_factors(nu_r, n, rudder, 0.5 * (port + starboard), live.now.length, time, state[2], factors)
    for i in range(terms.shape[0]):
        a, b, c = int(terms[i, 1]), int(terms[i, 2]), int(terms[i, 3])
        work.wrench[int(terms[i, 0])] += terms[i, 4] * factors[a] * factors[b] * factors[c]
