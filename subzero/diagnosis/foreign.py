"""What no cause explains: forces, drifts and sudden changes, set beside the causes on one scale of probability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.closer import Close, closer, linear
from subzero.diagnosis.evidence import KAPPAS, log_sum
from subzero.diagnosis.hypotheses import PRIOR, Ids, able
from subzero.diagnosis.late_places import largest, places_of
from subzero.diagnosis.latent import Terms
from subzero.diagnosis.one_term import one_terms
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.refit import is_lost
from subzero.diagnosis.search import Search
from subzero.diagnosis.struck import Struck, in_its_place, struck
from subzero.diagnosis.sudden import Place
from subzero.diagnosis.suspects import Suspect, suspects
from subzero.diagnosis.unknown import FINE, FORCE, Knots, all_columns, force_columns, knots_of
from subzero.external_force import AXES

ALIKE = 10.0
"""Forces whose log posteriors differ by less are told apart with finer knots."""
NEAR, FAR, MOST = 6.0, 45.0, 3
"""No force that is further behind the best than FAR, in log posterior, is looked at around its own fit, and at most so
many; where one cause explains the record within declared tolerances, what is linear is nearly true there: besides the
most probable force only those that are as close as NEAR."""
SURE = 30.0
"""No sum of causes gains more than this, in log posterior, over one cause that leaves nothing but noise."""
WORTH = 2.0
"""A force that is no further behind the best, in log posterior, is worth a closer look."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Foreign:
    """An explanation from outside the list of hypotheses.

    Attributes:
        beside: the causes that hold as well.
        what: a force or a drift, or a cause that begins in mid-trial.
        log_posterior: on the scale of `Candidate.log_posterior`.
        place: where it was fitted, if that explains the records.
    """

    beside: Ids
    what: Suspect | Struck
    log_posterior: float
    place: Place | None = None

    @property
    def id(self) -> str:
        """Such as "unknown_force:X" or "rudder_offset@12"."""
        return self.what.id


def foreigners(search: Search) -> list[Foreign]:
    """Return what lies outside, most probable first: beside nothing, and beside the best causes."""
    problem, knots, best = search.problem, knots_of(search.problem), search.best()
    columns, terms = all_columns(problem, best.fit.z, knots), one_terms(problem, best.fit.z, knots)
    found = _suspected(search, columns, knots, terms)
    close = _around_themselves(search, found, columns, knots, terms)
    own = [Foreign(beside=(), what=one.what, log_posterior=one.log_posterior + _log_prior(problem),
                   place=None if one.is_lost else one.place) for one in close]  # fmt: skip
    sudden = _sudden(search, close, max(_most(found + own), best.log_posterior))
    if _most(found + own) > max(_most(sudden), best.log_posterior) - WORTH:
        found = _finer(search, found, own)
    ranked = _sorted(found, own + sudden)
    _nothing_again(search, ranked[0])
    return ranked


def _nothing_again(search: Search, first: Foreign) -> None:
    """Fit "nothing is wrong" from where what explains the records is, beside nothing, if that seems more probable than
    every hypothesis: it may only have begun in a better place.
    """
    if first.place and first.log_posterior > search.best().log_posterior:
        search.fit((), first.place.fit)


def _finer(search: Search, found: list[Foreign], own: list[Foreign]) -> list[Foreign]:
    """Return forces and drifts, and again with finer knots forces that are about as probable as each other."""
    problem, best = search.problem, search.best()
    alike = {one.id.removeprefix(FORCE) for one in _close(found + own) if one.id.startswith(FORCE)}
    if len(alike) < 2:
        return found
    finer = knots_of(problem, FINE)
    columns = {FORCE + axis: C for axis, C in force_columns(problem, best.fit.z, alike, finer).items()}
    terms = one_terms(problem, best.fit.z, finer)
    return [one for one in found if one.id not in columns] + _suspected(search, columns, finer, terms)


def is_explained(search: Search, foreign: Sequence[Foreign]) -> bool:
    """Say whether a sudden cause leaves nothing but noise, and is so far before the best hypothesis that no sum of
    causes that hold throughout can come close.
    """
    best = max(foreign, key=lambda one: one.log_posterior, default=None)
    if best is None or not isinstance(best.what, Struck) or is_lost(best.what.fit):
        return False
    return best.log_posterior > search.best().log_posterior + SURE


def _sorted(found: list[Foreign], own: list[Foreign]) -> list[Foreign]:
    """Return it all, the most probable first; of what was asked in two places, the more probable."""
    kept: dict[tuple[str, Ids], Foreign] = {}
    for one in sorted(found + own, key=lambda one: -one.log_posterior):
        kept.setdefault((one.id, one.beside), one)
    return list(kept.values())


def _suspected(
    search: Search, columns: dict[str, np.ndarray], knots: Knots, terms: Mapping[str, Terms]
) -> list[Foreign]:
    """Return the forces and drifts of columns, beside nothing and beside the best causes."""
    problem, prior = search.problem, _log_prior(search.problem)
    found: list[Foreign] = []
    for candidate in _bases(search):
        scales = candidate.scales(problem)
        found += [Foreign(beside=candidate.ids, what=one, log_posterior=candidate.log_posterior + one.log_gain + prior)
                  for one in suspects(problem, columns, candidate.fit, scales, knots, terms)]  # fmt: skip
    return found


def _around_themselves(
    search: Search,
    found: list[Foreign],
    columns: dict[str, np.ndarray],
    knots: Knots,
    terms: Mapping[str, Terms],
) -> list[Close]:
    """Return the most probable forces and drifts beside nothing as they are around fits of their own, if they have any
    hope; none where nothing has to bend.
    """
    problem, best, prior = search.problem, search.best(), _log_prior(search.problem)
    if not best.ids and best.kappa == min(KAPPAS):
        return []
    hope = {one.id: one.log_posterior for one in found if not one.beside}
    for log, what in linear(problem, best.fit, columns, knots, terms, list(KAPPAS)):
        hope[what.id] = max(hope[what.id], log + prior)
    finer = knots_of(problem, FINE)
    terms = one_terms(problem, best.fit.z, finer)
    look = partial(closer, problem, best.fit, kappa=1.0, knots=finer, terms=terms)
    return sorted(search.side.map(look, _worth_a_look(hope, best)), key=lambda one: -one.log_posterior)


def _worth_a_look(hope: dict[str, float], best: Candidate) -> list[str]:
    """Return the forces and drifts that are looked at around their own fits, of hoped-for log posteriors."""
    ranked = sorted(hope, key=lambda name: -hope[name])[:MOST]
    least = max(best.log_posterior - FAR, hope[ranked[0]] - ALIKE)
    plain = best.kappa == min(KAPPAS) and len(best.ids) == 1
    further = max(least, best.log_posterior - NEAR) if plain else least
    return [name for i, name in enumerate(ranked) if hope[name] > (further if i else least)]


def _log_prior(problem: Problem) -> float:
    """Return how probable a force on some axis, or the drift of some sensor, is beforehand, beside a hypothesis."""
    return float(np.log(PRIOR["unknown"] / (len(AXES) + len(problem.records[0].noise))))


def _most(found: Sequence[Foreign]) -> float:
    """Return the log posterior of the most probable."""
    return max((one.log_posterior for one in found), default=-np.inf)


def _close(found: list[Foreign]) -> list[Foreign]:
    """Return what is about as probable as the best."""
    best = _most(found)
    return [one for one in found if one.log_posterior > best - ALIKE]


def _bases(search: Search) -> list[Candidate]:
    """Return the candidates that something may be added to."""
    best = search.best()
    return [search.candidates[()]] + ([best] if best.ids else [])


def _sudden(search: Search, close: Sequence[Close], known: float) -> list[Foreign]:
    """Return causes that begin in mid-trial, beside nothing else, that may be as probable as what is known."""
    problem, effects = search.problem, able(search.problem)
    if not effects:
        return []
    prior = float(np.log(PRIOR["sudden"] / (len(effects) * len(problem.records))))
    places, large = places_of(search, close, _log_prior(problem)), largest(search)
    made = [one for record in range(len(problem.records))
            for one in struck(problem, places, effects, record, known - prior, search.side, large)]  # fmt: skip
    return [Foreign(beside=(), what=one, log_posterior=one.log_posterior + prior,
                    place=None if is_lost(one.fit) else in_its_place(problem, one)) for one in made]  # fmt: skip


def shares(search: Search, foreign: list[Foreign]) -> tuple[dict[Ids, float], dict[str, float]]:
    """Return the probabilities of hypotheses, and of everything outside by id; together they sum to 1."""
    inside = search.beliefs.probabilities(search.problem)
    scale = search.beliefs.log_total()
    outside = log_sum([one.log_posterior for one in foreign]) if foreign else -np.inf
    total = log_sum([scale, outside])
    found: dict[str, float] = {}
    for one in foreign:
        found[one.id] = found.get(one.id, 0.0) + float(np.exp(one.log_posterior - total))
    kept = float(np.exp(scale - total))
    return {ids: kept * p for ids, p in inside.items()}, found


def tolerance_scale(search: Search) -> dict[float, float]:
    """Return κ → probability, over all candidates."""
    top = search.best().log_posterior
    weight = dict.fromkeys(KAPPAS, 0.0)
    for candidate in search.candidates.values():
        parts = {kappa: np.log(prior) + candidate.log_evidence[kappa] for kappa, prior in KAPPAS.items()}
        mixed = log_sum(list(parts.values()))
        for kappa, value in parts.items():
            weight[kappa] += float(np.exp(candidate.log_posterior - top + value - mixed))
    total = sum(weight.values())
    return {kappa: value / total for kappa, value in weight.items()}
