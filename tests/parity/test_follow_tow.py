"""A cable that is asked again for a tow point close by begins with its last answer, moved as the last matrix says.

Verifies: `cable.moving_end.time_step.follow_tow` against full solutions, `try_step(again=True)` against a step from
a prediction. Configuration: 8 m of heavy cable in segments of half a metre on a rubbing drum, towed along a bend for
2.5 s. Tolerance: what the matrix says is off by the square of the displacement, so half of that leaves a quarter;
steps agree as far as they are solved, 1e-9 of the tension and 1e-12 of the length.
"""

from typing import NamedTuple

import numpy as np
import pytest

from cable import CableProperties, DrumProperties
from cable.current import Current
from cable.moving_end.initial_shape import lay_straight, start_in_water
from cable.moving_end.remeshing import accept
from cable.moving_end.segment_load import new_load
from cable.moving_end.state import NEW, new_line
from cable.moving_end.time_step import follow_tow, try_step
from subzero.jit import compiled

CABLE = CableProperties(mass_per_length=0.02, compliance=1e-4).numbers()
STIFF = CableProperties(mass_per_length=0.02, compliance=1e-4, bending_stiffness=1e-3).numbers()
DRUM = DrumProperties(friction_torque=0.01).numbers()
WATER = Current.uniform([0.05, -0.1, 0.02]).numbers()
STEP, LENGTH = 0.1, 8.0
ASIDE = np.array([0.3, -1.0, 0.5])


class Asked(NamedTuple):
    converged: bool
    iterations: int


def place(time):
    """Return where the tow point is."""
    return np.array([LENGTH + 0.9 * time, 0.2 * time * time, 0.1 * np.sin(2.0 * time)])


def asked(line, work, tow, again=False, c=CABLE):
    """Solve the next step for a tow point; return whether there is a solution, and in how many iterations."""
    return Asked(try_step(line, STEP, tow, WATER, c, DRUM, work, again), int(line.ends.solved.iterations))


@compiled
def follow(line, tow):
    return follow_tow(line, tow)


@pytest.fixture
def towed():
    return pulled(CABLE)


def pulled(c):
    """Return a cable with the answer to the next place of its tow point, work space, and that place."""
    line, work = new_line(60), new_load()
    line.ends.layout.segment_length = 0.5
    north = np.array([1.0, 0.0, 0.0])
    lay_straight(line, LENGTH, north, 0.9 * north, DRUM, c)
    start_in_water(line, WATER, c, work)
    for row in range(1, 26):
        assert asked(line, work, place(row * STEP), c=c).converged
        accept(line, STEP, c, work)
    tow = place(26 * STEP)
    assert asked(line, work, tow, c=c).converged
    return line, work, tow


def state(line):
    """Return the unknowns of level NEW: positions [m], the last length [m], and tensions [N]."""
    N = line.ends.count
    return np.concatenate(
        [line.position[NEW, :N].ravel(), [line.ends.last_length[NEW]], line.tension[NEW, 1 : N + 1]]
    )


@pytest.mark.long
def test_what_the_matrix_says_is_off_by_the_square_of_the_displacement(towed):
    line, work, tow = towed
    errors = []
    for size in (2e-3, 1e-3):
        asked(line, work, tow)
        assert follow(line, tow + size * ASIDE)
        moved = state(line)
        asked(line, work, tow + size * ASIDE)
        errors.append(np.abs(moved - state(line)).max())
    assert 3.0 < errors[0] / errors[1] < 5.0


def test_the_answer_is_the_same_from_the_last_one_as_from_a_prediction(towed):
    line, work, tow = towed
    there = tow + 1e-4 * ASIDE
    again = asked(line, work, there, again=True)
    from_last, force = state(line), line.ends.tow.force.copy()
    anew = asked(line, work, there)
    assert again.converged
    assert again.iterations < anew.iterations
    np.testing.assert_allclose(from_last, state(line), rtol=1e-6)  # arcs are those of each one's prediction
    np.testing.assert_allclose(force, line.ends.tow.force, rtol=1e-6)


def test_the_same_tow_point_again_takes_no_iteration(towed):
    line, work, tow = towed
    before = state(line)
    assert asked(line, work, tow, again=True).iterations == 0
    np.testing.assert_array_equal(before, state(line))


def test_without_factors_nothing_moves_and_the_step_begins_with_a_prediction(towed):
    line, work, tow = towed
    line.ends.solver.factored = False
    before = state(line)
    assert not follow(line, tow + ASIDE)
    np.testing.assert_array_equal(before, state(line))
    assert asked(line, work, tow, again=True).iterations > 0


@pytest.mark.long
def test_a_stiff_cable_has_a_matrix_but_no_factors_and_begins_with_a_prediction():
    line, work, tow = pulled(STIFF)
    assert not follow(line, tow + ASIDE)
    assert asked(line, work, tow, again=True, c=STIFF).iterations > 0
