"""Latent forces and sensor drifts: candidates by linear evidence, histories, and a linearisation at their own fit.

    w ~ Gaussian process(a, T) on one axis;   a and T are those that make the record most probable

`latent_force_candidates` compares axes and channels in the linear problem around a fit. `estimate_force` fits the
history with simulations, all tolerances free, and gives its band. `relinearised_force` computes the evidence again at
that fit: without the force, all tolerances have to deviate from their priors to come close to a record, and a
linearisation there is inaccurate for a model that is as declared but for the force. Not modelled: forces on two axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.diagnosis.hypothesis.hypotheses import Ids, log_prior, nameable, variances
from subzero.diagnosis.inference.change_point_scan import BaseRun, LinearisationPoint
from subzero.diagnosis.inference.latent_force import (
    DRIFT,
    FINE_SPACING_S,
    FORCE,
    MAX_DRIFT_LEVELS,
    Knots,
    drift_columns,
    force_columns,
    history,
    knots_of,
    typical_force,
    with_force,
)
from subzero.diagnosis.inference.linear_gaussian import (
    AMPLITUDE_SHARES,
    CORRELATION_TIMES,
    KAPPAS,
    ForceInformation,
    Linear,
    Posterior,
    ProcessShape,
    Quadratic,
    Scale,
    Scales,
    Terms,
    correlation,
    log_evidence_process,
    log_evidence_term,
    log_gains,
    log_sum,
    mixed,
    modes,
    posterior,
    seen,
)
from subzero.diagnosis.inference.map_fit import Fit, is_poor_fit, possible, refit, with_own_jacobian
from subzero.diagnosis.inference.posing import rewhitened, whitened_again
from subzero.diagnosis.results import Unknown

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.inference.problem import Problem
    from subzero.external_force import MissingForce


@dataclass(frozen=True, kw_only=True, eq=False)
class LatentForceCandidate:
    """A force or a drift in the linear problem.

    Attributes:
        id: "unknown_force:X", "sensor_drift:heading".
        log_gain: log evidence over that of none; amplitudes, correlation times, formulas of one term and κ mixed.
        kappa: the most probable κ.
        fit: the linearisation point.
        columns: sensitivities to the history at its knots (m, n).
        knots: of the history.
        terms: axis → formulas of one term for a force on it, as alternatives to a process.
    """

    id: str
    log_gain: float
    kappa: float
    fit: Fit
    columns: np.ndarray
    knots: Knots
    terms: Mapping[str, Terms]

    def whitened_anew(self, before: Problem, after: Problem) -> LatentForceCandidate:
        """Return the candidate, whitened with the noise of one problem, whitened with that of another."""
        fit, columns = rewhitened(self.fit, before, after), whitened_again(before, after, self.columns)
        return replace(self, fit=fit, columns=columns)

    def log_evidence(self, problem: Problem, causes: Ids) -> float:
        """Return its log evidence in addition to causes, in the linear problem whitened with the noise of a
        problem.
        """
        D = variances(problem.entries, causes, self.kappa)
        data = _seen(self.fit, D, self.columns)
        gain = _log_gain(problem, self.id, data, self.knots, self.terms)
        return posterior(self.fit.quadratic, D).log_evidence + gain

    def linear(self, problem: Problem, causes: Ids) -> tuple[Linear, np.ndarray]:
        """Return its linear problem in addition to causes, with the modes of the most probable history, and the prior
        variances of all parameters (k,).
        """
        D, size = variances(problem.entries, causes, self.kappa), max(_amplitudes(problem, self.id))
        return self._with_modes(_best_modes(_seen(self.fit, D, self.columns), self.knots, size), D)

    def linear_at_most(self, problem: Problem, causes: Ids) -> tuple[Linear, np.ndarray]:
        """Return the same with the modes of the largest and quickest possible history."""
        largest = ProcessShape(max(_amplitudes(problem, self.id)), min(CORRELATION_TIMES))
        L = modes(self.knots.time, self.knots.record, largest)
        return self._with_modes(L, variances(problem.entries, causes, self.kappa))

    def _with_modes(self, L: np.ndarray, D: np.ndarray) -> tuple[Linear, np.ndarray]:
        J = np.hstack([self.fit.J, self.columns @ L])
        return Linear(self.fit.r + self.fit.J @ self.fit.z, J), np.concatenate([D, np.ones(L.shape[1])])


def latent_force_candidates(
    problem: Problem,
    columns: Mapping[str, np.ndarray],
    fit: Fit,
    scales: Scales,
    knots: Knots,
    terms: Mapping[str, Terms] | None = None,
) -> list[LatentForceCandidate]:
    """Return every force and drift of `columns` (id → (m, n)), in the linear problem around a fit, most probable
    first.

    Args:
        problem: of the columns.
        columns: as of `all_columns`.
        fit: the linearisation point, close to that of the columns.
        scales: κ → its log weight and the prior variances of the entries.
        knots: of the columns.
        terms: axis → formulas of one term for a force on it, as alternatives to a process.
    """
    q, whole = fit.quadratic, fit.r + fit.J @ fit.z
    found = []
    for name, C in columns.items():
        gains = {
            kappa: _log_gain(problem, name, seen(q.A, q.b, scale.D, fit.J, C, whole), knots, terms or {})
            for kappa, scale in scales.items()
        }
        gain, kappa = mixed(scales, gains)
        found.append(
            LatentForceCandidate(
                id=name, log_gain=gain, kappa=kappa, fit=fit, columns=C, knots=knots, terms=terms or {}
            )
        )
    return sorted(found, key=lambda each: -each.log_gain)


def _log_gain(
    problem: Problem, name: str, data: ForceInformation, knots: Knots, terms: Mapping[str, Terms]
) -> float:
    """Return the log evidence of a force or a drift over that of none: a process and a formula with equal priors,
    mixed.
    """
    amplitudes, axis = _amplitudes(problem, name), name.partition(":")[2]
    process = log_evidence_process(data, knots.time, knots.record, amplitudes, drift=name.startswith(DRIFT))
    if name.startswith(DRIFT) or axis not in terms:
        return process
    return log_sum([process, log_evidence_term(data, terms[axis], amplitudes)]) - float(np.log(2.0))


def _amplitudes(problem: Problem, name: str) -> list[float]:
    """Return the amplitudes of the mixture for a force or a drift."""
    kind, _, which = name.partition(":")
    if kind + ":" == FORCE:
        return amplitude_grid(problem.records[0].setting, which)
    return [share * MAX_DRIFT_LEVELS * SPECS[which].noise for share in AMPLITUDE_SHARES]


def amplitude_grid(setting: Setting, axis: str) -> list[float]:
    """Return the amplitudes of the mixture. [N, N m]"""
    return [share * typical_force(setting, axis) for share in AMPLITUDE_SHARES]


CORRELATION_TIMES_S = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Correlation times that are tried. [s]"""
AMPLITUDES_TRIED = tuple(0.01 * 1.6**i for i in range(12))
"""Amplitudes that are tried, in units of the axis' usual force."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EstimatedForce:
    """A latent force, fitted.

    Attributes:
        unknown: its history with a band, of the record where it is largest.
        record: the number of that record.
        missing: the same as a part of a model.
        problem: with the force's modes appended to its entries; unchanged for a drift.
        fit: of that problem.
        knots: of the history, all records.
        force: at the knots (n,). [N, N m]
        covariance: of these (n, n).
        columns: sensitivities to the force at the knots, around the fit (m, n).
        data: the information of the data alone on it there.
    """

    unknown: Unknown
    record: int
    missing: MissingForce | None
    problem: Problem
    fit: Fit
    knots: Knots
    force: np.ndarray
    covariance: np.ndarray
    columns: np.ndarray
    data: ForceInformation


def estimate_force(
    problem: Problem,
    fit: Fit,
    axis: str,
    D: np.ndarray | None = None,
    *,
    spacing: float = FINE_SPACING_S,
    most_fresh: int = 2,
) -> EstimatedForce:
    """Return the history of a force on an axis.

    Args:
        problem: records and parameters.
        fit: the start: of "nothing is wrong" within wide tolerances, or of named causes.
        axis: X, Y, Z, K, M or N.
        D: prior variances of the problem's entries (k,); those of the fit if None.
        spacing: of the knots. [s]
        most_fresh: how many times sensitivities may be computed again on the way.
    """
    D = fit.D if D is None else D
    knots = knots_of(problem, spacing)
    C = force_columns(problem, fit.z, (axis,), knots)[axis]
    L = _best_modes(_seen(fit, D, C), knots, typical_force(problem.records[0].setting, axis))
    more = with_force(problem, axis, knots, L, 1.0)
    whole, J = np.concatenate([D, np.ones(L.shape[1])]), np.hstack([fit.J, C @ L])
    start = _linear(fit, J, whole)
    made_at = None if fit.made_at is None else np.concatenate([fit.made_at, np.zeros(L.shape[1])])
    done = with_own_jacobian(more, refit(more, start.z, J, whole, most_fresh=most_fresh, made_at=made_at))
    found = posterior(done.quadratic, whole)
    k = D.size
    force, covariance = L @ done.z[k:], L @ found.M[k:, k:] @ L.T
    at_knots = np.linalg.solve(L.T, done.J[:, k:].T).T
    return _estimated(axis, more, done, D, History(knots, force, covariance, at_knots))


def estimate_drift(
    problem: Problem, fit: Fit, channel: str, scale: float, D: np.ndarray | None = None
) -> EstimatedForce:
    """Return the drift of a channel, in its unit, as the history of an unknown "force"; `scale` is a usual drift."""
    D = fit.D if D is None else D
    knots = knots_of(problem)
    C = drift_columns(problem, channel, knots)
    L = _best_modes(_seen(fit, D, C), knots, scale)
    whole, J = np.concatenate([D, np.ones(L.shape[1])]), np.hstack([fit.J, C @ L])
    found, k = _linear(fit, J, whole), D.size
    force, covariance = L @ found.z[k:], L @ found.M[k:, k:] @ L.T
    return _estimated(channel, problem, fit, D, History(knots, force, covariance, C))


def _seen(fit: Fit, D: np.ndarray, columns: np.ndarray) -> ForceInformation:
    """Return the information of the data on columns around a fit of the entries before them, or of those and the
    columns' modes.
    """
    J, whole = fit.J[:, : D.size], fit.r + fit.J @ fit.z
    return seen(J.T @ J, J.T @ whole, D, J, columns, whole)


def _linear(fit: Fit, J: np.ndarray, D: np.ndarray) -> Posterior:
    """Return the posterior with columns added to a fit's."""
    whole = fit.r + fit.J @ fit.z
    return posterior(Quadratic(A=J.T @ J, b=J.T @ whole, rr=float(whole @ whole)), D)


def _best_modes(data: ForceInformation, knots: Knots, size: float) -> np.ndarray:
    """Return the modes of the process that makes the record most probable."""
    amplitudes = [share * size for share in AMPLITUDES_TRIED]
    table = np.array(
        [log_gains(data, correlation(knots.time, knots.record, T), amplitudes) for T in CORRELATION_TIMES_S]
    )
    i, j = divmod(int(np.argmax(table)), table.shape[1])
    return modes(knots.time, knots.record, ProcessShape(amplitudes[j], CORRELATION_TIMES_S[i]))


class History(NamedTuple):
    """A history at knots: force or drift (n,), its covariance (n, n), and sensitivities to it (m, n)."""

    knots: Knots
    force: np.ndarray
    covariance: np.ndarray
    columns: np.ndarray


def _estimated(axis: str, problem: Problem, fit: Fit, D: np.ndarray, found: History) -> EstimatedForce:
    """Return a force or a drift, reported for the record in which it is largest."""
    knots, force, covariance, columns = found
    size = [float(np.sqrt(np.mean(force[knots.record == i] ** 2))) for i in range(len(problem.records))]
    record = int(np.argmax(size))
    own = knots.record == record
    band = np.sqrt(np.maximum(np.diag(covariance)[own], 0.0))
    unknown = Unknown(axis=axis, time=knots.time[own], force=force[own], band=band)
    missing = None if axis in BY_NAME else history(axis, knots.time[own], force[own])
    return EstimatedForce(
        unknown=unknown,
        record=record,
        missing=missing,
        problem=problem,
        fit=fit,
        knots=knots,
        force=force,
        covariance=covariance,
        columns=columns,
        data=_seen(fit, D, columns),
    )


class RelinearisedForce(NamedTuple):
    """A force or a drift around its own fit.

    Attributes:
        log_posterior: without causes, but for its own prior.
        what: the candidate.
        point: the linear problem there, without it, and the simulation, with it.
        is_poor: it does not explain the records.
    """

    log_posterior: float
    what: LatentForceCandidate
    point: LinearisationPoint
    is_poor: bool


def relinearised_force(
    problem: Problem, start: Fit, name: str, kappa: float, knots: Knots, terms: Mapping[str, Terms]
) -> RelinearisedForce:
    """Return a force or a drift without causes, around its own fit.

    Args:
        problem: records and parameters.
        start: a fit close to the records.
        name: "unknown_force:X", "sensor_drift:heading".
        kappa: how wide the tolerances are in the fit.
        knots: of its history.
        terms: axis → formulas of one term for a force on it.
    """
    D, which = variances(problem.entries, (), kappa), name.partition(":")[2]
    if name.startswith(FORCE):
        found = estimate_force(problem, start, which, D, spacing=knots.spacing, most_fresh=0)
        done = found.fit
    else:
        found = estimate_drift(problem, start, which, MAX_DRIFT_LEVELS * SPECS[which].noise, D)
        knots, done = found.knots, fit_with_drift(problem, found, D)
    fit = _without(found, done, D.size)
    ((log, what),) = linear_candidates(problem, fit, {name: found.columns}, knots, terms, [kappa])
    point = LinearisationPoint(fit=fit, along=BaseRun(found.problem, done.z))
    return RelinearisedForce(log + _possible(problem, done), what, point, is_poor_fit(done))


def linear_candidates(
    problem: Problem,
    fit: Fit,
    columns: Mapping[str, np.ndarray],
    knots: Knots,
    terms: Mapping[str, Terms],
    kappas: Sequence[float],
) -> list[tuple[float, LatentForceCandidate]]:
    """Return the log posteriors of forces without causes in the linear problem around a fit, and the forces.

    A fit is a poor linearisation point for tolerances wider than its own: with those the model would rather deviate
    from its priors.
    """
    D = {kappa: variances(problem.entries, (), kappa) for kappa in kappas}
    log = {
        kappa: float(np.log(KAPPAS[kappa])) + posterior(fit.quadratic, D[kappa]).log_evidence
        for kappa in kappas
    }
    total = log_sum(list(log.values()))
    scales = {kappa: Scale(log[kappa] - total, D[kappa]) for kappa in kappas}
    total += log_prior((), len(nameable(problem.entries)))
    return [
        (total + candidate.log_gain, candidate)
        for candidate in latent_force_candidates(problem, columns, fit, scales, knots, terms)
    ]


def fit_with_drift(problem: Problem, found: EstimatedForce, D: np.ndarray) -> Fit:
    """Return the fit of the records without a drift, under prior variances D (k,)."""
    start, channel, records = found.fit, found.unknown.axis, []
    for i, record in enumerate(problem.records):
        own = found.knots.record == i
        drift = np.interp(record.time, found.knots.time[own], found.force[own])
        records.append(record.corrected({channel: drift}))
    cleared = replace(problem, records=tuple(records))
    J, left = start.J, start.r + start.J @ start.z - found.columns @ found.force
    there = posterior(Quadratic(A=J.T @ J, b=J.T @ left, rr=float(left @ left)), D).z
    done = refit(cleared, there, J, D, most_fresh=1, made_at=start.made_at)
    return with_own_jacobian(cleared, done)


def _without(found: EstimatedForce, done: Fit, count: int) -> Fit:
    """Return the fit of a problem with a force, or with a drift, as a fit of the entries before it: with the residual
    without the force or drift.
    """
    z, D, r = done.z[:count], done.D[:count], done.r + found.columns @ found.force
    objective = 0.5 * float(r @ r) + 0.5 * float(np.sum(z * z / D))
    return Fit(
        z=z,
        r=r,
        J=done.J[:, :count],
        D=D,
        objective=objective,
        converged=done.converged,
        predicted_gain=0.0,
        fresh=done.fresh,
    )


def _possible(problem: Problem, done: Fit) -> float:
    """Return the correction of the log evidence because some values cannot be below 0."""
    count, free = len(problem.entries), posterior(done.quadratic, done.D)
    return possible(problem.entries, range(count), free.z[:count], np.sqrt(np.diag(free.M)[:count]))
