"""The lumped cable as arrays: nodes with half of the mass of the two adjacent segments, springs between them.

Nodes run from the tow point (0) to the drum (count). Nodes 1 … count−1 are material points that move freely; node count
is where the cable leaves the drum, or a free tail. Spring j joins nodes j−1 and j; the last one gets longer and shorter
while cable is paid out and reeled in. Positions are relative to where the drum is at the start, earth axes.

Every spring has its length L_j as a state of its own, dL_j/dt = t_j·(V_j − V_{j−1}) + (|x_j − x_{j−1}| − L_j)/τ: the
springs so bind velocities, which a Runge-Kutta method takes with its full order where it loses one when they bind
positions. The last term lets what they drift apart (third order in a step) fade within τ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.lumped.band_solver import WIDTH
from cable.lumped.load import NodeLoad
from subzero.jit import Record, compiled

NEW, OLD, MIDDLE = 0, 1, 2
"""Levels: being solved for, start of the step, end of its first stage."""
STATE, REST, SIZE, PULL, GAIN, GAP, SLOPE, START_STRETCHED, STRETCHED_RATE = range(9)
"""Numbers of a spring: ξ [N], unstretched length ℓ [m], |d| [m], T [N], dT/dL [N/m], L − ℓ(1+ε) [m], ℓ dε/dξ [m/N],
what the stage builds on for L [m], dL/dt at level OLD [m/s]."""
MOMENTUM_RATE, START_POSITION, START_MOMENTUM, WATER, THINNING, DIRECTION, ANSWER = range(7)
"""Vectors of a node: dp/dt of the lump at level OLD [N], what the stage builds on for position [m] and momentum
[kg m/s], J [m/s], ∂R/∂T of its balance by the tensions of the adjacent springs through √(1+eT); of a spring: t and
∂L/∂(V_j − V_{j−1}) [s]."""
FADING = 0.5
"""τ. [s]"""
SMOOTH_STEPS = 3
"""A drum that has caught up with its cable turns smoothly, and is advanced to second order, after so many steps."""


class RopeEnds(Record):
    """The fields of a lumped cable that exist once.

    Attributes:
        count: number of springs.
        free_end: the far end is a tail instead of the drum.
        compliance: e of the springs. [1/N]
        stretch: e of the cable, for √(1+eT) in the drag. [1/N]
        bending: EI. [N m²]
        tail_drag: ½ρC_dA of a drogue. [kg/m]
        last: unstretched length of the last spring (3 levels,). [m]
        payout: rate at which cable enters the water (3 levels,). [m/s]
        loose: length of the cable that a drum has thrown out ahead of that (3 levels,). [m]
        spin: rate at which the drum gives cable (3 levels,). [m/s]
        since_loose: steps since cable was last loose; no more are counted than `SMOOTH_STEPS`.
        stage_end: time of a stage from the start of the step. [s]
        payout_rate: d²S/dt² at level OLD. [m/s²]
        start_last, start_payout: values that the stage builds on. [m], [m/s]
        drum_place, drum_velocity: of the drum at level NEW (3,). [m], [m/s]
        drum_pull: T(S). [N]
        tow_force: on the vehicle, earth axes (3,). [N]
        by_payout: ∂ℓ/∂U of the last spring; 0 where its length is prescribed. [s]
        wanted: setpoint of a winch: length [m] or tension [N].
    """

    count: int = 1
    free_end: bool = False
    compliance: float = 0.0
    stretch: float = 0.0
    bending: float = 0.0
    tail_drag: float = 0.0
    last: np.ndarray = np.zeros(3)
    payout: np.ndarray = np.zeros(3)
    loose: np.ndarray = np.zeros(3)
    spin: np.ndarray = np.zeros(3)
    since_loose: int = SMOOTH_STEPS
    stage_end: float = 0.0
    payout_rate: float = 0.0
    start_last: float = 0.0
    start_payout: float = 0.0
    drum_place: np.ndarray = np.zeros(3)
    drum_velocity: np.ndarray = np.zeros(3)
    drum_pull: float = 0.0
    tow_force: np.ndarray = np.zeros(3)
    by_payout: float = 0.0
    wanted: float = 0.0


class Rope(NamedTuple):
    """The state of a lumped cable and the work space to advance it; entry 0 of arrays over springs is unused.

    Attributes:
        ends: the fields that exist once.
        position, velocity, momentum: of the nodes (3 levels, nodes, 3); momentum is that of the lump. [m, m/s, kg m/s]
        stretched: L (3 levels, nodes). [m]
        spring: numbers of the springs (rows as named above, nodes).
        vector: vectors of nodes and springs (rows as named above, nodes, 3).
        node, middle, drum: loads of a node, of the middle of the last spring, and of its end.
        band, right: the Newton system, `band_solver`.
    """

    ends: RopeEnds
    position: np.ndarray
    velocity: np.ndarray
    momentum: np.ndarray
    stretched: np.ndarray
    spring: np.ndarray
    vector: np.ndarray
    node: NodeLoad
    middle: NodeLoad
    drum: NodeLoad
    band: np.ndarray
    right: np.ndarray


def new_rope(capacity: int) -> Rope:
    """Return an empty rope with space for `capacity` springs."""
    n = capacity + 2
    return Rope(
        ends=RopeEnds(),
        position=np.zeros((3, n, 3)),
        velocity=np.zeros((3, n, 3)),
        momentum=np.zeros((3, n, 3)),
        stretched=np.zeros((3, n)),
        spring=np.zeros((9, n)),
        vector=np.zeros((7, n, 3)),
        node=NodeLoad(),
        middle=NodeLoad(),
        drum=NodeLoad(),
        band=np.zeros((3 * n, WIDTH)),
        right=np.zeros(3 * n),
    )


@compiled
def unknowns(rope: Rope) -> int:
    """Return the number of nodes that are solved for."""
    return rope.ends.count if rope.ends.free_end else rope.ends.count - 1
