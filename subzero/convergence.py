"""Is a run fine enough? Each tethered run is set beside a coarser one, and taken again finer where the two disagree.

    e_h = max |F_h − F_2h| / max |F_h|,    F the cable's force on the hull (12), steps and segments h and 2h

If each halving divides the change by r, what is left is e_h/(r − 1) (Richardson): a third of e_h at second order, e_h
at first. Of one pair r is not known, and the first order is supposed. The coarse run has a quarter of the nodes and
steps. Where the error is above `rtol`, the run is repeated with steps and segments halved, `MOST_HALVINGS` times;
what was the run is then the coarse one, and r = e_2h/e_h. A cable that comes taut makes r irregular: it does so
between two samples, and the largest change hangs on which. So does a command that changes between two. So while
another halving is cheap (`CHEAP_WORK`), no order is believed: halves are taken on until one changes no more than
`rtol`. Before any doubt is told, they are taken on as long as that is cheap, and once more where the first order
would then settle it; from the third on, what the last halving changes is the error. Where that stays above `rtol`,
the answer depends on the resolution, and the run says so: a jolt, or an ill-posed drum (`docs/theory.md`).

The first `START_ROWS` samples follow no such law. A start is a jolt: a current, a winch or the propeller takes hold of
the cable at once, what it sets off fades or rings within a few steps, and the coarse run has no sample in the first.
But they are cheap. So there the error is found, not estimated, by a run of these samples alone with steps and segments
a quarter as long (`START_REFINEMENTS`).

A doubt is proved where that does not take long. A run may be right since its last halving, which only another would
show; and one that confirms itself may be doubted for what it does, as an ill-posed drum may be the same on segments of
one and of half a metre. So every run that would end with a doubt that finer ones can settle
(`subzero.validity.refinement_that_settles`) is held against runs two, four and, where it must be, eight times as fine,
of which the first that contradicts is the last (`prove`). So is one whose error is estimated at more than three
quarters of `rtol`: an estimate is not as good as that. What they change is its error, whatever was estimated before.

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
from subzero.engine.recording import Grid
from subzero.errors import UserError

if TYPE_CHECKING:
    from subzero.engine.recording import Run

MOST_HALVINGS, CHEAP_HALVINGS = 2, 4
"""Steps and segments a quarter as long cost sixteen times as much. Up to `CHEAP_HALVINGS` are taken where they are
cheap; and a third one where the error is within `LEAST_GAIN` of `rtol`."""
MOST_WORK, CHEAP_WORK = 1e7, 3e5
"""Nodes times exchanges that a repeated run may take, half a minute or so; and that are cheap, a second or so. [-]"""
PROOFS, PROOF_WORK = (2, 4, 8), 3e7
"""How much finer the runs of a proof are; and nodes times iterations that the finest may take, at half a microsecond
each. [-]"""
LEAST_GAIN, MOST_GAIN = 2.0, 4.0
"""Gain of a halving, of the first and of the second order; more or less than these is chance, and not believed. [-]"""
START_ROWS, START_REFINEMENTS = 5, (4, 2)
"""Samples that belong to the start, and how much finer these are taken to see their error: half as fine where a run of
a stiff cable does not get so far. [-]"""
SMALLEST_FORCE = 1e-6
"""Forces are compared with at least this: what is smaller means nothing. [N]"""

Progress = Callable[[float], None]
Take = Callable[[scenarios.Trial, Grid, Progress | None], "Run"]
"""(trial, its times and what is kept, progress) → a run."""


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """How far the cable's force can be trusted.

    Attributes:
        force_error: of the force, as a share of its largest; infinite where another resolution could not go on. [-]
        change: largest change of the force from the resolution before to this one, after the start, as that share. [-]
        time: when it changes most. [s]
        start_error: of the force in the first samples, beside a run that is finer still, as that share. [-]
        start_time: when that is largest. [s]
        halvings: how often steps and segments were halved.
        rtol: what was asked for. [-]
        proof_error: change of the force to the finest run of a proof, as that share; 0 without a proof. [-]
        proof_time: when that is largest. [s]
        proof_finer: how many times as fine that run is; 0 without a proof.
    """

    force_error: float
    change: float
    time: float
    start_error: float
    start_time: float
    halvings: int
    rtol: float
    proof_error: float = 0.0
    proof_time: float = 0.0
    proof_finer: int = 0

    @property
    def converged(self) -> bool:
        """Whether the error is what was asked for."""
        return self.force_error <= self.rtol


@dataclass(frozen=True, kw_only=True)
class Change:
    """Largest change of the force between two runs, as a share of its largest value [-], and when it is [s]."""

    size: float
    time: float


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
    coarser = resolved(trial, 2.0)
    whole = Grid(times, 1, trial.stride)
    if coarser is None or coarse_times.size < 3:
        return take(trial, whole, progress), None
    coarse = _taken(take, coarser, _only_traced(coarse_times, 1), _share(progress, 0.0, 0.2))
    run = take(trial, whole, _share(progress, 0.2, 0.8))
    if coarse is None:
        return run, None
    change = _after_start(coarse, run)
    accuracy = _accuracy(trial, take, run, change, None, 0)
    for halvings in range(1, CHEAP_HALVINGS + 1):
        work = _finer_work(run, halvings)
        if work > _allowed(accuracy) or _settled(accuracy, work <= CHEAP_WORK):
            break
        finer = resolved(trial, 0.5**halvings)
        grid = whole._replace(parts=2**halvings)
        fine = None if finer is None else _taken(take, finer, grid, progress)
        if fine is None or (run.completed and not fine.completed):
            break
        run, before, change = fine, change, _after_start(run, fine)
        accuracy = _accuracy(trial, take, run, change, before, halvings)
    return run, accuracy


def _settled(accuracy: Accuracy, is_cheap: bool) -> bool:
    """Say whether no other halving is needed; a cheap one is, where only the order says that the error is small."""
    return accuracy.converged and not (is_cheap and accuracy.change > accuracy.rtol)


def _allowed(accuracy: Accuracy) -> float:
    """Return the work that one more halving may take. [-]"""
    near = accuracy.halvings == MOST_HALVINGS and accuracy.force_error <= LEAST_GAIN * accuracy.rtol
    return MOST_WORK if accuracy.halvings < MOST_HALVINGS or near else CHEAP_WORK


def prove(
    trial: scenarios.Trial,
    take: Take,
    run: Run,
    accuracy: Accuracy,
    finest: int,
    progress: Progress | None = None,
) -> Accuracy:
    """Hold a run that is doubted against finer ones, up to `finest` times as fine; stop at what contradicts it.

    Args:
        trial: a tethered one of the default scheme.
        take: makes a run.
        run: of the trial, as `run_converged` gives it; of its recording, trace and iterations are needed.
        accuracy: of the run.
        finest: one of `PROOFS`.
        progress: told the fraction that is done of each run.

    Returns:
        the accuracy with the error that was found, where all of them agree or one contradicts. The error stays as it
        was where the finest would take more than `PROOF_WORK`, as far as the one before tells, and where one of them is
        refused or does not reach the end: that proves nothing.
    """
    latest, reached, worst = run, 1, 0.0
    for finer in PROOFS[: PROOFS.index(finest) + 1]:
        too_long = _iterated(latest) * (finest / reached) ** 2 > PROOF_WORK
        fine = None if too_long else _finer(trial, take, run, 2**accuracy.halvings, finer, progress)
        if fine is None:
            break
        found = _change(run, fine, 1, _largest(run))
        latest, reached, worst = fine, finer, max(worst, found.size)
        accuracy = dataclasses.replace(
            accuracy, proof_error=found.size, proof_time=found.time, proof_finer=finer
        )
        if finer == finest or worst > accuracy.rtol:
            return dataclasses.replace(accuracy, force_error=worst)
    return accuracy


def _finer(
    trial: scenarios.Trial, take: Take, run: Run, given: int, finer: int, progress: Progress | None
) -> Run | None:
    """Return a run of a proof; None where it is refused, takes more than `PROOF_WORK`, or does not reach the end.

    Args:
        trial: of the run.
        take: makes a run.
        run: what is proved.
        given: how many times as fine as its trial that is.
        finer: how many times as fine as that.
        progress: told the fraction that is done.
    """
    other = resolved(trial, 1.0 / (finer * given))
    if other is None:
        return None
    most = PROOF_WORK / (finer * _mean_nodes(run))
    grid = _only_traced(run.all_times, finer * given)._replace(iterations=most)
    fine = _taken(take, other, grid, progress)
    return fine if fine is not None and fine.completed else None


def _only_traced(times: np.ndarray, parts: int) -> Grid:
    """Return the grid of a run of which nothing but the force is of use: no energies, and of its rows two, its ends."""
    return Grid(times, parts, times.size, booked=False)


def _taken(take: Take, trial: scenarios.Trial, grid: Grid, progress: Progress | None) -> Run | None:
    """Return a run beside the one that was asked for; None where it is refused, for memory or a start that fails."""
    try:
        return take(trial, grid, progress)
    except UserError:
        return None


def resolved(trial: scenarios.Trial, factor: float) -> scenarios.Trial | None:
    """Return a trial with segments, and smaller steps of the hull, times a factor; None beyond the limits."""
    try:
        return dataclasses.replace(
            trial,
            segment_length=factor * trial.segment_length,
            grading=factor * trial.grading,
            far_grading=factor * trial.far_grading,
            hull_step=min(factor, 1.0) * trial.hull_step,
        )
    except ScenarioError:
        return None


def _every_other(times: np.ndarray) -> np.ndarray:
    """Return every other time, and the last one."""
    return times[::2].copy() if times.size % 2 else np.append(times[::2], times[-1])


def _accuracy(
    trial: scenarios.Trial, take: Take, run: Run, change: Change, before: Change | None, halvings: int
) -> Accuracy:
    """Return the accuracy of a run; `change` is what the last halving brought, `before` the one before, if any.

    A run that will be repeated anyhow needs no look at its start.
    """
    known = before is not None and isfinite(before.size) and halvings <= MOST_HALVINGS
    gain = before.size / max(change.size, 1e-12) if before is not None and known else LEAST_GAIN
    error = change.size / (min(max(gain, LEAST_GAIN), MOST_GAIN) - 1.0)
    looks = error <= trial.rtol or halvings >= MOST_HALVINGS
    start = _start(trial, take, run, halvings) if looks else Change(size=0.0, time=0.0)
    return Accuracy(
        force_error=max(error, start.size),
        change=change.size,
        time=change.time,
        start_error=start.size,
        start_time=start.time,
        halvings=halvings,
        rtol=trial.rtol,
    )


def _after_start(coarse: Run, fine: Run) -> Change:
    """Return the change from a run to a finer one, after the start; infinite if only the finer one reaches the end."""
    if fine.completed and not coarse.completed:
        return Change(size=inf, time=float(coarse.all_times[-1]))
    return _change(coarse, fine, START_ROWS + 1, _largest(fine))


def _start(trial: scenarios.Trial, take: Take, run: Run, halvings: int) -> Change:
    """Return what finer steps and segments change in the first samples; nothing where no finer run gets so far."""
    times = run.all_times[: START_ROWS + 1]
    for finer in START_REFINEMENTS if times.size > 1 else ():
        other = resolved(trial, 0.5**halvings / finer)
        fine = None if other is None else _taken(take, other, _only_traced(times, finer * 2**halvings), None)
        if fine is not None and fine.completed:
            return _change(run, fine, 1, _largest(run))
    return Change(size=0.0, time=0.0)


def _change(one: Run, fine: Run, first: int, largest: float) -> Change:
    """Return the change from a run to a finer one, at their common times from number `first` of the finer one on.

    The force of time 0 is a guess. Forces are compared with the `largest` of the run. [N]
    """
    rows = np.searchsorted(fine.all_times, one.all_times - 1e-9)
    here = (rows < fine.all_times.size) & (rows >= first)
    if not here.any():
        return Change(size=0.0, time=0.0)
    gap = fine.recording.trace[rows[here], :3] - one.recording.trace[here, :3]
    size = np.linalg.norm(gap, axis=1)
    worst = int(np.argmax(size))
    return Change(size=float(size[worst]) / largest, time=float(one.all_times[here][worst]))


def _largest(run: Run) -> float:
    """Return the largest force of a run, at least what means something. [N]."""
    return max(float(np.linalg.norm(run.recording.trace[:, :3], axis=1).max()), SMALLEST_FORCE)


def _work(run: Run) -> float:
    """Return nodes times times of a run, summed up as it grows. [-]"""
    return float(run.recording.trace[:, 3].sum())


def _mean_nodes(run: Run) -> float:
    """Return how many nodes a run has, on average. [-]"""
    return float(run.recording.trace[:, 3].mean())


def _iterated(run: Run) -> float:
    """Return nodes times iterations of Newton's method of a run: what it took, half a microsecond each. [-]"""
    return float(run.recording.iterations[-1]) * _mean_nodes(run)


def _finer_work(run: Run, halvings: int) -> float:
    """Return nodes times exchanges of a run with so many halvings, from the one before, with half as many nodes. [-]"""
    return _work(run) * 2.0 ** (1 + halvings)


def _share(progress: Progress | None, start: float, size: float) -> Progress | None:
    """Return a progress that fills a part of another."""
    return None if progress is None else lambda fraction: progress(start + size * fraction)


def as_numbers(accuracy: Accuracy | None) -> dict[str, float | int | None]:
    """Return an accuracy ready for JSON: an infinite error as None."""
    if accuracy is None:
        return {}
    numbers = dataclasses.asdict(accuracy)
    return {name: value if isfinite(value) else None for name, value in numbers.items()}
