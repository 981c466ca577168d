"""Runs that were made are kept for a while: fits come back to where they were, and sensors change no run."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock
from typing import Any

import numpy as np

from subzero.diagnosis.tracked import Track

ROOM = 64_000_000
"""Runs are kept until they take more memory than this; the oldest go first. [byte]"""


class KeptRuns:
    """Tracks by setting and entries, the very objects that they are, and deviations; several threads may ask and keep.

    Attributes:
        asked: how many runs were asked for.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self.asked = 0
        self._tracks: OrderedDict[tuple[int, int, bytes], tuple[Track, Any]] = OrderedDict()
        self._size = 0
        self._lock = Lock()

    def count(self, runs: int) -> None:
        """Count runs that are asked for; the search hangs on their number, so none may be lost between threads."""
        with self._lock:
            self.asked += runs

    def get(self, setting: Any, entries: Any, z: np.ndarray) -> Track | None:
        """Return the track that was made of these; None if there is none, or no more."""
        with self._lock:
            found = self._tracks.get((id(setting), id(entries), z.tobytes()))
        return found[0] if found else None

    def keep(self, setting: Any, entries: Any, z: np.ndarray, track: Track) -> None:
        """Keep a track, and with it what made it, so that no other value can take its identity."""
        key = (id(setting), id(entries), z.tobytes())
        with self._lock:
            if key not in self._tracks:
                self._tracks[key] = (track, (setting, entries))
                self._size += track[1].nbytes
            while self._size > ROOM:
                (_, old), _ = self._tracks.popitem(last=False)[1]
                self._size -= old.nbytes
