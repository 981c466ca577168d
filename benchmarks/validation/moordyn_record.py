"""What MoorDyn 2 said, kept in `data/moordyn_2.csv` so that every machine can compare with it.

    python -m benchmarks.validation.moordyn_record        runs MoorDyn (extra `peers`) and writes the record anew

`python -m benchmarks.validation` does so too where MoorDyn is installed. Rows are 0.2 s apart, in seven digits: time
since the manoeuvre began, force on the tow point north, east, down, and the tension that MoorDyn reports for the end
segment. Of the straight tow and of the pay-out only the end is kept. `data/SOURCE.txt` says how it was made.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import cable
from benchmarks.cable import dive
from benchmarks.peers.moordyn_wire import HEAVY, NEUTRAL, Bare, Towed, tow

FILE = Path(__file__).parent / "data" / "moordyn_2.csv"
COLUMNS = ("run", "time_s", "north_N", "east_N", "down_N", "end_tension_N")
LENGTH, DURATION = 30.0, 30.0
"""Of the wire [m], of a manoeuvre [s]"""
LEAD_IN = 90.0
"""How long the heavy wire is towed straight first: MoorDyn starts it on a catenary. [s]"""
EVERY = 20
"""Of MoorDyn's exchanges, 0.01 s each, one is kept."""
STIFF = replace(NEUTRAL, compliance=1e-5)
"""For the straight tow: the drag grows with √(1 + eT) in our equations (7), and not in MoorDyn's."""

Motion = Callable[[float], tuple[float, float, float]]


def straight(_t: float) -> tuple[float, float, float]:
    """Go north at 1 m/s."""
    return 1.0, 0.0, 0.0


def spiral(t: float) -> tuple[float, float, float]:
    """Go straight, then turn at 0.3 rad/s and pitch down to 30 degrees, from 10 s to 20 s. [m/s]."""
    heading = 0.3 * min(max(t - 10.0, 0.0), 10.0)
    pitch = np.radians(-30.0) * min(max(0.2 * (t - 10.0), 0.0), 1.0)
    return np.cos(heading) * np.cos(pitch), np.sin(heading) * np.cos(pitch), -np.sin(pitch)


@dataclass(frozen=True)
class Trial:
    """A tow to compare: its motion, the wire, and how long it is towed straight before. [s]"""

    motion: Motion
    wire: Bare = NEUTRAL
    delay: float = 0.0

    def velocity(self, t: float) -> tuple[float, float, float]:
        """Return the velocity of the tow point. [m/s]."""
        return self.motion(max(t - self.delay, 0.0))

    def ours(self, step: float = 0.025) -> cable.History:
        """Return our run, with segments of 0.1 m."""
        return cable.tow(
            self.velocity,
            LENGTH,
            self.delay + DURATION,
            cable=self.wire,
            scheme=cable.MovingEnd(time_step=step, segment_length=0.1),
        )

    def theirs(self, segments: int) -> Towed:
        """Return MoorDyn's run, from the direction in which ours begins."""
        shape = cable.tow(self.velocity, LENGTH, 0.1, cable=self.wire).shapes[0]
        ahead = (shape[0] - shape[-1]) / np.linalg.norm(shape[0] - shape[-1])
        run = tow(self.velocity, LENGTH, self.delay + DURATION, segments, wire=self.wire, ahead=ahead)
        during = run.time > self.delay + 1e-9
        return kept(Towed(run.time[during] - self.delay, run.force[during], run.end_tension[during]), EVERY)


TRIALS = {
    "dive, neutral wire": Trial(dive),
    "spiral, neutral wire": Trial(spiral),
    "dive, heavy wire": Trial(dive, HEAVY, LEAD_IN),
}


def kept(run: Towed, every: int) -> Towed:
    """Return every so many rows of a run, the last among them."""
    return Towed(*(values[::-1][::every][::-1] for values in run))


def last(run: Towed) -> Towed:
    """Return the last row of a run."""
    return Towed(*(values[-1:] for values in run))


def runs() -> dict[str, Towed]:
    """Return all of MoorDyn's runs by name, the number of its segments at the end."""
    found = {"straight, 30": last(tow(straight, LENGTH, 10.0, 30, wire=STIFF))}
    for count in (30, 100):
        found[f"paid out, {count}"] = last(tow(straight, 10.0, 20.0, count, payout=1.0, held=True))
    for name, trial in TRIALS.items():
        counts = (30, 100) if trial.delay else (10, 30, 100)
        found |= {f"{name}, {count}": trial.theirs(count) for count in counts}
    return found


def renew() -> None:
    """Run MoorDyn and write the record."""
    with FILE.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for name, run in runs().items():
            for t, force, end in zip(*run, strict=True):
                table.writerow((name, *(f"{x:.7g}" for x in (t, *force, end))))
    recorded.cache_clear()


@cache
def recorded() -> dict[str, Towed]:
    """Return the record: MoorDyn's runs by name."""
    with FILE.open(newline="") as file:
        rows = list(csv.reader(file))[1:]
    found = {}
    for name in dict.fromkeys(row[0] for row in rows):
        table = np.array([row[1:] for row in rows if row[0] == name], dtype=float)
        found[name] = Towed(table[:, 0], table[:, 1:4], table[:, 4])
    return found


def is_possible() -> bool:
    """Say whether MoorDyn is installed."""
    return find_spec("moordyn") is not None


if __name__ == "__main__":
    renew()
