"""The log evidence of a set of data errors with an explanation of the corrected records, and estimates of its
numbers.

T the corrections, y the record as written:

    log p(y, errors) = log Σ_M p(T y | M) p(M) + Σ log|dT/dy| + Σ log p(error) + log p(noise)

A lost sample counts as an average one of its channel. But where a rounded channel may be frozen or stand still, its
repeated values are certain in the one case, and have the probability of an interval each, not a density, in the other
(`repeated_values`).

The scan finds a delay, a rate or a step in the linear problem about the nominal model, with the usual, nearly white
noise of sensors. Where the noise is correlated, that favours a number which makes the residual less correlated. So
the density of the number a is evaluated again in the linear problem around the best fit, with the noise estimated
there, summed over all fitted hypotheses:

    log p(a | y) = log Σ_M p(M) ∫ p(T_a y | z) p(z | M) dz

over the samples that none of the tried a puts outside the trial, so that all are judged by the same samples. A
parabola through five values of it gives the mean of a and its standard deviation (`numbers_again`).
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
"""Approximate number of errors that share the probability of a kind."""
FIRST_SHARE = 0.01
"""First distance between numbers that are tried, as a share of the number from the scan; later it is a standard
deviation. [-]
"""
APART = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
"""Points of a parabola, in those distances."""
MOST_PARABOLAS, FARTHEST, SETTLED = 5, 4.0, 0.5
"""Most parabolas; the farthest that the mean may move, in distances; the share of a distance below which it has
converged. [-]
"""
Density = Callable[[Sequence[float]], np.ndarray]
"""Some numbers → their log densities, up to a common constant; minus infinity where a number leaves no record."""
Samples = list[dict[str, np.ndarray]]
"""Record → channel → which samples, as they were written."""


def leaves_only_noise(work: Findings) -> bool:
    """Say whether some explanation leaves only the noise of usual sensors."""
    return _is_quiet(work) and (
        not is_poor_fit(work.search.best().fit) or any(error.point for error in work.out_of_catalogue)
    )


def _is_quiet(work: Findings) -> bool:
    """Say whether the residual of the most probable explanation is no larger than a usual sensor's noise in any
    channel: the noise that was estimated from the wide fit may contain a misfit, which is explained by now.
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
        """Return by how much the evidence is too large with its values as densities: their contribution at the best
        fit, and the log odds that the channel is frozen, not standing still, where each value is an interval.
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
    """Return the residual (m,) of the most probable explanation that has a simulation of its own, and its problem; a
    drift has none.
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
    """Return the rounded channels that are assumed to stand still where only some suspected errors are corrected."""
    return tuple(
        StillChannel(error.record, error.error.channels[0], lost_by(error, errors, records))
        for error in whole.errors
        if error.may_stand_still and not any(error is each for each in errors)
    )


def lost_by(error: SuspectedError, errors: Sequence[SuspectedError], records: Sequence[Logged]) -> np.ndarray:
    """Return which samples of its channel (n,) a further error removes from a record."""
    others = tuple(each.error for each in errors if each.record == error.record and each is not error)
    before, after = (
        np.isfinite(corrected(records[error.record], found).record.values[error.error.channels[0]])
        for found in (others, (*others, error.error))
    )
    return before & ~after


@dataclass(frozen=True, kw_only=True, eq=False)
class Explained:
    """A set of data errors, and the explanation of the corrected records.

    Attributes:
        errors: in the data.
        work: findings in the records without them.
        log_prior: of the errors, with the log Jacobian of their corrections.
        lost: channel → samples that are then no measurements, but for those of rounded channels that are frozen.
        standing: rounded channels that are assumed to stand still.
    """

    errors: tuple[SuspectedError, ...]
    work: Findings
    log_prior: float
    lost: Mapping[str, int]
    standing: tuple[StillChannel, ...] = ()

    def log_evidence(self, per_lost: Mapping[str, float]) -> float:
        """Return the log evidence of the records as they were written; each lost sample counts `per_lost` of its
        channel. The repeated values of a frozen channel are certain; one that stands still counts by its odds instead
        of a density.
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
        """Say whether neither more causes nor better fits can bring it close to another set that leaves only
        noise.
        """
        if other is self or not leaves_only_noise(other.work):
            return False
        per_lost, behind = least_means([self, other]), settings.DECISIVE_NATS
        return self.log_evidence(per_lost) + self._to_be_gained() < other.log_evidence(per_lost) - behind

    def _to_be_gained(self) -> float:
        """Return the predicted gain of better fits; while only the wide fit exists, the largest possible predicted
        gain.
        """
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
    """Return channel → index of the written sample at each place when clocks are corrected (n,); NaN where there is
    none.
    """
    return places(
        logged, [error.error for error in errors if error.record == record and error.error.kind in SHIFTS]
    )


def measured_by(logged: Logged, error: DataError) -> int:
    """Return the number of measured samples of an error's channels."""
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
    """Return the number of measured samples of each channel."""
    samples = Counter[str]()
    for record in work.problem.records:
        samples.update({name: int(np.isfinite(record.values[name]).sum()) for name in record.noise})
    return samples


def _fixed(record: Observed, name: str) -> float:
    """Return the terms of a channel's log density that depend on its noise alone: −½ log det Σ, the cost of outliers,
    and its prior.
    """
    return log_of_outliers(*_outliers(record, name)) + log_density_of_noise(record, name)


def log_outlier(record: Observed, name: str) -> float:
    """Return the log density of a further outlier of a channel."""
    return log_of_outlier(*_outliers(record, name))


def _outliers(record: Observed, name: str) -> tuple[int, int, float]:
    """Return how many samples of a channel are outliers, how many were measured, and the usual level of its
    sensor.
    """
    measured = int(np.isfinite(record.values[name]).sum())
    return measured - record.noise[name].count, measured, sensor_of(record, name).level


class Numbers(NamedTuple):
    """Errors with their numbers estimated again; the gain in log probability of the records [nat]; those of them that
    explain nothing, by the same samples and prior knowledge; and whether the numbers may be reported: they are
    conditional on hypotheses, and an explanation that is not in the catalogue may explain the records better.
    """

    errors: tuple[SuspectedError, ...]
    gain: float = 0.0
    needless: tuple[SuspectedError, ...] = ()
    may_be_told: bool = True


def numbers_again(explanation: Explained, records: Sequence[Logged]) -> Numbers:
    """Return the errors of an explanation with their numbers, estimated again one after the other, and the gain.

    Args:
        explanation: errors, and the explanation of the records without them.
        records: as they were written.
    """
    needless: list[SuspectedError] = []
    errors, gain = list(explanation.errors), 0.0
    log_other = max((each.log_posterior for each in explanation.work.out_of_catalogue), default=-np.inf)
    may_be_told = log_other <= explanation.work.search.best().log_posterior
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
    """Return the log density of the number of one of some errors, and where to look for its peak: a clock offset in
    the fit is part of the number of a late clock.
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
    """Mean and standard deviation of a number, and the gain of its log density over the first value."""

    mean: float
    sd: float
    gain: float


def peak(logs_of: Density, known: float, first: float, apart: float) -> Peak | None:
    """Return the peak of a log density, by parabolas; None if there is no peak close by.

    Args:
        logs_of: the density.
        known: the number so far, the reference of the gain.
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
    """Return the samples that the fits without errors use: no outliers."""
    found = Samples()
    for i, (logged, record) in enumerate(zip(records, search.problem.records, strict=True)):
        where = places_of(logged, errors, i)
        found.append({name: where[name][noise.used] for name, noise in record.noise.items()})
    return found


def _inside_of_all(known: Samples, records: Sequence[Logged], several: Sequence[Errors]) -> Samples:
    """Return the known samples that none of several sets of errors puts outside the trial."""
    found = [dict(error) for error in known]
    for errors in several:
        for i, logged in enumerate(records):
            where = places_of(logged, errors, i)
            found[i] = {name: np.intersect1d(some, where[name]) for name, some in found[i].items()}
    return found


def _log_density(
    search: Search, z: np.ndarray, records: Sequence[Logged], errors: Errors, kept: Samples
) -> float:
    """Return the log density of some samples of records in the linear problem around z (k,), up to terms that do not
    depend on the numbers of errors: summed over all fitted hypotheses, as a cause may do what a number does and be
    absent where the number is right; with the noise that is the most probable given the best of them.
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
    """Return the problem of some samples of records without errors, with the noise estimated at the best fit."""
    new = posed_again(search.problem, without(records, errors))
    if len(new.entries) != len(search.problem.entries):
        raise UserError("A channel has no sample within the trial.")  # and the catalogue no errors of it
    pairs = enumerate(zip(search.problem.records, new.records, strict=True))
    made = [_similar(old, seen, kept[i], places_of(records[i], errors, i)) for i, (old, seen) in pairs]
    return replace(new, records=tuple(made))


def _similar(
    old: Observed, new: Observed, kept: Mapping[str, np.ndarray], where: Mapping[str, np.ndarray]
) -> Observed:
    """Return a record with the noise and the step errors of another; restricted to some of the written samples;
    `where` has the written sample at each place in it (n,).
    """
    noise = {}
    for name, each in old.noise.items():
        used = np.isin(where[name], kept[name])
        noise[name] = replace(each, used=used, time=new.time[used])
    steps = {name: np.interp(new.time, old.time, column) for name, column in old.correction.items()}
    return replace(new, noise=noise, correction=steps, noise_times=old.noise_times)
