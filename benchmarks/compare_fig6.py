"""How long `subzero compare fig6` takes, beside its targets, in one run.

    python -m benchmarks.compare_fig6            inside a warm process, and as whole warm commands
    python -m benchmarks.compare_fig6 --cold     the first run ever as well: compiles everything, takes long

Each number is the least (and the median) of several runs, for other jobs may share the cores; the cold run, which is
run once, tells its CPU time too. Two trials of 30 s are simulated, with the cable and without, so "× real time" is
60 s over the time taken. Nothing here fails for being slow.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter

RUNS, COMMANDS = 15, 3
"""How often something is done inside this process, and how often a command is run."""
SUBZERO = Path(sys.executable).with_name("subzero")


@dataclass(frozen=True)
class Timing:
    """What was timed, how long each run took [s], its target [s], the time simulated in it [s], and remarks."""

    what: str
    times: list[float]
    target: float | None = None
    simulated: float = 0.0
    remark: str = ""

    def row(self) -> str:
        """Return a line of the table."""
        least, middle = min(self.times), median(self.times)
        target = "" if self.target is None else f"{self.target:g}"
        share = "" if self.target is None else f"{least / self.target:.2f}"
        speed = f"{self.simulated / least:.0f}" if self.simulated else ""
        return f"{self.what:<44}{least:9.3f}{middle:9.3f}{target:>8}{share:>9}{speed:>13}  {self.remark}"


HEAD = f"{'':<44}{'least s':>9}{'median s':>9}{'target':>8}{'of it':>9}{'× real time':>13}"


def timed(action: Callable[[], object], count: int) -> list[float]:
    """Return how long each of some runs takes. [s]."""
    times = []
    for _ in range(count):
        start = perf_counter()
        action()
        times.append(perf_counter() - start)
    return times


def inside() -> list[Timing]:
    """Time the library in this process, after one run that loads what is compiled."""
    import subzero

    trial = subzero.load_scenario("fig6")
    span = trial.duration
    subzero.compare("fig6")
    return [
        Timing("compare, warm process", timed(lambda: subzero.compare("fig6"), RUNS), 0.2, 2.0 * span),
        Timing("  tethered", timed(lambda: subzero.simulate(trial), RUNS), None, span),
        Timing("  untethered", timed(lambda: subzero.simulate(trial, tethered=False), RUNS), None, span),
        Timing("  reading the trial", timed(lambda: subzero.load_scenario("fig6"), RUNS)),
    ]


def command(*words: str, expected: int = 0, **environment: str) -> None:
    """Run a command line in an empty folder."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [SUBZERO, *words],
            cwd=folder,
            env=os.environ | environment,
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode != expected:
        raise SystemExit(f"subzero {' '.join(words)} ended with {done.returncode}:\n{done.stderr}")


def outside() -> list[Timing]:
    """Time whole commands, everything compiled."""
    command("compare", "fig6")
    return [
        Timing("subzero compare fig6, warm", timed(lambda: command("compare", "fig6"), COMMANDS), 4.0, 60.0),
        Timing("subzero --help", timed(lambda: command("--help"), COMMANDS), 0.5),
        Timing(
            "subzero compare fig66: a message",
            timed(lambda: command("compare", "fig66", expected=2), COMMANDS),
            0.5,
        ),
    ]


def first_ever() -> Timing:
    """Time the first run ever: nothing compiled, nothing in the cache."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as cache:
        times = timed(lambda: command("compare", "fig6", SUBZERO_CACHE_DIR=cache), 1)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    user, system = after.ru_utime - before.ru_utime, after.ru_stime - before.ru_stime
    remark = f"CPU: {user:.1f} s user, {system:.1f} s system"
    return Timing("subzero compare fig6, first run ever", times, 30.0, 60.0, remark)


def main() -> None:
    """Print the table."""
    print(HEAD)
    for timing in (*inside(), *outside()):
        print(timing.row(), flush=True)
    if "--cold" in sys.argv[1:]:
        print(first_ever().row())
    load = ", ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"{os.cpu_count()} cores; load over 1, 5, 15 min: {load}")


if __name__ == "__main__":
    main()
