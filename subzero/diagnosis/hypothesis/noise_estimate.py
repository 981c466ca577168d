"""The most probable noise of a channel, from the residual of a fit z* with Jacobian J (REML).

    y − h(z*) + J z*  ~  N(0, J D Jᵀ + Σ(σ_w, σ_s, τ_s, q)),        z ~ N(0, D),      Σ and priors as in `noise`

The parameters are marginalised, so that a smooth misfit that the model can follow is no noise. The slow part has a
prior: a usual sensor wanders by about its usual noise, and a wander many times as large is an effect to be found, so
σ_s is bounded by `MOST_SLOW`.

The best points of a grid are refined by Nelder's and Mead's method (1965), in compiled code: in a simplex of four
points the worst corner is reflected about the centre of the others; expanded if that is the best of all; contracted,
to the outside or the inside, if it is not better than the second worst; if that does not help either, all corners
shrink towards the best.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.noise import (
    FEWEST,
    Noise,
    Prior,
    SensorPrior,
    log_density,
    prior_noise,
    prior_of,
    slow_usual,
)
from subzero.jit import compiled, scratch

LEAST_SLOW, MOST_SLOW = 0.05, 4.0
"""Bounds of the slow part, in usual sizes: a larger one is no noise of the sensor; no sensor has a smaller one, and
the steps of a simulation err by as much. [-]
"""
SHORTEST, LONGEST = 0.25, 1.0 / 3.0
"""Correlation times lie between this share of a sample and that of the record. [-]"""
FELT = 0.03
"""A direction of the parameters that moves the samples by less than this, in usual levels, is neglected. [-]"""
MOST_WHITE, SEEN_WHITE = 3.0, 1.5
"""σ_w is at most so many usual levels, or so many times the estimate from second differences of the residual. [-]"""
RATIOS, TIMES, LEVELS = (0.1, 0.5, 1.0, 3.0), 6, (0.4, 1.0, 2.5)
"""Grid of starts: σ_s/σ_w, number of τ_s, and level over that of the residual. [-]"""
STARTS = 2
"""Number of starts, the best ones, that are refined."""
FIRST_MOVE, FIRST_MOVE_OF_0 = 0.05, 0.00025
"""In each other corner of the first simplex one number is larger by this share; or has this size if it is 0. [-]"""
SETTLED, MOST_ASKED = 0.02, 200
"""The search ends when all corners are within this distance of the best, in each logarithm and in nats; or after so
many evaluations of the likelihood.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class ResidualNoise:
    """The residual of a channel in a fit, from which its noise is estimated.

    Attributes:
        residual: y − h(z*) + J z* (m,): that with all parameters at 0.
        J: sensitivities to the parameters (m, k), in the channel's unit.
        D: prior variances of the parameters (k,).
    """

    residual: np.ndarray
    J: np.ndarray
    D: np.ndarray


class NoiseSearch(NamedTuple):
    """The data of the search for the most probable noise.

    Attributes:
        steps: times to the next sample (m,). [s]
        both: F, with F Fᵀ = J D Jᵀ, and in the last column y − h(z*) + J z* (m, n + 1).
        rounding: q²/12.
        prior: of log σ_w, log σ_s, log τ_s.
        low, high: their bounds (3,).
        work: work space (n + 3, n + 1).
    """

    steps: np.ndarray
    both: np.ndarray
    rounding: float
    prior: Prior
    low: np.ndarray
    high: np.ndarray
    work: np.ndarray


def estimate(
    time: np.ndarray, behind: ResidualNoise, usual: SensorPrior, known: Noise | None = None
) -> Noise:
    """Return the most probable noise of a channel, from the residual of a fit.

    Args:
        time: of the samples that are used (m,). [s]
        behind: residual and sensitivities of the fit.
        usual: the prior of the sensor.
        known: an estimate from another fit; the search is started from it, too.

    Returns:
        noise of which all these samples are used.
    """
    if time.size < FEWEST:
        return prior_noise(time, np.ones(time.size, dtype=bool), usual)
    # F has few columns: with it a likelihood costs of the order of m n² instead of m³.
    r, F = behind.residual, _felt_directions(behind.J * np.sqrt(behind.D), usual.level)
    steps, both = np.diff(time, append=time[-1:]), np.column_stack([F, r])
    # One work space for all evaluations, as compiled code allocates nothing.
    work = np.empty((both.shape[1] + 2, both.shape[1]))
    sought = NoiseSearch(
        steps, both, usual.resolution**2 / 12.0, prior_of(usual), *_bounds(time, r, usual), work
    )
    starts = _starts(time, r, F, usual)
    if known is not None:
        # The known estimate is always refined, whatever its rank among the starts.
        there = np.log([known.white, known.slow, known.correlation_time])
        starts = np.vstack([starts, np.clip(there, sought.low, sought.high)])
    costs = np.empty(len(starts))
    costs_of(sought, starts, costs)
    started = {
        *np.argsort(costs, kind="stable")[:STARTS].tolist(),
        *([] if known is None else [len(starts) - 1]),
    }
    for i in started:
        costs[i] = descend(sought, starts[i])
    return _noise_of(starts[min(started, key=lambda i: costs[i])], time, usual)


@compiled
def costs_of(sought: NoiseSearch, points: np.ndarray, costs: np.ndarray) -> None:
    """Fill the cost of each point (n, 3)."""
    for i in range(costs.size):
        costs[i] = _cost(sought, points[i])


@compiled
def _cost(sought: NoiseSearch, log: np.ndarray) -> float:
    """Return minus the log density of log σ_w, log σ_s, log τ_s (3,), up to a constant."""
    white, slow, lasts = np.exp(log[0]), np.exp(log[1]), np.exp(log[2])
    unrelated = white * white + sought.rounding
    likelihood = log_marginal(sought.steps, unrelated, slow * slow, lasts, sought.both, sought.work)
    return -likelihood - log_density(log, sought.prior)


@compiled
def descend(sought: NoiseSearch, point: np.ndarray) -> float:
    """Overwrite a point (3,) with the minimum found from it, and return its cost."""
    simplex, costs = scratch(4, 3), scratch(1, 4)[0]
    for k in range(4):
        # The first corner, with number −1, is the point itself.
        _corner(sought, point, k - 1, simplex[k])
        costs[k] = _cost(sought, simplex[k])
    asked = 4
    _sort(simplex, costs)
    while asked < MOST_ASKED and not _is_settled(simplex, costs):
        asked += _improve(sought, simplex, costs)
        _sort(simplex, costs)
    for i in range(3):
        point[i] = simplex[0, i]
    return costs[0]


@compiled
def _corner(sought: NoiseSearch, point: np.ndarray, moved: int, corner: np.ndarray) -> None:
    """Fill a corner of the first simplex (3,): the point with one of its numbers moved, reflected at an upper
    bound.
    """
    for i in range(3):
        corner[i] = point[i]
        if i == moved:
            corner[i] = (1.0 + FIRST_MOVE) * point[i] if point[i] != 0.0 else FIRST_MOVE_OF_0
            if corner[i] > sought.high[i]:
                # Clipped instead, a corner might coincide with a point at the bound: the simplex would be flat.
                corner[i] = 2.0 * sought.high[i] - corner[i]
    _clip(sought, corner)


@compiled
def _clip(sought: NoiseSearch, point: np.ndarray) -> None:
    """Clip a point (3,) to the bounds."""
    for i in range(3):
        point[i] = min(max(point[i], sought.low[i]), sought.high[i])


@compiled
def _sort(simplex: np.ndarray, costs: np.ndarray) -> None:
    """Sort the corners by their costs, the best first."""
    for k in range(1, 4):
        for at in range(k, 0, -1):
            # Equal costs keep their order.
            if not costs[at] < costs[at - 1]:
                break
            costs[at], costs[at - 1] = costs[at - 1], costs[at]
            for i in range(3):
                simplex[at, i], simplex[at - 1, i] = simplex[at - 1, i], simplex[at, i]


@compiled
def _is_settled(simplex: np.ndarray, costs: np.ndarray) -> bool:
    """Say whether all corners are close to the best."""
    far = costs[3] - costs[0]
    for k in range(1, 4):
        for i in range(3):
            far = max(far, abs(simplex[k, i] - simplex[0, i]))
    return far <= SETTLED


@compiled
def _improve(sought: NoiseSearch, simplex: np.ndarray, costs: np.ndarray) -> int:
    """Replace the worst corner by a better point, or shrink all towards the best; return the number of
    evaluations.
    """
    # Each branch returns its number of evaluations: 1, 2, or 5 with the three corners that shrink.
    first, second = scratch(1, 3)[0], scratch(1, 3)[0]
    reflected = _beyond(sought, simplex, 1.0, first)
    if costs[0] <= reflected < costs[2]:
        _put(first, reflected, simplex, costs)
        return 1
    if reflected < costs[0]:
        expanded = _beyond(sought, simplex, 2.0, second)
        if expanded < reflected:
            _put(second, expanded, simplex, costs)
        else:
            _put(first, reflected, simplex, costs)
        return 2
    # Contract on the side of the better one of the reflected point and the worst corner.
    is_better_than_worst = reflected < costs[3]
    contracted = _beyond(sought, simplex, 0.5 if is_better_than_worst else -0.5, second)
    if (contracted <= reflected) if is_better_than_worst else (contracted < costs[3]):
        _put(second, contracted, simplex, costs)
        return 2
    for k in range(1, 4):
        for i in range(3):
            simplex[k, i] = simplex[0, i] + 0.5 * (simplex[k, i] - simplex[0, i])
        costs[k] = _cost(sought, simplex[k])
    return 5


@compiled
def _beyond(sought: NoiseSearch, simplex: np.ndarray, share: float, point: np.ndarray) -> float:
    """Fill a point (3,), and return its cost: beyond the centre of the others as seen from the worst corner, by a
    share of the distance between the two.
    """
    for i in range(3):
        centre = (simplex[0, i] + simplex[1, i] + simplex[2, i]) / 3.0
        point[i] = (1.0 + share) * centre - share * simplex[3, i]
    _clip(sought, point)
    return _cost(sought, point)


@compiled
def _put(point: np.ndarray, cost: float, simplex: np.ndarray, costs: np.ndarray) -> None:
    """Replace the worst corner by a point (3,)."""
    for i in range(3):
        simplex[3, i] = point[i]
    costs[3] = cost


def _noise_of(log: np.ndarray, time: np.ndarray, usual: SensorPrior) -> Noise:
    white, slow, lasts = np.exp(log).tolist()
    every = np.ones(time.size, dtype=bool)
    return Noise(
        white=white, slow=slow, correlation_time=lasts, resolution=usual.resolution, used=every, time=time
    )


def _felt_directions(scaled: np.ndarray, level: float) -> np.ndarray:
    """Return F (m, few) with F Fᵀ = J D Jᵀ, without directions that hardly move the samples."""
    # U s² Uᵀ is J D Jᵀ; s/√m is the root mean square effect of a direction on the samples.
    U, s, _ = np.linalg.svd(scaled, full_matrices=False)
    felt = s > FELT * level * np.sqrt(scaled.shape[0])
    return U[:, felt] * s[felt]


def _bounds(at: np.ndarray, r: np.ndarray, usual: SensorPrior) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest log σ_w, log σ_s, log τ_s (3,) each.

    The residual of a fit that is far from the record has a large smooth part that is no noise: second differences
    hardly contain it.
    """
    # Second differences of white noise have the variance 6 σ²; 1.4826 times the median deviation of normal noise is
    # its standard deviation.
    seen = 1.4826 * float(np.median(np.abs(np.diff(r, 2)))) / np.sqrt(6.0)
    step, span = float(np.median(np.diff(at))), float(at[-1] - at[0])
    shortest = SHORTEST * step
    low = [1e-3 * usual.level, LEAST_SLOW * slow_usual(usual), shortest]
    most_white = max(MOST_WHITE * usual.level, SEEN_WHITE * seen)
    high = [most_white, MOST_SLOW * slow_usual(usual), max(LONGEST * span, 2.0 * shortest)]
    return np.log(low), np.log(high)


def _starts(at: np.ndarray, r: np.ndarray, F: np.ndarray, usual: SensorPrior) -> np.ndarray:
    """Return a grid of plausible points (n, 3): the level of the residual of a linear fit, divided between the parts
    of the noise.
    """
    # Ridge regression, with white noise of the usual level, removes what the parameters can follow.
    ridge = np.eye(F.shape[1]) * usual.level**2
    left = r - F @ np.linalg.solve(F.T @ F + ridge, F.T @ r)
    level = max(1.4826 * float(np.median(np.abs(left))), 0.1 * usual.level)
    low, high = _bounds(at, r, usual)
    times = np.linspace(low[2], high[2], TIMES + 2)[1:-1]
    ratio, share, time = (axis.ravel() for axis in np.meshgrid(RATIOS, LEVELS, times, indexing="ij"))
    # Both parts together have the level share · level.
    white = share * level / np.sqrt(1.0 + ratio**2)
    return np.clip(np.column_stack([np.log(white), np.log(ratio * white), time]), low, high)


@compiled
def log_marginal(
    steps: np.ndarray, unrelated: float, slow: float, lasts: float, both: np.ndarray, work: np.ndarray
) -> float:
    """Return log N(r; 0, F Fᵀ + Σ), up to a constant: −½ (xᵀx − |L⁻¹ Gᵀx|²) − log det L − ½ log det Σ, with x and G
    the whitened r and F, and L Lᵀ = I + Gᵀ G.

    Args:
        steps: times to the next sample (m,). [s]
        unrelated: σ_w² + q²/12.
        slow: σ_s².
        lasts: τ_s. [s]
        both: F and, in the last column, r (m, n + 1).
        work: work space (n + 3, n + 1).
    """
    many = both.shape[1]
    expected, white, inner = work[many], work[many + 1], work[:many]
    expected[:] = 0.0
    inner[:] = 0.0
    left, log_scale, kept = slow, 0.0, 0.0
    # One pass over the samples: the filter of `noise` for all columns, and the products of the whitened columns.
    for i in range(both.shape[0]):
        # Most records are evenly sampled, and the exponential is the costliest operation here.
        if i == 0 or steps[i] != steps[i - 1]:
            kept = np.exp(-steps[i] / lasts)
        seen = left + unrelated
        gain, inverse = left / seen, 1.0 / np.sqrt(seen)
        log_scale += 0.5 * np.log(seen)
        left = kept * kept * left * (1.0 - gain) + slow * (1.0 - kept * kept)
        for j in range(many):
            new = both[i, j] - expected[j]
            white[j] = new * inverse
            expected[j] = kept * (expected[j] + gain * new)
            for k in range(j + 1):
                inner[j, k] += white[j] * white[k]
    return -log_scale + _log_of_square(inner)


@compiled
def _log_of_square(inner: np.ndarray) -> float:
    """Return −½ (xᵀx − |L⁻¹ Gᵀx|²) − log det L, from Gᵀ G, below it xᵀ G, and xᵀx (n + 1, n + 1), which is
    overwritten by L.
    """
    last, log_det = inner.shape[0] - 1, 0.0
    # Cholesky decomposition in place, with r as a last row: that becomes (L⁻¹ Gᵀx)ᵀ, and its last element, without a
    # root, xᵀx − |L⁻¹ Gᵀx|².
    for j in range(last + 1):
        for k in range(j + 1):
            value = inner[j, k] + (1.0 if j == k and j < last else 0.0)
            for i in range(k):
                value -= inner[j, i] * inner[k, i]
            if k < j:
                inner[j, k] = value / inner[k, k]
            elif j < last:
                inner[j, j] = np.sqrt(value)
                log_det += np.log(inner[j, j])
            else:
                inner[j, j] = value
    return -0.5 * inner[last, last] - log_det
