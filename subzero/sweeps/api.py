"""Run a sweep: from a plan to one dataset, on this machine or on a cluster, however often it is interrupted."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

import scenarios
from subzero.arguments import checked_arguments
from subzero.errors import UserError, short, suggestion, whole
from subzero.sweeps.member import Member
from subzero.sweeps.plan import Plan, Planned, plan_sweep
from subzero.sweeps.result import RESULT, Gathered, open_result, write_result
from subzero.sweeps.schedule import Schedule
from subzero.sweeps.store import Store, opened
from subzero.sweeps.workers import WorkerPool, cores

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, kw_only=True)
class SweepProgress:
    """How far a sweep is.

    Attributes:
        finished: members that are.
        members: all of them.
        failed: of those that are finished.
        rate: members a second since it began. [1/s]
        slowest: number of the member that took longest since it began, and how long; −1 if none took much longer than
            the others. [s]
    """

    finished: int
    members: int
    failed: int
    rate: float
    slowest: tuple[int, float] = (-1, 0.0)

    @property
    def seconds_left(self) -> float:
        """How long it will take at this rate, infinite before there is one. [s]."""
        return (self.members - self.finished) / self.rate if self.rate > 0.0 else float("inf")


Progress = Callable[[SweepProgress], None]
"""Called after every batch with the progress of the sweep."""


@checked_arguments
def sweep(
    scenario: str | Path | scenarios.Trial | Plan,
    parameters: Mapping[str, Any] | None = None,
    *,
    out: str | Path | None = None,
    workers: int | Executor | None = None,
    client: Any = None,
    progress: Progress | None = None,
    **how: Unpack[Planned],
) -> xr.Dataset:
    """Run a trial with many values of its parameters, and return one labelled dataset.

    >>> import subzero
    >>> runs = subzero.sweep("fig6", {"start.wet_length_m": [0, 20, 40]}, changes={"run.duration_s": 2.0})
    >>> runs["peak_speed_m_s"].sizes["member"]
    3

    Args:
        scenario: name of a shipped scenario, path of a scenario file, a trial, or a whole plan (`plan_sweep`).
        parameters: their values, as of `plan_sweep`; not with a plan, which has them.
        out: folder that keeps the members. The same call with it goes on where another was killed; without one, nothing
            is kept.
        workers: processes on this machine, by default one for each of its cores; or a `concurrent.futures.Executor`.
        client: Dask client to run on instead.
        progress: called after every batch with the progress.
        **how: `design`, `changes`, `kept`, `tethered`, `description`, as of `plan_sweep`.

    Returns:
        parameters as coordinates on ``member``; scalars (member), channels (member, time); ``failed``, ``reason`` and
        ``warnings`` of every member. With `out` it is read from the file as far as it is looked at.
        ``runs.set_index(member=[...]).unstack()`` gives a grid one dimension for each parameter.

    Raises:
        UserError: what can be no plan; a folder with another sweep; workers that are none.
    """
    plan = _plan(scenario, parameters, how)
    if client is not None and workers is not None:
        raise UserError("sweep: workers and client are both given. Give one of them.")
    workers = workers if client is None else client
    place = tempfile.TemporaryDirectory(prefix="subzero-sweep-") if out is None else nullcontext(out)
    with place as folder:
        with finished(plan, Path(folder), workers=workers, progress=progress) as store:
            deliver(plan, store, Path(folder))
        if out is not None:
            return open_result(Path(folder) / RESULT)
        with open_result(Path(folder) / RESULT) as runs:
            return runs.load()


def _plan(
    scenario: str | Path | scenarios.Trial | Plan, parameters: Mapping[str, Any] | None, how: Planned
) -> Plan:
    """Return the plan that is meant."""
    if not isinstance(scenario, Plan):
        unknown = sorted(set(how) - set(Planned.__annotations__))
        if unknown:
            near = suggestion(unknown[0], Planned.__annotations__)
            raise UserError(f"sweep: there is no argument {unknown[0]!r}.{near}")
        if parameters is None:
            raise UserError(
                'sweep: no parameters are given. Give their values, as in {"start.wet_length_m": [0, 20, 40]}.'
            )
        return plan_sweep(scenario, parameters, **how)
    if parameters is not None or how:
        raise UserError(
            "sweep: a plan has its parameters already. Leave them out, or give the trial and not a plan."
        )
    return scenario


@contextmanager
def finished(
    plan: Plan,
    folder: Path,
    *,
    workers: Any = None,
    progress: Progress | None = None,
    retry: bool = False,
) -> Iterator[Store]:
    """Yield the store of a sweep with all its members finished; members finished by a former call are not run again.

    Args:
        plan: the sweep.
        folder: where the store is, or will be.
        workers: as of `sweep`.
        progress: as of `sweep`.
        retry: run members again that failed.

    Raises:
        UserError: as of `sweep`, or workers that cannot go on; finished members are kept.
    """
    check_workers(workers)  # before there is a folder
    job, rows = plan.job, plan.points.values
    shape = len(job.outcomes.channels), job.outcomes.times.size
    with opened(folder, plan.manifest(), shape) as store:
        if retry:
            store.forget_failed()
        done = store.finished(len(rows))
        tally = _Tally(store, len(rows), int(done.sum()), progress)
        if not done.all():
            with _executor(workers, len(rows) - int(done.sum())) as (executor, count):
                Schedule(job, rows, np.flatnonzero(~done), count, tally.keep).run(executor)
        yield store


class _Tally:
    """Keeps members, and reports the progress of the sweep."""

    def __init__(self, store: Store, members: int, finished: int, progress: Progress | None) -> None:
        self._store, self._members, self._progress = store, members, progress
        self._finished, self._before = finished, finished
        self._failed, self._started = store.failures(), monotonic()
        self._slowest, self._seconds = (-1, 0.0), 0.0
        self._report()

    def keep(self, members: Sequence[Member]) -> None:
        self._store.add(members)
        self._finished += len(members)
        self._failed += sum(bool(member.reason) for member in members)
        self._seconds += sum(member.seconds for member in members)
        self._slowest = max(
            self._slowest, *((member.index, member.seconds) for member in members), key=lambda pair: pair[1]
        )
        self._report()

    def _report(self) -> None:
        if self._progress is not None:
            count = self._finished - self._before
            rate = count / max(monotonic() - self._started, 1e-9)
            others = (self._seconds - self._slowest[1]) / max(count - 1, 1)
            from subzero.simulation.refinement import BUDGET_RATIO  # heavy, and there is no member without it

            slowest = self._slowest if count > 1 and self._slowest[1] > BUDGET_RATIO * others else (-1, 0.0)
            self._progress(
                SweepProgress(
                    finished=self._finished,
                    members=self._members,
                    failed=self._failed,
                    rate=rate,
                    slowest=slowest,
                )
            )


def deliver(plan: Plan, store: Store, folder: Path) -> Gathered:
    """Write the dataset of a finished sweep to a folder, whole or not at all; return the data for figures and
    page.
    """
    with tempfile.TemporaryDirectory(prefix=".subzero-", dir=folder) as hidden:
        found = write_result(store, plan.job, plan.points, plan.attributes, Path(hidden))
        for path in sorted(Path(hidden).iterdir()):
            os.replace(path, folder / path.name)
    return found


@contextmanager
def _executor(workers: Any, members: int) -> Iterator[tuple[Executor, int]]:
    """Yield the executor of the members, and the number that it runs at a time."""
    if isinstance(workers, Executor):
        yield workers, workers.count if isinstance(workers, WorkerPool) else cores()
    elif _is_client(workers):
        yield workers.get_executor(), _cluster_size(workers)
    else:
        count = min(cores() if workers is None else workers, members)
        pool = WorkerPool(count)
        try:
            yield pool, count
        finally:
            pool.shutdown(cancel_futures=True)


def check_workers(workers: Any) -> None:
    """Raise an error for workers that cannot run members.

    Raises:
        UserError: neither a number of processes, nor a Dask client, nor an executor.
    """
    if workers is None or isinstance(workers, Executor) or _is_client(workers):
        return
    if isinstance(workers, (int, float, str)):
        whole("workers", workers, least=1)
    else:
        raise UserError(
            f"workers is {short(workers)}. Allowed: a number of processes, a Dask client, or a"
            " concurrent.futures.Executor."
        )


def _is_client(workers: Any) -> bool:
    """Return whether this is a Dask client; Dask itself need not be installed."""
    return hasattr(workers, "get_executor") and hasattr(workers, "ncores")


CLUSTER_WAIT_S = 30
"""So long is waited for the first worker of a cluster. [s]"""


def _cluster_size(client: Any) -> int:
    """Return how many members a Dask cluster runs at a time, once it has a worker."""
    try:
        client.wait_for_workers(1, timeout=CLUSTER_WAIT_S)
    except TimeoutError:
        raise UserError(
            f"The Dask scheduler has no worker after {CLUSTER_WAIT_S} s. Start some: dask worker ADDRESS --nthreads 1"
        ) from None
    cores: dict[str, int] = client.ncores()
    return max(1, sum(cores.values()))
