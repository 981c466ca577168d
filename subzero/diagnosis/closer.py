"""How probable a missing force is where it acts: the linear problem around a real fit with it, beside nothing else.

Without the force the model has to bend all its tolerances to come close to a record, and what is linear there says
little of a model that is as declared but for the force. So the force is recovered, and all is asked again around that
fit: of "nothing is wrong", as it would be if everything were linear from there, and of the force beside it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from subzero.diagnosis.candidate import possible
from subzero.diagnosis.evidence import KAPPAS, Scale, log_sum, posterior
from subzero.diagnosis.hypotheses import log_prior, named, variances
from subzero.diagnosis.latent import Terms
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.recover import Recovered, recover
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.unknown import FORCE, Knots, Suspect, suspects


def closer(
    problem: Problem, start: Fit, axis: str, kappa: float, knots: Knots, terms: Mapping[str, Terms]
) -> tuple[float, Suspect]:
    """Return the log posterior of a force beside nothing, but for the prior of forces, and the force.

    Args:
        problem: records and parameters.
        start: a fit close to the records.
        axis: of the force.
        kappa: how wide the tolerances are in the fit.
        knots: of the force.
        terms: axis → what a force on it may look like.
    """
    found = recover(problem, start, axis, variances(problem.entries, (), kappa), spacing=knots.spacing)
    fit = _without(found, len(problem.entries))
    ((log, what),) = linear(problem, fit, {FORCE + axis: found.columns}, knots, terms)
    return log + _possible(problem, found), what


def linear(
    problem: Problem, fit: Fit, columns: Mapping[str, np.ndarray], knots: Knots, terms: Mapping[str, Terms]
) -> list[tuple[float, Suspect]]:
    """Return the log posteriors of forces beside nothing in the linear problem around a fit, and the forces."""
    D = {kappa: variances(problem.entries, (), kappa) for kappa in KAPPAS}
    log = {
        kappa: float(np.log(prior)) + posterior(fit.quadratic, D[kappa]).log_evidence
        for kappa, prior in KAPPAS.items()
    }
    total = log_sum(list(log.values()))
    scales = {kappa: Scale(log[kappa] - total, D[kappa]) for kappa in KAPPAS}
    total += log_prior((), len(named(problem)))
    return [(total + one.log_gain, one) for one in suspects(problem, columns, fit, scales, knots, terms)]


def _without(found: Recovered, count: int) -> Fit:
    """Return the fit of a force as one of the entries before it: with what the records lack without the force."""
    done = found.fit
    z, D, r = done.z[:count], done.D[:count], done.r + found.columns @ found.force
    objective = 0.5 * float(r @ r) + 0.5 * float(np.sum(z * z / D))
    return Fit(z=z, r=r, J=done.J[:, :count], D=D, objective=objective, converged=done.converged, promise=0.0,
               fresh=done.fresh)  # fmt: skip


def _possible(problem: Problem, found: Recovered) -> float:
    """Return what is added to the log evidence because some values cannot be below 0."""
    count, done = len(problem.entries), found.fit
    free = posterior(done.quadratic, done.D)
    return possible(problem.entries, range(count), free.z[:count], np.sqrt(np.diag(free.M)[:count]))
