"""The code stays as easy to carry on as it is: no circle of imports, and no longer chain of them than stands.

Verifies: `python -m benchmarks.house`. Configuration: the sources as they are, and graphs drawn by hand. Tolerance:
none. A change that shortens a chain lowers its number here.
"""

import ast

import pytest

from benchmarks import constants
from benchmarks.house import (
    ROOT,
    SMALL_FILES,
    Module,
    budgets,
    circles,
    engine_goals,
    figures,
    goals,
    longest_chain,
    product,
    scattered,
    targets,
)

FLOORS = {
    "cable": 9,
    "vehicle": 8,
    "scenarios": 6,
    "subzero.autopilot": 8,
    "subzero.calibration": 4,
    "subzero.diagnosis": 11,
    "subzero.page": 3,
    "subzero.records": 2,
    "subzero.sweeps": 7,
    "subzero.synthetic": 5,
    "subzero, rest": 13,
    "all": 24,
}
"""Package → modules on the longest chain of imports inside it."""


@pytest.fixture(scope="module")
def stands():
    """The figures of the sources as they are."""
    return figures()


@pytest.mark.long
def test_no_modules_import_one_another(stands):
    assert {row: one.circles for row, one in stands.items() if one.circles} == {}


@pytest.mark.long
@pytest.mark.parametrize("row", FLOORS)
def test_no_chain_of_imports_is_longer_than_it_was(stands, row):
    assert stands[row].floors <= FLOORS[row], stands[row].chain


@pytest.mark.long
def test_no_package_is_scattered_over_more_files_than_is_asked_for(stands):
    assert set(scattered(stands)) <= set(SMALL_FILES)


@pytest.mark.long
@pytest.mark.parametrize(
    "row", ["subzero.autopilot", "subzero.records", "subzero.sweeps", "subzero.synthetic"]
)
def test_a_file_with_one_importer_is_a_whole_concept(stands, row):
    assert stands[row].short_lone == []


@pytest.mark.long
def test_few_tests_of_the_diagnosis_know_more_of_it_than_its_faces(stands):
    one = stands["subzero.diagnosis"]
    assert one.tests_below_faces <= 0.1 * one.tests


@pytest.mark.long
def test_the_engine_of_a_diagnosis_is_as_small_as_is_asked_for():
    assert [goal.line() for goal in engine_goals(product()) if not goal.is_met] == []


@pytest.mark.long
def test_a_target_that_is_missed_says_so(stands):
    asked = goals(stands)
    for goal, line in zip(asked, targets(asked).splitlines()[1:], strict=True):
        assert (" NOT" in line) == (not goal.is_met)


@pytest.mark.long
def test_every_module_has_a_row(stands):
    assert set(stands) == set(FLOORS)
    assert stands["all"].files == sum(one.files for row, one in stands.items() if row != "all")


def test_a_circle_is_found_and_is_one_floor():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": set(), "e": {"d"}}
    assert circles(graph) == [["b", "c"]]
    assert longest_chain(graph) == ["a", "b", "d"]
    assert circles({"a": {"b"}, "b": {"c"}, "c": set()}) == []


def test_every_module_counts_in_one_budget():
    whole, *parts, _ = budgets(product())
    assert whole.found == sum(part.found for part in parts)


@pytest.mark.parametrize(
    ("moved", "part"),
    [
        ("subzero.simulation.checkpoint", "files, interrupts, checkpoint"),
        ("subzero.files.atomic_output", "files, interrupts, checkpoint"),
        ("subzero.simulation.refinement", "trust"),
        ("subzero.cli.output_mode", "command line and what it writes"),
        ("subzero.explore.page", "explore"),
        ("subzero.figures.accessor", "figures"),
    ],
)
def test_a_module_that_is_moved_counts_where_it_did(moved, part):
    module = Module(ROOT / "benchmarks" / "constants.py", moved)
    found = {goal.name: goal.found for goal in budgets({moved: module})}
    assert found[f"lines: {part}"] == module.lines


def test_numbers_are_counted_wherever_they_stand():
    tree = ast.parse(
        "FAR, NEAR = 1e3, 2\n"
        "WORDS = {'a': 1}\n"
        "class Tuning:\n    gain: float = 0.7\n    start: float = 0.0\n"
        "def law(x, limit=0.17, sign=-1):\n    return 0.5 * x + 3.2 * x**2 - 1\n"
    )
    assert constants.named(tree) == ["FAR", "NEAR", "gain"]
    assert (constants.defaults(tree), constants.bare(tree)) == (1, 1)


def test_comments_for_linters_are_no_comments(tmp_path):
    path = tmp_path / "some.py"
    path.write_text("# why\nx = [1]  # noqa: E501\ny = '# no comment'  # eq. (12)\n", encoding="utf-8")
    assert Module(path, "some").comments == 2
