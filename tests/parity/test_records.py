"""Records in memory: `subzero.jit.packed` reads and writes like the named tuple or dataclass it was made of."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from subzero.jit import compiled, packed


class Inner(NamedTuple):
    gain: float
    matrix: np.ndarray


@dataclass(kw_only=True)
class Outer:
    inner: Inner
    row: tuple
    count: int


@compiled
def change(outer):
    total = 0.0
    for i in range(2):
        total += outer.row[i].gain
    outer.count = 5
    outer.inner.matrix[0, 1] = total
    return outer.inner.gain


def make():
    matrix = np.arange(4.0).reshape(2, 2)
    return packed(Outer(inner=Inner(2.5, matrix), row=(Inner(1.0, matrix), Inner(2.0, matrix)), count=3))


def test_a_record_reads_like_what_it_was_made_of():
    record = make()
    assert record.inner.gain == 2.5
    assert record.inner.matrix.tolist() == [[0.0, 1.0], [2.0, 3.0]]
    assert record.row[1].gain == 2.0
    assert record.count == 3


def test_compiled_code_reads_and_writes_a_record_in_place():
    record = make()
    assert change(record) == 2.5
    assert record.count == 5
    assert record.inner.matrix[0, 1] == 3.0


def test_what_differs_in_kind_or_shape_has_a_layout_of_its_own():
    one, two, whole = np.eye(1), np.eye(2), Inner(1, np.eye(2))
    assert packed(Inner(1.5, one)).matrix.shape == (1, 1)
    assert packed(Inner(2.5, two)).matrix.shape == (2, 2)
    assert packed(Inner(1.5, two.astype(int))).matrix.dtype == int
    assert packed(whole).gain.dtype == int
    assert packed(Inner(1.5, two)).gain.dtype == float
    assert packed(Outer(inner=whole, row=(Inner(1.0, one),), count=0)).row.shape == (1,)


def test_packing_copies_and_a_packed_part_can_be_packed_again():
    matrix = np.eye(2)
    inner = packed(Inner(1.0, matrix))
    again = packed(Outer(inner=inner, row=(inner, inner), count=0))
    matrix[:] = 7.0
    assert again.inner.matrix.tolist() == [[1.0, 0.0], [0.0, 1.0]]
