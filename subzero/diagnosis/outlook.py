"""What a trial that has not been flown would show of hypotheses that the records at hand cannot tell apart.

    y = h(z_a) + J (z − z_a) + e,   z ~ N(z_a, M_a) of the records at hand,   e ~ N(0, I)
    D(a|b) = dᵀ (I + J M_b Jᵀ)⁻¹ d,   d = h(z_a) − h(z_b)

h(z_a) and h(z_b) are real runs; J is made once for a trial. Only the directions in which hypotheses and tolerances move
the data matter; noise in all others says nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from subzero.diagnosis.effects import START
from subzero.diagnosis.effects.sensors import NOISE
from subzero.diagnosis.entries import entries_of
from subzero.diagnosis.evidence import posterior
from subzero.diagnosis.noise_estimate import Usual, usual_noise
from subzero.diagnosis.problem import Observed, Problem
from subzero.diagnosis.refit import Fit
from subzero.diagnosis.response import economical
from subzero.diagnosis.setting import Setting


class Survivor(Protocol):
    """A hypothesis with its fit, such as `candidate.Candidate`."""

    @property
    def ids(self) -> tuple[str, ...]:
        """Its causes."""

    @property
    def fit(self) -> Fit:
        """Its best fit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Belief:
    """What the records at hand say: of a trial to come, with its own start.

    Attributes:
        z: deviations (k,).
        M: their covariance (k, k).
    """

    z: np.ndarray
    M: np.ndarray


def beliefs(problem: Problem, survivors: Sequence[Survivor]) -> list[Belief]:
    """Return what each hypothesis says of all that trials share, and of the start of a new one."""
    shared = [k for k, entry in enumerate(problem.entries) if entry.record < 0]
    start = np.array([one.tolerance**2 for effect in START for one in effect.parameters])
    found = []
    for one in survivors:
        M = posterior(one.fit.quadratic, one.fit.D).M[np.ix_(shared, shared)]
        whole = np.zeros((len(shared) + start.size,) * 2)
        whole[: len(shared), : len(shared)] = M
        whole[range(len(shared), len(whole)), range(len(shared), len(whole))] = start
        found.append(Belief(z=np.concatenate([one.fit.z[shared], np.zeros(start.size)]), M=whole))
    return found


def to_come(problem: Problem, setting: Setting, channels: Sequence[str] = ()) -> Problem:
    """Return the problem of a trial to come, logged as the first record is, with further channels."""
    first = problem.records[0]
    step = float(np.median(np.diff(first.time)))
    setting = economical(setting, setting.trial.duration)
    time = np.arange(step, setting.trial.duration + 1e-9, step)
    used = np.ones(time.size, bool)
    noise = {name: replace(one, used=used, time=time) for name, one in first.noise.items()}
    noise |= {name: usual_noise(time, used, Usual(NOISE[name], 0.0, is_known=False)) for name in channels}
    seen = Observed(name="to come", time=time, values={name: np.zeros(time.size) for name in noise}, noise=noise,
                    setting=setting)  # fmt: skip
    effects = list(dict.fromkeys(entry.effect for entry in problem.entries if entry.record < 0))
    return replace(problem, records=(seen,), entries=entries_of(effects, START, 1))


@dataclass(frozen=True, kw_only=True, eq=False)
class Outlook:
    """What a trial to come would show, in the directions that matter.

    Attributes:
        shown: h(z) of each hypothesis (hypotheses, q).
        J: sensitivities (q, k).
        beliefs: of each hypothesis.
    """

    shown: np.ndarray
    J: np.ndarray
    beliefs: Sequence[Belief]

    def covariance(self, b: int) -> np.ndarray:
        """Return I + J M_b Jᵀ (q, q)."""
        return np.eye(self.J.shape[0]) + self.J @ self.beliefs[b].M @ self.J.T

    def discrimination(self) -> float:
        """Return the smallest D over all pairs, both ways."""
        pairs = [(a, b) for a in range(len(self.beliefs)) for b in range(len(self.beliefs)) if a != b]
        return min(self._between(a, b) for a, b in pairs)

    def _between(self, a: int, b: int) -> float:
        d = self.shown[a] - self.shown[b]
        return float(d @ np.linalg.solve(self.covariance(b), d))

    def decides(self, prior: np.ndarray, *, seed: int, draws: int = 500, enough: float = 0.95) -> float:
        """Return the probability that one hypothesis, the true one, ends up with a probability of `enough`.

        Args:
            prior: probabilities of the hypotheses (hypotheses,).
            seed: of the draws.
            draws: how many.
            enough: to be decided.
        """
        random, q = np.random.default_rng(seed), self.J.shape[0]
        halves = [np.linalg.cholesky(self.covariance(b)) for b in range(prior.size)]
        true = random.choice(prior.size, size=draws, p=prior)
        noise = random.standard_normal((draws, q))
        data = np.stack([self.shown[a] + halves[a] @ e for a, e in zip(true, noise, strict=True)])
        log = np.stack(
            [np.log(prior[b]) + _log_normal(data - self.shown[b], halves[b]) for b in range(prior.size)],
            axis=1,
        )
        odds = np.exp(log - log.max(axis=1, keepdims=True))
        final = odds / odds.sum(axis=1, keepdims=True)
        return float(np.mean(final[np.arange(draws), true] >= enough))


def _log_normal(d: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Return the log density (draws,) of rows under N(0, L Lᵀ), but for a constant."""
    white = np.linalg.solve(half, d.T)
    return -0.5 * np.sum(white**2, axis=0) - float(np.sum(np.log(np.diag(half))))


def outlook(shown: np.ndarray, J: np.ndarray, held: Sequence[Belief]) -> Outlook:
    """Return what h(z) (hypotheses, m) and J (m, k) show, in as few directions as there are.

    The directions are those of J and of the differences between hypotheses.
    """
    differences = (shown - shown[0]).T
    Q, _ = np.linalg.qr(np.hstack([J, differences[:, 1:]]))
    return Outlook(shown=differences.T @ Q, J=Q.T @ J, beliefs=held)
