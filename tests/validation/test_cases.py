"""Every gate of docs/validation.md is a test.

Verifies: the same table of cases that `python -m benchmarks.validation` writes the page from; each case says in its
file what is compared, with which equation. Tolerance: the gates of the page, 1e-4 and order 1.9 for closed forms unless
a row says otherwise. By default with few refinements; everything with `-m slow`. Other codes are not needed: what
MoorDyn said is on record.
"""

import pytest

from benchmarks.validation.cases import CASES
from benchmarks.validation.page import cells


def assert_passed(case, quick):
    rows = case.rows(quick)
    assert rows, "a case without rows shows nothing"
    failed = [" | ".join(cells(row)) for row in rows if row.judged and not row.passed]
    assert not failed, "\n".join(failed)


@pytest.mark.long
@pytest.mark.parametrize("case", [case for case in CASES if not case.slow], ids=lambda case: case.name)
def test_gates_are_met_at_coarse_refinements(case):
    assert_passed(case, quick=True)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_all_gates_of_the_page_are_met(case):
    assert_passed(case, quick=False)
