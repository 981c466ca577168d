"""From a truth to a record: run by the other formulation, read by noisy sensors, with outliers and gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from subzero.diagnosis.effects.sensors import SPECS
from subzero.diagnosis.other_code import NoTruthError, simulate_otherwise
from subzero.diagnosis.response import respond
from subzero.diagnosis.setting import Setting
from subzero.measured import Record

RHO, OUTLIERS, GAPS, FAR = 0.5, 0.01, 0.02, 15.0
"""Of the noise: correlation from sample to sample, shares of outliers and gaps; size of an outlier in noise levels."""
FINE = {"hull_step": 0.01, "cable_step": 0.05, "segment_length": 0.25}
Shown = dict[str, np.ndarray]


class NoRunError(RuntimeError):
    """A truth that cannot be run at all."""


def shown_by(setting: Setting, times: np.ndarray, channels: tuple[str, ...]) -> tuple[Shown, str]:
    """Return what the sensors show without noise, and who says so: "other", or "fine" where that finds no run."""
    try:
        shown, who = simulate_otherwise(setting, times, channels), "other"
    except NoTruthError:
        shown, who = respond(replace(setting, trial=replace(setting.trial, **FINE)), times, channels), "fine"
    if not all(np.isfinite(values).all() for values in shown.values()):
        raise NoRunError(setting.trial.name)
    return shown, who


def noisy(shown: Shown, times: np.ndarray, rng: np.random.Generator, level: float = 1.0) -> Record:
    """Return a record of what is shown."""
    values = {
        name: column + _noise(rng, column.size, level * SPECS[name].noise) for name, column in shown.items()
    }
    return Record(source="benchmark", time=times, values=values)


def _noise(rng: np.random.Generator, size: int, level: float) -> np.ndarray:
    """Return AR(1) noise with outliers, NaN in gaps."""
    new, noise = rng.standard_normal(size), np.empty(size)
    noise[0] = new[0]
    for i in range(1, size):
        noise[i] = RHO * noise[i - 1] + np.sqrt(1.0 - RHO**2) * new[i]
    noise += np.where(rng.random(size) < OUTLIERS, FAR * rng.choice([-1.0, 1.0], size), 0.0)
    return level * np.where(rng.random(size) < GAPS, np.nan, noise)
