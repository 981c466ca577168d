"""The energy ledger of a run: where the propeller's work goes, in hull, cable and drum, joule by joule.

    W_propeller = L_hull + L_cable + ΔE + W_drum + W_added mass + residual

relative to the water. ΔE is the change of the kinetic energy (hull with its added mass, cable), of the potential energy
and of the elastic energy. What a missing force takes is booked with the loss of the hull. In a current that changes
along the way, the hull's balance closes only as far as it may be taken as steady (`vehicle_step.sample_current`), and
what the current does to the cable is booked with its added mass. The terms of the cable are those of
`cable.moving_end.energy`. Powers are summed up by the trapezoidal rule over hull steps (hull) and exchanges (cable),
so the residual is of second order in both. In a prescribed run the "propeller" is whatever moves the tow point.

A prescribed motion that is linear between its times has jumps in the rates of pitch and heading there. The tow point,
r_c from the centre, then changes its velocity at once, by R (ΔΩ × r_c), and the cable takes that as an impulse
(`cable.moving_end.jolt`). Its work is booked here, too. A smooth motion has no such jumps.
"""

from __future__ import annotations

import numpy as np

from cable.moving_end import (
    ADDED_MASS,
    AT_DRUM,
    CARRIED,
    FLOWS,
    GRAVITY_WORK,
    LOSS,
    STORED,
    STRAINED,
    TO_BED,
    TOWED,
    damping_loss,
    energy_flow,
    take_jolt,
)
from subzero.engine.external_wrench import add_missing, row_at, sample_current, tow_wrench
from subzero.engine.run_state import HEADING, LINEAR_ROWS, PITCH, TIME, Live, Setup
from subzero.jit import allocating, expanded, inlined, inner
from vehicle import kinetic_energy, power, rotation

PROPELLER, HULL_LOSS, CABLE_LOSS, KINETIC, DRUM, ADDED, RESIDUAL = range(7)
"""Rows of `Ledger.total`, in the order of the energy channels. [J]"""

P_PROPELLER, P_LOSS, P_RESTORING, P_EXTERNAL = range(4)
"""Places in `vehicle.POWERS`."""


@inlined
def book(setup: Setup, live: Live, start: float, span: float, steps: int) -> None:
    """Add an accepted exchange, whose hull states stand in live.path, to the ledger."""
    ledger = live.now.ledger
    total, old, new = ledger.total, ledger.cable_old, ledger.cable_new
    half = 0.5 * span
    if setup.fixed.prescribed and setup.fixed.tethered:
        total[PROPELLER] += half * (old[TOWED] + new[TOWED])
    else:
        _book_hull(setup, live, start, span, steps)
    total[CABLE_LOSS] += half * (old[LOSS] + new[LOSS]) + half * (old[TO_BED] + new[TO_BED])
    if setup.fixed.snaps:
        total[CABLE_LOSS] += damping_loss(old, new, span)
    total[DRUM] += half * (old[AT_DRUM] + new[AT_DRUM])
    total[ADDED] += half * (old[ADDED_MASS] + new[ADDED_MASS] + old[STRAINED] + new[STRAINED])
    total[ADDED] += span * new[CARRIED]
    total[KINETIC] += new[STORED] - old[STORED] - half * (old[GRAVITY_WORK] + new[GRAVITY_WORK])
    for i in range(FLOWS):
        old[i] = new[i]  # the trapezium of the next exchange begins where this one ends
    total[RESIDUAL] = total[PROPELLER]
    for i in range(HULL_LOSS, RESIDUAL):
        total[RESIDUAL] -= total[i]


@expanded
def _book_hull(setup: Setup, live: Live, start: float, span: float, steps: int) -> None:
    """Add the hull's share of an exchange."""
    ledger = live.now.ledger
    h, old, new, total, before = span / steps, ledger.hull_old, ledger.hull_new, ledger.total, -1
    # Without a missing force, the first stages of the steps have left the powers: the cable's is not asked for.
    left = not (setup.fixed.prescribed or setup.fixed.lacking)
    for n in range(steps):
        held = row_at(setup.orders.time, start + n * h)
        command = setup.orders.values[held]
        if held == before:  # a step begins as the one before ended, unless another command holds
            _copy_power(new, new[P_EXTERNAL], old)
        elif left:
            _copy_power(live.powers[n], 0.0, old)
        else:
            _hull_power(setup, live, n, start + n * h, n / steps, command, old)
        row, before = n + 1, held
        if left and row < steps and row_at(setup.orders.time, start + row * h) == held:
            _copy_power(live.powers[row], 0.0, new)
        else:
            _hull_power(setup, live, row, start + row * h, row / steps, command, new)
        if setup.fixed.prescribed:
            total[PROPELLER] -= 0.5 * h * (old[P_EXTERNAL] + new[P_EXTERNAL])
            continue
        total[PROPELLER] += 0.5 * h * (old[P_PROPELLER] + new[P_PROPELLER])
        loss = old[P_LOSS] + old[P_EXTERNAL] + (new[P_LOSS] + new[P_EXTERNAL])
        total[HULL_LOSS] -= 0.5 * h * loss
        total[KINETIC] -= 0.5 * h * (old[P_RESTORING] + new[P_RESTORING])
    if setup.fixed.prescribed:
        return
    # A difference of states, not a sum of powers: exact, so that the residual shows the errors of the other terms.
    kinetic = kinetic_energy(live.path[steps], live.now.hull.current, setup.fixed.vehicle)
    total[KINETIC] += kinetic - ledger.kinetic
    ledger.kinetic = kinetic


@inlined
def _copy_power(powers: np.ndarray, external: float, out: np.ndarray) -> None:
    """Fill out (4,) with powers, but for "external" with another one. [W]."""
    for i in range(P_EXTERNAL):
        out[i] = powers[i]
    out[P_EXTERNAL] = external


@inlined
def _hull_power(
    setup: Setup, live: Live, row: int, time: float, x: float, command: np.ndarray, out: np.ndarray
) -> None:
    """Fill out (4,) with the powers on the hull in state `row` of the path, a fraction x into the exchange. [W].

    "External" is the pull of the cable in a prescribed run, and the missing force in any other.
    """
    hull = live.now.hull
    for i in range(3):
        hull.pull[i] = live.now.force_before[i] + x * (live.now.force[i] - live.now.force_before[i])
    tow_wrench(live.path[row], hull.pull, setup.fixed.r_c, hull)
    sample_current(setup, live.path[row], time, hull)
    if not setup.fixed.prescribed:
        for i in range(6):
            hull.wrench[i] = 0.0
        if setup.fixed.lacking:
            add_missing(setup, live, live.path[row], command, time, hull)
    power(live.path[row], command, hull.current, hull.wrench, setup.fixed.vehicle, out)


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
    """Return the rate of pitch or heading from a row to the next, 0 after the last. [rad/s]."""
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
    rotation(live.state[3:7], R)
    for i in range(3):
        out[i] = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z
