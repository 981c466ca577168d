"""Noise of real sensors, for records of the benchmark: ``python -m benchmarks.diagnosis.sensor_noise FOLDER``.

What is left of measured channels after a smooth curve, parabolas over 9 or over 25 samples, in robust standard
deviations: the curve is the motion, what is left is what a sensor adds to it, with the tails and steps that no formula
has; behind the longer window, its wander and some motion too. The command makes ``kept/sensor_noise.jsonl`` from the
folders ``seaglider_sg180`` and ``bolt_auv``:

    series            sensors                                                        licence
    sg180 dive 2-6    compass, pitch, roll, pressure of a Seaglider; a sample every  BSD-3-Clause, (c) 2023
                      5 s and more; the same of its current profiler (dives 5, 6)    University of Washington
    bolt              roll, pitch, heading, depth of a student AUV in a pool,        MIT, (c) 2025
                      a sample every 0.1 to 0.5 s                                    Samer Mansour

from github.com/iop-apl-uw/basestation3 (testdata) and github.com/SamMans/AUV-Simulator.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import cyclopts
import numpy as np
import pandas as pd
from scipy.signal import savgol_filter
from scipy.stats import median_abs_deviation

KEPT = Path(__file__).parent / "kept" / "sensor_noise.jsonl"
WINDOWS, ORDER = (9, 25), 2
"""Of the smooth curves: samples, degree."""
SHORTEST = 50
"""A series of fewer samples is left out."""
FARTHEST = 8.0
"""Values beyond that are manoeuvres that the curve does not follow: the series ends there. [robust sd]"""
DIVES = range(2, 7)
app = cyclopts.App(
    name="python -m benchmarks.diagnosis.sensor_noise", help_format="plaintext", version_flags=[]
)


def cut(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return so many successive samples of a sensor's noise, of either sign, in robust standard deviations.

    A series that is too short is gone through to and fro.
    """
    noise = rng.choice([-1.0, 1.0]) * _series()[int(rng.integers(len(_series())))]
    noise = noise[:: int(rng.choice([-1, 1]))]
    there_and_back = np.concatenate([noise, noise[::-1]])
    start = int(rng.integers(noise.size - min(noise.size, count) + 1))
    return np.resize(there_and_back, start + count)[start:]


@cache
def _series() -> list[np.ndarray]:
    """Return all series that are kept."""
    return [np.array(json.loads(line)["noise"]) for line in KEPT.read_text().splitlines()]


@app.default
def make(folder: Path) -> None:
    """Make the kept noise from measured data.

    Args:
        folder: with the folders of both vehicles.
    """
    pieces = {
        f"{name}, {window} samples, {k}": piece.round(2).tolist()
        for name, values in _measured(folder)
        for window in WINDOWS
        for k, piece in enumerate(_noise(values, window))
    }
    KEPT.write_text(
        "".join(json.dumps({"series": key, "noise": value}) + "\n" for key, value in pieces.items())
    )
    print(f"{len(pieces)} series, {sum(map(len, pieces.values()))} samples")


def _measured(folder: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Return all channels, angles without jumps."""
    glider = pd.read_csv(folder / "seaglider_sg180" / "vehicle.csv.gz")
    profiler = pd.read_csv(folder / "seaglider_sg180" / "ad2cp.csv.gz")
    for table, columns in (
        (glider, ("eng_head", "eng_pitchAng", "eng_rollAng", "depth")),
        (profiler, ("ad2cp_heading", "ad2cp_pitch", "ad2cp_roll")),
    ):
        for dive in DIVES:
            for column in columns:
                values = table.loc[table["dive"] == dive, column].dropna().to_numpy(float)
                yield f"sg180 {dive} {column}", np.unwrap(values, period=360.0)
    for file in sorted((folder / "bolt_auv").glob("*.csv")):
        table = pd.read_csv(file)
        for column in ("Roll (rad)", "Pitch (rad)", "Yaw (rad)", "Z (m)"):
            steered = ("Yaw" in column) == (
                "aw" in file.name
            )  # steps that an autopilot asks for are no noise
            if column in table and not steered and np.ptp(table[column]) > 0.0:
                yield f"bolt {file.stem} {column}", np.unwrap(table[column].dropna().to_numpy(float))


def _noise(values: np.ndarray, window: int) -> Iterator[np.ndarray]:
    """Return what a smooth curve leaves, in pieces between manoeuvres."""
    if values.size < SHORTEST:
        return
    left = values - savgol_filter(values, window, ORDER)
    left = (left - np.median(left)) / median_abs_deviation(left, scale="normal")
    ends = np.concatenate([[-1], np.flatnonzero(np.abs(left) > FARTHEST), [left.size]])
    for before, after in itertools.pairwise(ends):
        if after - before > SHORTEST:
            yield left[before + 1 : after]


if __name__ == "__main__":
    app()
