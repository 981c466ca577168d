"""The table of cases: one line a section of the page, in its order."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from types import ModuleType
from typing import Any

from . import (
    bending,
    catenary,
    critical_angle,
    cross_current,
    economy,
    energy_balance,
    formulations,
    hanging_chain,
    invariance,
    manufactured,
    moordyn_2,
    out_and_back,
    remus,
    sagging_cable,
    sinking,
    straight_pull,
    taut_string,
    travelling_wave,
    turns,
)
from .row import Row


@dataclass(frozen=True)
class Case:
    """A section of the page.

    Attributes:
        name: for the command line, the figure's file and the tests.
        title: of the section.
        module: its docstring is the section's text; `rows(quick)` returns the comparisons; `draw(figure)`, if there is
            one, fills a matplotlib figure.
        slow: whether even the quick rows take more than a few seconds.
    """

    name: str
    title: str
    module: ModuleType
    slow: bool = False

    def rows(self, quick: bool = False) -> list[Row]:
        """Return the comparisons; with `quick` fewer refinements and parameters, and the same gates.

        A run that stops is a comparison that fails.
        """
        try:
            return list(self.module.rows(quick))
        except RuntimeError as stopped:
            return [Row(name=str(stopped), ours=nan, reference=nan, error=nan, gate=0.0, source="")]

    @property
    def missed(self) -> dict[str, str]:
        """Return why gates are not met, by the name of the row; the page prints it."""
        return getattr(self.module, "MISSED", {})

    @property
    def draw(self) -> Any:
        """Return the function that fills a figure, or None."""
        return getattr(self.module, "draw", None)


CASES = (
    Case("manufactured", "Made-up motions: all terms of (7)", manufactured),
    Case("straight_pull", "Pulled straight off the drum", straight_pull),
    Case("critical_angle", "A heavy cable in tow", critical_angle),
    Case("turns", "Steady turns, and turns too tight to be steady", turns),
    Case("cross_current", "A neutral cable across a current", cross_current),
    Case("catenary", "Catenaries, inextensible and elastic", catenary),
    Case("sinking", "A horizontal wire sinks", sinking),
    Case("bending", "A cable that resists bending", bending),
    Case("invariance", "Turned, mirrored, later, and adrift", invariance),
    Case("out_and_back", "Out and in again", out_and_back),
    Case("travelling_wave", "Waves on a taut cable", travelling_wave),
    Case("taut_string", "Natural frequencies of a taut cable", taut_string),
    Case("sagging_cable", "Vibrations of a sagging cable", sagging_cable),
    Case("hanging_chain", "A chain that hangs and swings in water", hanging_chain),
    Case("energy_balance", "Where the work goes", energy_balance),
    Case("economy", "Steps and segments as they are needed", economy),
    Case("formulations", "Three formulations of one cable", formulations),
    Case("moordyn_2", "Another code: MoorDyn 2", moordyn_2),
    Case("remus", "Another hull: REMUS 100", remus),
)
