"""The springs of the lumped cable: hardly any stretch when taut, hardly any push when slack.

One number ξ [N] per spring tells both what it pulls and how long it is, so that neither side is steep:

    T(ξ) = ½(ξ + √(ξ² + c²)),      ε(ξ) = e T − σ(ξ),      σ(ξ) = ½(−ξ + √(ξ² + c²))/k

Taut, ξ is the tension; slack, −ξ/k is the shortening; between them T σ = T₀ = c²/4k (1e-12 N). The price is a strain of
T₀/T. An inextensible cable (e = 0) is given the compliance `LEAST_COMPLIANCE`: 1e-6 of its length at one newton, so a
tow of 30 m and 1 N has a length error below 3e-5 m and a tension error below 1e-6 of itself.
"""

from __future__ import annotations

from math import sqrt

from subzero.jit import compiled, inner

LEAST_COMPLIANCE = 1e-6
"""e of a cable that does not stretch. [1/N]"""
SLACKNESS = 1.0
"""k: how far ξ falls for a shortening of one. [N]"""
CORNER = 2e-6
"""c: where taut and slack meet. [N]"""
CREEP = 1e-3
"""Pay-out rate at which the drum's friction has come to 0.7 of its full size. [m/s]"""


@compiled
def spring_law(xi: float, compliance: float) -> tuple[float, float, float, float]:
    """Return T [N], dT/dξ [-], ε [-] and dε/dξ [1/N] at ξ [N] for the compliance e [1/N]."""
    size = sqrt(xi * xi + CORNER * CORNER)
    small = 0.5 * CORNER * CORNER / (size + abs(xi))  # ½(size − |ξ|), without cancellation
    large = 0.5 * (size + abs(xi))
    T, push = (large, small) if xi > 0.0 else (small, large)
    share = T / size
    return T, share, compliance * T - push / SLACKNESS, compliance * share + (1.0 - share) / SLACKNESS


@compiled
def spring_state(T: float) -> float:
    """Return the ξ that pulls with the tension T > 0. [N]."""
    return T - 0.25 * CORNER * CORNER / T


@inner
def drum_friction(friction: float, payout: float) -> tuple[float, float]:
    """Return what friction holds back, C_f/R_d rounded off at rest [N], and its slope by the pay-out rate [N s/m]."""
    if payout <= 0.0:
        return 0.0, friction / CREEP
    size = sqrt(payout * payout + CREEP * CREEP)
    return friction * payout / size, friction * CREEP * CREEP / size**3
