"""Nodes come and go at the drum.

A last spring that has grown beyond `SPLIT_AT` segments gets a node, about a segment from its start; one that has shrunk
below `MERGE_AT` loses it. Tensions and velocities pass on. Where the drum is free to give cable, the new node lies on
the parabola through the last three nodes, and the drum gives the little by which two chords are longer than one (and
takes it back with the node). Where a winch prescribes the length (or the cable is slack or sharply bent) it lies on
the chord; when it is taken out again the chord is shorter than the cable, which evens out within `rope.FADING`.
"""

from __future__ import annotations

import numpy as np

from cable.lumped.balance import first_tangent, load_node, neighbours
from cable.lumped.rope import (
    DIRECTION,
    FADING,
    MOMENTUM_RATE,
    NEW,
    OLD,
    PULL,
    REST,
    SIZE,
    STATE,
    STRETCHED_RATE,
    WATER,
    Rope,
)
from cable.lumped.springs import spring_law, spring_state
from cable.properties import CableNumbers
from subzero.jit import allocating, compiled, inner

SPLIT_AT = 1.5
MERGE_AT = 0.5
"""Lengths of the last spring, in segments."""
STRAIGHT = 0.8
"""The parabola is used while chords over lengths, and the cosine between them, are above this."""
FAINT = 1e-11
"""A new spring, and one at the start, pulls at least this much. [N]"""


@compiled
def mind_the_drum(rope: Rope, segment_length: float, c: CableNumbers) -> None:
    """Insert or remove nodes until the last spring has a proper length; levels OLD and NEW hold the present."""
    if rope.ends.free_end:
        return
    changed = False
    while rope.ends.last[OLD] > SPLIT_AT * segment_length and rope.ends.count < rope.spring.shape[1] - 2:
        _insert(rope, segment_length)
        changed = True
    while rope.ends.last[OLD] < MERGE_AT * segment_length and rope.ends.count > 1:
        _remove(rope)
        changed = True
    if changed:
        fill_momenta(rope, c)


@allocating
def _insert(rope: Rope, segment_length: float) -> None:
    """Insert a node into the last spring, a segment from its start."""
    N, whole, xi = rope.ends.count, rope.ends.last[OLD], rope.spring[STATE, rope.ends.count]
    T, slope = rope.spring[PULL, N], 0.0
    if xi > 0.0:
        slope = (max(rope.ends.drum_pull, 0.0) - T) / (0.5 * whole)
    w = _weights(rope, segment_length)
    for i in range(3):
        _insert_between(rope.position[OLD], N, i, w)
        leaving = rope.velocity[OLD, N, i] - rope.ends.payout[OLD] * rope.vector[DIRECTION, N, i]
        here = w[1] * rope.velocity[OLD, N - 1, i] + w[2] * leaving
        here += w[0] * rope.velocity[OLD, N - 2, i] if N > 1 else 0.0
        rope.velocity[OLD, N + 1, i], rope.velocity[OLD, N, i] = rope.velocity[OLD, N, i], here
        rope.vector[WATER, N + 1, i] = rope.vector[WATER, N, i]
        rope.vector[WATER, N, i] += (1.0 - segment_length / whole) * (
            rope.vector[WATER, N - 1, i] - rope.vector[WATER, N, i]
        )
        crossing = 0.5 * rope.ends.payout[OLD] * rope.middle.momentum[i]
        before = 0.5 * (rope.spring[REST, N - 1] + whole) if N > 1 else 0.5 * whole
        rate = (rope.vector[MOMENTUM_RATE, N - 1, i] - crossing) / before
        rest = 0.5 * (whole - segment_length)
        rope.vector[MOMENTUM_RATE, N + 1, i] = (
            crossing + (rope.vector[MOMENTUM_RATE, N, i] - crossing) * 2.0 * rest / whole
        )
        rope.vector[MOMENTUM_RATE, N, i] = crossing + rate * 0.5 * whole
        rope.vector[MOMENTUM_RATE, N - 1, i] = rate * (before - rest)
    chord = max(rope.spring[SIZE, N], 1e-30)
    if rope.spring[STATE, N] > 0.0 and w[0] != 0.0:
        rope.spring[REST, N], rope.spring[REST, N + 1] = (
            whole * _chord(rope, N) / chord,
            whole * _chord(rope, N + 1) / chord,
        )
    else:
        rope.spring[REST, N], rope.spring[REST, N + 1] = segment_length, whole - segment_length
    rope.spring[STATE, N + 1] = xi
    if xi > 0.0:
        rope.spring[STATE, N] = spring_state(max(T + slope * 0.5 * (segment_length - whole), FAINT))
        rope.spring[STATE, N + 1] = spring_state(max(T + slope * 0.5 * segment_length, FAINT))
    rope.ends.count = N + 1
    rope.ends.last[OLD] = rope.spring[REST, N + 1]
    for j in range(N, N + 2):
        settle(rope, j)


@allocating
def _weights(rope: Rope, segment_length: float) -> np.ndarray:
    """Return how nodes N − 2, N − 1 and N share in the new node (3,)."""
    N, far = rope.ends.count, rope.ends.last[OLD]
    w = np.zeros(3)
    w[1], w[2] = 1.0 - segment_length / far, segment_length / far
    if N == 1 or rope.ends.by_payout == 0.0:
        return w
    near, dot, a, b, x = rope.spring[REST, N - 1], 0.0, 0.0, 0.0, rope.position[OLD]
    for i in range(3):
        e, f = (x[N - 1, i] - x[N - 2, i]) / near, (x[N, i] - x[N - 1, i]) / far
        dot, a, b = dot + e * f, a + e * e, b + f * f
    if min(a, b) > STRAIGHT * STRAIGHT and dot > STRAIGHT * np.sqrt(a * b):
        s = segment_length
        w[0] = s * (s - far) / (near * (near + far))
        w[1] = (s + near) * (far - s) / (near * far)
        w[2] = (s + near) * s / ((near + far) * far)
    return w


@inner
def _insert_between(x: np.ndarray, N: int, i: int, w: np.ndarray) -> None:
    """Move row N of x (nodes, 3) one down, and put a weighted mean of the rows around in its place."""
    here = w[1] * x[N - 1, i] + w[2] * x[N, i]
    if N > 1:
        here += w[0] * x[N - 2, i]
    x[N + 1, i], x[N, i] = x[N, i], here


@compiled
def _remove(rope: Rope) -> None:
    """Take the node before the drum out: the last two springs become one."""
    N, near, far = rope.ends.count, rope.spring[REST, rope.ends.count - 1], rope.ends.last[OLD]
    whole = near + far
    slack = min(rope.spring[STATE, N - 1], rope.spring[STATE, N]) <= 0.0
    mean = (near * rope.spring[PULL, N - 1] + far * rope.spring[PULL, N]) / whole
    rope.spring[STATE, N - 1] = (
        min(rope.spring[STATE, N - 1], rope.spring[STATE, N]) if slack else spring_state(max(mean, FAINT))
    )
    for i in range(3):
        rope.position[OLD, N - 1, i] = rope.position[OLD, N, i]
        rope.velocity[OLD, N - 1, i] = rope.velocity[OLD, N, i]
        crossing = 0.5 * rope.ends.payout[OLD] * rope.middle.momentum[i]
        rope.vector[MOMENTUM_RATE, N - 1, i] = (
            crossing + (rope.vector[MOMENTUM_RATE, N, i] - crossing) * whole / far
        )
        if N > 2:
            width = 0.5 * (rope.spring[REST, N - 2] + near)
            rope.vector[MOMENTUM_RATE, N - 2, i] *= 1.0 + 0.5 * far / width
            rope.vector[MOMENTUM_RATE, N - 2, i] += crossing
        rope.vector[WATER, N - 1, i] = rope.vector[WATER, N, i]
    rope.spring[REST, N - 1] = whole
    if not slack and rope.ends.by_payout > 0.0:
        rope.spring[REST, N - 1] *= _chord(rope, N - 1) / (rope.spring[SIZE, N - 1] + rope.spring[SIZE, N])
    rope.ends.count = N - 1
    rope.ends.last[OLD] = rope.spring[REST, N - 1]
    settle(rope, N - 1)


@inner
def _chord(rope: Rope, j: int) -> float:
    """Return the distance of the ends of spring j at level OLD. [m]."""
    square = 0.0
    for i in range(3):
        square += (rope.position[OLD, j, i] - rope.position[OLD, j - 1, i]) ** 2
    return np.sqrt(square)


@inner
def settle(rope: Rope, j: int) -> None:
    """Give spring j the length that its ξ asks for, and the rate at which its nodes lengthen it, at level OLD."""
    T, _, strain, _ = spring_law(rope.spring[STATE, j], rope.ends.compliance)
    rope.spring[PULL, j], rope.spring[SIZE, j] = T, _chord(rope, j)
    rope.stretched[OLD, j] = rope.spring[REST, j] * (1.0 + strain)
    x, V, size, rate = rope.position[OLD], rope.velocity[OLD], max(_chord(rope, j), 1e-15), 0.0
    for i in range(3):
        rate += (x[j, i] - x[j - 1, i]) * (V[j, i] - V[j - 1, i])
    rope.spring[STRETCHED_RATE, j] = rate / size + (size - rope.stretched[OLD, j]) / FADING
    for i in range(3):
        rope.vector[DIRECTION, j, i] = (x[j, i] - x[j - 1, i]) / size


@allocating
def fill_momenta(rope: Rope, c: CableNumbers) -> None:
    """Fill the momenta of all lumps at level OLD from positions and velocities there; J is where it was."""
    N, s = rope.ends.count, np.zeros(3)
    for j in range(N + 1):
        for i in range(3):
            rope.position[NEW, j, i] = rope.position[OLD, j, i]
            rope.velocity[NEW, j, i] = rope.velocity[OLD, j, i]
    for j in range(N + 1):
        if j == 0:
            first_tangent(rope, s)
            width = 0.5 * rope.spring[REST, 1]
        else:
            _, _, width = neighbours(rope, j, s)
        if j == N and not rope.ends.free_end:
            for i in range(3):
                s[i] = rope.vector[DIRECTION, N, i]
                rope.velocity[NEW, N, i] -= rope.ends.payout[OLD] * s[i]
        load_node(rope, j, s, 0.0, c)
        for i in range(3):
            rope.momentum[OLD, j, i] = width * rope.node.momentum[i]
