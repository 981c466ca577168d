"""Runs that were made are kept for a while: fits come back to where they were, and sensors change no run."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import numpy as np

from subzero.diagnosis.tracked import Track

ROOM = 64_000_000
"""Runs are kept until they take more memory than this; the oldest go first. [byte]"""


class KeptRuns:
    """Tracks by what made them: two values, taken as the very objects that they are, and numbers."""

    def __init__(self) -> None:
        """Begin with none."""
        self._tracks: OrderedDict[tuple[int, int, bytes], tuple[Track, Any]] = OrderedDict()
        self._size = 0

    def get(self, one: Any, other: Any, numbers: np.ndarray) -> Track | None:
        """Return the track that was made of these; None if there is none, or no more."""
        found = self._tracks.get((id(one), id(other), numbers.tobytes()))
        return found[0] if found else None

    def keep(self, one: Any, other: Any, numbers: np.ndarray, track: Track) -> None:
        """Keep a track, and with it what made it, so that no other value can take its identity."""
        key = (id(one), id(other), numbers.tobytes())
        if key not in self._tracks:
            self._tracks[key] = (track, (one, other))
            self._size += track[1].nbytes
        while self._size > ROOM:
            (_, old), _ = self._tracks.popitem(last=False)[1]
            self._size -= old.nbytes
