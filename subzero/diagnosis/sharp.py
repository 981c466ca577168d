"""Records as sharp as the best fit asks for: what economical steps get wrong is taken from them, where that is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.fits import HOPELESS, Fits
from subzero.diagnosis.hypotheses import Ids, variances
from subzero.diagnosis.pose import whitened_again, with_finer_steps, with_noise_behind
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit, refit
from subzero.diagnosis.screen import look


@dataclass(kw_only=True, eq=False)
class SharpFits(Fits):
    """Fits whose problem gets sharper where the best of them is.

    Attributes:
        behind: hypothesis → how far its fit was behind the best when it was given up, in log posterior.
        economical: the problem before what economical steps get wrong was taken from its records.
        sharp_at: the hypothesis at whose fit that was done.
        nominal: residual (m,) and sensitivities (m, k) of the nominal model.
    """

    behind: dict[Ids, float] = field(default_factory=dict)
    economical: Problem = field(init=False)
    sharp_at: Ids | None = None
    nominal: tuple[np.ndarray, np.ndarray] = field(init=False)

    def sharpen(self) -> None:
        """Estimate the noise behind the best fit, take from the records what economical steps get wrong there, and fit
        all again; nothing where neither is seen.
        """
        best = self.best()
        if self.sharp_at == best.ids:
            return
        self.progress(0.6, "noise behind the best fit, and finer steps")
        self.sharp_at, noise_is_new = best.ids, self._estimate_noise(best)
        sharper = with_finer_steps(self.economical, best.fit.z)
        if noise_is_new or sharper is not None:
            self.problem = sharper or self.economical
            self._give_up(best)
            self._go_on()

    def _estimate_noise(self, best: Candidate) -> bool:
        """Estimate the noise behind the best fit, and make white by it what the noise before has made white; say
        whether it is another.
        """
        D = variances(self.problem.entries, best.ids, best.kappa)
        found = with_noise_behind(self.economical, best.fit.z, D, again=True)
        if found is None:
            return False
        again = partial(whitened_again, self.economical, found)
        self.candidates = {
            ids: replace(one, fit=_rewhitened(one.fit, again)) for ids, one in self.candidates.items()
        }
        self.wide, self.economical = _rewhitened(self.wide, again), found
        self.nominal = again(self.nominal[0]), again(self.nominal[1])
        self.problem = found
        self.screen = look(found, self.wide, self.nominal, far=self.screen.far)
        return True

    def _give_up(self, best: Candidate) -> None:
        """Give up what is hopelessly behind the best candidate and no part of it."""
        kept = {ids: one for ids, one in self.candidates.items()
                if one.log_posterior > best.log_posterior - HOPELESS or set(ids) <= set(best.ids)}  # fmt: skip
        self.behind |= {ids: one.log_posterior - best.log_posterior for ids, one in self.candidates.items()
                        if ids not in kept}  # fmt: skip
        self.candidates = kept

    def _go_on(self) -> None:
        """Fit all candidates from where they are, with the sensitivities at hand."""
        ids_of = list(self.candidates)
        for ids, fit in zip(ids_of, self._aside(self._going_on, ids_of), strict=True):
            self._keep(ids, fit)
            self.raced -= set() if fit.converged else {ids}
        self.raced &= set(self.candidates)

    def _going_on(self, ids: Ids) -> Fit:
        """Return the fit of a candidate from where it is, with the sensitivities at hand."""
        fit = self.candidates[ids].fit
        return refit(self.problem, fit.z, fit.J, fit.D, most_fresh=0, made_at=fit.made_at)


def _rewhitened(fit: Fit, again: Callable[[np.ndarray], np.ndarray]) -> Fit:
    """Return a fit whose residual and sensitivities are made white by another noise."""
    return replace(fit, r=again(fit.r), J=again(fit.J))
