"""Bad headings in healthy records: does one bad compass sample spoil a comparison, or a diagnosis?

    python -m benchmarks.diagnosis.headings [--count 200] [--diagnose 4] [--seed 0]

Each record is a run across north with white noise (heading 0.4°, yaw rate 0.3°/s), with and without a logged yaw rate.
One of these is done to its heading as a compass shows it, 0 to 360°: a sample averaged across north, samples shifted by
179°, a second interpolated across north, a gap of 20 s in the turn, or all rows of that gap lost. Reported:
how many have a heading error (RMSE) within 10 % of the same record's before, how many diagnoses say that nothing is
wrong, and how many ended in an exception.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import numpy as np

import subzero
from subzero.records.record import Record, fit, modelled, with_heading_of

NOISE = {
    "surge_speed": 0.015,
    "heading": 0.4,
    "yaw_rate": 0.3,
    "pitch": 0.2,
    "roll_angle": 0.3,
    "depth": 0.015,
}
WITHIN = 1.1
TRIALS = {
    "turn": (330.0, 7.0),
    "straight": (357.0, 0.5),
}

Rng = np.random.Generator
Change = Callable[[Record, Rng], Record]


def _with(record: Record, heading: np.ndarray) -> Record:
    return Record(source=record.source, time=record.time, values={**record.values, "heading": heading})


def _crossings(heading: np.ndarray) -> np.ndarray:
    return np.flatnonzero(np.abs(np.diff(heading)) > 180.0)


def averaged(record: Record, rng: Rng) -> Record:
    """Average some samples around a crossing of north, as numbers."""
    heading = record.values["heading"].copy()
    at, share = int(rng.choice(_crossings(heading))), rng.uniform(0.2, 0.8)
    heading[at] = share * heading[at] + (1.0 - share) * heading[at + 1]
    return _with(record, heading)


def flipped(record: Record, rng: Rng) -> Record:
    """Show the other end of the needle in one to five samples, together or not."""
    heading = record.values["heading"].copy()
    at = rng.choice(heading.size, int(rng.integers(1, 6)), replace=False)
    heading[at] = (heading[at] + 179.0) % 360.0
    return _with(record, heading)


def interpolated(record: Record, rng: Rng) -> Record:
    """Interpolate a second around a crossing of north, as numbers."""
    heading = record.values["heading"].copy()
    at = int(rng.choice(_crossings(heading)))
    low = max(at - int(rng.integers(0, 10)), 0)
    high = min(low + 10, heading.size - 1)
    if abs(heading[high] - heading[low]) < 180.0:  # noise has gone back over north
        low, high = at, at + 1
    inside = np.arange(low, high + 1)
    heading[inside] = np.interp(inside, [low, high], heading[[low, high]])
    return _with(record, heading)


def gap(record: Record, rng: Rng) -> Record:
    """Leave 20 s of the heading empty."""
    begin = rng.uniform(1.0, 9.0)
    lost = (record.time > begin) & (record.time < begin + 20.0)
    return _with(record, np.where(lost, np.nan, record.values["heading"]))


def lost_rows(record: Record, rng: Rng) -> Record:
    """Lose all rows of 20 s."""
    begin = rng.uniform(1.0, 9.0)
    kept = (record.time <= begin) | (record.time >= begin + 20.0)
    values = {name: column[kept] for name, column in record.values.items()}
    return Record(source=record.source, time=record.time[kept], values=values)


CHANGES: tuple[Change, ...] = (averaged, flipped, interpolated, gap, lost_rows)


def measured(run, rng: Rng, with_rate: bool) -> Record:
    """Return what usual sensors log of a run."""
    time = run["time"].values
    values = {name: run[name].values + sd * rng.standard_normal(time.size) for name, sd in NOISE.items()}
    values["heading"] %= 360.0
    if not with_rate:
        del values["yaw_rate"]
    return Record(source="record", time=time, values=values)


def rmse(run, record: Record) -> float:
    """Return the error of the heading as `subzero compare` reports it."""
    return fit(run, with_heading_of(record, modelled(run, "heading", record.time)), "heading").rmse


def scenario(folder: Path, heading: float, rudder: float) -> Path:
    """Write fig6 with another heading at the start and another rudder to the end."""
    text = (resources.files("scenarios") / "trials" / "fig6.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^heading_deg = [^#]*", f"heading_deg = {heading} ", text)
    text = re.sub(r"(?m)^rudder_deg .*$", f"rudder_deg = [0.0, {rudder}, {rudder}]", text)
    path = folder / f"heading_{heading:g}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def main() -> None:
    """Corrupt, compare and diagnose."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--diagnose", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    trials = {name: scenario(folder, *numbers) for name, numbers in TRIALS.items()}
    runs = {name: subzero.simulate(trial) for name, trial in trials.items()}
    near, healthy, broken, worst = 0, 0, 0, 0.0
    for k in range(args.count):
        rng = np.random.default_rng([args.seed, k])
        change, name = CHANGES[k % len(CHANGES)], list(TRIALS)[(k // len(CHANGES)) % 2]
        clean = measured(runs[name], rng, with_rate=bool(k // (2 * len(CHANGES)) % 2))
        bad = change(clean, rng)
        try:
            ratio = rmse(runs[name], bad) / rmse(runs[name], clean)
            near, worst = near + (ratio < WITHIN), max(worst, ratio)
            if not ratio < WITHIN:
                print(f"{k}: {change.__name__}, {name}: {ratio:.2f} times")
            if k < args.diagnose:
                verdict = subzero.diagnose(bad, trials[name], budget="verdict").verdict
                healthy += verdict == "nothing_wrong"
                print(f"{k}: {change.__name__}, {name}: {verdict}", flush=True)
        except Exception as error:
            broken += 1
            print(f"{k}: {change.__name__}, {name}: {type(error).__name__}: {error}")
    print(f"{near} of {args.count} within 10 %, worst {worst:.2f} times; {broken} exceptions; "
          f"{healthy} of {args.diagnose} diagnoses say that nothing is wrong")  # fmt: skip


if __name__ == "__main__":
    main()
