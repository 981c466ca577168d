"""How well a run explains a measured record: the error of a model, channel by channel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from subzero.records.record import HEADING, Record, turned

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, kw_only=True)
class Fit:
    """How well a model explains one measured channel, in the channel's unit; error = model − measured.

    Args:
        samples: number of samples compared: measured, and inside the simulated time.
        rmse: root of the mean squared error.
        bias: mean error; positive if the model gives too much.
        fit_percent: 100 (1 − |error| / |measured − its mean|): 100 is perfect, 0 no better than the mean;
            NaN if what was measured does not vary.
    """

    samples: int
    rmse: float
    bias: float
    fit_percent: float


def modelled(run: xr.Dataset, name: str, time: np.ndarray) -> np.ndarray:
    """Return a channel of a run at other times: linear between its samples, NaN outside."""
    return np.interp(time, run["time"].values, run[name].values, left=np.nan, right=np.nan)


def fit(run: xr.Dataset, record: Record, name: str) -> Fit:
    """Compare one channel of a run with what was measured."""
    measured = record.values[name]
    error = modelled(run, name, record.time) - measured
    known = np.isfinite(error)
    if not known.any():
        return Fit(samples=0, rmse=np.nan, bias=np.nan, fit_percent=np.nan)
    error, measured = error[known], measured[known]
    spread = float(np.linalg.norm(measured - measured.mean()))
    share = float(np.linalg.norm(error)) / spread if spread > 0.0 else np.nan
    rmse = float(np.sqrt(np.mean(error**2)))
    return Fit(samples=error.size, rmse=rmse, bias=float(error.mean()), fit_percent=100.0 * (1.0 - share))


def fits(runs: dict[str, xr.Dataset], record: Record) -> dict[str, dict[str, Fit]]:
    """Return channel → run → how well that run explains the record."""
    return {name: {label: fit(run, record, name) for label, run in runs.items()} for name in record.values}


def beside(record: Record, run: xr.Dataset) -> Record:
    """Return the record with its heading shifted by whole turns, so that it starts next to the run's."""
    if HEADING not in record.values:
        return record
    heading = turned(record.values[HEADING], modelled(run, HEADING, record.time))
    return replace(record, values={**record.values, HEADING: heading})
