"""The next trial: of the library, with a further channel, or made to measure, what best separates what is left.

    max over trials of min over pairs of D, tolerances free within what is known of them already

Every trial is run for every hypothesis; the most promising ones with sensitivities, in the order of the library, until
one decides for sure (D ≥ SURE). If none does, further channels are looked at; and if nothing decides at all
(D < ENOUGH), command sequences are drawn at random, within the same limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from subzero.diagnosis.outlook import Belief, Outlook, Survivor, beliefs, outlook, to_come
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.setting import Setting
from subzero.diagnosis.trial_library import (
    CHANNELS,
    LIBRARY,
    PLANE,
    RUDDER,
    Row,
    cruise,
    fastest,
    flown,
    rows_of,
)
from subzero.diagnosis.verdict import NextTrial

ENOUGH = 16.0
"""D from which on a trial decides."""
SURE = 25.0
"""D from which on more is no better: the simpler trial is preferred."""
PROMISING = 6
"""How many trials are looked at with sensitivities."""
RUNS = 40
"""Runs of the search for a trial made to measure."""
SHALLOW, DEEPER = 0.2, 5.0
"""Nothing may rise above this depth, nor sink so much deeper than it starts. [m]"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A trial that might be flown.

    Attributes:
        name, sentence: as of the library.
        setting: of the trial.
        channel: further channel, "" for none.
        discrimination: the smallest D.
        view: what it would show; None before sensitivities are made.
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
    """Return what to do next to tell hypotheses apart; None if there are fewer than two.

    Args:
        problem: of the records at hand.
        survivors: hypotheses with their fits, of this problem.
        probabilities: of them; alike if None.
        seed: of all that is drawn.
    """
    if len(survivors) < 2:
        return None
    held = beliefs(problem, survivors)
    setting = problem.records[0].setting
    plans = [
        Plan(name=name, sentence=words, setting=make(setting)) for name, (words, make) in LIBRARY.items()
    ]
    found = _looked_at(problem, plans, held)
    if _most(found) < SURE:
        found += _with_channels(problem, setting, held)
    if _most(found) < ENOUGH:
        found += _looked_at(problem, _drawn(setting, len(held), seed), held, most=2)
    best = max(found, key=lambda plan: min(plan.discrimination, SURE), default=None)
    return None if best is None else _told(best, _weights(probabilities, len(held)), seed)


def outlooks(problem: Problem, survivors: Sequence[Survivor]) -> list[tuple[str, Outlook]]:
    """Return what every safe trial of the library would show."""
    held, setting = beliefs(problem, survivors), problem.records[0].setting
    coming = {name: to_come(problem, make(setting)) for name, (_, make) in LIBRARY.items()}
    shown = {name: _shown(one, held) for name, one in coming.items()}
    return [
        (name, outlook(h, coming[name].jacobian(held[0].z), held))
        for name, h in shown.items()
        if h is not None
    ]


def _most(plans: Sequence[Plan]) -> float:
    """Return the largest D of plans."""
    return max((plan.discrimination for plan in plans), default=0.0)


def _weights(probabilities: Sequence[float] | None, count: int) -> np.ndarray:
    weights = np.ones(count) if probabilities is None else np.maximum(np.asarray(probabilities, float), 1e-3)
    return weights / weights.sum()


def _told(plan: Plan, prior: np.ndarray, seed: int) -> NextTrial:
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


def _looked_at(
    problem: Problem, plans: Sequence[Plan], held: Sequence[Belief], most: int = PROMISING
) -> list[Plan]:
    """Return the most promising plans that are safe, in their order, up to the first that decides for sure."""
    shown = {plan.name: _shown(to_come(problem, plan.setting), held) for plan in plans}
    apart = {name: _apart(h) for name, h in shown.items() if h is not None}
    names = sorted(apart, key=lambda name: -apart[name])[:most]
    found: list[Plan] = []
    for plan in plans:
        if plan.name in names and _most(found) < SURE:
            h = shown[plan.name]
            assert h is not None
            found.append(_viewed(to_come(problem, plan.setting), plan, h, held))
    return found


def _shown(coming: Problem, held: Sequence[Belief]) -> np.ndarray | None:
    """Return h(z) (hypotheses, m) of a trial; None if a hypothesis leads it out of safe depths."""
    tracks = coming.tracks([(0, one.z) for one in held])
    depths = np.stack([track[1][:, 2] for track in tracks])
    start = coming.records[0].setting.trial.start.depth
    if not np.isfinite(depths).all() or depths.min() < min(SHALLOW, start) or depths.max() > start + DEEPER:
        return None
    return np.stack([coming.whitened(0, coming.setting(0, one.z), track)
                     for one, track in zip(held, tracks, strict=True)])  # fmt: skip


def _apart(shown: np.ndarray) -> float:
    """Return the smallest squared distance between any two hypotheses, tolerances aside."""
    count = range(len(shown))
    return min(float(np.sum((shown[a] - shown[b]) ** 2)) for a in count for b in count if a < b)


def _viewed(coming: Problem, plan: Plan, shown: np.ndarray, held: Sequence[Belief]) -> Plan:
    """Return a plan with what it would show."""
    view = outlook(shown, coming.jacobian(held[0].z), held)
    return Plan(name=plan.name, sentence=plan.sentence, setting=plan.setting, channel=plan.channel,
                discrimination=view.discrimination(), view=view)  # fmt: skip


def _with_channels(problem: Problem, setting: Setting, held: Sequence[Belief]) -> list[Plan]:
    """Return the same trial again, with each further channel."""
    more = [name for name in CHANNELS if name not in problem.records[0].noise]
    coming = to_come(problem, setting, more)
    shown = _shown(coming, held) if more else None
    if shown is None:
        return []
    J, found = coming.jacobian(held[0].z), []
    rows = np.repeat(np.array(list(coming.records[0].noise)), coming.records[0].time.size)
    for name in more:
        own = ~np.isin(rows, [other for other in more if other != name])
        view = outlook(shown[:, own], J[own], held)
        found.append(Plan(name="same", sentence="Fly the same trial again. " + CHANNELS[name], setting=setting,
                          channel=name, discrimination=view.discrimination(), view=view))  # fmt: skip
    return found


def _drawn(setting: Setting, hypotheses: int, seed: int) -> list[Plan]:
    """Return trials drawn at random, as many as runs allow."""
    random = np.random.default_rng(seed)
    words = "Fly the commands below, made to measure."
    return [Plan(name=f"optimised {i}", sentence=words, setting=_random(setting, random))
            for i in range(max(RUNS // hypotheses, 1))]  # fmt: skip


def _random(setting: Setting, random: np.random.Generator) -> Setting:
    """Return a trial with steps of propeller, rudder and stern-planes at random times, within limits."""
    n, top = cruise(setting), fastest(setting)
    times = np.round(np.sort(random.uniform(4.0, 36.0, 8)), 0)
    rows: list[Row] = [(0.0, n, 0.0, 0.0, 0.0)]
    for time in np.unique(times):
        speed = min(n * random.choice([0.0, 0.5, 0.8, 1.0, 1.0, 1.3]), top)
        rudder, plane = RUDDER * random.choice([-1, -0.5, 0, 0, 0.5, 1]), PLANE * random.choice([-1, 0, 0, 1])
        rows.append((float(time), float(speed), float(rudder), float(plane), float(plane)))
    return flown(setting, rows, 40.0)
