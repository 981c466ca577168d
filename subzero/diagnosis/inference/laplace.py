"""The evidence of a hypothesis around its MAP fit, by Laplace's method and mixed over κ; with the noise behind it.

log p(y | κ) = −objective(ẑ) − ½ log det (D P),   P = D⁻¹ + Jᵀ J;      log p(y) = log Σ_κ p(κ) p(y | κ)

A search makes all residuals white by one noise, that behind its best fit. What is slow in a record and is noise to one
explanation is motion to another, so that one noise for all favours what it was found behind. In the end each has the
noise θ that is the most probable beside it, in the linear problem around its fit, all channels at once:

    max_θ  −½ (rᵀ Σ⁻¹ r − bᵀ P⁻¹ b) − ½ log det (D P) − ½ log det Σ + log p(θ),    A = Jᵀ Σ⁻¹ J,  b = Jᵀ Σ⁻¹ r

a channel after the other: what the others say of the parameters, N(m, M), is the prior of those behind this one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import log_ndtr

from subzero.diagnosis.hypothesis.hypotheses import Entry, Ids, log_prior, nameable, variances
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.linear_gaussian import (
    KAPPAS,
    Quadratic,
    Scale,
    Scales,
    log_sum,
    posterior,
)
from subzero.diagnosis.inference.map_fit import Fit, refit
from subzero.diagnosis.inference.noise import (
    Behind,
    Noise,
    Usual,
    estimate,
    log_prior_of,
    usual_of,
)
from subzero.diagnosis.inference.posing import whitened_again

if TYPE_CHECKING:
    from subzero.diagnosis.inference.problem import Observed, Problem


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A hypothesis with a real fit.

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
        """The log posterior that a better fit might have."""
        return self.log_posterior + min(self.fit.predicted_gain, settings.MAX_PREDICTED_GAIN_NATS)

    @property
    def log_mixed(self) -> float:
        """The log evidence, mixed over κ."""
        return log_sum([np.log(prior) + self.log_evidence[kappa] for kappa, prior in KAPPAS.items()])

    def scales(self, problem: Problem) -> Scales:
        """Return what the hypothesis makes of κ: what else there is may be what asked for a wide one."""
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
    return laplace(problem.entries, fit, {kappa: variances(problem.entries, ids, kappa) for kappa in KAPPAS})


def laplace(entries: Sequence[Entry], fit: Fit, under: Mapping[float, np.ndarray]) -> dict[float, float]:
    """Return κ → log evidence under prior variances (k,): that of the linear problem, moved to what the real run leaves
    under the fit's own κ.
    """
    q = fit.quadratic
    found = {kappa: posterior(q, D) for kappa, D in under.items()}
    nearest = min(under, key=lambda kappa: float(np.sum(np.abs(np.log(under[kappa] / fit.D)))))
    here = -fit.objective - found[nearest].log_evidence - 0.5 * found[nearest].log_det
    every = range(len(entries))
    return {
        kappa: one.log_evidence + here + possible(entries, every, one.z, np.sqrt(np.diag(one.M)), held=True)
        for kappa, one in found.items()
    }


def possible(
    entries: Sequence[Entry], at: Sequence[int], mean: np.ndarray, sd: np.ndarray, *, held: bool = False
) -> float:
    """Return what is added to a log evidence because values below a bound at 0 are not possible; `held` if it was
    taken at the best values within bounds.
    """
    bounded = np.array([entries[k].parameter.low == 0.0 for k in at])
    if not bounded.any():
        return 0.0
    x = (mean / sd)[bounded]
    return float(np.sum(log_ndtr(x) + np.log(2.0) + (0.5 * np.minimum(x, 0.0) ** 2 if held else 0.0)))


class Linear(NamedTuple):
    """A linear problem around a fit: what is left if no parameter did anything, r + J z (m,), and J (m, k), both made
    white by the noise of a problem.
    """

    whole: np.ndarray
    J: np.ndarray


def log_density_of_noise(one: Observed) -> float:
    """Return what the noise of a record adds to the log density of its samples: −½ log det Σ + log p(θ)."""
    return sum(log_prior_of(noise, _usual(one, name)) - noise.log_scale for name, noise in one.noise.items())


def _gained(before: Problem, after: Problem) -> float:
    """Return what another noise adds to the log density of all samples, but for their residual."""
    pairs = zip(before.records, after.records, strict=True)
    return sum(log_density_of_noise(new) - log_density_of_noise(old) for old, new in pairs)


def candidate_with_own_noise(problem: Problem, one: Candidate) -> Candidate:
    """Return a hypothesis with the evidence that it has with the noise behind it, which may ask for another κ; its fit
    stays as it is, white by the noise of the problem.
    """
    fit, found = one.fit, list[Candidate]()
    for kappa in sorted({one.kappa, min(KAPPAS)}):
        D = variances(problem.entries, one.ids, kappa)
        more = with_own_noise(problem, Linear(fit.r + fit.J @ fit.z, fit.J), D)
        J = whitened_again(problem, more, fit.J)
        new = candidate_of(more, one.ids, refit(more, fit.z, J, D, most_fresh=0, made_at=fit.made_at))
        gain = _gained(problem, more)
        log = {each: value + gain for each, value in new.log_evidence.items()}
        found.append(replace(one, log_evidence=log, log_posterior=new.log_posterior + gain))
    return max(found, key=lambda each: each.log_posterior)


def gain_of_own_noise(problem: Problem, linear: Linear, D: np.ndarray) -> float:
    """Return what the log evidence of the linear problem around an explanation gains with the noise that is the most
    probable beside it; D are the prior variances of its parameters (k,).
    """
    more = with_own_noise(problem, linear, D)
    again = Linear(*(whitened_again(problem, more, one) for one in linear))
    return _linear_evidence(again, D) + _gained(problem, more) - _linear_evidence(linear, D)


def _linear_evidence(linear: Linear, D: np.ndarray) -> float:
    whole, J = linear
    return posterior(Quadratic(A=J.T @ J, b=J.T @ whole, rr=float(whole @ whole)), D).log_evidence


def with_own_noise(problem: Problem, linear: Linear, D: np.ndarray) -> Problem:
    """Return the problem with the noise that is the most probable one beside an explanation.

    Args:
        problem: with the noise that the linear problem was made white by.
        linear: around the fit of the explanation.
        D: prior variances of its parameters (k,).
    """
    channels = _channels(problem, linear)
    now = _log_evidence(channels, D)
    for _ in range(settings.MAX_TRIED):
        for i, one in enumerate(channels):
            channels[i] = one.with_noise_given(_sum(channels[:i] + channels[i + 1 :], D.size), D)
        then = _log_evidence(channels, D)
        if then < now + settings.NEGLIGIBLE_GAIN_NATS:
            break
        now = then
    new = iter(channels)
    records = [replace(one, noise={name: replace(next(new).noise, used=old.used) for name, old in one.noise.items()})
               for one in problem.records]  # fmt: skip
    return replace(problem, records=tuple(records))


@dataclass(frozen=True, eq=False)
class _Channel:
    """What a linear problem leaves of a channel of a record.

    Attributes:
        usual: what its sensor is like.
        noise: of its samples.
        whole: what is left if no parameter did anything, in the channel's unit (m,).
        J: sensitivities (m, k).
    """

    usual: Usual
    noise: Noise
    whole: np.ndarray
    J: np.ndarray

    @cached_property
    def q(self) -> Quadratic:
        """The linear problem of the channel alone, made white by its noise."""
        white, slopes = self.noise.whiten(self.whole), self.noise.whiten(self.J)
        return Quadratic(A=slopes.T @ slopes, b=slopes.T @ white, rr=float(white @ white))

    def with_noise_given(self, others: Quadratic, D: np.ndarray) -> _Channel:
        """Return the channel with its most probable noise, given what others say of parameters of variances D (k,)."""
        half = np.linalg.cholesky(np.diag(1.0 / D) + others.A)
        apart = np.linalg.solve(half, np.column_stack([self.J.T, others.b]))
        slopes, mean = apart[:, :-1].T, np.linalg.solve(half.T, apart[:, -1])
        behind = Behind(residual=self.whole - self.J @ mean, J=slopes, D=np.ones(D.size))
        found = estimate(self.noise.time, behind, self.usual)
        return replace(self, noise=found)


def _usual(one: Observed, name: str) -> Usual:
    """Return what the sensor of a channel is like, with the resolution that is known by now."""
    return usual_of(name, one.values[name], one.known)._replace(resolution=one.noise[name].resolution)


def _channels(problem: Problem, linear: Linear) -> list[_Channel]:
    """Return what a linear problem leaves of every channel of every record."""
    found, at = list[_Channel](), 0
    for one in problem.records:
        for name, noise in one.noise.items():
            own = slice(at, at + noise.count)
            every = replace(noise, used=np.ones(noise.count, dtype=bool))
            whole, J = (noise.colour(part[own]) for part in linear)
            found.append(_Channel(_usual(one, name), every, whole, J))
            at += noise.count
    return found


def _sum(channels: Sequence[_Channel], k: int) -> Quadratic:
    """Return the linear problem of some channels together, of k parameters."""
    A, b = np.zeros((k, k)), np.zeros(k)
    for one in channels:
        A += one.q.A
        b += one.q.b
    return Quadratic(A=A, b=b, rr=sum(one.q.rr for one in channels))


def _log_evidence(channels: Sequence[_Channel], D: np.ndarray) -> float:
    """Return the log evidence of all channels under prior variances D (k,), and of their noise."""
    fixed = sum(log_prior_of(one.noise, one.usual) - one.noise.log_scale for one in channels)
    return posterior(_sum(channels, D.size), D).log_evidence + fixed
