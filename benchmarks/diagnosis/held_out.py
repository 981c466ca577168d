"""The gain on the other manoeuvre, never fitted: the truth flown again, against four models of what was learnt.

Errors are mean squares in units of the sensors' noise, of the truth without noise: 0 is all that can be explained.

    G = (E_nominal − E_model)/E_nominal
"""

from __future__ import annotations

from typing import Any

import numpy as np

from subzero.diagnosis.hypothesis.catalogue import SPECS
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.hypotheses import nameable
from subzero.diagnosis.inference import Findings, Fit, economical, respond
from subzero.diagnosis.results import Verdict

from .cases import Case, Made
from .draws import Values, with_values
from .manoeuvres import CHANNELS, OTHER, nominal, times
from .truth import NoRunError, shown_by

STARTS = "start:"


def gains(case: Case, made: Made, verdict: Verdict, work: Findings) -> dict[str, Any]:
    """Return the mean square errors on the other manoeuvre: nominal, tolerances' refit, extended, and of the rival."""
    setting = nominal(OTHER[case.manoeuvre])
    flown = {name: values for name, values in made.values.items() if not name.startswith(STARTS)}
    at = times(setting)
    try:
        truth = shown_by(with_values(setting, flown), at, CHANNELS)
    except (NoRunError, ArithmeticError):
        truth = respond(economical(with_values(setting, flown), at[-1]), at, CHANNELS)
    models = {"nominal": {}, **{name: _shared(work, fit) for name, fit in _fits(verdict, work).items()}}
    return {name: _error(truth, setting, values, at) for name, values in models.items()}


def _fits(verdict: Verdict, work: Findings) -> dict[str, Fit]:
    """Return the fits that are compared."""
    candidates = work.search.candidates
    found = {"tolerance": candidates[()].fit}
    reported = tuple(sorted(cause.id for cause in verdict.causes))
    if reported in candidates:
        found["extended"] = candidates[reported].fit
    others = [one for ids, one in candidates.items() if ids and not set(ids) & set(reported)]
    if others and reported:
        found["rival"] = max(others, key=lambda one: one.log_posterior).fit
    return found


def _shared(work: Findings, fit: Fit) -> Values:
    """Return the deviations of a fit that hold for every trial."""
    entries, found = work.problem.entries, {}
    for one in nameable(work.problem.entries):
        found[one] = tuple(
            float(z) for z, entry in zip(fit.z, entries, strict=False) if entry.effect.id == one
        )
    return found


def _error(truth: dict[str, np.ndarray], setting: Setting, values: Values, at: np.ndarray) -> float:
    """Return the mean square error of a model."""
    shown = respond(economical(with_values(setting, values), at[-1]), at, CHANNELS)
    parts = [np.nanmean(((shown[name] - truth[name]) / SPECS[name].noise) ** 2) for name in CHANNELS]
    return float(np.mean(parts))
