"""Which share of a straight segment, and of a sphere, is dry, by how deep it is: pure numbers.

A cylinder of radius r whose axis is u r below the surface has the dry share of its cross-section

    δ(u) = ½ − (u √(1−u²) + asin u)/π  for |u| < 1,   1 above,   0 below

and a segment from depth a to b (in r; Δ = b − a) is dry by ∫δ dξ, of which ∫ξδ dξ belongs to its far end. With the
antiderivatives D₁ = ∫_u^1 δ du and D₂ = ∫_u^1 D₁ du, by parts,

    ∫δ dξ = (D₁(a) − D₁(b))/Δ,   ∫ξδ dξ = (D₂(a) − D₂(b))/Δ² − D₁(b)/Δ,   energy (D₂(a) − D₂(b))/Δ

exactly, however long and steep the segment is. A nearly level one takes three-point Gauss quadrature instead, as these
quotients would be all rounding.
"""

from __future__ import annotations

from math import asin, pi, sqrt

from subzero.jit import inner

LEVEL = 0.02
"""Segments that differ by less in depth, in radii, are nearly level. [-]"""


@inner
def dry_section(u: float) -> tuple[float, float, float, float]:
    """Return δ, δ′, D₁ and D₂ at a depth u. [-]"""
    if u >= 1.0:
        return 0.0, 0.0, 0.0, 0.0
    if u <= -1.0:
        return 1.0, 0.0, -u, 0.125 + 0.5 * u * u
    s, angle = sqrt(1.0 - u * u), asin(u)
    first = -0.5 * u + (u * angle + s - s * s * s / 3.0) / pi
    second = (0.5 * u * u + 0.125) * angle + 0.625 * u * s - u * s * s * s / 12.0
    return 0.5 - (u * s + angle) / pi, -2.0 * s / pi, first, 0.0625 + 0.25 * u * u - second / pi


@inner
def dry_segment(a: float, b: float) -> tuple[float, float, float, float, float]:
    """Return the dry shares of the near and the far end of a segment from depth a to b, and their derivatives.

    The derivatives are those of the near share by a, of either by the other depth, and of the far share by b. [-]
    """
    if min(a, b) >= 1.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    if max(a, b) <= -1.0:
        return 0.5, 0.5, 0.0, 0.0, 0.0
    away = b - a
    if abs(away) < LEVEL:
        near, far, by_near, across, by_far = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            x, weight = 0.5 + (k - 1) * sqrt(0.15), 4.0 / 9.0 if k == 1 else 5.0 / 18.0
            share, rate, _, _ = dry_section(a + x * away)
            near, far = near + weight * (1.0 - x) * share, far + weight * x * share
            by_near += weight * (1.0 - x) * (1.0 - x) * rate
            across += weight * x * (1.0 - x) * rate
            by_far += weight * x * x * rate
        return near, far, by_near, across, by_far
    at_a, _, first_a, second_a = dry_section(a)
    at_b, _, first_b, second_b = dry_section(b)
    mean = (first_a - first_b) / away
    far = ((second_a - second_b) / away - first_b) / away
    # ∫ξδ′ dξ and ∫ξ²δ′ dξ, by parts again
    once, twice = (at_b - mean) / away, (at_b - 2.0 * far) / away
    return mean - far, far, (at_b - at_a) / away - 2.0 * once + twice, once - twice, twice


@inner
def dry_energy(a: float, b: float) -> float:
    """Return ∫D₁ dξ: the energy that a segment has by being dry, in weights of its water times r. [-]"""
    if abs(b - a) >= LEVEL:
        return (dry_section(a)[3] - dry_section(b)[3]) / (b - a)
    total = 0.0
    for k in range(3):
        x, weight = 0.5 + (k - 1) * sqrt(0.15), 4.0 / 9.0 if k == 1 else 5.0 / 18.0
        total += weight * dry_section(a + x * (b - a))[2]
    return total


@inner
def dry_sphere(u: float) -> tuple[float, float, float]:
    """Return the dry share of a sphere whose centre is u radii deep, its derivative, and its energy ∫_u^1. [-]"""
    if abs(u) >= 1.0:
        return (0.0, 0.0, 0.0) if u > 0.0 else (1.0, 0.0, -u)
    share = 0.25 * (2.0 - 3.0 * u + u * u * u)
    energy = 0.25 * (0.75 - 2.0 * u + 1.5 * u * u - 0.25 * u * u * u * u)
    return share, 0.75 * (u * u - 1.0), energy
