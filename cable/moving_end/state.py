"""The cable in the water as arrays: nodes from the tow point (0) to the drum (count), at three levels of time.

Nodes 0 … count−1 are material points; the last node sits at the drum, and the last segment grows while cable is
paid out (a moving end). Positions are relative to the drum, in earth axes (north, east, down).

Levels: `NEW` is being solved for, `NOW` is the last accepted time, `BEFORE` the one before. A step is tried on level
NEW as often as needed and becomes real only by `accept`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cable.current import Water, water_velocity
from cable.drum import TURNING
from cable.moving_end.slack_law import SMOOTHING
from cable.moving_end.wetting import dry_segment
from cable.properties import CableNumbers, FloatingCableNumbers, SectionedCableNumbers
from cable.schemes import TOLERANCE
from subzero.jit import Record, by_field_at, compiled, inlined, inner, made_once

# Levels of time: indices of the first axis of the arrays of `Line`.
NEW, NOW, BEFORE = 0, 1, 2

KNOWN_STEPS = 3
"""A drum that has caught up with the cable by a jerk turned smoothly at two levels of time after so many steps."""

SPLIT_AT = 1.5
"""The last segment is split when it has grown to this many segment lengths."""
LONGEST = 10.0
"""Far from both ends segments get longer by no more than this. Of 9 starts with 8.5 km of cable in the water (three
propeller speeds, three steps), which goes slack for a moment, all are solved with these; with 20 m one was not, with
50 m seven were not. [m]"""


class Layout(Record):
    """How a cable is divided into segments, and the kind of its far end; chosen at the start.

    Attributes:
        segment_length, grading: new segments are `segment_length` + `grading` s long, s from the tow point. [m], [-]
        far_length, far_grading: farther than this from both ends, segments are joined to longer ones, by so much per
            metre (`remeshing.join_far`); 0: none are. [m], [-]
        run_in: length L₀ from the tow point in which segments are shorter (`spacing`), 0 for none. [m]
        free_end: whether the far end is a free tail instead of the drum.
        tail_drag: ½ρC_dA of a drogue there. [kg/m]
    """

    segment_length: float = 1.0
    grading: float = 0.0
    far_length: float = 0.0
    far_grading: float = 0.0
    run_in: float = 0.0
    free_end: bool = False
    tail_drag: float = 0.0


class Solver(Record):
    """How a step is solved, and whether its matrix can be used again.

    Attributes:
        tolerance: how exactly, see `time_step`. [-]
        smoothing: T₀ of the slack law in force. [N]
        factored: whether the blocks hold the factors of the last Newton matrix.
        rounding: how many times the rounding of a strain is seen in a length equation: 1, or 1 + τ/Δt with damping. [-]
        bold_steps: so many Newton steps are still taken whole, whatever they do to the residual.
        pulls_only: whether no Newton step goes to a tension below zero, see `time_step.go_from_guess`.
    """

    tolerance: float = TOLERANCE
    smoothing: float = SMOOTHING
    factored: bool = False
    rounding: float = 1.0
    bold_steps: int = 0
    pulls_only: bool = False


class Solved(Record):
    """How the last iteration ended.

    Attributes:
        converged: whether it found a solution.
        iterations: of Newton's method.
        residual: the largest, as a multiple of its tolerance.
        worst_node: block in which that stands.
        worst_equation: which one it is: 0 length, 1 … 3 balance north, east, down.
    """

    converged: bool = True
    iterations: int = 0
    residual: float = 0.0
    worst_node: int = 0
    worst_equation: int = 0


class Tow(Record):
    """The force on the vehicle, and its derivatives by the place of the tow point.

    Attributes:
        force: at level NEW (3,). [N]
        past: the same at levels NOW and BEFORE (2, 3). [N]
        largest: the largest so far. [N]
        by_tow, by_block: derivatives of the force by the tow point's position (3, 3) and by the unknowns of the first
            block (3, 4).
        answer: minus the answer of the first block's unknowns (columns) to a displacement of the tow point (rows)
            (3, 4), from the last Newton matrix.
    """

    force: np.ndarray = np.zeros(3)
    past: np.ndarray = np.zeros((2, 3))
    largest: float = 0.0
    by_tow: np.ndarray = np.zeros((3, 3))
    by_block: np.ndarray = np.zeros((3, 4))
    answer: np.ndarray = np.zeros((3, 4))


class Ends(Record):
    """The fields of a cable that exist once: its growing end at the drum, its tow point, its division and its solver.

    Attributes:
        count: number of segments.
        settled: length of all segments but the last. [m]
        last_length: length of the last, growing segment (3 levels,). [m]
        payout: rate at which cable enters the water (3 levels,). [m/s]
        loose: length of the cable that a drum has thrown out ahead of what the water takes (3 levels,). [m]
        ahead: how much faster the drum gives cable than the water takes it (3 levels,). [m/s]
        since_loose: steps since cable was last loose; no more are counted than `KNOWN_STEPS`.
        drum_mode: the state of the drum (`cable.drum`).
        drum_pull: tension at the drum at level NEW. [N]
        drum_force: the cable's pull on it, with the load of the last half segment (3,). [N]
        drum_velocity: of the drum at level NEW (3,). [m/s]
        origin: place that positions are counted from, in the axes of the sea bed (3,). [m]
        time: of level NOW. [s]
        previous_step: t_now − t_before, 0 after a start. [s]
        layout: how the cable is divided, and the kind of its far end.
        tow: the force on the vehicle.
        solver: how a step is solved.
        solved: how the last step that was tried was solved.
    """

    count: int = 0
    settled: float = 0.0
    last_length: np.ndarray = np.zeros(3)
    payout: np.ndarray = np.zeros(3)
    loose: np.ndarray = np.zeros(3)
    ahead: np.ndarray = np.zeros(3)
    since_loose: int = KNOWN_STEPS  # no cable was loose yet, so rates are of second order from the start
    drum_mode: int = TURNING
    drum_pull: float = 0.0
    drum_force: np.ndarray = np.zeros(3)
    drum_velocity: np.ndarray = np.zeros(3)
    origin: np.ndarray = np.zeros(3)
    time: float = 0.0
    previous_step: float = 0.0
    layout: Layout = Layout()
    tow: Tow = Tow()
    solver: Solver = Solver()
    solved: Solved = Solved()


class Line(NamedTuple):
    """The state of a cable; segment j lies between nodes j−1 and j, so index 0 of segment arrays is unused.

    Attributes:
        ends: the fields that exist once.
        position: node positions (3 levels, nodes, 3). [m]
        velocity: velocities of the material at the nodes (3 levels, nodes, 3). [m/s]
        momentum: momentum ∫p ds of the segments (3 levels, nodes, 3). [kg m/s]
        tension: tension of the segments (3 levels, nodes). [N]
        length: unstretched lengths of the segments (nodes,); of the last one, see `Ends.last_length`. [m]
        node_tension: tension at the nodes at level NOW (nodes,). [N]
        water: velocity of the water at the nodes (3 levels, nodes, 3). [m/s]
        friction: of the sea bed on the nodes, as a share s of its pressure, at levels NEW and NOW (2, nodes, 3). [-]
        forcing: a further force per length on segment j at level NEW (nodes, 3), for made-up solutions. [N/m]
        slip, normal_gain: corrections for the arc that a segment stands for (nodes,), see `chord_correction`. [m/s, 1]
        load: ∫(∂p/∂t + D − w_c k) ds of the segments at level NEW (nodes, 3). [N]
        blocks: of the Newton matrix (5, nodes, 4, 4): `LOWER`, `DIAGONAL`, `UPPER`, and for a cable with bending
            stiffness `LOWER2` and `UPPER2`, see `block_solver`.
        pivots: of the factored blocks (nodes, 4).
        rows: residual, guess and Newton step of the unknowns (3, nodes, 4).
    """

    ends: Ends
    position: np.ndarray
    velocity: np.ndarray
    momentum: np.ndarray
    tension: np.ndarray
    length: np.ndarray
    node_tension: np.ndarray
    water: np.ndarray
    friction: np.ndarray
    forcing: np.ndarray
    slip: np.ndarray
    normal_gain: np.ndarray
    load: np.ndarray
    blocks: np.ndarray
    pivots: np.ndarray
    rows: np.ndarray


RESIDUAL, GUESS, STEP = range(3)
"""Rows of `Line.rows`."""
LOWER, DIAGONAL, UPPER, LOWER2, UPPER2 = range(5)
"""Rows of `Line.blocks`."""


def new_line(capacity: int) -> Line:
    """Return an empty line with space for `capacity` segments."""
    # A line of n segments has n + 1 nodes.
    return Line(ends=_new_ends(), **_per_node(capacity + 1))


_new_ends = made_once(Ends)


def _per_node(n: int) -> dict[str, Any]:
    """Return the arrays of an empty line over n nodes, by name."""
    vectors = {name: np.zeros((3, n, 3)) for name in ("position", "velocity", "momentum", "water")}
    return vectors | {
        "tension": np.zeros((3, n)),
        "length": np.zeros(n),
        "node_tension": np.zeros(n),
        "friction": np.zeros((2, n, 3)),
        "forcing": np.zeros((n, 3)),
        "slip": np.zeros(n),
        # A gain of 1 is no correction.
        "normal_gain": np.ones(n),
        "load": np.zeros((n, 3)),
        # The outer two of the five diagonals are used by a cable with bending stiffness only.
        "blocks": np.zeros((5, n, 4, 4)),
        "pivots": np.zeros((n, 4), np.int64),
        "rows": np.zeros((3, n, 4)),
    }


def enlarged(line: Line, capacity: int) -> Line:
    """Return the same line with space for `capacity` segments."""
    larger = _per_node(capacity + 1)
    # Nodes keep their numbers: old arrays fill the beginning of the new ones.
    for name, new in larger.items():
        old = getattr(line, name)
        new[tuple(slice(0, size) for size in old.shape)] = old
    return line._replace(**larger)


@inlined
def in_water(line: Line) -> float:
    """Return the length of the cable in the water at level NOW. [m]."""
    return line.ends.settled + line.ends.last_length[NOW]


@inlined
def paid_out(line: Line) -> float:
    """Return the length that has left the drum by level NOW, with the loose cable in front of it. [m]."""
    return in_water(line) + line.ends.loose[NOW]


@inlined
def held_node(line: Line) -> int:
    """Return the index of the node that the drum holds; with a free end, one beyond the last."""
    return line.ends.count + 1 if line.ends.layout.free_end else line.ends.count


@inner
def spacing(line: Line) -> float:
    """Return how long a segment that starts at the end of the full ones, s from the tow point, has to be. [m].

    Δs + g s; and, within the first metres L₀ (`run_in`), Δs (√(s/L₀) + Δs/4L₀) + g s: then, without grading, node j is
    at s = (jΔs)²/4L₀. So a cable that begins with no length soon has as many segments as it needs.
    """
    layout, settled = line.ends.layout, line.ends.settled
    share = 1.0
    if layout.run_in > 0.0:
        # Shorter near the tow point, where a cable of no length begins.
        share = min(1.0, np.sqrt(settled / layout.run_in) + 0.25 * layout.segment_length / layout.run_in)
    return share * layout.segment_length + layout.grading * settled


@inner
def sample_water(line: Line, water: Water, time: float) -> None:
    """Fill the water's velocity at the nodes of level NEW."""
    x, J, uniform = line.position[NEW], line.water[NEW], water.velocity
    # A uniform current does not depend on places.
    if uniform.shape[0] == 1:
        for j in range(line.ends.count + 1):
            for i in range(3):
                J[j, i] = uniform[0, i]
        return
    # Places on level NEW: the water is sampled for the predicted shape.
    for j in range(line.ends.count + 1):
        J[j, 0], J[j, 1], J[j, 2] = water_velocity(water, x[j, 0], x[j, 1], x[j, 2], time)


@inlined
def length_at(line: Line, level: int, j: int) -> float:
    """Return the length of segment j at a level of time: only the one at the drum grows. [m]."""
    return line.ends.last_length[level] if j == line.ends.count else line.length[j]


@compiled
def find_section(line: Line, c: SectionedCableNumbers, j: int) -> None:
    """Make c describe the section that segment j is in: the one that holds its middle."""
    if j != c.section_segment + 1:  # no loop along the cable: count from the tow point
        c.section_along = 0.0
        for before in range(1, j):
            c.section_along += length_at(line, NOW, before)
    k, middle = 0, c.section_along + 0.5 * length_at(line, NOW, j)
    while middle > c.section_end[k]:
        k += 1
    c.section_along, c.section_segment = c.section_along + length_at(line, NOW, j), j
    if k == c.section_now:
        return
    row, c.section_now = c.section[k], k
    c.mass, c.added_mass, c.weight, c.compliance = row[0], row[1], row[2], row[3]
    c.retardation, c.tangential_drag, c.normal_drag = row[4], row[5], row[6]
    c.bed_stiffness, c.bed_damping, c.mass_along = row[7], row[8], row[9]


@inner
def no_change(line: Line, c: CableNumbers) -> None:
    """Do nothing, for a cable that lacks a field; so do the two that follow, and the fourth has no energy."""


@inner
def no_change_at(line: Line, c: CableNumbers, j: int) -> None:
    """Do nothing."""


@inner
def no_change_in_step(line: Line, c: CableNumbers, w: Any, slopes: bool) -> None:
    """Do nothing."""


@inner
def no_energy(line: Line, c: CableNumbers) -> float:
    """Return none. [J], [W]"""
    return 0.0


_select_row = by_field_at("section_end", find_section, no_change_at)


@inner
def _find_whole_section(line: Line, c: Any, j: int) -> None:
    """Fill the numbers of a segment in water, which its section has."""
    find_section(line, c, j)
    row = c.section[c.section_now]
    c.whole[0], c.whole[1], c.whole[2] = row[0] - row[9], row[1], row[9]
    c.whole[3], c.whole[4], c.whole[5], c.whole[6] = row[5], row[6], row[10], row[11]


find_whole = by_field_at("section_end", _find_whole_section, no_change_at)
"""Fill `FloatingCableNumbers.whole` for a segment."""


@inlined
def depth_in_radii(line: Line, c: FloatingCableNumbers, level: int, j: int) -> float:
    """Return how deep node j is below the surface at a level, in radii of the cable. [-]"""
    depth = line.position[level, j, 2] + line.ends.origin[2] - c.surface_level
    return depth / (c.softness * 0.5 * c.whole[6])


@inlined
def _wet(line: Line, c: FloatingCableNumbers, level: int, j: int) -> None:
    """Make c describe segment j with the water of its wetted share at a level."""
    find_whole(line, c, j)
    near, far, _, _, _ = dry_segment(depth_in_radii(line, c, level, j - 1), depth_in_radii(line, c, level, j))
    share, whole = 1.0 - near - far, c.whole
    c.mass, c.added_mass, c.mass_along = whole[0] + share * whole[2], share * whole[1], share * whole[2]
    c.tangential_drag, c.normal_drag = share * whole[3], share * whole[4]


@inner
def _wet_now(line: Line, c: FloatingCableNumbers, j: int) -> None:
    """Select a segment with its wetted share at level NOW."""
    _wet(line, c, NOW, j)


@inner
def _wet_new(line: Line, c: FloatingCableNumbers, j: int) -> None:
    """Select a segment with its wetted share at level NEW."""
    _wet(line, c, NEW, j)


@inner
def _all_wet(line: Line, c: CableNumbers, j: int) -> None:
    """Select the section of a segment."""
    _select_row(line, c, j)


select_section = by_field_at("surface_level", _wet_now, _all_wet)
"""Make the numbers of a cable describe the section of a segment, and its wetted share at level NOW; a uniform cable in
water everywhere compiles nothing of it."""
wet_at_new = by_field_at("surface_level", _wet_new, no_change_at)
"""Do the same for the wetted share at level NEW."""
