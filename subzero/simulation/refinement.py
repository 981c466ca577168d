"""Is a run fine enough? Each tethered run is compared with a coarser one, and repeated finer where the two disagree.

    e_h = max |F_h − F_2h| / max |F_h|,    F the cable's force on the hull (12), steps and segments h and 2h

The error that is reported is the last change e_h: no order is believed, for a cable that comes taut between two samples
follows none. Where e_h is above `rtol`, the run is repeated with steps and segments halved; what was the run is then
the coarse one.

The first `START_ROWS` samples follow no such law. A start is a jolt: a current, a winch or the propeller takes hold of
the cable at once, what it sets off fades or rings within a few steps, and the coarse run has no sample in the first.
So there the error is found by a run of these samples alone with steps and segments a quarter as long
(`START_REFINEMENTS`).

A doubt is proved where that does not take long. A run may confirm itself and be doubted for what it does, as an
ill-posed drum may be the same on segments of one and of half a metre. So every run that would end with a doubt that
finer ones can settle (`subzero.validity.refinement_that_settles`) is compared with runs two, four and, where it must
be, eight times as fine, of which the first that contradicts is the last (`prove`). What they change is its error.

The coarse run, and that of the start, are made in a second thread while the first makes the run itself: compiled code
lets go of Python's lock.

All of these runs share one `Budget`: `[run] budget_s`, or else ten times the work of the run as it was asked for, at
least two seconds of it. It is counted in nodes times iterations, not by a clock, so that the same trial gives the same
numbers on every machine. A run of an ill-posed problem takes ever more iterations as it is refined, so the budget ends
its refinement soon; then the last change is the error, and the run says that it is not resolved.

Where the cable comes taut between two samples (`_in_snap`), a force at a sample says how far a snap is at that instant,
which a shift by a millisecond changes by tens of newtons. There the largest pulls around the sample are compared, which
the exchanges follow with steps of their own (`subzero.engine.coupling`).

That looks at the whole error, of segments, steps, slack and coupling alike, which an estimate inside a step does not: a
cable that is bent sharply near the drum errs in its segments only, and its steps look perfect.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from math import inf
from threading import Event
from typing import TYPE_CHECKING

import numpy as np

import scenarios
from scenarios import ScenarioError
from subzero.engine.recording import TUG, Grid
from subzero.errors import UserError

if TYPE_CHECKING:
    from subzero.engine.recording import Run

MOST_HALVINGS = 4
"""Steps and segments a sixteenth as long cost 256 times as much. [-]"""
PROOFS = (2, 4, 8)
"""How much finer the runs of a proof are. [-]"""
NODE_ITERATION_S = 5e-7
"""Time that one iteration of Newton's method takes for one node. [s]"""
BUDGET_RATIO, LEAST_BUDGET_S = 10.0, 2.0
"""Finer runs may take so many times what the run as asked for takes, or so long if that is more. [-], [s]"""
START_ROWS, START_REFINEMENTS = 5, (4, 2)
"""Samples that belong to the start, and how much finer these are taken to see their error: half as fine where a run of
a stiff cable does not get so far. [-]"""
SNAP_OVERSHOOT = 0.03
"""The cable snaps where its pull between samples is above that at the samples by this share of its largest. [-]"""
SMALLEST_FORCE = 1e-6
"""Forces are compared with at least this: smaller ones have no meaning. [N]"""

Progress = Callable[[float], None]
"""Called now and then with the fraction that is done, 0 to 1."""
Take = Callable[[scenarios.Trial, Grid, Progress | None], "Run"]
"""(trial, its times and the rows to keep, progress) → a run."""


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """How far the cable's force can be trusted.

    Attributes:
        force_error: of the force, as a share of its largest; infinite where another resolution could not go on. [-]
        change: largest change of the force from the resolution before to this one, after the start, as that share. [-]
        time: when it changes most. [s]
        start_error: of the force in the first samples, from a run that is finer still, as that share. [-]
        start_time: when that is largest. [s]
        halvings: how often steps and segments were halved.
        rtol: the requested accuracy. [-]
        proof_error: change of the force to the finest run of a proof, as that share; 0 without a proof. [-]
        proof_time: when that is largest. [s]
        proof_finer: how many times as fine that run is; 0 without a proof.
        budget_spent: the budget ended the refinement.
        refinement_share: of the work of the run as it was asked for and of all finer ones, what these took. [-]
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
    budget_spent: bool = False
    refinement_share: float = 0.0

    @property
    def converged(self) -> bool:
        """Whether the error is within the requested accuracy."""
        return self.force_error <= self.rtol


@dataclass(frozen=True, kw_only=True)
class Change:
    """Largest change of the force between two runs, as a share of its largest value [-], and when it is [s]."""

    size: float
    time: float


class Budget:
    """Work that may still be spent on finer runs of a trial.

    Args:
        seconds: how long they may take; 0 for `BUDGET_RATIO` times the run as it was asked for. [s]

    Attributes:
        is_spent: a run that was wanted is beyond it.
    """

    def __init__(self, seconds: float = 0.0) -> None:
        self._seconds, self._left, self.is_spent = seconds, 0.0, False
        self._asked = self._spent = 0.0

    @property
    def share(self) -> float:
        """Work of finer runs, as a share of that and of the run as it was asked for. [-]"""
        return self._spent / max(self._asked + self._spent, 1.0)

    def grant(self, run: Run) -> None:
        """Make the budget that of a run as it was asked for."""
        seconds = self._seconds or max(BUDGET_RATIO * NODE_ITERATION_S * _iterated(run), LEAST_BUDGET_S)
        self._left, self._asked = seconds / NODE_ITERATION_S, _iterated(run)

    def allows(self, like: Run, finer: float, times: float = 1.0) -> bool:
        """Return whether a run so many times as fine as another, of a share of its times, is within the budget."""
        is_within = _iterated(like) * finer**2 * times <= self._left
        self.is_spent |= not is_within
        return is_within

    def spend(
        self,
        take: Take,
        like: Run,
        finer: float,
        trial: scenarios.Trial | None,
        grid: Grid,
        progress: Progress | None,
    ) -> Run | None:
        """Return a finer run; None where it is refused, costs too much or, found in the midst of it, more than that.

        Args:
            take: makes a run.
            like: a run whose nodes are known.
            finer: how many times as fine as that the trial is; a run takes the square as long, or more.
            trial: the trial to run; None beyond the limits of a trial.
            grid: its times and the rows to keep.
            progress: called with the fraction that is done.
        """
        times = grid.times.size / like.all_times.size  # the start alone has few of them
        if trial is None or not self.allows(like, finer, times):
            return None
        nodes = finer * _mean_nodes(like)
        run = _taken(take, trial, grid._replace(iterations=self._left / nodes), progress)
        if run is not None:
            self._left -= _iterated(run)
            self._spent += _iterated(run)
            self.is_spent |= self._left <= 0.0
        return run


def run_converged(
    trial: scenarios.Trial,
    take: Take,
    budget: Budget,
    progress: Progress | None = None,
    *,
    side_by_side: bool = True,
) -> tuple[Run, Accuracy | None]:
    """Run a trial as finely as its `rtol` asks for and a budget allows, and say how far its force can be trusted.

    Args:
        trial: a tethered one of the default scheme.
        take: makes a run.
        budget: of the finer runs; granted here.
        progress: called with the fraction that is done; it goes back where a run is repeated.
        side_by_side: make the coarser run while the run itself is made, in a second thread; else after it.

    Returns:
        the run, with rows at the times of the trial however fine it is; and its accuracy, None for one too short.
    """
    times = trial.times()
    coarse_times = _every_other(times)
    coarser = resolved(trial, 2.0)
    whole = Grid(times, 1, trial.stride)
    # Without a coarser run there is nothing to compare with.
    if coarser is None or coarse_times.size < 3:
        return take(trial, whole, progress), None
    # The coarse run is there for its force alone, so its energies and shapes are not kept.
    coarse_grid = _only_traced(coarse_times, 1)
    if side_by_side:
        run, coarse, take = _side_by_side(take, (trial, whole), (coarser, coarse_grid), progress)
    else:
        run = take(trial, whole, part_of(progress, 0.0, 0.7))
        coarse = _taken(take, coarser, coarse_grid, part_of(progress, 0.7, 1.0))
    # The budget depends on the work of the run as asked for, which is known only now.
    budget.grant(run)
    if coarse is None:
        return run, None
    accuracy = _accuracy(trial, take, budget, run, _after_start(coarse, run), 0)
    for halvings in range(1, MOST_HALVINGS + 1):
        if accuracy.converged:
            break
        grid = whole._replace(parts=2**halvings)
        fine = budget.spend(take, run, 2.0, resolved(trial, 0.5**halvings), grid, progress)
        # A finer run that stops early does not replace one that reaches the end.
        if fine is None or (run.completed and not fine.completed):
            accuracy = dataclasses.replace(accuracy, budget_spent=budget.is_spent)
            break
        # The finer run takes the place of the run; the one before is then the coarse one.
        run, change = fine, _after_start(run, fine)
        accuracy = _accuracy(trial, take, budget, run, change, halvings)
    return run, accuracy


def prove(
    trial: scenarios.Trial,
    take: Take,
    run: Run,
    accuracy: Accuracy,
    finest: int,
    budget: Budget,
    progress: Progress | None = None,
) -> Accuracy:
    """Compare a run that is doubted with finer ones, up to `finest` times as fine; stop at one that contradicts it.

    Args:
        trial: a tethered one of the default scheme.
        take: makes a run.
        run: of the trial, as `run_converged` gives it; of its recording, trace and iterations are needed.
        accuracy: of the run.
        finest: one of `PROOFS`.
        budget: the budget left by `run_converged`.
        progress: called with the fraction that is done of each run.

    Returns:
        the accuracy with the error that was found, where all of them agree or one contradicts. The error is not
        changed where the budget does not allow the finest, as far as the one before shows, and where one of them is
        refused or does not reach the end: that proves nothing.
    """
    latest, reached, worst, given = run, 1, 0.0, 2**accuracy.halvings
    for finer in PROOFS[: PROOFS.index(finest) + 1]:
        # Proofs that the budget has allowed are kept, and the error is not changed.
        if not budget.allows(latest, finest / reached):
            break
        # The finer run is sampled at the times of the run: their forces are compared there.
        grid = _only_traced(run.all_times, finer * given)
        fine = budget.spend(
            take, latest, finer / reached, resolved(trial, 1.0 / (finer * given)), grid, progress
        )
        if fine is None or not fine.completed:
            break
        found = _change(run, fine, 1, _largest(run))
        latest, reached, worst = fine, finer, max(worst, found.size)
        accuracy = dataclasses.replace(
            accuracy, proof_error=found.size, proof_time=found.time, proof_finer=finer
        )
        # A contradiction ends the proof: the change is then the error.
        if finer == finest or worst > accuracy.rtol:
            return dataclasses.replace(accuracy, force_error=worst)
    return accuracy


def _only_traced(times: np.ndarray, parts: int) -> Grid:
    """Return the grid of a run of which nothing but the force is of use: no energies, and of its rows two, its ends."""
    return Grid(times, parts, times.size, booked=False)


def _taken(take: Take, trial: scenarios.Trial, grid: Grid, progress: Progress | None) -> Run | None:
    """Return a run other than the requested one; None where it is refused, for memory or a start that fails."""
    try:
        return take(trial, grid, progress)
    # A refusal, such as for memory, is a user's error elsewhere; here it means that no comparison is possible.
    except UserError:
        return None


def _side_by_side(
    take: Take,
    asked: tuple[scenarios.Trial, Grid],
    coarser: tuple[scenarios.Trial, Grid],
    progress: Progress | None,
) -> tuple[Run, Run | None, Take]:
    """Return the run that was asked for, a coarser one that is made in a second thread in the meantime, and a `take`
    that has the first run of the start (`_start`), which is made there, too.

    An error or an interrupt of the one ends the other one soon, and is raised after that.
    """
    ended, (trial, whole) = Event(), asked
    short = _only_traced(whole.times[: START_ROWS + 1], START_REFINEMENTS[0])

    def go_on(_: float) -> None:
        if ended.is_set():
            raise CancelledError

    def others() -> list[Run | None]:
        jobs = coarser, (resolved(trial, 1.0 / START_REFINEMENTS[0]), short)
        return [None if each is None else _taken(take, each, grid, go_on) for each, grid in jobs]

    def take_or_have(each: scenarios.Trial, grid: Grid, reported: Progress | None) -> Run:
        is_it = not grid.booked and (grid.parts, grid.times.size) == (short.parts, short.times.size)
        if is_it and start is not None and start.recording.iterations[-1] <= grid.iterations:
            return start
        return take(each, grid, reported)

    with ThreadPoolExecutor(1) as second:
        started = cache(lambda: second.submit(others))

        def reported(fraction: float) -> None:
            started()  # not before: the first thread compiles, as no signal breaks in on that
            if progress is not None:
                progress(fraction)

        try:
            run = take(*asked, reported)
            coarse, start = started().result()
            return run, coarse, take_or_have
        finally:
            ended.set()


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
    trial: scenarios.Trial, take: Take, budget: Budget, run: Run, change: Change, halvings: int
) -> Accuracy:
    """Return the accuracy of a run; `change` is that of the last halving.

    A run that will be repeated anyhow needs no look at its start.
    """
    fine_enough = change.size <= trial.rtol or not budget.allows(run, 2.0) or halvings == MOST_HALVINGS
    # The start is checked only if no finer run follows, whose start would be checked again.
    start = _start(trial, take, budget, run, halvings) if fine_enough else Change(size=0.0, time=0.0)
    return Accuracy(
        force_error=max(change.size, start.size),
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


def _start(trial: scenarios.Trial, take: Take, budget: Budget, run: Run, halvings: int) -> Change:
    """Return the change by finer steps and segments in the first samples; 0 where no finer run gets so far."""
    times = run.all_times[: START_ROWS + 1]
    for finer in START_REFINEMENTS if times.size > 1 else ():
        grid = _only_traced(times, finer * 2**halvings)
        fine = budget.spend(take, run, finer, resolved(trial, 0.5**halvings / finer), grid, None)
        if fine is not None and fine.completed:
            return _change(run, fine, 1, _largest(run))
    return Change(size=0.0, time=0.0)


def _change(run: Run, fine: Run, first: int, largest: float) -> Change:
    """Return the change from a run to a finer one, at their common times from number `first` of the finer one on.

    The force of time 0 is a guess. Forces are compared with the `largest` of the run. [N]
    """
    rows = np.searchsorted(fine.all_times, run.all_times - 1e-9)
    # Rows before `first` belong to the start, or to time 0, where the force is a guess.
    here = (rows < fine.all_times.size) & (rows >= first)
    if not here.any():
        return Change(size=0.0, time=0.0)
    gap = fine.recording.trace[rows[here], :3] - run.recording.trace[here, :3]
    size = np.linalg.norm(gap, axis=1)
    snaps, pulls = _in_snap(run, fine, rows, here)
    size = np.where(snaps, pulls, size)
    worst = int(np.argmax(size))
    return Change(size=float(size[worst]) / largest, time=float(run.all_times[here][worst]))


def _in_snap(run: Run, fine: Run, rows: np.ndarray, here: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which of the common samples are in a snap, and by how much the pulls between samples differ there. [N].

    One is, if next to it the pull gets larger than at that sample, by `SNAP_OVERSHOOT`. The largest pull in an interval
    of the one run is held against that of the other in it and in its two neighbours, and the other way round: a snap
    may be a little sooner or later, but has to be as strong.

    Args:
        run: a run.
        fine: a finer one.
        rows: rows of the finer run at the samples of the other.
        here: which of these are common.
    """
    pulls = _between(run), _between(fine)
    nowhere = np.zeros(int(here.sum()), np.bool_), np.zeros(int(here.sum()))
    if not (pulls[0].any() or pulls[1].any()):
        return nowhere
    cuts = np.minimum(np.concatenate([[0], rows[:-1] + 1]), fine.all_times.size - 1)
    coarse, other = pulls[0], np.maximum.reduceat(pulls[1], cuts)
    sampled = np.linalg.norm(run.recording.trace[:, :3], axis=1)
    over = np.maximum(coarse, other) > sampled + SNAP_OVERSHOOT * max(coarse.max(), other.max())
    gap = np.maximum(coarse - _around(other, np.max), other - _around(coarse, np.max))
    snaps, gaps = _around(over, np.max), np.maximum(_around(gap, np.max), 0.0)
    return snaps[here], gaps[here]


def _between(run: Run) -> np.ndarray:
    """Return the largest pull since the time before, of all times of a run; zeros where it is not known. [N]."""
    trace = run.recording.trace
    pulls: np.ndarray = trace[:, TUG] if trace.shape[1] > TUG else np.zeros(trace.shape[0])
    return pulls


def _around(values: np.ndarray, reduce: Callable[..., np.ndarray]) -> np.ndarray:
    """Return the largest, or what `reduce` says, of every value and its two neighbours."""
    wide = np.pad(values, 1, mode="edge")
    return reduce([wide[:-2], wide[1:-1], wide[2:]], axis=0)


def _largest(run: Run) -> float:
    """Return the largest force of a run, between its samples too, but at least `SMALLEST_FORCE`. [N]."""
    sampled = np.linalg.norm(run.recording.trace[:, :3], axis=1)
    return max(float(sampled.max()), float(_between(run).max()), SMALLEST_FORCE)


def _mean_nodes(run: Run) -> float:
    """Return how many nodes a run has, on average. [-]"""
    return float(run.recording.trace[:, 3].mean())


def _iterated(run: Run) -> float:
    """Return nodes times iterations of Newton's method of a run: its work, half a microsecond each. [-]"""
    return float(run.recording.iterations[-1]) * _mean_nodes(run)


def part_of(progress: Progress | None, start: float, end: float) -> Progress | None:
    """Return a progress that fills a part of another."""
    return None if progress is None else lambda fraction: progress(start + (end - start) * fraction)
