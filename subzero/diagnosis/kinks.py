"""A fit once more from off its kinks.

Where a drum stops, a cable falls slack or a gear has play, runs have kinks, and a fit may end in a hollow of its own:
far on their other side, where slack cable jerks taut, or on the kink itself. So it is begun again with all that is
possible on one side only as it is in most vehicles, but for causes that are named.
"""

from __future__ import annotations

import numpy as np

from subzero.diagnosis.hypotheses import Ids
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit, refit
from subzero.diagnosis.stride import bounded_step, bounds

STRAYED = 2.0
"""A fit that bends what has kinks by so many tolerances has gone astray."""
TYPICAL = 0.5
"""What has kinks is begun again with so many tolerances: off the kinks, where most vehicles are."""


def kinked(problem: Problem, but: Ids) -> list[int]:
    """Return the entries of causes on one side only, but for sensors' and some causes': drums stop, cables fall slack,
    gears have play.
    """
    return [k for k, entry in enumerate(problem.entries) if entry.record < 0 and entry.parameter.low == 0.0
            and entry.effect.slot != "sensors" and entry.effect.id not in but]  # fmt: skip


def strayed(problem: Problem, fit: Fit, ids: Ids) -> bool:
    """Say whether the fit of a hypothesis bends what has kinks farther than it should."""
    at = kinked(problem, ids)
    tolerance = np.array([problem.entries[k].parameter.tolerance for k in at])
    return bool(np.any(np.abs(fit.z[at]) > STRAYED * tolerance))


def begun_again(problem: Problem, fit: Fit, ids: Ids, D: np.ndarray | None = None) -> Fit:
    """Return the fit of a hypothesis from where what has kinks is TYPICAL, and all else best for that.

    Args:
        problem: records and parameters.
        fit: of the hypothesis.
        ids: its causes, which may be as large as they are.
        D: prior variances (k,); those of the fit if None.
    """
    at, D = kinked(problem, ids), fit.D if D is None else D
    low, high = bounds(problem)
    low[at] = high[at] = [TYPICAL * problem.entries[k].parameter.tolerance for k in at]
    z = fit.z + bounded_step(fit.J, fit.r, fit.z, D, low, high)
    return refit(problem, z, problem.jacobian(z), D, most_fresh=1, made_at=z)
