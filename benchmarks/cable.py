"""What the cable costs: a node, a simulated second at a given error, an hour of pay-out.

    python -m benchmarks.cable

Times are those of the processor in a warm process, the least of several runs: machines are shared, so nothing is
asserted. An error is that of the tow force, as a vector, against a run of the same scheme with far smaller segments and
steps, as a share of the largest force; the worst of all recorded times but the first second and the 0.6 s about the
kinks of the motion at 10 and 20 s. What others cost: `python -m benchmarks.peers`.
"""

from __future__ import annotations

from functools import cache
from math import cos, radians, sin
from time import process_time

import numpy as np

import cable

REPEATS = 5
DURATION = 30.0


def dive(t: float) -> tuple[float, float, float]:
    """Return the tow point's velocity of case (ii), section 4.1: 60 degrees nose down between 10 and 20 s. [m/s]"""
    theta = -radians(6.0 * min(max(t - 10.0, 0.0), 10.0))
    swing = 0.5 * (-radians(6.0) if 10.0 < t < 20.0 else 0.0)
    c, s = cos(theta), sin(theta)
    return c + swing * s, 0.0, -s + swing * c


def least(run, repeats=REPEATS):
    """Return the result of a run and its least time. [s]"""
    result, best = run(), np.inf
    for _ in range(repeats):
        start = process_time()
        result = run()
        best = min(best, process_time() - start)
    return result, best


def table(title, columns, rows):
    """Print a Markdown table, and return its rows."""
    print(f"\n### {title}\n\n| {' | '.join(columns)} |\n|{' --- |' * len(columns)}")
    kept = []
    for row in rows:
        print(f"| {' | '.join(row)} |", flush=True)
        kept.append(row)
    return kept


def per_node():
    """Yield rows: how an iteration of Newton's method grows with the number of nodes."""
    for segments in (30, 100, 1000, 10_000, 100_000):
        length, steps = 0.3 * segments, 10
        run, seconds = least(
            lambda length=length, steps=steps: cable.tow(
                lambda t: (1.0, 0.2 * np.sin(t), 0.0),
                length,
                0.1 * steps,
                scheme=cable.MovingEnd(segment_length=0.3),
            ),
            2,
        )
        cost = seconds / (run.outcome.iterations * segments)
        yield f"{segments:,}", f"{run.outcome.iterations / steps:.1f}", f"{1e6 * cost:.2f}"


def worst_error(run, reference):
    """Return the largest error of the tow force after the first second, as a share of the largest force."""
    exact = np.array([np.interp(run.time, reference.time, reference.tow_force[:, i]) for i in range(3)]).T
    smooth = (np.abs(run.time - 10.0) > 0.6) & (np.abs(run.time - 20.0) > 0.6) & (run.time > 1.0)
    return np.linalg.norm(run.tow_force - exact, axis=1)[smooth].max() / reference.tow_tension.max()


def pay_out(segment, step, rtol=0.0, tolerance=1e-9):
    """Run the dive, paying out."""
    return cable.pull_out(
        dive,
        DURATION,
        scheme=cable.MovingEnd(time_step=step, segment_length=segment, rtol=rtol, tolerance=tolerance),
    )


def tow_30(segment, step, rtol=0.0, tolerance=1e-9):
    """Run the dive with 30 m of cable in tow."""
    return cable.tow(
        dive,
        30.0,
        DURATION,
        scheme=cable.MovingEnd(time_step=step, segment_length=segment, rtol=rtol, tolerance=tolerance),
    )


CASES = {
    "pay-out": (
        pay_out,
        1e-3,
        (
            (1.0, 0.5, 0.0),
            (1.0, 0.25, 0.0),
            (0.75, 0.25, 0.0),
            (0.75, 0.1, 0.0),
            (0.5, 0.25, 0.0),
            (0.5, 0.1, 0.0),
            (0.25, 0.1, 0.0),
            (0.75, 0.5, 1e-2),
            (0.5, 0.5, 1e-2),
            (0.5, 0.25, 0.0, 1e-5),
        ),
    ),
    "tow, 30 m": (
        tow_30,
        2e-4,
        (
            *((0.3, step, 0.0) for step in (1.0, 0.5, 0.25, 1.0 / 7.0, 0.125, 0.1, 0.05)),
            *((0.3, 0.5, rtol) for rtol in (1e-2, 3e-3, 1e-3)),
            *((0.3, 1.0 / 7.0, 0.0, tolerance) for tolerance in (1e-7, 1e-5)),
        ),
    ),
}
"""Manoeuvre: how to run it, the error that is asked for, and what to try: segment [m], step [s], rtol, tolerance."""


@cache
def reference(name):
    """Return the run that the others are compared with."""
    return CASES[name][0](0.0625, 0.0125)


@cache
def measured(name, *grid):
    """Return milliseconds per simulated second, the error, and how many steps."""
    run, seconds = least(lambda: CASES[name][0](*grid))
    return 1e3 * seconds / DURATION, worst_error(run, reference(name)), run.outcome.steps


def manoeuvres():
    """Yield rows: error against cost of the dive of section 4.1, paid out, and towed with 30 m of cable."""
    for name, (_, wanted, grids) in CASES.items():
        for grid in grids:
            cost, error, steps = measured(name, *grid)
            segment, step, rtol, tolerance = (*grid, 1e-9)[:4]
            met = "yes" if error <= wanted else ""
            yield (
                name,
                f"{segment:g}",
                f"{step:.3g}",
                f"{rtol:g}",
                f"{tolerance:g}",
                f"{steps}",
                f"{cost:.3f}",
                f"{error:.1e}",
                met,
            )


def wander(t):
    """Go at 1 m/s along a gently winding way."""
    return 1.0, 0.1 * np.sin(0.05 * t), 0.0


def long_runs():
    """Yield rows: what minutes of pay-out at 1 m/s cost, with segments of one length and with growing ones."""
    for minutes in (1, 2, 5, 10, 20, 60):
        for grading in (0.0, 0.02):
            run, seconds = least(
                lambda minutes=minutes, grading=grading: cable.pull_out(
                    wander,
                    60.0 * minutes,
                    scheme=cable.MovingEnd(time_step=0.5, segment_length=1.0, grading=grading),
                ),
                1,
            )
            nodes, force = len(run.shapes[-1]), run.tow_tension[-1]
            cost = f"{seconds:.2f}", f"{seconds / (60.0 * minutes):.5f}"
            yield f"{minutes}", f"{grading:g}", f"{run.length[-1]:.0f}", f"{nodes}", *cost, f"{force:.4f}"


if __name__ == "__main__":
    columns = ("segments", "iterations per step", "µs per node and iteration")
    table("A node of a Newton iteration", columns, per_node())
    columns = (
        "manoeuvre",
        "segment [m]",
        "step [s]",
        "rtol",
        "tolerance",
        "steps",
        "ms per simulated second",
    )
    columns += ("worst error", "within 1e-3 (pay-out), 2e-4 (tow)")
    table("Error against cost: the dive of section 4.1", columns, manoeuvres())
    columns = ("minutes", "grading", "cable at the end [m]", "nodes", "seconds", "of real time", "T(0) [N]")
    table("Pay-out at 1 m/s, steps of 0.5 s", columns, long_runs())
