"""The compiled time loop: exchange after exchange, row after row, no Python inside."""

from __future__ import annotations

import numpy as np

from subzero.coupling import FINE, exchange
from subzero.jit import compiled
from subzero.recording import Recording, record_row
from subzero.run_state import Live, Setup

NO_ROOM = 4
"""The room that was reserved is nearly full: enlarge it and go on; see `subzero.coupling` for the other endings."""
SPARE = 8
"""Nodes that one exchange may add. (A tow point at 40 segments a second would need more: `coupling.FASTEST`.)"""


@compiled
def run_rows(
    setup: Setup,
    live: Live,
    recording: Recording,
    times: np.ndarray,
    first: int,
    last: int,
    used: int,
    parts: int,
) -> tuple[int, int, int]:
    """Fill rows first … last − 1 of a recording.

    Args:
        setup: what stays.
        live: what changes; at times[first − 1] when called.
        recording: filled.
        times: of all rows (n,). [s]
        first: row to begin with.
        last: row to end before.
        used: nodes of the recording in use.
        parts: exchanges from a row to the next.

    Returns:
        rows that are filled, nodes in use, and how it ended (`coupling.FINE` …); `line.ends.solved` tells how the
        cable's last step was solved.
    """
    for row in range(first, last):
        nodes = live.line.ends.count + 1 + SPARE * parts
        if nodes > live.line.length.size or used + live.line.length.size > recording.tension.size:
            return row, used, NO_ROOM
        span = (times[row] - times[row - 1]) / parts
        for part in range(parts):
            ending = exchange(setup, live, times[row - 1] + part * span, span)
            if ending != FINE:
                return row, used, ending
        used = record_row(setup, live, recording, row, times[row], used)
    return last, used, FINE
