"""Causes that only ever begin in mid-trial, in records of the world: are jams and slow changes told as what they are?

Every record is of a manoeuvre and of a noise of `world`, its truth by the other formulation, all numbers of the vehicle
drawn within tolerance. D is against all that holds throughout and all else that may begin in mid-trial, with the true
noise. Run it:

    python -m benchmarks.diagnosis.onsets --count 48 --seed 7
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import cyclopts
import numpy as np

import subzero
from subzero.diagnosis.api import diagnose_trials
from subzero.diagnosis.hypothesis.catalogue import ONSETS
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, with_onset
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import pose
from subzero.records.record import Record

from .distance import sensitivities, sudden_distance
from .draws import nuisances, with_values
from .manoeuvres import AFTER, CHANNELS
from .results import results_of
from .truth import NoRunError, agreed
from .world import (
    FAMILIES,
    FLOWN,
    Drawn,
    flown,
    is_confidently_wrong,
    seen_by,
    with_true_noise,
)

app = cyclopts.App()
CLEAR = 16.0
"""From this D on a cause is asked for by name."""
CAUSES = {effect.id: effect for effect in ONSETS}
FIN_OF = {"rudder_jam": 1, "stern_plane_port_jam": 2, "stern_plane_starboard_jam": 3}
"""Jam → column of its fin among the commands."""


@dataclass(frozen=True, kw_only=True)
class Begun:
    """What is hidden: the cause, its deviations, and when it begins. [s]"""

    cause: str
    values: tuple[float, ...]
    time: float


def drawn(seed: int, count: int) -> list[Drawn]:
    """Return the first records of a seed: causes, manoeuvres and families in turn, shuffled by the seed."""
    rng, names = np.random.default_rng([seed, 31]), list(FAMILIES)
    causes = [list(CAUSES)[i] for i in np.concatenate([rng.permutation(len(CAUSES)) for _ in range(count)])]
    places = rng.permutation(count)
    return [
        Drawn(
            seed=seed,
            index=i,
            flown=FLOWN[places[i] % len(FLOWN)],
            family=names[i % len(names)],
            cause=causes[i],
        )
        for i in range(count)
    ]


def hidden(effect: Effect, setting: Setting, rng: np.random.Generator) -> Begun:
    """Return what is hidden: a fin that jams, where it stands or elsewhere, or what grows half to twice as usual."""
    time = float(rng.uniform(0.25, 0.65) * setting.trial.duration)
    if effect.grows:
        sizes = [rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2.0) * p.scale for p in effect.parameters]
        return Begun(cause=effect.id, values=tuple(float(z) for z in sizes), time=time)
    commands = setting.trial.commands
    row = max(int(np.searchsorted(commands.time, time, side="right")) - 1, 0)
    stands = float(np.degrees(commands.values[row][FIN_OF[effect.id]]))
    angle = stands if rng.random() < 0.5 else float(rng.uniform(-10.0, 10.0))
    return Begun(cause=effect.id, values=(1.0, angle), time=time)


def record_of(one: Drawn) -> tuple[Logged, Begun]:
    """Return a record with its nominal trial, and what is hidden in it; drawn again where there is no one truth."""
    for attempt in range(20):
        rng = one.rng(attempt)
        setting, family = flown(one, rng), FAMILIES[one.family]
        times = np.arange(0.0, setting.trial.duration + 1e-9, family.step)
        started, numbers = hidden(CAUSES[one.cause], setting, rng), nuisances(rng)
        longer = replace(setting, trial=replace(setting.trial, duration=setting.trial.duration + AFTER))
        true = with_onset(CAUSES[started.cause], started.time).apply(
            with_values(longer, numbers), *started.values
        )
        try:
            shown = agreed(true, times, CHANNELS)
        except (NoRunError, subzero.UserError):
            continue
        values = {name: seen_by(family, name, column, times, rng) for name, column in shown.items()}
        return Logged(
            record=Record(source="world", time=times, values=values), setting=setting, name=one.flown
        ), started
    message = f"Record {one.index} ({one.cause} on {one.flown}) has no truth."
    raise NoRunError(message)


def result_of(one: Drawn) -> dict[str, Any]:
    """Return what a record is and what the diagnosis says of it."""
    found = {"index": one.index, "flown": one.flown, "family": one.family, "cause": one.cause}
    try:
        logged, started = record_of(one)
        problem = with_true_noise(pose([logged]), FAMILIES[one.family])
        D, rival = sudden_distance(
            problem, sensitivities(problem), started.cause, started.values, started.time
        )
        start = perf_counter()
        verdict = diagnose_trials([logged], seed=one.index, budget="verdict")
        first, p = next(iter(verdict.probabilities.items()))
        found |= {
            "D": D,
            "rival": rival,
            "time": started.time,
            "values": started.values,
            "verdict": verdict.verdict,
        }
        found |= {"first": first.partition("@")[0], "began": float(first.partition("@")[2] or np.nan), "p": p}
        found |= {"listed": dict(list(verdict.probabilities.items())[:5]), "seconds": perf_counter() - start}
    except Exception as error:
        found |= {"error": repr(error)}
    return found


def is_right(one: Mapping[str, Any]) -> bool:
    """Say whether the most probable cause is the true one, whenever it begins."""
    return bool(one["first"] == one["cause"])


def line_of(one: Mapping[str, Any]) -> str:
    """Return a result as a line."""
    if "error" in one:
        return f"{one['index']:4d} {one['flown']:14} {one['family']:12} {one['cause']} ERROR {one['error']}"
    mark = "  " if is_right(one) else "! " if is_confidently_wrong(one) else "? "
    true = f"{one['cause']}@{one['time']:.1f} ({', '.join(f'{z:.2g}' for z in one['values'])})"
    reported = f"{one['verdict']} {one['first']}@{one['began']:.1f} {one['p']:.2f} {one['seconds']:.0f} s"
    distance = f"D {one['D']:.0f} ({one['rival']})"
    return f"{mark}{one['index']:4d} {one['flown']:14} {one['family']:12} {true} {distance} → {reported}"


def table(results: Sequence[Mapping[str, Any]]) -> str:
    """Return a row for every cause: records, those with D of at least CLEAR, right first, wrong with certainty."""
    rows = ["cause                       records  clear  right  sure, wrong"]
    for cause in (*CAUSES, "all"):
        own = [one for one in results if cause in (one["cause"], "all") and "error" not in one]
        clear = [one for one in own if one["D"] >= CLEAR]
        right, wrong = sum(map(is_right, clear)), sum(map(is_confidently_wrong, own))
        rows.append(f"{cause:26s} {len(own):8d} {len(clear):6d} {right:6d} {wrong:7d}")
    return "\n".join(rows)


@app.default
def benchmark(*, count: int = 24, seed: int = 7, workers: int = 2, results: Path | None = None) -> None:
    """Diagnose records with what only begins in mid-trial, and print what came of it.

    Args:
        count: how many records.
        seed: of all records.
        workers: processes.
        results: where they are kept, one JSON object a line, and gone on with if it is there; nowhere if not given.
    """
    known = results_of(drawn(seed, count), result_of, tell=line_of, workers=workers, path=results)
    print(table(known))


if __name__ == "__main__":
    app()
