"""Thirty measured tensions of a mooring chain (Bergdahl and others, 2016): 33 m of 2.2 mm chain, EA = 10 kN, from an
anchor on a concrete floor 3 m deep to a point that goes round a vertical circle. In two thirds of the conditions the
chain goes slack in each turn, and comes taut with a snap.

All numbers are those that the authors print: 0.0818 kg/m of steel (7800 kg/m³), drag coefficients 2.5 across and 0.5
along the chain on 2.2 mm, added mass 3.8 of the steel's volume, and for the floor a modulus of 3 GN/m³, critical
damping, friction 0.3. None is fitted. The circle grows over three turns; the score is the mean of the largest pulls at
the upper end of turns 8 to 12, as measured. Steps are a two-hundredth of a turn, segments 0.4 m; with half of both the
mean error changes by 0.02 %.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import cable

DATA = Path(__file__).with_name("bergdahl_chain.csv")
WAVE_DATA = Path(__file__).with_name("bergdahl_waveform.csv")
STEEL, DIAMETER = 7800.0, 0.0022
CHAIN = cable.CableProperties(
    water_density=1000.0,
    mass_per_length=0.0818,
    cross_section_area=0.0818 / STEEL,
    diameter=DIAMETER,
    normal_drag_coefficient=2.5,
    tangential_drag_coefficient=0.5 / np.pi,  # printed on d, here on the surface π d
    added_mass_coefficient=3.8,
    compliance=1e-4,
)
FLOOR = cable.SeaBed(depth=3.0, modulus=3e9, damping_ratio=1.0, axial_friction=0.3, lateral_friction=0.3)
ENDS, LENGTH = ((32.554, 0.0, -0.3), (0.0, 0.0, 3.0)), 33.0
WAVE = (1.25, 0.2)
"""Period [s] and radius [m] of the condition whose tension over a turn is at hand: a snap in each turn."""
GROWS, SETTLES, TURNS = 3, 7, 12
"""Turns in which the circle grows, after which the score begins, and in all."""


class Condition(NamedTuple):
    """Period [s] and radius [m] of the circle, and the mean of the measured largest pulls [N]."""

    period: float
    radius: float
    measured: float


def conditions() -> list[Condition]:
    """Return the thirty conditions, with what was measured."""
    return [Condition(*row) for row in _table(DATA)]


def measured_wave() -> np.ndarray:
    """Return time in the turn [s], mean and standard deviation of the measured pull [N] of `WAVE` (50, 3)."""
    return np.array(_table(WAVE_DATA))


def _table(path: Path) -> list[list[float]]:
    """Return the rows of a file of numbers below a heading."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return [[float(number) for number in row.values()] for row in csv.DictReader(lines)]


def in_phase(wave: np.ndarray) -> np.ndarray:
    """Return a computed pull of one turn (steps,) at the measured times (50,), at the phase of least error."""
    measured = measured_wave()[:, 1]
    steps, count = np.arange(wave.size), measured.size
    at = np.arange(count) * wave.size / count
    shifted = [np.interp(at + shift, steps, wave, period=wave.size) for shift in steps]
    return min(shifted, key=lambda pull: float(((pull - measured) ** 2).sum()))


def circle(period: float, radius: float) -> Callable[[float], tuple[float, float, float]]:
    """Return the velocity of the upper end on a circle that grows smoothly from nothing."""
    omega, whole = 2.0 * np.pi / period, GROWS * period

    def velocity(t: float) -> tuple[float, float, float]:
        u = min(t / whole, 1.0)
        size = radius * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
        rate = radius * 30.0 * u**2 * (1.0 - u) ** 2 / whole
        sine, cosine = np.sin(omega * t), np.cos(omega * t)
        return rate * sine + size * omega * cosine, 0.0, size * omega * sine - rate * cosine

    return velocity


def pulls(condition: Condition, steps: int = 200, segments: int = 82, turns: int = TURNS) -> np.ndarray:
    """Return the pull at the upper end in each turn (turns, steps). [N]"""
    period, segment = condition.period, LENGTH / segments
    start = cable.hold(ENDS, LENGTH, cable=CHAIN, segment_length=segment, bed=FLOOR)
    scheme = cable.MovingEnd(time_step=period / steps, tolerance=1e-6)
    path = circle(period, condition.radius)
    run = cable.pull_out(path, turns * period, drum=cable.Brake(), start=start, scheme=scheme)
    if not run.outcome.completed:
        raise RuntimeError(run.outcome.message)
    return np.linalg.norm(run.tow_force, axis=1)[1:].reshape(turns, steps)


def largest_pull(condition: Condition, steps: int = 200, segments: int = 82, turns: int = TURNS) -> float:
    """Return the mean of the largest pulls in the turns that count. [N]"""
    wave = pulls(condition, steps, segments, turns)
    return float(wave[min(SETTLES, turns - 1) :].max(axis=1).mean())


def errors(computed: np.ndarray) -> np.ndarray:
    """Return the relative errors of all conditions (30,)."""
    return computed / np.array([condition.measured for condition in conditions()]) - 1.0


def mean_error(computed: np.ndarray) -> float:
    """Return the mean of their sizes."""
    return float(np.abs(errors(computed)).mean())


def pull_at_rest(segments: int = 82) -> float:
    """Return the force at the upper end of the chain at rest. [N]"""
    rest = cable.hold(ENDS, LENGTH, cable=CHAIN, segment_length=LENGTH / segments, bed=FLOOR)
    return float(np.linalg.norm(rest.tow_force))
