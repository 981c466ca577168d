"""The most probable numbers, the noise estimated with them, and the covariance of both together.

    M = P⁻¹,  P = D⁻¹ + Jᵀ J;        honest:  M' = P⁻¹ (D⁻¹ + Jᵀ Ω J) P⁻¹,   Ω = cov(r)

M is right if the whitened residual r is white. What a noise model of one slow part leaves of other colours is in Ω,
estimated by sums over blocks of each channel (Liang and Zeger 1986); variances are inflated by what that is more.

A vehicle whose numbers are off by 40 % leaves records far off, where the linear problem says little. So the fit begins
with the beginnings of the records and more noise than there is, lowered as it comes closer, from several starts; it
goes on with the usual noise, the estimated one, and the error of the economical steps made good. Sensors, fins and
start are free from the first step on: what they are off by is many times the noise, and numbers that must make up for
it without them end in a wrong minimum.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri
from scipy.stats.qmc import Sobol

from subzero.calibration.numbers import STEP_SHARE
from subzero.diagnosis.inference import (
    SETTLED_GAIN,
    Fit,
    Problem,
    Progress,
    bounded_step,
    bounds,
    broyden_update,
    economical,
    objective,
    posterior,
    refit,
    runnable,
    with_finer_steps,
    with_residual_noise,
)

HORIZONS = ((0.3, 0.6, 1.0), (0.1, 0.2, 0.35, 0.6, 1.0))
"""Shares of the records that are fitted, one after the other; of the first start, and of the second. [-]"""
MORE_STARTS, START_SHARE = 4, 0.3
"""Starts with other numbers, up to this share of each, where those did not end in the same minimum. [-]"""
SAME_MINIMUM = 10.0
"""Fits of two starts whose objectives differ by less ended in the same minimum; others differ by hundreds. [nat]"""
MAX_CHECKS = 3
"""How often a fit continues from a better point found at the end of an interval."""
SIGMAS_95 = float(ndtri(0.975))
"""Half an interval of 95 % in standard deviations."""
LEAST_RISE = 0.25
"""−2 log posterior that rises by less than this at the end of an interval says only that it is far wider. [-]"""
MAX_PROFILE_STEPS, PROFILE_GAIN = 5, 0.1
"""Steps of the fit of all others with one number held, and the gain that is worth one more. [nat]"""
MAX_LOWERINGS, FAILED_SHARE = 5, 0.9
"""Noise is lowered so often; no more where the misfit remains above this share of its former value. [-]"""
FIRST_MISFIT = 2.0
"""A fit begins with so much noise that it leaves the vehicle so many levels off. [-]"""
MAX_NOISE_ROUNDS = 2
"""How often the noise is estimated."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """The fit of a calibration.

    Attributes:
        problem: with the noise that was estimated with the fit.
        fit: the most probable deviations.
        M: their covariance (k, k), inflated.
        settled: no step would move a calibrated number (`is_settled`), nor did one from the ends of an interval.
        repeated: another start ended in the same minimum.
    """

    problem: Problem
    fit: Fit
    M: np.ndarray
    settled: bool
    repeated: bool = True


def fitted(problem: Problem, free: int, D: np.ndarray, progress: Progress) -> Fitted:
    """Return the most probable deviations, with the noise they were estimated with.

    Args:
        problem: records, and the free parameters.
        free: so many entries, the first ones, are the numbers that are calibrated.
        D: prior variances of all entries (k,).
        progress: called with the fraction that is done, and the task in progress.
    """
    first, spread, repeated = _first(problem, free, D, progress)
    progress(0.5, "fit with usual noise")
    fit = refit(problem, first, D, precise=True)
    for round in range(MAX_NOISE_ROUNDS):
        progress(0.6 + 0.1 * round, "noise behind the fit")
        again = with_residual_noise(problem, fit.z, D)
        if again is None:
            break
        problem = again
        fit = refit(problem, fit.z, D, precise=True)
    progress(0.8, "errors of the time steps")
    corrected = with_finer_steps(problem, fit.z)
    if corrected is not None:
        problem = corrected
        fit = refit(problem, fit.z, D, precise=True)
    for round in range(MAX_CHECKS):
        progress(0.85 + 0.05 * round, "ends of the intervals")
        M = covariance(problem, fit)
        wider, better = ends_checked(problem, fit, M, free)
        if better is None:
            break
        fit = refit(problem, better, D, precise=True)
    settled = better is None and is_settled(problem, fit, M, free)
    wider = np.maximum(wider, spread) * wider_by_rows(problem, fit, M)
    M = wider[:, None] * M * wider
    return Fitted(problem=problem, fit=fit, M=M, settled=settled, repeated=repeated)


def is_settled(problem: Problem, fit: Fit, M: np.ndarray, free: int) -> bool:
    """Return whether the full step of the linear problem moves no calibrated number out of its interval.

    It must be less than √(2 `SETTLED_GAIN`) standard deviations, which corresponds to that gain. The damped steps of
    the fit can be arbitrarily short, so their predicted gain shows nothing; changes of sensors and starts are not
    considered.
    """
    step = bounded_step(fit.J, fit.r, fit.z, fit.D, *bounds(problem))
    sd = np.sqrt(np.diag(M))
    return bool(np.max(np.abs(step[:free]) / sd[:free]) < np.sqrt(2.0 * SETTLED_GAIN))


def wider_by_rows(problem: Problem, fit: Fit, M: np.ndarray) -> np.ndarray:
    """Return by which factors intervals must be wider (k,) to hold what outliers that stand in a row say.

    An outlier stands alone; several in a row, as in a transient, are what the model does not follow. A number that
    would move if they were used depends on their being left out.
    """
    again = with_rows_of_outliers(problem)
    if again is None:
        return np.ones(fit.z.size)
    J, r = again.central_jacobian(fit.z), again.residual(fit.z)
    step = bounded_step(J, r, fit.z, fit.D, *bounds(again))
    step -= bounded_step(fit.J, fit.r, fit.z, fit.D, *bounds(problem))
    wider: np.ndarray = np.sqrt(1.0 + step**2 / np.diag(M))
    return wider


def with_rows_of_outliers(problem: Problem) -> Problem | None:
    """Return the problem with the samples that were left out side by side; None if there are none."""
    records, any_row = [], False
    for record in problem.records:
        noise = {}
        for name, old in record.noise.items():
            out = np.isfinite(record.values[name]) & ~old.used
            row = out & (np.r_[False, out[:-1]] | np.r_[out[1:], False])
            any_row |= bool(row.any())
            noise[name] = replace(old, used=old.used | row, time=record.time[old.used | row])
        records.append(replace(record, noise=noise))
    return replace(problem, records=tuple(records)) if any_row else None


def _first(
    problem: Problem, free: int, D: np.ndarray, progress: Progress
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return where the fit with usual noise begins (k,), by how much what starts ended at is wider than Laplace's
    interval says (k,), and whether two ended in the same minimum.
    """
    ends: list[Fit] = []
    for i, (z, shares) in enumerate(_starts(problem, free, D.size)):
        progress(0.5 * i / (len(HORIZONS) + MORE_STARTS), f"first fit, from start {i + 1}")
        ends.append(_fit_from(problem, z, D, shares))
        best = min(ends, key=lambda end: end.objective)
        same = [end for end in ends if end.objective < best.objective + SAME_MINIMUM]
        if len(same) > 1:
            break
    sd = np.sqrt(np.diag(posterior(best.quadratic, D).M))
    apart = [
        np.abs(each.z - best.z) / sd / np.sqrt(1.0 + 2.0 * (each.objective - best.objective)) for each in same
    ]
    return best.z, np.maximum(np.max(apart, axis=0), 1.0), len(same) > 1


def ends_checked(
    problem: Problem, fit: Fit, M: np.ndarray, free: int
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return by which factors intervals must be wider (k,) for −2 log posterior to rise at their ends as it should; and
    deviations that are better than the fit (k,), where some are found on the way.
    """
    wider = np.ones(fit.z.size)
    low, high = bounds(problem)
    for k in range(free):
        for offset in SIGMAS_95 * np.sqrt(M[k, k]) * np.array([-1.0, 1.0]):
            if low[k] < fit.z[k] + offset < high[k]:
                z, rise = held_at(problem, fit, k, offset)
                if rise < -2.0 * SETTLED_GAIN:
                    return wider, z
                wider[k] = max(wider[k], SIGMAS_95 / np.sqrt(max(rise, LEAST_RISE)))
    return wider, None


def held_at(problem: Problem, fit: Fit, k: int, offset: float) -> tuple[np.ndarray, float]:
    """Return the deviations with entry k held at an offset from the best and all others fitted again (k,), and the rise
    of −2 log posterior there.
    """
    J, D = fit.J, fit.D
    low, high = bounds(problem)
    low[k] = high[k] = fit.z[k] + offset
    z, r, best, at = fit.z, fit.r, np.inf, fit.z
    for _ in range(MAX_PROFILE_STEPS):
        step = bounded_step(J, r, z, D, low, high)
        after = problem.residual(z + step)
        now = objective(after, z + step, D)
        if not now < best - PROFILE_GAIN:
            break
        J = broyden_update(J, step, after - r, D)
        z, r, best, at = z + step, after, now, z + step
    return at, float(2.0 * (best - fit.objective))


def _starts(problem: Problem, free: int, size: int) -> Iterator[tuple[np.ndarray, tuple[float, ...]]]:
    """Give starts (k,), and the shares of the records to begin with: the vehicle as it was, then others around it."""
    for shares in HORIZONS:
        yield np.zeros(size), shares
    nominal = np.array([entry.parameter.tolerance for entry in problem.entries[:free]]) / STEP_SHARE
    low, high = bounds(problem)
    for row in Sobol(free, rng=0).random(MORE_STARTS):
        z = np.zeros(size)
        z[:free] = START_SHARE * (2.0 * row - 1.0) * nominal
        yield np.clip(z, low, high), HORIZONS[0]


def _fit_from(problem: Problem, z: np.ndarray, D: np.ndarray, shares: Sequence[float]) -> Fit:
    """Return the fit with usual noise from a start, by way of the beginnings of the records and raised noise."""
    for share in shares:
        short = beginnings(problem, share)
        for _ in range(MAX_LOWERINGS):
            z, r = runnable(short, z, None)
            misfit = float(np.sqrt(np.mean(r**2)))
            if not np.isfinite(misfit):
                break
            factor = max(misfit / FIRST_MISFIT, 1.0)
            fit = refit(with_more_noise(short, factor), z, D)
            z = fit.z
            if factor == 1.0 or factor * np.sqrt(np.mean(fit.r**2)) > FAILED_SHARE * misfit:
                break
    return refit(problem, z, D)


def beginnings(problem: Problem, share: float) -> Problem:
    """Return the problem of the first part of every record, a share of its length."""
    if share >= 1.0:
        return problem
    records = []
    for record in problem.records:
        end = share * float(record.time[-1])
        noise = {}
        for name, old in record.noise.items():
            used = old.used & (record.time <= end)
            noise[name] = replace(old, used=used, time=record.time[used])
        records.append(replace(record, noise=noise, setting=economical(record.setting, end)))
    return replace(problem, records=tuple(records))


def with_more_noise(problem: Problem, factor: float) -> Problem:
    """Return the problem with noise that is a factor larger in every channel."""
    records = tuple(
        replace(
            record,
            noise={
                name: replace(
                    old, white=factor * old.white, slow=factor * old.slow, resolution=factor * old.resolution
                )
                for name, old in record.noise.items()
            },
        )
        for record in problem.records
    )
    return replace(problem, records=records)


BLOCK_CORRELATIONS = 5.0
"""A block of the residual lasts so many correlation times of the channel's slow part …"""
LEAST_BLOCK_S = 2.0
"""… and no less than this. [s]"""


def covariance(problem: Problem, fit: Fit) -> np.ndarray:
    """Return the covariance of the deviations (k, k), inflated where the residual is not white."""
    M = posterior(fit.quadratic, fit.D).M
    scores = block_scores(problem, fit)
    robust = M @ (np.diag(1.0 / fit.D) + scores.T @ scores) @ M
    factor = np.sqrt(np.maximum(np.diag(robust) / np.diag(M), 1.0))
    inflated: np.ndarray = factor[:, None] * M * factor
    return inflated


def block_scores(problem: Problem, fit: Fit) -> np.ndarray:
    """Return Σ over a block of J r, for every block of every channel of every record (blocks, k)."""
    found, at = [], 0
    for record in problem.records:
        for noise in record.noise.values():
            own = slice(at, at + noise.count)
            at += noise.count
            if noise.count:
                length = max(
                    LEAST_BLOCK_S, BLOCK_CORRELATIONS * noise.correlation_time if noise.slow else 0.0
                )
                block = ((noise.time - noise.time[0]) // length).astype(int)
                score = fit.J[own] * fit.r[own][:, None]
                found.append(np.stack([score[block == each].sum(axis=0) for each in np.unique(block)]))
    return np.concatenate(found)
