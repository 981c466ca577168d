"""The start of a run whose cable hangs at rest between the vehicle and a drum that is somewhere else."""

from __future__ import annotations

import numpy as np

import scenarios
from cable.drum import LENGTH
from cable.drum_motion import SETPOINT
from cable.hold import hold, lay_held
from cable.moving_end import FLOWS, energy_flow, start_in_water
from subzero.jit import compiled
from subzero.model import Model
from subzero.run_state import Live, Setup
from subzero.surroundings import water_of


def hang_between(setup: Setup, live: Live, trial: scenarios.Trial, model: Model) -> None:
    """Move the drum to where the trial has it, and let the cable in the water hang between it and the tow point.

    Raises:
        cable.HoldError: a cable that does not reach, or has no equilibrium.
    """
    fixed, now, wet = setup.fixed, live.now, trial.start.wet_length
    places = np.array([now.tow, now.tow + np.array(trial.start.drum)])
    held = hold(places, wet, water_of(model), cable=model.cable, segment_length=trial.segment_length)
    fixed.drum_place[:] = setup.water.points[:3] = places[1]
    led = setup.led
    rate = (
        (led[1, SETPOINT] - led[0, SETPOINT]) / (led[1, 0] - led[0, 0])
        if fixed.drum.control == LENGTH
        else 0.0
    )
    lay_held(live.line, held, now.change.copy(), fixed.drum.velocity, rate)
    live.line.ends.segment_length = trial.segment_length
    now.force[:] = held.tow_force
    begin_at_rest(setup, live)


@compiled
def begin_at_rest(setup: Setup, live: Live) -> None:
    """Fill what a cable that is laid out has at the start: the water around it, its momenta, its energy."""
    start_in_water(live.line, setup.water, setup.fixed.cable, live.load)
    energy_flow(live.line, setup.fixed.cable, live.load, live.now.ledger.cable_new)
    for i in range(FLOWS):
        live.now.ledger.cable_old[i] = live.now.ledger.cable_new[i]
