"""The energy ledger of a run: where the propeller's work goes, in hull, cable and drum, joule by joule.

    W_propeller = L_hull + L_cable + ΔE + W_drum + W_added mass + residual

relative to the water. ΔE is the change of the kinetic energy (hull with its added mass, cable), of the potential energy
and of the elastic energy. What a missing force takes is booked with the loss of the hull. In a current that changes
along the way, the hull's balance closes only as far as it may be taken as steady (`vehicle_step.feel_current`), and
what the current does to the cable is booked with its added mass. The terms of the cable are those of
`cable.moving_end.energy`. Powers are summed up by the trapezoidal rule over hull steps (hull) and exchanges (cable),
so the residual is of second order in both. In a prescribed run the "propeller" is whatever moves the tow point.
"""

from __future__ import annotations

import numpy as np

import vehicle
from cable.moving_end import (
    ADDED_MASS,
    AT_DRUM,
    CARRIED,
    FLOWS,
    GRAVITY_WORK,
    LOSS,
    STORED,
    STRAINED,
    TOWED,
)
from subzero.external_force import add_missing
from subzero.jit import inlined
from subzero.run_state import Live, Setup
from subzero.vehicle_step import feel_current, row_at, tow_wrench

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
    total[CABLE_LOSS] += half * (old[LOSS] + new[LOSS])
    total[DRUM] += half * (old[AT_DRUM] + new[AT_DRUM])
    total[ADDED] += half * (old[ADDED_MASS] + new[ADDED_MASS] + old[STRAINED] + new[STRAINED])
    total[ADDED] += span * new[CARRIED]
    total[KINETIC] += new[STORED] - old[STORED] - half * (old[GRAVITY_WORK] + new[GRAVITY_WORK])
    for i in range(FLOWS):
        old[i] = new[i]
    total[RESIDUAL] = total[PROPELLER]
    for i in range(HULL_LOSS, RESIDUAL):
        total[RESIDUAL] -= total[i]


@inlined
def _book_hull(setup: Setup, live: Live, start: float, span: float, steps: int) -> None:
    """Add the hull's share of an exchange."""
    ledger = live.now.ledger
    h, old, new, total = span / steps, ledger.hull_old, ledger.hull_new, ledger.total
    for n in range(steps):
        command = setup.orders.values[row_at(setup.orders.time, start + n * h)]
        for end in range(2):
            row = n + end
            _hull_power(setup, live, row, start + row * h, row / steps, command, new if end else old)
        if setup.fixed.prescribed:
            total[PROPELLER] -= 0.5 * h * (old[P_EXTERNAL] + new[P_EXTERNAL])
            continue
        total[PROPELLER] += 0.5 * h * (old[P_PROPELLER] + new[P_PROPELLER])
        loss = old[P_LOSS] + old[P_EXTERNAL] + (new[P_LOSS] + new[P_EXTERNAL])
        total[HULL_LOSS] -= 0.5 * h * loss
        total[KINETIC] -= 0.5 * h * (old[P_RESTORING] + new[P_RESTORING])
    if setup.fixed.prescribed:
        return
    kinetic = vehicle.kinetic_energy(live.path[steps], live.now.hull.current, setup.fixed.vehicle)
    total[KINETIC] += kinetic - ledger.kinetic
    ledger.kinetic = kinetic


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
    feel_current(setup, live.path[row], time, hull)
    if not setup.fixed.prescribed:
        for i in range(6):
            hull.wrench[i] = 0.0
        if setup.fixed.lacking:
            add_missing(setup, live, live.path[row], command, time, hull)
    vehicle.power(live.path[row], command, hull.current, hull.wrench, setup.fixed.vehicle, out)
