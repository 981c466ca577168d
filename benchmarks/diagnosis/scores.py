"""Figures with a target: shares of records with their binomial intervals, and the calibration of probabilities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest

Result = dict[str, Any]
EDGES = (0.0, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 0.99, 1.0 + 1e-9)
"""Bins of stated probabilities."""
MARK = {True: "pass", False: "**FAIL**", None: ""}


class Score(NamedTuple):
    """A figure: words, value as text, target as text, 95 % interval as text, records, met (None: not judged), and
    whether its interval reaches the target if not.
    """

    words: str
    value: str
    target: str
    interval: str
    cases: int
    met: bool | None
    near: bool = False

    @property
    def mark(self) -> str:
        """Whether the figure meets its target, if it is judged, or its interval reaches it."""
        return MARK[self.met] + (" (near)" if self.met is False and self.near else "")


def share(
    words: str,
    cases: Sequence[Result],
    good: Callable[[Result], bool],
    target: str,
    *,
    least: float | None = None,
    most: float | None = None,
) -> Score:
    """Return a share of records as a figure."""
    n, k = len(cases), sum(map(good, cases))
    if n == 0:
        return Score(words, "–", target, "–", 0, None)
    low, high = binomtest(k, n).proportion_ci(0.95)
    value = k / n
    met = (least is None or value >= least) and (most is None or value <= most)
    judged = met if (least, most) != (None, None) else None
    near = (least is None or high >= least) and (most is None or low <= most)
    interval = f"{100 * low:.1f} … {100 * high:.1f} %"
    return Score(words, f"{100 * value:.1f} %", target, interval, n, judged, near)


def by_chance(stated: np.ndarray, draws: int = 1000) -> np.ndarray:
    """Return the calibration errors (draws,) of an engine that is right as often as it states (n,)."""
    rng = np.random.default_rng(0)
    return np.array(
        [calibration_error(stated, 1.0 * (rng.random(stated.size) < stated)) for _ in range(draws)]
    )


def calibration_error(stated: np.ndarray, right: np.ndarray) -> float:
    """Return the mean difference, over bins, of stated probabilities (n,) and shares of right answers (n,)."""
    error = 0.0
    for low, high in pairwise(EDGES):
        own = (stated >= low) & (stated < high)
        if own.any():
            error += own.sum() * abs(stated[own].mean() - right[own].mean())
    return float(error / max(stated.size, 1))


def table(header: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [header, ["---"] * len(header), *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
