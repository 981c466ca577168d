"""The MAP fit of a hypothesis with real simulations, by bounded, damped Gauss-Newton with Broyden updates; and its
evidence, by Laplace's method, mixed over κ.

    objective = ½ |r(z)|² + ½ zᵀ D⁻¹ z,   low ≤ z ≤ high
    log p(y | κ) = −objective(ẑ) − ½ log det (D P),   P = D⁻¹ + Jᵀ J;      log p(y) = log Σ_κ p(κ) p(y | κ)

A step is the optimum of the linear model within bounds, or the part of it that gains; `broyden_update` updates J
after it.

Where a drum stops, a cable falls slack or a gear has play, simulations have non-smooth points, and a fit may end in a
local minimum beyond one. `restarted_where_smooth` fits once more from values of the one-sided parameters that most
vehicles have, but for those of named causes. `fit_wide` (`screening`) is the fit with κ = 4, close to the records
whatever is wrong; the noise is estimated from its residual.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import log_ndtr

from subzero.diagnosis.hypothesis.hypotheses import (
    PRACTICAL_TOLERANCES,
    Entry,
    Ids,
    columns_of,
    log_prior,
    nameable,
    variances,
)
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.linear_gaussian import (
    KAPPAS,
    Posterior,
    Quadratic,
    Scale,
    Scales,
    log_beyond,
    log_sum,
    posterior,
)

if TYPE_CHECKING:
    from subzero.diagnosis.inference.problem import Problem

POOR_FIT_SIGMAS = 2.0
"""A fit is poor if its sum of squares is this many standard deviations above that of noise."""


class Step(NamedTuple):
    """A step: the largest gain that the linear model predicted; the gain that it predicted for the last step tried;
    the share of that which was achieved; the new point, with its residual and objective.
    """

    predicted: float
    left: float
    share: float
    z: np.ndarray
    r: np.ndarray
    now: float


def damped_step(
    problem: Problem, z: np.ndarray, r: np.ndarray, now: float, J: np.ndarray, D: np.ndarray
) -> Step:
    """Return the optimal step of the linear model within bounds; if that gains nothing, the one with the non-smooth
    entries held; none where no more than settings.NEGLIGIBLE_GAIN_NATS is predicted.
    """
    low, high = bounds(problem)
    predicted = 0.0
    for bound in ((low, high), _held(z, low, high)):
        step = bounded_step(J, r, z, D, *bound)
        left = now - objective(r - J @ step, z + step, D)
        predicted = max(predicted, left)
        if left < settings.NEGLIGIBLE_GAIN_NATS:
            break
        share, there, r_there, then = _walk(problem, z, r, now, step, left, D)
        if share > 0.0:
            return Step(predicted, left, share, there, r_there, then)
    return Step(predicted, left, 0.0, z, r, now)


def _held(z: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds that hold all one-sided entries at their present values: where a drum stops, a cable falls slack
    or a gear has play, simulations have non-smooth points, and a step across one spoils the gain of the other
    entries.
    """
    one_sided = low == 0.0
    return np.where(one_sided, z, low), np.where(one_sided, z, high)


def broyden_update(J: np.ndarray, step: np.ndarray, change: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Return sensitivities that explain the change of the residual along a step, and are otherwise unchanged (Broyden
    1965), with steps measured in prior deviations: J + (−Δr − J s) (D⁻¹s)ᵀ/(sᵀD⁻¹s).
    """
    weighted = step / D
    return J + np.outer(-change - J @ step, weighted / (step @ weighted))


def _walk(
    problem: Problem,
    z: np.ndarray,
    r: np.ndarray,
    now: float,
    step: np.ndarray,
    predicted: float,
    D: np.ndarray,
) -> tuple[float, np.ndarray, np.ndarray, float]:
    """Return the share of the predicted gain that a step, or a part of it, achieves; and the new point."""
    for part in (1.0, 0.4, 0.1):
        there = z + part * step
        r_there = problem.residual(there)
        then = objective(r_there, there, D)
        if then < now:
            return (now - then) / predicted, there, r_there, then
    return 0.0, z, r, now


def objective(r: np.ndarray, z: np.ndarray, D: np.ndarray) -> float:
    """Return ½|r|² + ½ zᵀD⁻¹z, infinite for a simulation that failed."""
    value = 0.5 * float(r @ r) + 0.5 * float(np.sum(z * z / D))
    return value if np.isfinite(value) else np.inf


def bounds(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest deviations (k,) each."""
    pairs = [(entry.parameter.low, entry.parameter.high) for entry in problem.entries]
    low, high = np.array(pairs).T
    return low, high


def bounded_step(
    J: np.ndarray, r: np.ndarray, z: np.ndarray, D: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the optimal step of the linear model within bounds (active set): entries that would leave are held at
    their bound, and released when their gradient points inwards.
    """
    P, g = J.T @ J + np.diag(1.0 / D), J.T @ r - z / D
    return quadratic_step(P, g, low - z, high - z)


def quadratic_step(P: np.ndarray, g: np.ndarray, least: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Return argmin ½ xᵀPx − gᵀx with least ≤ x ≤ most, by holding entries at bounds and releasing them
    (active set).
    """
    x, held = np.zeros_like(g), np.zeros(g.size, dtype=bool)
    for _ in range(20):
        free = ~held
        right = g[free] - P[np.ix_(free, held)] @ x[held]
        x[free] = np.linalg.solve(P[np.ix_(free, free)], right)
        out = free & ((x < least - 1e-12) | (x > most + 1e-12))
        slope = g - P @ x
        back = held & (((x <= least) & (slope > 1e-9)) | ((x >= most) & (slope < -1e-9)))
        if not out.any() and not back.any():
            break
        x = np.clip(x, least, most)
        held = (held | out) & ~back
    return np.clip(x, least, most)


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """The most probable parameters of a hypothesis.

    Attributes:
        z: deviations (k,).
        r: whitened residual at z (m,).
        J: sensitivities at z, or close by (m, k).
        D: prior variances (k,).
        objective: ½|r|² + ½ zᵀD⁻¹z.
        converged: no step would gain more.
        predicted_gain: of a further step by the linear model; unreliable with old sensitivities.
        fresh: how many times sensitivities were computed.
        made_at: linearisation point of the sensitivities, if that is known (k,).
    """

    z: np.ndarray
    r: np.ndarray
    J: np.ndarray
    D: np.ndarray
    objective: float
    converged: bool
    predicted_gain: float
    fresh: int
    made_at: np.ndarray | None = None

    @property
    def quadratic(self) -> Quadratic:
        """The linear problem around the fit."""
        return Quadratic.at(self.z, self.r, self.J)

    def moved(self, problem: Problem) -> float:
        """Return the distance from the linearisation point of its sensitivities, in tolerances; infinite if that is
        not known.
        """
        if self.made_at is None:
            return np.inf
        tolerance = np.array([entry.parameter.tolerance for entry in problem.entries])
        return float(np.max(np.abs(self.z - self.made_at) / tolerance))


def is_poor_fit(fit: Fit) -> bool:
    """Say whether a fit leaves more than noise."""
    count = fit.r.size
    return bool(fit.r @ fit.r > count + POOR_FIT_SIGMAS * np.sqrt(2.0 * count))


def with_own_jacobian(problem: Problem, fit: Fit) -> Fit:
    """Return a fit repeated with sensitivities of its own, if it has moved from the linearisation point of its
    sensitivities.
    """
    if fit.moved(problem) < settings.OWN_JACOBIAN_TOLERANCES:
        return fit
    return refit(problem, fit.z, problem.jacobian(fit.z), fit.D, r=fit.r, most_fresh=0, made_at=fit.z)


def continued(problem: Problem, fit: Fit) -> Fit:
    """Return a fit continued, with sensitivities of its own, while a large gain is predicted and some of it
    achieved.
    """
    for _ in range(settings.MAX_TRIED):
        if fit.predicted_gain < settings.DECISIVE_NATS:
            break
        before, J = fit, problem.jacobian(fit.z)
        fit = refit(problem, fit.z, J, fit.D, r=fit.r, most_fresh=2, made_at=fit.z)
        if fit.objective > before.objective - settings.CLOSE_NATS:
            break
    return fit


def refit(
    problem: Problem,
    z: np.ndarray,
    J: np.ndarray,
    D: np.ndarray,
    *,
    r: np.ndarray | None = None,
    most_fresh: int = 1,
    made_at: np.ndarray | None = None,
) -> Fit:
    """Return the best fit under prior variances D, from z and sensitivities J close by.

    Args:
        problem: records and parameters.
        z: the start (k,).
        J: sensitivities at the start (m, k).
        D: prior variances (k,).
        r: the residual at z, if it is known.
        most_fresh: how many times sensitivities may be computed again.
        made_at: linearisation point of J (k,).
    """
    z, r = runnable(problem, np.clip(z, *bounds(problem)), r)
    now, fresh, converged, left = objective(r, z, D), 0, False, 0.0
    for _ in range(settings.MAX_STEPS):
        step = damped_step(problem, z, r, now, J, D)
        if step.share > 0.0:
            J = broyden_update(J, step.z - z, step.r - r, D)
        z, r, now, left = step.z, step.r, step.now, step.left
        if (
            step.share < settings.STALE_GAIN_SHARE
            and step.predicted > settings.CONVERGED_GAIN_NATS
            and fresh < most_fresh
        ):
            J, fresh, made_at = problem.jacobian(z), fresh + 1, z.copy()
        elif step.share <= 0.0:
            converged = left < settings.CONVERGED_GAIN_NATS
            break
    return Fit(
        z=z,
        r=r,
        J=J,
        D=D,
        objective=now,
        converged=converged,
        predicted_gain=0.0 if converged else left,
        fresh=fresh,
        made_at=made_at,
    )


def runnable(problem: Problem, z: np.ndarray, r: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return z, or a point nearer to the nominal model if the simulation at z fails, and the residual there."""
    r = problem.residual(z) if r is None else r
    for share in (0.5, 0.2, 0.0):
        if np.isfinite(r).all():
            break
        z = share * z
        r = problem.residual(z)
    return z, r


def non_smooth(problem: Problem, but: Ids) -> list[int]:
    """Return the entries of one-sided causes, except those of sensors and of the causes `but`: drums stop, cables
    fall slack, gears have play.
    """
    return [
        k
        for k, entry in enumerate(problem.entries)
        if entry.record < 0
        and entry.parameter.low == 0.0
        and entry.effect.slot != "sensors"
        and entry.effect.id not in but
    ]


def at_bad_minimum(problem: Problem, fit: Fit, ids: Ids) -> bool:
    """Say whether the fit of a hypothesis moves non-smooth parameters of no named cause by more than
    STRAYED_TOLERANCES.
    """
    at = non_smooth(problem, ids)
    tolerance = np.array([problem.entries[k].parameter.tolerance for k in at])
    return bool(np.any(np.abs(fit.z[at]) > settings.STRAYED_TOLERANCES * tolerance))


def restarted_where_smooth(problem: Problem, fit: Fit, ids: Ids, D: np.ndarray | None = None) -> Fit:
    """Return the fit of a hypothesis, started with non-smooth parameters at RESTART_TOLERANCES and the optimum of all
    others given these.

    Args:
        problem: records and parameters.
        fit: of the hypothesis.
        ids: its causes, which may be as large as they are.
        D: prior variances (k,); those of the fit if None.
    """
    at, D = non_smooth(problem, ids), fit.D if D is None else D
    low, high = bounds(problem)
    low[at] = high[at] = [settings.RESTART_TOLERANCES * problem.entries[k].parameter.tolerance for k in at]
    z = fit.z + bounded_step(fit.J, fit.r, fit.z, D, low, high)
    return refit(problem, z, _with_slopes_at_restart(problem, fit, z, at), D, most_fresh=1)


def _with_slopes_at_restart(problem: Problem, fit: Fit, z: np.ndarray, at: list[int]) -> np.ndarray:
    """Return the sensitivities (m, k) of a fit with new ones at z to the non-smooth entries, if z is close to the
    linearisation point of the others; else all of them at z.
    """
    if fit.moved(problem) > settings.JACOBIAN_HOLDS_TOLERANCES:
        return problem.jacobian(z)
    J = fit.J.copy()
    J[:, at] = problem.jacobian(z, at)[:, at]
    return J


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A hypothesis with a fit by simulations.

    Attributes:
        ids: its causes.
        fit: the best fit, under the most probable κ.
        log_evidence: κ → log evidence.
        log_posterior: log (evidence, mixed over κ, times prior).
    """

    ids: Ids
    fit: Fit
    log_evidence: dict[float, float]
    log_posterior: float

    @property
    def optimistic_log_posterior(self) -> float:
        """The log posterior with the predicted gain of a further step."""
        return self.log_posterior + min(self.fit.predicted_gain, settings.MAX_PREDICTED_GAIN_NATS)

    @property
    def log_mixed(self) -> float:
        """The log evidence, mixed over κ."""
        return log_sum([np.log(prior) + self.log_evidence[kappa] for kappa, prior in KAPPAS.items()])

    def scales(self, problem: Problem) -> Scales:
        """Return κ with its probability given the hypothesis and its prior variances: an explanation that is added
        may make a wide κ needless.
        """
        return {
            kappa: Scale(
                float(np.log(prior)) + self.log_evidence[kappa] - self.log_mixed,
                variances(problem.entries, self.ids, kappa),
            )
            for kappa, prior in KAPPAS.items()
        }

    @property
    def kappa(self) -> float:
        """The most probable scale of the tolerances."""
        return max(KAPPAS, key=lambda kappa: np.log(KAPPAS[kappa]) + self.log_evidence[kappa])


def candidate_of(problem: Problem, ids: Ids, fit: Fit) -> Candidate:
    """Return a hypothesis with its fit, and its evidence for every κ."""
    evidence = _evidence(problem, ids, fit)
    mixed = log_sum([np.log(KAPPAS[kappa]) + evidence[kappa] for kappa in KAPPAS])
    whole = mixed + log_prior(ids, len(nameable(problem.entries)))
    return Candidate(
        ids=ids,
        fit=fit,
        log_evidence=evidence,
        log_posterior=whole if np.isfinite(fit.objective) else -np.inf,
    )


def _evidence(problem: Problem, ids: Ids, fit: Fit) -> dict[float, float]:
    """Return κ → log evidence of a hypothesis."""
    under = {kappa: variances(problem.entries, ids, kappa) for kappa in KAPPAS}
    causes = [columns_of(problem.entries, (cause_id,)) for cause_id in ids]
    return laplace(problem.entries, fit, under, causes, PRACTICAL_TOLERANCES)


def laplace(
    entries: Sequence[Entry],
    fit: Fit,
    under: Mapping[float, np.ndarray],
    causes: Sequence[Sequence[int]],
    practical: float,
) -> dict[float, float]:
    """Return κ → log evidence under prior variances (k,): that of the linear problem, shifted so that under the fit's
    own κ it agrees with the residual of the simulation.

    Args:
        entries: of z.
        fit: the best one.
        under: κ → prior variances.
        causes: places of the parameters of each cause.
        practical: least size of a cause. [κτ]
    """
    q = fit.quadratic
    found = {kappa: posterior(q, D) for kappa, D in under.items()}
    nearest = min(under, key=lambda kappa: float(np.sum(np.abs(np.log(under[kappa] / fit.D)))))
    here = -fit.objective - found[nearest].log_evidence - 0.5 * found[nearest].log_det
    every = range(len(entries))
    return {
        kappa: each.log_evidence
        + here
        + possible(entries, every, each.z, np.sqrt(np.diag(each.M)), held=True)
        + of_sizes(entries, each, under[kappa], causes, practical * kappa)
        for kappa, each in found.items()
    }


def of_sizes(
    entries: Sequence[Entry],
    said: Posterior,
    D: np.ndarray,
    causes: Sequence[Sequence[int]],
    practical: float,
) -> float:
    """Return the correction of a log evidence because deviations within calibration are no cause (`log_beyond`).

    Args:
        entries: of z.
        said: their posterior under normal priors.
        D: the variances of these priors (k,).
        causes: places of the parameters of each cause.
        practical: least size of a cause. [τ]
    """
    at = [k for own in causes for k in own]
    within = np.array([(practical * entries[k].parameter.tolerance) ** 2 for k in at])
    mean = np.maximum(said.z[at], [-np.inf if entries[k].parameter.low < 0.0 else 0.0 for k in at])
    return float(log_beyond(mean, np.diag(said.M)[at], D[at], within, [len(own) for own in causes]))


def possible(
    entries: Sequence[Entry], at: Sequence[int], mean: np.ndarray, sd: np.ndarray, *, held: bool = False
) -> float:
    """Return the correction of a log evidence because values below a bound at 0 are not possible; `held` if the
    evidence was computed at the optimum within bounds.
    """
    bounded = np.array([entries[k].parameter.low == 0.0 for k in at])
    if not bounded.any():
        return 0.0
    x = (mean / sd)[bounded]
    return float(np.sum(log_ndtr(x) + np.log(2.0) + (0.5 * np.minimum(x, 0.0) ** 2 if held else 0.0)))
