"""Screening: the linear evidence of every hypothesis at the fit with κ = 4, and of all neighbours of a fitted one.

A cause that has no effect while it is small has no slope, and a one-sided slope at a non-smooth point does not hold
on the other side: such causes are simulated at some sizes. If even the fit with κ = 4 is not close to the records,
all causes are simulated so, and the best are fitted by themselves, before a force or a change point is fitted. The
same is done from the nominal model where something seems wrong: a wide fit may represent one large cause by many
small ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import log_ndtr

from subzero.diagnosis.hypothesis.hypotheses import (
    PRACTICAL_TOLERANCES,
    Ids,
    columns_of,
    is_flat,
    log_prior,
    nameable,
    pairs_of,
    variances,
    variances_named,
)
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.linear_gaussian import (
    KAPPAS,
    Posterior,
    Quadratic,
    freed,
    log_beyond,
    log_sum,
    posterior,
)
from subzero.diagnosis.inference.map_fit import (
    Candidate,
    Fit,
    at_bad_minimum,
    of_sizes,
    refit,
    restarted_where_smooth,
)
from subzero.diagnosis.inference.posing import with_residual_noise
from subzero.diagnosis.inference.problem import SizeRun, sizes_run

if TYPE_CHECKING:
    from subzero.diagnosis.inference.problem import Problem, Progress


@dataclass(frozen=True, kw_only=True, eq=False)
class Screening:
    """Linear evidence of hypotheses.

    Attributes:
        log_posterior: hypothesis → log (evidence, mixed over κ, times prior).
        starts: hypothesis → start of its fit, for causes without a slope.
        columns: place of an entry without a slope → its sensitivities, by the secant up to there (m,).
        count: of causes that can be named.
        far: the wide fit was not close to the records: sums of causes are no more than guesses.
    """

    log_posterior: dict[Ids, float] = field(default_factory=dict)
    starts: dict[Ids, np.ndarray] = field(default_factory=dict)
    columns: dict[int, np.ndarray] = field(default_factory=dict)
    count: int = 1
    far: bool = False

    def adds(self, ids: Ids, part: Ids) -> float:
        """Return the gain in log posterior of a hypothesis over a part of it; if the wide fit was far from the
        records, only that of the prior.
        """
        if self.far:
            return log_prior(ids, self.count) - log_prior(part, self.count)
        return self.log_posterior[ids] - self.log_posterior[part]

    def best(self, size: int, most: int, keep: float) -> list[Ids]:
        """Return the best hypotheses of a size, at most `most`, within `keep` nats of the best of that size."""
        of_size = (ids for ids in self.log_posterior if len(ids) == size)
        ranked = sorted(of_size, key=lambda ids: -self.log_posterior[ids])[:most]
        return [ids for ids in ranked if self.log_posterior[ids] > self.log_posterior[ranked[0]] - keep]


def is_close(problem: Problem, wide: Fit) -> bool:
    """Say whether a wide fit leaves only noise, and moves few parameters far."""
    bent = np.abs(wide.z) > settings.STRAINED_TOLERANCES * np.array(
        [entry.parameter.tolerance for entry in problem.entries]
    )
    model = np.array([entry.record < 0 for entry in problem.entries])
    is_poor = wide.r @ wide.r >= settings.POOR_MEAN_SQUARE * wide.r.size
    return bool(not is_poor and np.count_nonzero(bent & model) < settings.MAX_STRAINED)


def screening_of(
    problem: Problem, wide: Fit, nominal: tuple[np.ndarray, np.ndarray], *, far: bool
) -> Screening:
    """Return the linear evidence of no cause, every cause, and every pair.

    Args:
        problem: records and parameters.
        wide: the fit with wide tolerances.
        nominal: residual (m,) and sensitivities (m, k) of the nominal model.
        far: the wide fit is not close to the records.
    """
    if far:
        return _from_afar(problem, *nominal)
    names = nameable(problem.entries)
    found = Screening(count=len(names))
    base = _bases(problem, wide.quadratic, ())
    several: list[Ids] = [(), *((name,) for name in names), *pairs_of(problem.entries, names)]
    for ids, log in linear_evidences(problem, base, (), several).items():
        found.log_posterior[ids] = log + log_prior(ids, len(names))
    _sweep(problem, wide.z, wide.J, without_slope(problem, wide.J), found, wide.r, settings.SWEEP_SCALES)
    return found


def _from_afar(problem: Problem, r: np.ndarray, J: np.ndarray) -> Screening:
    """Return the screening if even the wide fit is not close to the records: every cause is simulated at some sizes,
    and a pair has the evidence of the better of the two.
    """
    names, zero = nameable(problem.entries), np.zeros(J.shape[1])
    found = Screening(count=len(names), far=True)
    found.log_posterior[()] = mixed_evidence(problem, Quadratic.at(zero, r, J)) + log_prior((), len(names))
    _sweep(problem, zero, J, _of_the_model(problem), found, r, settings.SWEEP_SCALES)
    for pair in pairs_of(problem.entries, names):
        better = max(found.log_posterior[(cause,)] for cause in pair)
        found.log_posterior[pair] = better + log_prior(pair, len(names)) - log_prior(pair[:1], len(names))
    return found


def swept_from_nominal(problem: Problem, r: np.ndarray, J: np.ndarray) -> Screening:
    """Return the screening of single causes at the best of some sizes, all other parameters within tolerances about
    the nominal model with residual r (m,) and sensitivities J (m, k): a wide fit may represent one large cause by
    many small ones.
    """
    found = Screening(count=len(nameable(problem.entries)))
    zero = np.zeros(J.shape[1])
    _sweep(problem, zero, J, _of_the_model(problem), found, r, settings.MERGED_SCALES)
    return found


def _of_the_model(problem: Problem) -> list[int]:
    """Return the entries of causes, not of start values."""
    return [k for k, entry in enumerate(problem.entries) if entry.record < 0]


class Base(NamedTuple):
    """The posterior with some causes free under a κ, and its prior variances (k,)."""

    known: Posterior
    D: np.ndarray


def _bases(problem: Problem, q: Quadratic, ids: Ids) -> dict[float, Base]:
    """Return κ → posterior with some causes free."""
    under = {kappa: variances(problem.entries, ids, kappa) for kappa in KAPPAS}
    return {kappa: Base(posterior(q, D), D) for kappa, D in under.items()}


def linear_evidences(
    problem: Problem, base: Mapping[float, Base], held: Ids, several: Sequence[Ids]
) -> dict[Ids, float]:
    """Return hypothesis → log evidence, mixed over κ, with its causes freed in addition to those that are free in
    `base`.
    """
    entries, by_sizes = problem.entries, dict[tuple[int, ...], list[tuple[Ids, list[int]]]]()
    own = {
        cause: columns_of(entries, (cause,))
        for cause in {cause_id for ids in (*several, held) for cause_id in ids}
    }
    for ids in several:
        more = [own[cause_id] for cause_id in ids if cause_id not in held]
        sizes = tuple(len(at) for at in more)
        by_sizes.setdefault(sizes, []).append((ids, [k for at in more for k in at]))
    known = {
        kappa: np.log(prior)
        + of_sizes(entries, *base[kappa], [own[cause] for cause in held], PRACTICAL_TOLERANCES * kappa)
        for kappa, prior in KAPPAS.items()
    }
    found = dict[Ids, float]()
    for sizes, alike in by_sizes.items():
        places = np.array([at for _, at in alike], dtype=int)
        logs = [
            log + _freed_evidence(problem, base[kappa], kappa, places, sizes) for kappa, log in known.items()
        ]
        found |= zip([ids for ids, _ in alike], np.logaddexp.reduce(logs).tolist(), strict=True)
    return {ids: found[ids] for ids in several}


def _freed_evidence(
    problem: Problem, base: Base, kappa: float, places: np.ndarray, sizes: Sequence[int]
) -> np.ndarray:
    """Return the log evidence (n,) of n hypotheses that free the entries at places (n, p) under a κ, of causes with
    so many parameters each.
    """
    every, bounded = range(len(problem.entries)), (_lowest(problem) == 0.0)[places]
    prior = variances_named(problem.entries, every, kappa)[places]
    value, mean, covariance = freed(base.known, base.D, places, prior)
    variance = np.diagonal(covariance, axis1=-2, axis2=-1)
    value = value + np.sum(np.where(bounded, log_ndtr(mean / np.sqrt(variance)) + np.log(2.0), 0.0), axis=-1)
    tolerance = np.array([entry.parameter.tolerance for entry in problem.entries])[places]
    within, mean = (
        (PRACTICAL_TOLERANCES * kappa * tolerance) ** 2,
        np.where(bounded, np.maximum(mean, 0.0), mean),
    )
    return value + log_beyond(mean, variance, prior, within, sizes)


def without_slope(problem: Problem, J: np.ndarray) -> list[int]:
    """Return the entries that have no effect when they are small."""
    return [
        k
        for k, entry in enumerate(problem.entries)
        if entry.record < 0 and entry.parameter.low == 0.0 and is_flat(entry, J[:, k])
    ]


def _sweep(
    problem: Problem,
    z: np.ndarray,
    J: np.ndarray,
    at: Sequence[int],
    found: Screening,
    here: np.ndarray,
    scales: Sequence[float],
) -> None:
    """Simulate sizes of entries about z, in parallel, given the residual `here` at z; keep the best of every
    cause.
    """
    names, flat, at_z = nameable(problem.entries), without_slope(problem, J), Quadratic.at(z, here, J)
    best: dict[Ids, float] = {
        (problem.entries[k].effect.id,): -np.inf for k in at
    }  # if no size can be simulated
    for cause in sizes_run(problem, z, here, at, scales):
        ids: Ids = (problem.entries[cause.k].effect.id,)
        value = _evidence_there(problem, _quadratic_of(cause, at_z, J), (), ids) + log_prior(ids, len(names))
        if value > best[ids]:
            best[ids], found.starts[ids] = value, cause.z
            if cause.k in flat:
                found.columns[cause.k] = (here - cause.r) / (cause.z[cause.k] - z[cause.k])
    found.log_posterior.update(best)


def _evidence_there(problem: Problem, q: Quadratic, held: Ids, ids: Ids) -> float:
    """Return the log evidence of a hypothesis with the causes `held` and at most one more, mixed over κ."""
    return linear_evidences(problem, _bases(problem, q, held), held, [ids])[ids]


def _quadratic_of(run: SizeRun, near: Quadratic, J: np.ndarray) -> Quadratic:
    """Return the linear problem at a simulated size, with all other sensitivities J (m, k), whose products are in
    `near`.
    """
    k, column = run.k, run.column
    whole = run.r + J @ run.z + (column - J[:, k]) * run.z[k]
    A, b, cross = near.A.copy(), J.T @ whole, J.T @ column
    cross[k], b[k] = column @ column, column @ whole
    A[k], A[:, k] = cross, cross
    return Quadratic(A=A, b=b, rr=float(whole @ whole))


def mixed_evidence(problem: Problem, q: Quadratic, ids: Ids = ()) -> float:
    """Return the log evidence of some causes, or of none, mixed over κ."""
    return log_sum(
        [np.log(prior) + linear_evidence(problem, q, ids, kappa) for kappa, prior in KAPPAS.items()]
    )


def linear_evidence(problem: Problem, q: Quadratic, ids: Ids, kappa: float) -> float:
    """Return the log evidence of some causes, or of none, under a κ."""
    D = variances(problem.entries, ids, kappa)
    said = posterior(q, D)
    causes = [columns_of(problem.entries, (cause_id,)) for cause_id in ids]
    return said.log_evidence + of_sizes(problem.entries, said, D, causes, PRACTICAL_TOLERANCES * kappa)


def with_one_added(problem: Problem, candidate: Candidate) -> dict[Ids, float]:
    """Return hypothesis → log posterior of all with one cause more than a candidate, in the linear problem there."""
    names, base = nameable(problem.entries), _bases(problem, candidate.fit.quadratic, candidate.ids)
    several = [tuple(sorted({*candidate.ids, more})) for more in names if more not in candidate.ids]
    logs = linear_evidences(problem, base, candidate.ids, [candidate.ids, *several])
    there = {ids: log + log_prior(ids, len(names)) for ids, log in logs.items()}
    return {ids: candidate.log_posterior + there[ids] - there[candidate.ids] for ids in several}


def with_one_swapped(problem: Problem, candidate: Candidate, rest: Ids) -> dict[Ids, float]:
    """Return hypothesis → log posterior of all with another cause added to the rest of a candidate, likewise."""
    q, names, found = candidate.fit.quadratic, nameable(problem.entries), {}
    for other in names:
        ids = tuple(sorted({*rest, other}))
        if len(ids) > len(rest) and ids != candidate.ids:
            found[ids] = mixed_evidence(problem, q, ids) + log_prior(ids, len(names))
    return found


class TriedSize(NamedTuple):
    """A hypothesis at a size of one of its causes: log posterior, deviations (k,), and sensitivities there (m, k)."""

    log_posterior: float
    z: np.ndarray
    J: np.ndarray


def with_sizes_tried(
    problem: Problem,
    candidate: Candidate,
    rest: Ids,
    at: Sequence[int],
    scales: Sequence[float],
) -> dict[Ids, TriedSize]:
    """Return hypothesis → its best size, for the causes of entries added to the rest of a candidate.

    Args:
        problem: records and parameters.
        candidate: the candidate.
        rest: those of its causes that are kept.
        at: places of the entries that are simulated.
        scales: their sizes, in effect scales, either way.
    """
    entries, names, J = problem.entries, nameable(problem.entries), candidate.fit.J
    z = np.maximum(
        posterior(candidate.fit.quadratic, variances(entries, rest, candidate.kappa)).z, _lowest(problem)
    )
    here = problem.residual(z)
    found, at_z = dict[Ids, TriedSize](), Quadratic.at(z, here, J)
    for run in sizes_run(problem, z, here, at, scales):
        ids = tuple(sorted({*rest, entries[run.k].effect.id}))
        log = _evidence_there(problem, _quadratic_of(run, at_z, J), rest, ids) + log_prior(ids, len(names))
        if ids not in found or log > found[ids].log_posterior:
            slopes = np.column_stack([J[:, : run.k], run.column, J[:, run.k + 1 :]])
            found[ids] = TriedSize(log, run.z, slopes)
    return found


def _lowest(problem: Problem) -> np.ndarray:
    return np.array([entry.parameter.low for entry in problem.entries])


KAPPA_WIDE = 4.0
"""κ of the fit that is the linearisation point of the screening."""
Nominal = tuple[np.ndarray, np.ndarray]
"""Residual (m,) and sensitivities (m, k) of the nominal model."""


def fit_wide(problem: Problem, progress: Progress) -> tuple[Problem, Fit, Nominal]:
    """Return the problem with the noise estimated from the wide fit, that fit, and the residual and sensitivities of
    the nominal model.
    """
    progress(0.05, "sensitivities of the nominal model")
    zero = np.zeros(len(problem.entries))
    J = problem.jacobian(zero)
    fit = _from(problem, zero, J, progress)
    for _ in range(settings.MAX_ADDED):
        D = variances(problem.entries, (), KAPPA_WIDE)
        again = with_residual_noise(problem, fit.z, D) if np.isfinite(fit.r).all() else None
        if again is None:
            break
        problem, J = again, again.jacobian(zero)
        fit = _from(problem, fit.z, problem.jacobian(fit.z), progress)
    return problem, fit, (problem.residual(zero), J)


def _from(problem: Problem, z: np.ndarray, J: np.ndarray, progress: Progress) -> Fit:
    """Return the fit from z, with the sensitivities there; or, if it ends in a bad local minimum, a better one
    restarted from smooth values of the non-smooth parameters.
    """
    progress(0.15, "fit within wide tolerances")
    fit = refit(problem, z, J, variances(problem.entries, (), KAPPA_WIDE), most_fresh=2, made_at=z)
    if not at_bad_minimum(problem, fit, ()):
        return fit
    again = restarted_where_smooth(problem, fit, ())
    return again if again.objective < fit.objective else fit
