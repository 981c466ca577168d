"""When an unknown input acts: of all spans of time, the one that suits the records best in the linear problem.

    log p(span) = ½ hᵀ S⁻¹ h − ½ log|S| + const,   S, h: of the knots in the span, all other numbers integrated out

A push that lasts for some seconds has few numbers, a history of the whole record has many, each of which costs
evidence. Spans have equal prior odds; those next to the best one, which say nearly the same, count with it.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from subzero.identification.explanation import Term, for_a_time
from subzero.identification.fit import Linear, Products, spreads
from subzero.identification.problem import Problem


def best_span(problem: Problem, linear: Linear, term: Term) -> Term:
    """Return an unknown input as it acts for the time that suits the records best.

    Args:
        problem: records and model.
        linear: an explanation in which it acts throughout.
        term: that it acts throughout.
    """
    own = np.array([(e.kind, e.name) == ("unknown", term.target) for e in linear.entries])
    S, h = _without_others(problem, linear, own)
    records = np.array([entry.record for entry in linear.entries])[own]
    spans, gains = [], []
    for record in np.unique(records).tolist():
        at = np.flatnonzero(records == record)
        for first in range(at.size):
            L = np.linalg.cholesky(S[np.ix_(at[first:], at[first:])])
            y = solve_triangular(L, h[at[first:]], lower=True)
            gains.append(np.cumsum(0.5 * y**2 - np.log(np.diag(L))))
            spans += [(record, first, last) for last in range(first, at.size)]
    gain = np.concatenate(gains)
    record, first, last = spans[int(np.argmax(gain))]
    share = float(np.mean(np.exp(gain - gain.max())))
    return _between(problem, term, record, first, last, share)


def _without_others(problem: Problem, linear: Linear, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (S, h) of some numbers, over the standard deviations of their priors, all others integrated out."""
    A, b, *_ = Products(problem, linear.terms, linear.e, linear.J).total(linear.levels.noise)
    sd = spreads(linear.entries, linear.levels)
    H, g = sd[:, None] * A * sd + np.eye(sd.size), sd * (b + A @ linear.off)
    factor, across = cho_factor(H[np.ix_(~own, ~own)], lower=True), H[np.ix_(own, ~own)]
    return H[np.ix_(own, own)] - across @ cho_solve(factor, across.T), g[own] - across @ cho_solve(
        factor, g[~own]
    )


def _between(problem: Problem, term: Term, record: int, first: int, last: int, share: float) -> Term:
    """Return an unknown input with some of its knots; between the knots next to these it is not 0."""
    times = problem.knots[record][term.target]
    begins, ends = times[max(first - 1, 0)], times[min(last + 1, times.size - 1)]
    where = f" of {problem.records[record].name}" if len(problem.records) > 1 else ""
    words = f"from {begins:.3g} to {ends:.3g} s{where}"
    return for_a_time(term, record, float(times[first]), float(times[last]), share, words)
