"""The cases: a list from a seed, balanced in every prefix, each a record with a truth that the diagnosis does not know.

single     one hidden effect                         pair      two of them
healthy    only nuisances                            outside   what no effect of the catalogue is
twin       one that the trial cannot tell from a rival (D < 4, though its signal is clear)
sudden     one that begins in mid-trial
degraded   3 × noise, two channels, 10 s, true spread 2 × or ½ × the declared one: healthy and single in turn
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged

from . import outside
from .draws import Values, hidden, nuisances, with_begun, with_values
from .manoeuvres import CHANNELS, FEW, ids, nominal, sudden, times
from .outside import Strange
from .truth import NoRunError, agreed, noisy

SHARES = {"single": 400, "healthy": 200, "pair": 100, "outside": 60, "twin": 20, "degraded": 20, "sudden": 60}
"""How many of each make the whole benchmark."""
SEED, BEFORE = 59, 37
"""Of all cases; of those that the engine had before, when it was another."""
SETTLED = {37: 31, 59: 53}
"""Seed → the last one that something was chosen with before."""
BEGINS, GRID = (0.2, 0.7), 0.05
"""When a sudden effect begins, as shares of the trial; at whole steps of the coarsest truth. [s]"""
DEGRADED = ("noise", "channels", "short", "wide", "narrow")
AFTER = 4.0
"""The trial goes on behind its record, for sensors whose clock runs ahead. [s]"""
HEAVY = "drum_inertia"
"""Hidden on `fig6` only: on `rich` slack cable jerks taut behind a heavy drum, and no two runs of that agree."""
TWINS = (("sensor_scale:depth", 0), ("sensor_bias:heading", 0), ("hull_drag", 0), ("propeller_thrust_slope", 0),
         ("sensor_bias:depth", 0), ("sensor_scale:heading", 0))  # fmt: skip
"""Effect, and its parameter, that have rivals on `fig6`."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """What a case is to be.

    Attributes:
        seed, index: decide all that is random.
        kind: of `SHARES`.
        number: of its kind.
        manoeuvre: of `manoeuvres`.
        how: of DEGRADED, or "".
        causes: ids of hidden effects.
        sign: of their main parameter; 0 for any.
    """

    seed: int
    index: int
    kind: str
    number: int
    manoeuvre: str
    how: str = ""
    causes: tuple[str, ...] = ()
    sign: int = 0

    def rng(self, attempt: int = 0) -> np.random.Generator:
        """Return the random numbers of an attempt to make the case."""
        return np.random.default_rng([self.seed, self.index, attempt])


@dataclass(frozen=True, kw_only=True, eq=False)
class Made:
    """A case with its record: what is hidden, when it begins [s] if that is in mid-trial, all deviations, what is
    strange, the true setting, and how many draws were dropped before it.
    """

    logged: Logged
    hidden: Values
    starts: Mapping[str, float]
    values: Values
    strange: Strange | None
    true: Setting
    dropped: int = field(default=0)


@cache
def cases(seed: int = SEED, scale: float = 1.0) -> tuple[Case, ...]:
    """Return the cases of a benchmark, all kinds in turn; fewer or more of them by a factor."""
    counts = {kind: max(round(scale * count), 1) for kind, count in SHARES.items()}
    order = sorted(((i + 0.5) / n, kind, i) for kind, n in counts.items() for i in range(n))
    return tuple(_case(seed, index, kind, number) for index, (_, kind, number) in enumerate(order))


def _case(seed: int, index: int, kind: str, number: int) -> Case:
    """Return a case: every effect in turn, four fifths of them on `fig6`, the others on `rich`."""
    every = sudden() if kind == "sudden" else ids()
    rng = np.random.default_rng([seed, 1 + list(SHARES).index(kind), number // len(every)])
    names = rng.permutation(every).tolist()
    one, other = names[number % len(names)], names[(number + 7) % len(names)]
    how = DEGRADED[number % len(DEGRADED)] if kind == "degraded" else ""
    alone = kind in ("single", "sudden") or (kind == "degraded" and (number // len(DEGRADED)) % 2 == 1)
    causes = (one,) if alone else (one, other) if kind == "pair" else ()
    causes = (TWINS[number % len(TWINS)][0],) if kind == "twin" else causes
    on_rich = kind not in ("twin", "degraded") and number % 5 == 1 and HEAVY not in causes
    manoeuvre = "short" if how == "short" else "rich" if on_rich else "fig6"
    return Case(seed=seed, index=index, kind=kind, number=number, manoeuvre=manoeuvre, how=how, causes=causes)


def make(case: Case, attempt: int = 0, size: float = 1.0) -> Made:
    """Return a case with its record; drawn again as long as its truth cannot be run, or is no one truth.

    Args:
        case: what it is to be.
        attempt: number of the draw.
        size: of what is outside the catalogue.
    """
    for again in range(20):
        try:
            return replace(_made(case, case.rng(attempt * 20 + again), size), dropped=again)
        except NoRunError:
            continue
    message = f"Case {case.index} ({case.causes}) has no truth."
    raise NoRunError(message)


def _made(case: Case, rng: np.random.Generator, size: float) -> Made:
    setting = nominal(case.manoeuvre)
    spread = {"wide": 2.0, "narrow": 0.5}.get(case.how, 1.0)
    main = 0 if case.kind == "twin" else None
    found = {one: hidden(rng, one, case.sign, main) for one in case.causes}
    starts = _starts(case, rng, setting.trial.duration)
    values = {**nuisances(rng, spread), **({} if starts else found)}
    strange = None
    if case.kind == "outside":
        strange = outside.KINDS[case.number % len(outside.KINDS)](rng, setting.trial.duration, size)
    true = with_begun(setting, values, found, starts) if starts else with_values(setting, values)
    channels = FEW if case.how == "channels" else CHANNELS
    flown = replace(true, trial=replace(true.trial, duration=true.trial.duration + AFTER))
    shown = agreed(strange.on(flown) if strange else flown, times(setting), channels)
    if strange and strange.drift:
        shown[strange.axis] = shown[strange.axis] + strange.drift(times(setting))
    record = noisy(shown, times(setting), rng, 3.0 if case.how == "noise" else 1.0)
    logged = Logged(record=record, setting=setting, name=case.manoeuvre)
    return Made(logged=logged, hidden=found, starts=starts, values=values, strange=strange, true=true)


def _starts(case: Case, rng: np.random.Generator, duration: float) -> dict[str, float]:
    """Return when what begins in mid-trial begins. [s]"""
    if case.kind != "sudden":
        return {}
    return {one: GRID * round(rng.uniform(*BEGINS) * duration / GRID) for one in case.causes}
