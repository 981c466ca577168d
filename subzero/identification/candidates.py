"""Candidate terms, as the declarations and the residuals of a fit suggest them.

Errors in the data are open: besides known factors and offsets, the regression of readings on a simulation is one. Of
all spans of time, an unknown input is tried in the one that suits the records best.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from subzero.identification.explanation import (
    AFFINE,
    CLOCK,
    CLOCK_KINDS,
    GAIN_SCALE,
    OFFSET_LEVELS,
    Term,
    Terms,
    cause_terms,
    data_terms,
    from_time,
    input_terms,
    tolerance_term,
    with_term,
)
from subzero.identification.fit import Linear, Products, quieter, spreads
from subzero.identification.noise import BINDING, Filter, level_of
from subzero.identification.problem import Problem
from subzero.identification.readings import Readings
from subzero.identification.repeats import repeats

SAME_CLOCK = 0.1
"""Odds of a delay of a channel that has the times of the inputs, over those of one with a clock of its own. [-]"""
RANKED_BY_RESIDUALS = ("unit", "swapped", "input", "exchanged")
"""Kinds of errors that are worth a look only where the residuals are then smaller."""
SIZES_TRIED = 16
"""Errors of a clock up to so many usual ones are tried, and delays up to half of a record; then some between
the best one's neighbours."""
FEWEST_AFTER = 8
"""An error that begins in the middle of a record has so many readings before and after it."""
SOFT = 3.0
"""Factors, offsets and errors of a clock within so many usual ones are usual. [-]"""
ANY_FACTOR = 2e-3
"""Odds that a factor and an offset are those of a regression, which saw the data, over those of any error: their priors
reach over four decades and a thousand levels, a term's own numbers over a tenth and sixty levels about them. [-]"""
NOISES_TRIED = 41
"""Sizes of the noise with which a unit is looked at. [-]"""
BEGINS_TRIED = 100
"""So many times at which an error may begin are tried at once."""
CAPPED = 25.0
"""Squared residual, in levels of the sensor, beyond which a reading says no more about when an error begins. [-]"""
OFF_LEVELS = 3.0
"""A channel that is closer to the simulation, in levels of its sensor (root mean square), has no gross error; in levels
of what its readings show, if that is less: in a unit that is far too large they are all near 0, and so is their noise.
"""


def declared(problem: Problem) -> list[Term]:
    """Return the terms that a model declares, and those that its channels may have throughout."""
    model = problem.model
    durations = [float(np.ptp(record.time)) for record in problem.records]
    data = [term for term in data_terms(model) if term.target in (*problem.channels, CLOCK)]
    data = [term for term in data if term.kind != "unit" or problem.may_read(term.target, term.factor)]
    inputs = [
        term
        for term in input_terms(problem.model)
        if (
            problem.differ(term.target, term.partner)
            if term.kind == "exchanged"
            else problem.moving_inputs.issuperset({term.target, term.partner or term.target})
        )
    ]
    data = [
        term
        for term in data
        if not term.partner
        or (term.partner in problem.channels and problem.may_be_swapped(term.target, term.partner))
    ]
    own_clock = {name for record in problem.records for name in record.times}
    data = [
        replace(term, odds=SAME_CLOCK * term.odds)
        if term.kind in CLOCK_KINDS and term.target not in own_clock
        else term
        for term in data
    ]
    return [*cause_terms(model, durations), tolerance_term(model), *data, *inputs]


def suggested(problem: Problem, linear: Linear, terms: list[Term]) -> list[Term]:
    """Return which of some terms are worth a look at a point, and those that its residuals suggest."""
    found = [term for term in terms if term.kind not in (*RANKED_BY_RESIDUALS, *CLOCK_KINDS)]
    found += _of_inputs(problem, linear, terms)
    found += _swapped(problem, linear, terms)
    found += [_from_best_size(problem, linear, term) for term in terms if term.kind in CLOCK_KINDS]
    quiet = quieter(problem, linear.terms, linear.levels)
    others = [_Others(problem, replace(linear, levels=levels)) for levels in (linear.levels, quiet)]
    for name in problem.channels:
        if problem.model.channels[name].trusted:
            continue
        own = [term for term in terms if term.target == name and term.is_data_error]
        found += _of_channel(problem, linear, name, own, others)
    return found


def _of_channel(
    problem: Problem, linear: Linear, name: str, own: list[Term], others: Sequence[_Others]
) -> Iterator[Term]:
    """Yield errors of a channel: known ones that bring it closer, at the point or where numbers follow it, the
    regression, those from some time on, runs.
    """
    each, used = problem.readings_of(name, linear.terms), problem.used(name, linear.terms)
    e, level, turn = linear.e[name], problem.levels(linear.terms)[name], problem.model.channels[name].turn
    simulated = problem.recorded(name, linear.terms) - e
    yield from repeats(problem, name, linear.terms, simulated, data_odds(problem))
    # A model that usually misses something misses jumps, too: they are not distinguished from steps of a sensor.
    soft = [term for term in own if term.kind == "offset" and not problem.model.always]
    for rest in others if soft else ():
        yield from _step(rest, name, soft[0])
    before, units = float(np.mean(e[used] ** 2)), [term for term in own if term.kind == "unit"]
    shown = level_of(each.values[used], problem.prior(name, linear.terms).resolution)
    is_far = before >= (OFF_LEVELS * min(level, shown)) ** 2
    follow = _Followed(problem, linear, name)
    now_is = next((term.factor for term in linear.terms if term.slot == (AFFINE, name)), 1.0)
    here = follow.log_density(e, now_is)
    for term in units:
        now = _wrapped((each.values - term.offset) / term.factor - simulated, turn)
        nearer = is_far and float(np.mean(now[used] ** 2)) < before
        if nearer or follow.log_density(now, term.factor) > here:
            yield term
    if not is_far:
        return
    if (affine := _regression(problem, name, simulated, each.values, used)) is not None:
        yield affine
    for term in units:
        yield from _from_some_time(each, term, e, simulated, used, level, turn)


class _Followed:
    """What residuals e of a channel leave where the numbers θ of the linear problem follow them, as far as their prior
    N(c, D) lets them.

        min over z of |r − F z|² + |z + z₀|²,   r = e / level,  F = J D^½ / level,  z₀ = D^-½ (θ − c)

    A nominal model may be farther from right readings than from wrong ones: from pitch of 2°, where it has −0.5°.
    """

    def __init__(self, problem: Problem, linear: Linear, name: str) -> None:
        sd, self._used = spreads(linear.entries, linear.levels), problem.used(name, linear.terms)
        self._level = problem.levels(linear.terms)[name]
        self._spread = problem.prior(name, linear.terms).spread
        F = linear.J[name][self._used] * sd / self._level
        self._squares, V = np.linalg.eigh(F.T @ F)
        self._F, self._at_centre = F @ V, F @ (linear.off / sd)

    def left(self, e: np.ndarray) -> float:
        """Return the minimum for residuals of all readings (m,), per reading; NaN in gaps."""
        square, along, count = self._projected(e)
        return float(square - along @ (along / (self._squares + 1.0))) / count

    def log_density(self, e: np.ndarray, factor: float) -> float:
        """Return the log density of the readings, up to a constant, that are a factor too large where they have the
        residuals e (m,); with the white noise σ, in levels, that suits them best. [nats]

            − m log |b σ| − ½ min / σ² − ½ log|I + FᵀF/σ²| − ½ (log σ / spread)²
        """
        square, along, count = self._projected(e)
        deviations = np.linspace(-BINDING, BINDING, NOISES_TRIED)
        variance = np.exp(2.0 * self._spread * deviations)
        left = square - np.sum(along**2 / (self._squares + variance[:, None]), axis=1)
        size = np.sum(np.log1p(np.maximum(self._squares, 0.0) / variance[:, None]), axis=1)
        log = -0.5 * (count * np.log(factor**2 * variance) + left / variance + size + deviations**2)
        return float(np.max(log))

    def _projected(self, e: np.ndarray) -> tuple[float, np.ndarray, int]:
        """Return |q|², Fᵀq along the axes of FᵀF, and the number of readings; q: r where all numbers are at c."""
        known = np.isfinite(e[self._used])
        q = np.where(known, e[self._used] / self._level + self._at_centre, 0.0)
        return float(q @ q), self._F.T @ q, int(known.sum())


def _of_inputs(problem: Problem, linear: Linear, terms: list[Term]) -> Iterator[Term]:
    """Yield the error of each input with which the simulation leaves least, if that is less; none where the simulation
    is near.
    """
    levels = problem.levels(linear.terms)
    left = {name: _log_left(problem, name, linear.terms, linear.e[name]) for name in problem.channels}
    if all(each < 2.0 * np.log(OFF_LEVELS * levels[name]) for name, each in left.items()):
        return
    best: dict[tuple[str, str], tuple[float, Term]] = {}
    for term in (term for term in terms if term.kind in ("input", "exchanged")):
        there = with_term(linear.terms, term)
        found, valid = problem.residuals(there, linear.entries, [linear.x])
        total = (
            sum(_log_left(problem, name, there, e[:, 0]) for name, e in found.items()) if valid[0] else np.inf
        )
        best[term.slot] = min(best.get(term.slot, (np.inf, term)), (total, term), key=lambda pair: pair[0])
    yield from (term for total, term in best.values() if total < sum(left.values()))


def _log_left(problem: Problem, name: str, terms: Terms, e: np.ndarray) -> float:
    """Return the log of the mean square of residuals of a channel (m,), those in gaps left out."""
    return float(np.log(np.nanmean(e[problem.used(name, terms)] ** 2)))


def _swapped(problem: Problem, linear: Linear, terms: list[Term]) -> Iterator[Term]:
    """Yield pairs of channels that are closer to the simulation of each other than to their own, at the point or where
    numbers follow them.
    """
    pairs = [term for term in terms if term.kind == "swapped"]
    names = {name for term in pairs for name in (term.target, term.partner)}
    follow = {name: _Followed(problem, linear, name) for name in names}
    for term in pairs:
        there, left, followed = with_term(linear.terms, term), 0.0, 0.0
        for name in (term.target, term.partner):
            before, own = linear.e[name], problem.recorded(name, linear.terms)
            e = before + problem.recorded(name, there) - own
            e = _wrapped(e, problem.model.channels[name].turn)
            left += _log_left(problem, name, there, e) - _log_left(problem, name, linear.terms, before)
            followed += np.log(follow[name].left(e) / follow[name].left(before))
        if min(left, followed) < 0.0:
            yield term


def _from_best_size(problem: Problem, linear: Linear, term: Term) -> Term:
    """Return an error of a clock that begins at the size which leaves least of the channels that it is about.

    All that are tried are equally probable: the prior of one that is not usual is about it, and has as much of the odds
    as is within its standard deviation.
    """
    entries = problem.entries(with_term(linear.terms, term))
    (sd,) = [entry.sd for entry in entries if (entry.kind, entry.name) == (term.kind, term.target)]
    half = 0.5 * max(float(np.ptp(record.time)) for record in problem.records)
    most = min(SIZES_TRIED * sd, half) if term.kind == "delay" else SIZES_TRIED * sd
    sizes = np.linspace(-most, most, 8 * SIZES_TRIED + 1)
    best = sizes[np.argmin(_left_by_sizes(problem, linear, term, sizes))]
    sizes = best + np.linspace(-1.0, 1.0, 2 * SIZES_TRIED + 1) * (sizes[1] - sizes[0])
    best = float(sizes[np.argmin(_left_by_sizes(problem, linear, term, sizes))])
    if abs(best) <= SOFT * sd:
        return replace(term, size=best / sd)
    return replace(term, centre=best, odds=term.odds * math.sqrt(2.0 * math.pi) * sd / (2.0 * most))


def _left_by_sizes(problem: Problem, linear: Linear, term: Term, sizes: np.ndarray) -> np.ndarray:
    """Return what errors of a clock of some sizes (n,) leave of the channels that they are about (n,): squares in
    levels of their sensors.
    """
    terms = with_term(linear.terms, term)
    entries = problem.entries(terms)
    known = {entry.identity: value for entry, value in zip(linear.entries, linear.x.tolist(), strict=True)}
    x = np.array([known.get(entry.identity, entry.centre) for entry in entries])
    own = np.array([(entry.kind, entry.name) == (term.kind, term.target) for entry in entries])
    names = list(problem.channels) if term.target == CLOCK else [term.target]
    found, _ = problem.residuals(terms, entries, [np.where(own, size, x) for size in sizes], names)
    levels, left = problem.levels(terms), np.zeros(sizes.size)
    for name in names:
        left += np.mean((found[name][problem.used(name, terms)] / levels[name]) ** 2, axis=0)
    return left


def _wrapped(values: np.ndarray, turn: float) -> np.ndarray:
    return values - turn * np.rint(values / turn) if turn else values


def _regression(
    problem: Problem, name: str, simulated: np.ndarray, values: np.ndarray, used: np.ndarray
) -> Term | None:
    """Return y = a + b x of a channel by least squares, if the readings follow the simulation at all."""
    h, y = simulated[used], values[used]
    spread = float(np.std(h))
    if spread <= problem.levels()[name] or problem.model.channels[name].angle:
        return None
    b = float(np.mean((h - h.mean()) * (y - y.mean()))) / spread**2
    if abs(b) < 1e-3 or b**2 * spread**2 < 0.5 * float(np.var(y)):
        return None
    a = float(np.mean(y - b * h))
    usual = (abs(b - 1.0) < SOFT * GAIN_SCALE, abs(a) < SOFT * OFFSET_LEVELS * problem.levels()[name])
    if all(usual):  # an offset or an error of scale serves
        return None
    odds = ANY_FACTOR * data_odds(problem)
    return Term(
        f"affine:{name}", f"{name} has another scale and zero", "affine", name, odds, factor=b, offset=a
    )


def data_odds(problem: Problem) -> float:
    """Return the prior odds of the errors of one channel together."""
    return sum(term.odds for term in data_terms(problem.model)) / max(len(problem.model.channels), 1)


def _from_some_time(
    each: Readings,
    term: Term,
    e: np.ndarray,
    simulated: np.ndarray,
    used: np.ndarray,
    level: float,
    turn: float,
) -> Iterator[Term]:
    """Yield a known unit from the time on that fits best in each record, if there is one."""
    records = np.unique(each.record).tolist()
    for record in records:
        at = np.flatnonzero(used & (each.record == record))
        if at.size < 2 * FEWEST_AFTER:
            continue
        now = _wrapped((each.values[at] - term.offset) / term.factor - simulated[at], turn)
        gain = np.minimum((e[at] / level) ** 2, CAPPED) - np.minimum((now / level) ** 2, CAPPED)
        total = np.cumsum(gain[::-1])[::-1]
        best = int(np.argmax(total))
        if FEWEST_AFTER <= best <= at.size - FEWEST_AFTER and total[best] > CAPPED:
            yield from_time(term, record, float(each.time[at[best]]), 1.0 / (len(records) * at.size))


def _step(others: _Others, name: str, term: Term) -> Iterator[Term]:
    """Yield the offset of a channel from some time of a record on that gains most in the linear problem, in which all
    other numbers are free, if it is worth its prior there: what they bend to suit the readings would hide it.
    """
    problem, terms = others.problem, others.linear.terms
    each, used = problem.readings_of(name, terms), problem.used(name, terms)
    (sd,) = [
        entry.sd
        for entry in problem.entries((replace(term, begins=0.0),))
        if (entry.kind, entry.name) == ("step", name)
    ]
    most = 0.0
    found: Term | None = None
    records = np.unique(each.record).tolist()
    for record in records:
        at = np.flatnonzero(used & (each.record == record))
        if at.size < 2 * FEWEST_AFTER:
            continue
        begins, gain = _best_begin(others, name, at, sd)
        late = from_time(term, record, float(each.time[at[begins]]), 1.0 / (len(records) * at.size))
        if gain + np.log(late.odds) > most:
            most, found = gain + float(np.log(late.odds)), late
    if found:
        yield found


def _best_begin(others: _Others, name: str, at: np.ndarray, sd: float) -> tuple[int, float]:
    """Return the reading of some, at which an offset begins that gains most, and its gain: of a hundred of them, and
    then of those between the best one's neighbours. [nats]
    """
    first, last = FEWEST_AFTER, at.size - FEWEST_AFTER
    while True:
        begins = np.unique(np.linspace(first, last, BEGINS_TRIED).astype(int))
        gains = others.gains(name, at, (np.arange(at.size)[:, None] >= begins).astype(float), sd)
        best = int(np.argmax(gains))
        if begins.size == last - first + 1:
            return int(begins[best]), float(gains[best])
        first, last = int(begins[max(best - 1, 0)]), int(begins[min(best + 1, begins.size - 1)])


class _Others:
    """The numbers of an explanation in its linear problem, integrated out: A = JᵀΣ⁻¹J, as `fit.solve` has it."""

    def __init__(self, problem: Problem, linear: Linear) -> None:
        A, b, *_ = Products(problem, linear.terms, linear.e, linear.J).total(linear.levels.noise)
        self.problem, self.linear, self.sd = problem, linear, spreads(linear.entries, linear.levels)
        self.factor = cho_factor(self.sd[:, None] * A * self.sd + np.eye(self.sd.size), lower=True)
        self.step = linear.off - self.sd * cho_solve(self.factor, self.sd * (b + A @ linear.off))

    def gains(self, name: str, at: np.ndarray, columns: np.ndarray, tau: float) -> np.ndarray:
        """Return what a number more would gain, for each of some columns (r,). [nats]

            ½ τ² h² / (1 + τ² A) − ½ log(1 + τ² A),   A, h: of the column, all other numbers integrated out

        Args:
            name: of the channel.
            at: places of its readings in a record (m,).
            columns: what each number would add to them (m, r).
            tau: standard deviation of its prior, whose mean is 0.
        """
        problem, linear = self.problem, self.linear
        time, resolution = problem.channels[name].time[at], problem.prior(name, linear.terms).resolution
        left = linear.e[name][at] + linear.J[name][at] @ self.step
        filtered = Filter.of(linear.levels.noise[name], resolution, time)
        white = filtered.whiten(np.column_stack([columns, linear.J[name][at] * self.sd, left]))
        steps, J, e = np.split(white, [columns.shape[1], columns.shape[1] + self.sd.size], axis=1)
        across = solve_triangular(self.factor[0], J.T @ steps, lower=True)
        size = tau**2 * (np.sum(steps**2, axis=0) - np.sum(across**2, axis=0))
        return 0.5 * (tau * steps.T @ e)[:, 0] ** 2 / (1.0 + size) - 0.5 * np.log1p(size)


def best_span(problem: Problem, linear: Linear, term: Term) -> Term:
    """Return an unknown input as it acts for the time that suits the records best in the linear problem, with as many
    knots.

        log p = ½ hᵀ S⁻¹ h − ½ log|S| + const,   S, h: of the knots in a span, all other numbers integrated out

    A push that lasts for some seconds has few numbers, and so has one that grows all the time; a history of the whole
    record has many, each of which costs evidence. Numbers of knots, and spans of each, have equal prior odds; spans
    next to the best one, which say nearly the same, count with it.

    Args:
        problem: records and model.
        linear: an explanation in which it acts throughout.
        term: that it acts throughout.
    """
    own = np.array([(e.kind, e.name) == ("unknown", term.target) for e in linear.entries])
    A, h = _without_others(problem, linear, own)
    of = np.array([entry.record for entry in linear.entries])[own]
    spans: list[Term] = []
    gains: list[np.ndarray] = []
    for record in np.unique(of).tolist():
        at = np.flatnonzero(of == record)
        counts = _halved(at.size - 1)
        for count in counts:
            knots, fine = problem.knots(record, count), problem.knots(record, at.size - 1)
            hats = np.array([np.interp(fine, knots, row) for row in np.eye(count + 1)])
            gains.append(_gains(hats @ A[np.ix_(at, at)] @ hats.T, hats @ h[at]))
            share = 1.0 / (gains[-1].size * len(counts) * np.unique(of).size)
            spans += _spans(problem, term, record, count, share)
    gain = np.concatenate(gains)
    log = gain + np.log([span.odds for span in spans])
    best = int(np.argmax(log))
    return replace(spans[best], odds=float(np.sum(np.exp(log - gain[best]))))


def _halved(intervals: int) -> list[int]:
    """Return a number of intervals, and half of it again and again, to one."""
    found = [intervals]
    while found[-1] > 1:
        found.append(found[-1] // 2)
    return found


def _without_others(problem: Problem, linear: Linear, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (S − I, h) of some numbers, over the standard deviations of their priors, all others integrated out."""
    A, b, *_ = Products(problem, linear.terms, linear.e, linear.J).total(linear.levels.noise)
    sd = spreads(linear.entries, linear.levels)
    H, g = sd[:, None] * A * sd, sd * (b + A @ linear.off)
    factor = cho_factor(H[np.ix_(~own, ~own)] + np.eye(int((~own).sum())), lower=True)
    across = H[np.ix_(own, ~own)]
    return (
        H[np.ix_(own, own)] - across @ cho_solve(factor, across.T),
        g[own] - across @ cho_solve(factor, g[~own]),
    )


def _gains(A: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Return ½ hᵀ S⁻¹ h − ½ log|S| of all spans of knots, S = I + A: by their first knot, then by their last one."""
    found = []
    for first in range(h.size):
        L = np.linalg.cholesky(A[first:, first:] + np.eye(h.size - first))
        y = solve_triangular(L, h[first:], lower=True)
        found.append(np.cumsum(0.5 * y**2 - np.log(np.diag(L))))
    return np.concatenate(found)


def _spans(problem: Problem, term: Term, record: int, count: int, share: float) -> Iterator[Term]:
    """Yield an unknown input with all spans of some knots, each with a share of its odds; between the knots next to a
    span it is not 0.
    """
    times = problem.knots(record, count).tolist()
    where = f" of {problem.records[record].name}" if len(problem.records) > 1 else ""
    for first in range(count + 1):
        for last in range(first, count + 1):
            begins, ends = times[max(first - 1, 0)], times[min(last + 1, count)]
            yield replace(
                term,
                id=f"{term.id}@{record}",
                sentence=f"from {begins:.3g} to {ends:.3g} s{where}, {term.sentence}",
                begins=times[first],
                ends=times[last],
                record=record,
                odds=share * term.odds,
                intervals=count,
            )
