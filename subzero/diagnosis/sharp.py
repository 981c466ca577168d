"""Records as sharp as the best fit asks for: what economical steps get wrong is taken from them, where that is seen."""

from __future__ import annotations

from dataclasses import dataclass, field

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.fits import HOPELESS, Fits
from subzero.diagnosis.hypotheses import Ids
from subzero.diagnosis.pose import with_finer_steps
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import Fit, refit


@dataclass(kw_only=True, eq=False)
class SharpFits(Fits):
    """Fits whose problem gets sharper where the best of them is.

    Attributes:
        behind: hypothesis → how far its fit was behind the best when it was given up, in log posterior.
        economical: the problem before what economical steps get wrong was taken from its records.
        sharp_at: the hypothesis at whose fit that was done.
    """

    behind: dict[Ids, float] = field(default_factory=dict)
    economical: Problem = field(init=False)
    sharp_at: Ids | None = None

    def sharpen(self) -> None:
        """Take from the records what economical steps get wrong at the best fit, if that can be seen, and fit again."""
        best = self.best()
        if self.sharp_at == best.ids:
            return
        self.progress(0.6, "finer steps")
        self.sharp_at, sharper = best.ids, with_finer_steps(self.economical, best.fit.z)
        if sharper is not None:
            self.problem = sharper
            self._give_up(best)
            self._go_on()

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
