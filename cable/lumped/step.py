"""Advance the lumped cable by one step of TR-BDF2.

    trapezoidal rule to t + γh       y_γ = y + g (ẏ + ẏ_γ)
    backward differences to t + h    y₁ = (y_γ − (1 − γ)² y)/(γ(2 − γ)) + g ẏ₁,      γ = 2 − √2,  g = (1 − 1/√2) h

One method of second order: L-stable, both stages with the same g, and exact to second order within the stages too,
which the tension, an algebraic unknown, needs. y holds positions, momenta of the lumps, lengths of the springs, length
and pay-out rate at the drum.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.current import Water, water_velocity
from cable.lumped.newton import StageSolved, solve_stage
from cable.lumped.nodes import fill_momenta, mind_the_drum, settle
from cable.lumped.rope import (
    MIDDLE,
    MOMENTUM_RATE,
    NEW,
    OLD,
    REST,
    START_MOMENTUM,
    START_POSITION,
    START_STRETCHED,
    STRETCHED_RATE,
    WATER,
    Rope,
)
from cable.properties import CableNumbers, DrumNumbers
from cable.winch import LENGTH
from subzero.jit import compiled, inner

GAMMA = 2.0 - sqrt(2.0)
"""Where the first stage ends, as a share of the step."""
START_OF_LEG = (0, 1, 4, 7, 8, 11, 14, 15)
"""Where time, places of tow point and drum, what the winch is asked for, and the three's rates stand in a leg."""


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
    for stage in range(2):
        if stage == 1:
            start_backward(rope)
        lead_ends(rope, legs[stage], drum)
        solved = solve_stage(rope, g, legs[stage, 0], c, drum, water)
        spent += solved.iterations
        if not solved.converged:
            return StageSolved(False, spent, solved.residual, solved.worst)
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
    """Fill what the first stage builds on, and guess that all goes on."""
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
    last[MIDDLE], U[MIDDLE] = last[NEW], U[NEW]
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
