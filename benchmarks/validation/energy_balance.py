"""Where the tow point's work goes: into motion, stretch and weight, drag, the drum and the water (`moving_end.energy`):

    −F·U(0) = dE/dt + L − G + D_S + M + C,        U = V − J

The balance of forces times U, integrated along the cable, is an identity; a run books both sides with the trapezoidal
rule over its steps, and the residual is the error of step and segment. Shown: the sum of residuals, as a share
of all work and loss, after smooth manoeuvres: the dive and the helix of Table 1 with friction at the drum; a helix with
a heavy elastic cable, a drum with inertia, and a sheared current; the umbilical on its winch.

The umbilical starts softly and without cable in the water: one that lies there without tension when a winch pulls at
it with 60 N is stretched in an instant, and what that jolt costs does not get less with the step. What is missing from
the elastic helix changes its sign on the way, so its slope is shown without a verdict. At 3 cm all have to miss no more
than the second order makes of a thousandth at half a metre.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import cable

from .formulations import history
from .manoeuvres import MANOEUVRES, SHEARED, Manoeuvre, ramp
from .row import Row, order_row

CROSSES_ZERO = ("elastic helix",)
"""What is missing changes its sign on the way: a slope through that tells no order, and is shown without a verdict."""
HEAVY = cable.CableProperties(mass_per_length=0.0055, compliance=0.05)
SOURCE = "cable/moving_end/energy.py"
ELASTIC = {
    "cable": HEAVY,
    "current": SHEARED,
    "drum": cable.DrumProperties(friction_torque=0.03, inertia=0.0005),
}


def softly(t: float) -> tuple[float, float, float]:
    """Return the velocity of the umbilical's vehicle, growing from rest in three seconds. [m/s]."""
    north, east, down = MANOEUVRES["umbilical"].velocity(t)
    return north, east, down * ramp(t / 3.0)


UMBILICAL = MANOEUVRES["umbilical"].settings | {"start": 0.0}
RUNS = {name: MANOEUVRES[name] for name in ("dive", "helix")}
RUNS["umbilical"] = Manoeuvre(softly, 28.0, UMBILICAL)
RUNS["elastic helix"] = Manoeuvre(MANOEUVRES["helix"].velocity, 24.0, ELASTIC)


@cache
def missing(name: str, segment_length: float, step: float) -> float:
    """Return what is missing at the end of a manoeuvre, as a share. [-]."""
    run = history(RUNS[name], "moving_end", segment_length, step)
    if not run.outcome.completed:
        raise RuntimeError(run.outcome.message)
    return run.outcome.energy_residual


def share(name: str, q: float = 1.0) -> Row:
    """Return what is missing at q · half a metre and q · a tenth of a second, against nothing; q² of it may be."""
    found = missing(name, 0.5 * q, 0.1 * q)
    what = f"{name}, {0.5 * q:g} m, {0.1 * q:g} s: missing share"
    gate = 1e-3 * q * q
    return Row(
        name=what, ours=found, reference=0.0, error=found, gate=gate, source=SOURCE, measure="of all work"
    )


def rows(quick: bool) -> list[Row]:
    """Show what is missing, and how it falls with step and segment."""
    found = [share(name) for name in RUNS]
    for name in () if quick else RUNS:
        sizes = (0.5, 0.25, 0.125, 0.0625)
        errors = [missing(name, 0.5 * q, 0.1 * q) for q in sizes]
        order = order_row(name, sizes, errors, "both", SOURCE)
        found.append(replace(order, gate=np.inf) if name in CROSSES_ZERO else order)
        found.append(share(name, sizes[-1]))
    return found
