"""How long `cable.hold` takes, and how often it finds nothing: ``python -m benchmarks.hold``.

Named problems with the time of a call and, for comparison, of a run that is led to the same rest with `cable.pull_out`
(two minutes of it, steps of 0.5 s); then random ones (`tests/exact/test_hold.py` draws them).
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from time import perf_counter

import numpy as np

import cable

from .validation.held_cable import held

HEAVY = cable.CableProperties(mass_per_length=0.02)
PLACES = {
    "catenary, 10 m": ((9.0, 0.0, 0.0), 10.0, (0.0, 0.0, 0.0)),
    "across a current, 10 m": ((9.0, 0.0, 0.0), 10.0, (0.0, 0.5, 0.0)),
    "oblique, 50 m": ((20.0, 5.0, 30.0), 50.0, (0.3, 0.2, 0.0)),
}
"""Where the vehicle is, how long the cable is, and how the water moves. [m], [m], [m/s]"""
TESTS = Path(__file__).parent.parent / "tests" / "exact" / "test_hold.py"


def best(call, repeats: int = 5) -> float:
    """Return the shortest time of a call. [s]."""
    times = []
    for _ in range(repeats):
        begin = perf_counter()
        call()
        times.append(perf_counter() - begin)
    return min(times)


def random_problems(count: int, seed: int):
    """Yield random problems."""
    spec = importlib.util.spec_from_file_location("test_hold", TESTS)
    tests = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tests)
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield tests.random_problem(rng)


def main(count: int = 2000, seed: int = 2) -> None:
    """Print both tables."""
    cable.hold(((9.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 10.0, cable=HEAVY)  # compiles
    print("problem                   hold [ms]  run [ms]  ratio")
    for name, (place, length, current) in PLACES.items():
        ends = (place, (0.0, 0.0, 0.0))
        ours = best(lambda e=ends, n=length, J=current: cable.hold(e, n, J, cable=HEAVY))
        held(HEAVY, place, length, 100, current)
        theirs = best(lambda p=place, n=length, J=current: held.__wrapped__(HEAVY, p, n, 100, J), 2)
        print(f"{name:25s} {1e3 * ours:9.2f}  {1e3 * theirs:8.1f}  {theirs / ours:5.0f}")
    times, failed = [], 0
    for ends, length, current, cord in random_problems(count, seed):
        begin = perf_counter()
        try:
            cable.hold(ends, length, current, cable=cord)
        except cable.HoldError:
            failed += 1
        times.append(1e3 * (perf_counter() - begin))
    share = 100.0 * (1.0 - failed / count)
    print(f"random: {count} problems, {failed} without an answer, {share:.2f} % solved;", end=" ")
    print(f"median {np.median(times):.1f} ms, 95 % within {np.quantile(times, 0.95):.0f} ms")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
