"""The gain of a few causes for a record, in the linear problem: compared with the gain of an error in its data.

    G = max over sets of at most MAX_CAUSES terms of  log p(y | terms) p(terms) − log p(y | nothing) p(nothing)

A term is a cause, throughout or from an onset of a grid on, as a late clock looks like a change point. The term that
gains most is added to the set, until no term gains; the scales of the noise are estimated again for each set, as in
`data_error_saturated_model`, which has only no cause and single causes (`most_of_physics`). For a large cause the
linear problem at the nominal model is inaccurate: it is simulated at some sizes, and linearised again at the optimum
(`most_of_one_cause`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.hypotheses import MAX_CAUSES, PRIOR, columns_of, nameable, variances
from subzero.diagnosis.inference.change_point_scan import (
    BaseRun,
    Begun,
    gain_of,
    in_rough_steps,
    onset_columns,
)
from subzero.diagnosis.inference.data_error_saturated_model import (
    KAPPA_NARROW,
    Evidence,
    Term,
    evidence_of_terms,
    generous_variances,
    least_scale,
    stacked,
    to_usual_sizes,
)
from subzero.diagnosis.inference.linear_gaussian import ForceInformation, Posterior, freed, seen
from subzero.diagnosis.inference.map_fit import bounds
from subzero.diagnosis.inference.problem import Problem, sizes_run
from subzero.diagnosis.inference.settings import MAX_ADDED, MERGED_SCALES


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear:
    """The linear problem of a record at the nominal model, whitened with the noise of usual sensors.

    Attributes:
        r: residual (m,).
        J: sensitivities to the free parameters (m, k).
        D: prior variances (k,).
        own: channel → its rows.
        bare: channel → its `Term` without the products of r and J.
    """

    r: np.ndarray
    J: np.ndarray
    D: np.ndarray
    own: Mapping[str, slice]
    bare: Mapping[str, Term]

    def reckoned(self) -> Evidence:
        """Return its evidence, with the best scales of the noise."""
        return evidence_of_terms(
            stacked({name: self._term(name, rows) for name, rows in self.own.items()}), self.D
        )

    def _term(self, name: str, rows: slice) -> Term:
        r, J = self.r[rows], self.J[rows]
        return self.bare[name]._replace(A=J.T @ J, b=J.T @ r, rr=float(r @ r))

    def scaled(self, scales: Mapping[str, float], values: np.ndarray) -> np.ndarray:
        """Return values (m, …) in noise of these scales."""
        found = values.copy()
        for name, rows in self.own.items():
            found[rows] /= scales[name]
        return found


class Further(NamedTuple):
    """A further term: its log prior, the approximate log evidence with it, and the linear problem with it."""

    log_prior: float
    log_evidence: float
    beside: Callable[[], Linear]


def most_of_physics(problem: Problem, record: int) -> float:
    """Return the log odds of a few causes, throughout or from mid-trial on, against none. [nat]

    Args:
        problem: of all records as they are, as posed.
        record: its number.
    """
    here = _linear(problem, record)
    started = _onset_responses(problem, record, here)
    now, log_prior = here.reckoned(), float(np.log(PRIOR["none"]))
    best = none = now.log + log_prior
    for _ in range(MAX_CAUSES):
        further = [*_causes(problem, here, now), *_onsets(problem, here, now, started)]
        found = max(further, key=lambda each: each.log_evidence + each.log_prior)
        here, log_prior = found.beside(), log_prior + found.log_prior
        now = here.reckoned()
        if now.log + log_prior <= best:
            break
        best = now.log + log_prior
    return best - none


def most_of_one_cause(problem: Problem, record: int) -> float:
    """Return the log odds of the best cause against none, where large ones are simulated: the linear problem at the
    nominal model is inaccurate for them. The best ones at some sizes are linearised again at the optimum of the
    linear problem there. [nat]

    Args:
        problem: of all records as they are, as posed.
        record: its number.
    """
    here, names = _linear(problem, record), nameable(problem.entries)
    none = here.reckoned().log + float(np.log(PRIOR["none"]))
    best: dict[str, Evidence] = {}
    for k, there in _at_sizes(problem, record, here):
        now, name = there.reckoned(), problem.entries[k].effect.id
        best[name] = max(now, best.get(name, now), key=lambda fit: fit.log)
    logs = [fit.log for fit in best.values()]
    for name in sorted(best, key=lambda name: -best[name].log)[:MAX_ADDED]:
        logs += _closer_by(problem, record, name, best[name])
    return max(logs, default=-np.inf) + float(np.log(PRIOR["single"] / len(names))) - none


def _closer_by(problem: Problem, record: int, name: str, now: Evidence) -> Iterator[float]:
    """Yield the log evidence of a cause each time it is linearised at the optimum of the linear problem before."""
    for _ in range(MAX_ADDED):
        there = _linear(problem, record, np.clip(now.z, *bounds(problem)))
        if not np.isfinite(there.r).all():
            return
        now = replace(there, D=_with_free(problem, there.D, name)).reckoned()
        yield now.log


def _at_sizes(problem: Problem, record: int, here: Linear) -> Iterator[tuple[int, Linear]]:
    """Yield the linear problem of a record at each simulated size of each entry, with its cause free."""
    zero, entries = np.zeros(len(problem.entries)), problem.entries
    at = [k for k, entry in enumerate(entries) if entry.record < 0]
    for fit in sizes_run(problem, zero, here.r, at, MERGED_SCALES, [record]):
        J, D = here.J.copy(), _with_free(problem, here.D, entries[fit.k].effect.id)
        J[:, fit.k] = fit.column
        yield fit.k, replace(here, r=fit.r + fit.column * fit.z[fit.k], J=J, D=D)


def _with_free(problem: Problem, D: np.ndarray, name: str) -> np.ndarray:
    """Return prior variances (k,) with the prior variance of a free cause."""
    at = columns_of(problem.entries, (name,))
    D = D.copy()
    D[at] = generous_variances(problem)[at]
    return D


def _linear(problem: Problem, record: int, z: np.ndarray | None = None) -> Linear:
    """Return the linear problem of a record at deviations z (k,), or at the nominal model, with wide tolerances;
    entries that have no effect while they are small are moved to a usual size.
    """
    z, seen_ = np.zeros(len(problem.entries)) if z is None else z, problem.records[record]
    places = [k for k, entry in enumerate(problem.entries) if entry.record in (-1, record)]
    moved = [to_usual_sizes(problem, k, z) for k in places]
    base, *tracks = problem.tracks([(record, each) for each in (z, *moved)])
    setting = problem.setting(record, z)
    plain = problem.whitened(record, setting, base)
    J = np.zeros((plain.size, z.size))
    for k, fit, track in zip(places, moved, tracks, strict=True):
        there = problem.whitened(record, problem.setting(record, fit), track)
        J[:, k] = np.nan_to_num((there - plain) / (fit[k] - z[k]))
    ends = np.cumsum([0, *(noise.count for noise in seen_.noise.values())]).tolist()
    own = {name: slice(a, b) for name, a, b in zip(seen_.noise, ends[:-1], ends[1:], strict=True)}
    nothing = np.zeros(0)
    bare = {
        name: Term(nothing, nothing, 0.0, noise.count, -noise.log_scale, least_scale(noise), noise.count)
        for name, noise in seen_.noise.items()
    }
    r = problem.whitened(record, setting, base, measured=True) + J @ z
    return Linear(r=r, J=J, D=variances(problem.entries, (), KAPPA_NARROW), own=own, bare=bare)


def _onset_responses(problem: Problem, record: int, here: Linear) -> dict[Begun, np.ndarray]:
    """Return the responses to causes that begin at onsets of a grid, in the rows of a record (m, parameters)."""
    along = in_rough_steps(BaseRun(problem, np.zeros(len(problem.entries))))
    before = sum(noise.count for each in problem.records[:record] for noise in each.noise.values())
    columns = onset_columns(along, problem.sudden_effects, record)
    return {pair: C[before : before + here.r.size] for pair, C in columns.items()}


def _causes(problem: Problem, here: Linear, now: Evidence) -> Iterator[Further]:
    """Yield every cause that holds throughout."""
    names, wide = nameable(problem.entries), generous_variances(problem)
    base = Posterior(z=now.z, M=now.M, log_evidence=now.log, log_det=0.0)
    price = float(np.log(PRIOR["single"] / len(names)))
    for name in names:
        at = columns_of(problem.entries, (name,))
        D = here.D.copy()
        D[at] = wide[at]
        if not np.array_equal(D, here.D):
            yield Further(price, float(freed(base, here.D, at, D[at])[0]), partial(replace, here, D=D))


def _onsets(
    problem: Problem, here: Linear, now: Evidence, started: Mapping[Begun, np.ndarray]
) -> Iterator[Further]:
    """Yield every cause with every onset."""
    if not started:
        return
    J, r = here.scaled(now.scales, here.J), here.scaled(now.scales, here.r)
    C = here.scaled(now.scales, np.hstack(list(started.values())))
    data = seen(J.T @ J, J.T @ r, here.D, J, C, r)
    ends = np.cumsum([0, *(columns.shape[1] for columns in started.values())]).tolist()
    price = float(np.log(PRIOR["sudden"] / len(started)))
    for (effect, time), a, b in zip(started, ends[:-1], ends[1:], strict=True):
        gain = gain_of(ForceInformation(data.M[a:b, a:b], data.q[a:b]), effect)[0]
        more = np.array([parameter.scale**2 for parameter in effect.parameters])
        yield Further(price, now.log + gain, partial(_with_columns, here, started[effect, time], more))


def _with_columns(here: Linear, C: np.ndarray, D: np.ndarray) -> Linear:
    """Return a linear problem with further columns (m, p), and their prior variances (p,)."""
    return replace(here, J=np.hstack([here.J, C]), D=np.append(here.D, D))
