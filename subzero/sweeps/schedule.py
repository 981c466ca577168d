"""Submit the members of a sweep to an executor in batches, and keep the results.

A batch takes about `BATCH_S`, so that handing it out costs little, and less towards the end, so that no worker waits
for another. Only a few batches are under way at a time, so memory does not grow with the number of members. Where a
worker dies, the members that were under way run again, each with nothing else under way; one that so ends
`MOST_DEATHS` workers has failed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field
from math import ceil

import numpy as np

from subzero.errors import UserError
from subzero.sweeps.member import Job, Member, run_members

BATCH_S = 0.5
"""So long takes a batch: handing it out takes a millisecond here, and ten on a cluster. [s]"""
AHEAD = 2
"""Batches under way for each worker: one that it is at, and one that waits. [-]"""
MOST_DEATHS = 3
"""Somebody may kill a worker; three that die of the same member are no chance. [-]"""
FORGETTING = 0.3
"""Share of the newest batch in the estimate of what a member takes. [-]"""


@dataclass(frozen=True)
class Batch:
    """Members that are handed out together, and how often their worker has died."""

    members: np.ndarray
    deaths: int = 0

    def apart(self) -> Iterator[Batch]:
        """Give its members one by one, after one more death."""
        for member in self.members:
            yield Batch(np.array([member]), self.deaths + 1)


@dataclass
class Schedule:
    """The batches still to be done, and those in progress.

    Attributes:
        job: the sweep.
        rows: parameters of all its members (members, parameters).
        todo: numbers of members that are not finished (n,).
        workers: how many work at a time.
        keep: is given the members of every batch that comes back.
    """

    job: Job
    rows: np.ndarray
    todo: np.ndarray
    workers: int
    keep: Callable[[Sequence[Member]], None]
    _next: int = 0
    _again: deque[Batch] = field(default_factory=deque)
    _seconds: float = 0.0
    _under_way: dict[Future[list[Member]], Batch] = field(default_factory=dict)

    def run(self, executor: Executor) -> None:
        """Run all that is to be done.

        Raises:
            UserError: the executor cannot go on; what came back is kept.
        """
        try:
            while self._fill(executor):
                done, _ = wait(self._under_way, return_when=FIRST_COMPLETED)
                for future in done:
                    self._take(future, self._under_way.pop(future))
        finally:
            for future in self._under_way:
                future.cancel()

    def _fill(self, executor: Executor) -> bool:
        """Submit batches as long as there is capacity; return whether any is in progress."""
        while len(self._under_way) < AHEAD * self.workers and (batch := self._batch()) is not None:
            try:
                future = executor.submit(
                    run_members, self.job, batch.members.tolist(), self.rows[batch.members]
                )
            except (BrokenExecutor, RuntimeError) as error:
                raise UserError(
                    f"The workers cannot go on: {error}. Run the same again: what is finished is kept."
                ) from error
            self._under_way[future] = batch
        return bool(self._under_way)

    def _batch(self) -> Batch | None:
        """Return the next batch; None if all are handed out, or one that may end its worker is still to be alone."""
        if self._again:
            return None if self._under_way else self._again.popleft()
        if any(batch.deaths for batch in self._under_way.values()):
            return None
        left = self.todo.size - self._next
        if left == 0:
            return None
        fair = ceil(left / (2 * AHEAD * self.workers))
        size = 1 if self._seconds == 0.0 else max(1, min(int(BATCH_S / self._seconds), fair))
        self._next += size
        return Batch(self.todo[self._next - size : self._next])

    def _take(self, future: Future[list[Member]], batch: Batch) -> None:
        """Keep what came back; run again what did not."""
        try:
            members = future.result()
        except UserError:
            raise
        except Exception as error:  # of a worker that died
            self._lost(batch, error)
        else:
            each = sum(member.seconds for member in members) / len(members)
            self._seconds += (FORGETTING if self._seconds else 1.0) * (each - self._seconds)
            self.keep(members)

    def _lost(self, batch: Batch, error: Exception) -> None:
        """Run a batch again that took its worker along, member by member; give up one that does so time after time."""
        if batch.members.size == 1 and batch.deaths + 1 >= MOST_DEATHS:
            why = f"{batch.deaths + 1} workers died of it: {error or type(error).__name__}"
            self.keep([self.job.failed(int(batch.members[0]), why)])
        else:
            self._again.extend(batch.apart())
