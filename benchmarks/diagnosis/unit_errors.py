"""Logs with one to five unit errors, by the engine for any model: ``python -m benchmarks.diagnosis.unit_errors``.

Healthy vehicles of the world (`benchmarks.diagnosis.world`), of which one to five random columns get a random unit or
sign that is wrong. Prints for each log what was planted and what is named; a name is wrong if it is a cause, if its
column has no error, or if its factor is not that of the column.
"""

from __future__ import annotations

import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import cyclopts
import numpy as np

from subzero import identification
from subzero.diagnosis.vehicle_model import vehicle_model

from . import world

FACTORS = {
    "any": (-1.0, 10.0, 0.1, 100.0, 0.01),
    "heading": (math.pi / 180.0,),
    "pitch": (math.pi / 180.0,),
    "roll_angle": (math.pi / 180.0,),
    "yaw_rate": (math.pi / 180.0, 60.0),
    "depth": (1.0 / 0.3048, 10.055),
    "surge_speed": (3.6 / 1.852, 3.6, 1.0 / 0.3048),
}
"""Factors of wrong units by channel, and of slips of any channel but the compass."""
SAME, SAID, SURE = 0.05, 3.0, 0.95
"""A factor is right within this share, or so many standard deviations that the verdict gives; a wrong name from this
probability on counts. [-]"""
app = cyclopts.App(
    name="python -m benchmarks.diagnosis.unit_errors", help_format="plaintext", version_flags=[]
)


def planted(seed: int, index: int) -> tuple[dict[str, float], list[tuple[str, float]], bool, bool]:
    """Return channel → factor, names with their probabilities, whether all were named, and whether one is wrong."""
    rng = np.random.default_rng([seed, index, 91])
    (one,) = [each for each in world.drawn(seed, 2 * index + 1) if each.index == 2 * index]
    logged, _ = world.record_of(one)
    names = rng.permutation(list(logged.record.values))[: int(rng.integers(1, 6))].tolist()
    factors = {name: _factor(name, rng) for name in names}
    values = {name: column * factors.get(name, 1.0) for name, column in logged.record.values.items()}
    model, records = vehicle_model([replace(logged, record=replace(logged.record, values=values))])
    verdict = identification.diagnose(records, model)
    said, wrong, right = [], False, set()
    for each in verdict.named:
        name = each.id.partition(":")[2].partition("@")[0]
        true = factors.get(name, math.inf)
        fits = each.is_data_error and any(
            abs(e.value - true) < max(SAME * abs(true), SAID * e.sd)
            for e in each.estimates
            if e.name == "factor"
        )
        right |= {name} if fits else set()
        wrong |= not fits and each.probability > SURE
        said.append((each.id, each.probability))
    return factors, said, right == set(factors), wrong


def _factor(name: str, rng: np.random.Generator) -> float:
    slips = () if name == "heading" else FACTORS["any"]
    return float(rng.choice([*FACTORS.get(name, ()), *slips]))


@app.default
def benchmark(*, count: int = 200, seed: int = 1, first: int = 0, workers: int = 2) -> None:
    """Diagnose logs with unit errors and print what is named.

    Args:
        count: how many logs.
        seed: of all logs.
        first: number of the first one.
        workers: processes.
    """
    all_named = wrong = 0
    with ProcessPoolExecutor(workers) as pool:
        for index, (factors, said, complete, bad) in enumerate(
            pool.map(planted, [seed] * count, range(first, first + count)), first
        ):
            all_named, wrong = all_named + complete, wrong + bad
            truth = ", ".join(f"{name} x {factor:.3g}" for name, factor in factors.items())
            names = ", ".join(f"{name} {p:.2f}" for name, p in said) or "nothing"
            print(f"{'!' if bad else ' '} {index:4d} {truth} -> {names}", flush=True)
    print(f"{count} logs: all named in {all_named}, wrong with p > {SURE} in {wrong}")


if __name__ == "__main__":
    app()
