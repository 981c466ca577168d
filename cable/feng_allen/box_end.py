"""A cable whose last node is the moving end on the drum: how it starts, grows and shrinks.

Nodes 0 … N−1 are material points, node N is the end s = S(t). When the last box has grown beyond 1.5
segments, a material node is left one segment into it; when it has shrunk below 0.4, its first node is taken
out. The end itself is never touched, so tension and velocity at the drum do not jump.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.feng_allen.box_newton import BoxWorkspace, box_workspace
from cable.feng_allen.printed_scheme import start_paper
from subzero.jit import compiled

SPLIT, MERGE = 1.5, 0.4
"""Lengths of the last box, in segments, beyond which a node is inserted or removed."""


class MovingEnd(NamedTuple):
    """A cable with a moving end: the boxes, the rates of change of its nodes, and where a step began."""

    boxes: BoxWorkspace
    rate: np.ndarray
    """ẏ at the nodes; of the last node, along its own path (nodes, 6) [1/s]."""
    old: np.ndarray
    """y at the beginning of a step."""


def moving_end(capacity: int) -> MovingEnd:
    """Return a cable of no length with room for `capacity` nodes; `start_moving_end` gives it a direction."""
    return MovingEnd(box_workspace(capacity), np.zeros((capacity, 6)), np.zeros((capacity, 6)))


@compiled
def start_moving_end(b: MovingEnd, north: float, east: float, down: float, friction: float) -> None:
    """Lay a cable of no length against the motion of the tow point; its two nodes are the same place."""
    start_paper(b.boxes, north, east, down, friction)
    b.boxes.count[0] = 2
    b.boxes.length[1] = 0.0
    for i in range(6):
        b.boxes.y[1, i] = b.boxes.y[0, i]
        b.rate[0, i] = 0.0
        b.rate[1, i] = 0.0


@compiled
def fit_nodes(b: MovingEnd, segment_length: float) -> bool:
    """Insert or remove nodes until the last box has a fair length; False when there is no room."""
    w = b.boxes
    while w.length[w.count[0] - 1] > SPLIT * segment_length:
        if w.count[0] == len(w.y):
            return False
        insert_node(b, segment_length)
    while w.count[0] > 2 and w.length[w.count[0] - 1] < MERGE * segment_length:
        remove_node(b)
    return True


@compiled
def insert_node(b: MovingEnd, segment_length: float) -> None:
    """Put a material node Δs into the last box, by linear interpolation; the end stays as it is.

    The new node does not move with the end: its rate is interpolated from that of the material at the end,
    ẏ + Vt ∂y/∂s.
    """
    w, n = b.boxes, b.boxes.count[0]
    length, speed = w.length[n - 1], w.y[n - 1, 1]
    part = segment_length / length
    for i in range(6):
        left, end = w.y[n - 2, i], w.y[n - 1, i]
        material = b.rate[n - 1, i] + speed * (end - left) / length
        w.y[n, i], b.rate[n, i] = end, b.rate[n - 1, i]
        w.y[n - 1, i] = left + part * (end - left)
        b.rate[n - 1, i] = b.rate[n - 2, i] + part * (material - b.rate[n - 2, i])
    w.length[n - 1], w.length[n] = segment_length, length - segment_length
    w.count[0] = n + 1


@compiled
def remove_node(b: MovingEnd) -> None:
    """Take the last material node out; the last two boxes become one, the end stays as it is."""
    w, n = b.boxes, b.boxes.count[0]
    for i in range(6):
        w.y[n - 2, i], b.rate[n - 2, i] = w.y[n - 1, i], b.rate[n - 1, i]
    w.length[n - 2] += w.length[n - 1]
    w.count[0] = n - 1


def with_room(b: MovingEnd, step: float, segment_length: float) -> MovingEnd:
    """Return the cable with room for twice what the next step can add."""
    used = int(b.boxes.count[0])
    wanted = used + 8 + int(4.0 * abs(b.boxes.y[used - 1, 1]) * step / segment_length)
    if wanted <= len(b.boxes.y):
        return b
    larger = moving_end(2 * wanted)
    larger.boxes.y[:used], larger.rate[:used] = b.boxes.y[:used], b.rate[:used]
    larger.boxes.length[:used], larger.boxes.count[0] = b.boxes.length[:used], used
    return larger
