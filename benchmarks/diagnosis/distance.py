"""D of a case: how far its truth is from the best rival, with all tolerances free; in the linear problem, by secants.

Columns of causes that have no slope at the nominal model are secants of half an effect scale, those of the hidden
causes secants of what they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from subzero.diagnosis.detect import information, marginal, separation
from subzero.diagnosis.evidence import Quadratic, posterior
from subzero.diagnosis.hypotheses import named, places, variances
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.setting import Setting

Hidden = Mapping[str, tuple[float, ...]]


def sensitivities(problem: Problem) -> np.ndarray:
    """Return J of the nominal model, with secants for causes without a slope there."""
    zero = np.zeros(len(problem.entries))
    J = problem.jacobian(zero)
    for k, entry in enumerate(problem.entries):
        if entry.parameter.low == 0.0 and entry.effect.slot == "fins":
            J[:, k] = secant(problem, k, 0.5 * entry.parameter.scale)
    return J


def secant(problem: Problem, k: int, size: float) -> np.ndarray:
    """Return the column of an entry as a secant from 0 to a size."""
    zero = np.zeros(len(problem.entries))
    there = zero.copy()
    there[k] = size
    return np.nan_to_num(problem.change(zero, there)) / size


def discriminations(problem: Problem, J: np.ndarray, hidden: Hidden) -> dict[str, tuple[float, str]]:
    """Return cause → D and its closest rival; the other hidden causes may be of any size."""
    J, z = J.copy(), np.zeros(len(problem.entries))
    for one, values in hidden.items():
        for k, value in zip(places(problem.entries, (one,)), values, strict=True):
            if value:
                J[:, k], z[k] = secant(problem, k, value), value
    return {one: _of(problem, J, z, one, hidden) for one in hidden}


def signals(problem: Problem, J: np.ndarray, hidden: Hidden) -> dict[str, float]:
    """Return cause → squared distance from what the tolerances of all others could do."""
    M, found = marginal(problem, J), {}
    for one, values in hidden.items():
        at, z = places(problem.entries, (one,)), np.array(values)
        found[one] = float(z @ information(problem, M, at) @ z)
    return found


def _of(problem: Problem, J: np.ndarray, z: np.ndarray, one: str, hidden: Hidden) -> tuple[float, str]:
    """Return D of one of the hidden causes, the others freed."""
    others = places(problem.entries, tuple(other for other in hidden if other != one))
    entries = [
        entry._replace(effect=_freed(entry.effect)) if k in others else entry
        for k, entry in enumerate(problem.entries)
    ]
    return separation(replace(problem, entries=tuple(entries)), J, z, (one,))


def _freed(effect):
    """Return an effect whose tolerance is its scale."""
    return replace(effect, parameters=tuple(replace(p, tolerance=p.scale) for p in effect.parameters))


def strangeness(problem: Problem, J: np.ndarray, change: np.ndarray) -> tuple[float, str]:
    """Return D of a whitened change of the record against everything in the catalogue, and what comes closest."""
    D = variances(problem.entries, (), 1.0)
    q = Quadratic(A=J.T @ J, b=J.T @ change, rr=float(change @ change))
    base = posterior(q, D)
    found = {"none": -2.0 * base.log_evidence - base.log_det}
    for one in named(problem):
        at = places(problem.entries, (one,))
        own = D.copy()
        own[at] = variances(problem.entries, (one,), 1.0)[at]
        found[one] = q.rr - float(q.b @ posterior(q, own).z)
    rival = min(found, key=lambda one: found[one])
    return max(found[rival], 0.0), rival


def change_by(problem: Problem, plain: Setting, other: Setting) -> np.ndarray:
    """Return what another setting changes in the record, whitened."""
    zero = np.zeros(len(problem.entries))
    here = replace(problem.records[0], setting=other)
    there = replace(problem, records=(here,))
    return problem.residual(zero) - there.residual(zero)
