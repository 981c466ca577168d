"""The law between tension and strain: inextensible or elastic when taut, and never a push.

A thin cable cannot be compressed: it buckles, and its chord gets shorter. With the shortening
σ = ½(1 + eT)² − ½|d|²/ℓ² of a segment (the strain, for a small one), slackness is the alternative

    T ≥ 0,   σ ≥ 0,   T σ = 0

which is smoothed to T σ = T₀ (`SMOOTHING`, 1e-13 N) and written as one equation that suits Newton's method,
the Fischer-Burmeister function φ(a, b) = a + b − √(a² + b² + 2μ) = 0 with a = T/T_r and b = σ/σ_r.

A cable with internal damping B of its stretch ε = |d|/ℓ − 1 (Kelvin and Voigt: a spring with a parallel dashpot)
pulls with T = EA ε + B dε/dt, so σ has the stretch of a spring that it would take to pull as hard,

    σ = ½(1 + eT)² − ½(|d|/ℓ + τ dε⁺/dt)²,    τ = B e,   ε⁺ = max(ε, 0)

τ is the time in which a stretched cable goes back. A dashpot does not push either: where a cable gets shorter faster
than that, it is slack before it is as short as it was. Per length it loses (T − ε⁺/e) dε⁺/dt.

Departs from source: the paper takes the cable as taut everywhere (its equations are singular at T = 0). The cost of
the smoothing is a strain of T₀/T: 1e-12 at a tenth of a newton. What happens inside a slack bight (folding, contact,
bending) is not modelled: without bending stiffness its shape below one segment length is ill-posed, and only its
ends, its drag and its inertia mean anything.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from subzero.jit import inlined

TENSION_SCALE = 1e-3
"""T_r [N] and σ_r [-]: where the corner between taut and slack is seen at the same size in both."""
STRAIN_SCALE = 1e-3
SMOOTHING = 1e-13
"""T₀ = T σ of the smoothed law. [N]"""
SOFTEST = 1e-4
"""T₀ that a difficult step starts with, a tenth at a time down to `SMOOTHING`. [N]"""
KNOWN = 1e-4
"""A cable with more tension than this is taut, and its tension is extrapolated from the steps before. [N]"""
FOLDING = 0.3
"""How early a heaped segment loses its direction, see `chord_length`; without any effect on a taut one."""


@inlined
def slack_law(T: float, shortening: float, smoothing: float) -> tuple[float, float, float]:
    """Return φ and its derivatives by the tension T [N] and the shortening σ [-], for T₀ = `smoothing` [N]."""
    # φ = 0 says a b = μ with a, b ≥ 0. It suits Newton's method: a taut segment has ∂φ/∂T ≈ 0 and a row that says
    # σ = 0, a slack one ∂φ/∂σ ≈ 0 and a row that says T = 0, so it is not necessary to guess which of the two it is.
    a, b = T / TENSION_SCALE, shortening / STRAIN_SCALE
    mu = smoothing / (TENSION_SCALE * STRAIN_SCALE)
    s = sqrt(a * a + b * b + 2.0 * mu)
    # a + b − s, without cancellation when one of the two is large
    phi = 2.0 * (a * b - mu) / (a + b + s) if a + b > 0.0 else a + b - s
    return phi, (1.0 - a / s) / TENSION_SCALE, (1.0 - b / s) / STRAIN_SCALE


@inlined
def damped_share(square: float, past: float, weight: float, tau: float) -> tuple[float, float]:
    """Return (|d|/ℓ + τ dε⁺/dt)² and its derivative by |d|²/ℓ². [-].

    Args:
        square: |d|²/ℓ² at the new time. [-]
        past: what the stretches before add to dε⁺/dt, see `bdf2`. [1/s]
        weight: weight of the new stretch in it. [1/s]
        tau: τ, above 0. [s]
    """
    share = sqrt(square)
    damped = max(share + tau * (weight * max(share - 1.0, 0.0) + past), 0.0)
    by_share = 1.0 + tau * weight if share > 1.0 else 1.0
    return damped * damped, damped * by_share / share


@inlined
def squared_share(d: np.ndarray, length: float) -> float:
    """Return |d|²/ℓ², 1 for a chord as long as its segment. [-]."""
    return (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / (length * length)


@inlined
def chord_length(square: float, length: float) -> float:
    """Return r with r² = |d|² + F² max(1 − |d|²/ℓ², 0)² ℓ², the length that the tangent t = d/r is made with. [m].

    For a taut or stretched segment r = |d|, and t is a unit vector. A slack one (|d| < ℓ) is a folded cable: its t gets
    shorter than one, smoothly to 0 when both ends meet, and P = I − t tᵀ then tends to equal drag in all directions.

    Args:
        square: |d|²/ℓ². [-]
        length: ℓ, unstretched. [m]
    """
    return length * sqrt(square + (FOLDING * max(1.0 - square, 0.0)) ** 2)


@inlined
def turning_rate(square: float) -> float:
    """Return g in ∂t/∂d = (I − g t tᵀ)/r, of |d|²/ℓ²; 1 for a taut segment. [-]."""
    return 1.0 - 2.0 * FOLDING * FOLDING * max(1.0 - square, 0.0)


@inlined
def fading_rate(square: float, length: float, r: float) -> float:
    """Return f in ∂t/∂ℓ = −f t, of |d|²/ℓ²; 0 for a taut segment. [1/m]."""
    return FOLDING * FOLDING * length * max(1.0 - square * square, 0.0) / (r * r)
