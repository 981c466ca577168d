"""Advance the hull over one exchange with the cable, pulled by a force that changes linearly in time.

Classic Runge-Kutta of fourth order in fixed steps. The cable's force is given in earth axes; at every stage it is
turned into the body's axes with the attitude of that stage (`subzero.engine.external_wrench`).

A prescribed run follows its motion instead: that of an "idealised vehicle" without dynamics (section 4.1 of the paper),
linear between its samples, or one that was measured (section 3, step 2), smooth between them
(`subzero.engine.prescribed_motion`).
"""

from __future__ import annotations

import numpy as np

from subzero.engine.external_wrench import add_missing, row_at, sample_current, tow_wrench
from subzero.engine.run_state import HEADING, LINEAR_ROWS, PITCH, PLACE, SLOPE, SPEED, TIME, Live, Setup
from subzero.engine.station_keeping import INTEGRALS, steer
from subzero.jit import allocating, compiled, expanded, inner, scratch
from vehicle import derivative, derivative_and_power, finish_step, quaternion_from_euler, rotation

GAUSS_OFFSET = 0.5 * np.sqrt(0.6)
"""Three-point Gauss quadrature: nodes at the middle and this fraction of a step before and behind it."""


@expanded
def advance_hull(setup: Setup, live: Live, start: float, span: float, steps: int) -> None:
    """Fill live.path[1 … steps] from path[0], pulled by F(t) = F_{n+1} + (t − t_{n+1}) (F_n − F_{n−1})/h_n.

    Args:
        setup: vehicle, water, commands (held during a step).
        live: forces and work space.
        start: time of the first state. [s]
        span: length of the exchange. [s]
        steps: Runge-Kutta steps in it.
    """
    work, orders, now = live.now.hull, setup.orders, live.now
    h = span / steps
    ratio = span / now.last_step if now.last_step > 0.0 else 0.0
    k, stage = live.stages, live.stages[4]
    for n in range(steps):
        state, new = live.path[n], live.path[n + 1]
        command = orders.values[row_at(orders.time, start + n * h)]
        if setup.station.track.shape[0] > 0:
            steer(setup.station, setup.fixed.vehicle, state, start + n * h, command)
        for s in range(4):
            part = 0.0 if s == 0 else (h if s == 3 else 0.5 * h)  # stages at t, t + h/2, t + h/2, t + h
            for i in range(new.size):
                stage[i] = state[i] + (part * k[s - 1, i] if s > 0 else 0.0)
            along = (n * h + part) / span
            # The pull ends at the unknown force, with a slope that is known: only so is the hull's response to
            # the guess linear, ∂x/∂F = (h²/2) A, and the exchange stable on a heavy cable (see `coupling`).
            for i in range(3):
                work.pull[i] = now.guess[i] + (along - 1.0) * ratio * (now.force[i] - now.force_before[i])
            tow_wrench(stage, work.pull, setup.fixed.r_c, work)
            sample_current(setup, stage, start + n * h + part, work)
            if setup.fixed.lacking:
                add_missing(setup, live, stage, command, start + n * h + part, work)
            if s == 0 and setup.fixed.booked:
                derivative_and_power(
                    stage, command, work.current, work.wrench, setup.fixed.vehicle, k[0], live.powers[n]
                )
            else:
                derivative(stage, command, work.current, work.wrench, setup.fixed.vehicle, k[s])
        for i in range(new.size):
            new[i] = state[i] + h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
        finish_step(
            new, command, setup.fixed.vehicle
        )  # quaternion to length one, linkages behind their servos
        if setup.station.track.shape[0] > 0:
            for i in range(INTEGRALS):
                new[new.size - INTEGRALS + i] += h * setup.station.error[i]


@compiled
def _attitude(track: np.ndarray, t: float) -> tuple[float, float, float, float, float]:
    """Return surge speed [m/s], pitch, heading [rad] and the rates of both [rad/s] at t."""
    row = row_at(track[TIME], t)
    if row == track.shape[1] - 1:
        return track[SPEED, row], track[PITCH, row], track[HEADING, row], 0.0, 0.0
    span = track[TIME, row + 1] - track[TIME, row]
    x = (t - track[TIME, row]) / span
    turn, dive = track[HEADING, row + 1] - track[HEADING, row], track[PITCH, row + 1] - track[PITCH, row]
    speed = track[SPEED, row] + x * (track[SPEED, row + 1] - track[SPEED, row])
    return speed, track[PITCH, row] + x * dive, track[HEADING, row] + x * turn, dive / span, turn / span


@compiled
def _move(track: np.ndarray, t: float, weight: float, state: np.ndarray) -> None:
    """Add the displacement of `weight` seconds at the velocity of time t."""
    u, pitch, heading, _, _ = _attitude(track, t)
    state[0] += weight * u * np.cos(pitch) * np.cos(heading)
    state[1] += weight * u * np.cos(pitch) * np.sin(heading)
    state[2] -= weight * u * np.sin(pitch)


@allocating
def pose(track: np.ndarray, t: float, state: np.ndarray) -> None:
    """Write attitude and velocities of a prescribed motion at t into a state; of a smooth one its place too."""
    if track.shape[0] != LINEAR_ROWS:
        _pose_between_knots(track, t, state)
        return
    u, pitch, heading, dive, turn = _attitude(track, t)
    q = quaternion_from_euler(0.0, pitch, heading)
    for i in range(4):
        state[3 + i] = q[i]
    for i in range(6):
        state[7 + i] = 0.0
    state[7] = u
    state[10] = -turn * np.sin(pitch)
    state[11] = dive
    state[12] = turn * np.cos(pitch)


@allocating
def _pose_between_knots(track: np.ndarray, t: float, state: np.ndarray) -> None:
    """Write place, attitude and velocities of a smooth motion at t into a state: cubics and their derivatives."""
    row = min(row_at(track[TIME], t), track.shape[1] - 2)
    h = track[TIME, row + 1] - track[TIME, row]
    x = (t - track[TIME, row]) / h
    place, rate, R = scratch(1, 6)[0], scratch(1, 6)[0], scratch(3, 3)
    for i in range(6):
        first, rise = track[PLACE + i, row], track[PLACE + i, row + 1] - track[PLACE + i, row]
        a, end = h * track[SLOPE + i, row], h * track[SLOPE + i, row + 1]
        b, c = 3.0 * rise - 2.0 * a - end, a + end - 2.0 * rise
        place[i] = first + x * (a + x * (b + x * c))
        rate[i] = (a + x * (2.0 * b + x * 3.0 * c)) / h
    q = quaternion_from_euler(place[3], place[4], place[5])
    rotation(q, R)
    for i in range(4):
        state[3 + i] = q[i]
    for i in range(3):
        state[i] = place[i]
        state[7 + i] = R[0, i] * rate[0] + R[1, i] * rate[1] + R[2, i] * rate[2]
    sr, cr, sp, cp = np.sin(place[3]), np.cos(place[3]), np.sin(place[4]), np.cos(place[4])
    state[10] = rate[3] - rate[5] * sp
    state[11] = rate[4] * cr + rate[5] * cp * sr
    state[12] = rate[5] * cp * cr - rate[4] * sr


@inner
def follow_track(start: float, span: float, steps: int, track: np.ndarray, path: np.ndarray) -> None:
    """Fill path[1 … steps] with a prescribed motion; positions of a linear one by three-point Gauss quadrature."""
    h = span / steps
    for n in range(steps):
        new, t = path[n + 1], start + n * h
        for i in range(new.size):
            new[i] = path[n, i]
        if track.shape[0] == LINEAR_ROWS:
            _move(track, t + h * (0.5 - GAUSS_OFFSET), h * 5.0 / 18.0, new)
            _move(track, t + h * 0.5, h * 8.0 / 18.0, new)
            _move(track, t + h * (0.5 + GAUSS_OFFSET), h * 5.0 / 18.0, new)
        pose(track, t + h, new)
