"""The energy ledger of a run: where the propeller's work goes, in hull, cable and drum, joule by joule.

    W_propeller = L_hull + L_cable + ΔE + W_drum + W_added mass + residual

in axes that move with the uniform current. ΔE is the change of the kinetic energy (hull with its added mass, cable),
of the potential energy and of the elastic energy. The terms of the cable are those of `cable.energy`. Powers are summed
up by the trapezoidal rule over hull steps (hull) and exchanges (cable), so the residual is of second order in both.
In a prescribed run the "propeller" is whatever moves the tow point.
"""

from __future__ import annotations

import numpy as np

import vehicle
from cable.energy import ADDED_MASS, AT_DRUM, GRAVITY_WORK, LOSS, STORED
from subzero.compiled import compiled, inner
from subzero.hull import row_at, tow_wrench
from subzero.run_state import Live, Setup

PROPELLER, HULL_LOSS, CABLE_LOSS, KINETIC, DRUM, ADDED, RESIDUAL = range(7)
"""Rows of `Ledger.total`, in the order of the energy channels. [J]"""

P_PROPELLER, P_LOSS, P_RESTORING, P_EXTERNAL = range(4)
"""Places in `vehicle.POWERS`."""


@inner
def book(setup: Setup, live: Live, start: float, span: float, steps: int) -> None:
    """Add an accepted exchange, whose hull states stand in live.path, to the ledger."""
    ledger = live.now.ledger
    total, old, new = ledger.total, ledger.cable_old, ledger.cable_new
    _book_hull(setup, live, start, span, steps)
    half = 0.5 * span
    total[CABLE_LOSS] += half * (old[LOSS] + new[LOSS])
    total[DRUM] += half * (old[AT_DRUM] + new[AT_DRUM])
    total[ADDED] += half * (old[ADDED_MASS] + new[ADDED_MASS])
    total[KINETIC] += new[STORED] - old[STORED] - half * (old[GRAVITY_WORK] + new[GRAVITY_WORK])
    for i in range(5):
        old[i] = new[i]
    total[RESIDUAL] = total[PROPELLER]
    for i in range(HULL_LOSS, RESIDUAL):
        total[RESIDUAL] -= total[i]


@compiled
def _book_hull(setup: Setup, live: Live, start: float, span: float, steps: int) -> None:
    """Add the hull's share; of a prescribed motion, the work that the tow point does on the cable."""
    ledger = live.now.ledger
    h, old, new, total = span / steps, ledger.hull_old, ledger.hull_new, ledger.total
    for n in range(steps):
        command = setup.orders.values[row_at(setup.orders.time, start + n * h)]
        _hull_power(setup, live, n, n / steps, command, old)
        _hull_power(setup, live, n + 1, (n + 1) / steps, command, new)
        if setup.fixed.prescribed:
            total[PROPELLER] -= 0.5 * h * (old[P_EXTERNAL] + new[P_EXTERNAL])
        else:
            total[PROPELLER] += 0.5 * h * (old[P_PROPELLER] + new[P_PROPELLER])
            total[HULL_LOSS] -= 0.5 * h * (old[P_LOSS] + new[P_LOSS])
            total[KINETIC] -= 0.5 * h * (old[P_RESTORING] + new[P_RESTORING])
    if not setup.fixed.prescribed:
        kinetic = vehicle.kinetic_energy(live.path[steps], setup.fixed.current, setup.fixed.vehicle)
        total[KINETIC] += kinetic - ledger.kinetic
        ledger.kinetic = kinetic


@compiled
def _hull_power(setup: Setup, live: Live, row: int, x: float, command: np.ndarray, out: np.ndarray) -> None:
    """Fill out (4,) with the powers on the hull in state `row` of the path, a fraction x into the exchange. [W]."""
    hull = live.now.hull
    for i in range(3):
        hull.pull[i] = live.now.force_before[i] + x * (live.now.force[i] - live.now.force_before[i])
    tow_wrench(live.path[row], hull.pull, setup.fixed.r_c, hull)
    vehicle.power(live.path[row], command, setup.fixed.current, hull.wrench, setup.fixed.vehicle, out)
