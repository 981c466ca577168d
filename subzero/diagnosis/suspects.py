"""Forces and drifts that no cause explains, in the linear problem around a fit: how probable is each?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from subzero.diagnosis.effects.sensors import SPECS
from subzero.diagnosis.evidence import Scales, log_sum, mixed
from subzero.diagnosis.latent import SHARES, Seen, Terms, log_evidence_process, log_evidence_term, seen
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.setting import Setting
from subzero.diagnosis.unknown import DRIFT, DRIFTS, FORCE, Knots, usual


@dataclass(frozen=True, kw_only=True, eq=False)
class Suspect:
    """A force or a drift in the linear problem.

    Attributes:
        id: "unknown_force:X", "sensor_drift:heading".
        log_gain: log evidence over that of none; amplitudes, correlation times, formulas of one term and κ mixed.
        kappa: the most probable κ.
    """

    id: str
    log_gain: float
    kappa: float


def suspects(
    problem: Problem,
    columns: Mapping[str, np.ndarray],
    fit: Fit,
    scales: Scales,
    knots: Knots,
    terms: Mapping[str, Terms] | None = None,
) -> list[Suspect]:
    """Return every force and drift of `columns` (id → (m, n)), in the linear problem around a fit, most probable first.

    Args:
        problem: of the columns.
        columns: as of `all_columns`.
        fit: that the columns were made close to.
        scales: κ → its log weight and the prior variances of the entries.
        knots: of the columns.
        terms: axis → what a force on it may look like beside a process.
    """
    q, whole = fit.quadratic, fit.r + fit.J @ fit.z
    found = []
    for name, C in columns.items():
        gains = {
            kappa: _log_gain(problem, name, seen(q.A, q.b, one.D, fit.J, C, whole), knots, terms or {})
            for kappa, one in scales.items()
        }
        gain, kappa = mixed(scales, gains)
        found.append(Suspect(id=name, log_gain=gain, kappa=kappa))
    return sorted(found, key=lambda one: -one.log_gain)


def _log_gain(problem: Problem, name: str, data: Seen, knots: Knots, terms: Mapping[str, Terms]) -> float:
    """Return the log evidence of a force or a drift over that of none: a process, or as probably a formula."""
    amplitudes, axis = _amplitudes(problem, name), name.partition(":")[2]
    process = log_evidence_process(data, knots.time, knots.record, amplitudes, drift=name.startswith(DRIFT))
    if name.startswith(DRIFT) or axis not in terms:
        return process
    return log_sum([process, log_evidence_term(data, terms[axis], amplitudes)]) - float(np.log(2.0))


def _amplitudes(problem: Problem, name: str) -> list[float]:
    """Return the amplitudes that are mixed for a force or a drift."""
    kind, _, which = name.partition(":")
    if kind + ":" == FORCE:
        return amplitude_grid(problem.records[0].setting, which)
    return [share * DRIFTS * SPECS[which].noise for share in SHARES]


def amplitude_grid(setting: Setting, axis: str) -> list[float]:
    """Return the amplitudes that are mixed. [N, N m]"""
    return [share * usual(setting, axis) for share in SHARES]
