"""A record as sensors write it: the truth of the other cable formulation, with coloured noise, outliers and gaps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from subzero.diagnosis.effects.sensors import NOISE
from subzero.diagnosis.other_code import simulate_otherwise
from subzero.diagnosis.setting import Setting
from subzero.records.record import Record

OUTLIER = (8.0, 25.0)
"""Outliers lie so many noise levels off."""

Simulate = Callable[[Setting, np.ndarray, Iterable[str]], Mapping[str, np.ndarray]]


def make_record(
    setting: Setting,
    times: np.ndarray,
    channels: Iterable[str],
    *,
    seed: int | np.random.Generator,
    noise: Mapping[str, float] | float = 1.0,
    rho: float = 0.5,
    outliers: float = 0.01,
    missing: float = 0.02,
    dropout: float = 0.0,
    quantum: Mapping[str, float] | None = None,
    simulate: Simulate = simulate_otherwise,
    source: str = "simulated",
) -> Record:
    """Return what is measured in a setting.

    Args:
        setting: the truth.
        times: of the samples (n,). [s]
        channels: names of `subzero.channels`.
        seed: of the noise.
        noise: channel → standard deviation in its display unit, or a factor on that of usual sensors.
        rho: correlation of the noise from sample to sample.
        outliers: share of samples far off.
        missing: share of samples that are not there.
        dropout: length of a gap in every channel, somewhere. [s]
        quantum: channel → smallest step that its sensor shows.
        simulate: what gives the truth.
        source: of the record, in words.
    """
    rng, channels = np.random.default_rng(seed), tuple(channels)
    factor = noise if isinstance(noise, float | int) else 1.0
    levels = {
        **{name: factor * level for name, level in NOISE.items()},
        **(noise if isinstance(noise, Mapping) else {}),
    }
    truth, values = simulate(setting, times, channels), {}
    for name in channels:
        shown = truth[name] + levels[name] * _coloured(rng, times.size, rho)
        far = rng.random(times.size) < outliers
        shown += far * rng.choice([-1.0, 1.0], times.size) * rng.uniform(*OUTLIER, times.size) * levels[name]
        step = (quantum or {}).get(name, 0.0)
        shown = np.round(shown / step) * step if step > 0.0 else shown
        gone = rng.random(times.size) < missing
        begins = rng.uniform(0.0, max(times[-1] - dropout, 0.0))
        gone |= (dropout > 0.0) & (times >= begins) & (times < begins + dropout)
        values[name] = np.where(gone, np.nan, shown)
    return Record(source=source, time=times, values=values)


def _coloured(rng: np.random.Generator, n: int, rho: float) -> np.ndarray:
    """Return AR(1) noise of level one."""
    white, out = rng.normal(size=n), np.zeros(n)
    out[0] = white[0]
    for k in range(1, n):
        out[k] = rho * out[k - 1] + np.sqrt(1.0 - rho * rho) * white[k]
    return out
