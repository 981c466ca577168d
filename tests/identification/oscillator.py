"""A driven oscillator as a model of a user, and records of it by another code: exact steps of the linear equations."""

import numpy as np
from scipy.linalg import expm

import subzero.diagnosis as sd

NOISE, STEP = 0.01, 0.1


def oscillator(p, u, t):
    """Runge-Kutta, one set of parameters or many."""
    x = v = np.zeros(np.broadcast_shapes(np.shape(p["k"]), np.shape(u["force"][0])))
    h, shown = (t[1] - t[0]) / 2, []

    def acceleration(x, v, force):
        return force - p["k"] * x - p["c"] * v - p["cubic"]["a"] * x**3

    for force in p["gain"] * u["force"]:
        shown.append(x)
        for _ in range(2):
            a1 = acceleration(x, v, force)
            a2 = acceleration(x + h / 2 * v, v + h / 2 * a1, force)
            a3 = acceleration(x + h / 2 * v + h**2 / 4 * a1, v + h / 2 * a2, force)
            a4 = acceleration(x + h * v + h**2 / 2 * a2, v + h * a3, force)
            x, v = x + h * v + h**2 / 6 * (a1 + a2 + a3), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return {"x": np.array(shown)}


def model(*, unknown=True, causes=("stiffness", "damping", "drive", "cubic"), **more):
    every = {
        "stiffness": sd.Cause("stiffness", "the spring has another stiffness", changes={"k": 0.8}),
        "damping": sd.Cause("damping", "the damper has another damping", changes={"c": 0.2}),
        "drive": sd.Cause("drive", "the drive has another gain", changes={"gain": 0.2}),
        "cubic": sd.Cause("cubic", "the spring hardens", a=sd.Number(0.0, scale=1.0), off={"a": 0.0}),
    }
    given = {
        "simulate": oscillator,
        "channels": {"x": sd.Sensor(noise=NOISE, unit="m")},
        "inputs": ["force"],
        "parameters": [
            sd.Number("k", 4.0, tolerance=0.04),
            sd.Number("c", 0.3, tolerance=0.01),
            sd.Number("gain", 1.0, tolerance=0.01),
        ],
        "causes": [every[name] for name in causes],
        "unknown": [sd.Unknown("command:force", size=0.01, time=0.5)] if unknown else [],
        "batch": True,
    }
    return sd.Model(**{**given, **more})


def record(seed, *, k=4.0, c=0.3, gain=1.0, second=0.0, samples=300):
    """Return a record of an oscillator, with a second mass on a soft spring if it is given: steps are exact."""
    rng = np.random.default_rng(seed)
    force = np.repeat(rng.choice([-1.0, 1.0], samples // 10), 10)
    soft, drag = 9.0 * second, 0.05 * second
    A = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-k - soft, -c - drag, soft, drag],
            [0.0, 0.0, 0.0, 1.0],
            [9.0, 0.05, -9.0, -0.05],
        ]
    )
    whole = np.zeros((5, 5))
    whole[:4, :4], whole[1, 4] = A, gain
    step = expm(whole * STEP)
    state, x = np.zeros(4), []
    for each in force:
        x.append(state[0])
        state = step[:4, :4] @ state + step[:4, 4] * each
    noisy = np.array(x) + NOISE * rng.standard_normal(samples)
    return sd.Record(STEP * np.arange(samples), {"x": noisy, "force": force})
