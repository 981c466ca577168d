"""Solve one step: predict it, and correct the prediction by Newton's method.

`try_step` solves for a new tow-point position without forgetting where the cable was, so a vehicle and its cable
can ask "what if" until they agree; `remeshing.accept` then makes the answer the present state.

What the drum does in the step (turn, stand, spin ahead of the cable) is guessed from the step before, and changed
when the answer contradicts it (`cable.drum`). Newton's method is damped, bounded in iterations, and always has an
outcome. Its last matrix gives the response of the tow force, and of all the cable, to the tow point.
"""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np

from cable.current import Water
from cable.drum import FREE, SPINNING, STANDING, DrumNumbers, next_mode
from cable.moving_end.assembly import assemble, assemble_residual
from cable.moving_end.bdf2 import Weights, backward_weights
from cable.moving_end.bending import has_residual, solve_for_step
from cable.moving_end.block_solver import SIZE, spread
from cable.moving_end.chord_correction import correct_for_arc
from cable.moving_end.drum_end import rate_taken
from cable.moving_end.segment_load import Load
from cable.moving_end.slack_law import KNOWN, SMOOTHING, SOFTEST, STRAIN_SCALE
from cable.moving_end.state import (
    BEFORE,
    GUESS,
    LOWER,
    NEW,
    NOW,
    RESIDUAL,
    STEP,
    Line,
    held_node,
    sample_water,
)
from cable.properties import CableNumbers
from subzero.jit import compiled, expanded, inlined, inner, scratch

TAUT = 1e-2
"""A step begins with at least this tension everywhere: Newton then looks for a taut cable first. [N]"""
TAKEN_UP = 1e-9
"""A free drum that would take up more cable than this in a step has not been solved: try a smaller one. [m]"""
MOST_DRUM_CHANGES = 4
"""How often the state of the drum may change within the solution of one step."""
MAX_ITERATIONS = 40
MAX_HALVINGS = 8
ABSOLUTE_TOLERANCE = 1e-13
"""Balances of a cable without tension hold to this. [N]"""
ROUNDING = 1e-15
"""Positions x are known to this fraction; inertia m1 ℓ a₀ b₀ x and strain x/ℓ of a segment cannot be known better."""
NEARLY = 1e-5
"""Below this merit a step is taken whole: Newton's method ends there by itself; rounding could hide its progress."""
FAR = 1e-2
"""From a merit above this, no step of Newton's method gets to the end: the next matrix is made with the residual."""
BOLD_STEPS = 40
"""Where tensions are kept above zero, so many Newton steps are taken whole: each finds out which segments are slack,
and the residual falls at once when all are found."""
SMALLEST_SEGMENT = 1e-9
"""The growing segment never gets shorter than this while iterating. [m]"""


@compiled
def try_step(
    line: Line,
    step: float,
    tow: np.ndarray,
    water: Water,
    c: CableNumbers,
    drum: DrumNumbers,
    work: Load,
    again: bool = False,
) -> bool:
    """Solve for the cable `step` later, with the tow point at `tow` (relative to the drum), on level NEW.

    Return whether there is a solution; `line.ends.solved` says how it was found.

    Args:
        line: the cable; levels NOW and BEFORE are not changed.
        step: Δt. [s]
        tow: position of the tow point at the new time, earth axes (3,). [m]
        water: how the water moves.
        c: cable.
        drum: drum, with its place and velocity at the new time.
        work: work space.
        again: level NEW holds the solution for another tow point, close by.
    """
    failed, converged = 0, False
    # The solution may show that the drum is in another state than assumed: solve again in that state.
    for change in range(MOST_DRUM_CHANGES):
        converged = _solve_softly(line, step, tow, water, c, drum, work, again and change == 0)
        # With one segment, a winch or a free end the drum has one state only.
        if line.ends.count == 1 or drum.control != FREE or line.ends.layout.free_end:
            break
        ends = line.ends
        mode = next_mode(
            ends.drum_mode, converged, rate_taken(line, 1.0 / step), ends.loose[NEW], ends.drum_pull, drum
        )
        if not converged or (mode == STANDING and ends.drum_mode == SPINNING):
            # A bit for each state without a solution, so that the loop does not return to it.
            failed |= 1 << line.ends.drum_mode  # a line that would take loose cable back stands
        if mode == line.ends.drum_mode or (failed >> mode) & 1:
            break
        line.ends.drum_mode = mode
    if converged and _takes_up(line, drum):
        solved = line.ends.solved
        solved.converged, solved.worst_node, solved.worst_equation = False, line.ends.count, 0
        return False
    return converged


@inlined
def _takes_up(line: Line, drum: DrumNumbers) -> bool:
    """Return whether a free drum would have taken up cable."""
    taken_up = line.ends.last_length[NOW] - line.ends.last_length[NEW] > TAKEN_UP
    return taken_up and drum.control == FREE and not line.ends.layout.free_end


@expanded
def _solve_softly(
    line: Line,
    step: float,
    tow: np.ndarray,
    water: Water,
    c: CableNumbers,
    drum: DrumNumbers,
    work: Load,
    again: bool,
) -> bool:
    """Solve from the solution for a tow point close by, if there is one; if there is none, or if Newton's method does
    not converge from it, solve from a prediction; if that fails, with a slack law that is sharpened in stages.
    """
    w = backward_weights(step, line.ends.previous_step)
    line.ends.solver.bold_steps = 0
    if (
        again
        and follow_tow(line, tow)
        and solve_step(line, w, c, drum, work, True)
        and not _takes_up(line, drum)
    ):
        return True
    if line.ends.solver.pulls_only:
        _predict(line, step, tow, water, c, drum, work)
        line.ends.solver.bold_steps = BOLD_STEPS
        if solve_step(line, w, c, drum, work, False):
            return True
        line.ends.solver.bold_steps = 0
    _predict(line, step, tow, water, c, drum, work)
    if solve_step(line, w, c, drum, work, False):
        return True
    # Last attempt: a softer slack law lets Newton's method converge from farther away.
    _predict(line, step, tow, water, c, drum, work)
    pull = drum.friction + abs(c.weight) * (line.ends.settled + line.ends.last_length[NOW])
    for j in range(1, line.ends.count + 1):
        # All segments start taut, with at least the tension that friction and weight can cause.
        line.tension[NEW, j] = max(line.tension[NEW, j], pull)
    return solve_softened(line, w, c, drum, work)


@inner
def solve_softened(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load) -> bool:
    """Solve with a softened slack law, which is then sharpened in stages, each with the solution of the one before as
    its first guess; iterations are added to those of the last attempt.
    """
    spent = line.ends.solved.iterations
    line.ends.solver.smoothing = SOFTEST
    while True:
        converged = solve_step(line, w, c, drum, work, False)
        spent += line.ends.solved.iterations
        if not converged or line.ends.solver.smoothing <= SMOOTHING:
            break
        line.ends.solver.smoothing = max(0.1 * line.ends.solver.smoothing, SMOOTHING)
    line.ends.solver.smoothing = SMOOTHING
    line.ends.solved.iterations = spent
    return converged


@compiled
def _predict(
    line: Line, step: float, tow: np.ndarray, water: Water, c: CableNumbers, drum: DrumNumbers, work: Load
) -> None:
    """Predict level NEW by extrapolation, and fill the quantities that are fixed while a step is solved."""
    N, held = line.ends.count, held_node(line)
    ratio = step / line.ends.previous_step if line.ends.previous_step > 0.0 else 0.0
    for j in range(N + 1):
        tension = line.tension[NOW, j] + ratio * (line.tension[NOW, j] - line.tension[BEFORE, j])
        # An extrapolation that is slack is replaced by the present tension, or by `TAUT` if that is larger.
        line.tension[NEW, j] = tension if tension > KNOWN else max(line.tension[NOW, j], TAUT)
        for i in range(3):
            change = ratio * (line.velocity[NOW, j, i] - line.velocity[BEFORE, j, i])
            moved = line.position[NOW, j, i] + step * (line.velocity[NOW, j, i] + 0.5 * change)
            line.position[NEW, j, i] = moved if j < held else drum.place[i]
    gap = scratch(1, 3)[0]
    for i in range(3):
        gap[i] = tow[i] - line.position[NEW, 0, i]
        line.position[NEW, 0, i] = tow[i]
        line.ends.drum_velocity[i] = drum.velocity[i]
    rate, last = line.ends.payout, line.ends.last_length
    growth = step * (rate[NOW] + 0.5 * ratio * (rate[NOW] - rate[BEFORE]))
    # The last segment is predicted to shrink to half of its length at most: a length has to remain positive.
    last[NEW] = max(last[NOW] + (0.0 if line.ends.drum_mode == STANDING else growth), 0.5 * last[NOW])
    if not line.ends.layout.free_end:
        pull = max(line.node_tension[N], 0.0)
        line.tension[NEW, N] = max(pull + (line.tension[NOW, N] - pull) * last[NEW] / last[NOW], KNOWN)
    sample_water(line, water, line.ends.time + step)
    correct_for_arc(line, drum.control != FREE, work)
    if line.ends.solver.factored:
        _relax(line, gap)


@inner
def solve_step(
    line: Line,
    w: Weights,
    c: CableNumbers,
    drum: DrumNumbers,
    work: Load,
    near: bool,
) -> bool:
    """Solve the equations of `assembly` for level NEW, from the guess in it; return whether the iteration converged,
    and report in `line.ends.solved` how. A guess as `near` as that of `follow_tow` is likely to be right: no matrix
    is made unless the residual shows that it is not.

    The matrix is computed for every step: a kept one converges to the tolerance only, and the remaining error then
    differs from run to run, which shows in sensitivities by differences. The residual alone shows whether a guess is
    good enough.
    """
    if c.retardation > 0.0:
        line.ends.solver.rounding = 1.0 + c.retardation * w.a0
    rounding, alone = ROUNDING * (c.mass + c.added_mass) * w.a0 * w.b0, has_residual(line, c)
    made = not near
    _residual(line, w, c, drum, work, near)
    merit = _merit(line)
    for iteration in range(MAX_ITERATIONS + line.ends.solver.bold_steps):
        # `merit` decides on the length of a Newton step, `size`, in tolerances, on convergence.
        size = _size(line, rounding, merit)
        if size <= 1.0:
            return _solved(line, iteration, size)
        if not made:
            assemble(line, w, c, drum, work)
        line.ends.solver.factored = solve_for_step(line, c)
        if not line.ends.solver.factored:
            break
        last_length, before, fraction = save_guess(line), merit, 1.0
        # Far from the solution another iteration is certain, so its matrix is computed together with the residual.
        made = before > FAR or not alone
        for _ in range(MAX_HALVINGS):
            go_from_guess(line, last_length, fraction)
            _residual(line, w, c, drum, work, not made)
            merit = _merit(line)
            # A residual has to fall by enough, and NaN never does; below `NEARLY` rounding decides, so any is
            # accepted.
            bold = line.ends.solver.bold_steps > 0
            if isfinite(merit) and (bold or merit <= max(before * (1.0 - 0.1 * fraction), NEARLY)):
                break
            fraction *= 0.5
        line.ends.solver.bold_steps = max(line.ends.solver.bold_steps - 1, 0)
        if not isfinite(merit):
            break
    size = _size(line, rounding, merit)
    return _solved(line, MAX_ITERATIONS, size) if size <= 1.0 else _failed(line, rounding)


@compiled
def _residual(line: Line, w: Weights, c: CableNumbers, drum: DrumNumbers, work: Load, alone: bool) -> None:
    """Fill the residual: `alone`, so that the factors of the last matrix are kept, or with the matrix."""
    if alone:
        assemble_residual(line, w, c, drum, work)
    else:
        assemble(line, w, c, drum, work)
        line.ends.solver.factored = False


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
    """Write guess minus `fraction` of the Newton step to level NEW.

    Where a stiff cable comes taut or slack, a Newton step takes every segment as taut, and has those that are not push,
    with more than all that pulls. With `pulls_only` they are taken at zero instead, where they find that they are
    slack; else the residual of what pushes lets no step be long.
    """
    N, held, guess, step = line.ends.count, held_node(line), line.rows[GUESS], line.rows[STEP]
    for j in range(1, N + 1):
        line.tension[NEW, j] = guess[j, 0] - fraction * step[j, 0]
        if line.ends.solver.pulls_only and line.tension[NEW, j] < 0.0:
            line.tension[NEW, j] = 0.0
        if j < held:
            for i in range(3):
                line.position[NEW, j, i] = guess[j, 1 + i] - fraction * step[j, 1 + i]
    if line.ends.layout.free_end:
        return
    # A Newton step may not make the last segment negative: it shrinks to a tenth at most.
    line.ends.last_length[NEW] = max(last_length - fraction * step[N, 1], 0.1 * last_length, SMALLEST_SEGMENT)


@inlined
def _tolerances(line: Line, rounding: float) -> tuple[float, float]:
    """Return by how much a length equation [-] and a balance [N] may be off.

    `Solver.tolerance` is the share of the largest tension in the cable for balances, and of `slack_law.STRAIN_SCALE`
    for lengths: 1e-9 is a strain of 1e-12.
    """
    tension, reach, x = 0.0, 0.0, line.position
    for j in range(1, line.ends.count + 1):
        tension = max(tension, abs(line.tension[NEW, j]))
        reach = max(reach, abs(x[NEW, j, 0]), abs(x[NEW, j, 1]), abs(x[NEW, j, 2]))
    # Lengths are differences of coordinates, so the rounding of large coordinates limits their accuracy.
    known = 2.0 * ROUNDING / STRAIN_SCALE * reach / max(line.length[1], SMALLEST_SEGMENT)
    strain = line.ends.solver.tolerance + known * line.ends.solver.rounding
    return strain, line.ends.solver.tolerance * tension + ABSOLUTE_TOLERANCE + rounding * line.length[
        1
    ] * reach


@compiled
def _size(line: Line, rounding: float, merit: float) -> float:
    """Return the largest residual as a multiple of its tolerance; infinite for one that is no number."""
    strain, allowed = _tolerances(line, rounding)
    length, balance, r = 0.0, 0.0, line.rows[RESIDUAL]
    for j in range(1, line.ends.count + 1):
        length = max(length, abs(r[j, 0]))
        balance = max(balance, abs(r[j, 1]), abs(r[j, 2]), abs(r[j, 3]))
    return max(length / strain, balance / allowed) if isfinite(merit) else np.inf


@inlined
def _solved(line: Line, iterations: int, size: float) -> bool:
    """Note that it converged, in how many iterations, and how large the worst residual is, in tolerances."""
    solved = line.ends.solved
    solved.converged, solved.iterations, solved.residual = True, iterations, size
    return True


@compiled
def _failed(line: Line, rounding: float) -> bool:
    """Report that it did not converge, and the place of the worst equation."""
    strain, allowed = _tolerances(line, rounding)
    worst, node, equation = 0.0, 0, 0
    for j in range(1, line.ends.count + 1):
        for i in range(4):
            size = abs(line.rows[RESIDUAL, j, i]) / (strain if i == 0 else allowed)
            # Once the worst value is NaN, worst == worst is false, so the first NaN is reported.
            if worst == worst and not size <= worst:
                worst, node, equation = size, j, i
    solved = line.ends.solved
    solved.converged, solved.iterations, solved.residual = False, MAX_ITERATIONS, worst
    solved.worst_node, solved.worst_equation = node, equation
    line.ends.solver.factored = False  # the matrix belongs to an iteration that did not converge
    return False


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


@inner
def impedance(line: Line, Z: np.ndarray) -> None:
    """Fill Z = ∂F/∂x (3, 3), the change of the tow force by a displacement of the tow point at the end of the step.

    Taken from the last Newton matrix, the answer of the whole cable included. [N/m].
    """
    for i in range(3):
        for k in range(3):
            Z[i, k] = line.ends.tow.by_tow[i, k]
            # The direct derivative plus the response of the first block: the chain rule over the whole cable.
            for m in range(4):
                Z[i, k] -= line.ends.tow.by_block[i, m] * line.ends.tow.answer[k, m]


@compiled
def _relax(line: Line, gap: np.ndarray) -> None:
    """Move all of level NEW by the response of the last matrix to a displacement `gap` (3,) of the tow point. [m]."""
    step, L = line.rows[RESIDUAL], line.blocks[LOWER]
    for j in range(1, line.ends.count + 1):
        for m in range(SIZE):
            step[j, m] = 0.0
    for m in range(SIZE):
        # The displacement enters the first block only; `spread` carries it to the others.
        for i in range(3):
            step[1, m] += L[1, m, 1 + i] * gap[i]
    spread(L, line.ends.count, step)
    go_from_guess(line, save_guess(line), 1.0)


@inner
def follow_tow(line: Line, tow: np.ndarray) -> bool:
    """Move the tow point of the answer on level NEW, and all that moves with it by the factors of the last matrix.

    Return False, and move nothing, if there are none.
    """
    if not line.ends.solver.factored:
        return False
    gap, at = scratch(1, 3)[0], line.position[NEW, 0]
    for i in range(3):
        gap[i], at[i] = tow[i] - at[i], tow[i]
    _relax(line, gap)
    return True
