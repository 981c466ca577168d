"""Values that a record repeats instead of measurements: read off the record itself.

A sensor's noise changes its value from sample to sample. So a run of L equal values among samples of which a share p
repeat the one before has the probability p^(L−1), at each place. A run up to the end of the record is a frozen
channel; other runs are drop-outs; and so is a value that recurs far from its neighbours, such as 0 or −999, or that
recurs in several runs though the channel is not rounded.

A rounded channel whose values from a sample on lie off the multiples of the samples before has a step in its sensor:
no motion causes that (`steps_off_grid`).

A channel that is rounded and stands still repeats itself, too, and a value that is far from its neighbours may be a
measurement at most of its places (`may_be_measured`): then the prediction decides, and the rate at which the channel
flickers.

A sensor that rounds to steps of q shows the step in which the measured quantity lies:

    y_i = k q   if   (k − ½) q  ≤  h(t_i) + x(t_i) + w_i  <  (k + ½) q,      w ~ N(0, σ_w²),   x ~ OU(σ_s, τ_s)

So how often a channel flickers between two steps follows from its noise, and from where the prediction h lies between
them; with slow noise it flickers less. The state of the filter is x, assumed to be normal, with its mean and variance
after each observed interval: the error of that is small, as the likelihood is log-concave. σ_w, σ_s and τ_s are
unknown: the evidence is marginalised over a grid of them with the prior of the sensor, so that the samples before a
run of equal values determine how noisy the channel is.

A channel that froze at one of N samples repeats its value with certainty; so the log odds of that against a run of
measurements up to the end are

    log Σ_s p(y_1 … y_s) / p(y_1 … y_N) − log N,      s in the run
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from subzero.diagnosis.hypothesis.data_error import DataError
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.hypothesis.noise import (
    Noise,
    SensorPrior,
    level_of,
    log_prior_of,
    resolution_of,
    sensor_prior,
)
from subzero.diagnosis.inference.linear_gaussian import log_sum

CLEAR_LOG_ODDS = 6.0
"""Runs whose log probability by chance is below minus this are not due to chance."""
FAR_LEVELS, FEWEST_FAR, NEIGHBOURS, NEAREST = 8.0, 4, 5, 2
"""A value is no measurement if it occurs FEWEST_FAR times, at least once in three samples in a row, FAR_LEVELS noise
levels from the measurements around it: from each of the NEAREST on both sides, or as many on one side, of which two
may be outliers. Outliers that are rounded may be equal, but not in a row. NEIGHBOURS on each side give the spread.
"""
MOSTLY_FAR = 0.5
"""If at least this share of a value's places is far off, it is no measurement there; if less is, the prediction
decides, as a vehicle at rest has a speed of 0, too. [-]
"""
SHORT, FEWEST_FROZEN = 3, 6
"""Runs at most this long give the rate of repeats by chance; a channel is frozen if it repeats so many values to the
end.
"""
WHITE_LEVELS = (0.1, 0.18, 0.31, 0.55, 0.97, 1.7, 3.0)
SLOW_LEVELS = (0.1, 0.23, 0.51, 1.16, 2.64, 6.0)
"""σ_w and σ_s that are tried, in usual levels: even in their logarithms, as far as a sensor's noise may be. [-]"""
TIMES_S = (0.3, 1.0, 3.0, 10.0)
"""... and τ_s. [s]"""
OUTLIERS, OUTLIER_LEVELS = 0.01, 50.0
"""Share of samples that are uniform within so many usual levels: so no value is ruled out."""
IMPROBABLE = 1e-300
"""Least probability of a value."""
OFF_GRID = 0.02
"""A value is off the multiples of a channel's steps by more than that share of a step. [-]"""


class Repeats(NamedTuple):
    """Runs of equal values: index of the first among the measured samples, and length."""

    first: np.ndarray
    length: np.ndarray


def repeated_values(logged: Logged, trusted: frozenset[str] = frozenset()) -> list[DataError]:
    """Return the frozen values and drop-outs of a record's channels."""
    found = []
    for name, values in logged.record.values.items():
        if name not in trusted:
            usual = sensor_prior(name, values, logged.noise)
            level = float(np.hypot(usual.level, usual.resolution / np.sqrt(12.0)))
            found += _of(name, logged.record.time, values, level)
    return found


def steps_off_grid(logged: Logged, trusted: frozenset[str] = frozenset()) -> list[DataError]:
    """Return steps of rounded channels that no motion causes: from a sample on all values have the same offset from
    the multiples before. The number of whole steps in the amount is left to the prediction.
    """
    found = []
    for name, values in logged.record.values.items():
        step = sensor_prior(name, values, logged.noise).resolution
        known = np.flatnonzero(np.isfinite(values))
        if name in trusted or step == 0.0 or known.size < 2 * FEWEST_FROZEN:
            continue
        offsets = _off_grid((values[known] - values[known[0]]) / step)
        first = int(np.argmax(np.abs(offsets) > OFF_GRID))
        same = np.abs(_off_grid(offsets[first:] - offsets[first])) < OFF_GRID
        if FEWEST_FROZEN <= first <= known.size - FEWEST_FROZEN and same.all():
            found.append(
                DataError(
                    kind="step",
                    channels=(name,),
                    amount=float(step * np.median(offsets[first:])),
                    since=float(logged.record.time[known[first]]),
                )
            )
    return found


def _off_grid(values: np.ndarray) -> np.ndarray:
    """Return values minus the nearest whole number (n,)."""
    return values - np.round(values)


def may_be_measured(error: DataError, logged: Logged) -> bool:
    """Say whether a channel may repeat values because it is rounded and stands still; or may have measured a value
    that is far from its neighbours at only a part of its places.
    """
    (channel,) = error.channels
    left = error.corrected(logged).record.values[channel]
    if error.how:
        places = np.count_nonzero(left == float(error.how)) + len(error.at)
        return bool(len(error.at) < MOSTLY_FAR * places)
    level = level_of(channel, logged.noise)
    return resolution_of(left, level) > 0.0


def _of(name: str, time: np.ndarray, values: np.ndarray, level: float) -> list[DataError]:
    found = []
    for value, at in {**_far_values(values, level), **_values_again(values, level)}.items():
        found.append(
            DataError(kind="dropout", channels=(name,), how=f"{value + 0.0:.9g}", at=tuple(time[at].tolist()))
        )
        values = np.where(at, np.nan, values)
    known = np.flatnonzero(np.isfinite(values))
    if known.size <= FEWEST_FROZEN:
        return found
    runs = _runs(values[known])
    unlikely = _unlikely(runs, known.size)
    lost = [known[a + 1 : a + n] for a, n in zip(runs.first[unlikely], runs.length[unlikely], strict=True)]
    if lost and lost[-1][-1] == known[-1] and lost[-1].size >= FEWEST_FROZEN:
        end = lost.pop()
        found.append(
            DataError(
                kind="frozen", channels=(name,), since=float(time[end[0]]), at=tuple(time[end].tolist())
            )
        )
    if lost:
        found.append(
            DataError(kind="dropout", channels=(name,), at=tuple(time[np.concatenate(lost)].tolist()))
        )
    return found


def _far_values(values: np.ndarray, level: float) -> Mapping[float, np.ndarray]:
    """Return value → samples where it is no measurement (n,): elsewhere, as where a vehicle is at rest, it may be
    measured. The farthest value first: measurements between two stretches of it are far from it, too; so each value
    is tested again without the others.
    """
    distinct, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    often, found = distinct[counts >= FEWEST_FAR], dict[float, np.ndarray]()
    for value in sorted(often.tolist(), key=lambda each: -abs(each - np.nanmedian(values))):
        if (far := _where_far(value, values, found, level)).any():
            found[value] = far
    for value in list(found):
        del found[value]
        if (far := _where_far(value, values, found, level)).any():
            found[value] = far
    return found


def _where_far(
    value: float, values: np.ndarray, others_far: Mapping[float, np.ndarray], level: float
) -> np.ndarray:
    """Return where a value is far from the measurements around it, without those of other far values (n,); nowhere if
    that is too rare.
    """
    values = np.where(
        np.any([np.zeros(values.size, dtype=bool), *others_far.values()], axis=0), np.nan, values
    )
    at, others, nowhere = values == value, _others(values, value), np.zeros(values.size, dtype=bool)
    if others.size < FEWEST_FAR:
        return nowhere
    places = np.flatnonzero(at[: others[-1]])  # a run to the end is a frozen channel
    far = at.copy()
    far[places] = [_is_far(value, i, values, others, level) for i in places.tolist()]
    enough = np.count_nonzero(far[: others[-1]]) >= FEWEST_FAR
    return far if enough and np.any(far[2:] & far[1:-1] & far[:-2]) else nowhere


def _others(values: np.ndarray, value: float) -> np.ndarray:
    """Return where a channel shows another value (k,): but for a single sample between two of the value, which is an
    outlier where a channel hardly ever leaves a value, if there are enough others.
    """
    known = np.flatnonzero(np.isfinite(values))
    other = values[known] != value
    alone = other & ~np.r_[other[1:], True] & ~np.r_[True, other[:-1]]
    return known[other & ~alone] if np.count_nonzero(other & ~alone) >= FEWEST_FAR else known[other]


def _values_again(values: np.ndarray, level: float) -> Mapping[float, np.ndarray]:
    """Return value → samples where it is no measurement (n,), of a channel that is not rounded: a value that occurs
    in several runs, and more often than by chance where other values hardly occur twice.

    A sample of N others shares its value with λ = (1 + Σ n (n − 1))/N more on average, n times each value occurs.
    """
    found, left = dict[float, np.ndarray](), values
    distinct, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    for value in distinct[np.argsort(-counts)][: np.count_nonzero(counts >= FEWEST_FAR)].tolist():
        at, others = left == value, left[left != value]
        _, times = np.unique(others[np.isfinite(others)], return_counts=True)
        if times.sum() < FEWEST_FROZEN or resolution_of(others, level) > 0.0:
            return found
        shared, more = (1.0 + float(np.sum(times * (times - 1)))) / times.sum(), np.count_nonzero(at) - 1
        log_chance = more * np.log(shared) - gammaln(more + 1.0) + np.log(distinct.size)
        if _is_in_several_runs(at[np.isfinite(values)]) and log_chance < -CLEAR_LOG_ODDS:
            found[value], left = at, np.where(at, np.nan, left)
    return found


def _is_in_several_runs(at: np.ndarray) -> bool:
    """Say whether a condition (n,) holds in more than one run."""
    return bool(np.count_nonzero(np.diff(at, prepend=False).astype(bool) & at) > 1)


def _is_far(value: float, at: int, values: np.ndarray, others: np.ndarray, level: float) -> bool:
    """Say whether a value is far from the measurements before and after it: no peak, but a jump there and back."""
    i = int(np.searchsorted(others, at))
    around = values[others[max(i - NEIGHBOURS, 0) : i + NEIGHBOURS]]
    spread = float(np.median(np.abs(np.diff(around)))) if around.size > 1 else 0.0
    first = max(min(i - NEAREST, others.size - 2 * NEAREST), 0)  # as many at an end, all on one side
    nearest = values[others[first : first + 2 * NEAREST]]
    return bool(np.min(np.abs(value - nearest)) > FAR_LEVELS * max(level, spread))


def _runs(values: np.ndarray) -> Repeats:
    """Return all runs of equal values of measured samples (m,), also of one."""
    first = np.flatnonzero(np.r_[True, np.diff(values) != 0.0])
    return Repeats(first, np.diff(np.r_[first, values.size]))


def _unlikely(runs: Repeats, count: int) -> np.ndarray:
    """Say which runs are not due to chance, given the rate of repeats in the others."""
    usual = runs.length <= SHORT
    for _ in range(3):
        repeats, pairs = np.sum(runs.length[usual] - 1), np.sum(runs.length[usual])
        share = (repeats + 0.5) / (pairs + 1.0)
        usual = -(runs.length - 1) * np.log(share) < CLEAR_LOG_ODDS + np.log(count)
    return ~usual


class Steps(NamedTuple):
    """The values of a rounded channel as intervals: times of the measured samples (n,) [s]; bounds of the deviation
    from the prediction of each (n,) [unit of the channel]; the usual noise of its sensor.
    """

    time: np.ndarray
    low: np.ndarray
    high: np.ndarray
    usual: SensorPrior


class _Belief(NamedTuple):
    """Mean and variance of x for every noise (g,)."""

    mean: np.ndarray
    variance: np.ndarray


def steps_of(time: np.ndarray, deviations: np.ndarray, usual: SensorPrior) -> Steps:
    """Return the values of a rounded channel as intervals.

    Args:
        time: of the measured samples (n,). [s]
        deviations: measured − predicted (n,). [unit of the channel]
        usual: noise and resolution of its sensor.
    """
    half = 0.5 * usual.resolution
    return Steps(time, deviations - half, deviations + half, usual)


def log_odds_of_frozen(steps: Steps, run: np.ndarray) -> float:
    """Return the log odds that a channel froze in a run of equal values up to its end, against that it stands still;
    the prior odds are left to the caller.

    Args:
        steps: all measured samples (n,).
        run: which of them repeat a value (n,): the last samples.
    """
    known, first = log_evidence_up_to(steps), int(np.argmax(run))
    before = np.concatenate([[0.0], known])[first:-1]  # of the samples before each one of the run
    return float(log_sum(before - known[-1]) - np.log(steps.time.size))


def log_evidence_up_to(steps: Steps) -> np.ndarray:
    """Return the log probability of the values up to each sample (n,), marginalised over the noise."""
    noises = _noises(steps.usual)
    white, slow, lasts, log = np.array([(n.white**2, n.slow**2, n.correlation_time, p) for n, p in noises]).T
    far = OUTLIERS * steps.usual.resolution / (OUTLIER_LEVELS * steps.usual.level)
    gaps, found = np.diff(steps.time, prepend=steps.time[:1]), np.empty(steps.time.size)
    x = _Belief(np.zeros(white.size), slow)
    for i, gap in enumerate(gaps.tolist()):
        kept = np.exp(-gap / lasts)
        x = _Belief(kept * x.mean, kept**2 * x.variance + (1.0 - kept**2) * slow)
        inside, x_inside = _within(x, white, float(steps.low[i]), float(steps.high[i]))
        inside = (1.0 - OUTLIERS) * inside
        log = log + np.log(inside + far)
        x = _mixed(x, x_inside, inside / (inside + far))
        found[i] = log_sum(log)
    return found


def _noises(usual: SensorPrior) -> Sequence[tuple[Noise, float]]:
    """Return the grid of noises, each with its log prior."""
    own, nothing = usual._replace(resolution=0.0), np.zeros(0)  # without the rounding
    each = [
        Noise(white=w * usual.level, slow=s * usual.level, correlation_time=t, used=nothing, time=nothing)
        for w in WHITE_LEVELS
        for s in SLOW_LEVELS
        for t in TIMES_S
    ]
    logs = [log_prior_of(item, own) for item in each]
    total = log_sum(logs)
    return [(item, log - total) for item, log in zip(each, logs, strict=True)]


def _within(x: _Belief, white: np.ndarray, low: float, high: float) -> tuple[np.ndarray, _Belief]:
    """Return the probability that x + w lies between two numbers (g,), and the distribution of x if it does."""
    from scipy.special import ndtr

    sd = np.sqrt(x.variance + white)
    a, b = (low - x.mean) / sd, (high - x.mean) / sd
    upper = a > 0.0  # far above, the difference of the upper tails loses no digits
    inside = np.maximum(np.where(upper, ndtr(-a) - ndtr(-b), ndtr(b) - ndtr(a)), IMPROBABLE)
    at_a, at_b = (np.exp(-0.5 * end * end) / np.sqrt(2.0 * np.pi) for end in (a, b))
    mean = (at_a - at_b) / inside
    variance = np.clip(1.0 + (a * at_a - b * at_b) / inside - mean**2, 0.0, 1.0)
    gain = x.variance / sd
    return inside, _Belief(x.mean + gain * mean, x.variance - gain**2 * (1.0 - variance))


def _mixed(belief: _Belief, other: _Belief, share: np.ndarray) -> _Belief:
    """Return mean and variance of the mixture of two beliefs, of which the other has a share (g,)."""
    apart = other.mean - belief.mean
    variance = share * other.variance + (1.0 - share) * belief.variance + share * (1.0 - share) * apart**2
    return _Belief(belief.mean + share * apart, variance)
