"""How well something outside the catalogue was found: flagged, axis, history, and the feature of its formula."""

from __future__ import annotations

from typing import Any

import numpy as np

from subzero.diagnosis.results import Unknown, Verdict
from subzero.external_force import AXES, history_at

from .cases import Made

FIRST = 2
"""Of the features, by their probability to belong to the formula."""


def judged(made: Made, verdict: Verdict) -> dict[str, Any]:
    """Return what was found of it."""
    strange, unknown = made.strange, verdict.unknown
    assert strange is not None
    found: dict[str, Any] = {"axis": strange.axis, "found": unknown.axis if unknown else "",
                             "features": list(strange.features)}  # fmt: skip
    if unknown is None:
        return found
    found["first"] = list(unknown.features)[:FIRST]
    if unknown.axis == strange.axis and not strange.features:
        found["rms"] = _off(made, unknown)
    return found


def _off(made: Made, unknown: Unknown) -> float:
    """Return the RMS error of a history as a share of its largest size, at a tenth of a second."""
    strange = made.strange
    assert strange is not None
    times = np.arange(0.0, unknown.time[-1], 0.1)
    if strange.drift is not None:
        true = strange.drift(times)
    else:
        assert strange.force is not None
        true = history_at(strange.force, times)[:, AXES.index(strange.axis)]
    reported = np.interp(times, unknown.time, unknown.force)
    return float(np.sqrt(np.mean((reported - true) ** 2)) / np.abs(true).max())
