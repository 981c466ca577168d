"""The cable in the water as arrays: nodes from the tow point (0) to the drum (count), at three levels of time.

Nodes 0 … count−1 are material points; the last node sits at the drum, and the last segment grows while cable is
paid out (a moving end). Positions are relative to the drum, in earth axes (north, east, down).

Levels: `NEW` is being solved for, `NOW` is the last accepted time, `BEFORE` the one before. A step is tried on level
NEW as often as needed and becomes real only by `accept`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cable.current import Water, water_velocity
from cable.drum import TURNING
from cable.moving_end.slack_law import SMOOTHING
from cable.schemes import TOLERANCE
from subzero.jit import inlined, inner, packed

NEW, NOW, BEFORE = 0, 1, 2

SPLIT_AT = 1.5
"""The last segment is split when it has grown to this many segment lengths."""


@dataclass(kw_only=True)
class Solved:
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


@dataclass(kw_only=True)
class Ends:
    """What a cable has once: its growing end at the drum, its tow point, and how it is solved.

    Attributes:
        count: number of segments.
        last_length: length of the last, growing segment (3 levels,). [m]
        payout: rate dS/dt at which cable enters the water (3 levels,). [m/s]
        free_end: whether the far end is a free tail instead of the drum.
        tail_drag: ½ρC_dA of a drogue there. [kg/m]
        drum_mode: what the drum does (`cable.drum`).
        drum_pull: tension at the drum at level NEW. [N]
        drum_force: the cable's pull on it, with what acts across the last half segment (3,). [N]
        previous_step: t_now − t_before, 0 after a start. [s]
        smoothing: T₀ of the slack law in force. [N]
        tolerance: how exactly a step is solved, see `time_step`. [-]
        time: of level NOW. [s]
        segment_length, grading: new segments are `segment_length` + `grading` s long, s from the tow point. [m], [-]
        far_length, far_grading: farther than this from both ends, segments are joined to longer ones, by so much per
            metre (`remeshing.join_far`); 0: none are. [m], [-]
        run_in: length L₀ beside the tow point in which segments are shorter (`spacing`), 0 for none. [m]
        settled: length of all segments but the last. [m]
        drum_velocity: of the drum at level NEW (3,). [m/s]
        tow_force: force on the vehicle at level NEW (3,). [N]
        past_force: the same at levels NOW and BEFORE (2, 3), and `largest_force`, the largest so far. [N]
        tow_by_tow, tow_by_block: derivatives of the tow force by the tow point's position (3, 3) and by the
            unknowns of the first block (3, 4).
        tow_answer: minus the answer of the first block's unknowns (columns) to a displacement of the tow point
            (rows) (3, 4), from the last Newton matrix.
        factored: whether the blocks hold the factors of that matrix.
        solved: how the last step that was tried was solved.
    """

    count: int
    free_end: bool
    tail_drag: float
    last_length: np.ndarray
    payout: np.ndarray
    drum_mode: int
    drum_pull: float
    drum_force: np.ndarray
    previous_step: float
    smoothing: float
    tolerance: float
    time: float
    segment_length: float
    grading: float
    far_length: float
    far_grading: float
    run_in: float
    settled: float
    drum_velocity: np.ndarray
    tow_force: np.ndarray
    past_force: np.ndarray
    largest_force: float
    tow_by_tow: np.ndarray
    tow_by_block: np.ndarray
    tow_answer: np.ndarray
    factored: bool
    solved: Solved


class Line(NamedTuple):
    """The state of a cable; segment j lies between nodes j−1 and j, so index 0 of segment arrays is unused.

    Attributes:
        ends: what there is once.
        position: node positions (3 levels, nodes, 3). [m]
        velocity: velocities of the material at the nodes (3 levels, nodes, 3). [m/s]
        momentum: momentum ∫p ds of the segments (3 levels, nodes, 3). [kg m/s]
        tension: tension of the segments (3 levels, nodes). [N]
        length: unstretched lengths of the segments (nodes,); of the last one, see `Ends.last_length`. [m]
        node_tension: tension at the nodes at level NOW (nodes,). [N]
        water: velocity of the water at the nodes (3 levels, nodes, 3). [m/s]
        forcing: a further force per length on segment j at level NEW (nodes, 3), for made-up solutions. [N/m]
        slip, normal_gain: corrections for the arc that a segment stands for (nodes,), see `chord_correction`. [m/s, 1]
        load: ∫(∂p/∂t + D − w_c k) ds of the segments at level NEW (nodes, 3). [N]
        blocks: of the Newton matrix (5, nodes, 4, 4): `LOWER`, `DIAGONAL`, `UPPER`, see `block_solver`; beside them
            `LOWER2` and `UPPER2` of a cable with bending stiffness, see `block_solver`.
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
    """Return an empty line with room for `capacity` segments."""
    n = capacity + 1
    ends = Ends(
        count=0,
        free_end=False,
        tail_drag=0.0,
        last_length=np.zeros(3),
        payout=np.zeros(3),
        drum_mode=TURNING,
        drum_pull=0.0,
        drum_force=np.zeros(3),
        previous_step=0.0,
        smoothing=SMOOTHING,
        tolerance=TOLERANCE,
        time=0.0,
        segment_length=1.0,
        grading=0.0,
        far_length=0.0,
        far_grading=0.0,
        run_in=0.0,
        settled=0.0,
        drum_velocity=np.zeros(3),
        tow_force=np.zeros(3),
        past_force=np.zeros((2, 3)),
        largest_force=0.0,
        tow_by_tow=np.zeros((3, 3)),
        tow_by_block=np.zeros((3, 4)),
        tow_answer=np.zeros((3, 4)),
        factored=False,
        solved=Solved(),
    )
    per_node = {name: np.zeros((3, n, 3)) for name in ("position", "velocity", "momentum", "water")}
    return Line(
        ends=packed(ends),
        **per_node,
        tension=np.zeros((3, n)),
        length=np.zeros(n),
        node_tension=np.zeros(n),
        forcing=np.zeros((n, 3)),
        slip=np.zeros(n),
        normal_gain=np.ones(n),
        load=np.zeros((n, 3)),
        blocks=np.zeros((5, n, 4, 4)),
        pivots=np.zeros((n, 4), np.int64),
        rows=np.zeros((3, n, 4)),
    )


def enlarged(line: Line, capacity: int) -> Line:
    """Return the same line with room for `capacity` segments."""
    larger = new_line(capacity)
    for old, new in zip(line[1:], larger[1:], strict=True):
        new[tuple(slice(0, size) for size in old.shape)] = old
    return larger._replace(ends=line.ends)


@inlined
def held_node(line: Line) -> int:
    """Return the index of the node that the drum holds; with a free end, one beyond the last."""
    return line.ends.count + 1 if line.ends.free_end else line.ends.count


@inner
def spacing(line: Line) -> float:
    """Return how long a segment that starts at the end of the full ones, s from the tow point, has to be. [m].

    Δs + g s; and, within the first metres L₀ (`run_in`), Δs (√(s/L₀) + Δs/4L₀) + g s: then, without grading, node j is
    at s = (jΔs)²/4L₀. So a cable that begins with no length soon has as many segments as it needs.
    """
    ends = line.ends
    share = 1.0
    if ends.run_in > 0.0:
        share = min(1.0, np.sqrt(ends.settled / ends.run_in) + 0.25 * ends.segment_length / ends.run_in)
    return share * ends.segment_length + ends.grading * ends.settled


@inner
def feel_water(line: Line, water: Water, time: float) -> None:
    """Fill the water's velocity at the nodes of level NEW."""
    x, J, uniform = line.position[NEW], line.water[NEW], water.velocity
    if uniform.shape[0] == 1:
        for j in range(line.ends.count + 1):
            for i in range(3):
                J[j, i] = uniform[0, i]
        return
    for j in range(line.ends.count + 1):
        J[j, 0], J[j, 1], J[j, 2] = water_velocity(water, x[j, 0], x[j, 1], x[j, 2], time)
