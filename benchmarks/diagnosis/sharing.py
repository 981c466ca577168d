"""Runs that all cases of a manoeuvre share, those around its nominal model, are made once in a process."""

from __future__ import annotations

import pickle
from collections import OrderedDict
from typing import Any

import numpy as np

from subzero.diagnosis import api as engine
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.inference import Findings, model_fits, problem, simulator
from subzero.diagnosis.results import Verdict

ROOM = 600
Track = tuple[np.ndarray, np.ndarray]


class Shared:
    """A memory of runs, and of the last work of the engine."""

    def __init__(self) -> None:
        self.runs: OrderedDict[bytes, Track] = OrderedDict()
        self.plain = simulator.simulate_track
        self.work: Findings | None = None
        self.tell = engine.conclude

    def tracked(self, setting: Setting) -> Track:
        """As `simulate_track`, each setting once."""
        key = pickle.dumps(setting)
        if key not in self.runs:
            self.runs[key] = self.plain(setting)
        self.runs.move_to_end(key)
        while len(self.runs) > ROOM:
            self.runs.popitem(last=False)
        return self.runs[key]

    def reported(self, work: Findings, *more: Any) -> Verdict:
        """As `conclude`, and keep the work."""
        self.work = work
        return self.tell(work, *more)


def share(threads: int | None = None) -> Shared:
    """Let this process share runs, with so many threads for each diagnosis, and keep the engine's work."""
    shared, modules = Shared(), (problem, simulator)
    for module in modules:
        patch: Any = module
        patch.simulate_track = shared.tracked
    patch = engine
    patch.conclude = shared.reported
    for module in (problem, model_fits) if threads is not None else ():
        patch = module
        patch.cpu_count = lambda: threads
    return shared
