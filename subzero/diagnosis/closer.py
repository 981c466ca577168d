"""How probable a force or a drift is where it acts: the linear problem around a real fit with it, beside nothing else.

Without it the model has to bend all its tolerances to come close to a record, and what is linear there says little of
a model that is as declared but for the force. So the force, or the drift, is recovered, and all is asked again around
that fit: of "nothing is wrong", as it would be if everything were linear from there, and of the force beside it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.candidate import possible
from subzero.diagnosis.effects.sensors import SPECS
from subzero.diagnosis.evidence import KAPPAS, Quadratic, Scale, log_sum, posterior
from subzero.diagnosis.hypotheses import log_prior, named, variances
from subzero.diagnosis.latent import Terms
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.recover import Recovered, drifted, recover
from subzero.diagnosis.refit import Fit, is_lost, refit, with_own_slopes
from subzero.diagnosis.sudden import Along, Place
from subzero.diagnosis.suspects import Suspect, suspects
from subzero.diagnosis.unknown import DRIFTS, FORCE, Knots


class Close(NamedTuple):
    """A force or a drift around its own fit.

    Attributes:
        log_posterior: of it beside nothing, but for its own prior.
        what: it is.
        place: the linear problem there, without it, and the run, with it.
        is_lost: it does not explain the records.
    """

    log_posterior: float
    what: Suspect
    place: Place
    is_lost: bool


def closer(
    problem: Problem, start: Fit, name: str, kappa: float, knots: Knots, terms: Mapping[str, Terms]
) -> Close:
    """Return a force or a drift beside nothing, around its own fit.

    Args:
        problem: records and parameters.
        start: a fit close to the records.
        name: "unknown_force:X", "sensor_drift:heading".
        kappa: how wide the tolerances are in the fit.
        knots: of its history.
        terms: axis → what a force on it may look like.
    """
    D, which = variances(problem.entries, (), kappa), name.partition(":")[2]
    if name.startswith(FORCE):
        found = recover(problem, start, which, D, spacing=knots.spacing, most_fresh=1)
        done = found.fit
    else:
        found = drifted(problem, start, which, DRIFTS * SPECS[which].noise, D)
        knots, done = found.knots, beside_drift(problem, found, D)
    fit = _without(found, done, D.size)
    ((log, what),) = linear(problem, fit, {name: found.columns}, knots, terms, [kappa])
    place = Place(fit=fit, along=Along(found.problem, done.z))
    return Close(log + _possible(problem, done), what, place, is_lost(done))


def linear(
    problem: Problem,
    fit: Fit,
    columns: Mapping[str, np.ndarray],
    knots: Knots,
    terms: Mapping[str, Terms],
    kappas: Sequence[float],
) -> list[tuple[float, Suspect]]:
    """Return the log posteriors of forces beside nothing in the linear problem around a fit, and the forces.

    A fit says little of tolerances that are wider than its own: with them the model would rather bend.
    """
    D = {kappa: variances(problem.entries, (), kappa) for kappa in kappas}
    log = {
        kappa: float(np.log(KAPPAS[kappa])) + posterior(fit.quadratic, D[kappa]).log_evidence
        for kappa in kappas
    }
    total = log_sum(list(log.values()))
    scales = {kappa: Scale(log[kappa] - total, D[kappa]) for kappa in kappas}
    total += log_prior((), len(named(problem)))
    return [(total + one.log_gain, one) for one in suspects(problem, columns, fit, scales, knots, terms)]


def beside_drift(problem: Problem, found: Recovered, D: np.ndarray) -> Fit:
    """Return the fit of the records without a drift, under prior variances D (k,)."""
    start, channel, records = found.fit, found.unknown.axis, []
    for i, one in enumerate(problem.records):
        own = found.knots.record == i
        drift = np.interp(one.time, found.knots.time[own], found.force[own])
        records.append(replace(one, values={**one.values, channel: one.values[channel] - drift}))
    cleared = replace(problem, records=tuple(records))
    J, left = start.J, start.r + start.J @ start.z - found.columns @ found.force
    there = posterior(Quadratic(A=J.T @ J, b=J.T @ left, rr=float(left @ left)), D).z
    done = refit(cleared, there, J, D, most_fresh=1, made_at=start.made_at)
    return with_own_slopes(cleared, done)


def _without(found: Recovered, done: Fit, count: int) -> Fit:
    """Return a fit with a force or beside a drift as one of the entries before it: with what the records lack then."""
    z, D, r = done.z[:count], done.D[:count], done.r + found.columns @ found.force
    objective = 0.5 * float(r @ r) + 0.5 * float(np.sum(z * z / D))
    return Fit(z=z, r=r, J=done.J[:, :count], D=D, objective=objective, converged=done.converged, promise=0.0,
               fresh=done.fresh)  # fmt: skip


def _possible(problem: Problem, done: Fit) -> float:
    """Return what is added to the log evidence because some values cannot be below 0."""
    count, free = len(problem.entries), posterior(done.quadratic, done.D)
    return possible(problem.entries, range(count), free.z[:count], np.sqrt(np.diag(free.M)[:count]))
