"""A model that changes in the middle of a run: a fin that is struck, a cable that is caught, a current that sets in.

Only numbers change: vehicle, cable, drum and water stand where they are and go on as they were. The energy that a
sudden change of a mass would take is not booked.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import scenarios
import vehicle
from cable.energy import FLOWS, STORED, energy_flow
from subzero.compiled import allocating
from subzero.errors import BadValueError, UserError, real, short
from subzero.hull import feel_current
from subzero.model import Model
from subzero.run_state import Live, Setup
from subzero.setup import setup_of

Later = Sequence[tuple[float, Model]]
"""(time [s], model) from which on another model holds."""

CLOSE = 1e-6
"""A time of a change is that of a row if it is as near as this. [s]"""


def checked_later(later: object) -> Later:
    """Return times and models; refuse what are none."""
    pairs: list[Any] = list(later) if isinstance(later, Sequence) else [later]
    for pair in pairs:
        good = isinstance(pair, Sequence) and len(pair) == 2
        if not (good and real(pair[0]) is not None and isinstance(pair[1], Model)):
            raise BadValueError(f"later holds {short(pair)}; it must hold pairs of a time [s] and a Model.")
    return pairs


def rows_of_changes(
    trial: scenarios.Trial, tethered: bool, times: np.ndarray, later: Later
) -> dict[int, Model]:
    """Return the rows from which on other models hold; refuse what cannot be done.

    Raises:
        UserError: a scheme that cannot change, or a time that is none of the run's.
    """
    if later and tethered and trial.scheme != "moving_end":
        raise UserError(
            f"'{trial.name}' has the scheme '{trial.scheme}'; only 'moving_end' can go on with another model."
        )
    changes = {}
    for time, model in checked_later(later):
        row = int(np.argmin(np.abs(times - time)))
        if not abs(times[row] - time) < CLOSE:
            raise UserError(
                f"Another model holds from t = {time!r} s on, which is no time of a result of '{trial.name}'. "
                f"Allowed: whole multiples of {times[1]:g} s, from 0 to {times[-1]:g} s."
            )
        changes[row] = model
    return changes


def go_on_with(
    model: Model, setup: Setup, live: Live, trial: scenarios.Trial, tethered: bool, time: float
) -> Setup:
    """Return what stays in a run that goes on with another model from `time` [s] on; `live` is made ready for it."""
    other = setup_of(trial, model, tethered)
    other.fixed.drum_place[:] = setup.fixed.drum_place
    other.water.points[:3] = setup.water.points[:3]
    begin_again(other, live, time)
    return other


@allocating
def begin_again(setup: Setup, live: Live, time: float) -> None:
    """Take the energies that are stored now, with the numbers that hold from now on, as those of the start."""
    ledger, flows = live.now.ledger, np.zeros(FLOWS)
    feel_current(setup, live.state, time, live.now.hull)
    ledger.kinetic = vehicle.kinetic_energy(live.state, live.now.hull.current, setup.fixed.vehicle)
    if setup.fixed.tethered:
        energy_flow(live.line, setup.fixed.cable, live.load, flows)
        ledger.cable_old[STORED] = flows[STORED]
