"""Where the tow point's work goes: into motion, stretch and weight, drag, the drum and the water (`cable.energy`):

    −F·U(0) = dE/dt + L − G + D_S + M + C,        U = V − J

The balance of forces times U, integrated along the cable, is an identity; a run books both sides with the trapezoidal
rule over its steps, and what is missing is the error of step and segment. Shown: the sum of what is missing, as a share
of all work and loss, after smooth manoeuvres: the dive and the helix of Table 1 with friction at the drum; a helix with
a heavy elastic cable, a drum with inertia, and a sheared current; the umbilical on its winch.

In a current the books, not the motion, are of first order: water that passes the drum works on T(S) t(S), and D_S takes
for t(S) the direction of the last segment, half a segment away.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import cable

from .formulations import history
from .manoeuvres import MANOEUVRES, SHEARED, Manoeuvre
from .row import Row, order_row

HEAVY = cable.CableProperties(mass_per_length=0.0055, compliance=0.05)
SOURCE = "cable/energy.py"
ELASTIC = {
    "cable": HEAVY,
    "current": SHEARED,
    "drum": cable.DrumProperties(friction_torque=0.03, inertia=0.0005),
}
RUNS = {name: MANOEUVRES[name] for name in ("dive", "helix", "umbilical")}
RUNS["elastic helix"] = Manoeuvre(MANOEUVRES["helix"].velocity, 24.0, ELASTIC)


@cache
def missing(name: str, segment_length: float, step: float) -> float:
    """Return what is missing at the end of a manoeuvre, as a share. [-]."""
    run = history(RUNS[name], "moving_end", segment_length, step)
    if not run.outcome.completed:
        raise RuntimeError(run.outcome.message)
    return run.outcome.energy_residual


def share(name: str) -> Row:
    """Return what is missing at half a metre and a tenth of a second, against nothing."""
    found = missing(name, 0.5, 0.1)
    gate = np.inf if "current" in RUNS[name].settings else 1e-3
    what = f"{name}, 0.5 m, 0.1 s: missing share"
    return Row(
        name=what, ours=found, reference=0.0, error=found, gate=gate, source=SOURCE, measure="of all work"
    )


def rows(quick: bool) -> list[Row]:
    """Show what is missing, and how it falls with step and segment."""
    found = [share(name) for name in RUNS]
    for name in () if quick else RUNS:
        sizes = (0.5, 0.25, 0.125, 0.0625)
        errors = [missing(name, 0.5 * q, 0.1 * q) for q in sizes]
        row = order_row(name, sizes, errors, "both", SOURCE)
        in_current = "current" in RUNS[name].settings
        found.append(replace(row, gate=np.inf) if in_current else row)
    return found
