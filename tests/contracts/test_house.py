"""The code stays as easy to carry on as it is: no circle of imports, and no longer chain of them than stands.

Verifies: `python -m benchmarks.house`. Configuration: the sources as they are, and graphs drawn by hand. Tolerance:
none. A change that shortens a chain lowers its number here.
"""

import pytest

from benchmarks.house import circles, figures, longest_chain

FLOORS = {
    "cable": 8,
    "vehicle": 6,
    "scenarios": 6,
    "subzero.autopilot": 8,
    "subzero.diagnosis": 14,
    "subzero.page": 3,
    "subzero.records": 2,
    "subzero.sweeps": 7,
    "subzero.synthetic": 5,
    "subzero, rest": 15,
    "all": 32,
}
"""Package → modules on the longest chain of imports inside it."""


@pytest.fixture(scope="module")
def stands():
    """The figures of the sources as they are."""
    return figures()


def test_no_modules_import_one_another(stands):
    assert {row: one.circles for row, one in stands.items() if one.circles} == {}


@pytest.mark.parametrize("row", FLOORS)
def test_no_chain_of_imports_is_longer_than_it_was(stands, row):
    assert stands[row].floors <= FLOORS[row], stands[row].chain


def test_every_module_has_a_row(stands):
    assert set(stands) == set(FLOORS)
    assert stands["all"].files == sum(one.files for row, one in stands.items() if row != "all")


def test_a_circle_is_found_and_is_one_floor():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": set(), "e": {"d"}}
    assert circles(graph) == [["b", "c"]]
    assert longest_chain(graph) == ["a", "b", "d"]
    assert circles({"a": {"b"}, "b": {"c"}, "c": set()}) == []
