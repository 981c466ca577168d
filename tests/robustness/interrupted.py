"""Interrupt calculations at random times, many times over, in this process: run as a child process by the tests.

    python tests/robustness/interrupted.py SEED COUNT [few | all | diagnose]

A timer raises `KeyboardInterrupt` wherever Python code runs then, as Ctrl-C does. After each interrupt another
calculation is done in the same process, and has to give what it gave before any interrupt, to the last bit; the same
simulator, which has been interrupted again and again, goes on with its run. Prints, as JSON, how many interrupts came,
where, and what went wrong.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import random
import signal
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr

import cable
import subzero

COMMAND = (25.0, 0.2, 0.0, 0.0)
Calculation = Callable[[], str]


def digest(arrays: Iterable[np.ndarray]) -> str:
    """Return some digits that change with any bit of the arrays."""
    found = hashlib.sha256()
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()[:16]


def of_run(run: xr.Dataset) -> str:
    return digest(run[name].values for name in sorted(run.data_vars))


def of_history(history: cable.History) -> str:
    return digest([history.tow_force, history.length, *history.shapes, *history.tensions])


def fig6() -> str:
    return of_run(subzero.simulate("fig6"))


def untethered() -> str:
    return of_run(subzero.simulate("fig6", tethered=False))


def stepped() -> str:
    sim = subzero.Simulator("fig6")
    return digest([np.array(sim.step(COMMAND)) for _ in range(100)])


def result() -> str:
    sim = subzero.Simulator("fig6")
    for _ in range(20):
        sim.step(COMMAND)
    return of_run(sim.result())


@cache
def simulator() -> subzero.Simulator:
    """Return one simulator for all of `driven`."""
    return subzero.Simulator("fig6")


def driven() -> str:
    """Drive the same simulator, whatever interrupted it before: on from where it is, and then from the start."""
    sim = simulator()
    if sim.time < 15.0:
        before = sim.time
        sim.step(COMMAND)
        assert abs(sim.time - before - 0.1) < 1e-9, "a step that is none"
    sim.reset()
    return digest([np.array(sim.step(COMMAND)) for _ in range(50)])


def ahead(t: float) -> tuple[float, float, float]:
    return (1.0, 0.2 * t, 0.0)


def pulled_out() -> str:
    return of_history(cable.pull_out(ahead, 10.0, scheme=cable.MovingEnd(time_step=0.1)))


def lumped() -> str:
    return of_history(cable.pull_out(ahead, 5.0, scheme=cable.Lumped(time_step=0.1)))


def printed() -> str:
    return of_history(cable.pull_out(ahead, 5.0, scheme=cable.Paper(time_step=0.5)))


def towed() -> str:
    return of_history(cable.tow(ahead, 20.0, 5.0))


def held() -> str:
    heavy = cable.CableProperties(mass_per_length=0.02)
    found = cable.hold(((0.0, 0.0, 0.0), (15.0, 2.0, 1.0)), 20.0, (0.3, 0.0, 0.0), cable=heavy)
    return digest([found.shape, found.tensions])


@cache
def record() -> Path:
    """Return a record of a vehicle whose propeller pushes less."""
    from subzero.results.netcdf_csv import write_csv

    model = subzero.Model.of(subzero.load_scenario("fig6"))
    weak = model.vehicle.propeller.thrust_constant * 0.9
    vehicle = model.vehicle.with_parameter("propeller.thrust_constant", weak)
    run = subzero.simulate("fig6", model=dataclasses.replace(model, vehicle=vehicle))
    path = Path(tempfile.mkdtemp()) / "record.csv"
    write_csv(run[["surge_speed", "heading", "depth"]], path)
    return path


def diagnosed() -> str:
    """Diagnose a record at first sight; interrupted, a diagnosis ends with what it has."""
    verdict = subzero.diagnose(record(), "fig6", budget="screen")
    if not verdict.complete:
        raise KeyboardInterrupt
    return f"{verdict.verdict} {sorted(verdict.probabilities.items())}"


FEW = (fig6, driven, pulled_out, towed, held)
QUICK = (fig6, untethered, stepped, result, driven, pulled_out, lumped, printed, towed, held)


def interrupt(calculation: Calculation, within: float) -> bool:
    """Run a calculation, interrupted after a time [s]; say whether it was."""
    try:
        signal.setitimer(signal.ITIMER_REAL, within)
        calculation()
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    except KeyboardInterrupt:
        return True
    return False


def stop(*_: object) -> None:
    raise KeyboardInterrupt


def main(seed: int, count: int, calculations: tuple[Calculation, ...], longest: float) -> None:
    draw = random.Random(seed)
    before = {each: each() for each in calculations}  # compiles, too: so that interrupts are of calculations
    signal.signal(signal.SIGALRM, stop)
    came: Counter[str] = Counter()
    wrong: list[str] = []
    while came.total() < count:
        calculation, other = draw.choice(calculations), draw.choice(calculations)
        try:
            if not interrupt(calculation, longest * 10.0 ** draw.uniform(-3.0, 0.0)):
                continue
            came[calculation.__name__] += 1
            if other() != before[other]:
                wrong.append(f"{other.__name__} differs after an interrupt of {calculation.__name__}")
        except Exception:
            wrong.append(f"after an interrupt of {calculation.__name__}: {traceback.format_exc()[-600:]}")
            came["error"] += 1
    print(json.dumps({"interrupts": came.total(), "where": came, "wrong": wrong}))


if __name__ == "__main__":
    asked, longest = {"few": (FEW, 0.2), "all": (QUICK, 0.2), "diagnose": ((diagnosed,), 3.0)}[sys.argv[3]]
    main(int(sys.argv[1]), int(sys.argv[2]), asked, longest)
