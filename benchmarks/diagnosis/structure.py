"""Structure errors that no candidate holds: how often is a cause or an error in the data named all the same?

    python -m benchmarks.diagnosis.structure [--runs 200] [--seed 1]

A driven oscillator with a second mass on a soft spring (2 to 30 %), a drive that is rounded by a lag of the first order
or a drive that comes late; records of 15 to 60 s with noise of 0.2 to 3 % of the motion. Everything else is as the
model says, so each name is an invention. The model offers stiffness, damping, drive and a hardening spring.
"""

from __future__ import annotations

import argparse
import collections
import sys
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm

import subzero.diagnosis as sd
from subzero.jit import compiled

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "identification"))
import oscillator  # the ten-line model of the tests

STEP = 0.1
KINDS = ("second mass", "rounded drive", "late drive")


@compiled
def integrated(
    k: np.ndarray, c: np.ndarray, gain: np.ndarray, a: np.ndarray, force: np.ndarray, h: float, x: np.ndarray
) -> None:
    """Fill the motion x (n, sets) of the model of the tests, `oscillator.oscillator`, under forces (n, sets)."""
    for j in range(x.shape[1]):
        at, v = 0.0, 0.0
        for i in range(x.shape[0]):
            x[i, j] = at
            drive = gain[j] * force[i, j]
            for _ in range(2):
                a1 = drive - k[j] * at - c[j] * v - a[j] * at**3
                b, w = at + h / 2 * v, v + h / 2 * a1
                a2 = drive - k[j] * b - c[j] * w - a[j] * b**3
                b, w = at + h / 2 * v + h**2 / 4 * a1, v + h / 2 * a2
                a3 = drive - k[j] * b - c[j] * w - a[j] * b**3
                b, w = at + h * v + h**2 / 2 * a2, v + h * a3
                a4 = drive - k[j] * b - c[j] * w - a[j] * b**3
                at, v = at + h * v + h**2 / 6 * (a1 + a2 + a3), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def simulate(p: Mapping[str, Any], u: Mapping[str, Any], t: np.ndarray) -> dict[str, np.ndarray]:
    """Return what `oscillator.oscillator` does, of many sets of parameters, compiled."""
    x = np.empty((t.size, p["k"].size))
    force = np.ascontiguousarray(np.broadcast_to(u["force"], x.shape))
    integrated(p["k"], p["c"], p["gain"], p["cubic"]["a"], force, (t[1] - t[0]) / 2, x)
    return {"x": x}


def drive(rng: np.random.Generator, samples: int) -> np.ndarray:
    """Return a command: steps of random length, or a random sum of sines."""
    if rng.random() < 0.5:
        hold = int(rng.integers(5, 25))
        return np.repeat(rng.choice([-1.0, 0.0, 1.0], samples // hold + 1), hold)[:samples]
    t = STEP * np.arange(samples)
    return (
        sum(
            np.sin(w * t + p)
            for w, p in zip(*rng.uniform([[0.3], [0.0]], [[3.0], [6.3]], (2, 4)), strict=True)
        )
        / 2.0
    )


def exact(force: np.ndarray, second: float) -> np.ndarray:
    """Return the motion under a force that is constant within fine steps, with a second mass on a soft spring."""
    soft, drag = 9.0 * second, 0.05 * second
    whole = np.zeros((5, 5))
    whole[:4, :4] = [
        [0.0, 1.0, 0.0, 0.0],
        [-4.0 - soft, -0.3 - drag, soft, drag],
        [0.0, 0.0, 0.0, 1.0],
        [9.0, 0.05, -9.0, -0.05],
    ]
    whole[1, 4] = 1.0
    fine = STEP / 10
    step = expm(whole * fine)
    state, x = np.zeros(4), np.zeros(force.size)
    for i, each in enumerate(force):
        x[i] = state[0]
        state = step[:4, :4] @ state + step[:4, 4] * each
    return x[::10]


def run(seed: int) -> tuple[str, float, str, tuple[str, ...]]:
    """Return kind and size of the structure error, the kind of verdict, and what is named."""
    rng = np.random.default_rng(seed)
    samples, kind = int(rng.integers(150, 600)), KINDS[seed % len(KINDS)]
    command = drive(rng, samples)
    force, second, size = np.repeat(command, 10), 0.0, 0.0
    if kind == "second mass":
        size = second = float(np.exp(rng.uniform(np.log(0.02), np.log(0.3))))
    elif kind == "rounded drive":
        size = float(rng.uniform(0.05, 0.6))
        keep, level, rounded = np.exp(-STEP / 10 / size), 0.0, np.zeros(force.size)
        for i, each in enumerate(force):
            level = keep * level + (1.0 - keep) * each
            rounded[i] = level
        force = rounded
    else:
        size = float(rng.uniform(0.05, 0.5))
        late = round(size / STEP * 10)
        force = np.concatenate([np.zeros(late), force[: force.size - late]])
    x = exact(force, second)
    noise = float(np.exp(rng.uniform(np.log(0.002), np.log(0.03)))) * float(np.std(x))
    record = sd.Record(
        STEP * np.arange(samples), {"x": x + noise * rng.standard_normal(samples), "force": command}
    )
    model = oscillator.model(simulate=simulate, channels={"x": sd.Sensor(noise=noise, unit="m")})
    verdict = sd.diagnose(record, model)
    return kind, size, verdict.verdict, tuple(each.id for each in verdict.named)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    asked = parser.parse_args()
    kinds: collections.Counter[tuple[str, str]] = collections.Counter()
    with ProcessPoolExecutor(asked.processes) as pool:
        for k, (kind, size, verdict, named) in enumerate(
            pool.map(run, range(asked.seed, asked.seed + asked.runs))
        ):
            kinds[kind, "named" if named else verdict] += 1
            if named:
                print(f"seed {asked.seed + k}: {kind} {size:.3g}: {verdict}: {', '.join(named)}", flush=True)
    for (kind, verdict), count in sorted(kinds.items()):
        print(f"{kind:<16}{verdict:<16}{count:>6}")


if __name__ == "__main__":
    main()
