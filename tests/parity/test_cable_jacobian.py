"""The analytic Jacobian of a cable step against central differences of its residual.

Verifies: every entry of the block tridiagonal matrix of `cable.moving_end.assembly` (and that nothing lies outside the
blocks), in random bent, half slack states, for all that a drum can do; and the tow force's own derivatives.
Configuration: a heavy stretching cable, a current that differs from node to node, a moving drum with inertia and
friction, corrections for the arc and a further force switched on; with and without a bending stiffness.
Tolerance: differences of step 1e-6 carry 1e-9 of truncation and rounding; 2e-6 of the largest entry of a row.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cable import CableProperties, Clamps, DrumProperties, SeaBed
from cable.current import Current
from cable.drum import SPINNING, STANDING, TURNING
from cable.moving_end.assembly import assemble
from cable.moving_end.bdf2 import backward_weights
from cable.moving_end.block_solver import factor_wide, solve_wide
from cable.moving_end.initial_shape import lay_straight, start_in_water
from cable.moving_end.segment_load import new_load
from cable.moving_end.state import (
    BEFORE,
    DIAGONAL,
    LOWER,
    LOWER2,
    NEW,
    NOW,
    RESIDUAL,
    UPPER,
    UPPER2,
    new_line,
)
from subzero.jit import compiled

CABLE = CableProperties(mass_per_length=0.02, compliance=0.05, tangential_drag_coefficient=0.02).numbers()
DRUM = DrumProperties(inertia=1e-3, friction_torque=0.01).numbers()
STIFF = CableProperties(mass_per_length=0.02, compliance=0.05, bending_stiffness=0.05).numbers()
DAMPED = CableProperties(mass_per_length=0.02, compliance=0.05, internal_damping=2.0).numbers()
CURRENT = Current.uniform([0.2, -0.1, 0.05]).numbers()
STEP = 1e-6


@compiled
def factor_and_solve(blocks, pivots, last, r):
    factor_wide(blocks, pivots, last)
    solve_wide(blocks, pivots, last, r)


def bent_line(segments, mode, seed, slackness=1e-4, c=CABLE):
    """Return a moving cable of half-metre segments with nodes shaken at all levels, and work space."""
    rng = np.random.default_rng(seed)
    line, work = new_line(segments + 2), new_load()
    line.ends.layout.segment_length = 0.5
    line.ends.drum_velocity[:] = 0.1, 0.3, -0.2
    north = np.array([1.0, 0.0, 0.0])
    lay_straight(line, 0.5 * segments + 0.1, north, north, DRUM, c)
    line.ends.count = segments
    line.ends.drum_mode = mode
    for level, lag in ((NEW, 0.0), (NOW, 0.1), (BEFORE, 0.2)):
        line.position[level, :segments, 0] -= lag
        line.ends.last_length[level] = 0.6 - lag
    line.position[:, :segments] += 0.05 * rng.normal(size=(segments, 3))
    line.position[:, :segments] += 1e-3 * rng.normal(size=(3, segments, 3))
    line.velocity[:, :segments] += 0.1 * rng.normal(size=(3, segments, 3))
    line.ends.payout[:] += 0.1 * rng.normal(size=3)
    chords = np.linalg.norm(np.diff(line.position[NEW, : segments + 1], axis=0), axis=1)
    line.length[1:segments] = chords[:-1] * (1.0 + slackness * rng.normal(size=segments - 1))
    line.ends.last_length[NEW] = chords[-1] * (1.0 + slackness)
    line.tension[NEW, 1 : segments + 1] = rng.uniform(0.0, 0.5, segments)
    line.slip[:] = 0.02 * rng.normal(size=line.slip.size)
    line.normal_gain[:] = rng.uniform(0.9, 1.0, line.normal_gain.size)
    start_in_water(line, CURRENT, c, work)
    line.water[:] += 0.1 * rng.normal(size=line.water.shape)
    line.forcing[:] = 0.1 * rng.normal(size=line.forcing.shape)
    return line, work


def unknowns(line):
    """Return the unknowns, 4 to a block; the last two of the last block are none."""
    N = line.ends.count
    blocks = np.concatenate([line.tension[NEW, 1 : N + 1, None], line.position[NEW, 1 : N + 1]], axis=1)
    blocks[-1] = line.tension[NEW, N], line.ends.last_length[NEW], 0.0, 0.0
    return blocks.ravel()


def residual(line, work, values, weights, c=CABLE):
    """Return residual and tow force at other unknowns (which stay in the line)."""
    N = line.ends.count
    blocks = values.reshape(N, 4)
    line.tension[NEW, 1 : N + 1] = blocks[:, 0]
    line.position[NEW, 1:N] = blocks[:-1, 1:]
    line.ends.last_length[NEW] = blocks[-1, 1]
    assemble(line, weights, c, DRUM, work)
    return line.rows[RESIDUAL, 1 : N + 1].ravel().copy(), line.ends.tow.force.copy()


def dense(line):
    """Return the block tridiagonal matrix as a full one."""
    N = line.ends.count
    matrix = np.zeros((4 * N, 4 * N))
    for j in range(N):
        rows = slice(4 * j, 4 * j + 4)
        matrix[rows, rows] = line.blocks[DIAGONAL, j + 1]
        if j > 0:
            matrix[rows, 4 * j - 4 : 4 * j] = line.blocks[LOWER, j + 1]
        if j < N - 1:
            matrix[rows, 4 * j + 4 : 4 * j + 8] = line.blocks[UPPER, j + 1]
        if j > 1:
            matrix[rows, 4 * j - 8 : 4 * j - 4] = line.blocks[LOWER2, j + 1]
        if j < N - 2:
            matrix[rows, 4 * j + 8 : 4 * j + 12] = line.blocks[UPPER2, j + 1]
    return matrix


def differences(line, work, weights, c=CABLE):
    """Return derivatives of residual and tow force by the unknowns, by central differences."""
    x = unknowns(line)
    columns, pulls = [], []
    for k in range(x.size):
        away = np.zeros(x.size)
        away[k] = STEP
        high, low = (residual(line, work, x + side * away, weights, c) for side in (1, -1))
        columns.append((high[0] - low[0]) / (2.0 * STEP))
        pulls.append((high[1] - low[1]) / (2.0 * STEP))
    residual(line, work, x, weights, c)
    return np.transpose(columns), np.transpose(pulls)


@pytest.mark.parametrize("mode", [TURNING, STANDING, SPINNING], ids=["turning", "standing", "spinning"])
@pytest.mark.parametrize("segments", [2, 3, 6])
@pytest.mark.parametrize("previous_step", [0.0, 0.07], ids=["first step", "later step"])
def test_the_analytic_jacobian_is_that_of_the_residual(mode, segments, previous_step):
    for seed in range(3):
        line, work = bent_line(segments, mode, seed)
        weights = backward_weights.py_func(0.1, previous_step)
        numeric, _ = differences(line, work, weights)
        analytic = dense(line)
        # The last two unknowns of the last block do not exist; their rows keep the matrix regular.
        assert_allclose(analytic[-2:], np.eye(4 * segments)[-2:])
        numeric[-2:] = analytic[-2:]
        largest = np.abs(analytic).max(axis=1, keepdims=True)
        assert_allclose(analytic / largest, numeric / largest, rtol=0, atol=2e-6)


@pytest.mark.parametrize("segments", [2, 4])
@pytest.mark.parametrize("stretch", [0.0, 0.01], ids=["comes taut", "was taut"])
def test_internal_damping_has_its_jacobian_right_too(segments, stretch):
    line, work = bent_line(segments, TURNING, 5, slackness=-2e-3, c=DAMPED)
    for level in (NOW, BEFORE):
        line.position[level] = (1.0 + stretch) * line.position[NEW]
        line.ends.last_length[level] = (0.99 if stretch else 1.01) * line.ends.last_length[NEW]
    weights = backward_weights.py_func(0.1, 0.1)
    numeric, _ = differences(line, work, weights, DAMPED)
    analytic = dense(line)
    numeric[-2:] = analytic[-2:]
    largest = np.abs(analytic).max(axis=1, keepdims=True)
    # The damped stretch has a corner where a segment gets slack; here all are on one side of it.
    assert_allclose(analytic / largest, numeric / largest, rtol=0, atol=2e-6)


@pytest.mark.long
@pytest.mark.parametrize("segments", [2, 3, 4, 6])
def test_bending_has_its_jacobian_right_too(segments):
    line, work = bent_line(segments, TURNING, 2, c=STIFF)
    weights = backward_weights.py_func(0.1, 0.1)
    numeric, _ = differences(line, work, weights, STIFF)
    analytic = dense(line)
    numeric[-2:] = analytic[-2:]
    largest = np.abs(analytic).max(axis=1, keepdims=True)
    assert_allclose(analytic / largest, numeric / largest, rtol=0, atol=2e-6)


@pytest.mark.long
@pytest.mark.parametrize("level", [-0.05, 0.02, 0.1])
def test_a_free_surface_has_its_jacobian_right_too(level):
    """Thick segments in and through the surface; without the arc's corrections, which its slopes leave out."""
    thick = CableProperties(mass_per_length=0.02, cross_section_area=1e-2, compliance=0.05, diameter=0.1)
    c = thick.numbers(surface=level)
    line, work = bent_line(5, TURNING, 4, c=c)
    line.slip[:], line.normal_gain[:] = 0.0, 1.0
    weights = backward_weights.py_func(0.1, 0.1)
    numeric, _ = differences(line, work, weights, c)
    analytic = dense(line)
    numeric[-2:] = analytic[-2:]
    largest = np.abs(analytic).max(axis=1, keepdims=True)
    last = 4 * line.ends.count - 8  # where the growing segment has its length, its dry weight is left out
    assert_allclose(analytic[:last] / largest[:last], (numeric / largest)[:last], rtol=0, atol=5e-6)


@pytest.mark.long
@pytest.mark.parametrize("segments", [2, 4])
def test_clamped_ends_have_their_jacobian_right_too(segments):
    stiff = CableProperties(mass_per_length=0.02, compliance=0.05, bending_stiffness=0.05)
    c = stiff.numbers(clamps=Clamps(first=(-1.0, 0.3, 0.1), second=(0.5, 0.2, -0.3)))
    line, work = bent_line(segments, TURNING, 2, c=c)
    weights = backward_weights.py_func(0.1, 0.1)
    numeric, _ = differences(line, work, weights, c)
    analytic = dense(line)
    numeric[-2:] = analytic[-2:]
    largest = np.abs(analytic).max(axis=1, keepdims=True)
    assert_allclose(analytic / largest, numeric / largest, rtol=0, atol=2e-6)


@pytest.mark.long
@pytest.mark.parametrize("mode", [TURNING, STANDING], ids=["turning", "standing"])
def test_added_mass_along_has_its_jacobian_right_too(mode):
    c = CableProperties(
        mass_per_length=0.02,
        compliance=0.05,
        diameter=0.01,
        cross_section_area=1e-4,
        tangential_added_mass_coefficient=0.5,
    ).numbers()
    line, work = bent_line(4, mode, 6, c=c)
    weights = backward_weights.py_func(0.1, 0.07)
    numeric, _ = differences(line, work, weights, c)
    analytic = dense(line)
    numeric[-2:] = analytic[-2:]
    largest = np.abs(analytic).max(axis=1, keepdims=True)
    assert_allclose(analytic / largest, numeric / largest, rtol=0, atol=2e-6)


@pytest.mark.long
@pytest.mark.parametrize("friction", [0.0, 0.2, 50.0], ids=["smooth", "slides", "sticks"])
def test_a_sea_bed_has_its_jacobian_right_too(friction):
    """All nodes are in the ground."""
    bed = SeaBed(
        depth=-0.3,
        slope_north=0.02,
        slope_east=-0.2,
        damping_ratio=0.01,
        axial_friction=friction,
        lateral_friction=0.5 * friction,
    )
    c = CableProperties(mass_per_length=0.02, compliance=0.05, diameter=0.06).numbers(bed)
    line, work = bent_line(5, TURNING, 4, c=c)
    line.friction[NOW] = (
        0.1 * friction * np.random.default_rng(1).uniform(-1.0, 1.0, line.friction[NOW].shape)
    )
    weights = backward_weights.py_func(0.1, 0.1)
    numeric, _ = differences(line, work, weights, c)
    analytic = dense(line)
    assert np.any(line.friction[NEW] if friction else line.rows[RESIDUAL])
    numeric[-2:] = analytic[-2:]
    largest = np.abs(analytic).max(axis=1, keepdims=True)
    assert_allclose(analytic / largest, numeric / largest, rtol=0, atol=2e-6)


@pytest.mark.long
@pytest.mark.parametrize("segments", [3, 4, 7])
def test_the_wide_elimination_solves_what_a_dense_one_solves(segments):
    """Verifies `cable.moving_end.block_solver` against LAPACK; round-off only."""
    line, work = bent_line(segments, TURNING, 3, c=STIFF)
    residual(line, work, unknowns(line), backward_weights.py_func(0.1, 0.1), STIFF)
    expected = np.linalg.solve(dense(line), line.rows[RESIDUAL, 1 : segments + 1].ravel())
    factor_and_solve(line.blocks, line.pivots, segments, line.rows[RESIDUAL])
    found = line.rows[RESIDUAL, 1 : segments + 1].ravel()
    assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_a_slack_line_has_its_jacobian_right_too():
    """Two per cent too much cable in every segment: tangents shrink (`chord_length`), the slack law takes over."""
    line, work = bent_line(4, TURNING, 5, slackness=0.0)
    line.length[1:4] *= 1.02
    line.ends.last_length[NEW] *= 1.02
    weights = backward_weights.py_func(0.1, 0.1)
    numeric, _ = differences(line, work, weights)
    analytic = dense(line)
    numeric[-2:] = analytic[-2:]
    largest = np.abs(analytic).max(axis=1, keepdims=True)
    assert_allclose(analytic / largest, numeric / largest, rtol=0, atol=2e-6)


@pytest.mark.parametrize("segments", [2, 5])
def test_the_tow_force_answers_to_the_first_block_as_told(segments):
    """The coupling's Newton method uses ∂F/∂(first block); it leaves out how the load is moved in the first half
    segment (a tenth of the load's own derivative), so a tenth of the largest entry is allowed.
    """
    line, work = bent_line(segments, TURNING, 1)
    _, pulls = differences(line, work, backward_weights.py_func(0.1, 0.1))
    reported = line.ends.tow.by_block.copy()
    assert_allclose(reported, pulls[:, :4], rtol=0, atol=0.1 * np.abs(reported).max())
