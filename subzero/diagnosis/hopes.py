"""Which causes that begin in mid-trial have any hope, before one is fitted: every one from every time, in the linear
problem of a place; and those that hold throughout in a hypothesis, by real runs, as large as they are there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.effect import Effect
from subzero.diagnosis.evidence import KAPPAS, Quadratic, posterior
from subzero.diagnosis.hypotheses import log_prior, named, places, variances
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.stride import bounds
from subzero.diagnosis.sudden import Along, Begun, Place, scan, times_of, with_begun

LARGER = (1.0, 1.5)
"""A cause that begins late is larger than one that holds throughout."""


class Hope(NamedTuple):
    """A sudden cause in the linear problem of a place: log posterior, as of `Struck`; where its fit begins, all entries
    and its parameters, if that is not the best of the linear problem.
    """

    log_posterior: float
    begun: Begun
    place: Place
    start: np.ndarray | None = None

    def at_most(self, bent: float) -> float:
        """Return the log posterior that its fit may have, if that share of what it gains is not linear."""
        return self.log_posterior + self.begun.between + bent * max(self.begun.log_gain, 0.0)


def hopes_in(problem: Problem, place: Place, able: Sequence[Effect], record: int) -> list[Hope]:
    """Return every sudden cause at its best time, in the linear problem of a place."""
    here = _log_none(problem, place.fit, record)
    found = scan(place, variances(problem.entries, (), 1.0), able, record)
    return [Hope(here + one.log_gain, one, place) for one in found]


def large_hopes(problem: Problem, one: Candidate, able: Sequence[Effect], record: int) -> list[Hope]:
    """Return the causes of a hypothesis from their best times on, by real runs from its fit: what nearly stops in
    mid-trial says little where it is changed a little.
    """
    return [_large(problem, one.fit, effect, record) for effect in able if effect.id in one.ids]


def _large(problem: Problem, fit: Fit, effect: Effect, record: int) -> Hope:
    """Return a cause at its best time and size, all else the best of the linear problem there."""
    own, times = places(problem.entries, (effect.id,)), times_of(problem, record)
    low, high = bounds(problem)
    without = fit.z.copy()
    without[own] = 0.0
    first = Begun(effect=effect, time=times[0], record=record, log_gain=-np.inf, mean=fit.z[own])
    sizes = [np.clip(share * fit.z[own], low[own], high[own]) for share in LARGER]
    jobs = [replace(first, time=time, mean=size) for time in times for size in sizes]
    at = [np.concatenate([without, one.mean, [one.time - first.time]]) for one in jobs]
    place, none = Place(fit, Along(problem, fit.z)), _log_none(problem, fit, record)
    tried = [_at_size(problem, Hope(none, one, place), without, r)
             for one, r in zip(jobs, with_begun(problem, first).residuals(at), strict=True)]  # fmt: skip
    return max(tried, key=lambda one: one.log_posterior)


def _at_size(problem: Problem, none: Hope, without: np.ndarray, r: np.ndarray) -> Hope:
    """Return the hope of a cause at a time and a size, with the residual there; `none` has that of nothing."""
    if not np.isfinite(r).all():
        return none._replace(log_posterior=-np.inf)
    begun, D = none.begun, variances(problem.entries, (), 1.0)
    there = posterior(Quadratic.at(without, r, none.place.fit.J), D)
    scale = np.array([one.scale for one in begun.effect.parameters])
    far = 0.5 * float(np.sum((begun.mean / scale) ** 2)) + scale.size
    nothing = posterior(none.place.fit.quadratic, D).log_evidence
    gain = there.log_evidence - far - nothing
    begun, start = replace(begun, log_gain=gain), np.append(there.z, begun.mean)
    return Hope(none.log_posterior + gain, begun, none.place, start)


def _log_none(problem: Problem, fit: Fit, record: int) -> float:
    """Return the log posterior of nothing in the linear problem of a fit, and of any time at which it might begin."""
    log = posterior(fit.quadratic, variances(problem.entries, (), 1.0)).log_evidence
    any_time = -float(np.log(len(times_of(problem, record))))
    return log + float(np.log(KAPPAS[1.0])) + log_prior((), len(named(problem))) + any_time
