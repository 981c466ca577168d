"""Advance the cable by one step: try it, and when all agree, accept it.

`try_step` solves for a new tow-point position without forgetting where the cable was, so a vehicle and its cable
can ask "what if" until they agree. `accept` makes the new level the present one and, when the growing segment has
become long, splits it.

What the drum does in the step (turn, stand, spin ahead of the cable) is guessed from the step before, and changed
when the answer contradicts it (`cable.drum`).

There is a new node at the drum when the last segment has become long, and one less when it has become short. Both
happen between two steps, at levels NOW and BEFORE, and leave length, shape and motion of the cable as they are.
"""

from __future__ import annotations

import numpy as np

from cable.current import Water
from cable.drum import FREE, STANDING, next_mode
from cable.moving_end.bdf2 import backward_weights
from cable.moving_end.chord_correction import correct_for_arc
from cable.moving_end.newton import solve_step
from cable.moving_end.segment_load import Load
from cable.moving_end.slack_law import KNOWN, SMOOTHING
from cable.moving_end.state import (
    BEFORE,
    NEW,
    NOW,
    SPLIT_AT,
    Line,
    feel_water,
    held_node,
    segment_momentum,
    spacing,
)
from cable.moving_end.tow_boundary import fill_node_tensions, follow_tow
from cable.properties import CableNumbers, DrumNumbers
from subzero.jit import compiled, inlined, inner

SOFTEST = 1e-4
"""T₀ that a difficult step starts with, a tenth at a time down to `slack_law.SMOOTHING`. [N]"""
TAUT = 1e-2
"""A step begins with at least this tension everywhere: Newton then looks for a taut cable first. [N]"""
TAKEN_UP = 1e-9
"""A free drum that would take up more cable than this in a step has not been solved: try a smaller one. [m]"""
MERGE_AT = 0.5
"""While cable is reeled in, a last segment shorter than this fraction of the one before is joined to it."""
MOST_DRUM_CHANGES = 4
"""How often one step may change its mind about what the drum does."""


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
        line: the cable; levels NOW and BEFORE stay untouched.
        step: Δt. [s]
        tow: position of the tow point at the new time, earth axes (3,). [m]
        water: how the water moves.
        c: cable.
        drum: drum, with its place and velocity at the new time.
        work: work space.
        again: level NEW holds the answer to another tow point, close by.
    """
    failed, converged = 0, False
    for change in range(MOST_DRUM_CHANGES):
        converged = _solve_softly(line, step, tow, water, c, drum, work, again and change == 0)
        if line.ends.count == 1 or drum.control != FREE or line.ends.free_end:
            break
        mode = next_mode(line.ends.drum_mode, converged, line.ends.payout[NEW], line.ends.drum_pull, drum)
        if not converged:
            failed |= 1 << line.ends.drum_mode
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
    """Say whether a free drum would have taken up cable."""
    taken_up = line.ends.last_length[NOW] - line.ends.last_length[NEW] > TAKEN_UP
    return taken_up and drum.control == FREE and not line.ends.free_end


@compiled
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
    """Solve from the answer to a tow point close by, if there is one; else, or if that leads astray, from a prediction;
    if that fails, with a slack law that is made sharp little by little.
    """
    w = backward_weights(step, line.ends.previous_step)
    if (
        again
        and follow_tow(line, tow)
        and solve_step(line, w, c, drum, work, True)
        and not _takes_up(line, drum)
    ):
        return True
    _predict(line, step, tow, water, c, drum, work)
    if solve_step(line, w, c, drum, work, False):
        return True
    _predict(line, step, tow, water, c, drum, work)
    pull = drum.friction + abs(c.weight) * (line.ends.settled + line.ends.last_length[NOW])
    for j in range(1, line.ends.count + 1):
        line.tension[NEW, j] = max(line.tension[NEW, j], pull)
    spent = line.ends.solved.iterations
    line.ends.smoothing = SOFTEST
    while True:
        converged = solve_step(line, w, c, drum, work, False)
        spent += line.ends.solved.iterations
        if not converged or line.ends.smoothing <= SMOOTHING:
            break
        line.ends.smoothing = max(0.1 * line.ends.smoothing, SMOOTHING)
    line.ends.smoothing = SMOOTHING
    line.ends.solved.iterations = spent
    return converged


@compiled
def _predict(
    line: Line, step: float, tow: np.ndarray, water: Water, c: CableNumbers, drum: DrumNumbers, work: Load
) -> None:
    """Guess level NEW: everything goes on as it moves, tensions stay; and what is held at its prediction."""
    N, held = line.ends.count, held_node(line)
    ratio = step / line.ends.previous_step if line.ends.previous_step > 0.0 else 0.0
    for j in range(N + 1):
        tension = line.tension[NOW, j] + ratio * (line.tension[NOW, j] - line.tension[BEFORE, j])
        line.tension[NEW, j] = tension if tension > KNOWN else max(line.tension[NOW, j], TAUT)
        for i in range(3):
            change = ratio * (line.velocity[NOW, j, i] - line.velocity[BEFORE, j, i])
            moved = line.position[NOW, j, i] + step * (line.velocity[NOW, j, i] + 0.5 * change)
            line.position[NEW, j, i] = moved if j < held else drum.place[i]
    for i in range(3):
        line.position[NEW, 0, i] = tow[i]
        line.ends.drum_velocity[i] = drum.velocity[i]
    rate, last = line.ends.payout, line.ends.last_length
    growth = step * (rate[NOW] + 0.5 * ratio * (rate[NOW] - rate[BEFORE]))
    last[NEW] = max(last[NOW] + (0.0 if line.ends.drum_mode == STANDING else growth), 0.5 * last[NOW])
    if not line.ends.free_end:
        pull = max(line.node_tension[N], 0.0)
        line.tension[NEW, N] = max(pull + (line.tension[NOW, N] - pull) * last[NEW] / last[NOW], KNOWN)
    feel_water(line, water, line.ends.time + step)
    correct_for_arc(line, drum.control != FREE, work)


@compiled
def accept(line: Line, step: float, c: CableNumbers, work: Load) -> None:
    """Make level NEW the present one; split the last segment while it is too long, join it while it is too short."""
    N = line.ends.count
    for level in (BEFORE, NOW):
        for j in range(N + 1):
            for i in range(3):
                line.position[level, j, i] = line.position[level - 1, j, i]
                line.velocity[level, j, i] = line.velocity[level - 1, j, i]
                line.momentum[level, j, i] = line.momentum[level - 1, j, i]
                line.water[level, j, i] = line.water[level - 1, j, i]
        line.ends.last_length[level] = line.ends.last_length[level - 1]
        line.ends.payout[level] = line.ends.payout[level - 1]
    for j in range(N + 1):
        line.tension[BEFORE, j] = line.tension[NOW, j]
        line.tension[NOW, j] = line.tension[NEW, j]
    fill_node_tensions(line)
    line.ends.previous_step = step
    line.ends.time += step
    if line.ends.free_end:
        return
    last = line.ends.last_length
    while last[NOW] > SPLIT_AT * spacing(line) and line.ends.count < line.length.size - 1:
        split_last(line, spacing(line), c, work)
    while line.ends.count > 1 and last[NOW] < MERGE_AT * line.length[line.ends.count - 1]:
        merge_last(line, c, work)


@inner
def split_last(line: Line, segment_length: float, c: CableNumbers, work: Load) -> None:
    """Insert a node `segment_length` from the start of the last segment, on its chord, at levels NOW and BEFORE.

    The new node is a material point. At level BEFORE it may still have been on the drum: then it is put where the
    straight continuation of the chord would have had it, so that its backward differences stay smooth. Where little or
    nothing of the last segment was out of the drum then, the segment before it is continued: a step may pay out several
    segments, or one exactly.
    """
    N = line.ends.count
    for level in (NOW, BEFORE):
        beyond = N > 1 and line.ends.last_length[level] < 0.5 * segment_length
        fraction = segment_length / (line.length[N - 1] if beyond else line.ends.last_length[level])
        _insert_between(line.position[level], N, fraction, beyond)
        _insert_between(line.velocity[level], N, fraction, beyond)
        _insert_between(line.water[level], N, fraction, beyond)
        line.ends.last_length[level] -= segment_length
        if level == NOW:
            near, end = line.node_tension[N - 1], line.node_tension[N]
            line.node_tension[N] = near + fraction * (end - near)
            line.node_tension[N + 1] = end
            _share_tension(line, N, fraction, near - end)
    line.length[N] = segment_length
    line.ends.count = N + 1
    line.ends.settled += segment_length
    for level in (NOW, BEFORE):
        segment_momentum(line, level, N, segment_length, c, work)
        segment_momentum(line, level, N + 1, line.ends.last_length[level], c, work)


@compiled
def _share_tension(line: Line, N: int, fraction: float, drop: float) -> None:
    """Give both parts of a split segment the tension at their middles, for a tension that falls evenly by `drop`."""
    for level in (NOW, BEFORE):
        line.tension[level, N + 1] = max(line.tension[level, N] - 0.5 * fraction * drop, 0.0)
        line.tension[level, N] += 0.5 * (1.0 - fraction) * drop


@compiled
def _insert_between(values: np.ndarray, last: int, fraction: float, beyond: bool) -> None:
    """Move the last row of `values` (nodes, 3) one down, and interpolate or extrapolate a new row before it.

    Either along the last interval, or, `beyond`, along the one before it.
    """
    for i in range(3):
        near, end = values[last - 1, i], values[last, i]
        values[last + 1, i] = end
        values[last, i] = near + fraction * (near - values[last - 2, i] if beyond else end - near)


@inner
def merge_last(line: Line, c: CableNumbers, work: Load) -> None:
    """Take the node before the drum out, at levels NOW and BEFORE: the last two segments become one.

    A taut new segment is as long as its chord (in the elastic state of its neighbours): the arc that the node cut
    off, an eighth of the angle squared, is given back to the drum, without a jolt.
    """
    N = line.ends.count
    last = line.ends.last_length
    square = 0.0
    for i in range(3):
        square += (line.position[NOW, N, i] - line.position[NOW, N - 2, i]) ** 2
    whole = line.length[N - 1] + last[NOW]
    pieces = _chord(line, N - 1) + _chord(line, N)
    taut = min(line.tension[NOW, N - 1], line.tension[NOW, N]) > KNOWN
    cut_off = whole * (1.0 - np.sqrt(square) / max(pieces, 1e-12)) if taut else 0.0
    for level in (NOW, BEFORE):
        last[level] += line.length[N - 1] - cut_off
        for i in range(3):
            line.position[level, N - 1, i] = line.position[level, N, i]
            line.velocity[level, N - 1, i] = line.velocity[level, N, i]
            line.water[level, N - 1, i] = line.water[level, N, i]
    line.tension[NOW, N - 1] = 0.5 * (line.tension[NOW, N - 1] + line.tension[NOW, N])
    line.tension[BEFORE, N - 1] = 0.5 * (line.tension[BEFORE, N - 1] + line.tension[BEFORE, N])
    line.node_tension[N - 1] = line.node_tension[N]
    line.ends.count = N - 1
    line.ends.settled -= line.length[N - 1]
    for level in (NOW, BEFORE):
        segment_momentum(line, level, N - 1, last[level], c, work)


@compiled
def _chord(line: Line, j: int) -> float:
    """Return the distance of the ends of segment j at level NOW. [m]."""
    square = 0.0
    for i in range(3):
        square += (line.position[NOW, j, i] - line.position[NOW, j - 1, i]) ** 2
    return np.sqrt(square)
