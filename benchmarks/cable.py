"""What the cable costs: per node and iteration, per simulated second, and against length.

    python -m benchmarks.cable

Prints three tables. Times are the least of several runs in a warm process, by the wall clock; errors are those of the
tow force against a run of the same scheme with segments and steps eight times smaller. Nothing is asserted: machines
are shared.
"""

from __future__ import annotations

from time import perf_counter

import numpy as np

import cable

REPEATS = 5


def dive(t: float) -> tuple[float, float, float]:
    """Return the tow point's velocity of case (ii), section 4.1: 60 degrees nose down between 10 and 20 s. [m/s]"""
    theta = -np.radians(6.0 * min(max(t - 10.0, 0.0), 10.0))
    swing = 0.5 * (-np.radians(6.0) if 10.0 < t < 20.0 else 0.0)
    c, s = np.cos(theta), np.sin(theta)
    return c + swing * s, 0.0, -s + swing * c


def least(run, repeats=REPEATS):
    """Return the result of a run and its least time. [s]"""
    result, best = run(), np.inf
    for _ in range(repeats):
        start = perf_counter()
        result = run()
        best = min(best, perf_counter() - start)
    return result, best


def table(title, columns, rows):
    """Print a Markdown table."""
    print(f"\n### {title}\n\n| {' | '.join(columns)} |\n|{' --- |' * len(columns)}")
    for row in rows:
        print(f"| {' | '.join(row)} |")


def per_node():
    """Yield rows: how a step of Newton's method grows with the number of nodes."""
    for segments in (30, 100, 1000, 10_000, 100_000):
        length, steps = 0.3 * segments, 10
        run, seconds = least(
            lambda length=length, steps=steps: cable.tow(
                lambda t: (1.0, 0.2 * np.sin(t), 0.0), length, 0.1 * steps, segment_length=0.3
            ),
            2,
        )
        cost = seconds / (run.outcome.iterations * segments)
        yield f"{segments:,}", f"{run.outcome.iterations / steps:.1f}", f"{1e6 * cost:.2f}"


def worst_error(run, reference):
    """Return the largest error of the tow force after the first second, as a share of the largest force."""
    exact = np.array([np.interp(run.time, reference.time, reference.tow_force[:, i]) for i in range(3)]).T
    kinks = (np.abs(run.time - 10.0) > 0.6) & (np.abs(run.time - 20.0) > 0.6) & (run.time > 1.0)
    return np.linalg.norm(run.tow_force - exact, axis=1)[kinks].max() / reference.tow_tension.max()


def manoeuvres():
    """Yield rows: the dive of section 4.1, paid out, and towed with a fixed length of 30 m."""
    for name, run_with, grids in (
        ("pay-out", pay_out, ((1.0, 0.5), (0.5, 0.25), (0.5, 0.1), (0.25, 0.1))),
        ("tow, 30 m", tow_30, ((0.3, 1.0), (0.3, 0.5), (0.3, 0.1))),
    ):
        reference = run_with(0.0625, 0.0125)
        for segment, step in grids:
            run, seconds = least(
                lambda segment=segment, step=step, run_with=run_with: run_with(segment, step)
            )
            error = worst_error(run, reference)
            yield name, f"{segment:g}", f"{step:g}", f"{1e3 * seconds / 30.0:.3f}", f"{error:.1e}"


def pay_out(segment, step):
    """Run the dive, paying out."""
    return cable.pull_out(dive, 30.0, step, segment_length=segment)


def tow_30(segment, step):
    """Run the dive with 30 m of cable in tow."""
    return cable.tow(dive, 30.0, 30.0, step, segment_length=segment)


def long_runs():
    """Yield rows: what minutes of pay-out at 1 m/s cost."""
    for minutes in (1, 2, 5, 10):
        run, seconds = least(
            lambda minutes=minutes: cable.pull_out(
                lambda t: (1.0, 0.1 * np.sin(0.05 * t), 0.0), 60.0 * minutes, 0.25, segment_length=0.5
            ),
            1,
        )
        yield f"{minutes}", f"{run.length[-1]:.0f}", f"{seconds:.2f}", f"{seconds / (60.0 * minutes):.4f}"


if __name__ == "__main__":
    columns = ("segments", "iterations per step", "µs per node and iteration")
    table("A node of a Newton iteration", columns, per_node())
    columns = (
        "manoeuvre",
        "segment [m]",
        "step [s]",
        "ms per simulated second",
        "worst error of the tow force",
    )
    table("The dive of section 4.1 (the half second after each kink left out)", columns, manoeuvres())
    columns = ("minutes", "cable at the end [m]", "seconds", "of real time")
    table("Pay-out at 1 m/s, segments of 0.5 m, steps of 0.25 s", columns, long_runs())
