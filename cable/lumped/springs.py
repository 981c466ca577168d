"""The springs of the lumped cable in a stage: the places of the nodes, the lengths and the tensions of the springs.

In a stage y = y* + g ẏ. With d the chord, t = d/|d| and ΔV = V_j − V_{j−1}, the length of spring j obeys

    L = [L* + g (t·ΔV + |d|/τ)] / (1 + g/τ),      ∂L/∂ΔV = g [t + g (ΔV − t t·ΔV)/|d| + g t/τ] / (1 + g/τ)

and ξ, its own unknown, L − ℓ (1 + ε(ξ)) = 0. Newton's step for ξ follows from those for the nodes,

    δξ = (L − ℓ(1 + ε) + ∂L/∂ΔV·δΔV − (1 + ε) δℓ) / (ℓ ε'),

so ξ is eliminated spring by spring, and the springs may be arbitrarily stiff.

The springs of the lumped cable: hardly any stretch when taut, hardly any push when slack.

One number ξ [N] per spring gives both its tension and its length, so that neither side is steep:

    T(ξ) = ½(ξ + √(ξ² + c²)),      ε(ξ) = e T − σ(ξ),      σ(ξ) = ½(−ξ + √(ξ² + c²))/k

Taut, ξ is the tension; slack, −ξ/k is the shortening; between them T σ = T₀ = c²/4k (1e-12 N). The price is a strain of
T₀/T. An inextensible cable (e = 0) is given the compliance `LEAST_COMPLIANCE`: 1e-6 of its length at one newton, so a
tow of 30 m and 1 N has a length error below 3e-5 m and a tension error below 1e-6 of itself.
"""

from __future__ import annotations

from math import sqrt

from cable.drum import CREEP
from cable.lumped.band_solver import add
from cable.lumped.rope import (
    ANSWER,
    DIRECTION,
    FADING,
    GAIN,
    GAP,
    NEW,
    PULL,
    REST,
    SIZE,
    SLOPE,
    START_POSITION,
    START_STRETCHED,
    STATE,
    THINNING,
    Rope,
    unknowns,
)
from subzero.jit import compiled, inner

POINT = 1e-7
"""A chord shorter than this share of its spring has no direction. [-]"""


@compiled
def observe(rope: Rope, g: float) -> None:
    """Fill positions, chords, lengths and pulls at level NEW from the velocities, ξ and pay-out rate there."""
    N = rope.ends.count
    for j in range(1, N + 1):
        for i in range(3):
            if j <= unknowns(rope):
                rope.position[NEW, j, i] = rope.vector[START_POSITION, j, i] + g * rope.velocity[NEW, j, i]
            else:
                rope.position[NEW, j, i] = rope.ends.drum_place[i]
                rope.velocity[NEW, j, i] = rope.ends.drum_velocity[i]
    _last_length(rope, g)
    for j in range(1, N + 1):
        _observe_spring(rope, j, g)


@compiled
def _last_length(rope: Rope, g: float) -> None:
    """Fill the unstretched length of the last spring."""
    N = rope.ends.count
    if rope.ends.free_end:
        return
    if rope.ends.by_payout > 0.0:
        rope.spring[REST, N] = rope.ends.start_last + g * rope.ends.payout[NEW]
    else:
        rope.spring[REST, N] = rope.ends.wanted
        for j in range(1, N):
            rope.spring[REST, N] -= rope.spring[REST, j]
    rope.ends.last[NEW] = rope.spring[REST, N]


@compiled
def _observe_spring(rope: Rope, j: int, g: float) -> None:
    """Fill the geometry and the tension of spring j."""
    x, V, t, rest = rope.position, rope.velocity, rope.vector[DIRECTION], rope.spring[REST, j]
    square, fading = (POINT * rest) ** 2, 1.0 / (1.0 + g / FADING)
    for i in range(3):
        t[j, i] = x[NEW, j, i] - x[NEW, j - 1, i]
        square += t[j, i] * t[j, i]
    size, rate = sqrt(square), 0.0
    for i in range(3):
        t[j, i] /= size
        rate += t[j, i] * (V[NEW, j, i] - V[NEW, j - 1, i])
    for i in range(3):
        across = V[NEW, j, i] - V[NEW, j - 1, i] - t[j, i] * rate
        rope.vector[ANSWER, j, i] = g * fading * (t[j, i] * (1.0 + g / FADING) + g * across / size)
    T, share, strain, slope = spring_law(rope.spring[STATE, j], rope.ends.compliance)
    rope.spring[SIZE, j], rope.spring[PULL, j], rope.spring[SLOPE, j] = size, T, rest * slope
    rope.stretched[NEW, j] = (rope.spring[START_STRETCHED, j] + g * (rate + size / FADING)) * fading
    rope.spring[GAP, j] = rope.stretched[NEW, j] - rest * (1.0 + strain)
    rope.spring[GAIN, j] = share / rope.spring[SLOPE, j]


@compiled
def pull_nodes(rope: Rope, g: float) -> None:
    """Add all springs to the residuals of their nodes' balances (required minus available force)."""
    N, held = rope.ends.count, unknowns(rope)
    column = 3 * (N - 1)
    for j in range(1, N + 1):
        T = rope.spring[PULL, j]
        for end in range(2):
            node, sign = j - end, 1.0 - 2.0 * end
            if node < 1 or node > held:
                continue
            for i in range(3):
                by_T = sign * rope.vector[DIRECTION, j, i] + rope.vector[THINNING, node, i]
                row = 3 * (node - 1) + i
                rope.right[row] += (
                    sign * T * rope.vector[DIRECTION, j, i]
                    + by_T * rope.spring[GAIN, j] * rope.spring[GAP, j]
                )
                for k in range(3):
                    same = 1.0 if i == k else 0.0
                    across = same - rope.vector[DIRECTION, j, i] * rope.vector[DIRECTION, j, k]
                    turn = g * T * across / rope.spring[SIZE, j]
                    value = by_T * rope.spring[GAIN, j] * rope.vector[ANSWER, j, k] + sign * turn
                    if j <= held:
                        add(rope.band, row, 3 * (j - 1) + k, value)
                    if j > 1:
                        add(rope.band, row, 3 * (j - 2) + k, -value)
                if j == N and not rope.ends.free_end:
                    by_U = -by_T * rope.spring[GAIN, j] * unit_length(rope, j) * rope.ends.by_payout
                    add(rope.band, row, column, by_U)


@inner
def unit_length(rope: Rope, j: int) -> float:
    """Return 1 + ε of spring j, as its law has it."""
    return (rope.stretched[NEW, j] - rope.spring[GAP, j]) / rope.spring[REST, j]


@compiled
def update_springs(rope: Rope, share: float) -> None:
    """Move ξ of all springs by `share` of Newton's step (in rope.right)."""
    N, held = rope.ends.count, unknowns(rope)
    for j in range(1, N + 1):
        change = rope.spring[GAP, j]
        for i in range(3):
            if j <= held:
                change += rope.vector[ANSWER, j, i] * rope.right[3 * (j - 1) + i]
            if j > 1:
                change -= rope.vector[ANSWER, j, i] * rope.right[3 * (j - 2) + i]
        if j == N and not rope.ends.free_end:
            change -= unit_length(rope, j) * rope.ends.by_payout * rope.right[3 * (N - 1)]
        rope.spring[STATE, j] += share * change / rope.spring[SLOPE, j]


LEAST_COMPLIANCE = 1e-6
"""e of a cable that does not stretch. [1/N]"""
SLACKNESS = 1.0
"""k: how far ξ falls for a shortening of one. [N]"""
CORNER = 2e-6
"""c: where taut and slack meet. [N]"""


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
    """Return the friction of the drum, C_f/R_d rounded off at rest [N], and its slope by the pay-out rate [N s/m]."""
    if payout <= 0.0:
        return 0.0, friction / CREEP
    size = sqrt(payout * payout + CREEP * CREEP)
    return friction * payout / size, friction * CREEP * CREEP / size**3
