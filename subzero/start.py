"""The start of a run: from a trial and a model to what stays and what changes, the cable laid straight behind."""

from __future__ import annotations

import numpy as np

import scenarios
import vehicle
from cable.element import new_load
from cable.line import lay_straight, new_line, set_momenta
from cable.pull_out import START_LENGTH
from subzero.compiled import packed
from subzero.hull import pose, tow_point
from subzero.model import Model
from subzero.run_state import Fixed, Live, Orders, Setup, Track, new_now

FIRST_ROOM = 16
"""Segments that a new cable has room for, beyond those that are in the water."""


def prepare(trial: scenarios.Trial, model: Model, tethered: bool) -> tuple[Setup, Live]:
    """Return what stays and what changes in a run, at its start: the cable laid straight behind the vehicle."""
    state, R, tow = _first_state(trial), np.zeros((3, 3)), np.zeros(3)
    fixed, wet = _fixed(trial, model, tethered), max(trial.start.wet_length, START_LENGTH)
    tow_point(state, fixed.r_c, R, tow)
    ahead, speed = R[:, 0].copy(), float(state[7])
    fixed.drum_place[:] = tow - wet * ahead
    line, load = new_line(int(wet / trial.segment_length) + FIRST_ROOM), new_load()
    lay_straight(line, wet, ahead, speed, trial.segment_length, fixed.cable)
    set_momenta(line, fixed.current, fixed.cable, load)
    pull = -fixed.cable.tangential_drag * speed * abs(speed) * wet * tethered
    now = new_now(state, pull * ahead)
    now.ledger.kinetic = vehicle.kinetic_energy(state, fixed.current, fixed.vehicle)
    steps = int(np.ceil(trial.cable_step / trial.hull_step - 1e-6))
    live = Live(now=now, path=np.zeros((steps + 1, vehicle.STATE_SIZE)), line=line, load=load)
    return Setup(fixed=fixed, orders=_orders(trial), track=_track(trial)), live


def _fixed(trial: scenarios.Trial, model: Model, tethered: bool) -> Fixed:
    """Return the numbers of a run; the drum's place is still to be filled in."""
    fixed = Fixed(
        vehicle=model.vehicle.numbers(),
        cable=model.cable.numbers(),
        drum=model.drum.numbers(),
        current=np.array(model.current, dtype=float),
        r_c=model.vehicle.tow_point.position(),
        drum_place=np.zeros(3),
        hull_step=trial.hull_step,
        segment_length=trial.segment_length,
        tethered=tethered,
        prescribed=trial.motion is not None,
    )
    return packed(fixed)


def _first_state(trial: scenarios.Trial) -> np.ndarray:
    """Return the vehicle's state at t = 0."""
    start = trial.start
    state = vehicle.initial_state(
        depth=start.depth,
        roll=start.roll,
        pitch=start.pitch,
        heading=start.heading,
        velocity=(start.surge_speed, 0.0, 0.0, 0.0, 0.0, 0.0),
    )
    if trial.motion is not None:
        pose(_track(trial), 0.0, state)
    return state


def _orders(trial: scenarios.Trial) -> Orders:
    """Return the commands, none for a prescribed motion."""
    if trial.commands is None:
        return Orders(np.zeros(1), np.zeros((1, 4)))
    return Orders(np.array(trial.commands.time, dtype=float), np.array(trial.commands.values, dtype=float))


def _track(trial: scenarios.Trial) -> Track:
    """Return the prescribed motion, of one resting sample for a run with commands."""
    motion = trial.motion
    if motion is None:
        return Track(np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1))
    columns = (motion.time, motion.surge_speed, motion.pitch, motion.heading)
    return Track(*(np.array(column, dtype=float) for column in columns))
