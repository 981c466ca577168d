"""D of a case: how far its truth is from the best rival, with all tolerances free; in the linear problem, by secants.

Columns of causes that have no slope at the nominal model are secants of half an effect scale, those of the hidden
causes secants of what they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from subzero.diagnosis.assessment import separation
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, with_onset
from subzero.diagnosis.hypothesis.hypotheses import columns_of, nameable, variances
from subzero.diagnosis.inference import (
    ForceInformation,
    Problem,
    Quadratic,
    posterior,
    seen,
    with_change_point,
)

ABOUT = (-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)
"""Rivals of what begins in mid-trial begin about then. [s]"""
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
        for k, value in zip(columns_of(problem.entries, (one,)), values, strict=True):
            if value:
                J[:, k], z[k] = secant(problem, k, value), value
    return {one: _of(problem, J, z, one, hidden) for one in hidden}


def _of(problem: Problem, J: np.ndarray, z: np.ndarray, one: str, hidden: Hidden) -> tuple[float, str]:
    """Return D of one of the hidden causes, the others freed."""
    others = columns_of(problem.entries, tuple(other for other in hidden if other != one))
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
    for one in nameable(problem.entries):
        at = columns_of(problem.entries, (one,))
        own = D.copy()
        own[at] = variances(problem.entries, (one,), 1.0)[at]
        found[one] = q.rr - float(q.b @ posterior(q, own).z)
    rival = min(found, key=lambda one: found[one])
    return max(found[rival], 0.0), rival


def sudden_distance(
    problem: Problem, J: np.ndarray, one: str, values: tuple[float, ...], time: float
) -> tuple[float, str]:
    """Return D of a cause that begins in mid-trial, and what comes closest: of what holds throughout, or of the other
    sudden causes, each from the best time about then.
    """
    setting = problem.records[0].setting
    effects = {effect.id: effect for effect in problem.sudden_effects}
    started = with_onset(effects[one], time).apply(setting, *values)
    change, D = change_by(problem, setting, started), variances(problem.entries, (), 1.0)
    q = Quadratic(A=J.T @ J, b=J.T @ change, rr=float(change @ change))
    base, found = posterior(q, D), dict([strangeness(problem, J, change)[::-1]])
    others = [without_common(effect, one) for effect in effects.values() if effect.id != one]
    pairs = [(effect, time + later) for effect in others for later in ABOUT]
    for effect, when in pairs:
        C = onset_columns(problem, effect, when)
        explained = _explained(seen(q.A, q.b, D, J, C, change), effect)
        found[f"{effect.id}@{when:.3g}"] = max(-2.0 * base.log_evidence - base.log_det - explained, 0.0)
    rival = min(found, key=lambda name: found[name])
    return found[rival], rival


def onset_columns(problem: Problem, effect: Effect, time: float) -> np.ndarray:
    """Return whitened sensitivities (m, parameters) of the nominal model to an effect from a time on. [s]"""
    more, n = with_change_point(problem, effect, time, 0), len(problem.entries)
    at = range(n, n + len(effect.parameters))
    return more.jacobian(np.zeros(len(more.entries)), at)[:, at]


def without_common(effect: Effect, one: str) -> Effect:
    """Return an effect with what another cause can do, too, held: a jam is no rival of an offset by its angle."""
    held = [replace(p, scale=1e-6 * p.scale) if p.also_of == one else p for p in effect.parameters]
    return replace(effect, parameters=tuple(held))


def _explained(data: ForceInformation, effect: Effect) -> float:
    """Return what an effect explains of a squared distance, as large as it may be."""
    scale = np.array([p.scale for p in effect.parameters])
    size = np.linalg.solve(data.M + np.diag(1.0 / scale**2), data.q)
    possible = all(p.low <= x <= p.high for x, p in zip(size, effect.parameters, strict=True))
    return float(data.q @ size) if possible else 0.0


def change_by(problem: Problem, plain: Setting, other: Setting) -> np.ndarray:
    """Return what another setting changes in the record, whitened."""
    zero = np.zeros(len(problem.entries))
    here = replace(problem.records[0], setting=other)
    there = replace(problem, records=(here,))
    return problem.residual(zero) - there.residual(zero)
