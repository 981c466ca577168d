"""How probable a cause that begins in mid-trial is: each fitted by real runs, and when it began with it.

Where much is wrong from some time on, a model without it has to bend, and what is linear there says little. But a force
that nobody explains, fitted, takes the run along the true one: there every sudden cause is tried from every time, the
best are fitted, and the others tried again in the place of the best, until none is left that might be better.

    z ~ N(0, κ² τ²),   size ~ N(0, s²),   p(t₀) = 1/T          log p = −objective − ½ log det (D P)
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from subzero.diagnosis.candidate import Candidate, laplace
from subzero.diagnosis.effect import Effect
from subzero.diagnosis.evidence import KAPPAS, Quadratic, log_sum, posterior
from subzero.diagnosis.hopes import Hope, hopes_in, large_hopes
from subzero.diagnosis.hypotheses import log_prior, named, variances
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit, gone_on, is_lost, refit, with_own_slopes
from subzero.diagnosis.stride import bounds
from subzero.diagnosis.sudden import Along, Begun, Place, columns, with_begun

ROUNDS, MOST, HOPE = 3, 3, 6.0
"""Rounds of trying; in each at most so many are fitted that the linear problem has this close to the best."""
BENT, MUCH = 0.05, 0.75
"""Where a cause gains much, what is not linear may be this share of it; of the cause that gains most, so much."""
BETTER = 2.0
"""What was fitted is fitted again where the linear problem promises so much more, in log posterior."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Struck:
    """A sudden cause with a fit of its own.

    Attributes:
        begun: what and when, as fitted.
        log_posterior: of it beside nothing, but for its own prior.
        problem: with its parameters and its time behind the entries.
        fit: of that problem.
    """

    begun: Begun
    log_posterior: float
    problem: Problem
    fit: Fit

    @property
    def id(self) -> str:
        """Such as "rudder_offset@12"."""
        return self.begun.id


def struck(
    problem: Problem,
    places: Sequence[Place],
    able: Sequence[Effect],
    record: int,
    least: float,
    side: Executor,
    large: Sequence[Candidate] = (),
) -> list[Struck]:
    """Return the sudden causes that are worth a fit of their own, fitted.

    Args:
        problem: records and parameters.
        places: where they are tried at first.
        able: effects that may begin in mid-trial.
        record: in which they begin.
        least: log posterior of what is known else, on the scale of `Struck`.
        side: for fits side by side.
        large: hypotheses whose causes are tried as large as they are there.
    """
    done: dict[str, Struck] = {}
    hopes = [one for place in places for one in hopes_in(problem, place, able, record)]
    hopes += [one for each in large for one in large_hopes(problem, each, able, record)]
    for _ in range(ROUNDS):
        worth = _worth(hopes, done, least)
        if not worth:
            break
        for one in side.map(partial(_fitted, problem), worth):
            name = one.begun.effect.id
            done[name] = max(one, done.get(name, one), key=lambda each: each.log_posterior)
        best = max(done.values(), key=lambda one: one.log_posterior)
        hopes = [one for one in hopes if not any(one is each for each in worth)]
        if not is_lost(best.fit):
            hopes = hopes_in(problem, in_its_place(problem, best), able, record)
    return list(done.values())


def _worth(hopes: Sequence[Hope], done: dict[str, Struck], least: float) -> list[Hope]:
    """Return what is worth a fit: each cause where it comes out best, if it may come close to the best, known or hoped
    for, and is promised more than what is known of it.
    """
    ranked = sorted(hopes, key=lambda one: -one.log_posterior)
    first = {one.begun.effect.id: one for one in reversed(ranked)}
    known = {name: one.log_posterior for name, one in done.items()}
    bar = max([least, *known.values(), *(one.log_posterior for one in ranked[:1])]) - HOPE
    found = [one for name, one in first.items()
             if one.at_most(MUCH if one is ranked[0] else BENT) > bar
             and one.log_posterior > known.get(name, -np.inf) + BETTER]  # fmt: skip
    return sorted(found, key=lambda one: -one.log_posterior)[:MOST]


def _fitted(problem: Problem, hope: Hope) -> Struck:
    """Return a sudden cause fitted by real runs, all else within declared tolerances."""
    place, begun = hope.place, hope.begun
    more, n = with_begun(problem, begun), len(problem.entries)
    start = _begin(problem, more, hope) if hope.start is None else hope.start
    start = np.clip(np.append(start, 0.0), *bounds(more))
    slopes = more.jacobian(start, range(n, start.size))[:, n:]
    D, J = _prior(problem, more, 1.0), np.hstack([place.fit.J[:, :n], slopes])
    fit = gone_on(more, with_own_slopes(more, refit(more, start, J, D, most_fresh=1)))
    under = {kappa: _prior(problem, more, kappa) for kappa in KAPPAS}
    log = laplace(more.entries, fit, under)
    mixed = log_sum([float(np.log(prior)) + log[kappa] for kappa, prior in KAPPAS.items()])
    kappa = max(KAPPAS, key=lambda kappa: np.log(KAPPAS[kappa]) + log[kappa])
    begun = replace(begun, time=round(begun.time + float(fit.z[-1]), 2), mean=fit.z[n:-1], kappa=kappa)
    total = mixed + log_prior((), len(named(problem)))
    return Struck(
        begun=begun, log_posterior=total if np.isfinite(fit.objective) else -np.inf, problem=more, fit=fit
    )


def _begin(problem: Problem, more: Problem, hope: Hope) -> np.ndarray:
    """Return the best deviations in the linear problem of a place with a sudden cause."""
    fit, begun, D = hope.place.fit, hope.begun, _prior(problem, more, 1.0)[:-1]
    (C,) = columns(hope.place.along, [(begun.effect, begun.time)], begun.record)
    n = len(problem.entries)
    J, whole = np.hstack([fit.J[:, :n], C]), fit.r + fit.J @ fit.z
    return posterior(Quadratic(A=J.T @ J, b=J.T @ whole, rr=float(whole @ whole)), D).z


def _prior(problem: Problem, more: Problem, kappa: float) -> np.ndarray:
    """Return the prior variances of a problem's entries and of the sudden cause behind them."""
    own = [entry.parameter.scale**2 for entry in more.entries[len(problem.entries) :]]
    return np.concatenate([variances(problem.entries, (), kappa), own])


def in_its_place(problem: Problem, one: Struck) -> Place:
    """Return the linear problem around a sudden cause's fit, of all but it."""
    n, fit = len(problem.entries), one.fit
    r = fit.r + fit.J[:, n:-1] @ fit.z[n:-1]
    without = replace(fit, z=fit.z[:n], r=r, J=fit.J[:, :n], D=fit.D[:n], made_at=None)
    return Place(fit=without, along=Along(one.problem, fit.z))
