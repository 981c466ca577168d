"""Words for when and for how long: what warnings say of samples in time."""

from __future__ import annotations

import numpy as np


def longest_span(time: np.ndarray, holds: np.ndarray) -> tuple[float, float]:
    """Return how long something holds at a stretch, at most, and when that stretch begins. [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    begin, end = edges[::2], edges[1::2] - 1
    if not begin.size:
        return 0.0, 0.0
    spans = time[end] - time[begin]
    return float(spans.max()), float(time[begin[spans.argmax()]])


def first_time(time: np.ndarray, holds: np.ndarray) -> float:
    """Return when something first holds. [s]."""
    return float(time[int(np.argmax(holds))])


def percent(share: float) -> str:
    """Return a share as a percentage."""
    return f"{100.0 * share:.3g} %"
