"""Sensitivities to the numbers that a new term brings: they hold wherever noise hides one simulation from another.

A search ranks hundreds of terms around each of its fits, most of which hardly differ. Ranks are of a linear problem; a
fit computes sensitivities of its own where those of its start do not hold.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from subzero.identification.explanation import Entry, Terms
from subzero.identification.problem import CORRECTIONS, Problem

Columns = Mapping[str, np.ndarray]
"""Channel → residuals (m,), or sensitivities (m, n)."""


class Sensitivities:
    """Sensitivities that were computed, with the residuals of the simulation that they are of."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._known: dict[Any, list[tuple[Columns, Columns]]] = {}

    def of(
        self, terms: Terms, entries: Sequence[Entry], x: np.ndarray, wanted: Sequence[int], e: Columns
    ) -> Columns:
        """Return sensitivities to some entries at x (n,), where the residuals are e."""
        if all(entries[i].kind in CORRECTIONS for i in wanted):  # no simulation is needed
            return self._problem.jacobian(terms, entries, x, wanted)
        inputs = [(term.id, term.factor) for term in terms if term.kind in ("input", "exchanged")]
        what = (*inputs, *((entries[i].identity, x[i]) for i in wanted))
        known = self._known.setdefault(what, [])
        for there, columns in known:
            if self._are_alike(terms, e, there):
                return columns
        known.append((e, self._problem.jacobian(terms, entries, x, wanted)))
        return known[-1][1]

    def _are_alike(self, terms: Terms, e: Columns, there: Columns) -> bool:
        """Return whether residuals differ by less than the levels of the sensors."""
        levels = self._problem.levels(terms)
        return all(
            float(np.mean((e[name] - there[name])[self._problem.used(name, terms)] ** 2)) < levels[name] ** 2
            for name in e
        )
