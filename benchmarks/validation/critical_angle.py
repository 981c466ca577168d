"""A heavy (or light) free-tail cable of 30 m is towed at a steady speed, and lies straight at the critical angle:

    ½ρdC_n U² sin²φ = |w_c| cosφ,         −dT/ds = ½ρπdC_t U² cos²φ + |w_c| sinφ

A run that starts in that state must remain there; the discrete equations have the same solution. A run that starts half
as fast again and slows down within 5 s must find it.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

import cable

from .row import Row, Setting

HEAVY = cable.CableProperties(mass_per_length=0.0098)
LIGHT = cable.CableProperties(mass_per_length=0.0035)
SOURCE = "(7), steady"


def angle_and_slope(speed: float, c: cable.CableProperties) -> tuple[float, float]:
    """Return φ [rad] and −dT/ds [N/m] from their equations."""
    across, along = 0.5 * c.water_density * c.diameter * speed**2, 9.81 * abs(c.mass_per_length - 0.0049)
    phi = brentq(lambda phi: across * np.sin(phi) ** 2 - along * np.cos(phi), 0.0, 0.5 * np.pi, xtol=1e-15)
    skin = across * np.pi * c.tangential_drag_coefficient
    return phi, skin * np.cos(phi) ** 2 + along * np.sin(phi)


def compare(run: cable.History, speed: float, c: cable.CableProperties, name: str, gate: float) -> list[Row]:
    """Compare the angle to the flow at the tow point's half of the cable, and the slope of T over that half."""
    phi, slope = angle_and_slope(speed, c)
    middle = len(run.shapes[-1]) // 2
    down = run.shapes[-1][middle] - run.shapes[-1][0]
    distance = float(run.length[-1]) * middle / (len(run.shapes[-1]) - 1)
    fall = (run.tensions[-1][0] - run.tensions[-1][middle]) / distance
    ours = float(np.arctan2(abs(down[2]), -down[0]))
    return [
        Setting(name, SOURCE, gate, "rad").row(ours, phi, what="angle to the flow"),
        Setting(name, SOURCE, gate, "N/m").row(float(fall), slope, what="−dT/ds"),
    ]


def staying(speed: float, c: cable.CableProperties, name: str) -> list[Row]:
    """Start at the critical angle."""
    run = cable.tow(
        lambda _: (speed, 0.0, 0.0),
        30.0,
        10.0,
        cable=c,
        scheme=cable.MovingEnd(time_step=0.1, segment_length=0.3),
    )
    return compare(run, speed, c, f"{name}, {speed:g} m/s", 1e-6)


def finding(speed: float, length: float = 10.0) -> list[Row]:
    """Start at the critical angle of another speed."""
    run = cable.tow(
        lambda t: (speed * (1.0 + 0.5 * np.cos(0.1 * np.pi * min(t, 5.0)) ** 2), 0.0, 0.0),
        length,
        40.0 * length / speed,
        cable=HEAVY,
        scheme=cable.MovingEnd(time_step=0.2 / speed, segment_length=length / 100),
    )
    return compare(run, speed, HEAVY, f"heavy, from {1.5 * speed:g} to {speed:g} m/s", 1e-4)


def rows(quick: bool) -> list[Row]:
    """Compare several speeds, cables that sink and float, and a cable that comes from another speed."""
    found = []
    for speed in (1.0,) if quick else (0.3, 0.5, 1.0, 2.0, 3.0):
        found += staying(speed, HEAVY, "heavy") + staying(speed, LIGHT, "light")
    for speed in (1.0,) if quick else (0.5, 1.0, 2.0):
        found += finding(speed)
    return found
