"""Advance the lumped cable by one step of TR-BDF2.

    trapezoidal rule to t + γh       y_γ = y + g (ẏ + ẏ_γ)
    backward differences to t + h    y₁ = (y_γ − (1 − γ)² y)/(γ(2 − γ)) + g ẏ₁,      γ = 2 − √2,  g = (1 − 1/√2) h

One method of second order: L-stable, both stages with the same g, and exact to second order within the stages too,
which the tension, an algebraic unknown, needs. y holds positions, momenta of the lumps, lengths of the springs, length
and pay-out rate at the drum.

A stage is solved by Newton's method. Unknowns are the velocities of the free nodes and the pay-out rate; the springs'
own are eliminated (`springs`). The matrix is exact but for the change of the water over a Newton step. A step is cut
short where nodes would go far beyond their neighbours.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from cable.current import Water, water_velocity
from cable.drum import FREE, LENGTH, DrumNumbers
from cable.lumped.balance import balance_nodes, bend_nodes
from cable.lumped.band_solver import WIDTH, solve_band
from cable.lumped.ends import hold_end, tow_force, wind_off
from cable.lumped.nodes import fill_momenta, mind_the_drum, settle
from cable.lumped.rope import (
    FADING,
    GAIN,
    GAP,
    MIDDLE,
    MOMENTUM_RATE,
    NEW,
    OLD,
    PULL,
    REST,
    SMOOTH_STEPS,
    START_MOMENTUM,
    START_POSITION,
    START_STRETCHED,
    STRETCHED_RATE,
    WATER,
    Rope,
    unknowns,
)
from cable.lumped.springs import observe, pull_nodes, update_springs
from cable.properties import CableNumbers
from subzero.jit import compiled, inner

GAMMA = 2.0 - sqrt(2.0)
"""Where the first stage ends, as a share of the step."""
START_OF_LEG = (0, 1, 4, 7, 8, 11, 14, 15)
"""Where time, places of tow point and drum, what the winch is asked for, and the three's rates stand in a leg."""
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


@compiled
def take_step(
    rope: Rope,
    h: float,
    legs: np.ndarray,
    c: CableNumbers,
    drum: DrumNumbers,
    water: Water,
    segment_length: float,
) -> tuple[bool, int, float, int]:
    """Take a step of length h; what the ends do at the end of both stages stands in `legs` (2, 15).

    Return a `StageSolved` as a tuple, for Python.
    """
    solved = try_step(rope, h, legs, c, drum, water)
    if solved.converged:
        accept_step(rope, h, segment_length, c)
    return solved.converged, solved.iterations, solved.residual, solved.worst


@inner
def try_step(
    rope: Rope, h: float, legs: np.ndarray, c: CableNumbers, drum: DrumNumbers, water: Water
) -> StageSolved:
    """Solve a step, as `take_step`, and leave level OLD as it is: the step can be tried again to other places.

    Before another try the springs need their states of the start of the step back (`rope.STATE`).
    """
    g = 0.5 * GAMMA * h
    rope.ends.by_payout = 0.0 if drum.control == LENGTH or rope.ends.free_end else g
    start_trapezoid(rope, g)
    rope.ends.payout[NEW] = rope.ends.payout[OLD]
    spent = 0
    rope.ends.stage_end, rope.ends.loose[MIDDLE] = GAMMA * h, 0.0
    for stage in range(2):
        if stage == 1:
            start_backward(rope)
            rope.ends.stage_end = h
        lead_ends(rope, legs[stage], drum)
        solved = solve_stage(rope, g, legs[stage, 0], c, drum, water)
        spent += solved.iterations
        if not solved.converged:
            return StageSolved(False, spent, solved.residual, solved.worst)
        if drum.control == FREE and not rope.ends.free_end:
            wind_off(rope, g, drum)
    return StageSolved(True, spent, solved.residual, solved.worst)


@inner
def accept_step(rope: Rope, h: float, segment_length: float, c: CableNumbers) -> None:
    """Make a step that was solved real."""
    keep(rope, 0.5 * GAMMA * h)
    mind_the_drum(rope, segment_length, c)


@inner
def lead_ends(rope: Rope, leg: np.ndarray, drum: DrumNumbers) -> None:
    """Put the ends at level NEW where a leg (15,) has them."""
    for i in range(3):
        rope.position[NEW, 0, i], rope.velocity[NEW, 0, i] = leg[1 + i], leg[8 + i]
        rope.ends.drum_place[i], rope.ends.drum_velocity[i] = leg[4 + i], leg[11 + i]
    rope.ends.wanted = leg[7]
    if drum.control == LENGTH and not rope.ends.free_end:
        rope.ends.payout[NEW] = leg[14]


@compiled
def begin(rope: Rope, leg: np.ndarray, c: CableNumbers, water: Water) -> None:
    """Complete the state of a cable that is laid out: lengths, momenta and their rates."""
    N, U = rope.ends.count, rope.ends.payout[OLD]
    for j in range(N + 1):
        x, J = rope.position[OLD, j], rope.vector[WATER, j]
        J[0], J[1], J[2] = water_velocity(water, x[0], x[1], x[2], leg[0])
        if j > 0:
            settle(rope, j)
    fill_momenta(rope, c)
    if rope.ends.free_end:
        return
    for end in range(2):
        width = rope.spring[REST, N] + (rope.spring[REST, N - 1] if end == 1 and N > 1 else 0.0)
        for i in range(3):
            rope.vector[MOMENTUM_RATE, N - end, i] = U / width * rope.momentum[OLD, N - end, i]


@inner
def start_trapezoid(rope: Rope, g: float) -> None:
    """Fill the values that the first stage builds on, with constant velocities as the first guess."""
    for j in range(rope.ends.count + 1):
        for i in range(3):
            rope.vector[START_POSITION, j, i] = rope.position[OLD, j, i] + g * rope.velocity[OLD, j, i]
            rope.vector[START_MOMENTUM, j, i] = (
                rope.momentum[OLD, j, i] + g * rope.vector[MOMENTUM_RATE, j, i]
            )
            rope.velocity[NEW, j, i] = rope.velocity[OLD, j, i]
        rope.spring[START_STRETCHED, j] = rope.stretched[OLD, j] + g * rope.spring[STRETCHED_RATE, j]
    rope.ends.start_last = rope.ends.last[OLD] + g * rope.ends.payout[OLD]
    rope.ends.start_payout = rope.ends.payout[OLD] + g * rope.ends.payout_rate


@inner
def start_backward(rope: Rope) -> None:
    """Keep the first stage on level MIDDLE, and fill what the second one builds on."""
    new, old = 1.0 / (GAMMA * (2.0 - GAMMA)), -((1.0 - GAMMA) ** 2) / (GAMMA * (2.0 - GAMMA))
    x, P, L = rope.position, rope.momentum, rope.stretched
    for j in range(rope.ends.count + 1):
        for i in range(3):
            rope.vector[START_POSITION, j, i] = new * x[NEW, j, i] + old * x[OLD, j, i]
            rope.vector[START_MOMENTUM, j, i] = new * P[NEW, j, i] + old * P[OLD, j, i]
        rope.spring[START_STRETCHED, j] = new * L[NEW, j] + old * L[OLD, j]
    last, U = rope.ends.last, rope.ends.payout
    last[MIDDLE], U[MIDDLE], rope.ends.loose[MIDDLE] = last[NEW], U[NEW], rope.ends.loose[NEW]
    rope.ends.start_last = new * last[NEW] + old * last[OLD]
    rope.ends.start_payout = new * U[NEW] + old * U[OLD]


@inner
def keep(rope: Rope, g: float) -> None:
    """Make level NEW the present one, with the rates of the last stage."""
    for j in range(rope.ends.count + 1):
        for i in range(3):
            rope.vector[MOMENTUM_RATE, j, i] = (
                rope.momentum[NEW, j, i] - rope.vector[START_MOMENTUM, j, i]
            ) / g
            rope.position[OLD, j, i] = rope.position[NEW, j, i]
            rope.velocity[OLD, j, i] = rope.velocity[NEW, j, i]
            rope.momentum[OLD, j, i] = rope.momentum[NEW, j, i]
        rope.spring[STRETCHED_RATE, j] = (rope.stretched[NEW, j] - rope.spring[START_STRETCHED, j]) / g
        rope.stretched[OLD, j] = rope.stretched[NEW, j]
    rope.ends.payout_rate = (rope.ends.payout[NEW] - rope.ends.start_payout) / g
    rope.ends.last[OLD], rope.ends.payout[OLD] = rope.ends.last[NEW], rope.ends.payout[NEW]
    rope.ends.spin[OLD], rope.ends.loose[OLD] = rope.ends.spin[NEW], rope.ends.loose[NEW]
    rope.ends.since_loose = 0 if rope.ends.loose[NEW] > 0.0 else min(rope.ends.since_loose + 1, SMOOTH_STEPS)


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
