"""From fits to the probability of every hypothesis, told no finer than it is needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.evidence import log_sum
from subzero.diagnosis.hypotheses import Ids
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.rules import NAMED, large
from subzero.diagnosis.screen import Screen

UNTRIED = 2.0
"""A hypothesis without a fit of its own is at least this far behind the best in log posterior."""
FURTHER = NAMED / (1.0 - NAMED)
"""A further cause has to be this many times as probable as none: then it could be named."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Beliefs:
    """What is known of all hypotheses.

    Attributes:
        candidates: hypothesis → its real fit.
        screen: what the linear problem at the wide fit says.
        beside: hypothesis → log posterior, estimated at the fit of one with a cause less.
        behind: hypothesis → how far its fit was behind the best when it was given up, in log posterior.
    """

    candidates: Mapping[Ids, Candidate]
    screen: Screen
    beside: Mapping[Ids, float]
    behind: Mapping[Ids, float] = field(default_factory=dict)

    def log_posteriors(self) -> dict[Ids, float]:
        """Return the log posterior of every hypothesis, but for a common constant: by its fit, or estimated."""
        log = self._fitted()
        best, untried = max(log.values()), [ids for ids in self.screen.log_posterior if ids not in log]
        return log | {ids: min(self._estimated(ids, log), best - UNTRIED) for ids in untried}

    def _fitted(self) -> dict[Ids, float]:
        """Return the log posterior of every hypothesis that has been fitted, now or before it was given up."""
        log = {ids: candidate.log_posterior for ids, candidate in self.candidates.items()}
        best = max(log.values())
        return {ids: best + behind for ids, behind in self.behind.items()} | log

    def log_total(self) -> float:
        """Return the log of the sum of all posteriors."""
        return log_sum(list(self.log_posteriors().values()))

    def probabilities(self, problem: Problem) -> dict[Ids, float]:
        """Return the probability of every hypothesis as it is told, the most probable first."""
        log, total = self.log_posteriors(), self.log_total()
        found = {ids: float(np.exp(value - total)) for ids, value in log.items()}
        return folded(self._without_small(problem, found))

    def _estimated(self, ids: Ids, fitted: Mapping[Ids, float]) -> float:
        """Return the log posterior of a hypothesis without a fit: of the best fit of a part of it, and what the linear
        problem there, or else the screen, says that the rest adds.
        """
        if ids in self.beside:
            return self.beside[ids]
        parts = [one for size in range(len(ids)) for one in combinations(ids, size) if one in fitted]
        part = max(parts, key=lambda one: fitted[one], default=())
        return fitted[part] + self.screen.adds(ids, part)

    def _without_small(self, problem: Problem, probabilities: Mapping[Ids, float]) -> dict[Ids, float]:
        """Return probabilities where causes of less than a practical size are not told beside others of more."""
        found = dict(probabilities)
        for ids, one in self.candidates.items():
            kept = large(problem.entries, ids, one.fit.z, one.kappa)
            if kept and kept != ids:
                found[kept] = found.get(kept, 0.0) + found.pop(ids)
        return found


def folded(probabilities: Mapping[Ids, float]) -> dict[Ids, float]:
    """Return probabilities, the most probable first, where a further cause that is not needed is not told: those of
    hypotheses that are not FURTHER times as probable as a part of them are that part's.
    """
    found = dict(probabilities)
    for ids in sorted(probabilities, key=len, reverse=True):
        if len(ids) > 1:
            part = max(combinations(ids, len(ids) - 1), key=lambda one: probabilities.get(one, 0.0))
            if probabilities.get(part, 0.0) * FURTHER > probabilities[ids]:
                found[part] += found.pop(ids)
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))
