"""What goes out can come in again: a straight line on a winch, and a cable that hangs.

A straight line that a winch holds at 0.6 N goes out and comes in with u = sin(πt/20 s) m/s, and

    T(0) = 0.6 N + (½ρπdC_t u|u| + m u′) S,        S = 1e-6 m + ∫u dt,  back to 1e-6 m

A hanging cable of 10 m is paid out by 2 m and reeled in again: force and shape must be those of before.
"""

from __future__ import annotations

import numpy as np

import cable

from .held_cable import going_to, share_per_second
from .invariance import HEAVY, worst_vector
from .row import Row, Setting, order_row

TABLE_1 = cable.CableProperties()
PERIOD, WINCH_TENSION = 40.0, 0.6


def to_and_fro(step: float) -> tuple[cable.History, np.ndarray]:
    """Pull a line out and let it in on a winch of constant tension; return T(0) of the closed form as well."""
    rate = 2.0 * np.pi / PERIOD
    run = cable.pull_out(
        lambda t: (np.sin(rate * t), 0.0, 0.0),
        PERIOD,
        drum=cable.ConstantTension(tension=WINCH_TENSION),
        scheme=cable.MovingEnd(time_step=step, segment_length=0.127),
    )
    u, length = np.sin(rate * run.time), (1.0 - np.cos(rate * run.time)) / rate + 1e-6
    load = TABLE_1.tangential_drag * u * np.abs(u) + TABLE_1.mass_per_length * rate * np.cos(rate * run.time)
    return run, WINCH_TENSION + load * length


def line_rows(quick: bool) -> list[Row]:
    """Compare a straight line that goes out to 12.7 m, in 100 segments, and comes in again."""
    steps, source = (0.2, 0.1, 0.05) if quick else (0.4, 0.2, 0.1, 0.05), "(7), straight"
    refined, setting = [], Setting("out and in on a line", source, 1e-4)
    for step in steps:
        run, exact = to_and_fro(step)
        refined.append(setting.worst(run.tow_tension[1:], exact[1:], WINCH_TENSION, f"T(0), {step:g} s"))
    back = Setting("out and in on a line", "start", 1e-7, "m").row(
        float(run.length[-1]), 1e-6, float(run.length.max()), "length at the end, per longest"
    )
    slope = order_row("out and in on a line", steps, [row.error for row in refined], "Δt", source)
    return [refined[-1], slope, back]


def hanging_rows() -> list[Row]:
    """Compare a hanging cable before and after two metres more have hung there for a while."""

    def rate(t: float) -> float:
        out, back = (
            share_per_second(t - 60.0) if t > 60.0 else 0.0,
            share_per_second(t - 120.0) if t > 120.0 else 0.0,
        )
        return 10.0 * share_per_second(t) + 2.0 * (out - back)

    run = cable.pull_out(
        going_to((9.0, 0.0, 0.0)),
        200.0,
        cable=HEAVY,
        drum=cable.PayOutRate(rate=rate),
        scheme=cable.MovingEnd(time_step=0.5, segment_length=0.1),
    )
    if not run.outcome.completed:
        raise RuntimeError(run.outcome.message)
    before = int(np.searchsorted(run.time, 59.75))
    force = worst_vector(
        "a hanging cable, out and in", run.tow_force[-1:], run.tow_force[before : before + 1], 1e-4
    )
    deepest = [run.shapes[k][:, 2].max() for k in (-1, before)]
    sag = Setting("a hanging cable, out and in", "before", 1e-4, "m").row(*map(float, deepest), what="sag")
    return [force, sag]


def rows(quick: bool) -> list[Row]:
    """Compare what comes back with where it was."""
    return [*line_rows(quick), *hanging_rows()]
