"""The most probable numbers, the noise behind them, and the covariance of both together.

    M = P⁻¹,  P = D⁻¹ + Jᵀ J;        honest:  M' = P⁻¹ (D⁻¹ + Jᵀ Ω J) P⁻¹,   Ω = cov(r)

M is right if the whitened residual r is white. What a noise model of one slow part leaves of other colours is in Ω,
estimated by sums over blocks of each channel (Liang and Zeger 1986); variances are inflated by what that is more.

A vehicle whose numbers are off by 40 % leaves records far off, where the linear problem says little. So the
fit begins with noise `FIRST_NOISE` times as large, and goes on with the usual one, the estimated one, and the error of
the economical steps made good.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from subzero.diagnosis.inference.linear_gaussian import posterior
from subzero.diagnosis.inference.map_fit import Fit, refit
from subzero.diagnosis.inference.problem import Problem, Progress, with_finer_steps, with_noise_behind

FIRST_NOISE = 8.0
"""Factor on the noise of the first fit. [-]"""
MAX_ROUNDS = 6
"""A fit is begun again at most so often where it stopped, with sensitivities of its own."""
SETTLED_GAIN = 0.5
"""A fit that the linear problem promises less than this has settled. [nat]"""
OWN_WITHIN = 0.3
"""Sensitivities are a fit's own if they were made so close to it, in tolerances."""
MAX_NOISE_ROUNDS = 2
"""How often the noise is estimated."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """The fit of a calibration.

    Attributes:
        problem: with the noise that was estimated behind the fit.
        fit: the most probable deviations.
        M: their covariance (k, k), inflated.
        settled: no step would gain more.
    """

    problem: Problem
    fit: Fit
    M: np.ndarray
    settled: bool


def fitted(problem: Problem, free: int, D: np.ndarray, progress: Progress) -> Fitted:
    """Return the most probable deviations, with the noise behind them.

    Args:
        problem: records, and what is free.
        free: so many entries, the first ones, are the numbers that are calibrated.
        D: prior variances of all entries (k,).
        progress: told the fraction that is done, and what is being done.
    """
    progress(0.05, "first fit, with more noise than there is")
    z = _first(problem, free, D)
    progress(0.25, "fit with usual noise")
    fit, settled = _settled(problem, z, D)
    for round in range(MAX_NOISE_ROUNDS):
        progress(0.5 + 0.15 * round, "noise behind the fit")
        again = with_noise_behind(problem, fit.z, D)
        if again is None:
            break
        problem = again
        fit, settled = _settled(problem, fit.z, D)
    progress(0.85, "errors of the time steps")
    corrected = with_finer_steps(problem, fit.z)
    if corrected is not None:
        problem = corrected
        fit, settled = _settled(problem, fit.z, D)
    return Fitted(problem=problem, fit=fit, M=covariance(problem, fit), settled=settled)


def _first(problem: Problem, free: int, D: np.ndarray) -> np.ndarray:
    """Return where the fit begins (k,): the numbers and the starts alone, with more noise than there is."""
    core = [k for k, entry in enumerate(problem.entries) if k < free or entry.record >= 0]
    few = replace(with_more_noise(problem, FIRST_NOISE), entries=tuple(problem.entries[k] for k in core))
    z = np.zeros(D.size)
    z[core] = _settled(few, z[core], D[core])[0].z
    return z


def _settled(problem: Problem, z: np.ndarray, D: np.ndarray) -> tuple[Fit, bool]:
    """Return a fit with sensitivities made close by, and whether a further step would gain nothing."""
    fit = refit(problem, z, problem.jacobian(z), D, most_fresh=2, made_at=z)
    for _ in range(MAX_ROUNDS):
        if fit.converged and fit.moved(problem) < OWN_WITHIN:
            return fit, True
        before = fit.objective
        fit = refit(problem, fit.z, problem.jacobian(fit.z), D, r=fit.r, most_fresh=0, made_at=fit.z)
        if before - fit.objective < SETTLED_GAIN and fit.moved(problem) < OWN_WITHIN:
            return fit, True
    return fit, False


def with_more_noise(problem: Problem, factor: float) -> Problem:
    """Return the problem with noise that is a factor larger in every channel."""
    records = tuple(
        replace(
            one,
            noise={
                name: replace(
                    old, white=factor * old.white, slow=factor * old.slow, resolution=factor * old.resolution
                )
                for name, old in one.noise.items()
            },
        )
        for one in problem.records
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
    return factor[:, None] * M * factor


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
                found.append(np.stack([score[block == one].sum(axis=0) for one in np.unique(block)]))
    return np.concatenate(found)
