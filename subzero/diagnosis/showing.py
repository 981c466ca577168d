"""What models say to the records, for the figures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from subzero.diagnosis.problem import Problem
from subzero.diagnosis.recover import Recovered
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.response import respond
from subzero.diagnosis.verdict import Curves


def curves(problem: Problem, fits: Mapping[str, Fit | None], found: Recovered | None) -> dict[str, Curves]:
    """Return record → curves of the nominal model (a fit of None) and of fits; `found` knows the entries of a force."""
    return {one.name: _curves(problem, i, fits, found) for i, one in enumerate(problem.records)}


def _curves(problem: Problem, record: int, fits: Mapping[str, Fit | None], found: Recovered | None) -> Curves:
    """Return the curves of a record."""
    one, models = problem.records[record], {}
    for label, fit in fits.items():
        z = fit.z if fit else np.zeros(len(problem.entries))
        wide = found.problem if found and z.size > len(problem.entries) else problem
        z = np.pad(z, (0, max(len(wide.entries) - z.size, 0)))
        models[label] = respond(wide.setting(record, z), one.time, one.noise)
    return Curves(
        time=one.time,
        measured=one.values,
        models=models,
        used={name: n.used for name, n in one.noise.items()},
    )
