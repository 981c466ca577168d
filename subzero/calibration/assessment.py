"""Assessment of a calibration: directions that records do not determine, profiles, held-out errors, trials to fly
next.

    Λ = D^½ (M_ff⁻¹ − D⁻¹) D^½,   Λ e = λ e

is the information of the data on the free numbers, in units of their priors; along e, 1/√(1 + λ) of the prior is left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from subzero.calibration.fit import SIGMAS_95, Fitted, held_at
from subzero.calibration.numbers import Number
from subzero.calibration.results import Advice, Direction, Estimate, Held, Profile
from subzero.diagnosis import assessment as judged
from subzero.diagnosis.assessment import LIBRARY, is_safe, prepared_trial, rows_of, trial_rows, whiteness
from subzero.diagnosis.hypothesis.catalogue import START
from subzero.diagnosis.hypothesis.catalogue.sensors import SPECS
from subzero.diagnosis.inference import (
    Noise,
    Problem,
    Progress,
    bounded_step,
    bounds,
    is_noise,
    runnable,
)

UNDETERMINED_ABOVE = 0.5
"""Remaining share of the prior standard deviation from which on the records do not determine a direction. [-]"""
SMALL_PART = 0.2
"""Parts of a direction smaller than this share of the largest, in priors, are not reported. [-]"""
AT_BOUND = 1e-9


def estimates(numbers: Sequence[Number], work: Fitted) -> tuple[Estimate, ...]:
    """Return the numbers that were free, with their intervals."""
    found = []
    for k, number in enumerate(numbers):
        z, sd = float(work.fit.z[k]), float(np.sqrt(work.M[k, k]))
        ends = np.clip([z - SIGMAS_95 * sd, z + SIGMAS_95 * sd], number.low, number.high)
        found.append(
            Estimate(
                name=number.name,
                unit=number.unit,
                before=number.nominal,
                value=number.nominal + z,
                sd=sd,
                low=float(number.nominal + ends[0]),
                high=float(number.nominal + ends[1]),
                prior_sd=number.prior_sd,
                tolerance=float(np.hypot(number.tolerance, sd)),
                is_determined=sd < UNDETERMINED_ABOVE * number.prior_sd,
                is_at_bound=min(z - number.low, number.high - z) < AT_BOUND,
            )
        )
    return tuple(found)


def correlation(M: np.ndarray) -> np.ndarray:
    """Return the correlations of a covariance (n, n)."""
    sd = np.sqrt(np.diag(M))
    found: np.ndarray = M / np.outer(sd, sd)
    return found


def directions(numbers: Sequence[Number], M: np.ndarray) -> tuple[Direction, ...]:
    """Return the directions that the records do not determine, from the covariance of the free numbers (n, n)."""
    prior = np.array([number.prior_sd for number in numbers])
    shares = prior[:, None] * (np.linalg.inv(M) - np.diag(prior**-2)) * prior
    values, vectors = np.linalg.eigh(0.5 * (shares + shares.T))
    left = 1.0 / np.sqrt(1.0 + np.maximum(values, 0.0))
    return tuple(
        _direction(numbers, vector, share)
        for vector, share in zip(vectors.T, left.tolist(), strict=True)
        if share > UNDETERMINED_ABOVE
    )


def _direction(numbers: Sequence[Number], vector: np.ndarray, left: float) -> Direction:
    """Return an eigenvector, in units of priors, as a common change of numbers."""
    vector = vector * np.sign(vector[np.argmax(np.abs(vector))])
    order = [
        int(i) for i in np.argsort(-np.abs(vector)) if abs(vector[i]) > SMALL_PART * np.abs(vector).max()
    ]
    parts = {numbers[i].name: float(left * vector[i] * numbers[i].prior_sd) for i in order}
    words = " together with ".join(_change(numbers[i], parts[numbers[i].name]) for i in order)
    return Direction(
        parts=parts, left=left, sentence=f"{words}: {100.0 * left:.0f} % of what was open is left"
    )


def _change(number: Number, change: float) -> str:
    name = number.name.removeprefix("vehicle.")
    if number.nominal:
        return f"{name} {100.0 * change / abs(number.nominal):+.0f} %"
    return f"{name} {change:+.2g}{'' if number.unit == '1' else f' {number.unit}'}"


PROFILE_SIGMAS = (-3.0, -1.5, 1.5, 3.0)
"""Where a profile is made, in standard deviations from the estimate."""
RISE_95 = SIGMAS_95**2
"""Rise of −2 log posterior at the ends of an interval of 95 %."""


def profiles(numbers: Sequence[Number], work: Fitted, progress: Progress) -> dict[str, Profile]:
    """Return how much worse the fit gets with each number held elsewhere and all others fitted again."""
    found = {}
    for k, number in enumerate(numbers):
        progress(k / len(numbers), f"profile of {number.name}")
        sd = float(np.sqrt(work.M[k, k]))
        offsets = [s * sd for s in PROFILE_SIGMAS if number.low <= work.fit.z[k] + s * sd <= number.high]
        points = [(offset, max(held_at(work.problem, work.fit, k, offset)[1], 0.0)) for offset in offsets]
        whole = sorted([*points, (0.0, 0.0)])
        values, rise = (
            np.array([number.nominal + work.fit.z[k] + x for x, _ in whole]),
            np.array([y for _, y in whole]),
        )
        low, high = _ends(values, rise)
        found[number.name] = Profile(values=values, rise=rise, low=low, high=high)
    return found


def _ends(values: np.ndarray, rise: np.ndarray) -> tuple[float, float]:
    """Return where a profile rises by RISE_95 to either side, from its signed root, which is nearly linear."""
    best = int(np.argmin(rise))
    root = np.sqrt(rise) * np.where(np.arange(rise.size) < best, -1.0, 1.0)
    if not np.all(np.diff(root) > 0.0):
        return -math.inf, math.inf
    ends = np.interp([-SIGMAS_95, SIGMAS_95], root, values, left=-math.inf, right=math.inf)
    return float(ends[0]), float(ends[1])


HELD_STEPS = 2
"""Steps of the fit without a record, from the linear one."""


def held_out(work: Fitted, progress: Progress) -> dict[str, dict[str, Held]]:
    """Return record → channel → errors, each record predicted by the vehicle that all others make.

    What belongs to the record alone, its start, is fitted to it: no other record can say it.
    """
    problem = work.problem
    if len(problem.records) == 1:
        return _held_blocks(work)
    found = {}
    nominal = problem.residual(np.zeros(work.fit.z.size))
    for i, record in enumerate(problem.records):
        progress(i / len(problem.records), f"{record.name} held out")
        found[record.name] = _errors(problem, i, nominal, _without(work, i), work.fit.r)
    return found


def _without(work: Fitted, record: int) -> np.ndarray:
    """Return the whitened residual (m,) with a record predicted by a fit of all others and its own start."""
    problem, fit = work.problem, work.fit
    own = np.array([entry.record == record for entry in problem.entries])
    rows = rows_of(problem).record == record
    low, high = bounds(problem)
    z, r = fit.z, fit.r
    for _ in range(HELD_STEPS):
        step = bounded_step(fit.J[~rows], r[~rows], z, fit.D, low, high)
        z, r = runnable(problem, z + step, None)
    held = np.where(own, 0.0, z)
    held, r = runnable(problem, held, None)
    hold = np.where(own, low, held), np.where(own, high, held)
    start = held + bounded_step(fit.J[rows], r[rows], held, fit.D, *hold)
    return problem.residual(start)


def _held_blocks(work: Fitted) -> dict[str, dict[str, Held]]:
    """Return the errors of the only record, blocks of it held out in the linear problem."""
    problem = work.problem
    parts = judged.parts_of(problem, rows_of(problem))
    held = judged.held_out(judged.Fitted(problem, work.fit), parts)
    nominal = problem.residual(np.zeros(work.fit.z.size))
    return {problem.records[0].name: _errors(problem, 0, nominal, held, work.fit.r)}


def _errors(
    problem: Problem, record: int, before: np.ndarray, after: np.ndarray, fitted: np.ndarray
) -> dict[str, Held]:
    """Return channel → errors of whitened residuals (m,) in a record, in levels of its noise."""
    rows = rows_of(problem)
    raw = [judged.raw(problem, each) for each in (before, after, fitted)]
    found = {}
    for name, noise in problem.records[record].noise.items():
        own = (rows.record == record) & (rows.channel == name)
        b, a, f = (
            float(np.sqrt(np.mean(each[own] ** 2))) / noise.sd if own.any() else math.nan for each in raw
        )
        found[name] = Held(before=b, after=a, fitted=f, noise=noise.sd, samples=int(own.sum()))
    return found


MOST_WANDER = 2.5
"""Where the remaining residuals wander by more than so many usual levels, they are a misfit and not noise. [-]"""


def refused(numbers: Sequence[Number], work: Fitted) -> tuple[str, ...]:
    """Return in sentences why a fit is not a calibration: it leaves more than noise, or found no minimum within
    bounds.

    A wrong minimum has intervals as narrow as the right one; what gives it away is the colour of what it leaves, and a
    number at its bound that makes up for another. Noise is estimated behind the fit, and a misfit would pass for slow
    noise: so its size is held to the sensor's.
    """
    found, at = [], 0
    for record in work.problem.records:
        for name, noise in record.noise.items():
            r = work.fit.r[at : at + noise.count]
            at += noise.count
            level = math.hypot(record.known.get(name, SPECS[name].noise), noise.resolution / math.sqrt(12.0))
            words = f"{name.replace('_', ' ')} in {record.name}"
            if not is_noise(r):
                found.append(f"The best fit misses the {words} by more than its noise.")
            elif (p := whiteness(r)) < STRANGE_P and not _is_coarse(noise):
                found.append(f"What is left of the {words} is no noise (Ljung and Box: p = {p:.1g}).")
            elif noise.slow > MOST_WANDER * level:
                found.append(
                    f"The best fit leaves the {words} wandering by {noise.slow / level:.1f} times the usual noise."
                )
    for k, (number, z) in enumerate(zip(numbers, work.fit.z, strict=False)):
        is_determined = np.sqrt(work.M[k, k]) < UNDETERMINED_ABOVE * number.prior_sd
        if is_determined and min(z - number.low, number.high - z) < AT_BOUND:
            found.append(f"{number.name} stands at its bound: it makes up for something else.")
    if not work.repeated:
        found.append("Every start ended in another minimum: which of them is the vehicle is not known.")
    if not work.settled:
        found.append("The fit found no minimum: another step would still gain.")
    return tuple(found)


def _is_coarse(noise: Noise) -> bool:
    """Return whether a channel is rounded so coarsely that its residuals are never white: where it hardly moves, the
    error of the rounding is the same for many samples.
    """
    return bool(noise.resolution > COARSE * math.sqrt(12.0) * noise.white)


COARSE = 0.5
"""Rounding errors of more than this share of the white noise are distinguished from it. [-]"""
STRANGE_P = 1e-4
"""A channel whose whitened residual is white with less than this probability is no noise. [-]"""
STRANGE_NOISE = 3.0
"""Noise of more than so many usual levels is reported: it may be an effect that the model does not contain. [-]"""


def strange(work: Fitted) -> tuple[str, ...]:
    """Return in sentences which sensors are many times as noisy as usual."""
    found = []
    for record in work.problem.records:
        for name, noise in record.noise.items():
            words, level = name.replace("_", " "), record.known.get(name, SPECS[name].noise)
            times = noise.sd / max(level, noise.resolution)
            if times > STRANGE_NOISE:
                found.append(f"The {words} in {record.name} is {times:.1f} times as noisy as usual.")
    return tuple(found)


def advice(numbers: Sequence[Number], work: Fitted, progress: Progress) -> tuple[Advice, ...]:
    """Return the safe trials of the library, by the information they would add on the free numbers."""
    problem, count = work.problem, len(numbers)
    shared = [k for k, entry in enumerate(problem.entries) if entry.record < 0]
    M = _with_new_start(work.M[np.ix_(shared, shared)])
    z = np.concatenate([work.fit.z[shared], np.zeros(len(START))])
    found = []
    for at, (name, (sentence, make)) in enumerate(LIBRARY.items()):
        progress(at / len(LIBRARY), f"would {name.replace('_', ' ')} help?")
        coming = prepared_trial(problem, make(problem.records[0].setting))
        if not is_safe(coming, coming.tracks([(0, z)])):
            continue
        after = np.linalg.inv(np.linalg.inv(M) + _information(coming, z))
        old, new = M[:count, :count], after[:count, :count]
        information = 0.5 * float(np.linalg.slogdet(old)[1] - np.linalg.slogdet(new)[1])
        shrinks = np.sqrt(np.diag(old) / np.diag(new))
        sharper = {numbers[i].name: float(shrinks[i]) for i in np.argsort(-shrinks)}
        found.append(
            Advice(
                name=name,
                sentence=sentence,
                information=information,
                sharper=sharper,
                commands=trial_rows(coming.records[0].setting),
            )
        )
    return tuple(sorted(found, key=lambda each: -each.information))


def _information(coming: Problem, z: np.ndarray) -> np.ndarray:
    """Return JᵀJ of a trial to come (k, k)."""
    J = coming.jacobian(z)
    information: np.ndarray = J.T @ J
    return information


def _with_new_start(M: np.ndarray) -> np.ndarray:
    """Return the covariance of the parameters that trials share and of the start of a new one."""
    start = [parameter.tolerance**2 for effect in START for parameter in effect.parameters]
    whole = np.zeros((M.shape[0] + len(start),) * 2)
    whole[: M.shape[0], : M.shape[0]] = M
    whole[range(M.shape[0], whole.shape[0]), range(M.shape[0], whole.shape[0])] = start
    return whole


def nuisances(work: Fitted, count: int) -> dict[str, tuple[float, float]]:
    """Return mean and standard deviation of everything but the first `count` entries, in tolerances."""
    tolerance = np.sqrt(work.fit.D)
    names = [entry.name for entry in work.problem.entries]
    sd = np.sqrt(np.diag(work.M))
    return {
        names[k]: (float(work.fit.z[k] / tolerance[k]), float(sd[k] / tolerance[k]))
        for k in range(count, len(names))
    }


def at_nominal(problem: Problem) -> Problem:
    """Return the problem without the parts that were added to its simulations."""
    return replace(problem, records=tuple(replace(record, correction={}) for record in problem.records))
