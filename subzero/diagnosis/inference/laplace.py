"""The evidence of a hypothesis around its MAP fit, by Laplace's method and mixed over κ.

log p(y | κ) = −objective(ẑ) − ½ log det (D P),   P = D⁻¹ + Jᵀ J;      log p(y) = log Σ_κ p(κ) p(y | κ)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import log_ndtr

from subzero.diagnosis.hypothesis.hypotheses import Entry, Ids, log_prior, nameable, variances
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.linear_gaussian import KAPPAS, Scale, Scales, log_sum, posterior

if TYPE_CHECKING:
    from subzero.diagnosis.inference.map_fit import Fit
    from subzero.diagnosis.inference.problem import Problem


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A hypothesis with a real fit.

    Attributes:
        ids: its causes.
        fit: the best fit, under the most probable κ.
        log_evidence: κ → log evidence.
        log_posterior: log (evidence, mixed over κ, times prior).
    """

    ids: Ids
    fit: Fit
    log_evidence: dict[float, float]
    log_posterior: float

    @property
    def optimistic_log_posterior(self) -> float:
        """The log posterior that a better fit might have."""
        return self.log_posterior + min(self.fit.predicted_gain, settings.MAX_PREDICTED_GAIN_NATS)

    @property
    def log_mixed(self) -> float:
        """The log evidence, mixed over κ."""
        return log_sum([np.log(prior) + self.log_evidence[kappa] for kappa, prior in KAPPAS.items()])

    def scales(self, problem: Problem) -> Scales:
        """Return what the hypothesis makes of κ: what else there is may be what asked for a wide one."""
        return {
            kappa: Scale(
                float(np.log(prior)) + self.log_evidence[kappa] - self.log_mixed,
                variances(problem.entries, self.ids, kappa),
            )
            for kappa, prior in KAPPAS.items()
        }

    @property
    def kappa(self) -> float:
        """The most probable scale of the tolerances."""
        return max(KAPPAS, key=lambda kappa: np.log(KAPPAS[kappa]) + self.log_evidence[kappa])


def candidate_of(problem: Problem, ids: Ids, fit: Fit) -> Candidate:
    """Return a hypothesis with its fit, and its evidence for every κ."""
    evidence = _evidence(problem, ids, fit)
    mixed = log_sum([np.log(KAPPAS[kappa]) + evidence[kappa] for kappa in KAPPAS])
    whole = mixed + log_prior(ids, len(nameable(problem.entries)))
    return Candidate(
        ids=ids,
        fit=fit,
        log_evidence=evidence,
        log_posterior=whole if np.isfinite(fit.objective) else -np.inf,
    )


def _evidence(problem: Problem, ids: Ids, fit: Fit) -> dict[float, float]:
    """Return κ → log evidence of a hypothesis."""
    return laplace(problem.entries, fit, {kappa: variances(problem.entries, ids, kappa) for kappa in KAPPAS})


def laplace(entries: Sequence[Entry], fit: Fit, under: Mapping[float, np.ndarray]) -> dict[float, float]:
    """Return κ → log evidence under prior variances (k,): that of the linear problem, moved to what the real run leaves
    under the fit's own κ.
    """
    q = fit.quadratic
    found = {kappa: posterior(q, D) for kappa, D in under.items()}
    nearest = min(under, key=lambda kappa: float(np.sum(np.abs(np.log(under[kappa] / fit.D)))))
    here = -fit.objective - found[nearest].log_evidence - 0.5 * found[nearest].log_det
    every = range(len(entries))
    return {
        kappa: one.log_evidence + here + possible(entries, every, one.z, np.sqrt(np.diag(one.M)), held=True)
        for kappa, one in found.items()
    }


def possible(
    entries: Sequence[Entry], at: Sequence[int], mean: np.ndarray, sd: np.ndarray, *, held: bool = False
) -> float:
    """Return what is added to a log evidence because values below a bound at 0 are not possible; `held` if it was
    taken at the best values within bounds.
    """
    bounded = np.array([entries[k].parameter.low == 0.0 for k in at])
    if not bounded.any():
        return 0.0
    x = (mean / sd)[bounded]
    return float(np.sum(log_ndtr(x) + np.log(2.0) + (0.5 * np.minimum(x, 0.0) ** 2 if held else 0.0)))
