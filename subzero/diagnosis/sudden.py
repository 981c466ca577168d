"""Effects that begin in the middle of a trial, in a linear problem: which, and when?

Every sudden effect is tried from every time of a grid, in the linear problem with all tolerances free; the best one
again on a finer grid. What is left out: effects that end again, and two that begin at different times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.begun import beginning, begun_at
from subzero.diagnosis.candidate import possible
from subzero.diagnosis.effect import Effect
from subzero.diagnosis.entries import Entry
from subzero.diagnosis.latent import Seen, seen
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.setting import Setting
from subzero.diagnosis.tracked import Stop, Track, on_from, tracked, with_stops

COARSE, FINE, LEAST = 15, 4, 1.0
"""A record has so many steps of times to begin at, each so many finer ones, but none is shorter than the last. [s]"""
SEEN = 3.0
"""What gains less, in log evidence, is not tried on the finer grid."""
SECANT = 0.25
"""Step of a sensitivity, in effect scales."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Begun:
    """A sudden effect in the linear problem.

    Attributes:
        effect: as it holds throughout.
        time: when it begins. [s]
        record: in which record; a sudden effect is an event of one trial.
        log_gain: log evidence over that of no such effect.
        mean: deviations of its parameters. [their unit]
        between: what a time between those that were tried may gain more.
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
    def begun(self) -> Effect:
        """The effect as it begins at that time."""
        return begun_at(self.effect, self.time)

    @property
    def id(self) -> str:
        """Such as "rudder_offset@12"."""
        return self.begun.id


class Along(NamedTuple):
    """A run to take sensitivities from: of a problem with deviations z of all its entries."""

    problem: Problem
    z: np.ndarray


class Place(NamedTuple):
    """A linear problem of all that holds throughout, and the run that sensitivities are taken from; what the run has
    besides (a force, a sudden cause) is part of what the records show.
    """

    fit: Fit
    along: Along


def spacing_of(problem: Problem, record: int) -> float:
    """Return the steps of the times to begin at. [s]"""
    return max(float(problem.records[record].time[-1]) / COARSE, LEAST)


def times_of(problem: Problem, record: int) -> list[float]:
    """Return times to begin at: a grid within a record, without its ends. [s]"""
    spacing = spacing_of(problem, record)
    return [
        float(time)
        for time in np.arange(spacing, float(problem.records[record].time[-1]) - 0.5 * spacing, spacing)
    ]


def scan(
    place: Place,
    D: np.ndarray,
    effects: Sequence[Effect],
    record: int = 0,
    *,
    best: int = 3,
) -> list[Begun]:
    """Return every sudden effect at its best time, most probable first; the `best` of them with finer times.

    Args:
        place: close to the data.
        D: prior variances of the entries (k,).
        effects: of the catalogue; those that are not sudden are left out.
        record: in which they begin.
        best: how many are tried on the finer grid.
    """
    able = [effect for effect in effects if effect.sudden]
    coarse = times_of(place.along.problem, record)
    found = _strongest(_tried(place, D, [(one, time) for one in able for time in coarse], record))
    spacing = spacing_of(place.along.problem, record)
    worth = [one for one in found[:best] if one.log_gain > SEEN]
    finer = [(one.effect, time) for one in worth for time in _around(one.time, spacing)]
    return _strongest(found + _tried(place, D, finer, record)) if finer else found


def _around(time: float, spacing: float) -> list[float]:
    """Return the finer times between a time of the grid and its neighbours."""
    return [time + i * spacing / FINE for i in range(1 - FINE, FINE) if i]


def _strongest(found: list[Begun]) -> list[Begun]:
    """Return the best time of every effect, most probable first."""
    ranked = sorted(found, key=lambda one: -one.log_gain)
    first = {one.effect.id: one for one in reversed(ranked)}
    return [
        replace(one, between=_between(one, found))
        for one in sorted(first.values(), key=lambda one: -one.log_gain)
    ]


def _between(best: Begun, found: list[Begun]) -> float:
    """Return how far a parabola through an effect's best time and its neighbours rises above it."""
    at = {one.time: one for one in found if one.effect.id == best.effect.id}
    own = [at[time] for time in sorted(at)]
    k = next(k for k, one in enumerate(own) if one.time == best.time)
    if not 0 < k < len(own) - 1:
        return 0.0
    times, gains = ([getattr(one, name) for one in own[k - 1 : k + 2]] for name in ("time", "log_gain"))
    a, b, c = np.polyfit(np.array(times) - best.time, gains, 2)
    return float(c - b * b / (4.0 * a) - best.log_gain) if a < 0.0 else 0.0


def _tried(place: Place, D: np.ndarray, pairs: list[tuple[Effect, float]], record: int) -> list[Begun]:
    """Return the linear evidence of effects that begin at times."""
    fit = place.fit
    q, whole = fit.quadratic, fit.r + fit.J @ fit.z
    made = columns(place.along, pairs, record)
    sizes, data = (
        np.cumsum([0, *(C.shape[1] for C in made)]),
        seen(q.A, q.b, D, fit.J, np.hstack(made), whole),
    )
    found = []
    for (effect, time), first, last in zip(pairs, sizes[:-1], sizes[1:], strict=True):
        own = slice(first, last)
        log, mean = _gain(Seen(data.M[own, own], data.q[own]), effect)
        found.append(Begun(effect=effect, time=time, record=record, log_gain=log, mean=mean))
    return found


def _gain(data: Seen, effect: Effect) -> tuple[float, np.ndarray]:
    """Return the log evidence of an effect over that of none, and the mean of its deviations."""
    variance = np.array([parameter.scale**2 for parameter in effect.parameters])
    inner = np.eye(variance.size) + variance[:, None] * data.M
    M = np.linalg.solve(inner, np.diag(variance))
    mean = M @ data.q
    log = 0.5 * float(data.q @ mean) - 0.5 * float(np.linalg.slogdet(inner)[1])
    entries = [Entry(effect, i, -1) for i in range(variance.size)]
    return log + possible(entries, range(variance.size), mean, np.sqrt(np.diag(M))), mean


def columns(along: Along, pairs: Sequence[tuple[Effect, float]], record: int = 0) -> list[np.ndarray]:
    """Return whitened sensitivities (m, parameters) to each (effect, time) in one record; secants of a small step."""
    problem, z = along
    base, steps = _plain(problem, record, z), [np.diag(_steps(effect)) for effect, _ in pairs]
    jobs = [(begun_at(effect, time).apply(base, *row.tolist()), time)
            for (effect, time), rows in zip(pairs, steps, strict=True) for row in rows]  # fmt: skip
    problem.kept.count(1 + len(jobs))
    plain, stops = with_stops(base, {time for _, time in jobs})
    tracks = [plain, *problem.pool.map(partial(_run, stops), jobs)]
    shown = problem.setting(record, z)
    seen_of = [problem.whitened(record, shown, track) for track in tracks]
    first, size = _rows(problem, record)
    changes, at = np.array(seen_of[1:]) - seen_of[0], 0
    found: list[np.ndarray] = []
    for rows in steps:
        C = np.zeros((size, rows.shape[0]))
        own = changes[at : at + rows.shape[0]] / np.diag(rows)[:, None]
        C[first : first + own.shape[1]] = np.nan_to_num(own.T)
        found, at = [*found, C], at + rows.shape[0]
    return found


def _steps(effect: Effect) -> list[float]:
    """Return the step of each parameter, to where there is more room."""
    return [SECANT * one.scale * (1.0 if one.high >= -one.low else -1.0) for one in effect.parameters]


def _plain(problem: Problem, record: int, z: np.ndarray) -> Setting:
    """Return the setting of a record, its sensors right."""
    return problem.setting(record, z, late=False)


def _run(stops: Mapping[float, Stop], job: tuple[Setting, float]) -> Track:
    """Return the track of a setting that differs from a time on; from there, if the run before it went as far."""
    setting, time = job
    return on_from(setting, stops[time]) if time in stops else tracked(setting)


def _rows(problem: Problem, record: int) -> tuple[int, int]:
    """Return where the rows of a record begin, and how many there are in all."""
    sizes = [sum(noise.count for noise in one.noise.values()) for one in problem.records]
    return sum(sizes[:record]), sum(sizes)


def with_begun(problem: Problem, begun: Begun) -> Problem:
    """Return the problem with a sudden effect's parameters and its time behind its entries."""
    effect = beginning(begun.effect, begun.time, float(problem.records[begun.record].time[-1]))
    more = tuple(Entry(effect, i, begun.record) for i in range(len(effect.parameters)))
    return replace(problem, entries=(*problem.entries, *more))
