"""Records as the world has them, not as the engine was made on: ``python -m benchmarks.diagnosis.world``.

Any shipped manoeuvre or a random one, noise of any family, healthy or with one hidden cause; truths by the other
formulation, all numbers drawn from their tolerances. D is measured with the true noise; that of a rounded channel is
what fits its errors best.

    white     from sample to sample              slow, slower   AR(1), ρ 0.9 and 0.97 at 10 Hz
    mild      AR(1), ρ 0.5 at 10 Hz              both           slow (5 s) and white at once
    rounded   white, compass 1°, log 0.05 m/s    both_rounded   all three
    coarse    white, one sample a second         tails          Student's t with three degrees of freedom
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

import cyclopts
import numpy as np
from scipy.optimize import minimize

import scenarios
import subzero
from subzero.diagnosis.api import diagnose_trials
from subzero.diagnosis.hypothesis.catalogue import NOISE
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import Noise, Problem, pose
from subzero.diagnosis.results import Cause, Verdict
from subzero.identification.verdict import UNSEEN
from subzero.model import Model
from subzero.records.record import Record

from .distance import discriminations, sensitivities
from .draws import Values, hidden, nuisances, with_values
from .manoeuvres import AFTER, CHANNELS, ids, nominal
from .results import read, results_of
from .truth import FAR, GAPS, OUTLIERS, NoRunError, agreed

FLOWN = ("fig6", "rich", "zigzag", "dive", "turning_circle", "stop_and_drift", "spiral", "current", "random")
"""Manoeuvres; "random" draws its commands."""
SHAKEN_BY = 0.01
"""Of a usual level of noise, that a record is shaken by. [-]"""
ROUNDED = {
    "heading": 1.0,
    "surge_speed": 0.05,
    "depth": 0.1,
    "pitch": 0.5,
    "roll_angle": 0.5,
    "yaw_rate": 0.5,
}
"""Resolution of coarse sensors, in the channels' units."""
CLEAR = 25.0
"""A cause with at least this D should be named. [-]"""
SURE = 0.95
"""Probability from which on a wrong verdict is a confident one. [-]"""
app = cyclopts.App(name="python -m benchmarks.diagnosis.world", help_format="plaintext", version_flags=[])


class Family(NamedTuple):
    """A kind of noise: σ of the white and of the slow part in usual levels, the slow part's correlation time [s],
    whether values are rounded, time between samples [s], and degrees of freedom of the white part (0: normal).
    """

    white: float = 1.0
    slow: float = 0.0
    time: float = 1.0
    rounded: bool = False
    step: float = 0.1
    freedom: float = 0.0


FAMILIES: Mapping[str, Family] = {
    "white": Family(),
    "mild": Family(white=0.0, slow=1.0, time=0.144),
    "slow": Family(white=0.0, slow=1.0, time=0.949),
    "slower": Family(white=0.0, slow=1.0, time=3.283),
    "both": Family(white=0.7, slow=0.7, time=5.0),
    "rounded": Family(white=0.3, rounded=True),
    "both_rounded": Family(white=0.5, slow=0.7, time=5.0, rounded=True),
    "coarse": Family(step=1.0),
    "tails": Family(white=0.6, freedom=3.0),
}


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """What a record of the world is: its number, the manoeuvre, the family of its noise, and its hidden cause or ""."""

    seed: int
    index: int
    flown: str
    family: str
    cause: str

    def rng(self, attempt: int) -> np.random.Generator:
        """Return the random numbers of an attempt to make it."""
        return np.random.default_rng([self.seed, self.index, attempt])


def drawn(seed: int, count: int) -> list[Drawn]:
    """Return the first records of a seed: families and manoeuvres in turn, every other one healthy."""
    rng = np.random.default_rng([seed, 77])
    causes, names = rng.permutation(ids()).tolist(), list(FAMILIES)
    return [
        Drawn(
            seed=seed,
            index=i,
            flown=FLOWN[(i + i // len(names)) % len(FLOWN)],
            family=names[i % len(names)],
            cause=causes[(i // 2) % len(causes)] if i % 2 else "",
        )
        for i in range(count)
    ]


class Made(NamedTuple):
    """A record with its nominal trial, what is hidden in it, and what its samples are off by: channel → (n,)."""

    logged: Logged
    planted: Values
    errors: Mapping[str, np.ndarray]


def record_of(one: Drawn, shaken: np.random.Generator | None = None) -> tuple[Logged, Values]:
    """Return a record with its nominal trial, and what is hidden in it, as `made`."""
    return made(one, shaken)[:2]


def made(one: Drawn, shaken: np.random.Generator | None = None) -> Made:
    """Return a record; drawn again where there is no one truth.

    Args:
        one: what is drawn.
        shaken: draws the little that every sample is off by, before it is rounded; nothing if not given.
    """
    for attempt in range(20):
        rng = one.rng(attempt)
        setting, family = flown(one, rng), FAMILIES[one.family]
        times = np.arange(0.0, setting.trial.duration + 1e-9, family.step)
        planted = {one.cause: hidden(rng, one.cause)} if one.cause else {}
        true = with_values(setting, {**nuisances(rng), **planted})
        longer = replace(true, trial=replace(true.trial, duration=true.trial.duration + AFTER))
        try:
            shown = agreed(longer, times, CHANNELS)
        except (NoRunError, subzero.UserError):
            continue
        values = {name: seen_by(family, name, column, times, rng, shaken) for name, column in shown.items()}
        record = Record(source="world", time=times, values=values)
        errors = {name: values[name] - column for name, column in shown.items()}
        return Made(Logged(record=record, setting=setting, name=one.flown), planted, errors)
    message = f"Record {one.index} ({one.cause} on {one.flown}) has no truth."
    raise NoRunError(message)


def flown(one: Drawn, rng: np.random.Generator) -> Setting:
    """Return the nominal setting of a record's manoeuvre."""
    return _random_commands(rng) if one.flown == "random" else _shipped(one.flown)


@cache
def _shipped(name: str) -> Setting:
    if name in ("fig6", "rich"):
        return nominal(name)
    trial = subzero.load_scenario(name)
    return Setting(trial=trial, model=Model.of(trial))


def _random_commands(rng: np.random.Generator) -> Setting:
    """Return fig6 for 40 s with five commands of propeller, rudder and planes, each for some seconds."""
    trial, count = subzero.load_scenario("fig6"), 5
    time = np.concatenate([[0.0], np.sort(rng.uniform(4.0, 35.0, count - 1)).round(1)])
    planes = np.radians(rng.uniform(-5.0, 5.0, count)) * (rng.random(count) < 0.5)
    rudder = np.radians(rng.uniform(-10.0, 10.0, count))
    values = np.column_stack([rng.uniform(12.0, 28.0, count), rudder, planes, planes])
    keep = np.concatenate([[True], np.diff(time) > 0.5])
    commands = scenarios.Commands(time=time[keep], values=values[keep])
    trial = replace(trial, duration=40.0, commands=commands)
    return Setting(trial=trial, model=Model.of(trial))


def seen_by(
    family: Family,
    name: str,
    column: np.ndarray,
    times: np.ndarray,
    rng: np.random.Generator,
    shaken: np.random.Generator | None = None,
) -> np.ndarray:
    """Return what a sensor with noise of a family shows of a channel (n,), with outliers, NaN in gaps."""
    noise = noise_of(family, times, rng)
    more = SHAKEN_BY * shaken.standard_normal(times.size) if shaken else 0.0
    return shown(family, name, column + NOISE[name] * (noise + more), rng)


def noise_of(family: Family, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return noise of a family in usual levels (n,), with outliers."""
    noise, kept = np.zeros(times.size), np.exp(-family.step / family.time)
    new = rng.standard_normal(times.size)
    for i in range(times.size):
        before = kept * noise[i - 1] if i else 0.0
        noise[i] = before + family.slow * (np.sqrt(1.0 - kept**2) if i else 1.0) * new[i]
    white = rng.standard_t(family.freedom, times.size) if family.freedom else rng.standard_normal(times.size)
    noise += family.white * white
    return noise + np.where(rng.random(times.size) < OUTLIERS, FAR * rng.choice([-1.0, 1.0], times.size), 0.0)


def shown(family: Family, name: str, noisy: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return noisy values (n,) with a sensor's resolution, NaN in gaps."""
    rounded = np.round(noisy / ROUNDED[name]) * ROUNDED[name] if family.rounded else noisy
    return np.where(rng.random(noisy.size) < GAPS, np.nan, rounded)


def with_true_noise(
    problem: Problem, family: Family, errors: Mapping[str, np.ndarray] | None = None
) -> Problem:
    """Return the problem of records with the noise that they have: of one record that is rounded, with that of its
    errors. What rounding takes off is no noise from sample to sample: beside little other noise it lasts as long as
    what is measured stands still.
    """
    spread = np.sqrt(family.freedom / (family.freedom - 2.0)) if family.freedom else 1.0

    def noise(name: str, old: Noise) -> Noise:
        if errors and family.rounded:
            return likeliest_noise(errors[name], old)
        return Noise(
            white=family.white * spread * NOISE[name],
            slow=family.slow * NOISE[name],
            correlation_time=family.time,
            resolution=ROUNDED[name] if family.rounded else 0.0,
            used=old.used,
            time=old.time,
        )

    records = tuple(
        replace(one, noise={name: noise(name, old) for name, old in one.noise.items()})
        for one in problem.records
    )
    return replace(problem, records=records)


def likeliest_noise(errors: np.ndarray, old: Noise) -> Noise:
    """Return the noise, white and slow, that gives errors (n,) the greatest density; of the samples of another."""

    def noise(log: np.ndarray) -> Noise:
        white, slow, time = np.exp(log)
        return replace(old, white=white, slow=slow, correlation_time=time, resolution=0.0)

    def cost(log: np.ndarray) -> float:
        guess = noise(log)
        white = guess.whiten(errors)
        return float(0.5 * white @ white + guess.log_scale)

    half = 0.7 * np.std(errors[old.used])
    found = [minimize(cost, np.log([half, half, time]), method="Nelder-Mead") for time in (0.3, 3.0)]
    return noise(min(found, key=lambda one: one.fun).x)


def result_of(one: Drawn) -> dict[str, Any]:
    """Return what a record is and what the diagnosis says of it."""
    found = {"index": one.index, "flown": one.flown, "family": one.family, "cause": one.cause}
    try:
        logged, planted, errors = made(one)
        problem = with_true_noise(pose([logged]), FAMILIES[one.family], errors)
        D = discriminations(problem, sensitivities(problem), planted) if planted else {}
        size = {"D": {k: v for k, (v, _) in D.items()}, "rival": {k: v for k, (_, v) in D.items()}}
        start, cpu = perf_counter(), process_time()
        said = _said(diagnose_trials([logged], seed=one.index, budget="verdict"))
        return found | size | said | {"seconds": perf_counter() - start, "cpu": process_time() - cpu}
    except Exception as error:
        return {**found, "error": repr(error)}


def _said(verdict: Verdict) -> dict[str, Any]:
    first, p = next(pair for pair in verdict.probabilities.items() if pair[0] != UNSEEN)
    if verdict.causes:  # what is named, over all explanations
        first, p = " + ".join(map(_name, verdict.causes)), min(cause.probability for cause in verdict.causes)
    noise = {
        name: [m.noise_sd, m.noise_slow, m.noise_time, m.resolution]
        for rows in verdict.misfit.values()
        for name, m in rows.items()
    }
    return {
        "verdict": verdict.verdict,
        "named": [cause.id for cause in verdict.causes],
        "first": first,
        "p": p,
        "listed": dict(list(verdict.probabilities.items())[:6]),
        "noise": noise,
    }


def _name(cause: Cause) -> str:
    """Return a cause as an explanation has it."""
    return cause.id if cause.start_time is None else f"{cause.id}@{cause.start_time:.4g}"


def is_right(one: Mapping[str, Any]) -> bool:
    """Say whether what is named, or else the most probable explanation, is what is true."""
    return set(one["first"].split(" + ")) == set((one["cause"] or "none").split(" + "))


def is_confidently_wrong(one: Mapping[str, Any]) -> bool:
    """Say whether something wrong has a probability of SURE, or an error is told of data that have none."""
    return one["verdict"] == "data_error" or (one["p"] >= SURE and not is_right(one))


def is_false_alarm(one: Mapping[str, Any]) -> bool:
    """Say whether a healthy record got a name, was called outside the catalogue, or accused of an error in its data."""
    return not one["cause"] and one["verdict"] in ("cause_named", "outside_catalogue", "data_error")


def table(results: Sequence[Mapping[str, Any]], families: Sequence[str] = tuple(FAMILIES)) -> str:
    """Return a row for every family: counts of healthy ones, of single causes with D above CLEAR, of all."""
    head = "family          healthy  right  alarms  clear  right  sure, wrong"
    return "\n".join([head, *(_row(name, results) for name in (*families, "all"))])


def _row(name: str, results: Sequence[Mapping[str, Any]]) -> str:
    own = [one for one in results if name in (one["family"], "all") and "error" not in one]
    healthy = [one for one in own if not one["cause"]]
    clear = [one for one in own if one["D"] and min(one["D"].values()) >= CLEAR]
    alarms, wrong = sum(map(is_false_alarm, healthy)), sum(map(is_confidently_wrong, own))
    right = [sum(map(is_right, some)) for some in (healthy, clear)]
    return f"{name:14s} {len(healthy):8d} {right[0]:6d} {alarms:7d} {len(clear):6d} {right[1]:6d} {wrong:7d}/{len(own)}"


def line_of(one: Mapping[str, Any]) -> str:
    """Return a result as a line."""
    if "error" in one:
        return f"{one['index']:4d} {one['flown']:14} {one['family']:12} ERROR {one['error']}"
    D = " ".join(f"{name} D {value:.0f} ({one['rival'][name]})" for name, value in one["D"].items())
    mark = "  " if is_right(one) else "! " if is_confidently_wrong(one) else "? "
    return (f"{mark}{one['index']:4d} {one['flown']:14} {one['family']:12} {D or 'healthy'} → {one['verdict']} "
            f"{one['first']} {one['p']:.2f} {one['seconds']:.0f} s")  # fmt: skip


CLOSE = 0.05
"""Probabilities that differ by less are the same. [-]"""


def differences(kept: Sequence[Mapping[str, Any]], results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a line for every record whose verdict, first name or probability is not what was kept of it."""
    before, found = {one["index"]: one for one in kept}, []
    for one in sorted(results, key=lambda one: one["index"]):
        old = before.get(one["index"])
        if old is None or "error" in old or "error" in one:
            found += [f"{one['index']:4d} cannot be compared"] if old != one else []
        elif (old["verdict"], old["first"]) != (one["verdict"], one["first"]) or abs(
            old["p"] - one["p"]
        ) > CLOSE:
            then = f"{old['verdict']} {old['first']} {old['p']:.2f}"
            found.append(f"{one['index']:4d} {then} → {one['verdict']} {one['first']} {one['p']:.2f}")
    return found


@app.default
def benchmark(
    *,
    count: int = 54,
    seed: int = 101,
    workers: int = 2,
    results: Path | None = None,
    resume: bool = False,
    families: str = "",
    against: Path | None = None,
) -> None:
    """Diagnose records of the world and print what came of it.

    Args:
        count: how many records.
        seed: of all records.
        workers: processes.
        results: where they are kept, one JSON object a line; nowhere if not given.
        resume: keep the results of an interrupted run, and go on behind them.
        families: only these, with commas between; all if empty.
        against: results that were kept; what is no more as it was is listed, and the exit code is 1.
    """
    chosen = [one for one in drawn(seed, count) if not families or one.family in families.split(",")]
    known = results_of(chosen, result_of, tell=line_of, workers=workers, path=results, resume=resume)
    print(Counter(one["error"] for one in known if "error" in one) or "", table(known), sep="\n")
    changed = differences(read(against), known) if against else []
    print(*changed, sep="\n")
    raise SystemExit(bool(changed))


if __name__ == "__main__":
    app()
