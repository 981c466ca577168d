"""The explanations of a search in the words of a trial, and their fits as least-squares problems of a trial's effects.

    Outcome of any model → pool of explanations → records without the named errors in their data → Problem, Fit

In that problem detectability, gain, the next trial and curves are computed; a fit begins where the search has ended.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from subzero.diagnosis.assessment import Fitted
from subzero.diagnosis.hypothesis.data_error import DataError, corrected
from subzero.diagnosis.hypothesis.effect import Effect
from subzero.diagnosis.hypothesis.hypotheses import Ids, variances
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import Observed, Problem, pose, refit, with_change_point
from subzero.diagnosis.verdict.terms import ENTRIES, cause_of, data_error, ids_of
from subzero.identification.api import Outcome
from subzero.identification.explanation import CLOCK, WIDER, Term
from subzero.identification.fit import Fit as PoolFit
from subzero.identification.problem import Problem as PoolProblem


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation:
    """An explanation of the pool.

    Attributes:
        ids: of all its terms; () where nothing is wrong.
        probability: of it, whatever the tolerances.
        fit: the best one.
        causes: ids of its causes of the catalogue.
        errors: (record, error) of its data; −1 for all records.
        is_wide: whether tolerances are too narrow.
    """

    ids: Ids
    probability: float
    fit: PoolFit
    causes: Ids
    errors: tuple[tuple[int, DataError], ...]
    is_wide: bool

    @property
    def error_ids(self) -> set[tuple[int, str]]:
        """Records and ids of the errors in its data, whatever their sizes."""
        return {(record, error.id) for record, error in self.errors}

    @property
    def is_of_catalogue(self) -> bool:
        """Whether it has no other terms than causes of the catalogue and errors in the data."""
        return len(self.ids) == len(self.causes) + len({error.id for _, error in self.errors})


def pool_of(outcome: Outcome) -> list[Explanation]:
    """Return the explanations of a search, the most probable first; those with the same terms are one."""
    problem, found = outcome.search.problem, dict[Ids, Explanation]()
    for fit, p in zip(outcome.search.ranked(), outcome.probabilities.tolist(), strict=True):
        ids = ids_of(problem, fit)
        if ids in found:
            found[ids] = replace(found[ids], probability=found[ids].probability + p)
        else:
            found[ids] = _explanation(problem, fit, ids, p)
    return sorted(found.values(), key=lambda each: -each.probability)


def best_of(pool: Sequence[Explanation], outcome: Outcome) -> Explanation:
    """Return the explanation that is the best fit of the search, which its verdict is about."""
    fit = outcome.search.ranked()[0]
    ids = ids_of(outcome.search.problem, fit)
    return next(each for each in pool if each.ids == ids)


def _explanation(problem: PoolProblem, fit: PoolFit, ids: Ids, p: float) -> Explanation:
    errors = [(term.record, data_error(problem, fit, term)) for term in fit.terms]
    return Explanation(
        ids=ids,
        probability=p,
        fit=fit,
        causes=tuple(sorted(filter(None, (cause_of(fit, term) for term in fit.terms)))),
        errors=tuple((record, error) for record, error in errors if error),
        is_wide=any(term.kind == "tolerances" for term in fit.terms),
    )


def without_errors(records: Sequence[Logged], errors: Sequence[tuple[int, DataError]]) -> list[Logged]:
    """Return records without errors in their data."""
    return [
        corrected(each, tuple(error for record, error in errors if record in (-1, k)))
        for k, each in enumerate(records)
    ]


def posed(
    records: Sequence[Logged], effects: Sequence[Effect], problem: PoolProblem, best: PoolFit
) -> Problem:
    """Return the least-squares problem of records with the noise of the best explanation of a search."""
    made = pose(records, effects)
    return replace(made, records=tuple(_with_noise(each, problem, best) for each in made.records))


def _with_noise(record: Observed, problem: PoolProblem, best: PoolFit) -> Observed:
    noise = dict(record.noise)
    for name, old in record.noise.items():
        if name in problem.channels:
            own, prior = best.linear.levels.noise[name], problem.prior(name, best.terms)
            noise[name] = replace(
                old, white=own.white, slow=own.slow, correlation_time=own.time, resolution=prior.resolution
            )
    return replace(record, noise=noise)


def fitted(problem: Problem, effects: Mapping[str, Effect], explanation: Explanation) -> Fitted:
    """Return the fit of an explanation in a least-squares problem, causes that begin in mid-trial appended to it.

    Args:
        problem: of the records without the explanation's errors in their data.
        effects: by id, those that may begin in mid-trial.
        explanation: whose fit is the start.
    """
    z = deviations(problem, explanation.fit)
    causes = tuple(name for name in explanation.causes if "@" not in name)
    D = variances(problem.entries, causes, WIDER if explanation.is_wide else 1.0)
    for term in explanation.fit.terms:
        if term.kind == "cause" and "@" in cause_of(explanation.fit, term):
            effect, known = effects[term.target], _numbers(explanation.fit, term)
            problem = with_change_point(problem, effect, known["since"], max(term.record, 0))
            own = [known.get(p.name, 0.0) for p in effect.parameters]
            z, D = (
                np.append(z, [*own, 0.0]),
                np.append(D, [e.parameter.scale**2 for e in problem.entries[D.size :]]),
            )
    return Fitted(problem, refit(problem, z, D))


def deviations(problem: Problem, fit: PoolFit) -> np.ndarray:
    """Return the deviations (k,) of a fit of the pool in a least-squares problem."""
    known: dict[tuple[str, int], float] = {}
    for entry, value in zip(fit.entries, fit.x.tolist(), strict=True):
        if entry.kind in ("number", "start"):
            known[entry.name, entry.record] = value
        elif entry.kind in ENTRIES and (entry.kind != "delay" or entry.name == CLOCK):
            effect, parameter = ENTRIES[entry.kind]
            where = "" if entry.name == CLOCK else f":{entry.name}"
            known[f"{effect}{where}:{parameter}", -1] = value
    return np.array(
        [known.get((f"{e.effect.id}:{e.parameter.name}", e.record), 0.0) for e in problem.entries]
    )


def _numbers(fit: PoolFit, term: Term) -> dict[str, float]:
    """Return the numbers of a cause that begins in mid-trial by the names of its parameters, and "since"."""
    found: dict[str, float] = {}
    for entry, value in zip(fit.entries, fit.x.tolist(), strict=True):
        if entry.kind == "since" and entry.name == term.target:
            found["since"] = value
        elif entry.kind in ("cause", "change") and entry.name.partition(".")[0] == term.target:
            found[entry.name.partition(".")[2].rpartition(":")[2]] = value
    return found
