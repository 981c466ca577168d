"""Two usual ways, for comparison: both hold all nuisances at their nominal values, and take the noise for white.

score       every cause alone: (J_kᵀ r)² / (J_kᵀ J_k), χ² with one degree of freedom, Bonferroni over all causes
selection   forward selection of columns by BIC, m ln RSS + k ln m, each fitted by least squares
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from subzero.diagnosis.inference import Noise, Observed, Problem

from .distance import sensitivities

ALARM, MOST = 0.05, 12


def white(problem: Problem) -> tuple[Problem, np.ndarray, np.ndarray]:
    """Return the problem as it were with white noise, its residual at the nominal model, and J."""
    records = tuple(replace(one, noise=_colourless(one)) for one in problem.records)
    plain = replace(problem, records=records)
    return plain, plain.residual(np.zeros(len(problem.entries))), sensitivities(plain)


def _colourless(one: Observed) -> dict[str, Noise]:
    return {
        name: replace(noise, white=noise.sd, slow=0.0, resolution=0.0) for name, noise in one.noise.items()
    }


def score(problem: Problem, r: np.ndarray, J: np.ndarray) -> tuple[str, bool]:
    """Return the cause that the score test ranks first, and whether it raises an alarm."""
    own = [k for k, entry in enumerate(problem.entries) if entry.record < 0]
    found = {k: float((J[:, k] @ r) ** 2 / max(J[:, k] @ J[:, k], 1e-12)) for k in own}
    best = max(found, key=lambda k: found[k])
    return problem.entries[best].effect.id, bool(found[best] > chi2.isf(ALARM / len(own), 1))


def selection(problem: Problem, r: np.ndarray, J: np.ndarray) -> list[str]:
    """Return the causes that forward selection by BIC names, in order; all chosen are fitted by least squares."""
    own = [k for k, entry in enumerate(problem.entries) if entry.record < 0]
    C, left, chosen = J[:, own].copy(), r.copy(), []
    least = 1e-9 * np.sum(C**2, axis=0) + 1e-30
    while len(chosen) < MOST:
        square = np.sum(C**2, axis=0)
        drop = np.where(square > least, (C.T @ left) ** 2 / np.maximum(square, least), 0.0)
        k, before = int(np.argmax(drop)), float(left @ left)
        if r.size * np.log((before - drop[k]) / before) + np.log(r.size) >= 0.0:
            break
        q = C[:, k] / np.sqrt(square[k])
        left, C = left - q * (q @ left), C - np.outer(q, q @ C)
        chosen.append(problem.entries[own[k]].effect.id)
    return list(dict.fromkeys(chosen))
