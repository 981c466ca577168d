"""The screen: how probable every hypothesis is in the linear problem at a wide fit, before any is fitted.

Causes that do nothing when they are small have no place in a linear problem: real runs try some sizes of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from subzero.diagnosis.candidate import Candidate, possible
from subzero.diagnosis.evidence import KAPPAS, Posterior, Quadratic, freed, log_sum, posterior
from subzero.diagnosis.hypotheses import Ids, compatible, log_prior, named, places, variances
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit

FAR = 1.08
"""A wide fit that leaves a greater mean square, in noise, is not close to the records."""
SWEEP = (0.25, 0.5, 1.0, 2.0)
"""Sizes, in effect scales, that effects without a slope at the nominal model are tried at."""
FELT = 1.0
"""An effect of one scale that seems to do less than this, in noise, has no slope at the nominal model."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Screen:
    """What the linear problem says.

    Attributes:
        log_posterior: hypothesis → log (evidence, mixed over κ, times prior).
        secants: hypothesis → where its fit begins, for causes without a slope.
    """

    log_posterior: dict[Ids, float] = field(default_factory=dict)
    secants: dict[Ids, np.ndarray] = field(default_factory=dict)

    def best(self, size: int, most: int, keep: float) -> list[Ids]:
        """Return the best hypotheses of a size, at most so many, this close to the best of all of that size."""
        of_size = (ids for ids in self.log_posterior if len(ids) == size)
        ranked = sorted(of_size, key=lambda ids: -self.log_posterior[ids])[:most]
        return [ids for ids in ranked if self.log_posterior[ids] > self.log_posterior[ranked[0]] - keep]


def is_close(wide: Fit) -> bool:
    """Say whether a wide fit leaves nothing but noise."""
    return float(wide.r @ wide.r) < FAR * wide.r.size


def look(problem: Problem, wide: Fit, nominal: np.ndarray) -> Screen:
    """Return the screen: nothing, every cause, and every pair.

    Args:
        problem: records and parameters.
        wide: the fit with wide tolerances.
        nominal: sensitivities of the nominal model (m, k).
    """
    found, names = Screen(), named(problem)
    base = {kappa: posterior(wide.quadratic, variances(problem.entries, (), kappa)) for kappa in KAPPAS}
    for ids in [(), *((one,) for one in names), *compatible(problem.entries, names)]:
        found.log_posterior[ids] = linear(problem, base, (), ids) + log_prior(ids, len(names))
    _sweep(problem, wide, nominal, found)
    return found


def linear(problem: Problem, base: Mapping[float, Posterior], held: Ids, more: Ids) -> float:
    """Return the log evidence, mixed over κ, when further causes are freed beside those that are free in `base`."""
    at, found = places(problem.entries, tuple(one for one in more if one not in held)), []
    for kappa, prior in KAPPAS.items():
        value = base[kappa].log_evidence
        if at:
            D, own = (variances(problem.entries, ids, kappa) for ids in (held, more))
            value, mean, covariance = freed(base[kappa], D, at, own[at])
            value += possible(problem.entries, at, mean, np.sqrt(np.diag(covariance)))
        found.append(np.log(prior) + value)
    return log_sum(found)


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
    """Return hypothesis → log evidence of all with another cause beside the rest of a candidate, likewise."""
    q, found = one.fit.quadratic, {}
    for other in named(problem):
        ids = tuple(sorted({*rest, other}))
        if len(ids) > len(rest) and ids != one.ids:
            under = {kappa: posterior(q, variances(problem.entries, ids, kappa)) for kappa in KAPPAS}
            found[ids] = log_sum(
                [np.log(prior) + under[kappa].log_evidence for kappa, prior in KAPPAS.items()]
            )
    return found


def _sweep(problem: Problem, wide: Fit, nominal: np.ndarray, found: Screen) -> None:
    """Try sizes of the causes that do nothing when they are small: at the wide fit, if that is close to the records."""
    z, J = (wide.z, wide.J) if is_close(wide) else (np.zeros_like(wide.z), nominal)
    for k, entry in enumerate(problem.entries):
        felt = float(np.linalg.norm(J[:, k])) * entry.parameter.scale
        if entry.record < 0 and entry.parameter.low == 0.0 and felt <= FELT:
            tried = [_secant(problem, k, size * entry.parameter.scale, z, J) for size in SWEEP]
            best, ids = max(tried, key=lambda pair: pair[0]), (entry.effect.id,)
            found.log_posterior[ids] = best[0] + log_prior(ids, len(named(problem)))
            found.secants[ids] = best[1]


def _secant(problem: Problem, k: int, size: float, z: np.ndarray, J: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the log evidence of entry k at a size, others within their tolerances about z; and where it is."""
    others, moved, found = z.copy(), z.copy(), []
    others[k], moved[k] = 0.0, size
    r = problem.residual(moved)
    if not np.isfinite(r).all():
        return -np.inf, moved
    q = Quadratic.at(others, r, J)
    for kappa, prior in KAPPAS.items():
        value = posterior(q, variances(problem.entries, (), kappa)).log_evidence
        found.append(np.log(prior) + value - 0.5 * (size / problem.entries[k].parameter.scale) ** 2 - 1.0)
    return log_sum(found), moved
