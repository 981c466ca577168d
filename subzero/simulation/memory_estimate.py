"""How much memory a run will need, estimated before it is allocated.

What grows is the cable's shape, kept at every step: the way that the tow point goes is estimated from below, so that
only runs are refused that cannot fit; one that nevertheless outgrows the memory stops and keeps what it has.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import NamedTuple

import numpy as np

import scenarios
from cable.memory import fits, refuse_unless_it_fits
from cable.moving_end import LONGEST
from cable.tow_path import segments_needed
from subzero.engine.recording import Grid, new_recording, row_of
from subzero.model import Model

BYTES_A_NODE, BYTES_OF_TRACE = 5 * 8, 4 * 8
"""Place, tension and arc length of a node in a row; force and nodes of every time."""
COPIES = 2
"""The recording, and the labelled result that is made of it."""
SHARE_OF_FREE_RUNNING = 0.3
"""A vehicle goes at no less than about this share of the speed at which its propeller has no thrust. [-]"""
JOINED = 1.5
"""Far segments are joined two by two: so many of them there are for one that is as long as it may be, about. [-]"""
REMEDY = (
    "Keep fewer results (every_s in the trial, or --every), or try a longer cable_step_s or segment_length_m, a "
    "grading, or a shorter duration_s."
)


MOST_KEPT = 1.5e8
"""A trial that does not say how many results it wants keeps all as long as these take so much; else fewer. [bytes]"""
THINNED = "thinned"
"""Attribute of a run that keeps fewer results than it has steps, unasked: why, and how to keep all."""
ROUND = (1, 2, 5)
"""Every so many results one is kept then, or ten times as many, and so on. [-]"""


class Work(NamedTuple):
    """An estimate of the work of a run: segments at most, and how long vehicle and cable take in all [µs]."""

    segments: int
    hull: float
    cable: float


MICROSECONDS_A_HULL_STEP = 2.0
MICROSECONDS_A_SEGMENT = 10.0
"""Of an exchange: a handful of Newton iterations, 1.4 µs a segment each."""


def work_of(trial: scenarios.Trial, model: Model, tethered: bool) -> Work:
    """Return an estimate of the work of a run."""
    segments, rows = most_segments(trial, model) if tethered else 0, trial.duration / trial.cable_step
    hull = MICROSECONDS_A_HULL_STEP * trial.duration / trial.hull_step
    return Work(segments, hull, MICROSECONDS_A_SEGMENT * rows * segments)


def most_segments(trial: scenarios.Trial, model: Model) -> int:
    """Return how many segments the cable has at most, about."""
    longest = max(trial.start.wet_length, _last_length(trial, model))
    return segments_of(trial, longest)


def segments_of(trial: scenarios.Trial, length: float) -> int:
    """Return how many segments a cable of some length [m] has, about, see `cable.moving_end.remeshing.join_far`."""
    even = segments_needed(length, trial.segment_length, trial.grading)
    near = min(2.0 * trial.far_length, length)
    if trial.far_grading == 0.0 or near == length:
        return even
    half, graded = 0.5 * (length - near), LONGEST / trial.far_grading
    growth = np.log1p(trial.far_grading * min(half, graded) / trial.segment_length)
    far = JOINED * 2.0 * (growth / np.log1p(trial.far_grading) + max(half - graded, 0.0) / LONGEST)
    return min(even, segments_needed(near, trial.segment_length, trial.grading) + int(far))


def with_fewer_results(trial: scenarios.Trial, model: Model, tethered: bool) -> scenarios.Trial:
    """Return a trial that keeps as many results as take `MOST_KEPT`, if it leaves open how many it wants (`every` 0).

    A trial whose results take less, or that states how many it wants, is not changed.
    """
    if trial.every > 0.0:
        return trial
    size = bytes_of_results(trial, model, tethered, row_of(trial.times().size - 1, 1) + 1.0)
    if size <= MOST_KEPT:
        return trial
    power = 10 ** int(np.log10(size / MOST_KEPT))
    stride = next(power * each for each in (*ROUND, 10) if power * each * MOST_KEPT >= size)
    return dataclasses.replace(trial, every=stride * trial.cable_step)


def thinning_notice(trial: scenarios.Trial) -> str:
    """Return the notice of a run that keeps fewer results than steps without being asked to."""
    step = f"{trial.cable_step:g}"
    return (
        f"Results are kept every {trial.every:g} s of this long run: all would take more than {MOST_KEPT / 1e6:g} MB. "
        f"every_s = {step} in the trial, or --every {step}, keeps all."
    )


def bytes_of_results(trial: scenarios.Trial, model: Model, tethered: bool, rows: float) -> float:
    """Return an estimate of the memory that so many results of a run take."""
    if not tethered:
        return rows * bytes_a_row()
    return rows * (bytes_a_row() + BYTES_A_NODE * (1 + most_segments(trial, model)))


def refuse_what_cannot_fit(trial: scenarios.Trial, model: Model, tethered: bool, grid: Grid) -> None:
    """Raise a UserError if the results of a run will not fit into memory."""
    rows = row_of(grid.times.size - 1, grid.stride) + 1.0
    size = COPIES * rows * bytes_a_row() + BYTES_OF_TRACE * grid.times.size
    if tethered:
        lengths = (trial.start.wet_length, _last_length(trial, model))
        nodes = [1 + segments_of(trial, length) for length in lengths]
        size += (
            rows * BYTES_A_NODE * (0.5 * sum(nodes) + max(nodes))
        )  # the result is padded to the largest number of nodes at all times
    kept = f", kept every {trial.every:g} s," if grid.stride > 1 else ","
    refuse_unless_it_fits(
        size, f"'{trial.name}', {trial.duration:g} s in steps of {trial.cable_step:g} s{kept}", REMEDY
    )


@cache
def bytes_a_row() -> float:
    """Return the memory of a recording for the vehicle at one time."""
    return float(sum(values.nbytes for values in new_recording(1, 0)))


def fits_in_memory(nodes: int) -> bool:
    """Return whether shapes of so many nodes in all can be kept, and made into a result."""
    return fits(COPIES * BYTES_A_NODE * nodes)


def _last_length(trial: scenarios.Trial, model: Model) -> float:
    """Return how much cable is in the water at the end, at least [m]."""
    wet = trial.start.wet_length
    if model.winch is not None and model.winch.control == "pay_out_rate":
        time, rate = np.array(model.winch.time), np.array(model.winch.setpoint)
        grid = np.linspace(0.0, trial.duration, 1001)
        return max(wet + float(np.trapezoid(np.interp(grid, time, rate), grid)), 0.0)
    return wet if model.winch is not None else wet + _way(trial, model)


def _way(trial: scenarios.Trial, model: Model) -> float:
    """Return how far the vehicle goes through the water, about, and rather too little [m]."""
    if trial.motion is not None:
        motion = trial.motion
        speeds = (motion.surge_speed, motion.sway_speed, motion.heave_speed)
        speed = np.sqrt(sum(each**2 for each in speeds if each is not None))
        return float(np.trapezoid(speed, motion.time))
    if trial.commands is None:
        return 0.0
    times = np.append(trial.commands.time, trial.duration)
    spans = np.clip(np.diff(np.minimum(times, trial.duration)), 0.0, None)
    propeller = model.vehicle.propeller
    advance = propeller.thrust_constant / max(propeller.thrust_slope, 1e-6) * propeller.diameter
    return SHARE_OF_FREE_RUNNING * advance * float(np.abs(trial.commands.values[:, 0]) @ spans)
