"""A diagnosis in progress: an interrupted one keeps what stands here."""

from __future__ import annotations

from dataclasses import dataclass, field

from subzero.diagnosis.foreign import Foreign
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.search import Search
from subzero.diagnosis.verdict import Detectability, Misfit


@dataclass(kw_only=True, eq=False)
class Work:
    """What was found so far.

    Attributes:
        search: over hypotheses.
        detectable: what could be seen at all.
        misfit: record → channel → how the nominal model fails.
        foreign: what lies outside the list.
        seconds: how long each part took.
        complete: nothing was left out.
        seed: of everything random.
        budget: one of BUDGETS.
    """

    search: Search
    detectable: tuple[Detectability, ...] = ()
    misfit: dict[str, dict[str, Misfit]] = field(default_factory=dict)
    foreign: list[Foreign] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    complete: bool = True
    seed: int = 0
    budget: str = "full"

    @property
    def problem(self) -> Problem:
        """Records and parameters, with the noise as it is known by now."""
        return self.search.problem
