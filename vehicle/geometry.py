"""The shape of the hull with its tow point, and derived quantities: volume, centre, inertia, added mass, strips.

    nose   R = D/2 [1 − ((x' − a)/a)²]^(1/n),   x' from the tip, a its length
    tail   R = D/2 − (3D/(2c²) − tan θ/c) s² + (D/c³ − tan θ/c²) s³,   s from its start, c its length
                                                                        (Myring 1976)

The derived numbers in a vehicle's file that call themselves a geometry formula are made by these functions, those of
its fins by the ones of `tests/hull/test_parameters.py`, which compares them all. They are plain numpy, run when a
vehicle is designed and never inside a simulation, except for the radius of the cross-flow strips.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vehicle.parameters import Section, parameter

SLICES = 20_000
"""Midpoint slices of the integrals below: relative errors under 1e-6, at a millisecond each."""

PARTS_OF_A_SLICE = 50
"""Parts of a strip for its area and centroid: one radius a strip misses the blunt nose by 2 %."""


@dataclass(frozen=True, kw_only=True)
class Hull(Section):
    """A Myring hull: nose, cylinder, tail."""

    length: float = parameter("length over all, L", "m", above=0.0)
    diameter: float = parameter("largest diameter, D", "m", above=0.0)
    nose_station: float = parameter("tip of the nose, forward of the hull centre (origin)", "m", above=0.0)
    nose_length: float = parameter("length of the nose, a", "m", above=0.0)
    tail_length: float = parameter("length of the tail, c", "m", above=0.0)
    nose_exponent: float = parameter("fullness of the nose, n", "1", above=0.0)
    tail_angle: float = parameter("half angle of the tail's end, theta", "rad", low=0.0, high=1.5)


@dataclass(frozen=True, kw_only=True)
class TowPoint(Section):
    """The point r_c of the hull that something outside, such as a cable, may pull at: from the hull centre, body axes
    (section 2.3 of the paper).
    """

    x: float = parameter("forward", "m")
    y: float = parameter("to starboard", "m")
    z: float = parameter("down", "m")

    def position(self) -> np.ndarray:
        """Return r_c (3,). [m]"""
        return np.array([self.x, self.y, self.z])


class LambFactors(NamedTuple):
    """Added mass along and across a spheroid, and its added inertia, over those of the displaced water."""

    k1: float
    k2: float
    k_prime: float


def hull_radius(hull: Hull, x: np.ndarray) -> np.ndarray:
    """Return the radius at stations x forward of the hull centre [m]; zero off the hull."""
    D, a, c, tan = hull.diameter, hull.nose_length, hull.tail_length, math.tan(hull.tail_angle)
    aft = hull.nose_station - np.asarray(x, dtype=float)
    s = aft - (hull.length - c)
    nose = 0.5 * D * np.clip(1.0 - ((aft - a) / a) ** 2, 0.0, None) ** (1.0 / hull.nose_exponent)
    tail = 0.5 * D - (1.5 * D / c**2 - tan / c) * s**2 + (D / c**3 - tan / c**2) * s**3
    radius = np.where(aft < a, nose, np.where(s > 0.0, tail, 0.5 * D))
    return np.where((aft < 0.0) | (aft > hull.length), 0.0, np.maximum(radius, 0.0))


@lru_cache(maxsize=64)
def slices(hull: Hull, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the centroids from the hull centre [m] and half the side areas [m2] of slices, (count,) each."""
    step = hull.length / (count * PARTS_OF_A_SLICE)
    x = hull.nose_station - step * (np.arange(count * PARTS_OF_A_SLICE) + 0.5)
    part = hull_radius(hull, x) * step
    area = part.reshape(count, PARTS_OF_A_SLICE).sum(axis=1)
    return (part * x).reshape(count, PARTS_OF_A_SLICE).sum(axis=1) / area, area


def stations(hull: Hull) -> tuple[np.ndarray, float]:
    """Return the middles of thin slices along the hull, and their thickness [m]."""
    step = hull.length / SLICES
    return hull.nose_station - step * (np.arange(SLICES) + 0.5), step


def displaced_volume(hull: Hull) -> float:
    """Volume inside the hull [m3]."""
    x, step = stations(hull)
    return float(np.sum(math.pi * hull_radius(hull, x) ** 2) * step)


def centre_of_volume(hull: Hull) -> float:
    """Station of the centre of the volume, forward of the hull centre [m]."""
    x, step = stations(hull)
    return float(np.sum(x * math.pi * hull_radius(hull, x) ** 2) * step / displaced_volume(hull))


def homogeneous_inertia(hull: Hull, density: float) -> tuple[float, float]:
    """Roll and pitch inertia of a hull filled evenly, about its centre of volume [kg m2]."""
    x, step = stations(hull)
    area = math.pi * hull_radius(hull, x) ** 2
    arm = x - centre_of_volume(hull)
    quarter = area**2 / (4.0 * math.pi)
    return float(np.sum(2.0 * quarter) * step * density), float(
        np.sum(quarter + area * arm**2) * step * density
    )


def lamb_factors(slenderness: float) -> LambFactors:
    """Return Lamb's factors of a prolate spheroid, length over diameter above 1 (Lamb 1932, section 114)."""
    squared = (1.0 / slenderness) ** 2  # 1 − e²: as that difference it would be lost of a thread
    e2 = 1.0 - squared
    e = math.sqrt(e2)
    log = 2.0 * math.log((1.0 + e) * slenderness)  # of (1 + e)/(1 − e)
    alpha = 2.0 * squared / e**3 * (0.5 * log - e)
    beta = 1.0 / e2 - squared / (2.0 * e**3) * log
    k_prime = e2**2 * (beta - alpha) / ((2.0 - e2) * (2.0 * e2 - (2.0 - e2) * (beta - alpha)))
    return LambFactors(alpha / (2.0 - alpha), beta / (2.0 - beta), k_prime)


def lateral_added_mass(hull: Hull, density: float) -> tuple[float, float, float]:
    """Return A22 [kg], A26 [kg m], A66 [kg m2] of the bare hull: ∫(1, x, x²) ρπR² dx by Lamb's factors."""
    x, step = stations(hull)
    strip = density * math.pi * hull_radius(hull, x) ** 2 * step
    factors = lamb_factors(hull.length / hull.diameter)
    sums = (float(np.sum(strip)), float(np.sum(x * strip)), float(np.sum(x**2 * strip)))
    return factors.k2 * sums[0], factors.k2 * sums[1], factors.k_prime * sums[2]
