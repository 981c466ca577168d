"""Is a run fine enough? Each tethered run is set beside a coarser one, and taken again finer where the two disagree.

    e_h = max |F_h − F_2h| / max |F_h|,    F the cable's force on the hull (12), steps and segments h and 2h

If each halving divides the change by r, what is left is e_h/(r − 1) (Richardson): a third of e_h at second order, e_h
at first. Of one pair r is not known, and `FIRST_GAIN` is supposed. The coarse run has a quarter of the nodes and steps.
Where the error is above `rtol`, the run is repeated with steps and segments halved, `MOST_HALVINGS` times at most; what
was the run is then the coarse one, and r = e_2h/e_h. Where it stays above `rtol`, the answer depends on the resolution,
and the run says so: a jolt, or an ill-posed drum (`docs/theory.md`).

That looks at the whole error, of segments, steps, slack and coupling alike, which an estimate inside a step does not: a
cable that is bent sharply beside the drum errs in its segments only, and its steps look perfect.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING

import numpy as np

import scenarios
from scenarios import ScenarioError
from subzero.errors import UserError

if TYPE_CHECKING:
    from subzero.recording import Run

MOST_HALVINGS = 2
"""Steps and segments a quarter as long cost sixteen times as much; what they do not settle, is not settled by more."""
MOST_WORK = 1e7
"""Nodes times exchanges that a repeated run may take: half a minute or so. [-]"""
FIRST_GAIN = 1.5
"""Gain of a halving that nobody has seen yet, below that of first order, 2: starts and jolts have less. [-]"""
LEAST_GAIN, MOST_GAIN = 1.25, 4.0
"""A halving that gains less than the first has hardly begun to converge; more than the scheme's second order gives is
not believed. [-]"""
SMALLEST_FORCE = 1e-6
"""Forces are compared with at least this: what is smaller means nothing. [N]"""

Progress = Callable[[float], None]
Take = Callable[[scenarios.Trial, np.ndarray, int, Progress | None], "Run"]
"""(trial, times of rows, exchanges a row, progress) → a run."""


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """How far the cable's force can be trusted.

    Attributes:
        force_error: of the force, as a share of its largest; infinite where the coarser run could not go on. [-]
        change: largest change of the force from the resolution before to this one, as the same share. [-]
        time: when it changes most. [s]
        halvings: how often steps and segments were halved.
        rtol: what was asked for. [-]
    """

    force_error: float
    change: float
    time: float
    halvings: int
    rtol: float

    @property
    def converged(self) -> bool:
        """Whether the error is what was asked for."""
        return self.force_error <= self.rtol


def run_converged(
    trial: scenarios.Trial, take: Take, progress: Progress | None = None
) -> tuple[Run, Accuracy | None]:
    """Run a trial as finely as its `rtol` asks for, and say how far its force can be trusted.

    Args:
        trial: a tethered one of the default scheme.
        take: makes a run.
        progress: told the fraction that is done; it goes back where a run is repeated.

    Returns:
        the run, with rows at the times of the trial however fine it is; and its accuracy, None for one too short.
    """
    times = trial.times()
    coarse_times = _every_other(times)
    coarser = _resolved(trial, 2.0)
    if coarser is None or coarse_times.size < 3:
        return take(trial, times, 1, progress), None
    coarse = _taken(take, coarser, coarse_times, 1, _share(progress, 0.0, 0.2))
    run = take(trial, times, 1, _share(progress, 0.2, 0.8))
    if coarse is None:
        return run, None
    accuracy = _compare(coarse, run, trial.rtol, 0)
    for halvings in range(1, MOST_HALVINGS + 1):
        finer = _resolved(trial, 0.5**halvings)
        if accuracy.converged or finer is None or _work(run) * 4**halvings > MOST_WORK:
            break
        fine = _taken(take, finer, times, 2**halvings, progress)
        if fine is None or (run.completed and not fine.completed):
            break
        run, accuracy = fine, _compare(run, fine, trial.rtol, halvings, accuracy.change)
    return run, accuracy


def _taken(
    take: Take, trial: scenarios.Trial, times: np.ndarray, parts: int, progress: Progress | None
) -> Run | None:
    """Return a run beside the one that was asked for; None where it is refused, for memory or a start that fails."""
    try:
        return take(trial, times, parts, progress)
    except UserError:
        return None


def _resolved(trial: scenarios.Trial, factor: float) -> scenarios.Trial | None:
    """Return a trial with segments, and smaller steps of the hull, times a factor; None beyond the limits."""
    try:
        return dataclasses.replace(
            trial,
            segment_length=factor * trial.segment_length,
            grading=factor * trial.grading,
            hull_step=min(factor, 1.0) * trial.hull_step,
        )
    except ScenarioError:
        return None


def _every_other(times: np.ndarray) -> np.ndarray:
    """Return every other time, and the last one."""
    return times[::2] if times.size % 2 else np.append(times[::2], times[-1])


def _compare(coarse: Run, fine: Run, rtol: float, halvings: int, before: float | None = None) -> Accuracy:
    """Return the accuracy of a run beside one with steps and segments twice as long.

    `before` is what the halving before this one changed, if there was one. [-]
    """
    rows = np.searchsorted(fine.times, coarse.times - 1e-9)
    here = rows < fine.times.size
    force = fine.recording.wrench[:, :3]
    gap = np.linalg.norm(force[rows[here]] - coarse.recording.wrench[here, :3], axis=1)
    gap[0] = 0.0  # the force of the first row is a guess
    size = max(float(np.linalg.norm(force, axis=1).max()), SMALLEST_FORCE)
    worst = int(np.argmax(gap))
    stopped_early = fine.completed and not coarse.completed
    change = inf if stopped_early else float(gap[worst]) / size
    gain = FIRST_GAIN if before is None or not isfinite(before) else before / max(change, 1e-12)
    return Accuracy(
        force_error=change / (min(max(gain, LEAST_GAIN), MOST_GAIN) - 1.0),
        change=change,
        time=float(coarse.times[-1 if stopped_early else worst]),
        halvings=halvings,
        rtol=rtol,
    )


def _work(run: Run) -> float:
    """Return nodes times rows of a run, summed up as it grows. [-]"""
    return float(run.recording.nodes.sum())


def _share(progress: Progress | None, start: float, size: float) -> Progress | None:
    """Return a progress that fills a part of another."""
    return None if progress is None else lambda fraction: progress(start + size * fraction)


def as_numbers(accuracy: Accuracy | None) -> dict[str, float | int | None]:
    """Return an accuracy ready for JSON: an infinite error as None."""
    if accuracy is None:
        return {}
    numbers = dataclasses.asdict(accuracy)
    return {name: value if isfinite(value) else None for name, value in numbers.items()}
