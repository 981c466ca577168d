"""What a sea bed costs a trial: `rov_umbilical`, whose vehicle goes to 44.6 m and whose cable would hang to 63.9 m.

    python -m benchmarks.sea_bed

Deepest node, rows with cable on the bed, iterations of the cable in an exchange (mean and most), and the processor time
of a run against the one without a bed, the ratio of medians of runs in turn.
"""

from __future__ import annotations

import statistics
from time import process_time

import numpy as np

import subzero

BEDS = (0.0, 80.0, 50.0, 46.0)
"""Depths; 0 is no bed. [m]"""
REPEATS = 3
HEAD = ("bed [m]", "deepest node [m]", "rows on the bed", "iterations, mean", "most", "ms a step", "ratio")


def deepest(run) -> np.ndarray:
    """Return the depth of the deepest node in every row (rows,). [m]"""
    nodes = run["cable_position"].values[:, :, 2]
    return np.nanmax(nodes - nodes[0, 0], axis=1) + float(run["depth"][0])


def timed(trial) -> float:
    """Return the processor time of a run. [s]"""
    started = process_time()
    subzero.simulate(trial)
    return process_time() - started


def main() -> None:
    trial = subzero.load_scenario("rov_umbilical")
    trials = {bed: trial.with_changes({"water.sea_bed_m": bed}) for bed in BEDS}
    runs = {bed: subzero.simulate(each) for bed, each in trials.items()}  # compiles, too
    times = [{bed: timed(each) for bed, each in trials.items()} for _ in range(REPEATS)]
    print(f"| {' | '.join(HEAD)} |\n" + "|---" * len(HEAD) + "|")
    for bed, run in runs.items():
        depth, iterations = deepest(run), np.diff(run["newton_iterations"].values)
        cost = 1e3 * statistics.median(row[bed] for row in times) * trial.cable_step / trial.duration
        ratio = statistics.median(row[bed] / row[0.0] for row in times)
        lies = int((depth > bed).sum()) if bed else 0
        cells = (f"{bed:g}", f"{depth.max():.3f}", f"{lies} of {depth.size}", f"{iterations.mean():.2f}",
                 f"{iterations.max():.0f}", f"{cost:.3f}", f"{ratio:.2f}")  # fmt: skip
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
