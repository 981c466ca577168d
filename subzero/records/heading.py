"""A heading is known but for whole turns: one compass begins at 359 degrees where another, or a run, begins at −1.

So a run's heading is counted from its trial's start, without a jump wherever that lies, and a record's from the run's.
"""

from __future__ import annotations

import numpy as np

HEADING = "heading"
TURN = 360.0
FIRST = 9
"""Samples that say where a record begins: a few of them may be outliers."""


def turned(heading: np.ndarray, like: np.ndarray | float) -> np.ndarray:
    """Return a heading (n,) with the whole turns more or less that bring its first samples close to those of another,
    (n,) or one. [degree]
    """
    apart = np.asarray(like - heading)
    first = apart[np.isfinite(apart)][:FIRST]
    return heading + TURN * np.round(np.median(first) / TURN) if first.size else heading
