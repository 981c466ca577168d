"""Healthy records whose logger filled in values: is anything found wrong with them?

    python -m benchmarks.diagnosis.sampled [--count 100] [--seed 0]

Records of fig6 with white noise, whose channels, all or some, come from 1, 2 or 5 Hz and are held, interpolated, or
averaged over the rows between and held, at 10 Hz. Reported: how many diagnoses say that something is wrong.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

import subzero
from benchmarks.diagnosis.headings import measured, scenario
from subzero.records.record import Record

KINDS = ("interpolated", "held", "averaged")
EVERY = (10, 5, 2)
"""Rows between two measurements, of 0.1 s each."""


def filled_in(values: np.ndarray, kind: str, every: int) -> np.ndarray:
    """Return what a logger writes of a slower sensor (n,)."""
    rows = np.arange(values.size)
    if kind == "interpolated":
        return np.interp(rows, rows[::every], values[::every])
    if kind == "averaged":
        means = np.add.reduceat(values, rows[::every]) / np.add.reduceat(np.ones(values.size), rows[::every])
        return means[rows // every]
    return values[rows // every * every]


def main() -> None:
    """Fill in, and diagnose."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    path = scenario(Path(tempfile.mkdtemp()), 27.0, 0.0)
    run, wrong = subzero.simulate(path), 0
    for k in range(args.count):
        rng = np.random.default_rng([args.seed, k])
        kind, every = KINDS[k % 3], EVERY[k // 3 % 3]
        record = measured(run, rng, with_rate=True)
        values = {
            name: filled_in(column, kind, every) if k % 2 == 0 or rng.random() < 0.5 else column
            for name, column in record.values.items()
        }
        made = Record(source="record", time=record.time, values=values)
        verdict = subzero.diagnose(made, path, budget="verdict").verdict
        wrong += verdict != "nothing_wrong"
        print(f"{k}: {kind} every {0.1 * every:g} s: {verdict}", flush=True)
    print(f"{wrong} of {args.count} have a false verdict")


if __name__ == "__main__":
    main()
