"""The analytic Jacobian against differences, the staircase solver against a dense one, compiled against not.

Configuration: heavy, stretching cable in a slanting current, random states; all three uses of the box
equations (trapezoidal, implicit, moving end). Tolerances: 1e-7 for differences (their own error), rounding
otherwise.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

import cable
from cable import CableProperties
from cable.feng_allen.box_equations import BoxRule, Ends, box_rows, box_scratch, drum_rows, tow_rows
from cable.feng_allen.box_newton import box_workspace, newton_pass
from cable.feng_allen.box_solver import back_substitute
from cable.feng_allen.equation7 import equation7_numbers
from cable.feng_allen.printed_scheme import add_node, keep_old_time
from subzero.jit import compiled

HEAVY = equation7_numbers(CableProperties(mass_per_length=0.02, compliance=0.05), (0.2, 0.1, -0.1))
TABLE_1 = equation7_numbers(CableProperties())
RULES = {
    "trapezoidal": BoxRule(0.5, 0.5, 3.0, False, 0.0),
    "implicit": BoxRule(1.0, 1.0, 3.0, False, 0.0),
    "moving end": BoxRule(1.0, 1.0, 3.0, True, 0.3),
}


def window_of(pair, histories, rule):
    """Fill a window with the rows of a box for the two states in `pair` (12,)."""
    window = np.zeros((9, 13))
    length = rule.end_history - pair[7] / rule.rate if rule.moves else 0.4
    left, right = histories
    known = np.zeros(6)
    box_rows(window, pair[:6], pair[6:], left, right, known, length, rule, HEAVY, box_scratch())
    return window


@pytest.mark.parametrize("name", RULES)
def test_box_slopes_are_the_differences_of_the_box_residual(name):
    rng = np.random.default_rng(1)
    middle = np.array([1.0, -1.0, 0.1, 0.2, 0.3, 3.3])
    left, right, *histories = (middle + 0.2 * rng.normal(size=6) for _ in range(4))
    pair, step = np.concatenate([left, right]), 1e-6
    slopes = window_of(pair, histories, RULES[name])[3:, :12]
    for column, unit in enumerate(np.eye(12)):
        high = window_of(pair + step * unit, histories, RULES[name])[3:, 12]
        low = window_of(pair - step * unit, histories, RULES[name])[3:, 12]
        np.testing.assert_allclose(slopes[:, column], (low - high) / (2 * step), atol=1e-7)


def test_tow_slopes_are_the_differences_of_the_tow_condition():
    ends, y, step = Ends(0.9, -0.3, 0.4, 0.0, 0.0, False), np.array([1.0, -1.0, 0.1, 0.2, 0.3, 3.3]), 1e-6

    def rows(state):
        window = np.zeros((9, 13))
        tow_rows(window, state, ends)
        return window[:3]

    for column, unit in enumerate(np.eye(6)):
        slope = (rows(y - step * unit)[:, 12] - rows(y + step * unit)[:, 12]) / (2 * step)
        np.testing.assert_allclose(rows(y)[:, column], slope, atol=1e-8)


def diving_cable(segments, length):
    """Return a workspace with a bent cable in the middle of an implicit step, its rule and its ends."""
    s = np.linspace(0.0, 1.0, segments + 1)
    w, rule = box_workspace(segments + 2), BoxRule(1.0, 1.0, 1.0 / length, False, 0.0)
    zero = np.zeros_like(s)
    w.y[: segments + 1] = np.stack(
        [0.5 * (1 - s), zero - 0.97, 0.17 * (1 - s) ** 2, zero, zero, np.pi - 0.3 * (1 - s) ** 2], axis=1
    )
    w.length[1 : segments + 1] = length
    w.count[0] = segments + 1
    add_node(w, length, 0.0)
    keep_old_time(w, 1.0, TABLE_1)
    return w, rule, Ends(0.93, 0.0, 0.36, 0.0, 0.0, False)


def dense_system(w, rule, ends):
    """Return the whole Newton matrix and right-hand side of `diving_cable`."""
    n = int(w.count[0])
    matrix, right = np.zeros((6 * n, 6 * n)), np.zeros(6 * n)
    top, bottom = np.zeros((9, 13)), np.zeros((9, 13))
    tow_rows(top, w.y[0], ends)
    matrix[:3, :6], right[:3] = top[:3, :6], top[:3, 12]
    for j in range(1, n):
        window = np.zeros((9, 13))
        before, after = w.history[j - 1], w.history[j]
        box_rows(window, w.y[j - 1], w.y[j], before, after, w.known[j], w.length[j], rule, TABLE_1, w.scratch)
        rows = slice(6 * j - 3, 6 * j + 3)
        matrix[rows, 6 * j - 6 : 6 * j + 6], right[rows] = window[3:, :12], window[3:, 12]
    drum_rows(bottom, w.y[n - 1], w.history[n - 1], rule.rate, ends)
    matrix[-3:, -6:], right[-3:] = bottom[3:6, :6], bottom[3:6, 12]
    return matrix, right


@compiled
def one_pass(w, rule, ends):
    newton_pass(w, rule, ends, TABLE_1, 1.0, 1.0)


@pytest.mark.parametrize(("segments", "length"), [(1, 1.0), (30, 1.0), (150, 0.1)])
def test_the_staircase_solver_finds_what_a_dense_solver_finds(segments, length):
    """150 nodes 0.1 m apart: elimination by rows alone has lost all digits there."""
    w, rule, ends = diving_cable(segments, length)
    matrix, right = dense_system(w, rule, ends)
    one_pass(w, rule, ends)
    back_substitute(w.factors, w.orders, w.count[0], w.update)
    exact = np.linalg.solve(matrix, right).reshape(-1, 6)
    np.testing.assert_allclose(w.update[: w.count[0]], exact, atol=1e-11 * np.abs(exact).max())


RUN = """
import json, sys
import cable
h = cable.pull_out(lambda t: (1.0, 0.1 * t, -0.1 * t), 5.0, scheme=cable.Paper(time_step=1.0))
json.dump([h.outcome.completed, *h.tow_force.ravel().tolist()], sys.stdout)
"""


@pytest.mark.long
def test_interpreted_and_compiled_scheme_agree():
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", RUN], capture_output=True, check=True, env=environment)
    completed, *forces = json.loads(done.stdout)
    here = cable.pull_out(lambda t: (1.0, 0.1 * t, -0.1 * t), 5.0, scheme=cable.Paper(time_step=1.0))
    assert completed
    assert here.outcome.completed
    np.testing.assert_allclose(here.tow_force.ravel(), forces, atol=1e-13)  # rounding of a sum
