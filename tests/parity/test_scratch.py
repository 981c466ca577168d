"""Arrays on the stack: as large as asked, not one another's, and each caller's own."""

import numpy as np
import pytest
from numba.core.errors import TypingError

from subzero.jit import compiled, scratch

ROWS = 3


@compiled
def shapes():
    a, b = scratch(ROWS, 2), scratch(1, 6)[0]
    return a.shape[0], a.shape[1], b.shape[0]


@compiled
def apart(x):
    """Return what two arrays hold when both have been written."""
    a, b = scratch(2, 2), scratch(2, 2)
    for i in range(2):
        for k in range(2):
            a[i, k], b[i, k] = x, -x
    return a[0, 0] + a[1, 1] + 10.0 * (b[0, 0] + b[1, 1])


@compiled
def own(depth):
    """Return the sum of what each caller wrote before it called the next."""
    a = scratch(1, 2)
    a[0, 0], a[0, 1] = depth, 2.0 * depth
    below = own(depth - 1) if depth > 0 else 0.0
    return a[0, 0] + a[0, 1] + below


@compiled
def often(count):
    total = 0.0
    for i in range(count):
        total += apart(float(i % 2))
    return total


@compiled
def any_size(n):
    return scratch(n, 2)[0, 0]


def test_it_is_as_large_as_asked():
    assert shapes() == (3, 2, 6)


def test_two_of_them_do_not_overlap():
    assert apart(1.0) == 2.0 - 20.0


def test_every_caller_has_its_own():
    assert own(4) == 3.0 * (4 + 3 + 2 + 1)


def test_asking_a_million_times_takes_no_more_room():
    assert often(1_000_000) == -18.0 * 500_000


def test_a_size_that_is_no_constant_is_refused():
    with pytest.raises(TypingError):
        any_size(2)


def test_interpreted_code_has_the_like():
    from subzero.jit import intrinsics as module

    array = module._interpreted(2, 3)
    assert array.shape == (2, 3)
    assert array.dtype == np.float64
