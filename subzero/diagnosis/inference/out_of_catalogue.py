"""Explanations that are not in the list of hypotheses: latent forces, drifts and change points, on one scale of
probability.

Each is added to "nothing is wrong" or to the best causes. Change points are scanned around the best hypothesis, and
along the simulations with the best latent forces. `Findings` holds the results of the engine so far: an interrupted
diagnosis concludes from it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.hypothesis.hypotheses import PRIOR, Ids, variances
from subzero.diagnosis.inference import settings
from subzero.diagnosis.inference.change_point_fit import (
    FittedChangePoint,
    as_fitted,
    fit_change_points,
    linearised_at,
)
from subzero.diagnosis.inference.change_point_scan import BaseRun, LinearisationPoint
from subzero.diagnosis.inference.input_estimation import (
    LatentForceCandidate,
    RelinearisedForce,
    latent_force_candidates,
    linear_candidates,
    relinearised_force,
)
from subzero.diagnosis.inference.latent_force import (
    FINE_SPACING_S,
    FORCE,
    Knots,
    all_columns,
    force_columns,
    knots_of,
    one_terms,
)
from subzero.diagnosis.inference.linear_gaussian import KAPPAS, Linear, Terms, log_sum, posterior
from subzero.diagnosis.inference.map_fit import is_poor_fit, refit
from subzero.diagnosis.inference.model_average import FURTHER_CAUSE_ODDS, occam_folded
from subzero.diagnosis.inference.model_fits import (
    WithRefittedNoise,
    gained_by_noise,
    refit_noise,
    with_refitted_noise,
)
from subzero.diagnosis.inference.posing import whitened_again
from subzero.external_force import AXES

if TYPE_CHECKING:
    from subzero.diagnosis.inference.map_fit import Candidate
    from subzero.diagnosis.inference.model_search import Search
    from subzero.diagnosis.inference.posing import SensitiveRun
    from subzero.diagnosis.inference.problem import Observed, Problem
    from subzero.diagnosis.results import Detectability, Misfit


def linearisation_points(
    search: Search, close: Sequence[RelinearisedForce], prior: float
) -> list[LinearisationPoint]:
    """Return the linearisation points for change points: the best hypothesis, and the best forces and drifts.

    Args:
        search: the fits of hypotheses.
        close: forces and drifts around fits of their own, most probable first.
        prior: log prior of a force, which `close` is without.
    """
    best = search.best()
    here = LinearisationPoint(fit=best.fit, along=BaseRun(search.problem, best.fit.z))
    known = [] if search.is_poor() else [best.log_posterior - prior]
    least = (
        max([*(candidate.log_posterior for candidate in close), *known], default=0.0) - settings.LINEAR_NATS
    )
    alike = [candidate.point for candidate in close[: settings.MAX_ADDED] if candidate.log_posterior > least]
    return [here, *alike]


def largest_hypotheses(search: Search) -> list[Candidate]:
    """Return the hypotheses whose causes may have a change point: the best that have any cause."""
    least = search.best().log_posterior - settings.LINEAR_NATS
    ranked = sorted(search.candidates.values(), key=lambda candidate: -candidate.log_posterior)
    return [candidate for candidate in ranked if candidate.log_posterior > least and candidate.ids][
        : settings.MAX_ADDED
    ]


@dataclass(frozen=True, kw_only=True, eq=False)
class OutOfCatalogue:
    """An explanation that is not in the list of hypotheses.

    Attributes:
        causes: those that are present as well.
        what: a force or a drift, or a cause with a change point.
        log_posterior: on the scale of `Candidate.log_posterior`.
        point: linearisation point at its fit, if that explains the records.
        own: the problem with its own noise, which whitens a force; None for that of the search.
    """

    causes: Ids
    what: LatentForceCandidate | FittedChangePoint
    log_posterior: float
    point: LinearisationPoint | None = None
    own: Problem | None = None

    @property
    def id(self) -> str:
        """Such as "unknown_force:X" or "rudder_offset@12"."""
        return self.what.id


def explanations_outside(search: Search) -> list[OutOfCatalogue]:
    """Return the explanations that are not in the catalogue, most probable first: with no cause, and with the best
    causes.
    """
    problem, knots, best = search.problem, knots_of(search.problem), search.best()
    columns, terms = all_columns(problem, best.fit.z, knots), one_terms(problem, best.fit.z, knots)
    found = _suspected(search, columns, knots, terms)
    close = _around_themselves(search, found, columns, knots, terms)
    own = [
        OutOfCatalogue(
            causes=(),
            what=candidate.what,
            log_posterior=candidate.log_posterior + _log_prior(problem),
            point=None if candidate.is_poor else candidate.point,
        )
        for candidate in close
    ]
    sudden = _sudden(search, close, max(_most(found + own), best.log_posterior))
    if _most(found + own) > max(_most(sudden), best.log_posterior) - settings.CLOSE_NATS:
        found = _finer(search, found, own)
    ranked = _sorted(found, own + sudden)
    _nothing_again(search, ranked[0])
    return ranked


def _nothing_again(search: Search, first: OutOfCatalogue) -> None:
    """Fit "nothing is wrong" from the fit of the first explanation, if that is more probable than every hypothesis:
    its lead may only be due to a better start.
    """
    if first.point and first.log_posterior > search.best().log_posterior:
        search.fit((), first.point.fit)


def _finer(search: Search, found: list[OutOfCatalogue], own: list[OutOfCatalogue]) -> list[OutOfCatalogue]:
    """Return forces and drifts, those forces with finer knots that are about as probable as each other."""
    problem, best = search.problem, search.best()
    alike = {
        candidate.id.removeprefix(FORCE)
        for candidate in _close(found + own)
        if candidate.id.startswith(FORCE)
    }
    if len(alike) < 2:
        return found
    finer = knots_of(problem, FINE_SPACING_S)
    columns = {FORCE + axis: C for axis, C in force_columns(problem, best.fit.z, alike, finer).items()}
    terms = one_terms(problem, best.fit.z, finer)
    return [candidate for candidate in found if candidate.id not in columns] + _suspected(
        search, columns, finer, terms
    )


def is_explained(search: Search, out_of_catalogue: Sequence[OutOfCatalogue]) -> bool:
    """Say whether a change point leaves only noise, and is so much more probable than the best hypothesis that no sum
    of causes that hold throughout can come close.
    """
    best = max(out_of_catalogue, key=lambda candidate: candidate.log_posterior, default=None)
    if best is None or not isinstance(best.what, FittedChangePoint) or is_poor_fit(best.what.fit):
        return False
    return best.log_posterior > search.best().log_posterior + settings.DECISIVE_NATS


def _sorted(found: list[OutOfCatalogue], own: list[OutOfCatalogue]) -> list[OutOfCatalogue]:
    """Return all explanations, the most probable first; of those with two linearisation points the more
    probable one.
    """
    kept: dict[tuple[str, Ids], OutOfCatalogue] = {}
    for each in sorted(found + own, key=lambda candidate: -candidate.log_posterior):
        kept.setdefault((each.id, each.causes), each)
    return list(kept.values())


def _suspected(
    search: Search, columns: dict[str, np.ndarray], knots: Knots, terms: Mapping[str, Terms]
) -> list[OutOfCatalogue]:
    """Return the forces and drifts of columns, with no cause and with the best causes."""
    problem, prior = search.problem, _log_prior(search.problem)
    found: list[OutOfCatalogue] = []
    for candidate in _bases(search):
        scales = candidate.scales(problem)
        found += [
            OutOfCatalogue(
                causes=candidate.ids, what=each, log_posterior=candidate.log_posterior + each.log_gain + prior
            )
            for each in latent_force_candidates(problem, columns, candidate.fit, scales, knots, terms)
        ]
    return found


def _around_themselves(
    search: Search,
    found: list[OutOfCatalogue],
    columns: dict[str, np.ndarray],
    knots: Knots,
    terms: Mapping[str, Terms],
) -> list[RelinearisedForce]:
    """Return the most probable forces and drifts without causes, linearised at fits of their own, if they may become
    the best; none where "nothing is wrong" within declared tolerances is the best hypothesis.
    """
    problem, best, prior = search.problem, search.best(), _log_prior(search.problem)
    if not best.ids and best.kappa == min(KAPPAS):
        return []
    predicted = {candidate.id: candidate.log_posterior for candidate in found if not candidate.causes}
    for log, what in linear_candidates(problem, best.fit, columns, knots, terms, list(KAPPAS)):
        predicted[what.id] = max(predicted[what.id], log + prior)
    finer = knots_of(problem, FINE_SPACING_S)
    terms = one_terms(problem, best.fit.z, finer)
    look = partial(relinearised_force, problem, best.fit, kappa=1.0, knots=finer, terms=terms)
    return sorted(
        search.side.map(look, _promising(predicted, best)), key=lambda candidate: -candidate.log_posterior
    )


def _promising(predicted: dict[str, float], best: Candidate) -> list[str]:
    """Return the forces and drifts to be linearised at their own fits, by their predicted log posteriors."""
    ranked = sorted(predicted, key=lambda name: -predicted[name])[: settings.MAX_TRIED]
    least = max(best.log_posterior - settings.FAR_NATS, predicted[ranked[0]] - settings.LINEAR_NATS)
    plain = best.kappa == min(KAPPAS) and len(best.ids) == 1
    further = max(least, best.log_posterior - settings.HOPELESS_NATS) if plain else least
    return [name for i, name in enumerate(ranked) if predicted[name] > (further if i else least)]


def _log_prior(problem: Problem) -> float:
    """Return the log prior of a force on some axis, or of the drift of some sensor, added to a hypothesis."""
    return float(np.log(PRIOR["unknown"] / (len(AXES) + len(problem.records[0].noise))))


def _most(found: Sequence[OutOfCatalogue]) -> float:
    """Return the log posterior of the most probable explanation."""
    return max((candidate.log_posterior for candidate in found), default=-np.inf)


def _close(found: list[OutOfCatalogue]) -> list[OutOfCatalogue]:
    """Return the explanations that are about as probable as the best."""
    best = _most(found)
    return [candidate for candidate in found if candidate.log_posterior > best - settings.LINEAR_NATS]


def _bases(search: Search) -> list[Candidate]:
    """Return the candidates that a force or a drift may be added to."""
    best = search.best()
    return [search.candidates[()]] + ([best] if best.ids else [])


def _sudden(search: Search, close: Sequence[RelinearisedForce], known: float) -> list[OutOfCatalogue]:
    """Return causes with a change point, without other causes, that may be as probable as the best
    explanation known.
    """
    problem, effects = search.problem, search.problem.sudden_effects
    if not effects:
        return []
    prior = float(np.log(PRIOR["sudden"] / (len(effects) * len(problem.records))))
    points, large = linearisation_points(search, close, _log_prior(problem)), largest_hypotheses(search)
    made = [
        point
        for record in range(len(problem.records))
        for point in fit_change_points(problem, points, effects, record, known - prior, search.side, large)
    ]
    return [
        OutOfCatalogue(
            causes=(),
            what=candidate,
            log_posterior=log + prior,
            point=None if is_poor_fit(candidate.fit) else linearised_at(problem, candidate),
        )
        for candidate, log in special_cases_folded(made)
    ]


def special_cases_folded(made: Sequence[FittedChangePoint]) -> list[tuple[FittedChangePoint, float]]:
    """Return causes with a change point and their log posteriors, where one that is not needed is merged into its
    special case: a fin with an offset since its last command may also be jammed, and the record cannot distinguish
    the two.

    As with a further cause (`occam_folded`): a change point that is not FURTHER_CAUSE_ODDS times as probable as its
    special case is reported as that case, with the probability of both.
    """
    log = {(each.change_point.effect.id, each.change_point.record): each.log_posterior for each in made}
    for candidate in made:
        own = candidate.change_point.effect.id, candidate.change_point.record
        for special in {
            (parameter.also_of, own[1]) for parameter in candidate.change_point.effect.parameters
        } & log.keys():
            if log[own] < log[special] + np.log(FURTHER_CAUSE_ODDS):
                log[special] = log_sum([log[special], log.pop(own)])
                break
    return [
        (each, log[key])
        for each in made
        if (key := (each.change_point.effect.id, each.change_point.record)) in log
    ]


def shares(
    search: Search, out_of_catalogue: list[OutOfCatalogue]
) -> tuple[dict[Ids, float], dict[Ids, float]]:
    """Return the probabilities of hypotheses, and of explanations that are not in the catalogue with the causes that
    they are added to, if these are needed (`occam_folded`); together they sum to 1.
    """
    inside = search.beliefs.probabilities(search.problem)
    scale = search.beliefs.log_total()
    log_added = log_sum([each.log_posterior for each in out_of_catalogue]) if out_of_catalogue else -np.inf
    total = log_sum([scale, log_added])
    found: dict[Ids, float] = {}
    for candidate in out_of_catalogue:
        ids = (*candidate.causes, candidate.id)
        found[ids] = found.get(ids, 0.0) + float(np.exp(candidate.log_posterior - total))
    kept = float(np.exp(scale - total))
    return {ids: kept * p for ids, p in inside.items()}, occam_folded(found)


def each_with_refitted_noise(search: Search, outside: Sequence[OutOfCatalogue]) -> list[OutOfCatalogue]:
    """Give every explanation that may be the most probable the evidence with its own noise: hypotheses in the search,
    and explanations that are not in the catalogue, which are returned, most probable first.

    "Nothing is wrong" leaves most to noise, and gains most: explanations that are less probable by more than that
    gain are skipped.
    """
    fits, first = search.candidates, max(search.best().log_posterior, _most(outside))
    own = partial(with_refitted_noise, search.problem)
    nothing = own(fits[()])
    none = nothing.before
    gained = max(none.log_posterior - fits[()].log_posterior, 0.0)
    least = max(first, none.log_posterior) - gained - settings.HOPELESS_NATS
    ranked = sorted(fits.values(), key=lambda fit: -fit.log_posterior)[: settings.MAX_RANKED]
    near = [candidate for candidate in ranked if candidate.ids and candidate.log_posterior > least]
    fits.update(
        {candidate.before.ids: candidate.before for candidate in [nothing, *search.side.map(own, near)]}
    )
    few = [
        candidate
        for candidate in outside[: settings.MAX_RANKED]
        if candidate.log_posterior > least and (candidate.point or not _is_force(candidate))
    ]
    found = search.side.map(partial(_with_refitted_noise, search.problem, nothing.problem), few)
    forces = search.side.map(partial(_against_nothing, search.problem, nothing), filter(_is_force, outside))
    return _sorted(
        [*found, *forces],
        [candidate for candidate in outside if candidate not in few and not _is_force(candidate)],
    )


def _is_force(candidate: OutOfCatalogue) -> bool:
    """Say whether it is a force or a drift without causes."""
    return isinstance(candidate.what, LatentForceCandidate) and not candidate.causes


def _with_refitted_noise(problem: Problem, behind: Problem, candidate: OutOfCatalogue) -> OutOfCatalogue:
    """Return an explanation that is not in the catalogue with the evidence with its own noise; `behind` is the
    problem with the noise of "nothing is wrong".
    """
    if isinstance(candidate.what, FittedChangePoint):
        return replace(
            candidate,
            log_posterior=candidate.log_posterior + _gain_of_refitted_noise(problem, candidate.what),
        )
    log = (
        candidate.log_posterior
        - candidate.what.log_evidence(problem, candidate.causes)
        + gained_by_noise(problem, behind)
    )
    return _against_noise(candidate, candidate.what.whitened_anew(problem, behind), log, behind)


def _gain_of_refitted_noise(problem: Problem, fitted: FittedChangePoint) -> float:
    """Return the gain in log evidence of a change point with its most probable noise, fitted again with that: in the
    linear problem alone nothing keeps a fin from losing more than all of its command.
    """
    own = refit_noise(problem, *fitted.linear(problem))
    more, fit = replace(fitted.problem, records=own.records), fitted.fit
    J = whitened_again(problem, own, fit.J)
    again = refit(more, fit.z, J, fit.D, most_fresh=0, made_at=fit.made_at)
    found = as_fitted(own, more, fitted.change_point, again)
    return found.log_posterior - fitted.log_posterior + gained_by_noise(problem, own)


def _against_nothing(
    problem: Problem, nothing: WithRefittedNoise, candidate: OutOfCatalogue
) -> OutOfCatalogue:
    """Return a force or a drift likewise, around "nothing is wrong" as it is fitted with its own noise."""
    assert isinstance(candidate.what, LatentForceCandidate)
    own, none = nothing.problem, nothing.again
    what = replace(candidate.what.whitened_anew(problem, own), fit=none.fit, kappa=none.kappa)
    without = posterior(none.fit.quadratic, variances(own.entries, (), none.kappa)).log_evidence
    return _against_noise(candidate, what, none.log_posterior + _log_prior(own) - without, own)


def _against_noise(
    candidate: OutOfCatalogue, what: LatentForceCandidate, log: float, behind: Problem
) -> OutOfCatalogue:
    """Return a force or a drift with the noise of "nothing is wrong", or with the noise given everything that the
    force might do: in the residual of "nothing is wrong" the force is noise, and given that noise little of the force
    is left; so there are two optima.

    Args:
        candidate: as it is.
        what: its force or drift, whitened with the noise of "nothing is wrong".
        log: added to its log evidence then.
        behind: the problem with that noise.
    """

    def log_posterior(own: Problem) -> float:
        evidence = what.whitened_anew(behind, own).log_evidence(own, candidate.causes)
        return log + evidence + gained_by_noise(behind, own)

    tried = [(log_posterior(behind), behind)]
    linear, D = what.linear_at_most(behind, candidate.causes)
    for _ in range(settings.MAX_TRIED):
        own = refit_noise(tried[-1][1], linear, D)
        tried.append((log_posterior(own), own))
        if tried[-1][0] < tried[-2][0] + settings.NEGLIGIBLE_GAIN_NATS:
            break
        linear, D = what.whitened_anew(behind, own).linear(own, candidate.causes)
    best, own = max(tried, key=lambda each: each[0])
    return replace(candidate, what=what.whitened_anew(behind, own), log_posterior=best, own=own)


def linear_of_first(search: Search, outside: Sequence[OutOfCatalogue]) -> tuple[Linear, np.ndarray]:
    """Return the linear problem around the most probable explanation, and prior variances of its parameters (k,)."""
    first, best = _first(search, outside), search.best()
    if first:
        return _linear_of(search.problem, first)
    linear = Linear(best.fit.r + best.fit.J @ best.fit.z, best.fit.J)
    return linear, variances(search.problem.entries, best.ids, best.kappa)


def _first(search: Search, added: Sequence[OutOfCatalogue]) -> OutOfCatalogue | None:
    """Return the explanation that is not in the catalogue, if that is the most probable one."""
    first = max(added, key=lambda candidate: candidate.log_posterior, default=None)
    return first if first and first.log_posterior > search.best().log_posterior else None


def _linear_of(problem: Problem, candidate: OutOfCatalogue) -> tuple[Linear, np.ndarray]:
    """Return the linear problem around an explanation that is not in the catalogue, and the prior variances of all
    its parameters (k,).
    """
    if isinstance(candidate.what, FittedChangePoint):
        return candidate.what.linear(problem)
    own = candidate.own or problem
    linear, D = candidate.what.linear(own, candidate.causes)
    return Linear(*(whitened_again(own, problem, part) for part in linear)), D


@dataclass(kw_only=True, eq=False)
class Findings:
    """Results so far.

    Attributes:
        search: over hypotheses.
        detectable: smallest detectable sizes of causes.
        misfit: record → channel → how the nominal model fails.
        out_of_catalogue: explanations that are not in the list of hypotheses.
        refuted: rivals of the best that simulations refute, however similar they are in the linear problem.
        sensitive: records whose motion no simulation follows for long.
        seconds: duration of each part.
        complete: nothing was left out.
        given_up: no further result can make it as probable as another set of data errors.
        seed: of all random numbers.
        budget: one of BUDGETS.
    """

    search: Search
    detectable: tuple[Detectability, ...] = ()
    misfit: dict[str, dict[str, Misfit]] = field(default_factory=dict)
    out_of_catalogue: list[OutOfCatalogue] = field(default_factory=list)
    refuted: frozenset[str] = frozenset()
    sensitive: tuple[SensitiveRun, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    complete: bool = True
    given_up: bool = False
    seed: int = 0
    budget: str = "full"

    @property
    def problem(self) -> Problem:
        """Records and parameters, with the noise as it is estimated so far."""
        return self.search.problem

    @property
    def records(self) -> tuple[Observed, ...]:
        """The records, with the noise of the most probable explanation, if it has one of its own."""
        first = _first(self.search, self.out_of_catalogue)
        return (first.own if first and first.own else self.problem).records
