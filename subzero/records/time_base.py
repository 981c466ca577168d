"""When a record was measured: its times beside those of the trial, its gaps, its whole turns."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

import scenarios
from subzero.records.record import Record

MIN_DURATION_S, MAX_STEP_S, MIN_SAMPLES = 5.0, 5.0, 6
"""A record has to last so long [s], with a sample at least so often [s], and so many samples."""

SAME_TIME_S = 1e-6
"""Times that differ by less are the same. [s]"""


def epoch_problems(record: Record, trial: scenarios.Trial) -> list[str]:
    """Return what is wrong if a record begins outside its trial."""
    first = record.time[0]
    if 0.0 <= first < trial.duration:
        return []
    return [
        f"the first time is {first:g} s, but time_s counts from the start of the trial, which lasts "
        f"{trial.duration:g} s: subtract the time of the start"
    ]


def time_problems(record: Record, trial: scenarios.Trial, *, longer: bool) -> list[str]:
    """Return what is wrong with the times of a record; it may be `longer` than its trial if it has its own commands."""
    time, problems = record.time, epoch_problems(record, trial)
    if problems:
        return problems
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    if time.size < MIN_SAMPLES:
        problems.append(f"it has {time.size} samples; a diagnosis needs at least {MIN_SAMPLES}")
    if step > MAX_STEP_S:
        problems.append(
            f"it is sampled every {step:g} s, slower than the vehicle moves: a diagnosis needs a sample every "
            f"{MAX_STEP_S:g} s, better every 0.1 s"
        )
    if time[-1] - time[0] < MIN_DURATION_S:
        problems.append(f"it lasts {time[-1] - time[0]:g} s; a diagnosis needs at least {MIN_DURATION_S:g} s")
    if not longer and time[-1] > trial.duration + max(step, trial.cable_step) + SAME_TIME_S:
        problems.append(
            f"it lasts until {time[-1]:g} s, but the trial {trial.name} ends at {trial.duration:g} s: give the "
            f"scenario that was flown, set duration_s = {math.ceil(time[-1]):d} in a copy of it, or cut the record"
        )
    return problems


def cut_to(trial: scenarios.Trial, record: Record) -> scenarios.Trial:
    """Return the trial, as long as its record."""
    steps = math.ceil(record.time[-1] / trial.cable_step - SAME_TIME_S)
    return dataclasses.replace(trial, duration=steps * trial.cable_step)


def without_repeats(time: np.ndarray, column: np.ndarray, rate: float | None) -> np.ndarray:
    """Return a channel without the repeats of a sensor slower than the record: gaps in their place."""
    if rate is None:
        return column
    turn = np.floor((time - time[0]) * rate + SAME_TIME_S)
    return np.where(np.r_[True, np.diff(turn) > 0], column, np.nan)
