"""What a sea bed costs a trial: `rov_umbilical`, whose vehicle goes to 44.6 m and whose cable would hang to 63.9 m; and
the same trial of a shallower dive, to 26.6 m with cable to 55.3 m, over a bed at 30 m.

    python -m benchmarks.sea_bed

Deepest node, rows with cable on the bed, iterations of the cable in an exchange (mean and most), and the processor time
of a run against the one without a bed, the ratio of medians of runs in turn.
"""

from __future__ import annotations

import statistics
from dataclasses import replace
from time import process_time

import numpy as np

import subzero

CASES = ((0.0, 1.0), (80.0, 1.0), (50.0, 1.0), (46.0, 1.0), (0.0, 0.55), (30.0, 0.55))
"""Depths of the bed, 0 is none [m], and the share of the trial's pitch that the vehicle dives with [-]."""
REPEATS = 3
HEAD = (
    "bed [m]",
    "dive to [m]",
    "deepest node [m]",
    "rows on the bed",
    "iterations, mean",
    "most",
    "ms a step",
    "ratio",
)


def deepest(run) -> np.ndarray:
    """Return the depth of the deepest node in every row (rows,). [m]"""
    nodes = run["cable_position"].values[:, :, 2]
    return np.nanmax(nodes - nodes[0, 0], axis=1) + float(run["depth"][0])


def timed(trial) -> float:
    """Return the processor time of a run. [s]"""
    started = process_time()
    subzero.simulate(trial)
    return process_time() - started


def trial_of(bed: float, dive: float):
    """Return the trial of a case."""
    trial = subzero.load_scenario("rov_umbilical").with_changes({"water.sea_bed_m": bed})
    return replace(trial, motion=replace(trial.motion, pitch=dive * np.asarray(trial.motion.pitch)))


def main() -> None:
    trials = {case: trial_of(*case) for case in CASES}
    runs = {case: subzero.simulate(each) for case, each in trials.items()}  # compiles, too
    times = [{case: timed(each) for case, each in trials.items()} for _ in range(REPEATS)]
    print(f"| {' | '.join(HEAD)} |\n" + "|---" * len(HEAD) + "|")
    for (bed, dive), run in runs.items():
        depth, iterations, trial = deepest(run), np.diff(run["newton_iterations"].values), trials[bed, dive]
        cost = 1e3 * statistics.median(row[bed, dive] for row in times) * trial.cable_step / trial.duration
        ratio = statistics.median(row[bed, dive] / row[0.0, dive] for row in times)
        lies = int((depth > bed).sum()) if bed else 0
        cells = (f"{bed:g}", f"{run['depth'].values.max():.1f}", f"{depth.max():.3f}", f"{lies} of {depth.size}",
                 f"{iterations.mean():.2f}", f"{iterations.max():.0f}", f"{cost:.3f}", f"{ratio:.2f}")  # fmt: skip
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
