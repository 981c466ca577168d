"""Change-point candidates, ranked by linear evidence before any is fitted: which cause, and which onset?

Every effect that may begin in mid-trial is tried from every time of a grid, in the linear problem at a linearisation
point with all tolerances free; the best one again on a finer grid. Causes of a hypothesis are tried by real
simulations, as large as they are there. Not modelled: effects that end again, and two with different onsets.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.effect import MINUTE_S, Effect, with_free_onset, with_onset
from subzero.diagnosis.hypothesis.hypotheses import (
    PRACTICAL_TOLERANCES_SUDDEN,
    Entry,
    columns_of,
    log_prior,
    nameable,
    variances,
)
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.linear_gaussian import (
    KAPPAS,
    ForceInformation,
    Posterior,
    Quadratic,
    posterior,
    seen,
)
from subzero.diagnosis.inference.map_fit import Candidate, Fit, bounds, of_sizes, possible
from subzero.diagnosis.inference.simulator import Stop, Track, simulate_on, simulate_track, with_stops

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.inference.problem import Observed, Problem

COARSE_ONSETS, FINE_PER_COARSE, MIN_ONSET_SPACING_S = 15, 4, 1.0
"""Number of steps of the coarse grid of onsets in a record; of fine steps in a coarse one; the shortest step. [s]"""
SECANT_SCALES = 0.25
"""Step of a sensitivity, in effect scales."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ChangePoint:
    """An effect with a change point, in the linear problem.

    Attributes:
        effect: as it holds throughout.
        time: its onset. [s]
        record: in which record; a change point is an event of one trial.
        log_gain: log evidence over that without the effect.
        mean: deviations of its parameters. [their unit]
        between: what an onset between those that were tried may gain more.
        kappa: the most probable scale of the tolerances.
    """

    effect: Effect
    time: float
    record: int
    log_gain: float
    mean: np.ndarray
    between: float = 0.0
    kappa: float = 1.0

    @property
    def with_onset(self) -> Effect:
        """The effect with that onset."""
        return with_onset(self.effect, self.time)

    @property
    def id(self) -> str:
        """Such as "rudder_offset@12"."""
        return self.with_onset.id


Begun = tuple[Effect, float]
"""An effect, and its onset. [s]"""


class BaseRun(NamedTuple):
    """A simulation to take sensitivities from: of a problem with deviations z of all its entries."""

    problem: Problem
    z: np.ndarray


class LinearisationPoint(NamedTuple):
    """A linear problem of all parameters that hold throughout, and the simulation that sensitivities are taken from;
    a force or a change point that the simulation has in addition is part of the linearisation.
    """

    fit: Fit
    along: BaseRun


def spacing_of(problem: Problem, record: int) -> float:
    """Return the spacing of the grid of onsets. [s]"""
    return max(float(problem.records[record].time[-1]) / COARSE_ONSETS, MIN_ONSET_SPACING_S)


def times_of(problem: Problem, record: int) -> list[float]:
    """Return the onsets that are tried: a grid within a record, without its ends. [s]"""
    spacing = spacing_of(problem, record)
    return [
        float(time)
        for time in np.arange(spacing, float(problem.records[record].time[-1]) - 0.5 * spacing, spacing)
    ]


def scan(
    point: LinearisationPoint,
    D: np.ndarray,
    effects: Sequence[Effect],
    record: int = 0,
    *,
    best: int = 3,
) -> list[ChangePoint]:
    """Return every effect with a change point at its best onset, most probable first; the `best` of them on a finer
    grid around each peak of about the same height: a jam that begins between two commands has several peaks.

    Args:
        point: close to the data.
        D: prior variances of the entries (k,).
        effects: of the catalogue; those that cannot begin in mid-trial are left out.
        record: in which they begin.
        best: how many are tried on the finer grid.
    """
    along, spacing = in_rough_steps(point.along), spacing_of(point.along.problem, record)
    columns = onset_columns(along, effects, record)
    found = _tried(point, D, columns, record)
    first = _strongest(found)
    worth = [candidate for candidate in first[:best] if candidate.log_gain > settings.SCAN_GAIN_NATS]
    near = [(candidate.effect, time) for candidate in worth for time in _peaks(candidate, found)]
    finer = list(dict.fromkeys((effect, at) for effect, time in near for at in _around(time, spacing)))
    if not finer:
        return first
    columns = dict(zip(finer, change_point_columns(along, finer, record), strict=True))
    return _strongest(found + _tried(point, D, columns, record))


def _peaks(best: ChangePoint, found: list[ChangePoint]) -> list[float]:
    """Return the onsets of a grid at which an effect gains about as much as at the best one, the best one first."""
    least = best.log_gain - settings.LINEAR_NATS
    alike = [
        candidate
        for candidate in found
        if candidate.effect.id == best.effect.id and candidate.log_gain > least
    ]
    return [
        each.time for each in sorted(alike, key=lambda candidate: -candidate.log_gain)[: settings.MAX_TRIED]
    ]


def in_rough_steps(along: BaseRun) -> BaseRun:
    """Return a simulation in coarser steps, accurate enough to scan for onsets."""
    return along._replace(problem=along.problem.roughly(along.z))


def onset_columns(along: BaseRun, effects: Sequence[Effect], record: int) -> dict[Begun, np.ndarray]:
    """Return whitened sensitivities (m, parameters) to every effect that begins at each onset of a grid."""
    able = [effect for effect in effects if effect.sudden]
    coarse = times_of(along.problem, record)
    steps = [(candidate, time) for candidate in able if not candidate.grows for time in coarse]
    columns = dict(zip(steps, change_point_columns(along, steps, record), strict=True))
    return columns | grown(
        [candidate for candidate in able if candidate.grows], columns, spacing_of(along.problem, record)
    )


def grown(
    effects: Sequence[Effect], columns: Mapping[Begun, np.ndarray], spacing: float
) -> dict[Begun, np.ndarray]:
    """Return the columns of effects that grow from each onset of a grid, without any simulation.

    An effect that grows from t₀ on is a sum of steps, ∫ step(t − s) ds from t₀ to the end; by the trapezoidal rule,
    where the last step, at the end, does nothing: within 2 to 5 % of the simulated columns, for onsets well before
    the end. No columns where the grid has no steps of the effect that grows.
    """
    found = dict[Begun, np.ndarray]()
    for effect in effects:
        total: np.ndarray | float = 0.0
        own = {time: C for (candidate, time), C in columns.items() if candidate.id == effect.grows}
        for time in sorted(own, reverse=True):
            found[effect, time] = (total + 0.5 * own[time]) * spacing / MINUTE_S
            total = total + own[time]
    return found


def _around(time: float, spacing: float) -> list[float]:
    """Return the onsets of the fine grid between one of the coarse grid and its neighbours."""
    finer = [time + i * spacing / FINE_PER_COARSE for i in range(1 - FINE_PER_COARSE, FINE_PER_COARSE) if i]
    return [round(candidate, 6) for candidate in finer]  # those of two neighbours are the same


def _strongest(found: list[ChangePoint]) -> list[ChangePoint]:
    """Return the best onset of every effect, most probable first."""
    ranked = sorted(found, key=lambda candidate: -candidate.log_gain)
    first = {candidate.effect.id: candidate for candidate in reversed(ranked)}
    return [
        replace(each, between=_between(each, found))
        for each in sorted(first.values(), key=lambda candidate: -candidate.log_gain)
    ]


def _between(best: ChangePoint, found: list[ChangePoint]) -> float:
    """Return by how much a parabola through the gains at an effect's best onset and its neighbours rises above the
    best.
    """
    at = {candidate.time: candidate for candidate in found if candidate.effect.id == best.effect.id}
    own = [at[time] for time in sorted(at)]
    k = next(k for k, candidate in enumerate(own) if candidate.time == best.time)
    if not 0 < k < len(own) - 1:
        return 0.0
    times, gains = (
        [getattr(candidate, name) for candidate in own[k - 1 : k + 2]] for name in ("time", "log_gain")
    )
    a, b, c = np.polyfit(np.array(times) - best.time, gains, 2)
    return float(c - b * b / (4.0 * a) - best.log_gain) if a < 0.0 else 0.0


def _tried(
    point: LinearisationPoint, D: np.ndarray, columns: Mapping[Begun, np.ndarray], record: int
) -> list[ChangePoint]:
    """Return effects with onsets and their linear evidence, from their whitened sensitivities."""
    fit, made = point.fit, list(columns.values())
    q, whole = fit.quadratic, fit.r + fit.J @ fit.z
    sizes, data = (
        np.cumsum([0, *(C.shape[1] for C in made)]),
        seen(q.A, q.b, D, fit.J, np.hstack(made), whole),
    )
    found = []
    for (effect, time), first, last in zip(columns, sizes[:-1], sizes[1:], strict=True):
        own = slice(first, last)
        log, mean = gain_of(ForceInformation(data.M[own, own], data.q[own]), effect)
        found.append(ChangePoint(effect=effect, time=time, record=record, log_gain=log, mean=mean))
    return found


def gain_of(data: ForceInformation, effect: Effect) -> tuple[float, np.ndarray]:
    """Return the log evidence of an effect over that without it, and the mean of its deviations."""
    variance = np.array([parameter.scale**2 for parameter in effect.parameters])
    inner = np.eye(variance.size) + variance[:, None] * data.M
    M = np.linalg.solve(inner, np.diag(variance))
    mean = M @ data.q
    log = 0.5 * float(data.q @ mean) - 0.5 * float(np.linalg.slogdet(inner)[1])
    said = Posterior(z=mean, M=M, log_evidence=log, log_det=float(np.linalg.slogdet(inner)[1]))
    entries, every = [Entry(effect, i, -1) for i in range(variance.size)], range(variance.size)
    log += possible(entries, every, mean, np.sqrt(np.diag(M))) + of_sizes(
        entries, said, variance, [every], PRACTICAL_TOLERANCES_SUDDEN
    )
    return log, mean


SAME_RUN_LEVELS = 1.0
"""Simulations that differ by less than this many levels of the noise (root mean square of each channel) share the
responses to onsets: sensitivities then differ by less than the error of their finite differences. [-]
"""
MOST_RUNS_KEPT = 6
"""The responses to onsets are kept for so many simulations, the last ones."""


class OnsetResponses(NamedTuple):
    """Responses to onsets along a simulation.

    Attributes:
        setting: the nominal one of the record.
        time: of its samples (n,). [s]
        shown: the simulated record, channel → (n,).
        changes: (effect, onset) → channel → response to a unit of each parameter (n, parameters).
    """

    setting: Setting
    time: np.ndarray
    shown: Mapping[str, np.ndarray]
    changes: dict[tuple[str, float], dict[str, np.ndarray]]

    def serves(self, other: OnsetResponses, seen: Observed) -> bool:
        """Say whether the responses along another simulation of the same record can be used for this one."""
        if (
            self.setting is not other.setting
            or self.time is not other.time
            or self.shown.keys() != other.shown.keys()
        ):
            return False
        apart = [
            float(np.mean((self.shown[name] - other.shown[name]) ** 2)) / noise.sd**2
            for name, noise in seen.noise.items()
        ]
        return max(apart) < SAME_RUN_LEVELS**2


def change_point_columns(along: BaseRun, pairs: Sequence[Begun], record: int = 0) -> list[np.ndarray]:
    """Return whitened sensitivities (m, parameters) to each (effect, time) in one record; finite differences of a
    small step, along the simulation or one that differs by less than the noise.
    """
    problem, seen = along.problem, along.problem.records[record]
    known = _responses_along(along, record)
    known.changes.update(
        _changes(
            along,
            [(candidate, time) for candidate, time in pairs if (candidate.id, time) not in known.changes],
            record,
        )
    )
    first, size = _rows(problem, record)
    found: list[np.ndarray] = []
    for effect, time in pairs:
        C, change = np.zeros((size, len(effect.parameters))), known.changes[effect.id, time]
        own = np.concatenate([noise.whiten(change[name]) for name, noise in seen.noise.items()])
        C[first : first + own.shape[0]] = np.nan_to_num(own)
        found.append(C)
    return found


def _responses_along(along: BaseRun, record: int) -> OnsetResponses:
    """Return the cached responses along a simulation that is close enough, or an empty set along this one; the last
    ones are kept.
    """
    (problem, z), kept = along, along.problem.kept.onsets
    seen, (track,) = problem.records[record], problem.tracks([(record, z)])
    here = OnsetResponses(
        seen.setting, seen.time, problem.shown(record, _plain(problem, record, z), track), {}
    )
    for known in kept:
        if here.serves(known, seen):
            return known
    kept[:] = [*kept[1 - MOST_RUNS_KEPT :], here]
    return here


def _changes(
    along: BaseRun, pairs: Sequence[Begun], record: int
) -> dict[tuple[str, float], dict[str, np.ndarray]]:
    """Return the responses to onsets along a simulation: (effect, onset) → channel → (n, parameters)."""
    problem, z = along
    base, steps = _plain(problem, record, z), [np.diag(_steps(effect)) for effect, _ in pairs]
    jobs = [
        (with_onset(effect, time).apply(base, *row.tolist()), time)
        for (effect, time), rows in zip(pairs, steps, strict=True)
        for row in rows
    ]
    if not jobs:
        return {}
    problem.kept.count(1 + len(jobs))
    plain, stops = with_stops(base, {time for _, time in jobs})
    tracks = problem.pool.map(partial(_run, stops), jobs)
    setting = problem.setting(record, z)
    shown, found = problem.shown(record, setting, plain), {}
    for (effect, time), rows in zip(pairs, steps, strict=True):
        moved = [problem.shown(record, setting, track) for track in islice(tracks, len(rows))]
        found[effect.id, time] = {
            name: np.column_stack(
                [(candidate[name] - own) / step for candidate, step in zip(moved, np.diag(rows), strict=True)]
            )
            for name, own in shown.items()
        }
    return found


def _steps(effect: Effect) -> list[float]:
    """Return the finite-difference step of each parameter, towards the farther bound."""
    return [
        SECANT_SCALES * parameter.scale * (1.0 if parameter.high >= -parameter.low else -1.0)
        for parameter in effect.parameters
    ]


def _plain(problem: Problem, record: int, z: np.ndarray) -> Setting:
    """Return the setting of a record, with sensors free of errors."""
    return problem.setting(record, z, late=False)


def _run(stops: Mapping[float, Stop], job: tuple[Setting, float]) -> Track:
    """Return the track of a setting that differs from a time on; resumed from there, if the base simulation got that
    far.
    """
    setting, time = job
    return simulate_on(setting, stops[time]) if time in stops else simulate_track(setting)


def _rows(problem: Problem, record: int) -> tuple[int, int]:
    """Return the first row of a record in the residual, and the number of all rows."""
    sizes = [sum(noise.count for noise in each.noise.values()) for each in problem.records]
    return sum(sizes[:record]), sum(sizes)


def with_change_point(problem: Problem, change_point: ChangePoint) -> Problem:
    """Return the problem with the parameters of an effect with a change point, and its onset, appended to its
    entries.
    """
    effect = with_free_onset(
        change_point.effect, change_point.time, float(problem.records[change_point.record].time[-1])
    )
    more = tuple(Entry(effect, i, change_point.record) for i in range(len(effect.parameters)))
    return replace(problem, entries=(*problem.entries, *more))


class RankedChangePoint(NamedTuple):
    """A cause with a change point in the linear problem at a linearisation point: log posterior, on the scale of
    `FittedChangePoint`; start of its fit, all entries and its parameters, if that is not the optimum of the linear
    problem.
    """

    log_posterior: float
    change_point: ChangePoint
    point: LinearisationPoint
    start: np.ndarray | None = None

    def at_most(self, share: float) -> float:
        """Return the log posterior that its fit may reach, if non-linearity hides that share of its gain."""
        return self.log_posterior + self.change_point.between + share * max(self.change_point.log_gain, 0.0)


def ranked_in(
    problem: Problem, point: LinearisationPoint, able: Sequence[Effect], record: int
) -> list[RankedChangePoint]:
    """Return every cause with a change point at its best onset, in the linear problem at a linearisation point."""
    here = _log_none(problem, point.fit, record)
    found = scan(point, variances(problem.entries, (), 1.0), able, record)
    return [RankedChangePoint(here + candidate.log_gain, candidate, point) for candidate in found]


def ranked_by_runs(
    problem: Problem, candidate: Candidate, able: Sequence[Effect], record: int
) -> list[RankedChangePoint]:
    """Return the causes of a hypothesis with their best onsets, by simulations from its fit: for an effect that
    nearly stops in mid-trial, the response to a small change is uninformative.
    """
    return [_large(problem, candidate.fit, effect, record) for effect in able if effect.id in candidate.ids]


def _large(problem: Problem, fit: Fit, effect: Effect, record: int) -> RankedChangePoint:
    """Return a cause at its best onset and size, all other parameters at the optimum of the linear problem there."""
    own, times = columns_of(problem.entries, (effect.id,)), times_of(problem, record)
    low, high = bounds(problem)
    without = fit.z.copy()
    without[own] = 0.0
    first = ChangePoint(effect=effect, time=times[0], record=record, log_gain=-np.inf, mean=fit.z[own])
    sizes = [np.clip(share * fit.z[own], low[own], high[own]) for share in settings.LATER_SIZES]
    jobs = [replace(first, time=time, mean=size) for time in times for size in sizes]
    at = [np.concatenate([without, job.mean, [job.time - first.time]]) for job in jobs]
    point, none = LinearisationPoint(fit, BaseRun(problem, fit.z)), _log_none(problem, fit, record)
    tried = [
        _at_size(problem, RankedChangePoint(none, job, point), without, r)
        for job, r in zip(jobs, with_change_point(problem, first).residuals(at), strict=True)
    ]
    return max(tried, key=lambda candidate: candidate.log_posterior)


def _at_size(
    problem: Problem, none: RankedChangePoint, without: np.ndarray, r: np.ndarray
) -> RankedChangePoint:
    """Return a cause at an onset and a size, ranked by the residual there; `none` is the model without it."""
    if not np.isfinite(r).all():
        return none._replace(log_posterior=-np.inf)
    change_point, D = none.change_point, variances(problem.entries, (), 1.0)
    there = posterior(Quadratic.at(without, r, none.point.fit.J), D)
    scale = np.array([parameter.scale for parameter in change_point.effect.parameters])
    far = 0.5 * float(np.sum((change_point.mean / scale) ** 2)) + scale.size
    nothing = posterior(none.point.fit.quadratic, D).log_evidence
    gain = there.log_evidence - far - nothing
    change_point, start = replace(change_point, log_gain=gain), np.append(there.z, change_point.mean)
    return RankedChangePoint(none.log_posterior + gain, change_point, none.point, start)


def _log_none(problem: Problem, fit: Fit, record: int) -> float:
    """Return the log posterior without a cause in the linear problem of a fit, with the log prior of an onset."""
    log = posterior(fit.quadratic, variances(problem.entries, (), 1.0)).log_evidence
    any_time = -float(np.log(len(times_of(problem, record))))
    return log + float(np.log(KAPPAS[1.0])) + log_prior((), len(nameable(problem.entries))) + any_time
