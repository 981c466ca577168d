"""Make a solved step real; put a node in at the drum, or take one out, where the last segment asks for it.

There is a new node at the drum when the last segment has become long, and one less when it has become short. In a long
cable, nodes far from both ends are taken out where it is nearly straight. All of this happens between two steps, at
levels NOW and BEFORE, and leaves length, shape and motion of the cable as they are.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.moving_end.contact import keep_friction
from cable.moving_end.segment_load import Load, segment_momentum
from cable.moving_end.slack_law import KNOWN
from cable.moving_end.state import BEFORE, KNOWN_STEPS, LONGEST, NEW, NOW, SPLIT_AT, Line, spacing
from cable.properties import CableNumbers
from subzero.jit import compiled, inner

STRAIGHT = 2e-5
"""Far segments are joined where that shortens them by no more than this share: they turn by 0.7 degrees. [-]"""
MERGE_AT = 0.5
"""While cable is reeled in, a last segment shorter than this fraction of the one before is joined to it."""


@compiled
def accept(line: Line, step: float, c: CableNumbers, work: Load) -> None:
    """Make level NEW the present one; split the last segment while it is too long, join it while it is too short."""
    N = line.ends.count
    for level in (BEFORE, NOW):  # the oldest first: each takes over what the next newer one has
        for j in range(N + 1):
            for i in range(3):
                line.position[level, j, i] = line.position[level - 1, j, i]
                line.velocity[level, j, i] = line.velocity[level - 1, j, i]
                line.momentum[level, j, i] = line.momentum[level - 1, j, i]
                line.water[level, j, i] = line.water[level - 1, j, i]
        line.ends.last_length[level] = line.ends.last_length[level - 1]
        line.ends.payout[level] = line.ends.payout[level - 1]
        line.ends.loose[level] = max(line.ends.loose[level - 1], 0.0)
        line.ends.ahead[level] = line.ends.ahead[level - 1]
    for j in range(N + 1):
        line.tension[BEFORE, j] = line.tension[NOW, j]
        line.tension[NOW, j] = line.tension[NEW, j]
    keep_friction(line, c)
    fill_node_tensions(line)
    line.ends.since_loose = 0 if line.ends.loose[NOW] > 0.0 else min(line.ends.since_loose + 1, KNOWN_STEPS)
    line.ends.previous_step = step
    line.ends.time += step
    # A cable with a free tail neither grows nor shrinks.
    if line.ends.layout.free_end:
        return
    last = line.ends.last_length
    while last[NOW] > SPLIT_AT * spacing(line) and line.ends.count < line.length.size - 1:
        split_last(line, spacing(line), c, work)
    while line.ends.count > 1 and last[NOW] < MERGE_AT * line.length[line.ends.count - 1]:
        merge_last(line, c, work)
    if line.ends.layout.far_grading > 0.0:
        join_far(line, c, work)


@inner
def split_last(line: Line, segment_length: float, c: CableNumbers, work: Load) -> None:
    """Insert a node `segment_length` from the start of the last segment, on its chord, at levels NOW and BEFORE.

    The new node is a material point. At level BEFORE it may still have been on the drum: then it is put where the
    straight continuation of the chord would have had it, so that its backward differences remain smooth. Where little
    or nothing of the last segment was out of the drum then, the segment before it is continued: a step may pay out
    several segments, or one exactly.
    """
    N = line.ends.count
    for level in (NOW, BEFORE):
        # Too little of the segment was out of the drum at this level to interpolate on its chord.
        beyond = N > 1 and line.ends.last_length[level] < 0.5 * segment_length
        fraction = segment_length / (line.length[N - 1] if beyond else line.ends.last_length[level])
        _insert_between(line.position[level], N, fraction, beyond)
        _insert_between(line.velocity[level], N, fraction, beyond)
        _insert_between(line.water[level], N, fraction, beyond)
        # The same off both levels: a backward difference of the length, the pay-out rate, sees no jump. At level BEFORE
        # it may be negative, for a node that was still on the drum.
        line.ends.last_length[level] -= segment_length
        if level == NOW:
            near, end = line.node_tension[N - 1], line.node_tension[N]
            line.node_tension[N] = near + fraction * (end - near)
            line.node_tension[N + 1] = end
            _share_tension(line, N, fraction, near - end)
    for i in range(3):
        line.friction[NOW, N, i] = 0.0  # what comes off the drum has not slid yet
    line.length[N] = segment_length
    line.ends.count, line.ends.solver.factored = N + 1, False
    line.ends.settled += segment_length
    # Momenta are remembered for whole segments (d(ℓp)/dt in `assembly`), so both parts need theirs at both levels.
    for level in (NOW, BEFORE):
        segment_momentum(line, level, N, c, work)
        segment_momentum(line, level, N + 1, c, work)


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
    # Only a taut segment is as long as its chord; a slack one keeps its material.
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
    # The number of blocks changes, so the factors of the last matrix are of no use.
    line.ends.count, line.ends.solver.factored = N - 1, False
    line.ends.settled -= line.length[N - 1]
    for level in (NOW, BEFORE):
        segment_momentum(line, level, N - 1, c, work)


@inner
def join_far(line: Line, c: CableNumbers, work: Load) -> None:
    """Join pairs of segments far from both ends to one, where the cable is taut and nearly straight.

    b metres beyond `far_length` from the nearer end, a segment may be Δs + g s + g₁ b long, up to `LONGEST` more. The
    ends keep short segments: there a cable bends, near the vehicle in its turns, and near the drum, where it hardly
    pulls, by a current or its own weight.
    """
    ends, layout, along, j = line.ends, line.ends.layout, 0.0, 1
    while j < ends.count - 1:
        whole = line.length[j] + line.length[j + 1]
        beyond = min(along, ends.settled + ends.last_length[NOW] - along - whole) - layout.far_length
        longest = layout.segment_length + layout.grading * along + min(layout.far_grading * beyond, LONGEST)
        if beyond > 0.0 and whole <= longest and min(line.tension[NOW, j], line.tension[NOW, j + 1]) > KNOWN:
            cut_off = _cut_off(line, j)
            if cut_off <= STRAIGHT:
                _join(line, j, whole, cut_off)
                for level in (NOW, BEFORE):
                    segment_momentum(line, level, j, c, work)
        # In one pass a segment is joined once at most: the next pair begins after it.
        along += line.length[j]
        j += 1


@compiled
def _cut_off(line: Line, j: int) -> float:
    """Return by which share the chord over segments j and j + 1 is shorter than theirs. [-]"""
    square = 0.0
    for i in range(3):
        square += (line.position[NOW, j + 1, i] - line.position[NOW, j - 1, i]) ** 2
    return 1.0 - np.sqrt(square) / max(_chord(line, j) + _chord(line, j + 1), 1e-12)


@compiled
def _join(line: Line, j: int, whole: float, cut_off: float) -> None:
    """Take node j out: segments j and j + 1 become one, as long as its chord; the rest goes back to the drum."""
    N, share = line.ends.count, line.length[j] / whole
    # Quantities of the joined segment are means of its parts, weighted by their lengths.
    line.slip[j] += (1.0 - share) * (line.slip[j + 1] - line.slip[j])
    line.normal_gain[j] += (1.0 - share) * (line.normal_gain[j + 1] - line.normal_gain[j])
    for level in (NOW, BEFORE):
        line.tension[level, j] += (1.0 - share) * (line.tension[level, j + 1] - line.tension[level, j])
        for n in range(j, N):
            for i in range(3):
                line.position[level, n, i] = line.position[level, n + 1, i]
                line.velocity[level, n, i] = line.velocity[level, n + 1, i]
                line.water[level, n, i] = line.water[level, n + 1, i]
                line.momentum[level, n, i] = line.momentum[level, n + 1, i]
        for n in range(j + 1, N):
            line.tension[level, n] = line.tension[level, n + 1]
    for n in range(j, N):
        line.node_tension[n] = line.node_tension[n + 1]
        for i in range(3):
            line.friction[NOW, n, i] = line.friction[NOW, n + 1, i]
    for n in range(j + 1, N):
        line.length[n] = line.length[n + 1]
        line.slip[n], line.normal_gain[n] = line.slip[n + 1], line.normal_gain[n + 1]
    line.length[j] = whole * (1.0 - cut_off)
    line.ends.settled -= whole * cut_off
    line.ends.count, line.ends.solver.factored = N - 1, False


@compiled
def _chord(line: Line, j: int) -> float:
    """Return the distance of the ends of segment j at level NOW. [m]."""
    square = 0.0
    for i in range(3):
        square += (line.position[NOW, j, i] - line.position[NOW, j - 1, i]) ** 2
    return np.sqrt(square)


@inner
def end_tensions(line: Line) -> tuple[float, float]:
    """Return the tensions T(0) at the tow point and T(S) at the drum, of the last solved step. [N].

    T(0) is the size of the force (12); T(S) is the tension that drives the drum (11), with the drag and the inertia
    of the last half segment; a slack end has none.
    """
    F = line.ends.tow.force
    return sqrt(F[0] * F[0] + F[1] * F[1] + F[2] * F[2]), max(line.ends.drum_pull, 0.0)


@inner
def fill_node_tensions(line: Line) -> None:
    """Fill line.node_tension (nodes,) after a step: T_j + ½ t_j·Q_j at the far end of segment j. [N]."""
    N, x = line.ends.count, line.position
    line.node_tension[0], line.node_tension[N] = end_tensions(line)
    for j in range(1, N):
        along, square = 0.0, 0.0
        for i in range(3):
            d = x[NEW, j, i] - x[NEW, j - 1, i]
            along += d * line.load[j, i]
            square += d * d
        line.node_tension[j] = max(line.tension[NEW, j] + 0.5 * along / sqrt(max(square, 1e-30)), 0.0)
