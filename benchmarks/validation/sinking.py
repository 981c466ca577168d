"""A horizontal wire is let go in still water and sinks, all of it alike:

    m1 dV/dt = w_c − ½ρdC_n V²,      V = V_t tanh(t/τ),    V_t = √(w_c/½ρdC_n),    τ = m1/√(w_c ½ρdC_n)
    depth = V_t τ ln cosh(t/τ),      and the vehicle that tows it feels ½ρπdC_t u² L along it, and no weight

The wire is taut because it is towed along itself at u = 0.5 m/s, which changes nothing across (the drag across depends
on the speed across alone, and every place of a straight wire moves alike). Once the tow point sinks at V(t), and the
solution holds everywhere and at all times; once it keeps its depth, and the solution holds far from it until the
bend arrives: 30 m away, for 2 s. A drogue of 1e-9 m² only makes the tow start horizontally.
"""

from __future__ import annotations

from functools import cache

import numpy as np

import cable

from .row import Row, Setting, order_row

HEAVY = cable.CableProperties(mass_per_length=0.0098)
LENGTH, SPEED = 30.0, 0.5
TERMINAL = np.sqrt(HEAVY.weight_in_water / HEAVY.normal_drag)
"""V_t, 0.196 m/s. [m/s]"""
TAU = HEAVY.virtual_mass_per_length / np.sqrt(HEAVY.weight_in_water * HEAVY.normal_drag)
"""τ, 0.06 s. [s]"""
SOURCE = "(7) across"


@cache
def sinking(step: float, follows: bool) -> cable.History:
    """Let the wire go, with a tow point that sinks with it or stays."""

    def velocity(t: float) -> tuple[float, float, float]:
        return SPEED, 0.0, TERMINAL * np.tanh(t / TAU) if follows else 0.0

    return cable.tow(
        velocity,
        LENGTH,
        2.0,
        cable=HEAVY,
        drogue_drag_area=1e-9,
        scheme=cable.MovingEnd(time_step=step, segment_length=LENGTH / 100),
    )


def compare(step: float, follows: bool) -> list[Row]:
    """Compare the depth of the tail at all times, and its speed at the end."""
    run = sinking(step, follows)
    name = f"{'tow point sinks too' if follows else 'tow point fixed'}, {step:g} s"
    depth = np.array([shape[-1, 2] for shape in run.shapes])
    exact = TERMINAL * TAU * np.log(np.cosh(run.time / TAU))
    speed = (depth[-1] - depth[-2]) / (run.time[-1] - run.time[-2])
    return [
        Setting(name, SOURCE, 1e-4, "m").worst(
            depth, exact, exact[-1], "depth of the tail, worst of all times"
        ),
        Setting(name, SOURCE, 1e-6, "m/s").row(
            float(speed), float(TERMINAL), what="speed of the tail at 2 s"
        ),
    ]


def rows(quick: bool) -> list[Row]:
    """Compare at 0.0025 s, a twenty-fourth of τ, and show the order in time."""
    steps = (0.01, 0.005, 0.0025) if quick else (0.02, 0.01, 0.005, 0.0025)
    refined = [compare(step, True) for step in steps]
    depths = order_row("tow point sinks too", steps, [rows[0].error for rows in refined], "Δt", SOURCE)
    pull = Setting("tow point sinks too", SOURCE, 1e-4).vector(
        sinking(0.0025, True).tow_force[-1],
        [-HEAVY.tangential_drag * SPEED**2 * LENGTH, 0.0, 0.0],
        "tow force at 2 s",
    )
    return [*refined[-1], pull, depths, *compare(0.0025, False)]
