"""What stays in a run, from a trial and a model, and the straight cable that it begins with.

It knows nothing of how a steady start is found (`subzero.start`), so machine code does not hang on that.
"""

from __future__ import annotations

import numpy as np

import scenarios
import vehicle
from cable.drum_path import lead_drum
from cable.energy import FLOWS, energy_flow
from cable.laying import lay_straight, start_in_water
from cable.pull_out import START_LENGTH
from subzero.compiled import compiled
from subzero.hull import feel_current, pose, tow_point, way_of_tow_point
from subzero.knots import knots
from subzero.missing_force import MissingForce
from subzero.model import Model
from subzero.packed import packed
from subzero.run_state import LINEAR_ROWS, Fixed, Live, Orders, Setup
from subzero.surroundings import drum_of, water_of, way_of_drum

FORCE_TOLERANCE = 1e-9
"""Hull and cable agree when their forces differ by less than this fraction (and 1e-11 N)."""


def setup_of(trial: scenarios.Trial, model: Model, tethered: bool) -> Setup:
    """Return what stays in a run; where its drum is, is still to be filled in."""
    added, terms = (model.missing or MissingForce()).numbers()
    return Setup(
        fixed=_fixed(trial, model, tethered, bool(added.size or terms.size)),
        orders=_orders(trial),
        track=_track(trial),
        water=water_of(model).numbers(),
        led=way_of_drum(trial, model, wet_length(trial)),
        added=added,
        terms=terms,
    )


def wet_length(trial: scenarios.Trial) -> float:
    """Return the length of cable in the water at the start; there is always some, for its direction. [m]."""
    return max(trial.start.wet_length, START_LENGTH)


def _fixed(trial: scenarios.Trial, model: Model, tethered: bool, lacking: bool) -> Fixed:
    """Return the numbers of a run; the drum's place is still to be filled in."""
    fixed = Fixed(
        vehicle=model.vehicle.numbers(),
        cable=model.cable.numbers(),
        drum=drum_of(model).numbers(),
        r_c=model.vehicle.tow_point.position(),
        drum_place=np.zeros(3),
        hull_step=trial.hull_step,
        agreement=FORCE_TOLERANCE,
        tethered=tethered,
        prescribed=trial.motion is not None,
        booked=True,
        lacking=lacking,
    )
    return packed(fixed)


def _orders(trial: scenarios.Trial) -> Orders:
    """Return the commands, none for a prescribed motion."""
    if trial.commands is None:
        return Orders(np.zeros(1), np.zeros((1, 4)))
    return Orders(np.array(trial.commands.time, dtype=float), np.array(trial.commands.values, dtype=float))


def _track(trial: scenarios.Trial) -> np.ndarray:
    """Return the prescribed motion, of one resting sample for a run with commands."""
    motion = trial.motion
    if motion is None:
        return np.zeros((LINEAR_ROWS, 1))
    if motion.is_smooth:
        return knots(motion, trial.start.depth)
    columns = (motion.time, motion.surge_speed, motion.pitch, motion.heading)
    return np.array(columns, dtype=float)


@compiled
def lay_out(setup: Setup, live: Live, wet: float) -> None:
    """Lay `wet` metres of cable straight behind the tow point, on its way, and put the drum at their end."""
    fixed, now, state = setup.fixed, live.now, live.state
    if setup.fixed.prescribed:
        pose(setup.track, 0.0, state)
    tow_point(state, fixed.r_c, now.hull.rotation, now.tow)
    speed = way_of_tow_point(state, fixed.r_c, now.hull.rotation, now.guess)
    for i in range(3):
        fixed.drum_place[i] = now.tow[i] - wet * now.guess[i]
        setup.water.points[i] = fixed.drum_place[i]
        pull = fixed.cable.tangential_drag * speed * abs(speed) * wet if fixed.tethered else 0.0
        now.force[i], now.change[i] = -pull * now.guess[i], speed * now.guess[i]
    lead_drum(setup.led, 0.0, fixed.drum)
    lay_straight(live.line, wet, now.guess, now.change, fixed.drum, fixed.cable)
    start_in_water(live.line, setup.water, fixed.cable, live.load)
    energy_flow(live.line, fixed.cable, live.load, now.ledger.cable_new)
    for i in range(FLOWS):
        now.ledger.cable_old[i] = now.ledger.cable_new[i]
    feel_current(setup, state, 0.0, now.hull)
    now.ledger.kinetic = vehicle.kinetic_energy(state, now.hull.current, fixed.vehicle)
