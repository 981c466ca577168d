"""How probable a set of errors in the data is, with what explains the records besides.

T the corrections, y the record as written:

    log p(y, errors) = log Σ_M p(T y | M) p(M) + Σ log|dT/dy| + Σ log p(error) + log p(noise)

A sample that is lost counts as any other of its channel. But where a rounded channel may be frozen or stand still, what
it repeats is certain in the one case, and in the other an interval each, no density (`repeated_values`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.data_error import DataError, corrected
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.hypothesis.noise import log_of_outlier, log_of_outliers
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.change_point_fit import FittedChangePoint
from subzero.diagnosis.inference.data_error_yardstick import LOUD
from subzero.diagnosis.inference.latent_force import FORCE
from subzero.diagnosis.inference.linear_gaussian import log_sum
from subzero.diagnosis.inference.map_fit import is_poor_fit
from subzero.diagnosis.inference.model_fits import log_density_of_noise
from subzero.diagnosis.inference.posing import sensor_of
from subzero.diagnosis.inference.problem import Observed, Problem
from subzero.diagnosis.inference.repeated_values import log_odds_of_frozen, steps_of

if TYPE_CHECKING:
    from subzero.diagnosis.inference.data_error_search import SuspectedError, Suspicion
    from subzero.diagnosis.inference.out_of_catalogue import Findings

ALIKE = 10
"""So many errors of a kind share its probability, about."""


def leaves_only_noise(work: Findings) -> bool:
    """Say whether one explanation leaves nothing but the noise of usual sensors."""
    return _is_quiet(work) and (
        not is_poor_fit(work.search.best().fit) or any(one.point for one in work.out_of_catalogue)
    )


def _is_quiet(work: Findings) -> bool:
    """Say whether the most probable explanation leaves no channel more than the noise of a usual sensor: the noise that
    was estimated behind wide tolerances may be that of a misfit, which something explains by now.
    """
    problem, r = _best_residual(work)
    for i, one in enumerate(problem.records):
        for name, noise in one.noise.items():
            left = min(float(np.sqrt(np.mean(_own(problem, r, i, name) ** 2))), 1.0)
            level = sensor_of(one, name).level
            most = LOUD * float(np.hypot(level, noise.resolution / np.sqrt(12.0)))
            if noise.sd * left >= most:
                return False
    return True


class Standing(NamedTuple):
    """A rounded channel of a record that repeats its value to the end (n,), and may be frozen."""

    record: int
    channel: str
    run: np.ndarray

    def log_excess(self, work: Findings) -> float:
        """Return by how much the evidence is too great with its values as densities: what they add to it behind the
        best fit, and the log odds that it is frozen, not standing still, where each value is an interval.
        """
        problem, r = _best_residual(work)
        one, white = problem.records[self.record], _own(problem, r, self.record, self.channel)
        noise, usual = one.noise[self.channel], sensor_of(one, self.channel)
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
    for one in work.out_of_catalogue:
        if one.log_posterior > least and isinstance(one.what, FittedChangePoint):
            least, found = one.log_posterior, (one.what.problem, one.what.fit.r)
        elif one.log_posterior > least and one.point and one.id.startswith(FORCE):
            along = one.point.along
            least, found = one.log_posterior, (along.problem, along.problem.residual(along.z))
    return found


def _own(problem: Problem, r: np.ndarray, record: int, channel: str) -> np.ndarray:
    """Return the part of a residual (m,) that is of one channel of one record."""
    at = 0
    for i, one in enumerate(problem.records):
        for name, noise in one.noise.items():
            if (i, name) == (record, channel):
                return r[at : at + noise.count]
            at += noise.count
    raise KeyError(channel)


def standing_of(
    whole: Suspicion, errors: Sequence[SuspectedError], records: Sequence[Logged]
) -> tuple[Standing, ...]:
    """Return the rounded channels that are held to stand still where only some suspected errors are corrected."""
    return tuple(
        Standing(one.record, one.error.channels[0], lost_by(one, errors, records))
        for one in whole.errors
        if one.may_stand_still and not any(one is each for each in errors)
    )


def lost_by(one: SuspectedError, errors: Sequence[SuspectedError], records: Sequence[Logged]) -> np.ndarray:
    """Return which samples of its channel (n,) one more error takes from a record."""
    others = tuple(each.error for each in errors if each.record == one.record and each is not one)
    before, after = (
        np.isfinite(corrected(records[one.record], found).record.values[one.error.channels[0]])
        for found in (others, (*others, one.error))
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
    standing: tuple[Standing, ...] = ()

    def log_evidence(self, per_lost: Mapping[str, float]) -> float:
        """Return the log evidence of the records as they were written; of samples that are lost, each so much as its
        channel is given. That a frozen channel repeats its value is certain; one that stands still has its odds in
        place of a density.
        """
        standing = sum(one.log_excess(self.work) for one in self.standing)
        lost = sum(count * per_lost.get(name, 0.0) for name, count in self.lost.items())
        return log_evidence(self.work) + self.log_prior + lost - standing

    @cached_property
    def means(self) -> dict[str, float]:
        """Channel → the mean log density of a sample: units differ, and so do densities in them."""
        problem, r = _best_residual(self.work)
        samples = samples_of(self.work)
        total = dict.fromkeys(samples, 0.0)
        for i, one in enumerate(problem.records):
            for name in one.noise:
                square = float(np.sum(_own(problem, r, i, name) ** 2))
                total[name] += _fixed(one, name) - 0.5 * square
        return {name: total[name] / count for name, count in samples.items() if count}

    def is_behind(self, other: Explained) -> bool:
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
        return max(one.optimistic_log_posterior for one in fits) - max(one.log_posterior for one in fits)


def least_means(several: Sequence[Explained]) -> dict[str, float]:
    """Return channel → the least of the mean log densities of a sample."""
    means = [one.means for one in several]
    return {name: min(one[name] for one in means if name in one) for name in set().union(*means)}


def measured_by(logged: Logged, error: DataError) -> int:
    """Return how many samples of an error's channels were measured."""
    return sum(int(np.isfinite(logged.record.values[name]).sum()) for name in error.channels
               if name in logged.record.values)  # fmt: skip


def log_evidence(work: Findings) -> float:
    """Return the log evidence of records, all explanations together, as a density of what was measured."""
    inside = work.search.beliefs.log_total()
    found = log_sum([inside, *(one.log_posterior for one in work.out_of_catalogue)])
    return found + sum(_fixed(one, name) for one in work.problem.records for name in one.noise)


def samples_of(work: Findings) -> Counter[str]:
    """Return how many samples of each channel were measured."""
    samples = Counter[str]()
    for one in work.problem.records:
        samples.update({name: int(np.isfinite(one.values[name]).sum()) for name in one.noise})
    return samples


def _fixed(one: Observed, name: str) -> float:
    """Return what the noise of a channel adds to its log density: −½ log det Σ, what outliers cost, and its prior."""
    return log_of_outliers(*_outliers(one, name)) + log_density_of_noise(one, name)


def log_outlier(one: Observed, name: str) -> float:
    """Return the log density of a further outlier of a channel."""
    return log_of_outlier(*_outliers(one, name))


def _outliers(one: Observed, name: str) -> tuple[int, int, float]:
    """Return how many samples of a channel are outliers, how many were measured, and the usual level of its sensor."""
    measured = int(np.isfinite(one.values[name]).sum())
    return measured - one.noise[name].count, measured, sensor_of(one, name).level
