"""How probable a set of errors in the data is, with what explains the records besides, and what its numbers are.

T the corrections, y the record as written:

    log p(y, errors) = log Σ_M p(T y | M) p(M) + Σ log|dT/dy| + Σ log p(error) + log p(noise)

A sample that is lost counts as any other of its channel. But where a rounded channel may be frozen or stand still, what
it repeats is certain in the one case, and in the other an interval each, no density (`repeated_values`).

The scan finds a delay, a rate or a step in the linear problem about the nominal model, with noise as white as sensors
usually have it. Where noise is slow, that prefers a number that makes the noise quick. So the number a has its density
again in the linear problem around the best fit, with the noise behind that, all hypotheses that were fitted together:

    log p(a | y) = log Σ_M p(M) ∫ p(T_a y | z) p(z | M) dz

of the samples that no a that is tried puts outside the trial: so all are judged by the same ones. A parabola through
five of its values has the mean of a and its standard deviation (`numbers_again`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.catalogue.sensors import CLOCK
from subzero.diagnosis.hypothesis.data_error import LEAST, NUMBERED, SHIFTS, DataError, corrected, places
from subzero.diagnosis.hypothesis.hypotheses import log_prior, nameable, variances
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.hypothesis.noise import log_of_outlier, log_of_outliers
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.change_point_fit import FittedChangePoint
from subzero.diagnosis.inference.data_error_saturated_model import LOUD
from subzero.diagnosis.inference.data_error_scan import log_prior as log_prior_of_error
from subzero.diagnosis.inference.latent_force import FORCE
from subzero.diagnosis.inference.linear_gaussian import KAPPAS, Linear, log_sum
from subzero.diagnosis.inference.map_fit import is_poor_fit
from subzero.diagnosis.inference.model_fits import gain_of_refitted_noise, log_density_of_noise
from subzero.diagnosis.inference.posing import posed_again, sensor_of
from subzero.diagnosis.inference.problem import Observed, Problem
from subzero.diagnosis.inference.repeated_values import log_odds_of_frozen, steps_of
from subzero.diagnosis.inference.screening import linear_evidence
from subzero.errors import UserError

if TYPE_CHECKING:
    from subzero.diagnosis.inference.data_error_search import SuspectedError, Suspects
    from subzero.diagnosis.inference.model_search import Search
    from subzero.diagnosis.inference.out_of_catalogue import Findings

    Errors = Sequence[SuspectedError]

ALIKE = 10
"""So many errors of a kind share its probability, about."""
FIRST_SHARE = 0.01
"""Numbers are first tried so far apart, as a share of what the scan has found; then by a standard deviation. [-]"""
APART = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
"""Where a parabola is fitted, in those distances."""
MOST_PARABOLAS, FARTHEST, SETTLED = 5, 4.0, 0.5
"""So many parabolas there are at most; one reaches so many distances; a mean that moves by less than a share of one has
settled. [-]"""
Density = Callable[[Sequence[float]], np.ndarray]
"""Some numbers → their log densities, but for what they have in common; minus infinity where one leaves no record."""
Samples = list[dict[str, np.ndarray]]
"""Record → channel → which samples, as they were written."""


def leaves_only_noise(work: Findings) -> bool:
    """Say whether one explanation leaves nothing but the noise of usual sensors."""
    return _is_quiet(work) and (
        not is_poor_fit(work.search.best().fit) or any(error.point for error in work.out_of_catalogue)
    )


def _is_quiet(work: Findings) -> bool:
    """Say whether the most probable explanation leaves no channel more than the noise of a usual sensor: the noise that
    was estimated behind wide tolerances may be that of a misfit, which something explains by now.
    """
    problem, r = _best_residual(work)
    for i, record in enumerate(problem.records):
        for name, noise in record.noise.items():
            left = min(float(np.sqrt(np.mean(_own(problem, r, i, name) ** 2))), 1.0)
            level = sensor_of(record, name).level
            most = LOUD * float(np.hypot(level, noise.resolution / np.sqrt(12.0)))
            if noise.sd * left >= most:
                return False
    return True


class StillChannel(NamedTuple):
    """A rounded channel of a record that repeats its value to the end (n,), and may be frozen."""

    record: int
    channel: str
    run: np.ndarray

    def log_excess(self, work: Findings) -> float:
        """Return by how much the evidence is too great with its values as densities: what they add to it behind the
        best fit, and the log odds that it is frozen, not standing still, where each value is an interval.
        """
        problem, r = _best_residual(work)
        record, white = problem.records[self.record], _own(problem, r, self.record, self.channel)
        noise, usual = record.noise[self.channel], sensor_of(record, self.channel)
        run = self.run[noise.used]
        if not run.any():
            return 0.0
        before = replace(noise, used=noise.used & ~self.run, time=noise.time[~run])
        added = before.log_scale - noise.log_scale - 0.5 * float(np.sum(white[run] ** 2))
        return added + log_odds_of_frozen(steps_of(noise.time, noise.colour(white), usual), run)


def _best_residual(work: Findings) -> tuple[Problem, np.ndarray]:
    """Return the residual (m,) of the most probable explanation that has a run of its own, and its problem: of a drift
    there is none.
    """
    best = work.search.best()
    least, found = best.log_posterior, (work.problem, best.fit.r)
    for error in work.out_of_catalogue:
        if error.log_posterior > least and isinstance(error.what, FittedChangePoint):
            least, found = error.log_posterior, (error.what.problem, error.what.fit.r)
        elif error.log_posterior > least and error.point and error.id.startswith(FORCE):
            along = error.point.along
            least, found = error.log_posterior, (along.problem, along.problem.residual(along.z))
    return found


def _own(problem: Problem, r: np.ndarray, record: int, channel: str) -> np.ndarray:
    """Return the part of a residual (m,) that is of one channel of one record."""
    at = 0
    for i, each in enumerate(problem.records):
        for name, noise in each.noise.items():
            if (i, name) == (record, channel):
                return r[at : at + noise.count]
            at += noise.count
    raise KeyError(channel)


def still_channels_of(
    whole: Suspects, errors: Sequence[SuspectedError], records: Sequence[Logged]
) -> tuple[StillChannel, ...]:
    """Return the rounded channels that are held to stand still where only some suspected errors are corrected."""
    return tuple(
        StillChannel(error.record, error.error.channels[0], lost_by(error, errors, records))
        for error in whole.errors
        if error.may_stand_still and not any(error is each for each in errors)
    )


def lost_by(error: SuspectedError, errors: Sequence[SuspectedError], records: Sequence[Logged]) -> np.ndarray:
    """Return which samples of its channel (n,) one more error takes from a record."""
    others = tuple(each.error for each in errors if each.record == error.record and each is not error)
    before, after = (
        np.isfinite(corrected(records[error.record], found).record.values[error.error.channels[0]])
        for found in (others, (*others, error.error))
    )
    return before & ~after


@dataclass(frozen=True, kw_only=True, eq=False)
class Explained:
    """Records that are taken to have errors in their data, and what explains them besides.

    Attributes:
        errors: in the data.
        work: what was found in the records without them.
        log_prior: of the errors, and what their corrections stretch.
        lost: channel → samples that are no measurements then, but for those of rounded channels that are frozen.
        standing: rounded channels that are held to stand still.
    """

    errors: tuple[SuspectedError, ...]
    work: Findings
    log_prior: float
    lost: Mapping[str, int]
    standing: tuple[StillChannel, ...] = ()

    def log_evidence(self, per_lost: Mapping[str, float]) -> float:
        """Return the log evidence of the records as they were written; of samples that are lost, each so much as its
        channel is given. That a frozen channel repeats its value is certain; one that stands still has its odds in
        place of a density.
        """
        standing = sum(error.log_excess(self.work) for error in self.standing)
        lost = sum(count * per_lost.get(name, 0.0) for name, count in self.lost.items())
        return log_evidence(self.work) + self.log_prior + lost - standing

    @cached_property
    def means(self) -> dict[str, float]:
        """Channel → the mean log density of a sample: units differ, and so do densities in them."""
        problem, r = _best_residual(self.work)
        samples = samples_of(self.work)
        total = dict.fromkeys(samples, 0.0)
        for i, record in enumerate(problem.records):
            for name in record.noise:
                square = float(np.sum(_own(problem, r, i, name) ** 2))
                total[name] += _fixed(record, name) - 0.5 * square
        return {name: total[name] / count for name, count in samples.items() if count}

    def is_less_probable(self, other: Explained) -> bool:
        """Say whether no more causes, nor better fits, bring it close to another that leaves only noise."""
        if other is self or not leaves_only_noise(other.work):
            return False
        per_lost, behind = least_means([self, other]), settings.DECISIVE_NATS
        return self.log_evidence(per_lost) + self._to_be_gained() < other.log_evidence(per_lost) - behind

    def _to_be_gained(self) -> float:
        """Return what better fits promise; while only the wide one was made, what any may promise."""
        if not self.work.search.screen.log_posterior:
            return settings.MAX_PREDICTED_GAIN_NATS
        fits = self.work.search.candidates.values()
        return max(fit.optimistic_log_posterior for fit in fits) - max(fit.log_posterior for fit in fits)


def least_means(several: Sequence[Explained]) -> dict[str, float]:
    """Return channel → the least of the mean log densities of a sample."""
    means = [error.means for error in several]
    return {name: min(mean[name] for mean in means if name in mean) for name in set().union(*means)}


def without(records: Sequence[Logged], errors: Errors) -> list[Logged]:
    """Return records without errors in them."""
    return [
        corrected(logged, tuple(error.error for error in errors if error.record == i))
        for i, logged in enumerate(records)
    ]


def places_of(logged: Logged, errors: Errors, record: int) -> dict[str, np.ndarray]:
    """Return channel → which of the samples that were written stands where when clocks are put right (n,); NaN where
    none does.
    """
    return places(
        logged, [error.error for error in errors if error.record == record and error.error.kind in SHIFTS]
    )


def measured_by(logged: Logged, error: DataError) -> int:
    """Return how many samples of an error's channels were measured."""
    return sum(
        int(np.isfinite(logged.record.values[name]).sum())
        for name in error.channels
        if name in logged.record.values
    )


def log_evidence(work: Findings) -> float:
    """Return the log evidence of records, all explanations together, as a density of what was measured."""
    inside = work.search.beliefs.log_total()
    found = log_sum([inside, *(error.log_posterior for error in work.out_of_catalogue)])
    return found + sum(_fixed(record, name) for record in work.problem.records for name in record.noise)


def samples_of(work: Findings) -> Counter[str]:
    """Return how many samples of each channel were measured."""
    samples = Counter[str]()
    for record in work.problem.records:
        samples.update({name: int(np.isfinite(record.values[name]).sum()) for name in record.noise})
    return samples


def _fixed(record: Observed, name: str) -> float:
    """Return what the noise of a channel adds to its log density: −½ log det Σ, what outliers cost, and its prior."""
    return log_of_outliers(*_outliers(record, name)) + log_density_of_noise(record, name)


def log_outlier(record: Observed, name: str) -> float:
    """Return the log density of a further outlier of a channel."""
    return log_of_outlier(*_outliers(record, name))


def _outliers(record: Observed, name: str) -> tuple[int, int, float]:
    """Return how many samples of a channel are outliers, how many were measured, and the usual level of its sensor."""
    measured = int(np.isfinite(record.values[name]).sum())
    return measured - record.noise[name].count, measured, sensor_of(record, name).level


class Numbers(NamedTuple):
    """Errors with their numbers found anew; by how much the records are more probable so [nat]; those of them that
    explain nothing, by the same samples and what is known beforehand; and whether the numbers can be told: they are
    those beside hypotheses, and something outside the catalogue may explain the records better.
    """

    errors: tuple[SuspectedError, ...]
    gain: float = 0.0
    needless: tuple[SuspectedError, ...] = ()
    may_be_told: bool = True


def numbers_again(explanation: Explained, records: Sequence[Logged]) -> Numbers:
    """Return the errors of an explanation with their numbers, found anew one after the other, and the gain.

    Args:
        explanation: errors, and what explains the records without them.
        records: as they were written.
    """
    needless: list[SuspectedError] = []
    errors, gain = list(explanation.errors), 0.0
    outside = max((each.log_posterior for each in explanation.work.out_of_catalogue), default=-np.inf)
    may_be_told = outside <= explanation.work.search.best().log_posterior
    samples = _known(explanation.work.search, records, explanation.errors)
    for i, each in enumerate(explanation.errors):
        if each.error.kind in NUMBERED and not each.is_read_off:
            logs_of, begin = _density(explanation.work.search, samples, records, errors, i)
            number = each.error.amount
            found = peak(logs_of, number, begin, FIRST_SHARE * abs(number))
            if found is not None and abs(found.mean) >= LEAST.get(each.error.kind, 0.0):
                errors[i] = _with_number(each, found.mean, found.sd)
                gain, number = gain + found.gain, found.mean
            there, without_it = logs_of([number, 0.0])
            if may_be_told and there - without_it + log_prior_of_error(each.error, 1) < 0.0:
                needless.append(each)
    return Numbers(tuple(errors), gain, tuple(needless), may_be_told)


def _density(
    search: Search, samples: Samples, records: Sequence[Logged], errors: Errors, i: int
) -> tuple[Density, float]:
    """Return the log density of the number of one of some errors, and where to look for its peak: what the fit has the
    clock late besides is part of a late clock.
    """
    amount, z = errors[i].error.amount, search.best().fit.z.copy()
    late = [k for k, entry in enumerate(search.problem.entries) if entry.effect.id == CLOCK.id]
    more = float(z[late].sum()) if errors[i].error.kind == "late_clock" else 0.0
    z[late] -= more

    def logs_of(amounts: Sequence[float]) -> np.ndarray:
        each = [[*errors[:i], _with_number(errors[i], amount), *errors[i + 1 :]] for amount in amounts]
        try:
            kept = _inside_of_all(samples, records, each)
            return np.array([_log_density(search, z, records, some, kept) for some in each])
        except UserError:  # a number leaves no record
            return np.full(len(each), -np.inf)

    return logs_of, amount + more


def _with_number(error: SuspectedError, amount: float, sd: float = 0.0) -> SuspectedError:
    return replace(error, error=replace(error.error, amount=float(amount), amount_sd=float(sd)))


class Peak(NamedTuple):
    """Mean and standard deviation of a number, and by how much its log density is greater there than at first."""

    mean: float
    sd: float
    gain: float


def peak(logs_of: Density, known: float, first: float, apart: float) -> Peak | None:
    """Return where a log density is greatest, by parabolas; None if there is no peak near by.

    Args:
        logs_of: the density.
        known: the number so far, which the gain is over.
        first: where to begin.
        apart: how far apart numbers are tried at first.
    """
    at = first
    for _ in range(MOST_PARABOLAS):
        logs = logs_of((at + apart * APART).tolist())
        if not np.isfinite(logs).all():
            return None
        c, b, _ = np.polyfit(APART, logs, 2)
        sd = apart / np.sqrt(-2.0 * c) if c < 0.0 else np.inf
        move = float(np.clip(-b / (2.0 * c) if c < 0.0 else FARTHEST * np.sign(b), -FARTHEST, FARTHEST))
        at += apart * move
        if abs(move) * apart < SETTLED * sd < SETTLED * FARTHEST * apart:
            then, before = logs_of([at, known])
            return Peak(at, float(sd), float(then - before))
        apart = float(np.clip(sd, apart / FARTHEST, apart * FARTHEST))
    return None


def _known(search: Search, records: Sequence[Logged], errors: Errors) -> Samples:
    """Return the samples that the fits without errors are made to: no outliers."""
    found = Samples()
    for i, (logged, record) in enumerate(zip(records, search.problem.records, strict=True)):
        where = places_of(logged, errors, i)
        found.append({name: where[name][noise.used] for name, noise in record.noise.items()})
    return found


def _inside_of_all(known: Samples, records: Sequence[Logged], several: Sequence[Errors]) -> Samples:
    """Return those of known samples that none of several sets of errors puts outside the trial."""
    found = [dict(error) for error in known]
    for errors in several:
        for i, logged in enumerate(records):
            where = places_of(logged, errors, i)
            found[i] = {name: np.intersect1d(some, where[name]) for name, some in found[i].items()}
    return found


def _log_density(
    search: Search, z: np.ndarray, records: Sequence[Logged], errors: Errors, kept: Samples
) -> float:
    """Return the log density of some samples of records in the linear problem around z (k,), but for what does not
    depend on the numbers of errors: all hypotheses that were fitted together, as a cause may do what a number does, and
    is none where the number is right; with the noise that is the most probable beside the best of them.
    """
    problem = _posed_like(search, records, errors, kept)
    J, count = problem.jacobian(z), len(nameable(problem.entries))
    linear = Linear(problem.residual(z) + J @ z, J)
    each = [(ids, kappa) for ids in search.candidates for kappa in KAPPAS]
    q = linear.quadratic
    logs = [
        log_prior(ids, count) + np.log(KAPPAS[kappa]) + linear_evidence(problem, q, ids, kappa)
        for ids, kappa in each
    ]
    best = variances(problem.entries, *each[int(np.argmax(logs))])
    found = log_sum(logs) + gain_of_refitted_noise(problem, linear, best)
    return found + sum(
        log_density_of_noise(record, name) for record in problem.records for name in record.noise
    )


def _posed_like(search: Search, records: Sequence[Logged], errors: Errors, kept: Samples) -> Problem:
    """Return the problem of some samples of records without errors, with the noise behind the best fit."""
    new = posed_again(search.problem, without(records, errors))
    pairs = enumerate(zip(search.problem.records, new.records, strict=True))
    made = [_similar(old, seen, kept[i], places_of(records[i], errors, i)) for i, (old, seen) in pairs]
    return replace(new, records=tuple(made))


def _similar(
    old: Observed, new: Observed, kept: Mapping[str, np.ndarray], where: Mapping[str, np.ndarray]
) -> Observed:
    """Return a record with the noise of another, and with what is known of the error of its steps; only with some of
    the samples that were written, which stand somewhere in it (n,).
    """
    noise = {}
    for name, each in old.noise.items():
        used = np.isin(where[name], kept[name])
        noise[name] = replace(each, used=used, time=new.time[used])
    steps = {name: np.interp(new.time, old.time, column) for name, column in old.correction.items()}
    return replace(new, noise=noise, correction=steps, noise_times=old.noise_times)
