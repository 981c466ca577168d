"""Residuals of the nominal model, channel by channel, and the curves of all models beside the records for the figures.

residual = measured − simulated;   nrmse = rms(W residual);   whiteness by Ljung-Box, 25 lags
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc

from subzero.diagnosis.inference.simulator import respond
from subzero.diagnosis.results import Curves, Misfit

if TYPE_CHECKING:
    from subzero.diagnosis.inference.map_fit import Fit
    from subzero.diagnosis.inference.noise import Noise
    from subzero.diagnosis.inference.problem import Observed, Problem

LJUNG_BOX_LAGS = 25
WINDOW_S = 2.0
"""Length of the windows in which a misfit is looked for [s]."""
COMMANDS = ("propeller", "rudder", "port stern-plane", "starboard stern-plane")


def misfits(one: Observed, simulated: dict[str, np.ndarray]) -> dict[str, Misfit]:
    """Return channel → misfit of a record, from what the nominal model says to its times."""
    return {name: _misfit(one, name, simulated[name]) for name in one.noise}


def _misfit(one: Observed, name: str, simulated: np.ndarray) -> Misfit:
    noise, measured = one.noise[name], one.values[name]
    residual = (measured - simulated)[noise.used]
    spread = measured[noise.used] - np.mean(measured[noise.used])
    rmse = float(np.sqrt(np.mean(residual**2)))
    norm = float(np.linalg.norm(spread))
    return Misfit(
        rmse=rmse,
        nrmse=rmse / noise.sd,
        fit_percent=100.0 * (1.0 - float(np.linalg.norm(residual)) / norm) if norm > 0.0 else float("nan"),
        bias=float(np.mean(residual)),
        whiteness_p=whiteness(noise.whiten(measured - simulated)),
        command_correlation=_correlations(one, noise, measured - simulated),
        windows=_windows(one.time[noise.used], residual, noise),
        noise_sd=noise.sd,
        noise_slow=noise.slow,
        noise_time=noise.correlation_time,
        resolution=noise.resolution,
        outliers=int(np.sum(np.isfinite(measured) & ~noise.used)),
        gaps=int(np.sum(~np.isfinite(measured))),
    )


def whiteness(white: np.ndarray, lags: int = LJUNG_BOX_LAGS) -> float:
    """Return the p-value of Ljung and Box: how often white noise would be as coloured."""
    x = white - np.mean(white)
    n, total = x.size, float(x @ x)
    if n <= lags + 1 or total == 0.0:
        return float("nan")
    rho = np.array([x[k:] @ x[:-k] for k in range(1, lags + 1)]) / total
    return float(chdtrc(lags, n * (n + 2) * np.sum(rho**2 / (n - np.arange(1, lags + 1)))))


def _correlations(one: Observed, noise: Noise, difference: np.ndarray) -> dict[str, tuple[float, float]]:
    """Return command → (lag [s], correlation) of the residual with a command up to 25 samples before, strongest."""
    commands = one.setting.trial.commands
    if commands is None:
        return {}
    held = np.asarray(commands.values)[np.searchsorted(commands.time, one.time + 1e-9, side="right") - 1]
    residual = np.where(noise.used, difference, 0.0)
    residual = np.where(noise.used, residual - np.mean(difference[noise.used]), 0.0)
    step, found = float(np.median(np.diff(one.time))), {}
    for name, column in zip(COMMANDS, held.T, strict=True):
        x = column - np.mean(column)
        scale = np.linalg.norm(x) * np.linalg.norm(residual)
        if scale > 0.0:
            values = [
                float(residual[k:] @ x[: x.size - k]) / scale for k in range(min(LJUNG_BOX_LAGS, x.size))
            ]
            at = int(np.argmax(np.abs(values)))
            found[name] = (at * step, float(values[at]))
    return found


def _windows(time: np.ndarray, residual: np.ndarray, noise: Noise) -> tuple[tuple[float, float], ...]:
    """Return the times in which the mean residual is more than noise can be, joined."""
    found: list[tuple[float, float]] = []
    for begin in np.arange(time[0], time[-1], WINDOW_S):
        own = (time >= begin) & (time < begin + WINDOW_S)
        if own.sum() > 3 and abs(np.mean(residual[own])) > 3.0 * noise.sd_of_mean(int(own.sum()), WINDOW_S):
            if found and abs(found[-1][1] - begin) < 1e-9:
                found[-1] = (found[-1][0], float(begin + WINDOW_S))
            else:
                found.append((float(begin), float(begin + WINDOW_S)))
    return tuple(found)


def curves(problem: Problem, fits: Mapping[str, Fit | None]) -> dict[str, Curves]:
    """Return record → curves of the nominal model (a fit of None) and of fits.

    Args:
        problem: with the entries of all fits; those of a fit with fewer are the first ones.
        fits: label → fit.
    """
    return {one.name: _curves(problem, i, fits) for i, one in enumerate(problem.records)}


def _curves(problem: Problem, record: int, fits: Mapping[str, Fit | None]) -> Curves:
    """Return the curves of a record."""
    one, models, count = problem.records[record], {}, len(problem.entries)
    for label, fit in fits.items():
        z = fit.z if fit else np.zeros(count)
        models[label] = respond(problem.setting(record, np.pad(z, (0, count - z.size))), one.time, one.noise)
    return Curves(
        time=one.time,
        measured=one.values,
        models=models,
        used={name: n.used for name, n in one.noise.items()},
    )
