"""From a truth to a record: run by the other formulation, read by noisy sensors, with outliers and gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from subzero.diagnosis.hypothesis.catalogue import SPECS
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.inference import Problem
from subzero.records.record import Record
from subzero.synthetic.reference_run import NoTruthError, simulate_reference

RHO, OUTLIERS, GAPS, FAR = 0.5, 0.01, 0.02, 15.0
"""Of the noise: correlation from sample to sample, shares of outliers and gaps; size of an outlier in noise levels."""
SEGMENTS = (0.5, 0.25, 0.125)
"""Of the cable in runs of the truth, whose time steps go with them. [m]"""
SAME = 4.0
"""Runs with two of them are one truth if they differ by less than this, squared, in noise levels."""
Shown = dict[str, np.ndarray]


class NoRunError(RuntimeError):
    """A truth that cannot be run at all, or that is another with every step."""


def shown_by(setting: Setting, times: np.ndarray, channels: tuple[str, ...], segment: float = 0.25) -> Shown:
    """Return what the sensors show without noise, by the other formulation with segments of a length [m]."""
    try:
        shown = simulate_reference(setting, times, channels, segment_length=segment, cable_step=0.1 * segment,
                                   hull_step=0.04 * segment)  # fmt: skip
    except NoTruthError as none:
        raise NoRunError(setting.trial.name) from none
    if not all(np.isfinite(values).all() for values in shown.values()):
        raise NoRunError(setting.trial.name)
    return shown


def agreed(setting: Setting, times: np.ndarray, channels: tuple[str, ...]) -> Shown:
    """Return what the first run shows that a coarser one agrees with: where slack cable jerks taut none may."""
    shown = shown_by(setting, times, channels, SEGMENTS[0])
    for segment in SEGMENTS[1:]:
        coarser, shown = shown, shown_by(setting, times, channels, segment)
        apart = [(shown[name] - coarser[name]) / SPECS[name].noise for name in channels]
        if float(np.sum(np.square(apart))) < SAME:
            return shown
    raise NoRunError(setting.trial.name)


def noisy(shown: Shown, times: np.ndarray, rng: np.random.Generator, level: float = 1.0) -> Record:
    """Return a record of what is shown."""
    values = {
        name: column + _noise(rng, column.size, level * SPECS[name].noise) for name, column in shown.items()
    }
    return Record(source="benchmark", time=times, values=values)


def with_true_noise(problem: Problem, level: float = 1.0) -> Problem:
    """Return the problem of records with the noise that `noisy` gives them."""
    lasts = -float(np.median(np.diff(problem.records[0].time))) / np.log(RHO)
    records = tuple(
        replace(
            one,
            noise={
                name: replace(
                    old, white=0.0, slow=level * SPECS[name].noise, correlation_time=lasts, resolution=0.0
                )
                for name, old in one.noise.items()
            },
        )
        for one in problem.records
    )
    return replace(problem, records=records)


def _noise(rng: np.random.Generator, size: int, level: float) -> np.ndarray:
    """Return AR(1) noise with outliers, NaN in gaps."""
    new, noise = rng.standard_normal(size), np.empty(size)
    noise[0] = new[0]
    for i in range(1, size):
        noise[i] = RHO * noise[i - 1] + np.sqrt(1.0 - RHO**2) * new[i]
    noise += np.where(rng.random(size) < OUTLIERS, FAR * rng.choice([-1.0, 1.0], size), 0.0)
    return level * np.where(rng.random(size) < GAPS, np.nan, noise)
