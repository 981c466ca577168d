"""One member of a sweep: a trial with its own numbers, run and looked at, in any process.

A `Job` is all that a worker needs, and is sent to it with every batch. What a member gives depends on the job and its
own number only: neither on who runs it, nor on what was run before. Whatever goes wrong with a member is kept as its
reason; only a damaged job, or another version of the code, stops the sweep.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

import scenarios
from scenarios.parameters import with_parameters
from subzero.errors import UserError, printable
from subzero.simulation.provenance import code_digest
from subzero.sweeps.outcomes import Outcomes, channels_of, own_numbers, scalars_of

if TYPE_CHECKING:
    from subzero.results.dataset import PlainRun

LONGEST_REASON = 1000
"""So much of a reason is kept. [characters]"""


@dataclass(frozen=True, kw_only=True)
class Member:
    """The outcomes of a member that are kept.

    Attributes:
        index: its number in the sweep, from 0.
        reason: why it failed; empty if it did not.
        warnings: (check, message) of its run.
        scalars: (scalars,), NaN if it failed.
        channels: (channels, times), float32; NaN if it failed.
        own: numbers that a function of one's own returned, by name.
        seconds: how long it took, which is no part of a result. [s]
        refinement_share: share of its work that runs with finer steps took. [-]
    """

    index: int
    reason: str
    warnings: tuple[tuple[str, str], ...]
    scalars: np.ndarray
    channels: np.ndarray
    own: dict[str, float]
    seconds: float
    refinement_share: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Job:
    """The data that a worker needs to run members.

    Attributes:
        trial: the trial to sweep, with all changes that hold for every member.
        names: of the parameters that change.
        outcomes: the outcomes to keep.
        tethered: with the cable.
        code: digest of the sources that the sweep was planned with.
    """

    trial: scenarios.Trial
    names: tuple[str, ...]
    outcomes: Outcomes
    tethered: bool
    code: str

    def run(self, first: int, rows: np.ndarray) -> Member:
        """Run a member; `rows` are the values of its parameters (parameters,)."""
        started = perf_counter()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the run keeps its own
                run = self._run(rows)
            return self._seen(first, run, started)
        except Exception as error:
            reported = str(error) if isinstance(error, UserError) else f"{type(error).__name__}: {error}"
            return self.failed(first, reported, perf_counter() - started)

    def _run(self, row: np.ndarray) -> PlainRun:
        """Return the run of a member."""
        from subzero.simulation.run import simulate_plainly

        trial = with_parameters(self.trial, dict(zip(self.names, row.tolist(), strict=True)))
        return simulate_plainly(trial, tethered=self.tethered)

    def _seen(self, index: int, run: PlainRun, started: float) -> Member:
        """Return the outcomes of a run that are kept."""
        warned = tuple(
            (load["check"], load["message"]) for load in json.loads(run.attrs.get("warnings", "[]"))
        )
        if run.attrs["outcome"] != "completed":
            return self.failed(index, run.attrs["outcome_message"], perf_counter() - started, warned)
        return Member(
            index=index,
            reason="",
            warnings=warned,
            scalars=scalars_of(run, self.outcomes.scalars),
            channels=channels_of(run, self.outcomes),
            own=own_numbers(run, self.outcomes.function),
            seconds=perf_counter() - started,
            refinement_share=json.loads(run.attrs["accuracy"]).get("refinement_share", 0.0),
        )

    def failed(
        self, index: int, why: str, seconds: float = 0.0, warned: tuple[tuple[str, str], ...] = ()
    ) -> Member:
        """Return a member that failed, and why."""
        shape = (len(self.outcomes.channels), self.outcomes.times.size)
        return Member(
            index=index,
            reason=printable(why[:LONGEST_REASON]) or "it failed without a word",
            warnings=warned,
            scalars=np.full(len(self.outcomes.scalars), np.nan),
            channels=np.full(shape, np.nan, dtype=np.float32),
            own={},
            seconds=seconds,
        )


class OtherVersionError(UserError):
    """A worker has another version of the code than the sweep was planned with."""


def run_members(job: Job, indices: Sequence[int], rows: np.ndarray) -> list[Member]:
    """Run members one after another; what a worker is asked for.

    Args:
        job: the sweep.
        indices: their numbers.
        rows: their parameters (members, parameters), in the units of the files.

    Raises:
        OtherVersionError: this process has other sources.
    """
    if job.code != code_digest():
        raise OtherVersionError(
            "A worker has another version of subzero than the one that plans the sweep, and would give other numbers."
            " Install the same on all machines, and start the workers again."
        )
    return [job.run(int(index), row) for index, row in zip(indices, rows, strict=True)]
