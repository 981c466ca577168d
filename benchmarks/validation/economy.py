"""Steps as small as an error allows (`rtol`), and segments that get longer towards the drum (`grading`).

A 30 m cable is towed into the helix of 5 m radius, in segments of half a metre, with rows every 0.4 s and `rtol` in
between; the error is that of the steps alone, against the same segments in steps of 1/320 s. `rtol` is what one step
may err by, by an estimate; errors of steps add up where the cable follows its own way. So the gate is 3 `rtol`:
from 3e-4 down the whole errs by more than `rtol` (by 1.3 to 2.9 times). On so even a motion equal steps are cheaper;
steps are chosen for motions that are even only in part.

(Between two rows the way of the tow point is a cubic through their velocities: rows 0.8 s apart would leave 2e-4.)

Then a vehicle winds along at 1 m/s for 600 s and pays out 560 m off a drum with friction. Segments are 1 m long at the
vehicle and 1 m + grading · s at the drum's side; against segments that are all 1 m long, the error of the force at all
times, and how many segments there are at the end. Work goes with their number.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from matplotlib.figure import Figure

import cable

from .manoeuvres import MANOEUVRES
from .row import Row

EVERY = 0.4
"""Time between rows. [s]"""
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
GRADINGS = (0.01, 0.02, 0.05, 0.1)
SOURCE = {"rtol": "steps of 1/320 s", "grading": "segments of 1 m"}


@cache
def towed(step: float, rtol: float, heavy: bool = True) -> cable.History:
    """Tow a cable into a helix."""
    way = MANOEUVRES["helix"]
    properties = cable.CableProperties(mass_per_length=0.01) if heavy else None
    return cable.tow(
        way.velocity, 30.0, way.duration, cable=properties, scheme=cable.MovingEnd(time_step=step, rtol=rtol)
    )


def step_error(step: float, rtol: float, heavy: bool = True) -> float:
    """Return the error of the force at the rows, as a share of the largest force. [-]."""
    ours, fine = towed(step, rtol, heavy), towed(EVERY / 128, 0.0, heavy)
    skipped = round(EVERY / step)
    return worst(ours.tow_force[::skipped][1:], fine.tow_force[::128][1:])


def worst(ours: np.ndarray, reference: np.ndarray) -> float:
    """Return the worst distance of two force histories (n, 3), over the largest force. [-]."""
    return float(np.linalg.norm(ours - reference, axis=1).max() / np.linalg.norm(reference, axis=1).max())


def winding(t: float) -> tuple[float, float, float]:
    """Go at 1 m/s, with a soft start, 30° to both sides and 6° up and down. [m/s]."""
    heading, pitch = 0.5 * np.sin(2.0 * np.pi * t / 120.0), -0.1 * np.sin(2.0 * np.pi * t / 200.0)
    speed = 1.0 - np.exp(-((t / 3.0) ** 2))
    return (
        float(speed * np.cos(pitch) * np.cos(heading)),
        float(speed * np.cos(pitch) * np.sin(heading)),
        float(-speed * np.sin(pitch)),
    )


@cache
def paid_out(grading: float) -> cable.History:
    """Wind along for ten minutes."""
    drum = cable.DrumProperties(friction_torque=0.005)
    return cable.pull_out(
        winding, 600.0, drum=drum, scheme=cable.MovingEnd(time_step=0.5, segment_length=1.0, grading=grading)
    )


def graded_error(grading: float) -> float:
    """Return the error of the force from 10 s on, as a share of the largest force. [-]."""
    return worst(paid_out(grading).tow_force[20:], paid_out(0.0).tow_force[20:])


def segments(run: cable.History) -> int:
    """Return how many segments there are at the end."""
    return len(run.shapes[-1]) - 1


def allowed(rtol: float, heavy: bool) -> Row:
    """Compare an error with what is allowed."""
    error, steps = step_error(EVERY, rtol, heavy), towed(EVERY, rtol, heavy).outcome.steps
    name = f"{'heavy' if heavy else 'neutral'} tow, rtol = {rtol:g}, {steps} steps: error per rtol"
    return Row(
        name=name,
        ours=error / rtol,
        reference=0.0,
        error=error,
        gate=3.0 * rtol,
        source=SOURCE["rtol"],
        measure="force",
    )


def coarser(grading: float, gate: float) -> Row:
    """Compare how many segments there are, and judge what that costs in the force."""
    ours, even = segments(paid_out(grading)), segments(paid_out(0.0))
    name = f"10 minutes, grading = {grading:g}: segments at the end"
    return Row(
        name=name,
        ours=ours,
        reference=even,
        error=graded_error(grading),
        gate=gate,
        source=SOURCE["grading"],
        measure="of the force",
    )


def rows(quick: bool) -> list[Row]:
    """Compare errors with the tolerances that were asked for, and what graded segments cost."""
    found = [
        allowed(rtol, heavy)
        for heavy in (False, True)
        for rtol in (TOLERANCES[1::2] if quick else TOLERANCES)
    ]
    gates = dict(zip(GRADINGS, (1e-4, 1e-4, 1e-4, 1e-3), strict=True))
    return found + [coarser(g, gates[g]) for g in ((0.02,) if quick else GRADINGS)]


def draw(figure: Figure) -> None:
    """Draw errors over the number of steps, and over the number of segments."""
    left, right = figure.subplots(1, 2)
    fixed = [EVERY / n for n in (1, 2, 4, 8, 16)]
    left.loglog([24.0 / h for h in fixed], [step_error(h, 0.0) for h in fixed], ".-", label="equal steps")
    steps = [towed(EVERY, rtol).outcome.steps for rtol in TOLERANCES]
    left.loglog(steps, [step_error(EVERY, rtol) for rtol in TOLERANCES], "o-", markersize=4, label="rtol")
    for n, rtol in zip(steps, TOLERANCES, strict=True):
        left.annotate(
            f"{rtol:g}", (n, step_error(EVERY, rtol)), fontsize=6, xytext=(4, 3), textcoords="offset points"
        )
    left.set(xlabel="steps in 24 s", ylabel="error of the tow force")
    left.legend(frameon=False)
    counts = [segments(paid_out(g)) for g in GRADINGS]
    right.loglog(counts, [graded_error(g) for g in GRADINGS], "o-", markersize=4)
    for n, g in zip(counts, GRADINGS, strict=True):
        right.annotate(f"{g:g}", (n, graded_error(g)), fontsize=6, xytext=(4, 3), textcoords="offset points")
    right.axvline(segments(paid_out(0.0)), color="0.7", label="all of 1 m")
    right.set(xlabel="segments after 10 minutes", ylabel="error of the tow force")
    right.set_xticks([50, 100, 200, 500], ["50", "100", "200", "500"])
    right.minorticks_off()
    right.legend(frameon=False)
