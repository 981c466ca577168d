"""The trial that best separates explanations that the present records cannot: from a library, with a further channel,
or random.

    y = h(z_a) + J (z − z_a) + e,   z ~ N(z_a, M_a) of the present records,   e ~ N(0, I)
    D(a|b) = dᵀ (I + J M_b Jᵀ)⁻¹ d,   d = h(z_a) − h(z_b);   max over trials of min over pairs of D   (T-optimal)

h(z_a) and h(z_b) are simulations; J is computed once for a trial. Only the directions in which hypotheses and
tolerances move the data matter.

Every trial is simulated for every hypothesis; those with the largest distances also with sensitivities, in the order
of the library, until one surely decides (D ≥ AMPLE_DISCRIMINATION). If none does, further channels are tried; if none
decides at all (D < DECISIVE_DISCRIMINATION), command sequences are drawn at random, within the same limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from subzero.diagnosis.assessment.trial_library import (
    CHANNELS,
    LIBRARY,
    PLANE_AMPLITUDE,
    RUDDER_AMPLITUDE,
    Row,
    cruise,
    fastest,
    flown,
    rows_of,
)
from subzero.diagnosis.hypothesis.catalogue import START
from subzero.diagnosis.hypothesis.catalogue.sensors import NOISE
from subzero.diagnosis.hypothesis.hypotheses import entries_of
from subzero.diagnosis.hypothesis.noise import as_noise, prior_of
from subzero.diagnosis.inference.linear_gaussian import posterior
from subzero.diagnosis.inference.problem import Observed, Problem
from subzero.diagnosis.inference.simulator import economical
from subzero.diagnosis.results import NextTrial

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.inference.map_fit import Fit
    from subzero.diagnosis.inference.simulator import Track


class Survivor(Protocol):
    """A hypothesis with its fit, such as `map_fit.Candidate`."""

    @property
    def ids(self) -> tuple[str, ...]:
        """Its causes."""

    @property
    def fit(self) -> Fit:
        """Its best fit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Belief:
    """The posterior given the present records, for a trial to come with its own start.

    Attributes:
        z: deviations (k,).
        M: their covariance (k, k).
    """

    z: np.ndarray
    M: np.ndarray


def beliefs(problem: Problem, survivors: Sequence[Survivor]) -> list[Belief]:
    """Return the posterior of each hypothesis for all that trials share, and for the start of a new one."""
    shared = [k for k, entry in enumerate(problem.entries) if entry.record < 0]
    start = np.array([parameter.tolerance**2 for effect in START for parameter in effect.parameters])
    found = []
    for survivor in survivors:
        M = posterior(survivor.fit.quadratic, survivor.fit.D).M[np.ix_(shared, shared)]
        whole = np.zeros((len(shared) + start.size,) * 2)
        whole[: len(shared), : len(shared)] = M
        whole[range(len(shared), len(whole)), range(len(shared), len(whole))] = start
        found.append(Belief(z=np.concatenate([survivor.fit.z[shared], np.zeros(start.size)]), M=whole))
    return found


def prepared_trial(problem: Problem, setting: Setting, channels: Sequence[str] = ()) -> Problem:
    """Return the problem of a trial to come, logged as the first record is, with further channels."""
    first = problem.records[0]
    step = float(np.median(np.diff(first.time)))
    setting = economical(setting, setting.trial.duration)
    time = np.arange(step, setting.trial.duration + 1e-9, step)
    used = np.ones(time.size, bool)
    noise = {name: replace(each, used=used, time=time) for name, each in first.noise.items()}
    for name in channels:
        prior = prior_of(NOISE[name], 0.0, time, is_known=False)
        noise[name] = as_noise(prior.usual(), prior, time, used)
    seen = Observed(
        name="to come",
        time=time,
        values={name: np.zeros(time.size) for name in noise},
        noise=noise,
        setting=setting,
    )
    effects = list(dict.fromkeys(entry.effect for entry in problem.entries if entry.record < 0))
    return replace(problem, records=(seen,), entries=entries_of(effects, START, 1))


@dataclass(frozen=True, kw_only=True, eq=False)
class Outlook:
    """The prediction for a trial to come, in the directions that matter.

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
            enough: for a decision.
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
    """Return h(z) (hypotheses, m) and J (m, k) projected to as few directions as there are.

    The directions are those of J and of the differences between hypotheses.
    """
    differences = (shown - shown[0]).T
    Q, _ = np.linalg.qr(np.hstack([J, differences[:, 1:]]))
    return Outlook(shown=differences.T @ Q, J=Q.T @ J, beliefs=held)


DECISIVE_DISCRIMINATION = 16.0
"""D from which on a trial decides."""
AMPLE_DISCRIMINATION = 25.0
"""D above which a larger one is no advantage: the simpler trial is preferred."""
MAX_SIMULATED = 6
"""Most trials that are evaluated with sensitivities."""
MAX_OPTIMISER_RUNS = 40
"""Simulations of the random search for a trial."""
MIN_DEPTH_M, MAX_DEEPER_M = 0.2, 5.0
"""Least depth of a safe trial; most that it may sink below its start. [m]"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A trial that might be flown.

    Attributes:
        name, sentence: as of the library.
        setting: of the trial.
        channel: further channel, "" for none.
        discrimination: the smallest D.
        view: its prediction; None before sensitivities are computed.
    """

    name: str
    sentence: str
    setting: Setting
    channel: str = ""
    discrimination: float = 0.0
    view: Outlook | None = None


def next_trial(
    problem: Problem,
    survivors: Sequence[Survivor],
    *,
    probabilities: Sequence[float] | None = None,
    seed: int = 0,
) -> NextTrial | None:
    """Return the next trial to tell hypotheses apart; None if there are fewer than two.

    Args:
        problem: of the present records.
        survivors: hypotheses with their fits, of this problem.
        probabilities: of them; alike if None.
        seed: of the random draws.
    """
    if len(survivors) < 2:
        return None
    held = beliefs(problem, survivors)
    setting = problem.records[0].setting
    plans = [
        Plan(name=name, sentence=words, setting=make(setting)) for name, (words, make) in LIBRARY.items()
    ]
    found = _evaluated(problem, plans, held)
    if _most(found) < AMPLE_DISCRIMINATION:
        found += _with_channels(problem, setting, held)
    if _most(found) < DECISIVE_DISCRIMINATION:
        found += _evaluated(problem, _drawn(setting, len(held), seed), held, most=2)
    best = max(found, key=lambda plan: min(plan.discrimination, AMPLE_DISCRIMINATION), default=None)
    return None if best is None else _reported(best, _weights(probabilities, len(held)), seed)


def _most(plans: Sequence[Plan]) -> float:
    """Return the largest D of plans."""
    return max((plan.discrimination for plan in plans), default=0.0)


def _weights(probabilities: Sequence[float] | None, count: int) -> np.ndarray:
    weights = np.ones(count) if probabilities is None else np.maximum(np.asarray(probabilities, float), 1e-3)
    return weights / weights.sum()


def _reported(plan: Plan, prior: np.ndarray, seed: int) -> NextTrial:
    """Return a plan as it is reported."""
    assert plan.view is not None
    return NextTrial(
        name=plan.name.split()[0],
        sentence=plan.sentence,
        decides=plan.view.decides(prior, seed=seed),
        discrimination=plan.discrimination,
        channel=plan.channel,
        commands=rows_of(plan.setting),
    )


def _evaluated(
    problem: Problem, plans: Sequence[Plan], held: Sequence[Belief], most: int = MAX_SIMULATED
) -> list[Plan]:
    """Return the safe plans with the largest distances, in their order, up to the first that surely decides."""
    shown = {plan.name: _shown(prepared_trial(problem, plan.setting), held) for plan in plans}
    apart = {name: _apart(h) for name, h in shown.items() if h is not None}
    names = sorted(apart, key=lambda name: -apart[name])[:most]
    found: list[Plan] = []
    for plan in plans:
        if plan.name in names and _most(found) < AMPLE_DISCRIMINATION:
            h = shown[plan.name]
            assert h is not None
            found.append(_viewed(prepared_trial(problem, plan.setting), plan, h, held))
    return found


def _shown(coming: Problem, held: Sequence[Belief]) -> np.ndarray | None:
    """Return h(z) (hypotheses, m) of a trial; None if it leaves safe depths under some hypothesis."""
    tracks = coming.tracks([(0, each.z) for each in held])
    if not is_safe(coming, tracks):
        return None
    return np.stack(
        [
            coming.whitened(0, coming.setting(0, each.z), track)
            for each, track in zip(held, tracks, strict=True)
        ]
    )


def is_safe(coming: Problem, tracks: Sequence[Track]) -> bool:
    """Say whether a trial to come remains within safe depths on all of some tracks."""
    depths = np.stack([track[1][:, 2] for track in tracks])
    start = coming.records[0].setting.trial.start.depth
    return bool(
        np.isfinite(depths).all()
        and depths.min() >= min(MIN_DEPTH_M, start)
        and depths.max() <= start + MAX_DEEPER_M
    )


def _apart(shown: np.ndarray) -> float:
    """Return the smallest squared distance between any two hypotheses, tolerances aside."""
    count = range(len(shown))
    return min(float(np.sum((shown[a] - shown[b]) ** 2)) for a in count for b in count if a < b)


def _viewed(coming: Problem, plan: Plan, shown: np.ndarray, held: Sequence[Belief]) -> Plan:
    """Return a plan with its prediction."""
    view = outlook(shown, coming.jacobian(held[0].z), held)
    return Plan(
        name=plan.name,
        sentence=plan.sentence,
        setting=plan.setting,
        channel=plan.channel,
        discrimination=view.discrimination(),
        view=view,
    )


def _with_channels(problem: Problem, setting: Setting, held: Sequence[Belief]) -> list[Plan]:
    """Return the same trial again, with each further channel."""
    more = [name for name in CHANNELS if name not in problem.records[0].noise]
    coming = prepared_trial(problem, setting, more)
    shown = _shown(coming, held) if more else None
    if shown is None:
        return []
    J, found = coming.jacobian(held[0].z), []
    rows = np.repeat(np.array(list(coming.records[0].noise)), coming.records[0].time.size)
    for name in more:
        own = ~np.isin(rows, [other for other in more if other != name])
        view = outlook(shown[:, own], J[own], held)
        found.append(
            Plan(
                name="same",
                sentence="Fly the same trial again. " + CHANNELS[name],
                setting=setting,
                channel=name,
                discrimination=view.discrimination(),
                view=view,
            )
        )
    return found


def _drawn(setting: Setting, hypotheses: int, seed: int) -> list[Plan]:
    """Return trials drawn at random, as many as runs allow."""
    random = np.random.default_rng(seed)
    words = "Fly the commands below, made to measure."
    return [
        Plan(name=f"optimised {i}", sentence=words, setting=_random(setting, random))
        for i in range(max(MAX_OPTIMISER_RUNS // hypotheses, 1))
    ]


def _random(setting: Setting, random: np.random.Generator) -> Setting:
    """Return a trial with steps of propeller, rudder and stern-planes at random times, within limits."""
    n, top = cruise(setting), fastest(setting)
    times = np.round(np.sort(random.uniform(4.0, 36.0, 8)), 0)
    rows: list[Row] = [(0.0, n, 0.0, 0.0, 0.0)]
    for time in np.unique(times):
        speed = min(n * random.choice([0.0, 0.5, 0.8, 1.0, 1.0, 1.3]), top)
        rudder, plane = (
            RUDDER_AMPLITUDE * random.choice([-1, -0.5, 0, 0, 0.5, 1]),
            PLANE_AMPLITUDE * random.choice([-1, 0, 0, 1]),
        )
        rows.append((float(time), float(speed), float(rudder), float(plane), float(plane)))
    return flown(setting, rows, 40.0)
