"""Forces and drifts that no cause of the catalogue is: are they reported? ``python -m benchmarks.diagnosis.outside``.

Six forces that the engine was not made with, a hull that heels more and more, and a compass that wanders off and comes
back; four fifths of them on `fig6`, the others on `rich`. Truths are by the other formulation, all numbers drawn from
their tolerances, with AR(1) noise, outliers and gaps (`truth`). D is the squared distance, with the true noise, from
everything in the catalogue; what has less than `CLEAR` is drawn again, and larger.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

import cyclopts
import numpy as np

from subzero.diagnosis.api import diagnose_trials
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import Problem, pose
from subzero.diagnosis.results import Verdict
from subzero.external_force import AXES, MissingForce, Term
from subzero.synthetic.unmodelled_forces import ALSO_CAUSES

from .distance import change_by, sensitivities, strangeness
from .draws import nuisances, with_values
from .manoeuvres import AFTER, CHANNELS, nominal, times
from .results import results_of
from .truth import NoRunError, agreed, noisy, with_true_noise

CLEAR = 16.0
"""From this D on something is asked to be found. [-]"""
ATTEMPTS, LARGER = 12, 1.3
"""Draws until one is clear, each larger than the one before by this factor."""
CLOSE_CAUSES = {**ALSO_CAUSES, "weed": "fouling"}
"""Kind → the cause of the catalogue that comes close to it, which may be named for it."""
app = cyclopts.App(name="python -m benchmarks.diagnosis.outside", help_format="plaintext", version_flags=[])


@dataclass(frozen=True, kw_only=True, eq=False)
class Strange:
    """Something outside the catalogue.

    Attributes:
        kind: its name.
        axis: of its force or moment, or the channel that drifts.
        force: what acts.
        drift: of the channel, at times. [display unit]
    """

    kind: str
    axis: str
    force: MissingForce | None = None
    drift: Callable[[np.ndarray], np.ndarray] | None = None

    def on(self, setting: Setting) -> Setting:
        """Return a setting with it."""
        if self.force is None:
            return setting
        later = tuple((time, model) for time, model in setting.later)
        assert not later
        return setting.with_model(missing=self.force)


def _history(axis: str, end: float, shape: Callable[[np.ndarray], np.ndarray]) -> MissingForce:
    times = np.linspace(0.0, end, int(end / 0.1) + 1)
    wrench = np.zeros((times.size, len(AXES)))
    wrench[:, AXES.index(axis)] = shape(times)
    return MissingForce(time=tuple(times.tolist()), wrench=tuple(map(tuple, wrench.tolist())))


def _bump(times: np.ndarray, start: float, length: float) -> np.ndarray:
    """Return a smooth bump of height 1."""
    x = np.clip((times - start) / length, 0.0, 1.0)
    return np.sin(np.pi * x) ** 2


def snag(rng: np.random.Generator, end: float, size: float) -> Strange:
    """The cable is caught for some seconds, and comes free."""
    start, length = rng.uniform(0.25, 0.6) * end, rng.uniform(3.0, 6.0)
    return Strange(
        kind="snag", axis="X", force=_history("X", end, lambda t: -0.5 * size * _bump(t, start, length))
    )


def surges(rng: np.random.Generator, end: float, size: float) -> Strange:
    """Waves push it forward and back."""
    period, phase = rng.uniform(5.0, 8.0), rng.uniform(0.0, 6.28)
    force = _history("X", end, lambda t: 0.4 * size * np.sin(2.0 * np.pi * t / period + phase))
    return Strange(kind="surges", axis="X", force=force)


def knock(rng: np.random.Generator, end: float, size: float) -> Strange:
    """Something turns it, for some seconds."""
    start, length, side = rng.uniform(0.25, 0.7) * end, rng.uniform(3.0, 6.0), rng.choice([-1.0, 1.0])
    force = _history("N", end, lambda t: 0.03 * side * size * _bump(t, start, length))
    return Strange(kind="knock", axis="N", force=force)


def shifting(rng: np.random.Generator, end: float, size: float) -> Strange:
    """A weight inside slides forward and back."""
    start, length, side = rng.uniform(0.2, 0.4) * end, rng.uniform(8.0, 12.0), rng.choice([-1.0, 1.0])
    force = _history("M", end, lambda t: 0.02 * side * size * _bump(t, start, length))
    return Strange(kind="shifting", axis="M", force=force)


def weed(rng: np.random.Generator, end: float, size: float) -> Strange:
    """Weed gathers on the hull: its drag grows with time."""
    term = Term("X", "time*u2", -size * rng.uniform(0.8, 1.5) / end)
    return Strange(kind="weed", axis="X", force=MissingForce(terms=(term,)))


def tumbling(rng: np.random.Generator, end: float, size: float) -> Strange:
    """A loose part drags hardest when it turns: a force aside with the square of the yaw rate."""
    term = Term("N", "r|r|", -size * rng.uniform(1.0, 2.0))
    return Strange(kind="tumbling", axis="N", force=MissingForce(terms=(term,)))


def heeling(rng: np.random.Generator, end: float, size: float) -> Strange:
    """A hatch works itself open: the hull heels more and more."""
    term = Term("K", "time*u2", size * rng.uniform(0.01, 0.02) * rng.choice([-1.0, 1.0]) / end)
    return Strange(kind="heeling", axis="K", force=MissingForce(terms=(term,)))


def wandering(rng: np.random.Generator, end: float, size: float) -> Strange:
    """A compass wanders off and comes back."""
    start, length, side = rng.uniform(0.1, 0.3) * end, rng.uniform(0.4, 0.7) * end, rng.choice([-1.0, 1.0])
    return Strange(
        kind="wandering", axis="heading", drift=lambda t: 4.0 * side * size * _bump(t, start, length)
    )


KINDS = (snag, weed, surges, knock, shifting, heeling, tumbling, wandering)


class Case(NamedTuple):
    """A record that is to be made: the seed, its number among these, and the number that its draws start from."""

    seed: int
    number: int
    index: int

    @property
    def manoeuvre(self) -> str:
        """The trial that is flown."""
        return "rich" if self.number % 5 == 1 else "fig6"


class Made(NamedTuple):
    """A record with its nominal trial, what is hidden in it, its problem with the true noise, D, and the rival."""

    logged: Logged
    strange: Strange
    D: float
    rival: str


KINDS_OF_RECORDS = {
    "degraded": 20,
    "healthy": 200,
    "outside": 60,
    "pair": 100,
    "single": 400,
    "sudden": 60,
    "twin": 20,
}
"""The kept records were drawn in turn with those of other kinds, so many of each: draws start from that number."""


def drawn(seed: int, count: int) -> list[Case]:
    """Return the first records of a seed."""
    counts = KINDS_OF_RECORDS.items()
    order = sorted(((i + 0.5) / most, kind, i) for kind, most in counts for i in range(most))
    found = [Case(seed, number, index) for index, (_, kind, number) in enumerate(order) if kind == "outside"]
    return found[:count]


def made(case: Case) -> Made:
    """Return a record; drawn again where there is no one truth, or where it is not clear."""
    for attempt in range(ATTEMPTS):
        logged, strange = _record(case, attempt)
        problem = with_true_noise(pose([logged]))
        D, rival = distance(problem, strange)
        if D >= CLEAR:
            break
    return Made(logged, strange, D, rival)


def _record(case: Case, attempt: int) -> tuple[Logged, Strange]:
    setting, size = nominal(case.manoeuvre), LARGER ** min(attempt, 5)
    for again in range(20):
        rng = np.random.default_rng([case.seed, case.index, attempt * 20 + again])
        true = with_values(setting, nuisances(rng))
        strange = KINDS[case.number % len(KINDS)](rng, setting.trial.duration, size)
        longer = replace(true, trial=replace(true.trial, duration=true.trial.duration + AFTER))
        try:
            shown = agreed(strange.on(longer), times(setting), CHANNELS)
        except NoRunError:
            continue
        if strange.drift:
            shown[strange.axis] = shown[strange.axis] + strange.drift(times(setting))
        record = noisy(shown, times(setting), rng)
        return Logged(record=record, setting=setting, name=case.manoeuvre), strange
    message = f"Record {case.index} has no truth."
    raise NoRunError(message)


def distance(problem: Problem, strange: Strange) -> tuple[float, str]:
    """Return D of what is outside the catalogue, and what comes closest."""
    record, J = problem.records[0], sensitivities(problem)
    if strange.drift is None:
        return strangeness(problem, J, change_by(problem, record.setting, strange.on(record.setting)))
    shift = dict.fromkeys(record.noise, 0.0 * record.time)
    shift[strange.axis] = strange.drift(record.time)
    change = np.concatenate([noise.whiten(shift[name]) for name, noise in record.noise.items()])
    return strangeness(problem, J, change)


def result_of(case: Case) -> dict[str, Any]:
    """Return what a record is and what the diagnosis says of it."""
    found = {"index": case.index, "number": case.number, "manoeuvre": case.manoeuvre}
    try:
        logged, strange, D, rival = made(case)
        start, cpu = perf_counter(), process_time()
        verdict = diagnose_trials([logged], seed=case.index, budget="verdict")
        took = {"seconds": {"wall": perf_counter() - start, "cpu": process_time() - cpu}}
        kind = {"strange": strange.kind, "D": {strange.kind: D}, "rival": {strange.kind: rival}}
        return found | kind | took | _said(verdict, strange)
    except Exception as error:
        return found | {"error": repr(error)}


def _said(verdict: Verdict, strange: Strange) -> dict[str, Any]:
    axis = verdict.unknown.axis if verdict.unknown else ""
    listed = dict(list(verdict.probabilities.items())[:ATTEMPTS])
    return {
        "verdict": verdict.verdict,
        "probabilities": listed,
        "outside": {"axis": strange.axis, "found": axis},
    }


def is_clear(one: Mapping[str, Any]) -> bool:
    """Say whether something is asked to be found."""
    return bool(min(one["D"].values()) >= CLEAR)


def first(one: Mapping[str, Any]) -> tuple[str, float]:
    """Return the most probable hypothesis and its probability."""
    name, p = max(one["probabilities"].items(), key=lambda pair: pair[1])
    return name, float(p)


def is_right(one: Mapping[str, Any]) -> bool:
    """Say whether it is called outside the catalogue, or the cause that comes close to it."""
    close, (name, onset) = CLOSE_CAUSES.get(one["strange"]), first(one)[0].partition("@")[::2]
    return one["verdict"] == "outside_catalogue" or bool(onset and name == close)


def has_right_axis(one: Mapping[str, Any]) -> bool:
    """Say whether the force or drift that is reported is on the true axis or channel."""
    return bool(one["outside"]["axis"] == one["outside"]["found"])


def line_of(one: Mapping[str, Any]) -> str:
    """Return a result as a line."""
    if "error" in one:
        return f"{one['index']:4d} {one['manoeuvre']:5} ERROR {one['error']}"
    (kind, D), (name, p) = next(iter(one["D"].items())), first(one)
    mark = "  " if is_right(one) else "? "
    return f"{mark}{one['index']:4d} {one['manoeuvre']:5} {kind} D {D:.0f} → {one['verdict']} {name} {p:.2f}"


def summary(results: Sequence[Mapping[str, Any]]) -> str:
    """Return how many clear ones are reported, by kind."""
    clear = [one for one in results if "error" not in one and is_clear(one)]
    rows = [f"D >= {CLEAR:g}: {sum(map(is_right, clear))} of {len(clear)} are reported"]
    for kind in dict.fromkeys(one["strange"] for one in clear):
        own = [one for one in clear if one["strange"] == kind]
        rows.append(f"{kind:10s} {sum(map(is_right, own))} of {len(own)}")
    return "\n".join(rows)


@app.default
def benchmark(*, count: int = 44, seed: int = 91, workers: int = 2, results: Path | None = None) -> None:
    """Diagnose records with something outside the catalogue, and print what came of it.

    Args:
        count: how many records, 60 at most.
        seed: of all records.
        workers: processes.
        results: where they are kept, one JSON object a line; those that are there are not made again.
    """
    print(summary(results_of(drawn(seed, count), result_of, tell=line_of, workers=workers, path=results)))


if __name__ == "__main__":
    app()
