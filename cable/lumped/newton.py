"""Solve one stage of a step of the lumped cable by Newton's method.

Unknowns are the velocities of the free nodes and the pay-out rate; the springs' own are eliminated
(`springs`). The matrix is exact but for the change of the water over a Newton step. A step is cut short
where nodes would go far beyond their neighbours.
"""

from __future__ import annotations

from typing import NamedTuple

from cable.current import Water, water_velocity
from cable.lumped.balance import balance_nodes, bend_nodes
from cable.lumped.band_solver import WIDTH, solve_band
from cable.lumped.ends import hold_end, tow_force
from cable.lumped.rope import FADING, GAIN, GAP, NEW, PULL, REST, WATER, Rope, unknowns
from cable.lumped.springs import observe, pull_nodes, update_springs
from cable.properties import CableNumbers, DrumNumbers
from subzero.jit import compiled, inner

TOLERANCE = 1e-9
"""Residual of a balance, as a share of the largest tension (or of `SMALL`)."""
SMALL = 1e-2
"""Tensions below this are small. [N]"""
ROUNDING = 2e-15
MOST_ITERATIONS = 40
LONGEST_MOVE = 0.7
"""A node moves by no more than this share of the shortest full spring in one iteration."""


class StageSolved(NamedTuple):
    """How a stage was solved: whether, in how many iterations, and the worst residual and equation that are left."""

    converged: bool
    iterations: int
    residual: float
    worst: int


@inner
def solve_stage(
    rope: Rope, g: float, time: float, c: CableNumbers, drum: DrumNumbers, water: Water
) -> StageSolved:
    """Solve one stage from the guess on level NEW."""
    residual, worst = 0.0, 0
    size = 3 * unknowns(rope) + (0 if rope.ends.free_end else 1)
    for iteration in range(MOST_ITERATIONS):
        assemble_stage(rope, g, time, c, drum, water)
        residual, worst = _largest(rope, size, g)
        if not residual < 1e30:
            break
        if residual < 1.0 and iteration > 0:
            tow_force(rope, g, c)
            return StageSolved(True, iteration, residual, worst)
        for i in range(size):
            rope.right[i] = -rope.right[i]
        if not solve_band(rope.band, rope.right, size):
            break
        share = _allowed(rope, g, size)
        update_springs(rope, share)
        _move(rope, share)
    return StageSolved(False, MOST_ITERATIONS, residual, worst)


@compiled
def assemble_stage(
    rope: Rope, g: float, time: float, c: CableNumbers, drum: DrumNumbers, water: Water
) -> None:
    """Fill the Newton system at the guess on level NEW; the change of J over a Newton step is left out of it."""
    observe(rope, g)
    for j in range(rope.ends.count + 1):
        x, J = rope.position[NEW, j], rope.vector[WATER, j]
        J[0], J[1], J[2] = water_velocity(water, x[0], x[1], x[2], time)
    for i in range(3 * rope.ends.count + 1):
        rope.right[i] = 0.0
        for k in range(WIDTH):
            rope.band[i, k] = 0.0
    balance_nodes(rope, g, c)
    if rope.ends.bending > 0.0:
        bend_nodes(rope, g)
    pull_nodes(rope, g)
    hold_end(rope, g, c, drum)


@compiled
def _largest(rope: Rope, size: int, g: float) -> tuple[float, int]:
    """Return the largest residual in units of its tolerance, and which it is (gaps of springs count from `size` on).

    Stiff springs make forces of the rounding of lengths and positions: ten roundings are allowed.
    """
    scale, worst, which, far = SMALL, 0.0, 0, 0.0
    for j in range(1, rope.ends.count + 1):
        scale = max(scale, rope.spring[PULL, j])
        for i in range(3):
            far = max(far, 1.0 + abs(rope.position[NEW, j, i]) * g / (FADING * rope.spring[REST, j]))
    allowed = TOLERANCE * scale + ROUNDING * far / rope.ends.compliance
    for i in range(size):
        left = abs(rope.right[i]) / allowed
        if not left <= worst:
            worst, which = left, i
    for j in range(1, rope.ends.count + 1):
        left = abs(rope.spring[GAIN, j] * rope.spring[GAP, j]) / allowed
        left = max(left, abs(rope.spring[GAP, j]) / (TOLERANCE * rope.spring[REST, j]))
        if not left <= worst:
            worst, which = left, size + j
    return worst, which


@compiled
def _allowed(rope: Rope, g: float, size: int) -> float:
    """Return which share of Newton's step to go: no node far beyond its neighbours, no last spring that vanishes."""
    N, farthest, shortest = rope.ends.count, 0.0, rope.spring[REST, 1]
    for i in range(3 * unknowns(rope)):
        farthest = max(farthest, abs(rope.right[i]) * g)
    share = min(1.0, LONGEST_MOVE * shortest / max(farthest, 1e-300))
    if not rope.ends.free_end and rope.ends.by_payout > 0.0:
        shrinks = -rope.right[size - 1] * rope.ends.by_payout
        if shrinks > 0.0:
            share = min(share, 0.7 * rope.spring[REST, N] / shrinks)
    return share


@compiled
def _move(rope: Rope, share: float) -> None:
    """Apply a share of Newton's step to the velocities and to the pay-out rate."""
    held = unknowns(rope)
    for j in range(1, held + 1):
        for i in range(3):
            rope.velocity[NEW, j, i] += share * rope.right[3 * (j - 1) + i]
    if not rope.ends.free_end:
        rope.ends.payout[NEW] += share * rope.right[3 * held]
