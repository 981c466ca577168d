"""Records drawn as wide as users have them: ``python -m benchmarks.diagnosis.wide``.

Where `benchmarks.diagnosis.world` varies noise and manoeuvre of one record of Subzero II, here all is drawn at once:

    vehicle       Subzero II, or the REMUS 100 of the other table, which needs an autopilot to keep straight
    manoeuvre     shipped, random commands, or steps of heading under an autopilot that feeds the sensors' noise back
    records       one to three
    sampling      1 to 20 samples a second
    noise         the families of `world`, or cut from measured channels of real vehicles (`sensor_noise`)
    tolerances    right, or half or twice what the vehicles are drawn from
    truth         healthy, one cause, or two, by the other formulation

D is of the declared tolerances and the true noise (white with the same deviation, where it is measured).
"""

from __future__ import annotations

import tempfile
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import cyclopts
import numpy as np

import scenarios
import subzero
from subzero.diagnosis.api import diagnose_trials
from subzero.diagnosis.hypothesis.catalogue.sensors import NOISE
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import pose
from subzero.model import Model
from subzero.records.record import Record

from .cases import AFTER
from .distance import discriminations, sensitivities
from .draws import Values, hidden, nuisances, with_values
from .manoeuvres import CHANNELS, ids
from .results import results_of
from .sensor_noise import cut
from .truth import NoRunError, agreed
from .world import FAMILIES, FLOWN, Drawn, Family, flown, line_of, noise_of, shown, table, with_true_noise

STEPS = (0.05, 0.1, 0.2, 0.5, 1.0)
"""Between samples. [s]"""
SPREADS = (0.5, 1.0, 1.0, 2.0)
"""Of the vehicles, in declared tolerances."""
RECORDS = (1, 1, 2, 3)
KINDS = ("healthy", "single", "healthy", "single", "pair")
MEASURED = Family(white=1.4)
"""Noise cut from measured channels, in usual levels: its deviation, tails and all."""
NOISES = {**FAMILIES, "measured": MEASURED}
HOLD = 0.5
"""Of a command of the autopilot. [s]"""
GAINS, LIMIT = (0.8, 0.9), 0.17
"""Of the autopilot: rudder per heading error [-] and per yaw rate [s]; largest rudder. [rad]"""
FLIGHT = 40.0
"""Of a record under the autopilot. [s]"""
app = cyclopts.App(name="python -m benchmarks.diagnosis.wide", help_format="plaintext", version_flags=[])


@dataclass(frozen=True, kw_only=True)
class Wide:
    """What is drawn: a number, the vehicle, its manoeuvres, noise, time between samples [s], spread, hidden causes."""

    seed: int
    index: int
    vehicle: str
    flown: tuple[str, ...]
    family: str
    step: float
    spread: float
    causes: tuple[str, ...]

    def noise(self) -> Family:
        """Return the family of its noise at its sampling."""
        return NOISES[self.family]._replace(step=self.step)


def drawn(seed: int, index: int) -> Wide:
    """Return a record of a seed, or several of one vehicle."""
    rng = np.random.default_rng([seed, index, 5])
    vehicle = "remus100" if rng.random() < 0.25 else "subzero2"
    manoeuvres = ("autopilot",) if vehicle == "remus100" else (*FLOWN, "autopilot", "autopilot")
    hidden_causes = {"healthy": 0, "single": 1, "pair": 2}[KINDS[index % len(KINDS)]]
    return Wide(
        seed=seed,
        index=index,
        vehicle=vehicle,
        flown=tuple(rng.choice(manoeuvres, int(rng.choice(RECORDS))).tolist()),
        family=list(NOISES)[index % len(NOISES)],
        step=float(rng.choice(STEPS)),
        spread=float(rng.choice(SPREADS)),
        causes=tuple(sorted(rng.choice(ids(), hidden_causes, replace=False).tolist())),
    )


def records_of(one: Wide) -> tuple[list[Logged], Values]:
    """Return the records with their nominal trials, and what is hidden in them; drawn again where there is no truth."""
    for attempt in range(10):
        rng = np.random.default_rng([one.seed, one.index, attempt])
        planted = {cause: hidden(rng, cause) for cause in one.causes}
        values = {**nuisances(rng, one.spread), **planted}
        try:
            return [_record(one, k, values, rng) for k in range(len(one.flown))], planted
        except (NoRunError, subzero.UserError):
            continue
    message = f"Record {one.index} has no truth."
    raise NoRunError(message)


def _record(one: Wide, which: int, values: Values, rng: np.random.Generator) -> Logged:
    """Return one record."""
    name, family = one.flown[which], one.noise()
    setting = (
        _under_autopilot(one.vehicle, rng) if name == "autopilot" else flown(_as_of_world(one, name), rng)
    )
    times = np.arange(0.0, setting.trial.duration + 1e-9, one.step)
    noise = {channel: NOISE[channel] * _noise(one, family, times, rng) for channel in CHANNELS}
    if name == "autopilot":
        setting = _steered(setting, with_values(setting, values), times, noise, rng)
    true = with_values(setting, values)
    truth = agreed(
        replace(true, trial=replace(true.trial, duration=true.trial.duration + AFTER)), times, CHANNELS
    )
    seen = {
        channel: shown(family, channel, column + noise[channel], rng) for channel, column in truth.items()
    }
    record = Record(source=f"wide {which}", time=times, values=seen)
    return Logged(record=record, setting=setting, name=f"{name} {which}")


def _noise(one: Wide, family: Family, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return noise in usual levels (n,)."""
    return cut(rng, times.size) if one.family == "measured" else noise_of(family, times, rng)


def _as_of_world(one: Wide, name: str) -> Drawn:
    return Drawn(seed=one.seed, index=one.index, flown=name, family=one.family, cause="")


def _under_autopilot(vehicle: str, rng: np.random.Generator) -> Setting:
    """Return fig6 of a vehicle, from a speed on, with a propeller that changes once; the fins are at rest."""
    text = subzero.load_scenario("fig6").text.replace('"subzero2"', f'"{vehicle}"')
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "steered.toml"
        path.write_text(text, encoding="utf-8")
        trial = subzero.load_scenario(path)
    time = np.arange(0.0, FLIGHT, HOLD)
    command = np.zeros((time.size, 4))
    command[:, 0] = np.where(time < rng.uniform(10.0, 25.0), *rng.uniform(14.0, 26.0, 2))
    trial = replace(trial, duration=FLIGHT, commands=scenarios.Commands(time=time, values=command))
    return Setting(trial=trial, model=Model.of(trial))


def _steered(
    setting: Setting, true: Setting, times: np.ndarray, noise: dict[str, np.ndarray], rng: np.random.Generator
) -> Setting:
    """Return a setting with the rudder and planes that an autopilot gave which saw what the sensors show."""
    commands = setting.trial.commands
    assert commands is not None
    asked = np.radians(np.cumsum(rng.uniform(-30.0, 30.0, 4)))
    simulator = subzero.Simulator(true.trial, model=true.model, sample_time=HOLD)
    values, begin = commands.values.copy(), simulator.observation
    for k, time in enumerate(commands.time):
        seen, at = simulator.observation, min(int(np.searchsorted(times, time)), times.size - 1)
        heading = seen.heading - begin.heading + np.radians(noise["heading"][at])
        rate = seen.yaw_rate + np.radians(noise["yaw_rate"][at])
        error = asked[int(time / FLIGHT * asked.size)] - heading
        values[k, 1] = np.clip(GAINS[0] * error - GAINS[1] * rate, -LIMIT, LIMIT)
        values[k, 2:] = np.clip(-0.5 * seen.pitch, -LIMIT, LIMIT)
        simulator.step(tuple(values[k]))
    held = scenarios.Commands(time=commands.time, values=values)
    return replace(setting, trial=replace(setting.trial, commands=held))


def result_of(one: Wide) -> dict[str, Any]:
    """Return what was drawn and what the diagnosis says of it."""
    found = {"index": one.index, "flown": "+".join(one.flown), "family": one.family, "vehicle": one.vehicle,
             "step": one.step, "spread": one.spread, "cause": " + ".join(one.causes)}  # fmt: skip
    try:
        records, planted = records_of(one)
        problem = with_true_noise(pose(records), one.noise())
        D = discriminations(problem, sensitivities(problem), planted) if planted else {}
        start = perf_counter()
        verdict = diagnose_trials(records, seed=one.index, budget="verdict")
        first, p = next(iter(verdict.probabilities.items()))
        return {**found, "D": {name: value for name, (value, _) in D.items()},
                "rival": {name: rival for name, (_, rival) in D.items()}, "verdict": verdict.verdict,
                "named": [cause.id for cause in verdict.causes], "first": first, "p": p,
                "listed": dict(list(verdict.probabilities.items())[:6]), "seconds": perf_counter() - start}  # fmt: skip
    except Exception as error:
        return {**found, "error": repr(error)}


@app.default
def benchmark(
    *,
    count: int = 50,
    seed: int = 301,
    workers: int = 2,
    results: Path | None = None,
    resume: bool = False,
) -> None:
    """Diagnose records drawn as wide as users have them, and print what came of it.

    Args:
        count: how many.
        seed: of all.
        workers: processes.
        results: where they are kept, one JSON object a line; nowhere if not given.
        resume: keep the results of an interrupted run, and go on behind them.
    """
    wanted = [drawn(seed, index) for index in range(count)]
    known = results_of(wanted, result_of, tell=line_of, workers=workers, path=results, resume=resume)
    print(
        Counter(one["error"] for one in known if "error" in one) or "", table(known, list(NOISES)), sep="\n"
    )


if __name__ == "__main__":
    app()
