"""Where the tow point's work goes: into motion, stretch and weight, drag, the drum and the water (`cable.energy`):

    −F·U(0) = dE/dt + L − G + D_S + M + C,        U = V − J

The balance of forces times U, integrated along the cable, is an identity; a run books both sides with the trapezoidal
rule over its steps, and what is missing is the error of step and segment. Shown: the sum of what is missing, as a share
of all work and loss, after smooth manoeuvres: the dive and the helix of Table 1 with friction at the drum; a helix with
a heavy elastic cable, a drum with inertia, and a sheared current; the umbilical on its winch.

The umbilical starts softly and without cable in the water: one that lies there without tension when a winch pulls at
it with 60 N is stretched in an instant, and what that jolt costs does not get less with the step.
"""

from __future__ import annotations

from functools import cache

import cable

from .formulations import history
from .manoeuvres import MANOEUVRES, SHEARED, Manoeuvre, ramp
from .row import Row, order_row

MISSED = {
    "elastic helix: order in both, 4 refinements": "what is missing changes its sign on the way (1.5e-4 at 0.5 m; then "
    "2.4e-5, 9e-7, 2e-6, 1e-6 of all work), and a slope through that tells no order; it is below 3e-6 from 12 cm on.",
}
HEAVY = cable.CableProperties(mass_per_length=0.0055, compliance=0.05)
SOURCE = "cable/energy.py"
ELASTIC = {
    "cable": HEAVY,
    "current": SHEARED,
    "drum": cable.DrumProperties(friction_torque=0.03, inertia=0.0005),
}


def softly(t: float) -> tuple[float, float, float]:
    """Return the velocity of the umbilical's vehicle, growing from rest in three seconds. [m/s]."""
    north, east, down = MANOEUVRES["umbilical"].velocity(t)
    return north, east, down * ramp(t / 3.0)


UMBILICAL = MANOEUVRES["umbilical"].settings | {"wet_length": 0.0}
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


def share(name: str) -> Row:
    """Return what is missing at half a metre and a tenth of a second, against nothing."""
    found = missing(name, 0.5, 0.1)
    what = f"{name}, 0.5 m, 0.1 s: missing share"
    return Row(
        name=what, ours=found, reference=0.0, error=found, gate=1e-3, source=SOURCE, measure="of all work"
    )


def rows(quick: bool) -> list[Row]:
    """Show what is missing, and how it falls with step and segment."""
    found = [share(name) for name in RUNS]
    for name in () if quick else RUNS:
        sizes = (0.5, 0.25, 0.125, 0.0625)
        errors = [missing(name, 0.5 * q, 0.1 * q) for q in sizes]
        found.append(order_row(name, sizes, errors, "both", SOURCE))
    return found
