"""The Newton system of the lumped cable against central differences of its residual, and its band solver against numpy.

Verifies: every entry of the banded matrix of `cable.lumped.newton.assemble_stage`, the elimination of the springs' own
unknowns included, in random bent states with taut and slack springs, for each thing the far end can be: a free drum
that turns, one that stands, one that overruns, a winch that keeps a tension, one that keeps a length, a tail with a
drogue. Configuration: five springs; a heavy stretching cable with bending stiffness, a slanting uniform current, a
moving drum with inertia and friction.
Tolerance: differences of step 1e-6 carry 1e-9 of truncation and rounding; 2e-6 of the largest entry of a row.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from cable import CableProperties, DrumProperties
from cable.current import Current
from cable.lumped.band_solver import REACH, WIDTH, solve_band
from cable.lumped.rope import (
    NEW,
    REST,
    START_MOMENTUM,
    START_POSITION,
    START_STRETCHED,
    STATE,
    new_rope,
    unknowns,
)
from cable.lumped.springs import observe, spring_law
from cable.lumped.step import assemble_stage
from cable.winch import ConstantTension, PayOutRate

CABLE = CableProperties(mass_per_length=0.02, compliance=0.05, tangential_drag_coefficient=0.02)
CURRENT = Current.uniform([0.2, -0.1, 0.05]).numbers()
FREE = DrumProperties(inertia=1e-3, friction_torque=0.01)
N, G, STEP = 5, 0.03, 1e-6
ENDS = ("turns", "stands", "overruns", "keeps a tension", "keeps a length", "tail")


def bent_rope(end, seed):
    """Return a shaken cable of half-metre springs in the middle of a stage, and the drum's numbers."""
    rng = np.random.default_rng(seed)
    rope = new_rope(N)
    rope.ends.count, rope.ends.free_end = N, end == "tail"
    rope.ends.compliance = rope.ends.stretch = CABLE.compliance
    rope.ends.bending, rope.ends.tail_drag = 0.01, 5.0
    along = np.outer(np.arange(N, -1, -1), [0.5, 0.0, 0.0])
    rope.vector[START_POSITION, : N + 1] = along + 0.05 * rng.normal(size=(N + 1, 3))
    rope.position[NEW, 0] = rope.vector[START_POSITION, 0]
    rope.velocity[NEW, : N + 1] = [1.0, 0.0, 0.0] + 0.2 * rng.normal(size=(N + 1, 3))
    rope.vector[START_MOMENTUM, : N + 1] = 0.01 * rng.normal(size=(N + 1, 3))
    rope.ends.drum_velocity[:] = 0.1, 0.3, -0.2
    rope.spring[REST, 1 : N + 1] = 0.5
    rope.ends.by_payout = 0.0 if end in ("keeps a length", "tail") else G
    rope.ends.start_last, rope.ends.payout[NEW], rope.ends.start_payout = 0.47, 1.1, 0.9
    rope.ends.wanted = 0.5 * N + 0.02 if end == "keeps a length" else 0.3
    if end in ("stands", "overruns"):
        rope.ends.payout[NEW], rope.ends.start_payout = (0.1, 5.0) if end == "overruns" else (0.0, -5.0)
    observe(rope, G)
    rope.spring[START_STRETCHED, 1 : N + 1] = 0.5 + rng.uniform(-0.02, 0.02, N)
    winches = {"keeps a tension": ConstantTension(tension=0.3), "keeps a length": PayOutRate(rate=1.0)}
    return rope, winches.get(end, FREE).numbers()


def residual(rope, drum, values):
    """Return the residual at other velocities and pay-out rate, with ξ of every spring as its length asks for it."""
    held = unknowns(rope)
    rope.velocity[NEW, 1 : held + 1] = values[: 3 * held].reshape(held, 3)
    if values.size > 3 * held:
        rope.ends.payout[NEW] = values[-1]
    observe(rope, G)
    for j in range(1, N + 1):
        strain = rope.stretched[NEW, j] / rope.spring[REST, j] - 1.0
        rope.spring[STATE, j] = brentq(
            lambda xi, strain=strain: spring_law(xi, CABLE.compliance)[2] - strain, -5.0, 20.0, xtol=1e-15
        )
    assemble_stage(rope, G, 0.0, CABLE.numbers(), drum, CURRENT)
    return rope.right[: values.size].copy()


def dense(band, size):
    """Return the band as a full matrix."""
    matrix = np.zeros((size, size))
    for i in range(size):
        for j in range(max(0, i - REACH), min(size, i + REACH + 1)):
            matrix[i, j] = band[i, j - i + REACH]
    return matrix


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("seed", [0, 1])
def test_the_newton_matrix_is_the_derivative_of_the_residual(end, seed):
    rope, drum = bent_rope(end, seed)
    values = rope.velocity[NEW, 1 : unknowns(rope) + 1].flatten()
    if end not in ("tail", "keeps a length"):
        values = np.append(values, rope.ends.payout[NEW])
    residual(rope, drum, values)
    analytic = dense(rope.band, values.size)
    taut = rope.spring[STATE, 1 : N + 1] > 0.0
    assert taut.any()
    numeric = np.empty_like(analytic)
    for k in range(values.size):
        change = np.zeros(values.size)
        change[k] = STEP
        above, below = (residual(rope, drum, values + sign * change) for sign in (1.0, -1.0))
        numeric[:, k] = (above - below) / (2.0 * STEP)
    scale = np.abs(numeric).max(axis=1, keepdims=True)
    assert_allclose(analytic / scale, numeric / scale, atol=2e-6)


def test_a_banded_system_is_solved_as_a_full_one_even_where_rows_must_be_exchanged():
    rng = np.random.default_rng(3)
    size = 40
    band = np.zeros((size, WIDTH))
    band[:, : 2 * REACH + 1] = rng.normal(size=(size, 2 * REACH + 1))
    band[::3, REACH] = 0.0  # no pivot on the diagonal
    for i in range(size):
        for j in range(i - REACH, i + REACH + 1):
            if not 0 <= j < size:
                band[i, j - i + REACH] = 0.0
    full, right = dense(band, size), rng.normal(size=size)
    expected = np.linalg.solve(full, right)
    assert solve_band(band, right, size)
    assert_allclose(right, expected, rtol=1e-9, atol=1e-12)


def test_a_singular_system_is_told():
    assert not solve_band(np.zeros((4, WIDTH)), np.ones(4), 4)
