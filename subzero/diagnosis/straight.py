"""A fit once more from the smooth side of its kinks.

Where a drum stops, a cable falls slack or a gear has play, runs have kinks, and far on their other side slack cable
jerks taut, and no slope leads back. So a fit that ended there is begun again with all that is possible on one side only
as nominal, but for causes that are named.
"""

from __future__ import annotations

import numpy as np

from subzero.diagnosis.evidence import posterior
from subzero.diagnosis.hypotheses import Ids
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit, bounds, refit

STRAYED = 2.0
"""What has kinks is begun again if a fit bends it by so many tolerances."""


def kinked(problem: Problem, but: Ids) -> list[int]:
    """Return the entries of causes on one side only, but for sensors' and some causes': drums stop, cables fall slack,
    gears have play.
    """
    return [k for k, entry in enumerate(problem.entries) if entry.record < 0 and entry.parameter.low == 0.0
            and entry.effect.slot != "sensors" and entry.effect.id not in but]  # fmt: skip


def straightened(problem: Problem, fit: Fit, ids: Ids, D: np.ndarray | None = None) -> Fit | None:
    """Return the fit of a hypothesis from where nothing with kinks is bent; None if the fit bends nothing such much.

    Args:
        problem: records and parameters.
        fit: of the hypothesis.
        ids: its causes, which may be as large as they are.
        D: prior variances (k,); those of the fit if None.
    """
    at, D = kinked(problem, ids), fit.D if D is None else D
    tolerance = np.array([problem.entries[k].parameter.tolerance for k in at])
    if not np.any(np.abs(fit.z[at]) > STRAYED * tolerance):
        return None
    held = D.copy()
    held[at] = (1e-6 * tolerance) ** 2
    z = np.clip(posterior(fit.quadratic, held).z, *bounds(problem))
    z[at] = 0.0
    return refit(problem, z, problem.jacobian(z), D, most_fresh=1, made_at=z)
