"""A neutral cable without tangential drag (C_t = 0) is held by both ends in a current across, J. At rest the tension is
the same all along and the angle φ between cable and current obeys

    T dφ/ds = −½ρdC_n J² sin²φ,          cot φ = ½ρdC_n J² s/T + constant

a catenary with the parameter a = T/½ρdC_nJ², whose axis is the current's. Between places L apart across the current
S = 2a sinh(L/2a). Once a winch holds the length, and once it holds the tension, the end force that makes the shape.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.optimize import brentq

import cable

from .held_cable import going_to, held
from .row import Row, Setting, order_row

NO_SKIN = cable.CableProperties(tangential_drag_coefficient=0.0)
LENGTH, SPAN, CURRENT = 10.0, 9.0, 1.0
LOAD = NO_SKIN.normal_drag * CURRENT**2
"""½ρdC_n J². [N/m]"""
WINCH_TENSION = 8.0
SOURCE = "closed form for C_t = 0"


def force(a: float, length: float) -> np.ndarray:
    """Return the force on the vehicle, which is north of the drum in a current to the east (3,). [N]."""
    tension, angle = LOAD * a, np.arctan(0.5 * length / a)
    return tension * np.array([-np.cos(angle), np.sin(angle), 0.0])


def length_held(segments: int) -> list[Row]:
    """Compare the force and the tension along a cable of given length."""
    run = held(NO_SKIN, (SPAN, 0.0, 0.0), LENGTH, segments, (0.0, CURRENT, 0.0))
    S = float(run.length[-1])
    a = brentq(lambda a: 2.0 * a * np.sinh(0.5 * SPAN / a) - S, 1.0, 100.0, xtol=1e-14)
    setting = Setting("length held", SOURCE, 1e-4)
    even = setting.worst(run.tensions[-1], LOAD * a, what="T at any node")
    shape = Setting("length held", SOURCE, 1e-4, "m").worst(
        run.shapes[-1][:, 1],
        a * (np.cosh(0.5 * SPAN / a) - np.cosh((run.shapes[-1][:, 0] - 0.5 * SPAN) / a)),
        S,
        "how far the current carries a node",
    )
    return [setting.vector(run.tow_force[-1], force(a, S), "tow force"), even, shape]


@cache
def tension_run(segments: int) -> cable.History:
    """Hold the tension at the drum while the vehicle goes to its place and waits."""
    return cable.pull_out(
        going_to((SPAN, 0.0, 0.0)),
        200.0,
        cable=NO_SKIN,
        current=(0.0, CURRENT, 0.0),
        drum=cable.ConstantTension(tension=WINCH_TENSION),
        scheme=cable.MovingEnd(time_step=0.5, segment_length=LENGTH / segments),
    )


def tension_held(segments: int) -> list[Row]:
    """Compare the length that a given tension holds, and the force on the vehicle."""
    run, a = tension_run(segments), WINCH_TENSION / LOAD
    S = 2.0 * a * np.sinh(0.5 * SPAN / a)
    name = f"T(S) = {WINCH_TENSION:g} N held"
    return [
        Setting(name, SOURCE, 1e-4, "m").row(float(run.length[-1]), S, what="length that comes out"),
        Setting(name, SOURCE, 1e-4).vector(run.tow_force[-1], force(a, S), "tow force"),
    ]


def rows(quick: bool) -> list[Row]:
    """Compare both ways to hold the cable with 100 segments, and the order of the first."""
    sizes = (50, 100, 200)
    refined = [length_held(segments) for segments in sizes]
    errors = [rows[0].error for rows in refined]
    name = "length held: tow force"
    shown = order_row(name, [LENGTH / n for n in sizes], errors, "Δs", SOURCE)
    return [*refined[1], shown, *tension_held(100)]
