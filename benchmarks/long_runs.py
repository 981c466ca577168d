"""Long cables and long hours: what segments that grow far from the vehicle change, and what a long run costs.

    python -m benchmarks.long_runs              # all of it: some minutes
    python -m benchmarks.long_runs force        # how much the default far segments change the tow force
    python -m benchmarks.long_runs cost         # 30 minutes with 2 km, 10 hours with 10 km, 5 minutes as a file

`force`: each manoeuvre is run with even segments, and with those that are joined far from its ends (`far_grading`); the
change is that of the force on the vehicle, as a share of its largest value, at any time. `cost`: each run is a process
of its own; seconds are CPU time.
"""

from __future__ import annotations

import dataclasses
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

import scenarios
import subzero
from subzero.simulation.run import run_trial

GRADINGS = (0.05, 0.1, 0.2)
MINUTES = 20.0
MIB = 1024.0**2


def straight(t: np.ndarray) -> np.ndarray:
    """Go straight ahead."""
    return 0.0 * t


def winding(t: np.ndarray) -> np.ndarray:
    """Swing to both sides, two minutes each way."""
    return 2.0 * np.sin(2.0 * np.pi * t / 240.0)


def lawn_mower(t: np.ndarray) -> np.ndarray:
    """Go up and down parallel lanes: a turn about every three minutes, to alternate sides."""
    return np.where(np.mod(t, 180.0) < 20.0, np.where(np.mod(t, 360.0) < 180.0, 4.0, -4.0), 0.0)


def circles(t: np.ndarray) -> np.ndarray:
    """Go round and round, behind a minute straight ahead."""
    return np.where(t < 60.0, 0.0, 0.6)


def sharp(t: np.ndarray) -> np.ndarray:
    """Turn sharply every ten minutes."""
    return np.where((np.mod(t, 600.0) > 300.0) & (np.mod(t, 600.0) < 310.0), 12.0, 0.0)


RUDDERS = {one.__name__: one for one in (straight, winding, lawn_mower, circles, sharp)}
"""Manoeuvre → rudder over time [degree]."""


def trial_of(
    rudder: str = "straight",
    minutes: float = MINUTES,
    propeller: float = 48.0,
    wet_length: float = 0.0,
    **fields: object,
) -> scenarios.Trial:
    """Return fig6 with other commands: a rudder, a propeller that makes about a metre a second on the cable; and with
    so much cable [m] in the water at the start.
    """
    fig6 = subzero.load_scenario("fig6")
    times = np.arange(0.0, 60.0 * minutes, 1.0)
    values = np.zeros((times.size, 4))
    values[:, 0], values[:, 1] = propeller, np.radians(RUDDERS[rudder](times))
    commands = scenarios.Commands(time=times, values=values)
    start = dataclasses.replace(fig6.start, wet_length=wet_length)
    made: scenarios.Trial = dataclasses.replace(
        fig6, duration=60.0 * minutes, commands=commands, start=start, **fields
    )
    return made


CASES = {
    **{name: {"rudder": name} for name in RUDDERS},
    "winding in a cross current": {"rudder": "winding", "current": (0.05, 0.1, 0.0)},
    "straight, a cable that sinks": {"heavy": True},
}
"""What the change of the force is measured in."""


def case(name: str, minutes: float = MINUTES, **fields: object) -> scenarios.Trial:
    """Return the trial of a case."""
    words = dict(CASES[name]) | fields
    heavy = words.pop("heavy", False)
    trial = trial_of(minutes=minutes, **words)  # type: ignore[arg-type]
    if heavy:
        cable, drum = (
            dict(trial.cable) | {"mass_per_length": 0.0052},
            dict(trial.drum) | {"friction_torque": 0.05},
        )
        trial = dataclasses.replace(trial, cable=cable, drum=drum)
    return trial


def force_of(trial: scenarios.Trial) -> tuple[np.ndarray, int, float, float]:
    """Return the force on the vehicle (times, 3) [N], how many segments and how much cable there are at the end, and
    the CPU time [m, s].
    """
    started = process_time()
    run = run_trial(dataclasses.replace(trial, every=trial.duration), subzero.Model.of(trial), tethered=True)
    if not run.completed:
        raise subzero.UserError(run.message)
    trace, length = run.recording.trace, float(run.recording.length[-1])
    return trace[:, :3], int(trace[-1, 3]) - 1, length, process_time() - started


def change_of_force(trial: scenarios.Trial, far_grading: float, even: np.ndarray) -> tuple[float, int, float]:
    """Return how much a grading changes the force, how many segments it takes, and the CPU time [-, -, s]."""
    force, segments, _, seconds = force_of(dataclasses.replace(trial, far_grading=far_grading))
    largest = np.linalg.norm(even, axis=1).max()
    return float(np.linalg.norm(force - even, axis=1).max() / largest), segments, seconds


def tell_force(minutes: float) -> None:
    """Print how much far segments change the tow force."""
    print(
        f"Change of the tow force by segments that are joined far from both ends, in {minutes:g} min (CPU s)\n"
    )
    head = ["manoeuvre", "cable [m]", "even", *(f"far_grading = {g:g}" for g in GRADINGS)]
    print("| " + " | ".join(head) + " |\n" + "|---" * len(head) + "|")
    for name in CASES:
        trial = case(name, minutes, cable_step=0.2)
        even, segments, length, seconds = force_of(dataclasses.replace(trial, far_grading=0.0))
        cells = [name, f"{length:.0f}", f"{segments} segments, {seconds:.1f} s"]
        for grading in GRADINGS:
            change, count, took = change_of_force(trial, grading, even)
            cells.append(f"{change:.1e}, {count} segments, {took:.1f} s")
        print("| " + " | ".join(cells) + " |", flush=True)


LONG = {
    "30 minutes, 2 km": {"minutes": 30.0, "wet_length": 1100.0},
    "30 minutes, 2 km, every second": {"minutes": 30.0, "wet_length": 1100.0, "every": 1.0},
    "5 minutes of fig6": {"minutes": 5.0, "propeller": 25.0},
    "10 hours, 10 km, every 10 s": {
        "minutes": 600.0, "propeller": 20.0, "wet_length": 7000.0, "cable_step": 1.0, "every": 10.0,
    },
}  # fmt: skip
"""What a long run costs."""


def measure(name: str) -> dict[str, float]:
    """Return what a long run costs, files and all but figures, in this process."""
    from subzero.files.atomic_output import open_output_folder
    from subzero.results.netcdf_csv import write_run

    subzero.simulate("fig6")  # whatever is loaded or compiled once
    trial, started = trial_of(**LONG[name]), process_time()  # type: ignore[arg-type]
    run = subzero.simulate(trial)
    took = process_time() - started
    with tempfile.TemporaryDirectory() as folder:
        with open_output_folder(Path(folder) / "run") as output_folder:
            write_run(run, output_folder, "tethered")
        size = (Path(folder) / "run" / "tethered.nc").stat().st_size
    accuracy = json.loads(run.attrs["accuracy"])
    return {
        "cable [m]": float(run["cable_length"][-1]),
        "segments": float(run["node_count"].max()) - 1.0,
        "run [CPU s]": took,
        "writing [CPU s]": process_time() - started - took,
        "memory [MiB]": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "netCDF [MB]": size / 1e6,
        "force error": accuracy["force_error"],
        "halvings": accuracy["halvings"],
    }


def tell_cost() -> None:
    """Print what long runs cost, each in a process of its own."""
    rows = {}
    for name in LONG:
        command = [sys.executable, "-m", "benchmarks.long_runs", "measure", name]
        rows[name] = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        if len(rows) == 1:
            print("| run | " + " | ".join(rows[name]) + " |\n" + "|---" * (1 + len(rows[name])) + "|")
        print(f"| {name} | " + " | ".join(f"{value:.3g}" for value in rows[name].values()) + " |", flush=True)


def main(words: list[str]) -> None:
    """Print what was asked for."""
    if words[:1] == ["measure"]:
        print(json.dumps(measure(words[1])))
        return
    if words[:1] in ([], ["force"]):
        tell_force(float(words[1]) if words[1:] else MINUTES)
    if words[:1] in ([], ["cost"]):
        tell_cost()


if __name__ == "__main__":
    main(sys.argv[1:])
