"""The start of a run: a cable that is straight, hangs, or is towed steadily, at three equal levels of time."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, sqrt
from typing import Any

import numpy as np

from cable.current import Water
from cable.drum import FREE, TURNING, DrumNumbers
from cable.history import Equilibrium
from cable.moving_end.composition import steady_tow
from cable.moving_end.segment_load import Load, segment_momentum
from cable.moving_end.state import (
    BEFORE,
    LONGEST,
    NEW,
    NOW,
    SPLIT_AT,
    Line,
    new_line,
    sample_water,
    spacing,
)
from cable.properties import CableNumbers
from cable.sea_bed import SeaBed
from cable.sections import AnyCable, SectionedCable, check_length
from cable.tow_path import first_direction, segments_needed, steady_direction
from subzero.jit import compiled


@compiled
def lay_straight(
    line: Line, wet_length: float, direction: np.ndarray, tow: np.ndarray, drum: DrumNumbers, c: CableNumbers
) -> None:
    """Lay a straight cable from the drum along `direction` (a unit vector) to a tow point that moves at `tow`.

    The cable is as long as `wet_length` says, in segments of `spacing`, those far from both ends as long as
    `remeshing.join_far` would make them; it comes off the drum as fast as the tow point
    moves away, and its tension is that of a steady straight pull with none at the drum, so a run can start at speed
    without a jolt. Requires 0 < wet_length and a line with enough capacity.
    """
    ends, away = line.ends, 0.0
    ends.count, ends.settled, ends.time, ends.previous_step = 1, 0.0, 0.0, 0.0
    ends.drum_mode, ends.drum_pull = TURNING, 0.0
    # The last segment, which grows at the drum, takes the remainder.
    while wet_length - ends.settled > SPLIT_AT * spacing(line):
        line.length[ends.count] = spacing(line) + _more_in_the_middle(line, wet_length)
        ends.settled += line.length[ends.count]
        ends.count += 1
    line.length[ends.count] = wet_length - ends.settled
    for i in range(3):
        away += (tow[i] - drum.velocity[i]) * direction[i]
    if drum.control == FREE:  # where the vehicle backs up: a free drum takes nothing back
        away = max(away, 0.0)
    for level in range(3):
        ends.last_length[level] = line.length[ends.count]
        ends.payout[level] = away
        ends.loose[level] = ends.ahead[level] = 0.0
    _pull_straight(line, wet_length, direction, tow, drum, c)


@compiled
def _more_in_the_middle(line: Line, wet_length: float) -> float:
    """Return by how much the next segment is longer because it lies far from both ends. [m]

    ℓ = ℓ₀ + g₁ b, up to `LONGEST` more, with b = min(s, S − s − ℓ) − `far_length` > 0; which is solved for ℓ where the
    drum is the nearer end.
    """
    layout, s = line.ends.layout, line.ends.settled
    from_tow = s - layout.far_length
    from_drum = (wet_length - s - layout.far_length - spacing(line)) / (1.0 + layout.far_grading)
    return min(layout.far_grading * max(min(from_tow, from_drum), 0.0), LONGEST)


@compiled
def _pull_straight(
    line: Line, wet_length: float, direction: np.ndarray, tow: np.ndarray, drum: DrumNumbers, c: CableNumbers
) -> None:
    """Fill places, velocities (even between both ends) and tensions of a straight cable that moves along itself."""
    # A straight cable that moves along itself has the drag of its speed along itself only.
    speed = tow[0] * direction[0] + tow[1] * direction[1] + tow[2] * direction[2]
    per_metre, along = c.tangential_drag * speed * abs(speed), wet_length
    for j in range(line.ends.count + 1):
        if j > 0:
            for level in range(2):
                line.tension[level, j] = per_metre * (along - 0.5 * line.length[j])
            # `along` is the distance from the drum: it falls from the wet length to zero at the last node.
            along = along - line.length[j] if j < line.ends.count else 0.0
        line.node_tension[j] = max(per_metre, 0.0) * along
        for i in range(3):
            at_drum = drum.velocity[i] + line.ends.payout[NOW] * direction[i]
            velocity = at_drum + along / wet_length * (tow[i] - at_drum)
            for level in range(3):
                line.position[level, j, i] = along * direction[i]
                line.velocity[level, j, i] = velocity
    for i in range(3):
        line.ends.tow.force[i] = -per_metre * wet_length * direction[i]


def lay_held(line: Line, held: Equilibrium, tow: np.ndarray, drum: np.ndarray, payout: float) -> None:
    """Lay a line in an equilibrium shape, at all levels of time: at rest, or moving with ends at velocity `tow` and
    `drum`.

    Args:
        line: with space for its segments; filled, relative to the second end.
        held: the equilibrium.
        tow: velocity of its first end (3,); even along the cable to the other. [m/s]
        drum: velocity of its second end (3,). [m/s]
        payout: rate at which cable enters at the second end. [m/s]
    """
    ends, N = line.ends, held.segment_lengths.size
    ends.count, ends.time, ends.previous_step, ends.drum_mode = N, 0.0, 0.0, TURNING
    line.length[1 : N + 1] = held.segment_lengths
    ends.settled, ends.last_length[:] = held.segment_lengths[:-1].sum(), held.segment_lengths[-1]
    ends.payout[:] = payout
    along = np.concatenate([[0.0], np.cumsum(held.segment_lengths)]) / held.length
    line.position[:, : N + 1] = held.shape - held.shape[-1]
    line.velocity[:, : N + 1] = tow + along[:, None] * (drum - tow)
    line.tension[:, 1 : N + 1], line.node_tension[: N + 1] = held.segment_tensions, held.tensions
    ends.tow.force[:], ends.drum_pull = held.tow_force, held.tensions[-1]
    if held.bed is not None:
        line.friction[:, : N + 1] = held.bed_friction


@compiled
def start_in_water(line: Line, water: Water, c: CableNumbers, work: Load) -> None:
    """Fill the water's velocity at the nodes and the segments' momenta, at all levels, from the motion at the
    start.
    """
    sample_water(line, water, line.ends.time)
    for level in (NOW, BEFORE):
        for j in range(line.ends.count + 1):
            for i in range(3):
                line.water[level, j, i] = line.water[NEW, j, i]
        for j in range(1, line.ends.count + 1):
            segment_momentum(line, level, j, c, work)


def _set_steady_tow(
    line: Line, velocity: np.ndarray, J: np.ndarray, cable: AnyCable, tail_drag: float, each: float
) -> None:
    """Give every node the tow point's velocity, and the segments tension and stretch of a steady tow: a straight one,
    but for a line of sections.
    """
    if isinstance(cable, SectionedCable):
        _set_steady_sections(line, velocity, J, cable, tail_drag, each)
        return
    N, U = line.ends.count, velocity - J
    t = -line.position[NOW, 0] / np.linalg.norm(line.position[NOW, 0])
    drag, weight = cable.tangential_drag * abs(U @ t) * -(U @ t), cable.weight_in_water * t[2]
    line.velocity[:, : N + 1] = velocity
    line.ends.payout[:] = 0.0
    pulls, middles = [tail_drag * float(U @ U)], []
    lengths = [*line.length[1:N].tolist(), line.ends.last_length[NOW]]
    # From the tail to the tow point, as the tension of each segment depends on the one before.
    for length in reversed(lengths):
        middles.append(_grown(pulls[-1], 0.5 * length, drag, weight, cable.compliance))
        pulls.append(_grown(middles[-1], 0.5 * length, drag, weight, cable.compliance))
    line.tension[:, 1 : N + 1], line.node_tension[: N + 1] = middles[::-1], pulls[::-1]
    chords = np.array(lengths) * (1.0 + cable.compliance * np.array(middles[::-1]))
    behind = np.cumsum(chords[::-1])[::-1]
    line.position[:, :N] = line.position[NOW, N] - behind[:, None] * t
    line.ends.tow.force[:], line.ends.drum_pull = pulls[-1] * t, pulls[0]


def _set_steady_sections(
    line: Line, velocity: np.ndarray, J: np.ndarray, cable: SectionedCable, tail_drag: float, each: float
) -> None:
    """Divide a line into segments at the ends of its sections and at its bodies, and lay it in a steady tow."""
    lengths = cable.divided(each)
    N = line.ends.count = lengths.size
    line.length[1 : N + 1] = lengths
    line.ends.last_length[:], line.ends.settled = lengths[-1], lengths[:-1].sum()
    line.ends.payout[:] = 0.0
    line.velocity[:, : N + 1] = velocity
    c: Any = cable.numbers()
    steady_tow(line, c, velocity - J, tail_drag)


def division(cable: AnyCable, length: float, each: float) -> int:
    """Return how many segments of about `each` [m] a cable of fixed length is divided into."""
    if isinstance(cable, SectionedCable):
        check_length(cable, length)
        return int(cable.divided(each).size)
    return max(1, int(np.ceil(length / each - 1e-9)))


def trail(line: Line, bed: SeaBed | None, surface: float | None) -> None:
    """Lay what would begin below the bed, or above the surface, on it, in the direction in which it would have gone."""
    if bed is not None:
        _trail(line, bed.below, bed.normal)
    if surface is not None:
        _trail(line, lambda places: surface - np.atleast_2d(places)[:, 2], np.array([0.0, 0.0, -1.0]))


def _trail(line: Line, beyond: Callable[[np.ndarray], np.ndarray], n: np.ndarray) -> None:
    """Lay what would begin beyond a plane with the unit normal n on it; `beyond` is how far places are (n,). [m]"""
    N, x, origin = line.ends.count, line.position[NOW], np.asarray(line.ends.origin)
    if beyond(x[: N + 1] + origin).max() <= 0.0:
        return
    chords, away = np.diff(x[: N + 1], axis=0), x[N] - x[0]
    away = away - (away @ n) * n
    size = float(np.linalg.norm(away))
    away = away / size if size > 0.0 else first_direction(np.zeros((1, 3)))
    for j in range(1, N + 1):
        chord = float(np.linalg.norm(chords[j - 1]))
        x[j] = x[j - 1] + chords[j - 1]
        if beyond(x[j] + origin)[0] > 0.0:
            down = min(max(-float(beyond(x[j - 1] + origin)[0]), 0.0), chord)
            x[j] = x[j - 1] + down * n + np.sqrt(chord * chord - down * down) * away
    line.position[:, : N + 1] = x[: N + 1]


def _grown(T: float, length: float, drag: float, weight: float, e: float) -> float:
    """Return the tension `length` further up, dT/ds = drag √(1 + eT) + weight; none where it would push. [N]."""
    end, before = T, inf
    while abs(end - before) > 1e-15 * abs(end):
        before, end = end, T + length * (drag * sqrt(1.0 + e * 0.5 * (T + end)) + weight)
    return max(end, 0.0)


def straight_between(
    states: np.ndarray, length: float, each: float, drum: DrumNumbers, c: CableNumbers
) -> Line:
    """Return a straight line between the ends; one of no length lies along the way of its first end."""
    apart, drum.velocity[:] = states[0, 0] - states[1, 0], states[1, 1]
    direction = first_direction(np.array([apart, states[0, 1] - states[1, 1]]))
    line = new_line(segments_needed(length, each, 0.0))
    line.ends.layout.segment_length = each
    lay_straight(line, length, direction, states[0, 1], drum, c)
    line.ends.drum_force[:] = -direction * float(line.node_tension[line.ends.count])
    return line


def towed(
    cable: AnyCable, velocity: np.ndarray, length: float, each: float, J: np.ndarray, tail_drag: float
) -> Line:
    """Return a line that is towed steadily, its places counted from its tail.

    Args:
        cable: the cable.
        velocity: of the tow point, from the start on (n, 3). [m/s]
        length: L. [m]
        each: length of its segments. [m]
        J: velocity of the water (3,). [m/s]
        tail_drag: ½ρC_dA of a drogue. [kg/m]
    """
    count = division(cable, length, each)
    line = new_line(count)
    line.ends.layout.segment_length = length / count
    uphill = steady_direction(velocity - J, cable, tail_drag)
    lay_straight(line, length, uphill, velocity[0], DrumNumbers(), cable.numbers())
    line.ends.layout.free_end, line.ends.layout.tail_drag = True, tail_drag
    _set_steady_tow(line, velocity[0], J, cable, tail_drag, each)
    return line
