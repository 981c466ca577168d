"""Runs that all cases of a manoeuvre share, those around its nominal model, are made once in a process."""

from __future__ import annotations

import pickle
from collections import OrderedDict
from typing import Any

import numpy as np

from subzero.diagnosis import diagnose as engine
from subzero.diagnosis import problem, response, search
from subzero.diagnosis.setting import Setting
from subzero.diagnosis.verdict import Verdict
from subzero.diagnosis.work import Work

ROOM = 600
Track = tuple[np.ndarray, np.ndarray]


class Shared:
    """A memory of runs, and of the last work of the engine."""

    def __init__(self) -> None:
        self.runs: OrderedDict[bytes, Track] = OrderedDict()
        self.plain = response.tracked
        self.work: Work | None = None
        self.tell = engine.tell

    def tracked(self, setting: Setting) -> Track:
        """As `response.tracked`, each setting once."""
        key = pickle.dumps(setting)
        if key not in self.runs:
            self.runs[key] = self.plain(setting)
        self.runs.move_to_end(key)
        while len(self.runs) > ROOM:
            self.runs.popitem(last=False)
        return self.runs[key]

    def told(self, work: Work) -> Verdict:
        """As `telling.tell`, and keep the work."""
        self.work = work
        return self.tell(work)


def share(threads: int | None = None) -> Shared:
    """Let this process share runs, with so many threads for each diagnosis, and keep the engine's work."""
    shared, modules = Shared(), (problem, response)
    for module in modules:
        patch: Any = module
        patch.tracked = shared.tracked
    patch = engine
    patch.tell = shared.told
    for module in (problem, search) if threads is not None else ():
        patch = module
        patch.cpu_count = lambda: threads
    return shared
