"""Cascaded tanks: a real process whose textbook model lacks one effect; python examples/cascaded_tanks/tanks.py.

A pump fills the upper tank, which drains into the lower one, whose level is measured (Schoukens et al. 2016, see
SOURCE.txt). The documented answer: the upper tank overflows, in part into the lower one.
"""

import sys
from pathlib import Path

import numpy as np

import subzero.diagnosis as sd

DATA = Path(__file__).with_name("dataBenchmark.csv")


def tanks(p, u, t):
    """Return the level that the sensor shows: Bernoulli's law for both valves, Euler steps of a second."""
    pump, inflow, spill = u["pump"], u["inflow"], p["overflow"]
    upper, lower, shown, h = p["upper0"] + 0 * inflow[0], p["lower0"] + 0 * inflow[0], [], (t[1] - t[0]) / 4
    for i in range(len(t)):
        shown.append(lower)
        for _ in range(4):
            through = p["k2"] * np.sqrt(np.maximum(upper, 0.0))
            over = spill["rate"] * np.maximum(upper - spill["lip"], 0.0)
            out = p["k3"] * np.maximum(lower, 0.0) ** p["exponent"]
            lower = lower + h * (through - out + spill["share"] * over)
            upper = upper + h * (p["k4"] * pump[i] + inflow[i] - p["k1"] / p["k2"] * through - over)
    return {"level": np.array(shown)}


def number(name):
    """Return a constant of a valve or of the pump, hardly known."""
    return sd.Number(name, 0.05, tolerance=0.03, low=0.005)


overflow = sd.Cause(
    "overflow",
    "the upper tank overflows",
    lip=sd.Number(9.0, scale=2.0),
    rate=sd.Number(0.2, scale=0.2, low=0.0),
    share=sd.Number(0.5, scale=0.3, low=0.0, high=1.0),
    off={"rate": 0.0},
)
valve = sd.Cause("lower_valve", "the lower valve has another law", changes={"exponent": 0.2})


def model(causes=(overflow, valve)):
    """Return the base model. Its unknown inflow is what Bernoulli's law and the pump's curve miss."""
    return sd.Model(
        tanks if overflow in causes else lambda p, u, t: tanks({**p, "overflow": NONE}, u, t),
        channels={"level": sd.Sensor(noise=0.02, high=10.0, unit="V")},
        inputs=["pump"],
        parameters=[
            *map(number, ("k1", "k2", "k3", "k4")),
            sd.Number("exponent", 0.5, tolerance=0.01),
            sd.Start("upper0", 5.0, tolerance=4.0, low=0.0),
            sd.Start("lower0", 5.0, tolerance=0.5, low=0.0),
        ],
        causes=causes,
        unknown=[sd.Unknown("inflow", size=0.03, time=20.0)],
        batch=True,
    )


NONE = {"rate": 0.0, "lip": 0.0, "share": 0.0}


def read(kind):
    """Return the record for estimation ("Est") or validation ("Val")."""
    return sd.read(DATA, time="4 s", level=f"y{kind}", pump=f"u{kind}", name=kind)


if __name__ == "__main__":
    told = "-q" not in sys.argv
    verdict = sd.diagnose(
        read("Est"), model(), held_out=read("Val"), progress=lambda share, words: told and print(words)
    )
    print(verdict)
    verdict.plot().savefig("tanks.png", dpi=150)
