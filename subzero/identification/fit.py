"""The fit of an explanation, and its evidence.

    e(θ) = e₀ − J (θ − θ₀),   θ ~ N(c, D),   e ~ N(0, Σ)
    log p = −½ eᵀ Σ⁻¹ e − ½ log|2πΣ| − ½ (θ̂ − c)ᵀ D⁻¹ (θ̂ − c) − ½ log|I + D^½ Jᵀ Σ⁻¹ J D^½| + log prior(Σ, D)

Laplace's approximation at the maximum θ̂ of the posterior, found by Gauss-Newton steps with real simulations. Levels of
the noise, and sizes of unknown inputs, maximise the same evidence of the linear problem (empirical Bayes); a declared
level binds them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import minimize_scalar

from subzero.identification.explanation import Entry, Terms
from subzero.identification.noise import Filter, Noise, log_times, most_probable, visible
from subzero.identification.problem import Problem

SIZE_SPREAD = 1.0
"""Standard deviation of the logarithm of an unknown input's size about the declared one. [-]"""
SHARES = (1.0, 0.5, 0.2, 0.05)
"""A step is shortened to these, until it gains. [-]"""
ROUNDS, STEPS = 20, 3
"""Sensitivities are computed at most so often; Gauss-Newton steps with each."""
PATIENCE = 2
"""Rounds without a gain that end a fit: the evidence of a linear problem falls now and then on the way."""
SLOPE_ERROR = 0.02
"""Sensitivities that miss no larger share of a change still hold. [-]"""
TEMPER, APPROACHING = 0.3, 0.03
"""Noise on the way from afar, over the residual; a smaller share gained of every channel ends it. [-]"""
ENOUGH = 0.05
"""A step that gains less log posterior ends them. [nats]"""
SIZE_RANGE = (-5.0, 6.0)
"""Sizes of unknown inputs that are looked at, as logarithms of their ratio to the declared one. [-]"""
NO_SIZES: Mapping[str, float] = MappingProxyType({})
"""Unknown inputs have their declared sizes."""


@dataclass(frozen=True)
class Levels:
    """What a fit takes as known while it moves θ: noise of the channels, sizes of the unknown inputs over the
    declared ones.
    """

    noise: Mapping[str, Noise]
    sizes: Mapping[str, float]


def usual_levels(problem: Problem, terms: Terms) -> Levels:
    """Return the levels of an explanation before any fit."""
    return Levels(
        {name: problem.prior(name, terms).usual() for name in problem.channels},
        {unknown.name: 1.0 for unknown in problem.model.unknown},
    )


def quieter(problem: Problem, terms: Terms, levels: Levels) -> Levels:
    """Return levels with no more noise than usual."""
    usual = usual_levels(problem, terms).noise
    noise = {
        name: replace(each, white=min(each.white, usual[name].white), slow=min(each.slow, usual[name].slow))
        for name, each in levels.noise.items()
    }
    return replace(levels, noise=noise)


def levels_under(problem: Problem, terms: Terms, linear: Linear) -> Levels:
    """Return the levels of a point for another explanation, which may undo other units; rounding is no part of them."""
    noise = {
        name: replace(each, white=each.white * ratio, slow=each.slow * ratio)
        for name, each in linear.levels.noise.items()
        for ratio in [problem.prior(name, terms).level / problem.prior(name, linear.terms).level]
    }
    return replace(linear.levels, noise=noise)


class Products:
    """Jᵀ Σ⁻¹ J, Jᵀ Σ⁻¹ e, eᵀ Σ⁻¹ e and ½ log|2πΣ| of channels, at one point: sums over channels.

    A channel's products are computed anew only where its noise changes.
    """

    def __init__(
        self, problem: Problem, terms: Terms, e: Mapping[str, np.ndarray], J: Mapping[str, np.ndarray]
    ) -> None:
        self._parts: dict[tuple[str, Noise], tuple[np.ndarray, float]] = {}
        self._resolutions = {name: problem.prior(name, terms).resolution for name in e}
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
    products: tuple[np.ndarray, np.ndarray, float, float],
    entries: Sequence[Entry],
    levels: Levels,
    off: np.ndarray,
) -> tuple[np.ndarray, float, np.ndarray]:
    """Return the step (n,) to the maximum of a linear problem's posterior within bounds, its log evidence, and the
    factor of H = I + D^½ A D^½.

    Args:
        products: of the point.
        entries: its free numbers.
        levels: sizes of unknown inputs.
        off: θ − c at the point (n,).
    """
    A, b, ee, log_scale = products
    sd = spreads(entries, levels)
    # θ = c + √D z: e + J off is the residual with all numbers at the means of their priors.
    whole = b + A @ off
    square = ee + 2.0 * float(off @ b) + float(off @ A @ off)
    H = sd[:, None] * A * sd
    H.ravel()[:: sd.size + 1] += 1.0 + sd.size * np.finfo(float).eps * np.trace(H)
    factor = cho_factor(H, lower=True)
    z = _within(H, sd * whole, cho_solve(factor, sd * whole), entries, sd)
    log_det = float(np.sum(np.log(np.diag(factor[0]))))
    evidence = -0.5 * (square - 2.0 * float(z @ (sd * whole)) + float(z @ H @ z)) - log_det - log_scale
    return sd * z - off, evidence, factor


def _within(
    H: np.ndarray, g: np.ndarray, z: np.ndarray, entries: Sequence[Entry], sd: np.ndarray
) -> np.ndarray:
    """Return the minimum of ½ zᵀHz − gᵀz within bounds, from that without: what leaves them is held there, and the rest
    follows.
    """
    centre = np.array([entry.centre for entry in entries])
    low, high = ((bound - centre) / sd for bound in bounds(entries))
    held = np.zeros(sd.size, dtype=bool)
    while (beyond := ~held & ((z < low) | (z > high))).any():
        held |= beyond
        z = np.clip(z, low, high)
        free = ~held
        if free.any():
            rest = g[free] - H[np.ix_(free, held)] @ z[held]
            z[free] = np.linalg.solve(H[np.ix_(free, free)], rest)
    return z


def log_levels(problem: Problem, terms: Terms, levels: Levels) -> float:
    """Return the log prior density of noise and sizes, up to a constant."""
    noise = sum(problem.prior(name, terms).log_density(each) for name, each in levels.noise.items())
    sizes = sum(
        -0.5 * (np.log(levels.sizes[unknown.name]) / SIZE_SPREAD) ** 2 for unknown in problem.unknown(terms)
    )
    return float(noise + sizes) + _log_times(problem, levels)


def _log_times(problem: Problem, levels: Levels) -> float:
    """Return the log prior density of the correlation times of all channels, logger by logger."""
    return sum(
        log_times(
            [levels.noise[name] for name in own], [problem.channels[name].prior.interval for name in own]
        )
        for own in _loggers(problem, levels).values()
    )


def _loggers(problem: Problem, levels: Levels) -> dict[str, list[str]]:
    """Return logger → its channels."""
    found: dict[str, list[str]] = {}
    for name in levels.noise:
        found.setdefault(problem.model.channels[name].logger, []).append(name)
    return found


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
        step, evidence, factor = solve(products, self.entries, self.levels, self.off)
        more = problem.log_jacobian(self.terms, self.e) + log_levels(problem, self.terms, self.levels)
        return step, evidence + more, factor


def bounds(entries: Sequence[Entry]) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of entries, (n,) each."""
    return np.array([entry.low for entry in entries]), np.array([entry.high for entry in entries])


def fitted_levels(problem: Problem, linear: Linear) -> Levels:
    """Return the noise and the sizes that have the highest evidence in a linear problem, one after the other."""
    products, levels = Products(problem, linear.terms, linear.e, linear.J), linear.levels
    for unknown in problem.unknown(linear.terms):
        levels = _best_size(problem, linear, products, levels, unknown.name)
    for name in linear.e:
        levels = _best_noise(problem, linear, products, levels, name)
    return levels


def _best_size(problem: Problem, linear: Linear, products: Products, levels: Levels, name: str) -> Levels:
    total, off = products.total(levels.noise), linear.off

    def at(log: float) -> Levels:
        return replace(levels, sizes={**levels.sizes, name: float(np.exp(log))})

    def negative(log: float) -> float:
        there = at(log)
        return -solve(total, linear.entries, there, off)[1] - log_levels(problem, linear.terms, there)

    with np.errstate(invalid="ignore"):  # sizes at which nothing can be solved have no evidence: ∞ − ∞
        found = minimize_scalar(negative, bounds=SIZE_RANGE, method="bounded", options={"xatol": 0.05})
    return at(float(found.x))


def _best_noise(problem: Problem, linear: Linear, products: Products, levels: Levels, name: str) -> Levels:
    """Return levels with the noise of a channel that has the highest evidence, given those of all others."""
    prior, (times, columns) = (
        problem.prior(name, linear.terms),
        given_others(problem, linear, products, levels, name),
    )

    own = _loggers(problem, levels)[problem.model.channels[name].logger]
    intervals = [problem.channels[each].prior.interval for each in own]

    def log_more(noise: Noise) -> float:
        return log_times([noise if each == name else levels.noise[each] for each in own], intervals)

    best = most_probable(levels.noise[name], prior, times, columns, log_more)
    return replace(levels, noise={**levels.noise, name: best})


def given_others(
    problem: Problem, linear: Linear, products: Products, levels: Levels, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the times of a channel's readings (m,), and [K e₀] (m, r + 1): given all other channels its residual is
    e₀ − K w with w ~ N(0, I), whatever its own noise. Directions that move no reading visibly are left out.
    """
    others = {other: noise for other, noise in levels.noise.items() if other != name and other in linear.e}
    sd, used = spreads(linear.entries, levels), problem.used(name, linear.terms)
    J, e = linear.J[name][used], linear.e[name][used]
    if others:
        A, b, *_ = products.total(others)
    else:
        A, b = np.zeros((sd.size, sd.size)), np.zeros(sd.size)
    H = sd[:, None] * A * sd + np.eye(sd.size)
    factor = np.linalg.cholesky(H)
    z = cho_solve((factor, True), sd * (b + A @ linear.off))
    K = solve_triangular(factor, (J * sd).T, lower=True).T
    e0 = e + J @ (linear.off - sd * z)
    K = visible(K, problem.levels(linear.terms)[name])
    return problem.channels[name].time[used], np.column_stack([K, e0])


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


def fit(problem: Problem, start: Linear, least: float = -np.inf) -> Fit:
    """Return the fit of an explanation from where it is linearised; sensitivities are computed anew where those of the
    start do not hold.

    Args:
        problem: records and model.
        start: the explanation.
        least: log evidence; a fit ends where the linear problem predicts less.
    """
    linear, origin = _approached(problem, start)
    best, score, lasting = linear, -np.inf, 0
    for _ in range(ROUNDS):
        linear = replace(linear, levels=fitted_levels(problem, linear))
        if linear.evidence(problem)[1] < least:
            best = linear if score == -np.inf else best
            break
        linear = stepped(problem, linear)
        if not _is_linear(problem, origin, linear):
            linear = origin = linearised(problem, linear.terms, linear.entries, linear.x, linear.levels)
        now = _laplace(problem, linear)[0]
        lasting = 0 if now > score + ENOUGH else lasting + 1
        if now > score:
            best, score = linear, now
        if lasting == PATIENCE:
            break
    return _finished(problem, best)


def starting_point(problem: Problem, terms: Terms, start: Mapping[Entry, float]) -> Linear | None:
    """Return an explanation linearised where some of its numbers are known, all others at the means of their priors,
    with usual noise; None if it cannot be simulated there.
    """
    entries = problem.entries(terms)
    known = {entry.identity: value for entry, value in start.items()}
    x = np.array([known.get(entry.identity, entry.centre) for entry in entries])
    x = np.clip(x, *bounds(entries))
    if not problem.residuals(terms, entries, [x])[1][0]:
        return None
    return linearised(problem, terms, entries, x, usual_levels(problem, terms))


def _is_linear(problem: Problem, origin: Linear, there: Linear) -> bool:
    """Return whether sensitivities of one point still hold at another: what they miss of the change of the residuals is
    little, or a small share of it.
    """
    moved = missed = 0.0
    for name, e in there.e.items():
        change = origin.J[name] @ (there.x - origin.x)
        left = origin.e[name] - change - e
        for _, times, both in _blocks(problem, name, there.terms, change[:, None], left):
            resolution = problem.prior(name, there.terms).resolution
            filtered = Filter.of(there.levels.noise[name], resolution, times)
            squares = np.sum(filtered.whiten(both) ** 2, axis=0)
            moved, missed = moved + float(np.sum(squares[:-1])), missed + float(squares[-1])
    return missed < max(2.0 * ENOUGH, SLOPE_ERROR**2 * moved)


def free_fit(
    problem: Problem, terms: Terms, start: Mapping[Entry, float], sizes: Mapping[str, float] = NO_SIZES
) -> Fit:
    """Return the fit of an explanation in free simulation: unknown inputs that no term names are 0, and the residual is
    the noise.

    It says how well an explanation predicts, where `fit` says how probable it is.

    Args:
        problem: of the explanation.
        terms: of the explanation.
        start: values of its numbers.
        sizes: of unknown inputs, over the declared ones; these if not given. [-]
    """
    fixed = {entry.identity: 0.0 for entry in problem.entries(()) if entry.kind == "unknown"}
    free = problem.with_fixed(fixed)
    entries = free.entries(terms)
    known = {entry.identity: value for entry, value in start.items() if entry.identity not in fixed}
    x = np.clip(np.array([known.get(entry.identity, entry.centre) for entry in entries]), *bounds(entries))
    usual = usual_levels(free, terms)
    levels = replace(usual, sizes={**usual.sizes, **sizes})
    linear = origin = linearised(free, terms, entries, x, levels)
    for _ in range(ROUNDS):
        before = _left(free, linear)
        noise = {
            name: replace(each, white=max(each.white, before[name]))
            for name, each in linear.levels.noise.items()
        }
        there = stepped(free, replace(linear, levels=Levels(noise, linear.levels.sizes)))
        linear = replace(there, levels=linear.levels)
        if not _is_linear(free, origin, there):
            linear = origin = linearised(free, terms, entries, there.x, linear.levels)
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


def _approached(problem: Problem, linear: Linear) -> tuple[Linear, Linear]:
    """Return a problem nearer to the records, where it is far from them, and where its sensitivities are those of.

    The noise is taken to be a share of the residual, so that a step remains where the linear problem holds; it shrinks
    with the residual (graduated optimisation).
    """
    origin = linear
    for _ in range(ROUNDS):
        left, levels = _left(problem, linear), tempered(problem, linear)
        if levels == linear.levels:
            break
        there = stepped(problem, replace(linear, levels=levels))
        now = _left(problem, there)
        ends = all(now[name] > (1.0 - APPROACHING) * left[name] for name in left)
        if ends and sum(now.values()) > sum(left.values()):
            break
        linear = replace(there, levels=linear.levels)
        if not _is_linear(problem, origin, there):
            linear = origin = linearised(problem, linear.terms, linear.entries, linear.x, linear.levels)
        if ends:
            break
    return linear, origin


def tempered(problem: Problem, linear: Linear) -> Levels:
    """Return the levels of a point with as much noise as suits a linear problem there: a share of the residual."""
    left = _left(problem, linear)
    noise = {
        name: replace(each, white=max(each.white, TEMPER * left[name]))
        for name, each in linear.levels.noise.items()
    }
    return replace(linear.levels, noise=noise)


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


def stepped(problem: Problem, linear: Linear) -> Linear:
    """Return the problem after Gauss-Newton steps, each shortened until it gains; sensitivities learn from each."""
    at, low_high = linear, bounds(linear.entries)
    cost = _negative_log_posterior(problem, at)
    for _ in range(STEPS):
        step = at.evidence(problem)[0]
        sets = [np.clip(at.x + share * step, *low_high) for share in SHARES]
        costs = ((there, _negative_log_posterior(problem, there)) for there in _moved(problem, at, sets))
        taken = next(((there, new) for there, new in costs if new < cost), None)
        if taken is None:
            return at
        gained, at, cost = cost - taken[1], with_secant(at, taken[0]), taken[1]
        if gained < ENOUGH:
            return at
    return at


def with_secant(linear: Linear, there: Linear) -> Linear:
    """Return a problem at another point, with sensitivities that explain the change of the residuals on the way there,
    and are otherwise unchanged (Broyden 1965): J + (−Δe − J s) (D⁻¹ s)ᵀ/(sᵀ D⁻¹ s), s in prior deviations.
    """
    step = there.x - linear.x
    weighted = step / spreads(linear.entries, linear.levels) ** 2
    if not (size := float(step @ weighted)) > 0.0:
        return there
    J = {
        name: J + np.outer(linear.e[name] - there.e[name] - J @ step, weighted / size)
        for name, J in linear.J.items()
    }
    return replace(there, J=J)


def _moved(problem: Problem, linear: Linear, sets: Sequence[np.ndarray]) -> Iterator[Linear]:
    """Yield a problem at other points that can be simulated; simulated together where the model takes many sets."""
    for some in [sets] if problem.model.batch else [[x] for x in sets]:
        e, valid = problem.residuals(linear.terms, linear.entries, some)
        for j in np.flatnonzero(valid).tolist():
            yield replace(linear, x=some[j], e={name: columns[:, j] for name, columns in e.items()})


def _negative_log_posterior(problem: Problem, linear: Linear) -> float:
    """Return −log of the posterior density at a point, up to constants."""
    total = -problem.log_jacobian(linear.terms, linear.e)
    for name, e in linear.e.items():
        resolution = problem.prior(name, linear.terms).resolution
        for _, times, columns in _blocks(problem, name, linear.terms, np.empty((e.size, 0)), e):
            filtered = Filter.of(linear.levels.noise[name], resolution, times)
            with np.errstate(over="ignore"):  # a simulation that grows beyond all bounds has no probability
                total += 0.5 * float(np.sum(filtered.whiten(columns) ** 2))
    return total + 0.5 * float(np.sum((linear.off / spreads(linear.entries, linear.levels)) ** 2))


def _laplace(problem: Problem, linear: Linear) -> tuple[float, np.ndarray]:
    """Return the log evidence of Laplace at a point that is a maximum, and the posterior variances (n,)."""
    products = Products(problem, linear.terms, linear.e, linear.J).total(linear.levels.noise)
    sd = spreads(linear.entries, linear.levels)
    factor = solve(products, linear.entries, linear.levels, linear.off)[2]
    log_det = float(np.sum(np.log(np.diag(factor[0]))))
    evidence = (
        -_negative_log_posterior(problem, linear)
        - log_det
        - products[3]
        + log_levels(problem, linear.terms, linear.levels)
    )
    return evidence, sd**2 * np.diag(cho_solve(factor, np.eye(sd.size)))


def _finished(problem: Problem, linear: Linear) -> Fit:
    """Return a fit with its evidence, at the point where it is linearised."""
    return Fit(linear.terms, linear, *_laplace(problem, linear))
