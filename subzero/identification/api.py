"""`diagnose`: from records and a model to a verdict.

problem → search → nearness → locks → verdict
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from time import process_time
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

from subzero.arguments import checked_arguments
from subzero.errors import UserError
from subzero.identification.candidates import declared
from subzero.identification.explanation import AFFINE, Term, kinds_of, with_term, without
from subzero.identification.fit import Fit, Linear, free_fit, spreads
from subzero.identification.locks import locks
from subzero.identification.model import Model
from subzero.identification.named_terms import NAMED_PROBABILITY, histories, named_term, said_of
from subzero.identification.nearness import Nearness, levels_left, nearness
from subzero.identification.problem import Problem, Progress
from subzero.identification.record import Record
from subzero.identification.search import Search
from subzero.identification.verdict import (
    CALIBRATED,
    CAUSE_NAMED,
    DATA_ERROR,
    NOTHING_NEAR,
    NOTHING_WRONG,
    UNDECIDED,
    UNKNOWN_NAMED,
    UNSEEN,
    Curves,
    Named,
    Share,
    Verdict,
    curves_of,
)

HEALTHY_PROBABILITY = 0.5
"""That nothing is wrong is said from this probability on."""
SEEN_ODDS = 9.0
"""Odds from which on a term would be seen: of NAMED_PROBABILITY."""
PASSES = 3
"""Most searches of a diagnosis, each without the outliers that the one before has shown."""
RELATED = 3.0
"""Channels differ if all explanations say so, by so many standard deviations."""


@checked_arguments
def diagnose(
    records: Record | Sequence[Record],
    model: Model,
    *,
    held_out: Record | Sequence[Record] = (),
    seconds: float | None = None,
    progress: Progress | None = None,
) -> Verdict:
    """Say what a model gets wrong in records, and whether it is near them at all.

        >>> verdict = diagnose(read("est.csv", time="4 s", level="yEst", pump="uEst"), tanks)   # doctest: +SKIP
        >>> print(verdict)                                                                     # doctest: +SKIP

    Args:
        records: one or several, which share all numbers of the model but the states at their beginnings.
        model: the function and its declarations.
        held_out: records that no fit sees, for the gain of a term. Without them each of several records is
            predicted by a fit of the others, or the last part of a single one by a fit of the first.
        seconds: of processor time, after which the search is ended; the verdict is of what was found by then, and
            says so; no limit if not given. [s]
        progress: called with the share that is done, and the present step.

    Raises:
        UserError: a record cannot be used, or there is no time.
        ModelError: the model cannot be used.
    """
    return outcome(records, model, held_out=held_out, seconds=seconds, progress=progress).verdict


class Outcome(NamedTuple):
    """A verdict, the search that it stands on, and the probability of every explanation (n,), in the order of
    `Search.ranked`.
    """

    verdict: Verdict
    search: Search
    probabilities: np.ndarray


def outcome(
    records: Record | Sequence[Record],
    model: Model,
    *,
    held_out: Record | Sequence[Record] = (),
    seconds: float | None = None,
    progress: Progress | None = None,
    screen: bool = False,
) -> Outcome:
    """Return a verdict with all explanations; arguments and errors as of `diagnose`. To `screen` is to rank single
    terms in the linear problem, without a fit of any.
    """
    if seconds is not None and not seconds > 0.0:
        raise UserError(f"diagnose: seconds is {seconds!r}; it must be greater than 0.")
    end = math.inf if seconds is None else process_time() + seconds
    report = progress or (lambda share, words: None)
    given = [records] if isinstance(records, Record) else list(records)
    kept = [held_out] if isinstance(held_out, Record) else list(held_out)
    with threadpool_limits(limits=1, user_api="blas"):  # matrices are small
        search, outliers = _searched(model, given, report, end, screen=screen)
        report(0.9, "locks")
        return Outcome(_concluded(search, kept, outliers), search, _probabilities(search, search.ranked()))


def _searched(
    model: Model, records: Sequence[Record], report: Progress, end: float, *, screen: bool = False
) -> tuple[Search, dict[str, int]]:
    """Return the search, until some processor time [s]; and channel → how many outliers it is without.

    It begins anew without the outliers that its best explanation so far shows.
    """
    count: dict[str, int] = {}
    begin: Fit | None = None
    problem: Problem | None = None
    for left in reversed(range(PASSES)):
        problem = Problem(model, records, before=problem)
        search = Search(problem, report, end - process_time(), begin)
        search.start()
        if not (left and search.outliers()):
            search.screen() if screen else search.run(with_outliers=not left)
        if not left or not (outliers := search.outliers()):
            break
        begin, records = search.ranked()[0], search.problem.without(outliers)
        count |= {name: count.get(name, 0) + int(found.sum()) for name, found in outliers.items()}
    return search, count


def _concluded(search: Search, held_out: Sequence[Record], outliers: Mapping[str, int]) -> Verdict:
    problem, ranked = search.problem, search.ranked()
    best, probabilities = ranked[0], _probabilities(search, ranked)
    free = free_fit(problem, best.terms, best.values, best.linear.levels.sizes)
    near = nearness(problem, best, free)
    own = locks(problem, best, held_out, settled=search.settled) if near.near else {}
    terms = [
        named_term(problem, best, said, own.get(said.term.id), near)
        for said in said_of(ranked, probabilities)
        if said.term.kind != "tolerances"
    ]
    named = tuple(
        each for each in terms if near.near and not each.against and each.probability >= NAMED_PROBABILITY
    )
    suspected = tuple(each for each in terms if each not in named)
    return Verdict(
        verdict=_kind(best, near, named, suspected, probabilities),
        nearness=near,
        named=named,
        suspected=suspected,
        explanations=_shown(ranked, probabilities),
        relations=tuple(_relations(problem, ranked, probabilities / probabilities.sum())),
        budget=_budget(search, best, free),
        remainder=_remainder(problem, best, near),
        visible_from=_visible_from(search),
        notes=_notes(problem, search, outliers),
        curves=tuple(_curves(problem, search, free)),
        complete=search.complete,
    )


def _probabilities(search: Search, ranked: Sequence[Fit]) -> np.ndarray:
    """Return the probability of every explanation; the rest to 1 is that of one term more, unseen."""
    log = np.array([search.score(each) for each in ranked])
    return np.exp(log - logsumexp([*log, search.log_unseen()]))


def _kind(
    best: Fit, near: Nearness, named: Sequence[Named], suspected: Sequence[Named], probabilities: np.ndarray
) -> str:
    if not near.near:
        return NOTHING_NEAR
    if any(not each.is_data_error and not each.history for each in named):
        return CAUSE_NAMED
    if any(each.history for each in named):
        return UNKNOWN_NAMED
    if named:
        return DATA_ERROR
    if not best.terms and probabilities[0] >= HEALTHY_PROBABILITY:
        return NOTHING_WRONG
    return CALIBRATED if best.terms and not suspected and probabilities[0] >= NAMED_PROBABILITY else UNDECIDED


def _shown(ranked: Sequence[Fit], probabilities: np.ndarray) -> dict[str, float]:
    found: dict[str, float] = {}
    for each, p in zip(ranked, probabilities.tolist(), strict=True):
        name = " + ".join(_name(term) for term in each.terms) or "nothing is wrong"
        found[name] = found.get(name, 0.0) + p
    found[UNSEEN] = max(1.0 - float(probabilities.sum()), 0.0)
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))


def _name(term: Term) -> str:
    return f"{term.id} ({term.sentence.partition(': ')[2]})" if term.kind == "unit" else term.id


def _relations(problem: Problem, ranked: Sequence[Fit], probabilities: np.ndarray) -> list[str]:
    """Return what explanations have in common about two channels of one unit, though not which of them is wrong."""
    units = {name: problem.model.channels[name].unit for name in problem.channels}
    names = list(problem.channels)
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :] if units[a] == units[b]]
    found = []
    for a, b in pairs:
        ratio = _contrast(ranked, probabilities, a, b, "gain")
        clock = _contrast(ranked, probabilities, a, b, "delay")
        said = []
        if ratio is not None:
            said.append(
                f"by a factor {math.exp(ratio[0]):.3f} ± {math.exp(ratio[0]) * ratio[1]:.2g} ({b} over {a})"
            )
        if clock is not None:
            said.append(
                f"their clocks by {abs(clock[0]):.2f} ± {clock[1]:.2g} s ({b if clock[0] > 0 else a} is later)"
            )
        if said and not _decided(ranked, probabilities, (a, b)):
            found.append(
                f"{a} and {b} differ {', and '.join(said)}. These records do not decide which of them is wrong."
            )
    return found


def _decided(ranked: Sequence[Fit], probabilities: np.ndarray, channels: tuple[str, str]) -> bool:
    """Return whether one set of errors of two channels is probable enough to be named."""
    sets: dict[tuple[str, ...], float] = {}
    for each, p in zip(ranked, probabilities.tolist(), strict=True):
        name = tuple(sorted(term.id for term in each.terms if term.target in channels))
        sets[name] = sets.get(name, 0.0) + p
    return max(sets.values()) >= NAMED_PROBABILITY


def _contrast(
    ranked: Sequence[Fit], probabilities: np.ndarray, a: str, b: str, kind: str
) -> tuple[float, float] | None:
    """Return log scale or delay of channel b less that of a, over all explanations, and its standard deviation; None
    where it may be 0.
    """
    means, variances = [], []
    for each in ranked:
        mean = variance = 0.0
        for channel, sign in ((b, 1.0), (a, -1.0)):
            factor = [term.factor for term in each.terms if term.target == channel and term.slot[0] == AFFINE]
            mean += sign * sum(math.log(abs(f)) for f in factor) if kind == "gain" else 0.0
            for entry, value, own in zip(each.entries, each.x.tolist(), each.variance.tolist(), strict=True):
                if entry.kind == kind and entry.name == channel:
                    mean += sign * (math.log1p(value) if kind == "gain" else value)
                    variance += own / (1.0 + value) ** 2 if kind == "gain" else own
        means.append(mean)
        variances.append(variance)
    mean = float(probabilities @ np.array(means))
    sd = math.sqrt(float(probabilities @ (np.array(variances) + (np.array(means) - mean) ** 2)))
    return (mean, sd) if sd > 0.0 and abs(mean) > RELATED * sd else None


def _budget(search: Search, best: Fit, free: Fit) -> tuple[Share, ...]:
    """Return what each term of the best explanation takes in free simulation, with those before it: first the term
    without which most is left, the other numbers as they are.
    """
    problem, levels = search.problem, search.problem.levels(best.terms)
    bare = {term: search.ranking.there(free.linear, without(best.terms, term)) for term in best.terms}
    lacking = {
        term: levels_left(problem, linear, levels) if linear else math.inf for term, linear in bare.items()
    }
    terms = sorted(best.terms, key=lambda term: -lacking[term])
    sizes = best.linear.levels.sizes
    fits = [free_fit(problem, tuple(terms[:count]), best.values, sizes) for count in range(len(terms))]
    left = [levels_left(problem, fitted.linear, levels) for fitted in (*fits, free)]
    return tuple(
        Share(term.id, before, after) for term, before, after in zip(terms, left[:-1], left[1:], strict=True)
    )


def _remainder(problem: Problem, best: Fit, near: Nearness) -> str:
    """Return where the remainder acts, and with which channel or input it grows."""
    if near.near or not near.sizes:
        return ""
    name = max(near.sizes, key=lambda each: near.sizes[each][0] / near.sizes[each][1])
    rows = []
    for history, record in zip(histories(problem, best, name), problem.records, strict=True):
        rows.append((record, np.abs(np.interp(record.time, history.time, history.value))))
    size = np.concatenate([row for _, row in rows])
    grows = [
        (float(np.corrcoef(size, column)[0, 1]), other)
        for other in (*problem.model.inputs, *problem.channels)
        for column in [np.concatenate([_on_grid(record, other) for record, _ in rows])]
        if np.std(column) > 0.0 and np.std(size) > 0.0
    ]
    strongest = max(grows, key=lambda pair: abs(pair[0]), default=(0.0, ""))
    words = (
        f", and {'grows' if strongest[0] > 0 else 'falls'} with {strongest[1]}"
        if abs(strongest[0]) > 0.5
        else ""
    )
    return f"The remainder acts on {name}{words}."


def _on_grid(record: Record, name: str) -> np.ndarray:
    values, time = record.columns[name], record.times_of(name)
    known = np.isfinite(values)
    return np.interp(record.time, time[known], values[known])


def _visible_from(search: Search) -> dict[str, str]:
    """Return error or cause → the size from which on it would be seen, if nothing else is wrong.

    With the prior N(0, τ²) of a number, N(0, τ² + s²) with the term, and σ of what the readings say of it, the log odds
    of the term grow as ½ x² (1/(σ² + τ²) − 1/(σ² + τ² + s²)).
    """
    base = search.fits[()].linear
    found: dict[str, str] = {}
    for term in declared(search.problem):
        if (
            term.kind not in ("scale", "offset", "delay", "rate", "cause")
            or math.isfinite(term.begins)
            or term.size
        ):
            continue
        if (linear := search.ranking.there(base, with_term(base.terms, term), term)) is not None:
            for name, size, unit in _sizes(search.problem, linear, term):
                found.setdefault(name, f"{size:.2g}{unit}")
    return found


def _sizes(problem: Problem, linear: Linear, term: Term) -> list[tuple[str, float, str]]:
    _, _, (factor, _) = linear.evidence(problem)
    sd = spreads(linear.entries, linear.levels)
    half = np.linalg.inv(np.tril(factor))
    variance = sd**2 * np.sum(half**2, axis=0)
    cause = next((cause for cause in problem.model.causes if cause.id == term.target), None)
    found, usual = [], {entry.identity: entry.sd for entry in problem.entries(())}
    for i, entry in enumerate(linear.entries):
        mine = (
            entry.name == term.target and entry.kind in kinds_of(term)
            if term.is_data_error
            else bool(cause) and entry.name in (cause.changes if cause else ())
        )
        before = usual.get(entry.identity, 0.0)
        if not mine or before >= sd[i]:
            continue
        seen = 1.0 / max(1.0 / variance[i] - 1.0 / sd[i] ** 2, 1e-300)
        narrow, wide = seen + before**2, seen + sd[i] ** 2
        log = math.log(SEEN_ODDS / term.odds) + 0.5 * math.log(wide / narrow)
        size = math.sqrt(2.0 * log / (1.0 / narrow - 1.0 / wide))
        unit = {"gain": " %", "rate": " %", "delay": " s"}.get(entry.kind, "")
        found.append((term.id, 100.0 * size if unit == " %" else size, unit))
    return found


def _notes(problem: Problem, search: Search, outliers: Mapping[str, int]) -> tuple[str, ...]:
    aside = {name: int(each.spikes.sum()) + outliers.get(name, 0) for name, each in problem.channels.items()}
    counts = ", ".join(f"{name} {count}" for name, count in aside.items() if count)
    why = "outside the record's time, or alone far from their neighbours or from the best explanation"
    found = [f"Readings that are set aside ({why}): {counts}."] if counts else []
    for name, each in problem.channels.items():
        if problem.model.channels[name].noise is None:
            found.append(f"{name}: the noise of its sensor, {each.prior.level:.2g}, was read off the record.")
    if not search.complete:
        found.append(
            "The search was ended by its time or its number of fits; there may be better explanations."
        )
    return tuple(found)


def _curves(problem: Problem, search: Search, free: Fit) -> list[Curves]:
    nothing = search.fits[()]
    centre = np.array([entry.centre for entry in nothing.entries])
    zero, _ = problem.residuals((), nothing.entries, [centre])
    found = []
    for name, each in problem.channels.items():
        measured = problem.recorded(name, free.terms)
        simulated = each.values - zero[name][:, 0]
        for k, record in enumerate(problem.records):
            at = (each.record == k) & problem.used(name, free.terms)
            if at.any():
                rows = (measured[at], measured[at] - simulated[at], free.linear.e[name][at])
                found.append(curves_of(record, name, problem.model.channels[name].unit, each.time[at], rows))
    return found
