"""What else there may be around a candidate: beside it, or in the place of one of its causes.

The linear problem at its fit says that of all causes, but for those that runs have kinks in: a slope on one side of a
kink says nothing of the other, so that real runs try some sizes of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.evidence import KAPPAS, Quadratic, posterior
from subzero.diagnosis.hypotheses import Ids, log_prior, named, variances
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.screen import SWEEP, linear, mixed_evidence, sizes


def beside(problem: Problem, one: Candidate) -> dict[Ids, float]:
    """Return hypothesis → log posterior of all with one cause more than a candidate, in the linear problem there."""
    names, found = named(problem), {}
    base = {
        kappa: posterior(one.fit.quadratic, variances(problem.entries, one.ids, kappa)) for kappa in KAPPAS
    }
    here = linear(problem, base, one.ids, one.ids) + log_prior(one.ids, len(names))
    for more in names:
        ids = tuple(sorted({*one.ids, more}))
        if len(ids) > len(one.ids):
            there = linear(problem, base, one.ids, ids) + log_prior(ids, len(names))
            found[ids] = one.log_posterior + there - here
    return found


def instead(problem: Problem, one: Candidate, rest: Ids) -> dict[Ids, float]:
    """Return hypothesis → log posterior of all with another cause beside the rest of a candidate, likewise."""
    q, names, found = one.fit.quadratic, named(problem), {}
    for other in names:
        ids = tuple(sorted({*rest, other}))
        if len(ids) > len(rest) and ids != one.ids:
            found[ids] = mixed_evidence(problem, q, ids) + log_prior(ids, len(names))
    return found


class Tried(NamedTuple):
    """A hypothesis at a size of one of its causes: log posterior, deviations (k,), and sensitivities there (m, k)."""

    log_posterior: float
    z: np.ndarray
    J: np.ndarray


def swept(
    problem: Problem, one: Candidate, rest: Ids, at: Sequence[int], scales: Sequence[float] = SWEEP
) -> dict[Ids, Tried]:
    """Return hypothesis → its best size, for the causes of entries beside the rest of a candidate.

    Args:
        problem: records and parameters.
        one: the candidate.
        rest: those of its causes that are kept.
        at: places of the entries that are tried.
        scales: sizes that they are tried at, in effect scales, either way.
    """
    entries, names, J = problem.entries, named(problem), one.fit.J
    z = np.maximum(posterior(one.fit.quadratic, variances(entries, rest, one.kappa)).z, _lowest(problem))
    jobs = [(k, size) for k in at for size in sizes(entries[k].parameter, scales)]
    moved = [np.concatenate([z[:k], [size], z[k + 1 :]]) for k, size in jobs]
    found = dict[Ids, Tried]()
    here, *runs = problem.residuals([z, *moved])
    for (k, size), there, r in zip(jobs, moved, runs, strict=True):
        ids = tuple(sorted({*rest, entries[k].effect.id}))
        slopes = np.column_stack([J[:, :k], (here - r) / (size - z[k]), J[:, k + 1 :]])
        if np.isfinite(slopes).all():
            log = mixed_evidence(problem, Quadratic.at(there, r, slopes), ids) + log_prior(ids, len(names))
            if ids not in found or log > found[ids].log_posterior:
                found[ids] = Tried(log, there, slopes)
    return found


def _lowest(problem: Problem) -> np.ndarray:
    return np.array([entry.parameter.low for entry in problem.entries])
