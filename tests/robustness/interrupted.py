"""Interrupt calculations at random times, many times over, in this process: run as a child process by the tests.

    python tests/robustness/interrupted.py SEED COUNT

A timer raises `KeyboardInterrupt` wherever Python code runs then, as Ctrl-C does. Prints, as JSON, how many interrupts
came, where calculations were, and whether a run after all of them is the one before, to the last bit.
"""

from __future__ import annotations

import json
import random
import signal
import sys
from collections import Counter
from collections.abc import Callable

import numpy as np

import cable
import subzero

COMMAND = (25.0, 0.2, 0.0, 0.0)


def fig6() -> None:
    subzero.simulate("fig6")


def untethered() -> None:
    subzero.simulate("fig6", tethered=False)


def stepped() -> None:
    sim = subzero.Simulator("fig6")
    for _ in range(300):
        sim.step(COMMAND)


def driven_on(sim: subzero.Simulator) -> Callable[[], None]:
    """Return a calculation that drives the same simulator on, whatever interrupted it before."""

    def drive() -> None:
        if sim.time > 60.0:
            sim.reset()
        for _ in range(100):
            before = sim.time
            sim.step(COMMAND)
            assert sim.time > before

    return drive


def pulled_out() -> None:
    cable.pull_out(lambda t: (1.0, 0.2 * t, 0.0), 10.0, 0.1)


def lumped() -> None:
    cable.pull_out(lambda t: (1.0, 0.2 * t, 0.0), 5.0, 0.1, scheme="lumped")


def printed() -> None:
    cable.pull_out(lambda t: (1.0, 0.2 * t, 0.0), 5.0, 0.5, scheme="paper")


def interrupt(calculation: Callable[[], None], within: float) -> bool:
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


def main(seed: int, count: int) -> None:
    draw = random.Random(seed)
    sim = subzero.Simulator("fig6")
    calculations = [fig6, untethered, stepped, driven_on(sim), pulled_out, lumped, printed]
    for calculation in calculations:  # compile before, so that interrupts are of calculations
        calculation()
    before = subzero.simulate("fig6")
    signal.signal(signal.SIGALRM, stop)
    came: Counter[str] = Counter()
    while came.total() < count:
        calculation = draw.choice(calculations)
        if interrupt(calculation, 10.0 ** draw.uniform(-4.0, -0.7)):
            came[calculation.__name__] += 1
    signal.signal(signal.SIGALRM, signal.SIG_IGN)
    sim.result()
    after = subzero.simulate("fig6")
    same = all(np.array_equal(before[name], after[name], equal_nan=True) for name in before.data_vars)
    print(json.dumps({"interrupts": came.total(), "where": came, "same": bool(same)}))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
