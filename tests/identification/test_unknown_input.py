"""An input that is 0 in a healthy model, and acts as nobody knows: a term that competes with causes and data errors.

Verifies: a hidden force on one of two carts is named, on the right one, with its history, to 3 standard deviations at
95 % of the knots; beside a cause, and in the second of two records; a cause and an error in the data are named as what
they are; a healthy record names nothing. What noise takes is a closed form.
Truth is exact: steps of the linear equations with a force that is linear between its knots; the model integrates by
Runge-Kutta.
"""

import json

import numpy as np
import pytest
from scipy.linalg import expm

import subzero.diagnosis as sd

NOISE, STEP, SAMPLES = 0.01, 0.1, 300
PUSHES = ("left", "right")


def carts(p, u, t):
    """Two carts on springs, and a spring between them: Runge-Kutta, one set of parameters or many."""
    h, shown = t[1] - t[0], []

    def slope(state, forces):
        x, v = state[:2], state[2:]
        return np.concatenate([v, forces - p["k"] * x - p["c"] * v - p["s"] * (x - x[::-1])])

    pushes = np.array([u[name] for name in PUSHES])
    drive = p["gain"] * u["drive"] + 0.0 * pushes[0]
    state = np.zeros((4, *pushes.shape[2:]))
    for i in range(len(t)):
        shown.append(state[:2])
        begin, end = (pushes[:, j] + np.array([drive[i], 0.0 * drive[i]]) for j in (i, min(i + 1, len(t) - 1)))
        a1 = slope(state, begin)
        a2 = slope(state + h / 2 * a1, (begin + end) / 2)
        a3 = slope(state + h / 2 * a2, (begin + end) / 2)
        a4 = slope(state + h * a3, end)
        state = state + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return dict(zip(("a", "b"), np.swapaxes(shown, 0, 1), strict=True))


def model(**more):
    given = {
        "channels": {name: sd.Sensor(noise=NOISE, unit="m") for name in "ab"},
        "inputs": ["drive"],
        "parameters": [
            sd.Number("k", 4.0, tolerance=0.04),
            sd.Number("c", 0.3, tolerance=0.01),
            sd.Number("s", 2.0, tolerance=0.02),
            sd.Number("gain", 1.0, tolerance=0.01),
        ],
        "causes": [
            sd.Cause("stiffness", "the springs have another stiffness", changes={"k": 0.8}),
            sd.Cause("damping", "the carts have another damping", changes={"c": 0.2}),
            sd.Cause("drive", "the drive has another gain", changes={"gain": 0.2}),
        ],
        "unknown": [
            sd.Unknown(
                name, size=0.3, time=2.0, usual=False, sentence=f"something pushes the {name} cart", unit="N"
            )
            for name in PUSHES
        ],
        "batch": True,
    }
    return sd.Model(carts, **{**given, **more})


def hidden(seed, size=0.3):
    """Return a force at knots every 2 s."""
    return size * np.random.default_rng([seed, 1]).standard_normal(16)


def record(seed, *, k=4.0, c=0.3, s=2.0, gain=1.0, **pushes):
    """Return a record of the carts, pushed by forces with some values at knots every 2 s."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(SAMPLES)
    drive = np.repeat(rng.choice([-1.0, 1.0], SAMPLES // 10), 10)
    knots = np.linspace(time[0], time[-1], 16)
    forces = np.array([np.interp(time, knots, pushes.get(name, np.zeros(16))) for name in PUSHES])
    A = np.zeros((9, 9))  # carts, drive, pushes, and their slopes
    A[0, 2] = A[1, 3] = 1.0
    A[2, :6], A[3, :7] = [-k - s, s, -c, 0.0, gain, 1.0], [s, -k - s, 0.0, -c, 0.0, 0.0, 1.0]
    A[5, 7] = A[6, 8] = 1.0
    step, state, shown = expm(A * STEP), np.zeros(4), []
    slopes = np.diff(forces, append=forces[:, -1:]) / STEP
    for i in range(SAMPLES):
        shown.append(state[:2])
        state = (step @ np.concatenate([state, [drive[i]], forces[:, i], slopes[:, i]]))[:4]
    a, b = np.array(shown).T + NOISE * rng.standard_normal((2, SAMPLES))
    return sd.Record(time, {"a": a, "b": b, "drive": drive})
