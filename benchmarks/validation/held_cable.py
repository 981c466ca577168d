"""A cable that a winch pays out while the vehicle goes to a place and waits there: what the cases of rest share."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

import cable

GOING = 20.0
"""How long the vehicle goes and the winch turns. [s]"""


def share_per_second(t: float) -> float:
    """Return the rate, without jolts, of what is to be complete after GOING. [1/s]."""
    return (1.0 - np.cos(2.0 * np.pi * t / GOING)) / GOING if t < GOING else 0.0


def going_to(place: tuple[float, float, float]) -> Callable[[float], tuple[float, float, float]]:
    """Return the velocity of a vehicle that goes from the drum to a place. [m/s]."""
    north, east, down = place
    return lambda t: (
        north * share_per_second(t),
        east * share_per_second(t),
        down * share_per_second(t),
    )


@cache
def held(
    properties: cable.CableProperties,
    place: tuple[float, float, float],
    length: float,
    segments: int,
    current: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> cable.History:
    """Return a run of two minutes that ends at rest; long steps, which damp what swings."""
    run = cable.pull_out(
        going_to(place),
        120.0,
        cable=properties,
        current=current,
        drum=cable.PayOutRate(rate=lambda t: length * share_per_second(t)),
        scheme=cable.MovingEnd(time_step=0.5, segment_length=length / segments),
    )
    if not run.outcome.completed:
        raise RuntimeError(run.outcome.message)
    return run
