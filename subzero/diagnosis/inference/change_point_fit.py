"""Change points, fitted: the log posterior of a cause that begins in mid-trial, with its onset as a parameter.

    z ~ N(0, κ² τ²),   size ~ N(0, s²),   p(t₀) = 1/T          log p = −objective − ½ log det (D P)

Where a large change begins at some time, a model without it has to deviate from its priors, and a linearisation there
is inaccurate. With an estimated input force the simulation follows the true trajectory: around it every candidate is
scanned, the best ones are fitted, and the others are scanned again around the best fit, until no candidate is left
that might be better.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.hypothesis.hypotheses import (
    PRACTICAL_TOLERANCES_SUDDEN,
    log_prior,
    nameable,
    variances,
)
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.change_point_scan import (
    BaseRun,
    ChangePoint,
    LinearisationPoint,
    RankedChangePoint,
    change_point_columns,
    ranked_by_runs,
    ranked_in,
    with_change_point,
)
from subzero.diagnosis.inference.linear_gaussian import KAPPAS, Linear, Quadratic, log_sum, posterior
from subzero.diagnosis.inference.map_fit import (
    Candidate,
    Fit,
    bounds,
    continued,
    is_poor_fit,
    laplace,
    refit,
    with_own_jacobian,
)

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.effect import Effect
    from subzero.diagnosis.inference.problem import Problem


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedChangePoint:
    """A cause with a change point, with a fit of its own.

    Attributes:
        change_point: effect, onset and record, as fitted.
        log_posterior: with no other cause, but for the prior of the change point itself.
        problem: with its parameters and its onset appended to the entries.
        fit: of that problem.
    """

    change_point: ChangePoint
    log_posterior: float
    problem: Problem
    fit: Fit

    @property
    def id(self) -> str:
        """Such as "rudder_offset@12"."""
        return self.change_point.id

    def linear(self, problem: Problem) -> tuple[Linear, np.ndarray]:
        """Return the linear problem around this fit, and the prior variances of all its parameters (k,)."""
        fit = self.fit
        return Linear(fit.r + fit.J @ fit.z, fit.J), _prior(problem, self.problem, self.change_point.kappa)


def fit_change_points(
    problem: Problem,
    points: Sequence[LinearisationPoint],
    able: Sequence[Effect],
    record: int,
    least: float,
    side: Executor,
    large: Sequence[Candidate] = (),
) -> list[FittedChangePoint]:
    """Return the causes with a change point that are worth a fit, fitted.

    Args:
        problem: records and parameters.
        points: linearisation points of the first scan.
        able: effects that may begin in mid-trial.
        record: in which they begin.
        least: log posterior of the best other explanation, on the scale of `FittedChangePoint`.
        side: executor for fits in parallel.
        large: hypotheses whose causes are also tried at their full size.
    """
    done: dict[str, FittedChangePoint] = {}
    candidates = [candidate for point in points for candidate in ranked_in(problem, point, able, record)]
    candidates += [run for each in large for run in ranked_by_runs(problem, each, able, record)]
    for _ in range(settings.MAX_TRIED):
        worth = _worth(candidates, done, least)
        if not worth:
            break
        for item in side.map(partial(_fitted, problem), worth):
            name = item.change_point.effect.id
            done[name] = max(item, done.get(name, item), key=lambda each: each.log_posterior)
        best = max(done.values(), key=lambda candidate: candidate.log_posterior)
        candidates = [candidate for candidate in candidates if not any(candidate is each for each in worth)]
        is_place = best.log_posterior > least - settings.HOPELESS_NATS and not is_poor_fit(best.fit)
        if is_place:
            candidates = ranked_in(problem, linearised_at(problem, best), able, record)
    return list(done.values())


def _worth(
    candidates: Sequence[RankedChangePoint], done: dict[str, FittedChangePoint], least: float
) -> list[RankedChangePoint]:
    """Return the candidates that are worth a fit: each cause at the linearisation point where it ranks best, if it
    gains anything there, may come close to the best log posterior (fitted or predicted), and is predicted to gain
    more than any fit of it so far.
    """
    ranked = sorted(candidates, key=lambda candidate: -candidate.log_posterior)
    first = {candidate.change_point.effect.id: candidate for candidate in reversed(ranked)}
    known = {name: candidate.log_posterior for name, candidate in done.items()}
    bar = (
        max([least, *known.values(), *(candidate.log_posterior for candidate in ranked[:1])])
        - settings.HOPELESS_NATS
    )
    found = [
        candidate
        for name, candidate in first.items()
        if candidate.at_most(
            settings.NON_LINEAR_SHARE_OF_FIRST if candidate is ranked[0] else settings.NON_LINEAR_SHARE
        )
        > bar
        and candidate.change_point.log_gain + candidate.change_point.between > settings.CLOSE_NATS
        and candidate.log_posterior > known.get(name, -np.inf) + settings.CLOSE_NATS
    ]
    return sorted(found, key=lambda candidate: -candidate.log_posterior)[: settings.MAX_TRIED]


def _fitted(problem: Problem, candidate: RankedChangePoint) -> FittedChangePoint:
    """Return a cause with a change point, fitted by simulations, all other parameters within declared tolerances."""
    point, change_point = candidate.point, candidate.change_point
    more, n = with_change_point(problem, change_point), len(problem.entries)
    start = _begin(problem, more, candidate) if candidate.start is None else candidate.start
    start = np.clip(np.append(start, 0.0), *bounds(more))
    slopes = more.jacobian(start, range(n, start.size))[:, n:]
    D, J = _prior(problem, more, 1.0), np.hstack([point.fit.J[:, :n], slopes])
    fit = continued(more, with_own_jacobian(more, refit(more, start, J, D, most_fresh=1)))
    time = round(change_point.time + float(fit.z[-1]), 2)
    return as_fitted(problem, more, replace(change_point, time=time), fit)


def as_fitted(problem: Problem, more: Problem, change_point: ChangePoint, fit: Fit) -> FittedChangePoint:
    """Return a cause with a change point, with its fit in `more` (the problem with its parameters appended), and its
    evidence, mixed over κ.
    """
    n, under = len(problem.entries), {kappa: _prior(problem, more, kappa) for kappa in KAPPAS}
    log = laplace(more.entries, fit, under, [range(n, fit.z.size - 1)], PRACTICAL_TOLERANCES_SUDDEN)
    mixed = log_sum([float(np.log(prior)) + log[kappa] for kappa, prior in KAPPAS.items()])
    kappa = max(KAPPAS, key=lambda kappa: np.log(KAPPAS[kappa]) + log[kappa])
    change_point = replace(change_point, mean=fit.z[n:-1], kappa=kappa)
    total = mixed + log_prior((), len(nameable(problem.entries)))
    return FittedChangePoint(
        change_point=change_point,
        log_posterior=total if np.isfinite(fit.objective) else -np.inf,
        problem=more,
        fit=fit,
    )


def _begin(problem: Problem, more: Problem, candidate: RankedChangePoint) -> np.ndarray:
    """Return the best deviations in the linear problem at a linearisation point with a change point added."""
    fit, change_point, D = candidate.point.fit, candidate.change_point, _prior(problem, more, 1.0)[:-1]
    (C,) = change_point_columns(
        candidate.point.along, [(change_point.effect, change_point.time)], change_point.record
    )
    n = len(problem.entries)
    J, whole = np.hstack([fit.J[:, :n], C]), fit.r + fit.J @ fit.z
    return posterior(Quadratic(A=J.T @ J, b=J.T @ whole, rr=float(whole @ whole)), D).z


def _prior(problem: Problem, more: Problem, kappa: float) -> np.ndarray:
    """Return the prior variances of a problem's entries and of the cause with a change point appended to them."""
    own = [entry.parameter.scale**2 for entry in more.entries[len(problem.entries) :]]
    return np.concatenate([variances(problem.entries, (), kappa), own])


def linearised_at(problem: Problem, fitted: FittedChangePoint) -> LinearisationPoint:
    """Return the linear problem around the fit of a change point, of all parameters but its own."""
    n, fit = len(problem.entries), fitted.fit
    r = fit.r + fit.J[:, n:-1] @ fit.z[n:-1]
    without = replace(fit, z=fit.z[:n], r=r, J=fit.J[:, :n], D=fit.D[:n], made_at=None)
    return LinearisationPoint(fit=without, along=BaseRun(fitted.problem, fit.z))
