"""Newton's method on the equations of one step: damped, bounded in iterations, and always with an outcome."""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np

from cable.moving_end.assembly import assemble, assemble_residual
from cable.moving_end.bdf2 import Weights
from cable.moving_end.bending import factor_step, has_residual, solve_factored
from cable.moving_end.segment_load import Load
from cable.moving_end.slack_law import STRAIN_SCALE
from cable.moving_end.state import GUESS, NEW, NOW, RESIDUAL, STEP, Line, held_node
from cable.properties import CableNumbers, DrumNumbers
from subzero.jit import compiled, inlined, inner

MAX_ITERATIONS = 40
MAX_HALVINGS = 8
ABSOLUTE_TOLERANCE = 1e-13
"""Balances of a cable without tension hold to this. [N]"""
ROUNDING = 1e-15
"""Positions x are known to this fraction; inertia m1 ℓ a₀ b₀ x and strain x/ℓ of a segment cannot be known better."""
NEARLY = 1e-5
"""Below this merit a step is taken whole: Newton's method ends there by itself; rounding could hide its progress."""
SMALLEST_SEGMENT = 1e-9
"""The growing segment never gets shorter than this while iterating. [m]"""


@inner
def solve_step(
    line: Line,
    w: Weights,
    c: CableNumbers,
    drum: DrumNumbers,
    work: Load,
    near: bool,
) -> bool:
    """Solve the equations of `assembly` for level NEW, from the guess that stands there; return whether that went well,
    and leave in `line.ends.solved` how. One that is as `near` as that
    of `follow_tow` is likely to be right: no matrix is made until the residual says that it is not.

    The matrix is made anew for every step: a kept one converges to the tolerance only, and what is left then differs
    from run to run, which sensitivities by differences see. Whether a guess will do, the residual tells by itself.
    """
    rounding, alone = ROUNDING * (c.mass + c.added_mass) * w.a0 * w.b0, has_residual(line, c)
    made = not near
    _residual(line, w, c, drum, work, near)
    merit = _merit(line)
    for iteration in range(MAX_ITERATIONS):
        if _size(line, rounding, merit) <= 1.0:
            return _solved(line, rounding, True, iteration)
        if not made:
            assemble(line, w, c, drum, work)
        line.ends.factored = factor_step(line, c)
        if not line.ends.factored:
            break
        solve_factored(line, c)
        last_length, before, fraction = save_guess(line), merit, 1.0
        for _ in range(MAX_HALVINGS):
            go_from_guess(line, last_length, fraction)
            _residual(line, w, c, drum, work, alone)
            made, merit = not alone, _merit(line)
            if isfinite(merit) and merit <= max(before * (1.0 - 0.1 * fraction), NEARLY):
                break
            fraction *= 0.5
        if not isfinite(merit):
            break
    return _solved(line, rounding, _size(line, rounding, merit) <= 1.0, MAX_ITERATIONS)


@compiled
def _residual(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load, alone: bool) -> None:
    """Fill the residual: `alone`, so that the factors of the last matrix stay, or with the matrix."""
    if alone:
        assemble_residual(line, w, c, drum, work)
    else:
        assemble(line, w, c, drum, work)
        line.ends.factored = False


@compiled
def save_guess(line: Line) -> float:
    """Keep the guess and the Newton step; return the guess of the last segment's length. [m]."""
    for j in range(1, line.ends.count + 1):
        line.rows[GUESS, j, 0] = line.tension[NEW, j]
        for i in range(3):
            line.rows[GUESS, j, 1 + i] = line.position[NEW, j, i]
        for i in range(4):
            line.rows[STEP, j, i] = line.rows[RESIDUAL, j, i]
    return line.ends.last_length[NEW]


@compiled
def go_from_guess(line: Line, last_length: float, fraction: float) -> None:
    """Write guess minus `fraction` of the Newton step to level NEW."""
    N, held, guess, step = line.ends.count, held_node(line), line.rows[GUESS], line.rows[STEP]
    for j in range(1, N + 1):
        line.tension[NEW, j] = guess[j, 0] - fraction * step[j, 0]
        if j < held:
            for i in range(3):
                line.position[NEW, j, i] = guess[j, 1 + i] - fraction * step[j, 1 + i]
    if line.ends.free_end:
        return
    line.ends.last_length[NEW] = max(last_length - fraction * step[N, 1], 0.1 * last_length, SMALLEST_SEGMENT)


@inlined
def _tolerances(line: Line, rounding: float) -> tuple[float, float]:
    """Return by how much a length equation [-] and a balance [N] may be off.

    `ends.tolerance` is the share of the largest tension in the cable for balances, and of `slack_law.STRAIN_SCALE` for
    lengths: 1e-9 is a strain of 1e-12.
    """
    tension, reach, x = 0.0, 0.0, line.position
    for j in range(1, line.ends.count + 1):
        tension = max(tension, abs(line.tension[NEW, j]))
        reach = max(reach, abs(x[NEW, j, 0]), abs(x[NEW, j, 1]), abs(x[NEW, j, 2]))
    known = 2.0 * ROUNDING / STRAIN_SCALE * reach / max(line.length[1], SMALLEST_SEGMENT)
    strain = line.ends.tolerance + known
    return strain, line.ends.tolerance * tension + ABSOLUTE_TOLERANCE + rounding * line.length[1] * reach


@compiled
def _size(line: Line, rounding: float, merit: float) -> float:
    """Return the largest residual as a multiple of its tolerance; infinite for one that is no number."""
    strain, allowed = _tolerances(line, rounding)
    length, balance, r = 0.0, 0.0, line.rows[RESIDUAL]
    for j in range(1, line.ends.count + 1):
        length = max(length, abs(r[j, 0]))
        balance = max(balance, abs(r[j, 1]), abs(r[j, 2]), abs(r[j, 3]))
    return max(length / strain, balance / allowed) if isfinite(merit) else np.inf


@compiled
def _solved(line: Line, rounding: float, converged: bool, iterations: int) -> bool:
    """Note how it ended, with the worst equation and where it stands; return whether it converged."""
    strain, allowed = _tolerances(line, rounding)
    worst, node, equation = 0.0, 0, 0
    for j in range(1, line.ends.count + 1):
        for i in range(4):
            size = abs(line.rows[RESIDUAL, j, i]) / (strain if i == 0 else allowed)
            if worst == worst and not size <= worst:
                worst, node, equation = size, j, i
    solved = line.ends.solved
    solved.converged, solved.iterations, solved.residual = converged, iterations, worst
    solved.worst_node, solved.worst_equation = node, equation
    return converged


@compiled
def _merit(line: Line) -> float:
    """Return the root of the sum of squares of all residuals, lengths in `STRAIN_SCALE`, balances in millinewtons.

    Where the cable pulls with more than 1 N, balances count in thousandths of its pull: the rounding of theirs, which
    grows with it, would hide the lengths, and no step would seem to help.
    """
    total, pull = 0.0, 1.0
    for j in range(1, line.ends.count + 1):
        pull = max(pull, line.tension[NOW, j])
    for j in range(1, line.ends.count + 1):
        total += line.rows[RESIDUAL, j, 0] ** 2
        for i in range(1, 4):
            total += (1e3 / pull * line.rows[RESIDUAL, j, i]) ** 2
    return sqrt(total)
