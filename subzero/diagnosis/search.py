"""The search: from all hypotheses by linear evidence to a few by real fits.

all tolerances wide → a point close to the data → linear evidence of everything there → refits of what is left
→ a second cause beside the best, and a third → probabilities
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy.stats import norm

from subzero.diagnosis.evidence import KAPPAS, Posterior, Quadratic, freed, log_sum, posterior
from subzero.diagnosis.hypotheses import Ids, compatible, log_prior, named, places, variances
from subzero.diagnosis.pose import with_finer_steps, with_noise_behind
from subzero.diagnosis.problem import Problem, Progress
from subzero.diagnosis.refit import Fit, refit
from subzero.diagnosis.rules import large

WIDE = 4.0
"""κ of the fit that the linear evidence is made at."""
NOISE_ROUNDS = 2
"""How often the noise may be estimated again, behind the wide fit."""
KEEP, SINGLES, PAIRS = 12.0, 7, 4
"""Refit hypotheses whose log evidence is this close to the best of their kind, and at most so many."""
BENT, LEAST_BENT = 2, 10.0
"""So many causes that the wide fit bends by at least so many tolerances are fitted by themselves."""
MOST_HOPE = 300.0
"""A promise of old sensitivities counts up to this much."""
RACERS, HOPELESS = 6, 6.0
"""At most so many fits with sensitivities of their own in a race; none for what is this far behind in log posterior."""
FAR = 1.08
"""A wide fit that leaves a greater mean square, in noise, is not close to the records."""
NEAR = 4.0
"""Sensitivities hold as far as this from where they were made, in tolerances."""
MOST_RUNS = 800
"""No further race after so many runs."""
FURTHER = 20.0
"""A further cause has to make the records this many times as probable, prior and all (log-odds 3)."""
UNTRIED = 2.0
"""A hypothesis without a fit of its own is at least this far behind the best in log posterior."""
SWEEP = (0.25, 0.5, 1.0, 2.0)
"""Sizes, in effect scales, that effects without a slope at the nominal model are tried at."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A hypothesis with a real fit.

    Attributes:
        ids: its causes.
        fit: the best fit, under the most probable κ.
        log_evidence: κ → log evidence.
        log_posterior: log (evidence, mixed over κ, times prior).
    """

    ids: Ids
    fit: Fit
    log_evidence: dict[float, float]
    log_posterior: float

    @property
    def hope(self) -> float:
        """The log posterior that a better fit might have."""
        return self.log_posterior + min(self.fit.promise, MOST_HOPE)

    @property
    def kappa(self) -> float:
        """The most probable scale of the tolerances."""
        return max(KAPPAS, key=lambda kappa: np.log(KAPPAS[kappa]) + self.log_evidence[kappa])


@dataclass(kw_only=True, eq=False)
class Search:
    """A search that goes on: what was found so far is always in `candidates`.

    Attributes:
        problem: records and parameters.
        progress: told what is being tried.
        wide: the fit with wide tolerances.
        screen: hypothesis → linear log posterior at the wide fit.
        candidates: hypothesis → its real fit.
        secants: hypothesis → where its fit begins, for causes without a slope.
        raced: hypotheses that were fitted with sensitivities of their own.
        beside: hypothesis → log posterior, estimated at the fit of one with a cause less.
        economical: the problem before what economical steps get wrong was taken from its records.
        sharp_at: the hypothesis at whose fit that was done.
    """

    problem: Problem
    progress: Progress
    wide: Fit = field(init=False)
    nominal: tuple[np.ndarray, np.ndarray] = field(init=False)
    screen: dict[Ids, float] = field(default_factory=dict)
    candidates: dict[Ids, Candidate] = field(default_factory=dict)
    secants: dict[Ids, np.ndarray] = field(default_factory=dict)
    raced: set[Ids] = field(default_factory=set)
    beside: dict[Ids, float] = field(default_factory=dict)
    economical: Problem = field(init=False)
    sharp_at: Ids | None = None

    def begin(self) -> None:
        """Make the sensitivities at the nominal model, and the fit with wide tolerances."""
        self.progress(0.05, "sensitivities of the nominal model")
        zero = np.zeros(len(self.problem.entries))
        self._from(zero, self.problem.jacobian(zero))
        for _ in range(NOISE_ROUNDS):
            again = with_noise_behind(self.problem, self.wide.z) if np.isfinite(self.wide.r).all() else None
            if again is None:
                break
            self.problem = again
            self._from(self.wide.z, self.problem.jacobian(zero))
        self.economical = self.problem

    def _from(self, z: np.ndarray, nominal: np.ndarray) -> None:
        """Make the fit with wide tolerances, from z; `nominal` are the sensitivities of the nominal model."""
        self.progress(0.15, "fit within wide tolerances")
        zero, D = np.zeros(z.size), variances(self.problem.entries, (), WIDE)
        self.nominal = (self.problem.residual(zero), nominal)
        J = self.problem.jacobian(z) if np.any(z != 0.0) else nominal
        self.wide = refit(self.problem, z, J, D, most_fresh=2, made_at=z)

    def look(self) -> None:
        """Fill the screen: linear evidence of nothing, every cause, and every pair."""
        ids = named(self.problem)
        q = self.wide.quadratic
        D = {kappa: variances(self.problem.entries, (), kappa) for kappa in KAPPAS}
        base = {kappa: posterior(q, D[kappa]) for kappa in KAPPAS}
        for hypothesis in [(), *((one,) for one in ids), *compatible(self.problem.entries, ids)]:
            self.screen[hypothesis] = self._linear(hypothesis, base, D) + log_prior(hypothesis, len(ids))
        self._sweep()

    def _linear(self, ids: Ids, base: dict[float, Posterior], D: dict[float, np.ndarray]) -> float:
        """Return the log evidence of a hypothesis in a linear problem, mixed over κ."""
        at = places(self.problem.entries, ids)
        found = []
        for kappa, prior in KAPPAS.items():
            if at:
                value, mean, covariance = freed(
                    base[kappa], D[kappa], at, variances(self.problem.entries, ids, kappa)[at]
                )
                value += self._inside(at, mean, np.sqrt(np.diag(covariance)))
            else:
                value = base[kappa].log_evidence
            found.append(np.log(prior) + value)
        return log_sum(found)

    def _inside(self, at: list[int], mean: np.ndarray, sd: np.ndarray, *, held: bool = False) -> float:
        """Return what is added to a log evidence because values below a bound at 0 are not possible; `held` if it was
        taken at the best values within bounds.
        """
        low = np.array([self.problem.entries[k].parameter.low for k in at])
        x = (mean / sd)[low == 0.0]
        return float(np.sum(norm.logcdf(x) + np.log(2.0) + (0.5 * np.minimum(x, 0.0) ** 2 if held else 0.0)))

    def _sweep(self) -> None:
        """Try sizes of the causes that do nothing when they are small."""
        zero, entries = np.zeros(len(self.problem.entries)), self.problem.entries
        z, J = (self.wide.z, self.wide.J) if self._is_close() else (zero, self.nominal[1])
        norms = np.linalg.norm(J, axis=0) * [entry.parameter.scale for entry in entries]
        for k, entry in enumerate(entries):
            if entry.record >= 0 or entry.parameter.low != 0.0 or norms[k] > 1.0:
                continue
            best = max(
                (self._secant(k, size * entry.parameter.scale, z, J) for size in SWEEP),
                key=lambda pair: pair[0],
            )
            ids = (entry.effect.id,)
            self.screen[ids] = best[0] + log_prior(ids, len(named(self.problem)))
            self.secants[ids] = best[1]

    def _is_close(self) -> bool:
        """Say whether the wide fit leaves nothing but noise."""
        return float(self.wide.r @ self.wide.r) < FAR * self.wide.r.size

    def _secant(self, k: int, size: float, z: np.ndarray, J: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the log evidence of entry k at a size, others within their tolerances about z; and where it is."""
        entry, moved = self.problem.entries[k], z.copy()
        moved[k] = size
        r = self.problem.residual(moved)
        if not np.isfinite(r).all():
            return -np.inf, moved
        found = []
        for kappa, prior in KAPPAS.items():
            D = variances(self.problem.entries, (), kappa)
            others = moved.copy()
            others[k] = 0.0
            q = Quadratic.at(others, r, J)
            value = posterior(q, D).log_evidence - 0.5 * (size / entry.parameter.scale) ** 2 - 1.0
            found.append(np.log(prior) + value)
        return log_sum(found), moved

    def refit_best(self) -> None:
        """Fit nothing, and the best causes and pairs of the screen, with real runs: all with the sensitivities at hand,
        then those that come out best with their own.
        """
        kinds = (((),), self._bent(), _best(self.screen, 1, SINGLES), _best(self.screen, 2, PAIRS))
        for ids in kinds[1]:
            self.progress(0.3, "fitting " + ids[0] + " by itself")
            self._alone(ids)
        for ids in (ids for kind in kinds for ids in kind):
            self.progress(0.3, "fitting " + (" + ".join(ids) or "nothing wrong"))
            self.fit(ids)
        self.race(2)
        self.sharpen()
        self.race()

    def _bent(self) -> list[Ids]:
        """Return the causes that the wide fit bends most: of a large effect the linear problem says little."""
        bent: dict[str, float] = {}
        for z, entry in zip(self.wide.z, self.problem.entries, strict=True):
            if entry.record < 0:
                size = abs(z) / entry.parameter.tolerance
                bent[entry.effect.id] = max(size, bent.get(entry.effect.id, 0.0))
        found: list[Ids] = [
            (one,) for one in sorted(bent, key=lambda one: -bent[one])[:BENT] if bent[one] > LEAST_BENT
        ]
        return found if self._is_close() else [*found, *(ids for ids in self.secants if ids not in found)]

    def _alone(self, ids: Ids) -> None:
        """Fit a cause from where the wide fit has it, all else nominal, with the sensitivities there."""
        z, at = np.zeros(len(self.problem.entries)), places(self.problem.entries, ids)
        z[at] = self.secants.get(ids, self.wide.z)[at]
        D = variances(self.problem.entries, ids, 1.0)
        self._keep(ids, refit(self.problem, z, self.problem.jacobian(z), D, most_fresh=2, made_at=z))

    def fit(self, ids: Ids, start: Fit | None = None) -> None:
        """Fit a hypothesis with real runs and the sensitivities of another fit, unless it was fitted."""
        if ids not in self.candidates:
            start = start or self.wide
            D, z = variances(self.problem.entries, ids, 1.0), self.secants.get(ids)
            z = posterior(start.quadratic, D).z if z is None else z
            self._keep(ids, refit(self.problem, z, start.J, D, most_fresh=0, made_at=start.made_at))

    def race(self, most: int = RACERS, hopeless: float = HOPELESS) -> None:
        """Fit candidates again with sensitivities of their own, the best first, until the next is hopeless."""
        for _ in range(most):
            self.raced |= {one.ids for one in self.candidates.values() if self._settled(one.fit)}
            waiting = [one for one in self.candidates.values() if one.ids not in self.raced]
            if not waiting or self.problem.runs[0] > MOST_RUNS:
                return
            now = max(waiting, key=lambda one: one.hope)
            done = [self.candidates[ids].log_posterior for ids in self.raced]
            if len(done) >= 2 and now.hope < max(done) - hopeless:
                return
            self.progress(0.5, "fitting again " + (" + ".join(now.ids) or "nothing wrong"))
            self._again(now)

    def _settled(self, fit: Fit) -> bool:
        """Say whether a fit has converged, close to where its sensitivities were made."""
        if not fit.converged or fit.made_at is None:
            return False
        tolerance = np.array([entry.parameter.tolerance for entry in self.problem.entries])
        return bool(np.max(np.abs(fit.z - fit.made_at) / tolerance) < NEAR)

    def _again(self, one: Candidate) -> None:
        """Fit a candidate with sensitivities of its own, under its most probable κ."""
        self.raced.add(one.ids)
        D = variances(self.problem.entries, one.ids, one.kappa)
        J = self.problem.jacobian(one.fit.z)
        now = self._keep(
            one.ids, refit(self.problem, one.fit.z, J, D, r=one.fit.r, most_fresh=1, made_at=one.fit.z)
        )
        if now.kappa != one.kappa:
            D = variances(self.problem.entries, one.ids, now.kappa)
            self._keep(
                one.ids,
                refit(
                    self.problem, now.fit.z, now.fit.J, D, r=now.fit.r, most_fresh=0, made_at=now.fit.made_at
                ),
            )

    def _keep(self, ids: Ids, fit: Fit) -> Candidate:
        """Keep a fit and return its candidate."""
        self.candidates[ids] = self._candidate(ids, fit)
        return self.candidates[ids]

    def _candidate(self, ids: Ids, fit: Fit) -> Candidate:
        """Return a candidate with its evidence by Laplace's method around a fit, for every κ."""
        q, entries = fit.quadratic, self.problem.entries
        under = {kappa: variances(entries, ids, kappa) for kappa in KAPPAS}
        found = {kappa: posterior(q, under[kappa]) for kappa in KAPPAS}
        nearest = min(KAPPAS, key=lambda kappa: float(np.sum(np.abs(np.log(under[kappa] / fit.D)))))
        here = -fit.objective - found[nearest].log_evidence - 0.5 * found[nearest].log_det
        every = list(range(len(entries)))
        evidence = {
            kappa: one.log_evidence + here + self._inside(every, one.z, np.sqrt(np.diag(one.M)), held=True)
            for kappa, one in found.items()
        }
        mixed = log_sum([np.log(KAPPAS[kappa]) + evidence[kappa] for kappa in KAPPAS])
        prior = log_prior(ids, len(named(self.problem)))
        posterior_ = mixed + prior if np.isfinite(fit.objective) else -np.inf
        return Candidate(ids=ids, fit=fit, log_evidence=evidence, log_posterior=posterior_)

    def sharpen(self) -> None:
        """Take from the records what economical steps get wrong at the best fit, if that can be seen, and fit again."""
        best = self.best()
        if self.sharp_at == best.ids:
            return
        self.progress(0.6, "finer steps")
        sharper = with_finer_steps(self.economical, best.fit.z)
        self.sharp_at = best.ids
        if sharper is None:
            return
        self.problem = sharper
        least = best.log_posterior - HOPELESS
        self.candidates = {
            ids: one
            for ids, one in self.candidates.items()
            if one.log_posterior > least or set(ids) <= set(best.ids)
        }
        self.raced &= set(self.candidates)
        for ids, one in list(self.candidates.items()):
            self._keep(
                ids,
                refit(self.problem, one.fit.z, one.fit.J, one.fit.D, most_fresh=0, made_at=one.fit.made_at),
            )

    def best(self) -> Candidate:
        """Return the most probable candidate."""
        return max(self.candidates.values(), key=lambda candidate: candidate.log_posterior)

    def grow(self, most: int = 3, rounds: int = 4) -> None:
        """Look beside the best candidate for one more cause, and below it for one less, until the best stays."""
        looked: set[Ids] = set()
        for _ in range(rounds):
            best = self.best()
            if best.ids in looked:
                return
            looked.add(best.ids)
            self.progress(0.75, "a further cause beside " + (" + ".join(best.ids) or "nothing"))
            if len(best.ids) < most:
                for ids in self._beside(best):
                    self.fit(ids, best.fit)
            for without in best.ids:
                rest = tuple(one for one in best.ids if one != without)
                self._below(rest, best.fit)
                for ids in self._instead(best, rest):
                    self.fit(ids, best.fit)
            self.race(2, 2.0)

    def _below(self, ids: Ids, fit: Fit) -> None:
        """Fit a part of a hypothesis from its fit, if that is better than what is known of the part."""
        known = self.candidates.get(ids)
        kappa = known.kappa if known else 1.0
        D = variances(self.problem.entries, ids, kappa)
        found = refit(
            self.problem, posterior(fit.quadratic, D).z, fit.J, D, most_fresh=0, made_at=fit.made_at
        )
        if known is None or found.objective < known.fit.objective - 0.1:
            self._keep(ids, found)
            self.raced.discard(ids)

    def _instead(self, best: Candidate, rest: Ids, most: int = 3) -> list[Ids]:
        """Return the hypotheses with another cause beside the rest that the linear problem at a fit finds best."""
        q, found = best.fit.quadratic, {}
        for one in named(self.problem):
            ids = tuple(sorted({*rest, one}))
            if len(ids) > len(rest) and ids not in self.candidates:
                under = {kappa: variances(self.problem.entries, ids, kappa) for kappa in KAPPAS}
                found[ids] = log_sum([
                    np.log(prior) + posterior(q, under[kappa]).log_evidence for kappa, prior in KAPPAS.items()
                ])  # fmt: skip
        return sorted(found, key=lambda ids: -found[ids])[:most]

    def _beside(self, candidate: Candidate, most: int = 2, worth: float = -4.0) -> list[Ids]:
        """Return the hypotheses with one cause more that the linear problem at a fit finds best."""
        q, entries = candidate.fit.quadratic, self.problem.entries
        count, found = len(named(self.problem)), {}
        D = {kappa: variances(entries, candidate.ids, kappa) for kappa in KAPPAS}
        base = {kappa: posterior(q, D[kappa]) for kappa in KAPPAS}
        none = [np.log(prior) + base[kappa].log_evidence for kappa, prior in KAPPAS.items()]
        for one in named(self.problem):
            ids = tuple(sorted({*candidate.ids, one}))
            if len(ids) > len(candidate.ids) and ids not in self.candidates:
                at, parts = places(entries, (one,)), []
                for kappa, prior in KAPPAS.items():
                    own = variances(entries, ids, kappa)[at]
                    value, mean, covariance = freed(base[kappa], D[kappa], at, own)
                    parts.append(np.log(prior) + value + self._inside(at, mean, np.sqrt(np.diag(covariance))))
                gain = (
                    log_sum(parts) - log_sum(none) + log_prior(ids, count) - log_prior(candidate.ids, count)
                )
                found[ids] = self.beside[ids] = candidate.log_posterior + gain
        ranked = sorted(found, key=lambda ids: -found[ids])[:most]
        return [ids for ids in ranked if found[ids] > candidate.log_posterior + worth]

    def estimated(self, ids: Ids) -> float:
        """Return the log posterior of a hypothesis without a fit: of the best fit of a part of it, and what the linear
        problem there, or else the screen, says that the rest adds.
        """
        if ids in self.beside:
            return self.beside[ids]
        parts = [one for part in range(len(ids)) for one in combinations(ids, part) if one in self.candidates]
        part = max(parts, key=lambda one: self.candidates[one].log_posterior, default=())
        return self.candidates[part].log_posterior + self.screen[ids] - self.screen[part]

    def probabilities(self) -> dict[Ids, float]:
        """Return the probability of every hypothesis: by its fit, or by the screen if it was not worth one."""
        log, total = self.log_posteriors(), self.log_total()
        found = {ids: float(np.exp(value - total)) for ids, value in log.items()}
        return _folded(self._without_small(found))

    def _without_small(self, probabilities: dict[Ids, float]) -> dict[Ids, float]:
        """Return probabilities where causes of less than a practical size are not told beside others of more."""
        found = dict(probabilities)
        for ids, one in self.candidates.items():
            kept = large(self.problem.entries, ids, one.fit.z, one.kappa)
            if kept and kept != ids:
                found[kept] = found.get(kept, 0.0) + found.pop(ids)
        return found

    def log_posteriors(self) -> dict[Ids, float]:
        """Return the log posterior of every hypothesis, but for a common constant."""
        log = {ids: candidate.log_posterior for ids, candidate in self.candidates.items()}
        best = max(log.values())
        for ids in self.screen:
            log.setdefault(ids, min(self.estimated(ids), best - UNTRIED))
        return log

    def log_total(self) -> float:
        """Return the log of the sum of all posteriors."""
        return log_sum(list(self.log_posteriors().values()))


def _folded(probabilities: dict[Ids, float]) -> dict[Ids, float]:
    """Return probabilities, the most probable first, where a further cause that is not needed is not told: those of
    hypotheses that are not FURTHER times as probable as a part of them are that part's.
    """
    found = dict(probabilities)
    for ids in sorted(probabilities, key=len, reverse=True):
        if len(ids) > 1:
            part = max(combinations(ids, len(ids) - 1), key=lambda one: probabilities.get(one, 0.0))
            if probabilities.get(part, 0.0) * FURTHER > probabilities[ids]:
                found[part] += found.pop(ids)
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))


def _best(screen: dict[Ids, float], size: int, most: int) -> list[Ids]:
    """Return the best hypotheses of a size, close to the best of all of that size."""
    ranked = sorted((ids for ids in screen if len(ids) == size), key=lambda ids: -screen[ids])[:most]
    return [ids for ids in ranked if screen[ids] > screen[ranked[0]] - KEEP]
