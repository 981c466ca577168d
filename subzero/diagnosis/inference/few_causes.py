"""How far a few causes, throughout or from some time on, come towards a record, in the linear problem.

    G = max over sets of at most MAX_CAUSES terms of  log p(y | terms) p(terms) − log p(y | nothing) p(nothing)

A term is a cause, throughout or from some time of a grid on, which is what a late clock looks like. The set grows by
the term that gains most; the scales of the noise are found anew behind each set, as in `data_error_yardstick`, which
has nothing and single causes only. An error of the data that is far ahead of that needs no search of the record as it
is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.hypotheses import MAX_CAUSES, PRIOR, columns_of, nameable, variances
from subzero.diagnosis.inference.change_point_scan import BaseRun, Begun, gain_of, onset_columns
from subzero.diagnosis.inference.data_error_yardstick import (
    KAPPA_NARROW,
    Reckoned,
    Term,
    generous_variances,
    least_scale,
    reckon,
    to_usual_sizes,
)
from subzero.diagnosis.inference.linear_gaussian import ForceInformation, Posterior, freed, seen
from subzero.diagnosis.inference.problem import Problem


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear:
    """The linear problem of a record at the nominal model, whitened with the noise of usual sensors.

    Attributes:
        r: residual (m,).
        J: sensitivities to what is free (m, k).
        D: prior variances (k,).
        own: channel → its rows.
        bare: channel → what it says of nothing, but for its sums.
    """

    r: np.ndarray
    J: np.ndarray
    D: np.ndarray
    own: Mapping[str, slice]
    bare: Mapping[str, Term]

    def reckoned(self) -> Reckoned:
        """Return its evidence, with the scales of the noise that are best."""
        return reckon({name: self._term(name, rows) for name, rows in self.own.items()}, self.D)

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
    """A further term: its log prior, and about the log evidence with it; the linear problem then."""

    log_prior: float
    log_evidence: float
    beside: Linear


def most_of_physics(problem: Problem, record: int) -> float:
    """Return by how much a few causes, throughout or from mid-trial on, are more probable than none. [nat]

    Args:
        problem: of all records as they are, as posed.
        record: its number.
    """
    here = _linear(problem, record)
    begun = _begun(problem, record, here)
    now, log_prior = here.reckoned(), float(np.log(PRIOR["none"]))
    best = none = now.log + log_prior
    for _ in range(MAX_CAUSES):
        further = [*_causes(problem, here, now), *_onsets(problem, here, now, begun)]
        one = max(further, key=lambda each: each.log_evidence + each.log_prior)
        here, log_prior = one.beside, log_prior + one.log_prior
        now = here.reckoned()
        if now.log + log_prior <= best:
            break
        best = now.log + log_prior
    return best - none


def _linear(problem: Problem, record: int) -> Linear:
    """Return the linear problem of a record, with wide tolerances; what does nothing while it is small is moved to a
    usual size.
    """
    zero, seen_ = np.zeros(len(problem.entries)), problem.records[record]
    places = [k for k, entry in enumerate(problem.entries) if entry.record in (-1, record)]
    moved = [to_usual_sizes(problem, k) for k in places]
    base, *tracks = problem.tracks([(record, z) for z in (zero, *moved)])
    plain = problem.whitened(record, seen_.setting, base)
    J = np.zeros((plain.size, zero.size))
    for k, z, track in zip(places, moved, tracks, strict=True):
        J[:, k] = np.nan_to_num((problem.whitened(record, problem.setting(record, z), track) - plain) / z[k])
    ends = np.cumsum([0, *(noise.count for noise in seen_.noise.values())]).tolist()
    own = {name: slice(a, b) for name, a, b in zip(seen_.noise, ends[:-1], ends[1:], strict=True)}
    nothing = np.zeros(0)
    bare = {name: Term(nothing, nothing, 0.0, noise.count, -noise.log_scale, least_scale(noise), noise.count)
            for name, noise in seen_.noise.items()}  # fmt: skip
    r = problem.whitened(record, seen_.setting, base, measured=True)
    return Linear(r=r, J=J, D=variances(problem.entries, (), KAPPA_NARROW), own=own, bare=bare)


def _begun(problem: Problem, record: int, here: Linear) -> dict[Begun, np.ndarray]:
    """Return what causes that begin at times of a grid change in the rows of a record (m, parameters)."""
    along = BaseRun(problem, np.zeros(len(problem.entries)))
    before = sum(noise.count for one in problem.records[:record] for noise in one.noise.values())
    columns = onset_columns(along, problem.sudden_effects, record)
    return {pair: C[before : before + here.r.size] for pair, C in columns.items()}


def _causes(problem: Problem, here: Linear, now: Reckoned) -> Iterator[Further]:
    """Give every cause that holds throughout."""
    names, wide = nameable(problem.entries), generous_variances(problem)
    base = Posterior(z=now.z, M=now.M, log_evidence=now.log, log_det=0.0)
    price = float(np.log(PRIOR["single"] / len(names)))
    for name in names:
        at = columns_of(problem.entries, (name,))
        D = here.D.copy()
        D[at] = wide[at]
        if not np.array_equal(D, here.D):
            yield Further(price, freed(base, here.D, at, D[at])[0], replace(here, D=D))


def _onsets(
    problem: Problem, here: Linear, now: Reckoned, begun: Mapping[Begun, np.ndarray]
) -> Iterator[Further]:
    """Give every cause from every time on."""
    if not begun:
        return
    J, r = here.scaled(now.scales, here.J), here.scaled(now.scales, here.r)
    C = here.scaled(now.scales, np.hstack(list(begun.values())))
    data = seen(J.T @ J, J.T @ r, here.D, J, C, r)
    ends = np.cumsum([0, *(columns.shape[1] for columns in begun.values())]).tolist()
    price = float(np.log(PRIOR["sudden"] / len(begun)))
    for (effect, time), a, b in zip(begun, ends[:-1], ends[1:], strict=True):
        gain = gain_of(ForceInformation(data.M[a:b, a:b], data.q[a:b]), effect)[0]
        more = np.array([parameter.scale**2 for parameter in effect.parameters])
        beside = replace(here, J=np.hstack([here.J, begun[effect, time]]), D=np.append(here.D, more))
        yield Further(price, now.log + gain, beside)
