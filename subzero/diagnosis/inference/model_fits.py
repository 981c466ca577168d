"""The pool of fitted hypotheses: each keeps its best fit, and all are updated when the noise or the discretisation
error is known better.

Simulations have non-smooth points, and a fit may end in a local minimum. So hypotheses close to the best are fitted
again with a Jacobian of their own, and rivals from each other's optimum. `Fits.sharpen` estimates the noise again
from the residual of the best fit, and corrects for the discretisation error of economical steps there, where that is
visible.

A noise shared by all hypotheses favours the one from whose residual it was estimated: a slow part of a record is
noise to one explanation, and motion to another. So each has, in the end, the noise θ that is the most probable given
that explanation (`refit_noise`), in the linear problem around its fit, all channels at once:

    max_θ  −½ (rᵀ Σ⁻¹ r − bᵀ P⁻¹ b) − ½ log det (D P) − ½ log det Σ + log p(θ),    A = Jᵀ Σ⁻¹ J,  b = Jᵀ Σ⁻¹ r

one channel after the other: the posterior of the parameters given the other channels, N(m, M), is their prior for
this one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from os import cpu_count
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from subzero.diagnosis.hypothesis.hypotheses import Ids, columns_of, is_flat, variances
from subzero.diagnosis.hypothesis.noise import Noise, SensorPrior, log_prior_of
from subzero.diagnosis.hypothesis.noise_estimate import ResidualNoise, estimate
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.linear_gaussian import KAPPAS, Linear, Quadratic, posterior
from subzero.diagnosis.inference.map_fit import Candidate, Fit, candidate_of, is_poor_fit, refit
from subzero.diagnosis.inference.posing import (
    rewhitened,
    sensor_of,
    whitened_again,
    with_finer_steps,
    with_residual_noise,
)
from subzero.diagnosis.inference.screening import Screening, screening_of

if TYPE_CHECKING:
    from subzero.diagnosis.inference.problem import Observed, Problem, Progress

Asked = TypeVar("Asked")
Made = TypeVar("Made")


@dataclass(kw_only=True, eq=False)
class Fits:
    """The fits of hypotheses, which are improved and extended, in a problem that is refined at the best of them.

    Attributes:
        problem: records and parameters.
        progress: called with the hypothesis that is being fitted.
        wide: the fit with wide tolerances.
        screen: linear evidence at the wide fit.
        candidates: hypothesis → its fit by simulations.
        refined: hypotheses that were fitted with sensitivities of their own.
        side: threads for fits in parallel, whose simulations may use those of the problem.
        behind: hypothesis → log posterior of its fit relative to the best when it was given up.
        economical: the problem before its records were corrected for the error of economical steps.
        sharp_at: the hypothesis at whose fit that was done.
        nominal: residual (m,) and sensitivities (m, k) of the nominal model.
    """

    problem: Problem
    progress: Progress
    wide: Fit = field(init=False)
    screen: Screening = field(default_factory=Screening)
    candidates: dict[Ids, Candidate] = field(default_factory=dict)
    refined: set[Ids] = field(default_factory=set)
    side: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(cpu_count() or 1))
    behind: dict[Ids, float] = field(default_factory=dict)
    economical: Problem = field(init=False)
    sharp_at: Ids | None = None
    nominal: tuple[np.ndarray, np.ndarray] = field(init=False)

    def best(self) -> Candidate:
        """Return the most probable candidate."""
        return max(self.candidates.values(), key=lambda candidate: candidate.log_posterior)

    def _ranked(self) -> list[Ids]:
        """Return the candidates, the most probable first."""
        return sorted(self.candidates, key=lambda ids: -self.candidates[ids].log_posterior)

    def fit(self, ids: Ids, start: Fit | None = None) -> None:
        """Fit a hypothesis as `fit_all` does."""
        self.fit_all([ids], start)

    def fit_all(self, several: Sequence[Ids], start: Fit | None = None, words: str = "") -> None:
        """Fit hypotheses by simulations, in parallel, and keep better fits: with the sensitivities of the wide fit
        those that have no fit yet; or all of them, starting from another fit.
        """
        wanted = [ids for ids in dict.fromkeys(several) if start or ids not in self.candidates]
        for ids, found in zip(
            wanted, self._in_parallel(partial(self._fitted, start=start), wanted), strict=True
        ):
            if words:
                self._report_progress(0.3, words, ids)
            self._take(found)

    def _take(self, found: Candidate) -> None:
        """Keep a candidate if it is better than the known fit of its hypothesis."""
        known = self.candidates.get(found.ids)
        if known is None or found.log_posterior > known.log_posterior:
            self.candidates[found.ids] = found
            self.refined.discard(found.ids)

    def _fitted(self, ids: Ids, start: Fit | None) -> Candidate:
        """Return a hypothesis with its fit, started from another fit or from the wide one."""
        D, z = variances(self.problem.entries, ids, 1.0), None if start else self.screen.starts.get(ids)
        start = start or self.wide
        z = posterior(start.quadratic, D).z if z is None else z
        J = self._with_slopes(start.J, ids)
        return candidate_of(
            self.problem, ids, refit(self.problem, z, J, D, most_fresh=0, made_at=start.made_at)
        )

    def refine(self, most: int | None = None, hopeless: float | None = None) -> None:
        """Fit candidates again with sensitivities of their own, the best first, until the next is hopeless."""
        hopeless = settings.HOPELESS_NATS if hopeless is None else hopeless
        runs = settings.MAX_RUNS_PER_RECORD * len(self.problem.records)
        for _ in range(settings.MAX_RANKED if most is None else most):
            self.refined |= {
                candidate.ids
                for candidate in self.candidates.values()
                if self._settled(candidate.fit, settings.JACOBIAN_HOLDS_TOLERANCES)
            }
            waiting = [
                candidate for candidate in self.candidates.values() if candidate.ids not in self.refined
            ]
            if not waiting:
                return
            now = max(waiting, key=lambda candidate: candidate.optimistic_log_posterior)
            done = [self.candidates[ids].log_posterior for ids in self.refined]
            behind = 0.0 if self.problem.kept.asked > runs else hopeless
            if len(done) >= 2 and now.optimistic_log_posterior < max(done) - behind:
                return
            self._report_progress(0.5, "fitting again", now.ids)
            self._again(now)

    def cross(self) -> None:
        """Fit the close rivals of the best candidate from its optimum, and the best from theirs, and keep better
        fits: where a drum stops or a cable falls slack, simulations have non-smooth points, and a fit may end in a
        local minimum.
        """
        for _ in range(settings.MAX_ADDED):
            best = self.best()
            close = [
                ids
                for ids in self._ranked()[1 : settings.MAX_RANKED]
                if self.candidates[ids].log_posterior > best.log_posterior - settings.HOPELESS_NATS
            ]
            self.fit_all(close, best.fit)
            starts = [self.candidates[ids].fit for ids in close]
            for found in self._in_parallel(partial(self._fitted, best.ids), starts):
                self._take(found)
            if self.best().log_posterior < best.log_posterior + settings.CONVERGED_GAIN_NATS:
                return

    def _again(self, candidate: Candidate) -> None:
        """Fit a candidate with sensitivities of its own, under its most probable κ; again if that κ has changed."""
        self.refined.add(candidate.ids)
        (J, made_at), D = (
            self._slopes_at(candidate.fit),
            variances(self.problem.entries, candidate.ids, candidate.kappa),
        )
        fit = refit(self.problem, candidate.fit.z, J, D, r=candidate.fit.r, most_fresh=1, made_at=made_at)
        now = self._keep(candidate.ids, fit)
        if now.kappa != candidate.kappa:
            D = variances(self.problem.entries, candidate.ids, now.kappa)
            self._keep(
                candidate.ids,
                refit(self.problem, fit.z, fit.J, D, r=fit.r, most_fresh=0, made_at=fit.made_at),
            )

    def _slopes_at(self, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
        """Return sensitivities (m, k) that hold at a fit, and their linearisation point (k,): those of the candidate
        with the closest one; new ones if none is close, or if the fit's own are.
        """
        near = settings.JACOBIAN_HOLDS_TOLERANCES
        if fit.moved(self.problem) > near:
            made = [
                (candidate.fit.J, candidate.fit.made_at)
                for candidate in self.candidates.values()
                if candidate.fit.made_at is not None
            ]
            apart = [replace(fit, made_at=made_at).moved(self.problem) for _, made_at in made]
            if apart and min(apart) < near:
                return made[int(np.argmin(apart))]
        return self.problem.jacobian(fit.z), fit.z

    def _keep(self, ids: Ids, fit: Fit) -> Candidate:
        """Keep a fit and return its candidate."""
        self.candidates[ids] = candidate_of(self.problem, ids, fit)
        return self.candidates[ids]

    def _below(self, ids: Ids, fit: Fit) -> None:
        """Fit a part of a hypothesis, started from the fit of the whole; keep it if it is better than the known fit
        of the part.
        """
        known = self.candidates.get(ids)
        D = variances(self.problem.entries, ids, known.kappa if known else 1.0)
        z = posterior(fit.quadratic, D).z
        found = refit(self.problem, z, fit.J, D, most_fresh=0, made_at=fit.made_at)
        if known is None or found.objective < known.fit.objective - settings.NEGLIGIBLE_GAIN_NATS:
            self._keep(ids, found)
            self.refined.discard(ids)

    def _settled(self, fit: Fit, near: float) -> bool:
        """Say whether a fit has converged close to the linearisation point of its sensitivities, or has not moved
        from it.
        """
        moved = fit.moved(self.problem)
        return moved == 0.0 or (fit.converged and moved < near)

    def _with_slopes(self, J: np.ndarray, ids: Ids) -> np.ndarray:
        """Return sensitivities with secants for the causes of a hypothesis that have no effect when they are
        small.
        """
        J = J.copy()
        for k in columns_of(self.problem.entries, ids):
            if k in self.screen.columns and is_flat(self.problem.entries[k], J[:, k]):
                J[:, k] = self.screen.columns[k]
        return J

    def _in_parallel(self, make: Callable[[Asked], Made], several: Sequence[Asked]) -> Iterator[Made]:
        """Return `make` of each of several, in parallel: the simulations of one fit are sequential."""
        return self.side.map(make, several)

    def _report_progress(self, share: float, words: str, ids: Ids, more: str = "") -> None:
        self.progress(share, f"{words} {' + '.join(ids) or 'nothing wrong'}{more}")

    def sharpen(self) -> None:
        """Estimate the noise from the residual of the best fit, correct for the error of economical steps there, and
        fit all again; do nothing where neither changes visibly.
        """
        best = self.best()
        if self.sharp_at == best.ids:
            return
        self.progress(0.6, "noise behind the best fit, and finer steps")
        self.sharp_at, noise_is_new = best.ids, self._estimate_noise(best)
        sharper = with_finer_steps(self.economical, best.fit.z)
        if noise_is_new or sharper is not None:
            self.problem = sharper or self.economical
            self._give_up(self.candidates[best.ids])
            self._go_on()

    def _estimate_noise(self, best: Candidate) -> bool:
        """Estimate the noise from the residual of the best fit, and whiten all fits with it instead of the old noise;
        say whether it has changed.
        """
        D, fit = variances(self.problem.entries, best.ids, best.kappa), best.fit
        near = fit.moved(self.problem) < settings.JACOBIAN_HOLDS_TOLERANCES
        found = with_residual_noise(
            self.economical, fit.z, D, fit.J if near else self.economical.jacobian(fit.z)
        )
        if found is None:
            return False
        old, again = self.economical, partial(whitened_again, self.economical, found)
        self.candidates = {
            ids: candidate_of(found, ids, rewhitened(candidate.fit, old, found))
            for ids, candidate in self.candidates.items()
        }
        self.wide, self.economical = self._nearer(rewhitened(self.wide, old, found)), found
        self.nominal = again(self.nominal[0]), again(self.nominal[1])
        self.problem = found
        self.screen = screening_of(found, self.wide, self.nominal, far=self.screen.far)
        return True

    def _nearer(self, wide: Fit) -> Fit:
        """Return a wide fit, or the best one where the wide fit is poor and the best has a smaller whitened residual:
        far from the records the linear problem is uninformative about other causes.
        """
        best = self.best().fit
        return best if is_poor_fit(wide) and best.r @ best.r < wide.r @ wide.r else wide

    def _give_up(self, best: Candidate) -> None:
        """Give up candidates with a log posterior HOPELESS_NATS below the best, including the gain that their linear
        problem predicts with the noise as it is now estimated; but no part of the best.
        """
        behind = {
            ids: candidate.optimistic_log_posterior - best.optimistic_log_posterior
            for ids, candidate in self.candidates.items()
        }
        kept = {ids for ids in behind if behind[ids] > -settings.HOPELESS_NATS or set(ids) <= set(best.ids)}
        self.behind |= {ids: log for ids, log in behind.items() if ids not in kept}
        self.candidates = {ids: candidate for ids, candidate in self.candidates.items() if ids in kept}

    def _go_on(self) -> None:
        """Continue the fits of all candidates, with the sensitivities at hand."""
        ids_of = list(self.candidates)
        for ids, fit in zip(ids_of, self._in_parallel(self._going_on, ids_of), strict=True):
            self._keep(ids, fit)
            self.refined -= set() if fit.converged else {ids}
        self.refined &= set(self.candidates)

    def _going_on(self, ids: Ids) -> Fit:
        """Return the fit of a candidate continued, with the sensitivities at hand."""
        fit = self.candidates[ids].fit
        return refit(self.problem, fit.z, fit.J, fit.D, most_fresh=0, made_at=fit.made_at)


def log_density_of_noise(record: Observed, name: str) -> float:
    """Return the part of the log density of a channel's samples that depends on its noise alone: −½ log det Σ + log
    p(θ).
    """
    return log_prior_of(record.noise[name], sensor_of(record, name)) - record.noise[name].log_scale


def gained_by_noise(before: Problem, after: Problem) -> float:
    """Return the change of the log density of all samples with another noise, without that of the residual."""
    return sum(
        log_density_of_noise(new, name) - log_density_of_noise(old, name)
        for old, new in zip(before.records, after.records, strict=True)
        for name in old.noise
    )


class WithRefittedNoise(NamedTuple):
    """A hypothesis with its own noise: the problem with that noise, the hypothesis refitted in it, and the same with
    its fit from before and the new evidence.
    """

    problem: Problem
    again: Candidate
    before: Candidate


def with_refitted_noise(problem: Problem, candidate: Candidate) -> WithRefittedNoise:
    """Return a hypothesis with its most probable noise, with which another κ may be the most probable."""
    fit, found = candidate.fit, list[WithRefittedNoise]()
    for kappa in sorted({candidate.kappa, min(KAPPAS)}):
        D = variances(problem.entries, candidate.ids, kappa)
        more = refit_noise(problem, Linear(fit.r + fit.J @ fit.z, fit.J), D)
        J = whitened_again(problem, more, fit.J)
        new = candidate_of(more, candidate.ids, refit(more, fit.z, J, D, most_fresh=0, made_at=fit.made_at))
        gain = gained_by_noise(problem, more)
        log = {each: value + gain for each, value in new.log_evidence.items()}
        again = replace(new, log_evidence=log, log_posterior=new.log_posterior + gain)
        found.append(WithRefittedNoise(more, again, replace(again, fit=fit)))
    return max(found, key=lambda each: each.again.log_posterior)


def gain_of_refitted_noise(problem: Problem, linear: Linear, D: np.ndarray) -> float:
    """Return the gain in log evidence of the linear problem around an explanation with its most probable noise; D are
    the prior variances of its parameters (k,).
    """
    more = refit_noise(problem, linear, D)
    again = Linear(*(whitened_again(problem, more, candidate) for candidate in linear))
    before, after = (posterior(candidate.quadratic, D).log_evidence for candidate in (linear, again))
    return after - before + gained_by_noise(problem, more)


def refit_noise(problem: Problem, linear: Linear, D: np.ndarray) -> Problem:
    """Return the problem with the most probable noise given an explanation.

    Args:
        problem: with the noise that whitens the linear problem.
        linear: around the fit of the explanation.
        D: prior variances of its parameters (k,).
    """
    new = iter(_with_residual_noise(_channels(problem, linear), D))
    records = [
        replace(
            record,
            noise={name: replace(next(new).noise, used=old.used) for name, old in record.noise.items()},
        )
        for record in problem.records
    ]
    return replace(problem, records=tuple(records))


def log_evidence_of(
    problem: Problem, linear: Linear, D: np.ndarray, kept: Sequence[Mapping[str, np.ndarray]]
) -> float:
    """Return the log evidence of an explanation if only some samples were measured, with the most probable noise
    then.

    Args:
        problem: with the noise that whitens the linear problem.
        linear: around the fit of the explanation.
        D: prior variances of its parameters (k,).
        kept: channel → which of its samples are kept (n,), of every record.
    """
    channels, masks = _channels(problem, linear), []
    for record, some in zip(problem.records, kept, strict=True):
        masks += [some[name][noise.used] for name, noise in record.noise.items()]
    some_of_each = [channel.only(mask) for channel, mask in zip(channels, masks, strict=True)]
    return _log_evidence(_with_residual_noise(some_of_each, D), D)


@dataclass(frozen=True, eq=False)
class _Channel:
    """The linear problem of one channel of a record.

    Attributes:
        usual: the prior of its sensor.
        noise: of its samples.
        whole: residual with all parameters at 0, in the channel's unit (m,).
        J: sensitivities (m, k).
    """

    usual: SensorPrior
    noise: Noise
    whole: np.ndarray
    J: np.ndarray

    @cached_property
    def q(self) -> Quadratic:
        """The linear problem of the channel alone, whitened with its noise."""
        return Linear(self.noise.whiten(self.whole), self.noise.whiten(self.J)).quadratic

    def only(self, kept: np.ndarray) -> _Channel:
        """Return the channel with some of its samples (m,)."""
        noise = replace(
            self.noise, used=np.ones(np.count_nonzero(kept), dtype=bool), time=self.noise.time[kept]
        )
        return replace(self, noise=noise, whole=self.whole[kept], J=self.J[kept])

    def with_noise_given(self, others: Quadratic, D: np.ndarray) -> _Channel:
        """Return the channel with its most probable noise, given the information of other channels on parameters of
        prior variances D (k,).
        """
        half = np.linalg.cholesky(np.diag(1.0 / D) + others.A)
        apart = np.linalg.solve(half, np.column_stack([self.J.T, others.b]))
        slopes, mean = apart[:, :-1].T, np.linalg.solve(half.T, apart[:, -1])
        behind = ResidualNoise(residual=self.whole - self.J @ mean, J=slopes, D=np.ones(D.size))
        found = estimate(self.noise.time, behind, self.usual, self.noise)
        return replace(self, noise=found)


def _with_residual_noise(channels: list[_Channel], D: np.ndarray) -> list[_Channel]:
    """Return channels with their most probable noise, parameters of prior variances D (k,) marginalised."""
    now = _log_evidence(channels, D)
    for _ in range(settings.MAX_TRIED):
        for i, channel in enumerate(channels):
            channels[i] = channel.with_noise_given(_sum(channels[:i] + channels[i + 1 :], D.size), D)
        then = _log_evidence(channels, D)
        if then < now + settings.NEGLIGIBLE_GAIN_NATS:
            break
        now = then
    return channels


def _channels(problem: Problem, linear: Linear) -> list[_Channel]:
    """Return the linear problem of every channel of every record."""
    found, at = list[_Channel](), 0
    for record in problem.records:
        for name, noise in record.noise.items():
            own = slice(at, at + noise.count)
            every = replace(noise, used=np.ones(noise.count, dtype=bool))
            whole, J = (noise.colour(part[own]) for part in linear)
            found.append(_Channel(sensor_of(record, name), every, whole, J))
            at += noise.count
    return found


def _sum(channels: Sequence[_Channel], k: int) -> Quadratic:
    """Return the linear problem of some channels together, of k parameters."""
    A, b = np.zeros((k, k)), np.zeros(k)
    for channel in channels:
        A += channel.q.A
        b += channel.q.b
    return Quadratic(A=A, b=b, rr=sum(each.q.rr for each in channels))


def _log_evidence(channels: Sequence[_Channel], D: np.ndarray) -> float:
    """Return the log evidence of all channels under prior variances D (k,), with the log prior of their noise."""
    fixed = sum(log_prior_of(channel.noise, channel.usual) - channel.noise.log_scale for channel in channels)
    return posterior(_sum(channels, D.size), D).log_evidence + fixed
