"""Which errors in the data would explain a record better: each correction compared with the saturated model.

An error in the data is suspected if the corrected record has a higher evidence than the record as it is
(`data_error_saturated_model`), with its density in the units in which it was written, and with the log prior of the
error. Nothing is simulated for it, but once for each error of the commands. Fits with simulations decide whether it
is an error (`data_error_choice`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scenarios.heading import turned
from subzero.channels import BY_NAME, HEADING
from subzero.diagnosis.hypothesis.data_error import (
    ANY,
    COMMAND_GROUPS,
    KINDS,
    LEAST,
    REFERENCES,
    SWAPS,
    DataError,
)
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.hypothesis.noise import level_of, prior_noise, resolution_of, sensor_prior
from subzero.diagnosis.inference.repeated_values import log_odds_of_frozen, steps_of
from subzero.records.consistency import MISTAKEN

if TYPE_CHECKING:
    from subzero.diagnosis.inference.data_error_saturated_model import Evidence, SaturatedModel, Term


FEWEST = 6
"""A channel with fewer samples is not scanned."""
LATEST_SHARE, CLOCK_STEP_S, LATEST_CHANNEL_S = 0.5, 0.5, 6.0
"""The latest clock, as a share of the record; step of the grid of clock offsets; the longest delay of one channel.
[s]
"""
RATES, RATE_STEP = (0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2), 0.02
"""By how much a clock may run too fast, or too slow. [-]"""
CHANNEL_STEP_S = 1.0
"""Step of the grid of one channel's delays: its lag and the clock are free about each. [s]"""
STEP_MARGIN = 0.1
"""No step is scanned so close to the ends of a record, as a share of it: there it is a bias, or unobservable."""
STEP_TIMES, STEP_LEVELS = 40, 30.0
"""Number of times at which a step in a sensor is scanned; its usual size in levels of the noise."""
LOUDEST = 6.0
"""Noise of a sensor is never so many usual levels: a channel whose noise is larger in another unit is not in that
unit. [-]
"""
FREE_NUMBER_LOG_PRIOR = -5.0
"""Log prior of a number (a delay, a rate, a size, a time) that is fitted to the record."""
LEAST_STEP_LEVELS = 4.0
"""Least size of a step in a sensor, in levels of the noise with its rounding: a smaller one is a drift, or none."""
PEAKS = 4
"""Number of peaks on a grid of numbers that are refined."""
UNREFINED = -8.0
"""The number of an error with lower log posterior odds is not refined."""
FAR_BEHIND = 100.0
"""A suspect that is so many nats less probable than the best is not refined."""
HOPELESS = -30.0
"""Nor is one with lower log odds against no error, under the saturated model."""
FINEST = 0.02
"""A number is refined to this share of the step of its grid."""
AS_GOOD = 0.5
"""The posterior mean of a number is reported instead of the best one where the best is more probable by no more than
this.
"""


class Suspect(NamedTuple):
    """An error in the data, and its log posterior odds against no error: with at most one cause, and under the
    saturated model.
    """

    error: DataError
    lead: float
    generous: float


def suspects(saturated: SaturatedModel, trusted: frozenset[str] = frozenset()) -> list[Suspect]:
    """Return the errors that would explain a record better, the most probable first.

    Args:
        saturated: the saturated model of the record.
        trusted: channels that the user has declared to be free of errors.
    """
    rough = []
    for group in possible(saturated, trusted):
        group = group._replace(
            each=[suspect for suspect in group.each if not _is_known(suspect, saturated.corrected)]
        )
        each = [_judged(saturated, suspect, group) for suspect in group.each]
        rough += [(peak, group) for peak in (_peaks(each) if group.step else each)]
    close = [
        (_judged(saturated, suspect.error, group, closer=True), group)
        for suspect, group in rough
        if suspect.generous > HOPELESS or _may_be_commanded(saturated, suspect.error)
    ]
    lead = max((suspect.lead for suspect, _ in close), default=-np.inf)
    found: dict[str, Suspect] = {}
    for error, group in close:
        if error.lead > max(UNREFINED, lead - FAR_BEHIND) and (group.step or error.error.kind == "step"):
            error = _refined(saturated, error, group)
        if error.lead > found.get(error.error.id, error).lead or error.error.id not in found:
            found[error.error.id] = error
    return sorted(
        (suspect for suspect in found.values() if suspect.lead > 0.0), key=lambda suspect: -suspect.lead
    )


def judged_as_it_is(saturated: SaturatedModel, error: DataError) -> Suspect:
    """Return the odds of an error in another record, or with others corrected."""
    return _judged(saturated, error, _group_of(saturated, error), closer=True)


def clock_below_least(saturated: SaturatedModel) -> Suspect | None:
    """Return a clock that is late by less than an error, if that explains a record better than as it is, and than any
    clock that is later: a cause like others, but one for which the linear problem is inaccurate.
    """
    least, group = LEAST["late_clock"], Group([], is_read_off=True)
    judge = partial(_judged, saturated, group=group, closer=True)
    sizes = np.arange(0.5 * CLOCK_STEP_S, least + CLOCK_STEP_S, 0.5 * CLOCK_STEP_S)
    both = [side * float(size) for size in sizes for side in (1.0, -1.0)]
    each = [judge(DataError(kind="late_clock", amount=amount)) for amount in both]
    best = max(each, key=lambda error: error.lead)
    if best.lead < UNREFINED:
        return None
    best = best_number(judge, best, 0.5 * CLOCK_STEP_S)
    return best if best.lead > 0.0 and abs(best.error.amount) < least else None


def likeliest(saturated: SaturatedModel, errors: Sequence[DataError]) -> DataError:
    """Return the most probable of errors that are read off a record, and may be as small as they are."""
    group = Group(list(errors), is_read_off=True)
    return max(errors, key=lambda error: _judged(saturated, error, group, closer=True).lead)


def judged_again(saturated: SaturatedModel, error: DataError) -> Suspect:
    """Return the odds of an error with its numbers estimated again."""
    suspect, group = judged_as_it_is(saturated, error), _group_of(saturated, error)
    return _refined(saturated, suspect, group) if group.step or error.kind == "step" else suspect


def _group_of(saturated: SaturatedModel, error: DataError) -> Group:
    """Return the errors that share the prior probability of one; an error that is read off the record is alone in its
    group.
    """
    groups = possible(saturated, frozenset())
    found = (group for group in groups if any(suspect.id == error.id for suspect in group.each))
    return next(found, Group([error]))


def _is_known(error: DataError, known: Sequence[DataError]) -> bool:
    """Say whether such an error is corrected already."""
    return any(
        suspect.kind == error.kind and set(suspect.channels) == set(error.channels) for suspect in known
    )


def _peaks(each: Sequence[Suspect]) -> list[Suspect]:
    """Return the local maxima on a grid of numbers, the best first."""
    row = sorted(each, key=lambda error: error.error.amount)
    value = [-np.inf, *(error.generous for error in row), -np.inf]
    tops = [error for i, error in enumerate(row) if value[i + 1] >= max(value[i], value[i + 2])]
    return sorted(tops, key=lambda top: -top.generous)[:PEAKS]


def log_prior(error: DataError, alike: int) -> float:
    """Return the log prior odds of an error, one of so many of its kind, against none."""
    among = error.numbers * FREE_NUMBER_LOG_PRIOR if error.numbers else -np.log(max(alike, 1))
    return float(np.log(ANY * KINDS[error.kind].share / (1.0 - ANY)) + among)


def _judged(saturated: SaturatedModel, error: DataError, group: Group, *, closer: bool = False) -> Suspect:
    """Return the log posterior odds of an error in the data of a record."""
    logged = saturated.without(error)
    is_of_all = error.is_of_clock or error.is_of_commands or not saturated.is_last(error)
    touched = list(saturated.own) if is_of_all else list(error.channels)
    there = saturated.under(logged) if closer and error.is_of_commands else saturated
    there = there.with_scale_held(error.channels) if error.kind == "unit" else there
    terms = {**saturated.own, **there.terms(logged, touched)}
    is_small = not group.is_read_off and _is_small(saturated, error)
    if min(terms[name].samples for name in touched) < FEWEST or is_small:
        return Suspect(error, -np.inf, -np.inf)
    odds = log_prior(error, len(group.each))
    odds += error.log_jacobian * sum(terms[name].measured for name in error.channels if name in terms)
    generous = odds + _lost(saturated, error, terms, saturated.as_is)
    generous += there.generous(terms) - saturated.as_is.log
    if not closer:
        return Suspect(error, float(generous), float(generous))
    lead = odds + _lost(saturated, error, terms, saturated.likeliest)
    lead += there.sparse(terms) - saturated.log_sparse
    return Suspect(error, float(lead), float(generous))


def _is_small(saturated: SaturatedModel, error: DataError) -> bool:
    """Say whether the number of an error is too small to be one. Where a rounded channel stands still, the rounding
    error is constant for long, and a step in the sensor of a part of its resolution would explain it.
    """
    if error.kind != "step":
        return abs(error.amount) < LEAST.get(error.kind, 0.0)
    (name,) = error.channels
    usual = sensor_prior(name, saturated.logged.record.values[name], saturated.logged.noise)
    return abs(error.amount) < LEAST_STEP_LEVELS * np.hypot(usual.level, usual.resolution / np.sqrt(12.0))


def _may_be_commanded(saturated: SaturatedModel, error: DataError) -> bool:
    """Say whether the nominal model under other commands comes closer to a record: with the sensitivities under the
    recorded commands, the saturated model is inaccurate for others.
    """
    if not error.is_of_commands:
        return False
    terms = saturated.terms(saturated.without(error), saturated.own)
    return saturated.sparse(terms) - saturated.log_sparse > HOPELESS


def may_stand_still(saturated: SaturatedModel, error: DataError) -> bool:
    """Say whether a channel that seems to be frozen may only stand still, as it is rounded."""
    return error.kind == "frozen" and error in saturated.repeated


def _stuck(saturated: SaturatedModel, error: DataError, as_is: Evidence) -> float:
    """Return the contribution to the log evidence of the record as it is of the values that a rounded channel repeats
    to the end, and the log odds that it is frozen, not standing still: where each value is an interval
    (`repeated_values`).
    """
    (name,) = error.channels
    logged = saturated.without(error)
    record, kept = saturated.logged.record, logged.record.values[name]
    known = np.isfinite(record.values[name])
    run = ~np.isfinite(kept[known])
    if not run.any():
        return -np.inf
    usual = sensor_prior(name, record.values[name], saturated.logged.noise)
    steps = steps_of(record.time[known], saturated.deviations(name, as_is.z)[known], usual)
    rest = saturated.terms(logged, [name])[name]
    return saturated.added(name, rest, as_is) + log_odds_of_frozen(steps, run)


def _lost(saturated: SaturatedModel, error: DataError, terms: Mapping[str, Term], as_is: Evidence) -> float:
    """Return the average contribution to the evidence of the record as it is of samples that are no measurements any
    more; for a channel that may only stand still, the contribution of these samples, and the odds that it does not.
    """
    if may_stand_still(saturated, error):
        return _stuck(saturated, error, as_is)
    if not any(saturated.own[name].measured - terms[name].measured for name in saturated.own):
        return 0.0
    return sum(saturated.of_lost(name, lost, as_is) for name, lost in saturated.lost_by(error).items())


def _refined(saturated: SaturatedModel, suspect: Suspect, group: Group) -> Suspect:
    """Return an error with its numbers refined around the best of the grid."""
    judge = partial(_judged, saturated, group=group, closer=True)
    if group.step:
        return best_number(judge, suspect, group.step)
    time = saturated.time
    at, span = int(np.searchsorted(time, suspect.error.since)), max(time.size // STEP_TIMES, 1)
    around = time[max(at - span, 1) : at + span + 1 : max(span // 4, 1)]
    for _ in range(2):
        suspect = best_number(judge, suspect, 0.6 * abs(suspect.error.amount))
        suspect = max(
            [suspect, *(judge(replace(suspect.error, since=float(t))) for t in around)],
            key=lambda each: each.lead,
        )
        around = time[max(int(np.searchsorted(time, suspect.error.since)) - 3, 1) :][:7]
    return suspect


def best_number(judge: Callable[[DataError], Suspect], suspect: Suspect, step: float) -> Suspect:
    """Return an error with the most probable number within amount ± step (golden section); with the posterior mean
    where that is about as probable.
    """
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)

    def at(amount: float) -> Suspect:
        return judge(replace(suspect.error, amount=float(amount)))

    low, high = suspect.error.amount - step, suspect.error.amount + step
    inner = [at(high - ratio * step * 2.0), at(low + ratio * step * 2.0)]
    seen = [suspect, *inner]
    while high - low > FINEST * step:
        if inner[0].lead > inner[1].lead:
            high = inner[1].error.amount
            inner = [at(high - ratio * (high - low)), inner[0]]
            seen.append(inner[0])
        else:
            low = inner[0].error.amount
            inner = [inner[1], at(low + ratio * (high - low))]
            seen.append(inner[1])
    seen += [at(suspect.error.amount + share * step) for share in (-1.0, -0.5, 0.5, 1.0)]
    best, mean = max(seen, key=lambda each: each.lead), at(_mean_number(seen))
    return mean if mean.lead > best.lead - AS_GOOD else best


def _mean_number(seen: Sequence[Suspect]) -> float:
    """Return the posterior mean of a number, from the odds at some of its values (trapezoidal rule)."""
    row = sorted({error.error.amount: error.lead for error in seen}.items())
    x, lead = np.array(row).T
    density = np.exp(lead - lead.max())
    return float(np.trapezoid(density * x, x) / np.trapezoid(density, x))


class Group(NamedTuple):
    """Errors of a kind that share its prior probability; `step` of the grid of its number, 0 if there is none;
    whether the record itself shows that there is one of them.
    """

    each: list[DataError]
    step: float = 0.0
    is_read_off: bool = False


def possible(saturated: SaturatedModel, trusted: frozenset[str]) -> list[Group]:
    """Return all errors that a record may have, but for repeated values."""
    values, time = saturated.logged.record.values, saturated.logged.record.time
    names = [name for name in values if name in saturated.nominal]
    open_ = [name for name in names if name not in trusted]
    units = [
        DataError(kind="unit", channels=(name,), how=how)
        for name in open_
        for how in MISTAKEN.get(BY_NAME[name].unit, {})
    ]
    units = [unit for unit in units if _is_quiet(saturated, unit)]
    pairs = [DataError(kind="swapped", channels=pair) for pair in itertools.combinations(open_, 2)]
    found = [
        Group([DataError(kind="sign", channels=(name,)) for name in open_]),
        Group(units),
        Group(
            [
                DataError(kind="reference", channels=(HEADING,), how=how)
                for how in REFERENCES
                if HEADING in open_
            ]
        ),
        Group(pairs),
        Group([error for error in saturated.repeated if error.channels[0] in open_]),
    ]
    found += [Group([error for name in open_ for error in _step(saturated, name)]), *_clocks(time, open_)]
    if saturated.logged.setting.trial.commands is not None:
        found += _commands(saturated.logged)
    return [group for group in found if group.each]


def _is_quiet(saturated: SaturatedModel, error: DataError) -> bool:
    """Say whether a channel's noise from sample to sample is that of a sensor, once it is in the right unit.

    Where the prediction fails, any unit that makes the values smaller would be as likely; the noise differs between
    units.
    """
    (name,) = error.channels
    record = error.corrected(saturated.logged).record
    known = record.values[name][np.isfinite(record.values[name])]
    level = level_of(name, saturated.logged.noise)
    if known.size < FEWEST or np.ptp(known) == 0.0:
        return False
    expected = saturated.at(saturated.nominal[name], record.time)
    jitter = _jitter(known) + resolution_of(known, level) / np.sqrt(12.0)
    return jitter < LOUDEST * level + 2.0 * _jitter(expected)


def _jitter(values: np.ndarray) -> float:
    """Return the standard deviation of white noise with second differences of the same median size."""
    return 1.4826 * float(np.median(np.abs(np.diff(values, 2)))) / np.sqrt(6.0) if values.size > 2 else 0.0


def _clocks(time: np.ndarray, names: Sequence[str]) -> list[Group]:
    span = float(time[-1] - time[0])
    least = LEAST["late_clock"]
    late = np.arange(least, max(LATEST_SHARE * span, 2.0 * least), CLOCK_STEP_S)
    own = np.arange(LEAST["latency"], min(LATEST_CHANNEL_S, LATEST_SHARE * span) + 1e-9, CHANNEL_STEP_S)
    found = [_numbered("late_clock", late, CLOCK_STEP_S), _numbered("clock_rate", RATES, RATE_STEP)]
    return found + [_numbered("latency", own, CHANNEL_STEP_S, name) for name in names if len(names) > 1]


def _numbered(kind: str, sizes: Iterable[float], step: float, *channels: str) -> Group:
    """Return errors of a kind of these sizes, either way."""
    both = [side * float(x) for x in sizes for side in (1.0, -1.0)]
    return Group([DataError(kind=kind, channels=channels, amount=x) for x in both], step)


def _commands(logged: Logged) -> list[Group]:
    """Return the errors of commands that change any."""
    turned_ = [DataError(kind="command_sign", channels=(group,)) for group in COMMAND_GROUPS]
    exchanged = [DataError(kind="command_swap", channels=pair) for pair in SWAPS]
    return [Group(_different(logged, some)) for some in (turned_, exchanged)]


def _different(logged: Logged, errors: Iterable[DataError]) -> list[DataError]:
    """Return those errors that change commands, each change once."""
    found: dict[bytes, DataError] = {}
    own = logged.setting.trial.commands
    assert own is not None
    for error in errors:
        changed = error.corrected(logged).setting.trial.commands
        assert changed is not None
        if not np.array_equal(changed.values, own.values):
            found.setdefault((changed.values + 0.0).tobytes(), error)
    return list(found.values())


def _step(saturated: SaturatedModel, name: str) -> list[DataError]:
    """Return the step in a sensor that explains most of the residual of its channel in the saturated model."""
    record, here = saturated.logged.record, saturated.as_is
    values, time = record.values[name], record.time
    expected = saturated.at(saturated.nominal[name], time)
    values = turned(values, expected) if name == HEADING else values
    usual = sensor_prior(name, values, saturated.logged.noise)
    used = np.isfinite(values)
    noise = prior_noise(time, used, usual)
    begins = time[0] + (time[-1] - time[0]) * np.linspace(STEP_MARGIN, 1.0 - STEP_MARGIN, STEP_TIMES)
    steps = (time[:, None] >= begins).astype(float)
    rows = np.column_stack(
        [
            values - expected - saturated.at(saturated.slopes[name], time) @ here.z,
            steps,
            saturated.at(saturated.slopes[name], time),
        ]
    )
    white = noise.whiten(rows) / here.scales[name]
    r, C, J = white[:, 0], white[:, 1 : 1 + begins.size], white[:, 1 + begins.size :]
    cross = J.T @ C
    M = np.sum(C * C, axis=0) - np.sum(cross * (here.M @ cross), axis=0)
    q, prior = C.T @ r, (STEP_LEVELS * usual.level) ** -2
    best = int(np.argmax(q**2 / (np.maximum(M, 0.0) + prior)))
    size = float(q[best] / (max(M[best], 0.0) + prior))
    return [DataError(kind="step", channels=(name,), amount=size, since=_first(time, begins[best]))]


def _first(time: np.ndarray, at: float) -> float:
    return float(time[np.searchsorted(time, at)])
