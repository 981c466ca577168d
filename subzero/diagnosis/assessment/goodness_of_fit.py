"""How well models predict records: the misfit of the nominal one, channel by channel; curves of all models and of the
measurements; and the gain of the extended one on data that were not fitted: blocks of the same trial, or other
trials.

    residual = measured − simulated;   nrmse = rms(W residual);   whiteness by Ljung-Box, 25 lags
    G0 = (E_nominal − E_extended)/(E_nominal − floor),   G1 = (E_tolerance − E_extended)/(E_tolerance − floor)

E is the mean square of the held-out residual, whitened: 1 is the noise alone. The refit without the held-out data is
that of the linear problem around the fit of all data, so that it takes no simulation; entries at a bound are held
there. A gain over the nominal model is mostly owed to tolerances; G1 is the part owed to the new physics.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import chdtrc

from subzero.diagnosis.inference.map_fit import Fit, bounds
from subzero.diagnosis.inference.posing import rewhitened, whitened_again
from subzero.diagnosis.inference.simulator import respond
from subzero.diagnosis.results import ChannelGain, Curves, Gain, Misfit

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.noise import Noise
    from subzero.diagnosis.inference.problem import Observed, Problem

LJUNG_BOX_LAGS = 25
WINDOW_S = 2.0
"""Length of the windows in which a misfit is tested [s]."""
COMMANDS = ("propeller", "rudder", "port stern-plane", "starboard stern-plane")


def misfits(record: Observed, simulated: dict[str, np.ndarray]) -> dict[str, Misfit]:
    """Return channel → misfit of a record, from the prediction of the nominal model at its times."""
    return {name: _misfit(record, name, simulated[name]) for name in record.noise}


def _misfit(record: Observed, name: str, simulated: np.ndarray) -> Misfit:
    noise, measured = record.noise[name], record.values[name]
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
        command_correlation=_correlations(record, noise, measured - simulated),
        windows=_windows(record.time[noise.used], residual, noise),
        noise_sd=noise.sd,
        noise_slow=noise.slow,
        noise_time=noise.correlation_time,
        resolution=noise.resolution,
        outliers=int(np.sum(np.isfinite(measured) & ~noise.used)),
        gaps=int(np.sum(~np.isfinite(measured))),
    )


def whiteness(white: np.ndarray, lags: int = LJUNG_BOX_LAGS) -> float:
    """Return the p-value of Ljung and Box: the probability that white noise would be as coloured."""
    x = white - np.mean(white)
    n, total = x.size, float(x @ x)
    if n <= lags + 1 or total == 0.0:
        return float("nan")
    rho = np.array([x[k:] @ x[:-k] for k in range(1, lags + 1)]) / total
    return float(chdtrc(lags, n * (n + 2) * np.sum(rho**2 / (n - np.arange(1, lags + 1)))))


def _correlations(record: Observed, noise: Noise, difference: np.ndarray) -> dict[str, tuple[float, float]]:
    """Return command → (lag [s], correlation) of the residual with a command up to 25 samples before, strongest."""
    commands = record.setting.trial.commands
    if commands is None:
        return {}
    held = np.asarray(commands.values)[np.searchsorted(commands.time, record.time + 1e-9, side="right") - 1]
    residual = np.where(noise.used, difference, 0.0)
    residual = np.where(noise.used, residual - np.mean(difference[noise.used]), 0.0)
    step, found = float(np.median(np.diff(record.time))), {}
    for name, column in zip((*COMMANDS, *commands.listed), held.T, strict=True):
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
    """Return the windows in which the mean residual is significantly above the noise, joined."""
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
    return {record.name: _curves(problem, i, fits) for i, record in enumerate(problem.records)}


def _curves(problem: Problem, record: int, fits: Mapping[str, Fit | None]) -> Curves:
    """Return the curves of a record."""
    found, models, count = problem.records[record], {}, len(problem.entries)
    for label, fit in fits.items():
        z = fit.z if fit else np.zeros(count)
        models[label] = respond(
            problem.setting(record, np.pad(z, (0, count - z.size))), found.time, found.noise
        )
    return Curves(
        time=found.time,
        measured=found.values,
        models=models,
        used={name: n.used for name, n in found.noise.items()},
    )


BLOCK_S, FOLDS = 2.0, 5
"""Length of a block [s], and number of parts in which a trial is held out."""
BOOTSTRAP_DRAWS, LOWER_LEVEL = 1000, 0.05
"""Draws of the bootstrap, and its one-sided level: the lower bound is exceeded with 95 %."""
AT_BOUND = 1e-9
BLOCKS, TRIALS = "blocks of the same trial", "other trials"


class Fitted(NamedTuple):
    """A fit, and the problem that it is a fit of."""

    problem: Problem
    fit: Fit


class _Row(NamedTuple):
    """Origin of the rows of a residual: record, channel, and time [s] of each (m,)."""

    record: np.ndarray
    channel: np.ndarray
    time: np.ndarray


def gain(
    nominal: np.ndarray, tolerance: Fitted, extended: Fitted, rival: Fitted | None = None, *, seed: int = 0
) -> Gain:
    """Return the gain of an extended model.

    Args:
        nominal: residual of the nominal model (m,), whitened with the noise of the tolerances' refit.
        tolerance: "nothing is wrong", refit within tolerances.
        extended: the named explanation, refit; its problem may have a noise of its own, which then whitens all
            residuals.
        rival: the best other hypothesis; the tolerances' refit is used if there is none.
        seed: of the bootstrap.
    """
    problem = extended.problem
    rows = rows_of(problem)
    parts = parts_of(problem, rows)
    nominal = whitened_again(tolerance.problem, problem, nominal)
    models = [_whitened_anew(each, problem) for each in (tolerance, extended, rival or tolerance)]
    fitted = [nominal, *(model.fit.r for model in models)]
    held = [nominal, *(held_out(model, parts) for model in models)]
    n, t, e = (held[i] ** 2 for i in range(3))
    return Gain(
        fitted=_channels(problem, rows, fitted),
        held_out=_channels(problem, rows, held),
        total=share(n.mean(), e.mean(), n.size),
        owed=share(t.mean(), e.mean(), n.size),
        owed_low=_lower(t, e, _blocks(rows), seed),
        how=TRIALS if len(problem.records) > 1 else BLOCKS,
    )


def _whitened_anew(model: Fitted, problem: Problem) -> Fitted:
    """Return a fit of the same samples, whitened with the noise of another problem."""
    known = replace(model.problem, records=problem.records)
    return Fitted(known, rewhitened(model.fit, model.problem, known))


def share(before: float, after: float, samples: float) -> float:
    """Return (before − after)/(before − 1) of mean squares: 1 if everything that can be explained is, below 0 if the
    error grows.

    The residual may lie below the noise's expected square; then all is explained. Where there was next to nothing to
    explain, the denominator is no smaller than the scatter of such squares, so that no gain is claimed.
    """
    scatter = float(np.sqrt(2.0 / samples))
    return float((before - after) / max(before - min(1.0, after), scatter))


def rows_of(problem: Problem) -> _Row:
    """Return the origin of the rows of a residual."""
    record, channel, time = [], [], []
    for i, each in enumerate(problem.records):
        for name, noise in each.noise.items():
            used = each.time[noise.used]
            record.append(np.full(used.size, i))
            channel.append(np.full(used.size, name, dtype=object))
            time.append(used)
    return _Row(np.concatenate(record), np.concatenate(channel), np.concatenate(time))


def parts_of(problem: Problem, rows: _Row) -> np.ndarray:
    """Return the number of the part (m,) in which each row is held out: its record, or its block of the only
    trial.
    """
    if len(problem.records) > 1:
        return rows.record
    return (rows.time // BLOCK_S).astype(int) % FOLDS


def held_out(model: Fitted, parts: np.ndarray) -> np.ndarray:
    """Return the residual (m,) in which each part is predicted by a linear refit of all others."""
    fit = model.fit
    low, high = bounds(model.problem)
    free = (fit.z > low + AT_BOUND) & (fit.z < high - AT_BOUND)
    J, prior = fit.J[:, free], 1.0 / fit.D[free]
    found = fit.r.copy()
    for part in np.unique(parts):
        known = parts != part
        P = J[known].T @ J[known] + np.diag(prior)
        step = np.linalg.solve(P, J[known].T @ fit.r[known] - prior * fit.z[free])
        found[~known] = fit.r[~known] - J[~known] @ step
    return found


def _channels(problem: Problem, rows: _Row, residuals: list[np.ndarray]) -> Mapping[str, ChannelGain]:
    """Return the root mean square of residuals in each channel's unit, with that of the noise."""
    squares = [raw(problem, residual) ** 2 for residual in residuals]
    found = {}
    for name in dict.fromkeys(rows.channel.tolist()):
        before, tolerance, after, rival = (
            float(np.sqrt(square[rows.channel == name].mean())) for square in squares
        )
        levels = [record.noise[name].sd for record in problem.records if name in record.noise]
        floor = float(np.sqrt(np.mean(np.square(levels))))
        found[name] = ChannelGain(before=before, tolerance=tolerance, after=after, rival=rival, floor=floor)
    return found


def raw(problem: Problem, whitened: np.ndarray) -> np.ndarray:
    """Return a whitened residual (m,) in the channels' units."""
    parts, at = [], 0
    for record in problem.records:
        for noise in record.noise.values():
            parts.append(noise.colour(whitened[at : at + noise.count]))
            at += noise.count
    return np.concatenate(parts)


def _blocks(rows: _Row) -> np.ndarray:
    """Return the block (m,) that each row belongs to, all channels together, numbered from 0."""
    both = np.stack([rows.record, (rows.time // BLOCK_S).astype(int)])
    return np.unique(both, axis=1, return_inverse=True)[1].ravel()


def _lower(before: np.ndarray, after: np.ndarray, blocks: np.ndarray, seed: int) -> float:
    """Return the lower bound of `share` by a bootstrap of blocks of squares."""
    count = int(blocks.max()) + 1
    sums = [
        np.bincount(blocks, weights=each, minlength=count) for each in (before, after, np.ones_like(before))
    ]
    drawn = np.random.default_rng(seed).integers(count, size=(BOOTSTRAP_DRAWS, count))
    b, a, n = (each[drawn].sum(axis=1) for each in sums)
    shares = [share(x / k, y / k, k) for x, y, k in zip(b, a, n, strict=True)]
    return float(np.quantile(shares, LOWER_LEVEL))
