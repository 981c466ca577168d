"""The fit of an explanation, and its evidence.

    e(θ) = e₀ − J (θ − θ₀),   θ ~ N(c, D),   e ~ N(0, Σ)
    log p = −½ eᵀ Σ⁻¹ e − ½ log|2πΣ| − ½ (θ̂ − c)ᵀ D⁻¹ (θ̂ − c) − ½ log|I + D^½ Jᵀ Σ⁻¹ J D^½| + log prior(Σ, D)

Laplace's approximation at the maximum θ̂ of the posterior, found by Gauss-Newton steps with real simulations. Levels of
the noise, and sizes of unknown inputs, maximise the same evidence of the linear problem (empirical Bayes); a declared
level binds them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize, minimize_scalar

from subzero.identification.explanation import Entry, Terms
from subzero.identification.noise import Filter, Noise
from subzero.identification.problem import Problem

SIZE_SPREAD = 1.0
"""Standard deviation of the logarithm of an unknown input's size about the declared one. [-]"""
ROUNDS, STEPS = 20, 3
"""Sensitivities are computed at most so often; Gauss-Newton steps with each."""
PATIENCE = 2
"""Rounds without a gain that end a fit: the evidence of a linear problem falls now and then on the way."""
TEMPER, APPROACHING = 0.3, 0.03
"""Noise on the way from afar, over the residual; a smaller share gained of every channel ends it. [-]"""
ENOUGH = 0.05
"""A step that gains less log posterior ends them. [nats]"""
SIZE_RANGE = (-5.0, 6.0)
"""Sizes of unknown inputs that are looked at, as logarithms of their ratio to the declared one. [-]"""


@dataclass(frozen=True)
class Levels:
    """What a fit takes as known while it moves θ: noise of the channels, sizes of the unknown inputs over the
    declared ones.
    """

    noise: Mapping[str, Noise]
    sizes: Mapping[str, float]


def usual_levels(problem: Problem) -> Levels:
    """Return the levels before any fit."""
    return Levels(
        {name: each.prior.usual() for name, each in problem.channels.items()},
        {unknown.name: 1.0 for unknown in problem.model.unknown},
    )


class Products:
    """Jᵀ Σ⁻¹ J, Jᵀ Σ⁻¹ e, eᵀ Σ⁻¹ e and ½ log|2πΣ| of channels, at one point: sums over channels.

    A channel's products are computed anew only where its noise changes.
    """

    def __init__(
        self, problem: Problem, terms: Terms, e: Mapping[str, np.ndarray], J: Mapping[str, np.ndarray]
    ) -> None:
        self._parts: dict[tuple[str, Noise], tuple[np.ndarray, float]] = {}
        self._resolutions = {name: each.prior.resolution for name, each in problem.channels.items()}
        self._blocks = {name: _blocks(problem, name, terms, J[name], e[name]) for name in e}
        self._size = next(iter(J.values())).shape[1] + 1

    def of(self, name: str, noise: Noise) -> tuple[np.ndarray, float]:
        """Return [J e]ᵀ Σ⁻¹ [J e] and the log scale of a channel with a noise."""
        if (name, noise) not in self._parts:
            G, log_scale = np.zeros((self._size, self._size)), 0.0
            for places, times, columns in self._blocks[name]:
                filtered = Filter.of(noise, self._resolutions[name], times)
                white = filtered.whiten(columns)
                G[np.ix_(places, places)] += white.T @ white
                log_scale += filtered.log_scale + 0.5 * times.size * np.log(2.0 * np.pi)
            self._parts[name, noise] = (G, log_scale)
        return self._parts[name, noise]

    def total(self, noise: Mapping[str, Noise]) -> tuple[np.ndarray, np.ndarray, float, float]:
        """Return (A, b, ee, log scale), sums over all channels."""
        parts = [self.of(name, each) for name, each in noise.items() if name in self._blocks]
        G = np.sum([part[0] for part in parts], axis=0)
        return G[:-1, :-1], G[:-1, -1], float(G[-1, -1]), sum(part[1] for part in parts)


Block = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Of a channel in one record: places of the columns that are not 0 (k,), times (m,), columns (m, k)."""


def _blocks(problem: Problem, name: str, terms: Terms, J: np.ndarray, e: np.ndarray) -> list[Block]:
    """Return a channel record by record: unknown inputs and starts of one change nothing in another."""
    each, used = problem.channels[name], problem.used(name, terms)
    found = []
    for record in np.unique(each.record).tolist():
        at = used & (each.record == record)
        columns = np.column_stack([J[at], e[at]])
        places = np.flatnonzero(np.append(columns[:, :-1].any(axis=0), True))
        found.append((places, each.time[at], np.ascontiguousarray(columns[:, places])))
    return found


def spreads(entries: Sequence[Entry], levels: Levels) -> np.ndarray:
    """Return prior standard deviations (n,)."""
    return np.array(
        [entry.sd * (levels.sizes[entry.name] if entry.kind == "unknown" else 1.0) for entry in entries]
    )


def solve(
    products: tuple[np.ndarray, np.ndarray, float, float], sd: np.ndarray, off: np.ndarray
) -> tuple[np.ndarray, float, np.ndarray]:
    """Return the step (n,) to the maximum of a linear problem's posterior, its log evidence, and the factor of
    I + D^½ A D^½.

    Args:
        products: of the point.
        sd: √D (n,).
        off: θ − c at the point (n,).
    """
    A, b, ee, log_scale = products
    # θ = c + √D z: e + J off is the residual with all numbers at the means of their priors.
    whole = b + A @ off
    square = ee + 2.0 * float(off @ b) + float(off @ A @ off)
    H = sd[:, None] * A * sd
    H.ravel()[:: sd.size + 1] += 1.0 + sd.size * np.finfo(float).eps * np.trace(H)
    factor = cho_factor(H, lower=True)
    z = cho_solve(factor, sd * whole)
    log_det = float(np.sum(np.log(np.diag(factor[0]))))
    evidence = -0.5 * (square - float(z @ (sd * whole))) - log_det - log_scale
    return sd * z - off, evidence, factor


def log_levels(problem: Problem, levels: Levels) -> float:
    """Return the log prior density of noise and sizes, up to a constant."""
    noise = sum(problem.channels[name].prior.log_density(each) for name, each in levels.noise.items())
    sizes = sum(
        -0.5 * (np.log(levels.sizes[unknown.name]) / SIZE_SPREAD) ** 2 for unknown in problem.model.unknown
    )
    return float(noise + sizes)


@dataclass(frozen=True, eq=False)
class Linear:
    """An explanation linearised at a point.

    Attributes:
        terms: the explanation.
        entries: its free numbers.
        x: the point (n,).
        e: channel → residuals there (m,).
        J: channel → −∂e/∂θ (m, n).
        levels: noise and sizes.
    """

    terms: Terms
    entries: Sequence[Entry]
    x: np.ndarray
    e: Mapping[str, np.ndarray]
    J: Mapping[str, np.ndarray]
    levels: Levels

    @property
    def off(self) -> np.ndarray:
        """How far the point is from the means of the priors (n,)."""
        return self.x - np.array([entry.centre for entry in self.entries])

    def evidence(self, problem: Problem) -> tuple[np.ndarray, float, np.ndarray]:
        """Return the best step (n,), the log evidence with everything that is not linear, and the factor."""
        products = Products(problem, self.terms, self.e, self.J).total(self.levels.noise)
        step, evidence, factor = solve(products, spreads(self.entries, self.levels), self.off)
        more = problem.log_jacobian(self.terms) + log_levels(problem, self.levels)
        return step, evidence + more, factor


def bounds(entries: Sequence[Entry]) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of entries, (n,) each."""
    return np.array([entry.low for entry in entries]), np.array([entry.high for entry in entries])


def fitted_levels(problem: Problem, linear: Linear) -> Levels:
    """Return the noise and the sizes that have the highest evidence in a linear problem, one after the other, twice."""
    products, levels = Products(problem, linear.terms, linear.e, linear.J), linear.levels
    off = linear.off

    def negative(levels: Levels) -> float:
        prior = log_levels(problem, levels)
        if not np.isfinite(prior):
            return 1e300
        return -solve(products.total(levels.noise), spreads(linear.entries, levels), off)[1] - prior

    for _ in range(2):
        for unknown in problem.model.unknown:
            levels = _best_size(levels, unknown.name, negative)
        for name in linear.e:
            levels = _best_noise(levels, name, negative)
    return levels


def _best_size(levels: Levels, name: str, negative: Callable[[Levels], float]) -> Levels:
    def at(log: float) -> Levels:
        return replace(levels, sizes={**levels.sizes, name: float(np.exp(log))})

    found = minimize_scalar(
        lambda log: negative(at(log)), bounds=SIZE_RANGE, method="bounded", options={"xatol": 0.05}
    )
    return at(float(found.x))


def _best_noise(levels: Levels, name: str, negative: Callable[[Levels], float]) -> Levels:
    before = levels.noise[name]

    def at(log: np.ndarray) -> Levels:
        white, slow, time = (np.array([before.white, before.slow, before.time]) * np.exp(log)).tolist()
        return replace(levels, noise={**levels.noise, name: Noise(white, slow, time)})

    start = np.vstack([np.zeros(3), np.diag([0.3, -0.5, 0.7])])
    found = minimize(
        lambda log: negative(at(log)),
        np.zeros(3),
        method="Nelder-Mead",
        options={"initial_simplex": start, "maxfev": 60, "xatol": 0.02, "fatol": ENOUGH},
    )
    return at(found.x) if found.fun <= negative(levels) else levels


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted explanation.

    Attributes:
        terms: the explanation.
        linear: the problem, linearised at the maximum.
        log_evidence: of Laplace.
        variance: posterior variance of every entry (n,).
    """

    terms: Terms
    linear: Linear
    log_evidence: float
    variance: np.ndarray = field(repr=False)

    @property
    def x(self) -> np.ndarray:
        """All numbers at the maximum (n,)."""
        return self.linear.x

    @property
    def entries(self) -> Sequence[Entry]:
        """What they are."""
        return self.linear.entries

    @property
    def values(self) -> dict[Entry, float]:
        """Entry → its value at the maximum: where another fit may begin."""
        return dict(zip(self.entries, self.x.tolist(), strict=True))


def fit(problem: Problem, terms: Terms, start: Mapping[Entry, float], levels: Levels) -> Fit:
    """Return the fit of an explanation.

    Args:
        problem: records and model.
        terms: the explanation.
        start: where it begins, of entries that are known there; others begin at the means of their priors.
        levels: noise and sizes at the beginning.
    """
    entries = problem.entries(terms)
    known = {entry.identity: value for entry, value in start.items()}
    x = np.array([known.get(entry.identity, entry.centre) for entry in entries])
    x = np.clip(x, *bounds(entries))
    linear = _approached(problem, linearised(problem, terms, entries, x, levels))
    best, score, lasting = linear, -np.inf, 0
    for _ in range(ROUNDS):
        linear = replace(linear, levels=fitted_levels(problem, linear))
        moved = _stepped(problem, linear)
        linear = linearised(problem, terms, entries, moved.x, moved.levels)
        now = _laplace(problem, linear)[0]
        lasting = 0 if now > score + ENOUGH else lasting + 1
        if now > score:
            best, score = linear, now
        if lasting == PATIENCE:
            break
    return _finished(problem, best)


def free_fit(problem: Problem, terms: Terms, start: Mapping[Entry, float]) -> Fit:
    """Return the fit of an explanation in free simulation: unknown inputs are 0, and the residual is the noise.

    It says how well an explanation predicts, where `fit` says how probable it is.
    """
    fixed = {entry.identity: 0.0 for entry in problem.entries(()) if entry.kind == "unknown"}
    free = problem.with_fixed(fixed)
    entries = free.entries(terms)
    known = {entry.identity: value for entry, value in start.items() if entry.kind != "unknown"}
    x = np.clip(np.array([known.get(entry.identity, entry.centre) for entry in entries]), *bounds(entries))
    linear = linearised(free, terms, entries, x, usual_levels(free))
    for _ in range(ROUNDS):
        before = _left(free, linear)
        noise = {
            name: replace(each, white=max(each.white, before[name]))
            for name, each in linear.levels.noise.items()
        }
        there = _stepped(free, replace(linear, levels=Levels(noise, linear.levels.sizes)))
        linear = linearised(free, terms, entries, there.x, linear.levels)
        now = _left(free, linear)
        if all(now[name] > (1.0 - APPROACHING) * before[name] for name in before):
            break
    return _finished(free, linear)


def _left(problem: Problem, linear: Linear) -> dict[str, float]:
    """Return channel → root mean square of the residual."""
    return {
        name: float(np.sqrt(np.mean(e[problem.used(name, linear.terms)] ** 2)))
        for name, e in linear.e.items()
    }


def _approached(problem: Problem, linear: Linear) -> Linear:
    """Return a problem linearised nearer to the records, where it is far from them.

    The noise is taken to be a share of the residual, so that a step remains where the linear problem holds; it shrinks
    with the residual (graduated optimisation).
    """
    for _ in range(ROUNDS):
        left = _left(problem, linear)
        tempered = {
            name: replace(each, white=max(each.white, TEMPER * left[name]))
            for name, each in linear.levels.noise.items()
        }
        if tempered == linear.levels.noise:
            return linear
        there = _stepped(problem, replace(linear, levels=Levels(tempered, linear.levels.sizes)))
        moved = linearised(problem, linear.terms, linear.entries, there.x, linear.levels)
        now = _left(problem, moved)
        if all(now[name] > (1.0 - APPROACHING) * left[name] for name in left):
            return linear if sum(now.values()) > sum(left.values()) else moved
        linear = moved
    return linear


def linearised(
    problem: Problem,
    terms: Terms,
    entries: Sequence[Entry],
    x: np.ndarray,
    levels: Levels,
    *,
    must: bool = False,
) -> Linear:
    """Return an explanation linearised at x (n,), which can be simulated; `must` as of `Problem.jacobian`."""
    e, _ = problem.residuals(terms, entries, [x], must=True)
    J = problem.jacobian(terms, entries, x, must=must)
    return Linear(terms, entries, x, {name: column[:, 0] for name, column in e.items()}, J, levels)


def _stepped(problem: Problem, linear: Linear) -> Linear:
    """Return the problem after Gauss-Newton steps with the sensitivities as they are, each shortened until it gains."""
    at, low_high = linear, bounds(linear.entries)
    cost = _negative_log_posterior(problem, at)
    for _ in range(STEPS):
        step = at.evidence(problem)[0]
        sets = [np.clip(at.x + share * step, *low_high) for share in (1.0, 0.5, 0.2, 0.05)]
        taken = None
        for x in sets:
            e, valid = problem.residuals(at.terms, at.entries, [x])
            if not valid[0]:
                continue
            there = replace(at, x=x, e={name: column[:, 0] for name, column in e.items()})
            new = _negative_log_posterior(problem, there)
            if new < cost:
                taken = (there, new)
                break
        if taken is None:
            return at
        gained, (at, cost) = cost - taken[1], taken
        if gained < ENOUGH:
            return at
    return at


def _negative_log_posterior(problem: Problem, linear: Linear) -> float:
    """Return −log of the posterior density at a point, up to constants."""
    total = -problem.log_jacobian(linear.terms)
    for name, e in linear.e.items():
        each = problem.channels[name]
        for _, times, columns in _blocks(problem, name, linear.terms, np.empty((e.size, 0)), e):
            filtered = Filter.of(linear.levels.noise[name], each.prior.resolution, times)
            total += 0.5 * float(np.sum(filtered.whiten(columns) ** 2))
    return total + 0.5 * float(np.sum((linear.off / spreads(linear.entries, linear.levels)) ** 2))


def _laplace(problem: Problem, linear: Linear) -> tuple[float, np.ndarray]:
    """Return the log evidence of Laplace at a point that is a maximum, and the posterior variances (n,)."""
    products = Products(problem, linear.terms, linear.e, linear.J).total(linear.levels.noise)
    sd = spreads(linear.entries, linear.levels)
    factor = solve(products, sd, linear.off)[2]
    log_det = float(np.sum(np.log(np.diag(factor[0]))))
    evidence = (
        -_negative_log_posterior(problem, linear) - log_det - products[3] + log_levels(problem, linear.levels)
    )
    return evidence, sd**2 * np.diag(cho_solve(factor, np.eye(sd.size)))


def _finished(problem: Problem, linear: Linear) -> Fit:
    """Return a fit with its evidence, at the point where it is linearised."""
    return Fit(linear.terms, linear, *_laplace(problem, linear))
