"""The cable of a run as one flat array of numbers, and back: what a step leaves for the next.

The state of a cable is everything in its line but the work space of a step, and the pull at the last two times. As a
flat array it can be the state vector of a discrete-time system: stored, restored and stepped again from anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from subzero.run_state import Live

NOT_KEPT = ("blocks", "pivots", "rows", "load", "slip", "normal_gain", "forcing", "solved")
"""Fields of `cable.moving_end.state.Line` and its ends that a step fills before it reads them, or that stay zero."""
OF_NOW = ("force", "force_before", "last_step")
"""Fields of `subzero.run_state.Now` that a step leaves for the next."""


class Memory:
    """Views of all the numbers that a step leaves for the next, in one order.

    Attributes:
        places: name → its slice of the flat array.
        size: numbers in all.
    """

    def __init__(self, live: Live) -> None:
        self._views: dict[str, np.ndarray] = dict(_views(live))
        ends = np.cumsum([view.size for view in self._views.values()])
        self.places = {
            name: slice(int(end) - view.size, int(end))
            for (name, view), end in zip(self._views.items(), ends, strict=True)
        }
        self.size = int(ends[-1])

    def read(self) -> np.ndarray:
        """Return the numbers as they stand (size,)."""
        return np.concatenate([view.ravel().astype(float) for view in self._views.values()])

    def write(self, flat: np.ndarray) -> None:
        """Put numbers (size,) back; whole numbers are rounded."""
        for name, view in self._views.items():
            values = flat[self.places[name]].reshape(view.shape)
            view[...] = values if view.dtype.kind == "f" else np.rint(values).astype(view.dtype)


def _views(live: Live) -> Iterator[tuple[str, np.ndarray]]:
    """Walk through what is kept: name, view of the memory."""
    for name in OF_NOW:
        yield name, live.now.base[name]  # type: ignore[attr-defined]  # a packed record
    for name in live.line.ends.base.dtype.names:  # type: ignore[attr-defined]
        if name not in NOT_KEPT:
            yield name, live.line.ends.base[name]  # type: ignore[attr-defined]
    for name, values in zip(live.line._fields[1:], live.line[1:], strict=True):
        if name not in NOT_KEPT:
            yield name, values
