"""Motions of a tow point with soft ends, and the umbilical of a vehicle that goes down and turns back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import cable


def ramp(x: float) -> float:
    """Return a ramp from 0 to 1 over 0 ≤ x ≤ 1 with three continuous derivatives."""
    y = float(np.clip(x, 0.0, 1.0))
    return y**4 * (35.0 - 84.0 * y + 70.0 * y**2 - 20.0 * y**3)


def ramp_integral(x: float) -> float:
    """Return the integral of `ramp`, a straight line beyond 1."""
    y = float(np.clip(x, 0.0, 1.0))
    return 7.0 * y**5 - 14.0 * y**6 + 10.0 * y**7 - 2.5 * y**8 + max(x - 1.0, 0.0)


def turned(t: float, total: float, start: float = 4.0, soft: float = 2.0) -> float:
    """Return an angle [rad] that turns by `total` [rad] at 6°/s from `start` on, with ends of `soft`. [s]."""
    rate = np.radians(6.0)
    started, ended = (t - start) / soft, (t - start - total / rate) / soft
    return float(rate * soft * (ramp_integral(started) - ramp_integral(ended)))


def heading_for(pitch: float, heading: float) -> tuple[float, float, float]:
    """Return the velocity of 1 m/s with this pitch and heading [rad]. [m/s]."""
    return (
        float(np.cos(pitch) * np.cos(heading)),
        float(np.cos(pitch) * np.sin(heading)),
        float(-np.sin(pitch)),
    )


UMBILICAL = cable.CableProperties(
    mass_per_length=0.2,
    cross_section_area=1.13e-4,
    diameter=0.012,
    tangential_drag_coefficient=0.02,
    normal_drag_coefficient=1.2,
    compliance=2e-6,
)
"""12 mm thick; weighs 0.85 N/m in water; EA = 5e5 N."""
SHEARED = cable.Current.sampled(
    lambda _n, _e, down, t: (0.0, 0.02 * t * (1.0 - 0.02 * down), -0.01 * t * (1.0 - 0.02 * down)),
    down=(-10.0, 50.0),
    time=(0.0, 60.0),
)
"""Grows to 0.5 m/s at the surface in the course of the dive, and is gone at 50 m of depth."""


def dive_and_return(t: float) -> tuple[float, float, float]:
    """Return the velocity of an ROV that goes down, then ahead, and turns back through 180°. [m/s]."""
    down = 0.8 * (1.0 - ramp((t - 8.0) / 6.0))
    ahead, heading = 0.6 * ramp((t - 6.0) / 6.0), np.pi * ramp((t - 14.0) / 8.0)
    return float(ahead * np.cos(heading)), float(ahead * np.sin(heading)), down


@dataclass(frozen=True)
class Manoeuvre:
    """A prescribed motion of the vehicle: velocity by time [m/s], how long [s], and settings of `cable.pull_out`."""

    velocity: Callable[[float], tuple[float, float, float]]
    duration: float
    settings: dict[str, Any]


ON_SHORE = {"drum": cable.DrumProperties(friction_torque=0.005)}
MANOEUVRES = {
    "dive": Manoeuvre(lambda t: heading_for(-turned(t, np.pi / 3.0), 0.0), 24.0, ON_SHORE),
    "helix": Manoeuvre(
        lambda t: heading_for(-0.2 * ramp((t - 1.0) / 4.0), 0.8 * ramp_integral((t - 1.0) / 4.0)),
        24.0,
        ON_SHORE,
    ),
    "U-turn": Manoeuvre(lambda t: heading_for(0.0, turned(t, np.pi)), 40.0, ON_SHORE),
    "umbilical": Manoeuvre(
        dive_and_return,
        28.0,
        {
            "cable": UMBILICAL,
            "current": SHEARED,
            "drum": cable.ConstantTension(tension=60.0),
            "start": 4.0,
        },
    ),
}
