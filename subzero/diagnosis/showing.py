"""What models say to the records, for the figures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.response import respond
from subzero.diagnosis.verdict import Curves


def curves(problem: Problem, fits: Mapping[str, Fit | None]) -> dict[str, Curves]:
    """Return record → curves of the nominal model (a fit of None) and of fits.

    Args:
        problem: with the entries of all fits; those of a fit with fewer are the first ones.
        fits: label → fit.
    """
    return {one.name: _curves(problem, i, fits) for i, one in enumerate(problem.records)}


def _curves(problem: Problem, record: int, fits: Mapping[str, Fit | None]) -> Curves:
    """Return the curves of a record."""
    one, models, count = problem.records[record], {}, len(problem.entries)
    for label, fit in fits.items():
        z = fit.z if fit else np.zeros(count)
        models[label] = respond(problem.setting(record, np.pad(z, (0, count - z.size))), one.time, one.noise)
    return Curves(
        time=one.time,
        measured=one.values,
        models=models,
        used={name: n.used for name, n in one.noise.items()},
    )
