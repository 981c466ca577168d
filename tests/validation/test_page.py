"""The page tells what was measured, keeps what was not, and hides no failure.

Verifies: `benchmarks.validation.page` and `row` on small rows with known answers, and that docs/validation.md has a
section for every case. Tolerance: none, text and exact numbers; the order of errors 3h² is 2 to rounding.
"""

import numpy as np
import pytest

from benchmarks.validation import page
from benchmarks.validation.cases import CASES
from benchmarks.validation.row import Setting, order, order_row

GOOD = Setting("a thing", "(7)", 0.1).row(1.05, 1.0)
BAD = Setting("another", "(7)", 0.1).row(1.5, 1.0)
LOST = Setting("a third", "(7)", 0.1).row(np.nan, 1.0)


def test_a_row_passes_when_its_error_is_within_the_gate_and_a_number():
    assert GOOD.passed
    assert GOOD.error == pytest.approx(0.05)
    assert not BAD.passed
    assert not LOST.passed


def test_the_worst_of_a_series_is_shown():
    row = Setting("series", "(7)", 0.1).worst(np.array([1.0, 2.2, 3.0]), np.array([1.0, 2.0, 3.0]))
    assert (row.ours, row.reference) == (2.2, 2.0)
    assert row.error == pytest.approx(0.1)


def test_the_direction_of_a_vector_counts():
    assert Setting("turned", "(7)", 0.1).vector([0.0, 1.0], [1.0, 0.0]).error == pytest.approx(np.sqrt(2.0))


def test_an_order_below_the_gate_fails():
    sizes = [0.4, 0.2, 0.1]
    assert order(sizes, [3.0 * h**2 for h in sizes]) == pytest.approx(2.0)
    assert order_row("second", sizes, [h**2 for h in sizes], "Δs", "").passed
    assert order_row("third", sizes, [h**3 for h in sizes], "Δs", "").passed
    assert not order_row("first", sizes, [h**1.8 for h in sizes], "Δs", "").passed
    assert not order_row("none", sizes, [0.0, np.nan, 1.0], "Δs", "").passed


def test_failures_are_counted_and_sections_not_measured_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "PAGE", tmp_path / "validation.md")
    first, second = CASES[0], CASES[1]
    page.write_page({first.name: [GOOD, BAD], second.name: [GOOD]})
    page.write_page({first.name: [BAD]})
    text = page.PAGE.read_text()
    assert "**1 of 2 gates are met.**" in text
    assert text.count(f"| {page.FAIL} |") == 1
    assert list(page.sections(text)) == [first.title, second.title]


def test_every_case_has_its_section_and_its_figure():
    there = page.sections(page.PAGE.read_text())
    assert list(there) == [case.title for case in CASES]
    for case in CASES:
        assert not case.draw or page.figure_path(case).exists(), case.name
