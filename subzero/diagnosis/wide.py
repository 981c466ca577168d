"""The fit with wide tolerances: close to the records whatever is wrong, and what their noise is estimated behind."""

from __future__ import annotations

import numpy as np

from subzero.diagnosis.hypotheses import variances
from subzero.diagnosis.kinks import begun_again, strayed
from subzero.diagnosis.pose import with_noise_behind
from subzero.diagnosis.problem import Problem, Progress
from subzero.diagnosis.refit import Fit, refit

WIDE = 4.0
"""κ of the fit that the linear evidence is made at."""
ROUNDS = 2
"""How often the noise may be estimated again, behind the fit."""
Nominal = tuple[np.ndarray, np.ndarray]
"""Residual (m,) and sensitivities (m, k) of the nominal model."""


def fit_wide(problem: Problem, progress: Progress) -> tuple[Problem, Fit, Nominal]:
    """Return the problem with the noise that is left behind the fit, the fit, and what the nominal model leaves."""
    progress(0.05, "sensitivities of the nominal model")
    zero = np.zeros(len(problem.entries))
    J = problem.jacobian(zero)
    fit = _from(problem, zero, J, progress)
    for _ in range(ROUNDS):
        D = variances(problem.entries, (), WIDE)
        again = with_noise_behind(problem, fit.z, D) if np.isfinite(fit.r).all() else None
        if again is None:
            break
        problem, J = again, again.jacobian(zero)
        fit = _from(problem, fit.z, problem.jacobian(fit.z), progress)
    return problem, fit, (problem.residual(zero), J)


def _from(problem: Problem, z: np.ndarray, J: np.ndarray, progress: Progress) -> Fit:
    """Return the fit from z, with the sensitivities there; or if it went astray, a better one from off its kinks."""
    progress(0.15, "fit within wide tolerances")
    fit = refit(problem, z, J, variances(problem.entries, (), WIDE), most_fresh=2, made_at=z)
    if not strayed(problem, fit, ()):
        return fit
    again = begun_again(problem, fit, ())
    return again if again.objective < fit.objective else fit
