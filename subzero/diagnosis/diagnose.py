"""From records to a verdict: the engine from end to end.

pose → what could be seen → misfit → search → what is outside → rules → extended model → gain → next trial

Where even wide tolerances do not come close, or the first fits all fail, what is outside is asked before: a force takes
the run along the records, and a cause that begins in mid-trial and explains them ends the search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from time import perf_counter

from threadpoolctl import threadpool_limits

from subzero.diagnosis.detect import detectability, with_secants
from subzero.diagnosis.effect import Effect
from subzero.diagnosis.foreign import foreigners, is_explained
from subzero.diagnosis.logged import Logged
from subzero.diagnosis.misfit import misfits
from subzero.diagnosis.pose import pose
from subzero.diagnosis.problem import Progress
from subzero.diagnosis.response import respond
from subzero.diagnosis.search import Search
from subzero.diagnosis.telling import tell
from subzero.diagnosis.verdict import Detectability, Verdict
from subzero.diagnosis.work import Work

BUDGETS = ("screen", "verdict", "full")
"""Linear evidence only; up to the verdict and the extended model; with gain and next trial."""

Seen = Callable[[tuple[Detectability, ...]], None]


def diagnose(
    records: Sequence[Logged],
    *,
    effects: Iterable[Effect] = (),
    progress: Progress | None = None,
    seen: Seen | None = None,
    seed: int = 0,
    budget: str = "full",
) -> Verdict:
    """Say what the nominal models of some records get wrong, and why.

    Args:
        records: of one vehicle, each with its trial.
        effects: causes besides the catalogue.
        progress: told the fraction that is done, and what is being tried.
        seen: told what the records can show, before they are looked at.
        seed: of everything random.
        budget: one of BUDGETS.

    Raises:
        UserError: the nominal model cannot be run through a trial.
    """
    problem = pose(records, effects)
    search = Search(problem=problem, progress=progress or (lambda share, words: None))
    work = Work(search=search, seed=seed, budget=budget)
    try:
        with threadpool_limits(limits=1, user_api="blas"):  # runs have the cores; matrices are small
            _work(work, seen or (lambda table: None))
    except KeyboardInterrupt:
        work.complete = False
        if () not in search.candidates:
            raise
    return tell(work)


def _work(work: Work, seen: Seen) -> None:
    """Do all parts in turn, and keep their times."""
    search, start = work.search, perf_counter()

    def done(part: str) -> None:
        work.seconds[part] = perf_counter() - start - sum(work.seconds.values())

    search.begin()
    _measure_misfit(work)
    work.detectable = detectability(work.problem, with_secants(work.problem, search.nominal[1]))
    seen(work.detectable)
    if search.is_far and work.budget != "screen":
        _from_afar(work)
    search.look()
    done("screen")
    if work.budget == "screen":
        search.fit(())
        return
    search.first_fits()
    if search.is_lost() and not work.foreign:
        search.progress(0.6, "forces, and causes that begin in mid-trial")
        work.foreign = foreigners(search)
    if not is_explained(search, work.foreign):
        search.races()
        search.grow()
        search.settle()
        done("fits")
        search.progress(0.8, "forces that no cause explains")
        work.foreign = foreigners(search)
    _measure_misfit(work)
    done("outside")


def _measure_misfit(work: Work) -> None:
    """Set the nominal simulation beside the records, with the noise as it is known by now."""
    for one in work.problem.records:
        work.misfit[one.name] = misfits(one, respond(one.setting, one.time, one.noise))


def _from_afar(work: Work) -> None:
    """Let a force, or a cause that begins in mid-trial, take the run along the records, and look from there."""
    work.search.progress(0.2, "forces, and causes that begin in mid-trial")
    work.search.only_nothing()
    work.foreign = foreigners(work.search)
    if work.foreign[0].place:
        work.search.go_near(work.foreign[0].place.fit)
