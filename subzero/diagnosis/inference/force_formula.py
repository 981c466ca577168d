"""A formula for a latent force: sparse regression on shapes of `latent_force`, by evidence from the data themselves.

    w(t) = Σ c_j φ_j(t),   φ_j of `latent_force`;      c ~ N(0, (a/rms φ)²), amplitudes a mixed
    log p = log evidence of the sum (tolerances free) + log prior of its features and of their number

Only the information of the data on the history is used (`ForceInformation`): no formula is fitted to a curve that was
smoothed before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.inference.latent_force import (
    SHAPE_STEP_S,
    Shape,
    all_shapes,
    at_knots,
    factors_along,
    samples_of,
    shape_weight,
    shifted,
    size_of,
    typical_force,
)
from subzero.diagnosis.inference.linear_gaussian import AMPLITUDE_SHARES, ForceInformation, log_sum

if TYPE_CHECKING:
    from subzero.diagnosis.inference.input_estimation import EstimatedForce

NORMAL_95 = 1.96


@dataclass(frozen=True, kw_only=True, eq=False)
class Formula:
    """A short sum of shapes.

    Attributes:
        axis: it acts on.
        shapes: its terms, the largest first.
        coefficients: of each (columns of its shape,), in the order of its columns.
        covariance: of all coefficients, in the order of all columns (columns, columns).
        log_gain: log evidence over that of no force, with the log prior of its features.
        features: feature → probability that it belongs to the formula, most probable first.
    """

    axis: str
    shapes: tuple[Shape, ...]
    coefficients: tuple[np.ndarray, ...]
    covariance: np.ndarray
    log_gain: float
    features: Mapping[str, float]

    def terms(self) -> tuple[tuple[str, str, float, float, float], ...]:
        """Return (words, feature, coefficient, low, high) of every term; of a wave its amplitude."""
        found, at = [], 0
        for shape, c in zip(self.shapes, self.coefficients, strict=True):
            own = self.covariance[at : at + c.size, at : at + c.size]
            size = float(c[0]) if c.size == 1 else float(np.linalg.norm(c))
            along = c / size if size else np.eye(c.size)[0]
            sd = float(np.sqrt(along @ own @ along))
            found.append((shape.words, shape.feature, size, size - NORMAL_95 * sd, size + NORMAL_95 * sd))
            at += c.size
        return tuple(found)

    def force(self) -> np.ndarray:
        """Return the force at the samples (n,). [N, N m]"""
        return np.sum([s.columns @ c for s, c in zip(self.shapes, self.coefficients, strict=True)], axis=0)


FURTHER_TERM_PRIOR = 0.05
"""Prior of a further term, relative to none."""
BEAM_WIDTH, MAX_TERMS = 10, 3
"""Number of sums that are carried on from one size to the next, and the most terms."""


def describe(found: EstimatedForce) -> Formula:
    """Return the most probable formula of a recovered force."""
    setting = found.problem.setting(found.record, found.fit.z)
    times = samples_of(float(found.unknown.time[-1]))
    shapes = all_shapes(factors_along(setting, times), times)
    axis = found.unknown.axis
    own = found.knots.record == found.record
    data = ForceInformation(found.data.M[np.ix_(own, own)], found.data.q[own])
    amplitudes = [share * typical_force(setting, axis) for share in AMPLITUDE_SHARES]
    to_knots = at_knots(times, found.unknown.time)
    return refined(choose(shapes, data, to_knots, axis, amplitudes), shapes, data, to_knots, amplitudes)


def refined(
    formula: Formula,
    shapes: Sequence[Shape],
    data: ForceInformation,
    to_knots: np.ndarray,
    amplitudes: Sequence[float],
) -> Formula:
    """Return a formula with the edges of its windows on a finer grid; the probabilities of features are unchanged."""
    times = SHAPE_STEP_S * np.arange(to_knots.shape[1])
    plain = {shape.feature: shape for shape in shapes if shape.is_plain}
    for shape in formula.shapes:
        others = [each for each in formula.shapes if each is not shape]
        tried = [(*others, each) for each in shifted(shape, plain.get(shape.feature, shape), times)]
        best = max(
            (_fixed(formula.axis, each, data, to_knots, amplitudes) for each in tried),
            key=lambda each: each.log_gain,
        )
        formula = replace(best, features=formula.features)
    return formula


def _fixed(
    axis: str,
    terms: Sequence[Shape],
    data: ForceInformation,
    to_knots: np.ndarray,
    amplitudes: Sequence[float],
) -> Formula:
    """Return the formula of given terms."""
    scaled, every = [to_knots @ (term.columns / size_of(term)) for term in terms], tuple(range(len(terms)))
    score = _score(every, terms, scaled, data, axis, amplitudes)
    return _formula(every, {every: score}, terms, scaled, data, axis, amplitudes)


def choose(
    shapes: Sequence[Shape],
    data: ForceInformation,
    to_knots: np.ndarray,
    axis: str,
    amplitudes: Sequence[float],
) -> Formula:
    """Return the most probable sum of shapes.

    Args:
        shapes: the candidates for terms.
        data: the information of the data on the force at knots.
        to_knots: from samples to knots (knots, samples).
        axis: of the force.
        amplitudes: of the mixture. [N, N m]
    """
    scaled = [to_knots @ (shape.columns / size_of(shape)) for shape in shapes]
    scores: dict[tuple[int, ...], float] = {}
    kept: list[tuple[int, ...]] = [()]
    narrow: list[int] = list(range(len(shapes)))
    for size in range(1, MAX_TERMS + 1):
        sets = {tuple(sorted({*formula, i})) for formula in kept for i in narrow if i not in formula}
        for each in sets:
            scores[each] = _score(each, shapes, scaled, data, axis, amplitudes)
        ranked = sorted((formula for formula in sets), key=lambda formula: -scores[formula])
        kept = _different(ranked, shapes)
        narrow = _narrow(narrow, ranked, shapes) if size == 1 else narrow
    best = max(scores, key=lambda score: scores[score])
    return _formula(best, scores, shapes, scaled, data, axis, amplitudes)


def _different(ranked: list[tuple[int, ...]], shapes: Sequence[Shape]) -> list[tuple[int, ...]]:
    """Return the best sums, at most two with the same features."""
    kept: list[tuple[int, ...]] = []
    counts: dict[tuple[str, ...], int] = {}
    for candidate in ranked:
        key = tuple(shapes[i].feature for i in candidate)
        counts[key] = counts.get(key, 0) + 1
        kept += [candidate] if counts[key] <= 2 and len(kept) < BEAM_WIDTH else []
    return kept


def _narrow(narrow: list[int], ranked: list[tuple[int, ...]], shapes: Sequence[Shape]) -> list[int]:
    """Return the shapes that may be further terms: all plain ones, and the best others."""
    return sorted({*(i for i in narrow if shapes[i].is_plain), *(i for (i,) in _different(ranked, shapes))})


def _score(
    chosen: tuple[int, ...],
    shapes: Sequence[Shape],
    scaled: Sequence[np.ndarray],
    data: ForceInformation,
    axis: str,
    amplitudes: Sequence[float],
) -> float:
    """Return the log posterior of a sum, over that of no force, but for a common constant."""
    gains = [_gain(_own(chosen, scaled, data), a) for a in amplitudes]
    return log_sum(gains) - float(np.log(len(gains))) + _log_prior([shapes[i] for i in chosen], axis)


def _log_prior(terms: Sequence[Shape], axis: str) -> float:
    return sum(shape_weight(term, axis) for term in terms) + (len(terms) - 1) * float(
        np.log(FURTHER_TERM_PRIOR)
    )


def _own(chosen: tuple[int, ...], scaled: Sequence[np.ndarray], data: ForceInformation) -> ForceInformation:
    """Return the information of the data on the coefficients of a sum."""
    phi = np.hstack([scaled[i] for i in chosen])
    return ForceInformation(phi.T @ data.M @ phi, phi.T @ data.q)


def _gain(data: ForceInformation, amplitude: float) -> float:
    """Return the log evidence over that of no force, for coefficients of an amplitude."""
    a2 = amplitude**2
    if data.q.size == 1:
        stiff = 1.0 + a2 * float(data.M[0, 0])
        return 0.5 * a2 * float(data.q[0]) ** 2 / stiff - 0.5 * float(np.log(stiff))
    inner = np.eye(data.q.size) + a2 * data.M
    return 0.5 * a2 * float(data.q @ np.linalg.solve(inner, data.q)) - 0.5 * float(
        np.linalg.slogdet(inner)[1]
    )


def _formula(
    best: tuple[int, ...],
    scores: Mapping[tuple[int, ...], float],
    shapes: Sequence[Shape],
    scaled: Sequence[np.ndarray],
    data: ForceInformation,
    axis: str,
    amplitudes: Sequence[float],
) -> Formula:
    """Return the formula of the best sum, its largest term first."""
    own = _own(best, scaled, data)
    a = max(amplitudes, key=partial(_gain, own))
    covariance = np.linalg.inv(np.eye(own.q.size) / a**2 + own.M)
    mean, sizes = covariance @ own.q, [shapes[i].columns.shape[1] for i in best]
    parts = np.split(np.arange(mean.size), np.cumsum(sizes)[:-1])
    order = sorted(range(len(best)), key=lambda j: -float(np.linalg.norm(mean[parts[j]])))
    scale = np.concatenate([np.full(size, size_of(shapes[i])) for i, size in zip(best, sizes, strict=True)])
    places = np.concatenate([parts[j] for j in order])
    return Formula(
        axis=axis,
        shapes=tuple(shapes[best[j]] for j in order),
        coefficients=tuple(mean[parts[j]] / scale[parts[j]] for j in order),
        covariance=(covariance / np.outer(scale, scale))[np.ix_(places, places)],
        log_gain=scores[best],
        features=_features(scores, shapes),
    )


def _features(scores: Mapping[tuple[int, ...], float], shapes: Sequence[Shape]) -> dict[str, float]:
    """Return the probability of every feature to belong to the formula."""
    total = log_sum(list(scores.values()))
    found: dict[str, float] = {}
    for each, score in scores.items():
        for name in {shapes[i].feature for i in each}:
            found[name] = found.get(name, 0.0) + float(np.exp(score - total))
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))
