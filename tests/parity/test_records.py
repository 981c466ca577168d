"""Records in memory: a `subzero.jit.Record` reads and writes like the class that it is declared as.

Verifies: fields, their memory, layouts, compiled code on them, what is refused. Configuration: small records by hand.
Tolerance: none.
"""

from __future__ import annotations

import numpy as np
import pytest

from subzero.jit import Record, compiled, made_once


class Inner(Record):
    gain: float
    matrix: np.ndarray


class Outer(Record):
    inner: Inner
    row: tuple[Inner, ...]
    count: int
    is_open: bool = True


class Wider(Inner):
    offset: float


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
    return Outer(Inner(2.5, matrix), (Inner(1.0, matrix), Inner(2.0, matrix)), count=3)


def test_a_record_is_what_its_class_declares():
    record = make()
    assert isinstance(record, Outer)
    assert isinstance(record.inner, Inner)
    assert record.inner.gain == 2.5
    assert record.inner.matrix.tolist() == [[0.0, 1.0], [2.0, 3.0]]
    assert record.row[1].gain == 2.0
    assert record.count == 3
    assert record.is_open
    assert [name for name, _ in zip(Outer.names, record, strict=True)] == [
        "inner", "row", "count", "is_open"
    ]  # fmt: skip


def test_compiled_code_reads_and_writes_a_record_in_place():
    record = make()
    assert change(record) == 2.5
    assert record.count == 5
    assert record.inner.matrix[0, 1] == 3.0


def test_python_writes_a_record_in_place_and_one_that_is_in_it():
    record = make()
    record.inner.gain = 7.0
    record.inner.matrix[1] = 4.0
    record.count = 9
    assert (record.inner.gain, record.count) == (7.0, 9)
    assert record.inner.matrix[1].tolist() == [4.0, 4.0]
    record.memory_of("count")[0] = 2
    record.memory_of("inner")["gain"] = 1.5
    assert (record.inner.gain, record.count) == (1.5, 2)


def test_what_differs_in_kind_or_shape_has_a_layout_of_its_own():
    one, two, whole = np.eye(1), np.eye(2), Inner(1, np.eye(2))
    assert Inner(1.5, one).matrix.shape == (1, 1)
    assert Inner(2.5, two).matrix.shape == (2, 2)
    assert Inner(1.5, two.astype(int)).matrix.dtype == int
    assert whole.gain.dtype == int
    assert Inner(1.5, two).gain.dtype == float
    assert Outer(inner=whole, row=(Inner(1.0, one),), count=0).row.shape == (1,)
    assert Inner(1.5, two).dtype is Inner(2.5, two).dtype


def test_a_record_copies_what_it_is_made_of():
    matrix = np.eye(2)
    inner = Inner(1.0, matrix)
    again = Outer(inner=inner, row=(inner, inner), count=0)
    matrix[:] = inner.gain = 7.0
    assert again.inner.matrix.tolist() == [[1.0, 0.0], [0.0, 1.0]]
    assert again.inner.gain == 1.0


def test_a_copy_is_the_same_record_in_memory_of_its_own_to_the_last_field():
    record = make()
    copy = record.copy()
    assert isinstance(copy, Outer)
    assert copy.tobytes() == record.tobytes()
    copy.memory_of("count")[0] = 2
    assert change(copy) == 2.5
    assert (record.count, copy.count) == (3, 5)
    assert record.inner.matrix[0, 1] == 1.0


def test_what_is_made_once_is_given_away_as_copies():
    calls = []

    @made_once
    def empty() -> Inner:
        calls.append(1)
        return Inner(1.0, np.zeros((2, 2)))

    empty().matrix[:] = 7.0
    assert empty().matrix.tolist() == [[0.0, 0.0], [0.0, 0.0]]
    assert len(calls) == 1


def test_the_fields_of_a_subclass_stand_first_in_its_memory():
    wider = Wider(gain=1.0, matrix=np.eye(1), offset=2.0)
    assert isinstance(wider, Inner)
    assert wider.dtype.names == ("offset", "gain", "matrix")


@pytest.mark.parametrize(
    "given, named",
    [((1.0,), {}), ((1.0, np.eye(1), 2.0), {}), ((1.0,), {"matrix": np.eye(1), "gian": 2.0})],
)
def test_fields_that_are_missing_too_many_or_unknown_are_refused(given, named):
    with pytest.raises(TypeError, match="Inner takes gain, matrix"):
        Inner(*given, **named)


def test_an_unknown_field_is_told_with_those_there_are():
    with pytest.raises(AttributeError, match="no field 'gian'; it has gain, matrix"):
        Inner(1.0, np.eye(1)).gian  # noqa: B018
    with pytest.raises(AttributeError, match="no field 'gian'"):
        Inner(1.0, np.eye(1)).gian = 2.0


def test_a_name_that_every_record_has_is_refused():
    with pytest.raises(TypeError, match="every record has size already"):

        class Sized(Record):
            size: float
