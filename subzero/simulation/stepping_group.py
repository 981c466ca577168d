"""Simulators that are stepped together, by some threads: each takes the next one that no other has taken."""

from __future__ import annotations

import time
import weakref
from collections.abc import Sequence
from operator import is_
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numba
import numpy as np

from subzero.channels import Observation
from subzero.engine.coupling import FINE
from subzero.engine.time_loop import ENDING, NO_SPACE, begin, hold_batch, share
from subzero.simulation.stepper import Held, Simulator


class SteppingGroup:
    """Simulators of one trial, one model and one sample time.

    The thread that calls does not wait for the others to wake, which takes as long as some steps: it begins, and they
    take the remaining ones. Nor do they sleep at once: the next steps may come before they would be awake again.

    Args:
        simulators: none of them has stopped; nothing else steps them in the meantime.
        threads: how many step them, the one that calls among them.
    """

    def __init__(self, simulators: Sequence[Simulator], threads: int) -> None:
        self._simulators, self._exchanges = simulators, simulators[0]._exchanges
        self._orders, self._held = np.zeros((len(simulators), 4)), list[Held]()
        self._shown = np.zeros((len(simulators), len(Observation._fields)))
        self._reached = np.zeros((len(simulators), 2), np.int64)
        self._others = 0 if numba.config.DISABLE_JIT else threads - 1
        self._batch: Any = None
        self._is_stepping = False
        self._asked: SimpleQueue[Any] = SimpleQueue()
        for _ in range(self._others):
            Thread(target=_help, args=(self._asked, self._exchanges), daemon=True).start()
        self.close = weakref.finalize(self, _end, self._asked, self._others)

    def hold(self, orders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Hold a command in each, as `Simulator.hold` does.

        Args:
            orders: propeller [rev/s], rudder, port and starboard stern-plane [rad] of each (simulators, 4).

        Returns:
            which of them cannot go on, and `Simulator.seen` of all (simulators, 27).
        """
        if self._is_stepping:
            self._finish()  # what an interrupt has broken off
        self._take([each._held for each in self._simulators])
        self._orders[:] = orders
        self._is_stepping = True
        begin(self._batch)
        for _ in range(self._others - self._asked.qsize()):
            self._asked.put(self._batch)
        self._finish()
        goals, endings = self._reached.T
        for i in np.flatnonzero(endings == NO_SPACE).tolist():
            each = self._simulators[i]
            each._reach(int(goals[i]), *self._orders[i].tolist())
            endings[i], self._shown[i] = each._held.at[ENDING], each.seen
        return endings != FINE, self._shown.copy()

    def _take(self, held: list[Held]) -> None:
        """Take the runs as they are now: after a reset, or with space for more rows, they are other arrays."""
        if self._held and all(map(is_, held, self._held)):
            return
        handles, at, seen = zip(*((each.handle, each.at, each.seen) for each in held), strict=True)
        batch = hold_batch(handles, at, seen, self._orders, self._shown, self._reached)
        self._held, self._batch = held, batch

    def _finish(self) -> None:
        """Take what no other thread has taken, and wait for what the others have."""
        while not share(self._batch, self._exchanges, False):
            time.sleep(0.0)
        self._is_stepping = False


def _help(asked: SimpleQueue[Any], exchanges: int) -> None:
    """Share the batches of a group, as they come."""
    while (batch := asked.get()) is not None:
        share(batch, exchanges, True)


def _end(asked: SimpleQueue[Any], threads: int) -> None:
    for _ in range(threads):
        asked.put(None)
