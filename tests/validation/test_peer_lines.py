"""The lines that are timed against other codes (`benchmarks.peers.lines`), and the table of it in docs/performance.md.

Verifies: the closed forms that errors are measured against, the motion that all codes are led by, and that the page
has the rows of the kept run. Tolerance: segments of 0.4 m leave 2e-4; derivatives by differences leave 1e-6.
"""

import json
from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from benchmarks.peers import lines
from benchmarks.peers.__main__ import Measured, Row, cells

DOCS = Path(__file__).parents[2] / "docs"


def test_a_hanging_line_has_the_pull_of_its_catenary():
    hanging = lines.Line(((20.0, lines.CHAIN),), ((16.0, 0.0, 3.0), (0.0, 0.0, 8.0)))
    halves = hanging._replace(sections=((8.0, lines.CHAIN), (12.0, lines.CHAIN)))
    assert lines.exact(halves) == pytest.approx(lines.exact(hanging), rel=1e-9)
    assert lines.our_pull(hanging, 0.4) == pytest.approx(lines.exact(hanging), rel=2e-4)


@pytest.mark.long
@pytest.mark.parametrize(
    "line", [lines.ON_FLOOR._replace(modulus=lines.HARD), lines.SECTIONS], ids=["floor", "two"]
)
def test_the_lines_of_the_table_have_their_closed_form(line):
    errors = [lines.our_pull(line, segment) / lines.exact(line) - 1.0 for segment in (0.4, 0.1)]
    assert abs(errors[0]) < 2e-4
    assert abs(errors[1]) < 1e-5


@pytest.mark.parametrize("t", [0.4, 2.1, 5.3])
def test_the_motion_has_its_velocity_and_acceleration(t):
    h = 1e-5
    before, here, after = (lines.motion(t + k * h) for k in (-1, 0, 1))
    assert_allclose((after[:2] - before[:2]) / (2.0 * h), here[1:], atol=1e-6)
    assert_allclose(lines.motion(0.0), 0.0, atol=1e-12)


def test_every_section_has_its_share_of_the_elements():
    assert lines.divided(lines.SECTIONS, 80) == [48, 32]
    text = lines.moordyn_text(lines.SECTIONS, [48, 32])
    assert "1 type0 2 1 20.0 48 -" in text
    assert "2 type1 3 2 13.0 32 -" in text


def test_the_page_has_the_rows_of_the_kept_run():
    page = (DOCS / "performance.md").read_text(encoding="utf-8")
    kept = json.loads((DOCS / "performance.json").read_text(encoding="utf-8"))["rows"]
    assert len(kept) > 30
    for row in kept:
        theirs, ours = Measured(**row["theirs"]), Measured(**row["ours"])
        assert " | ".join(cells(Row(case=row["case"], peer=row["peer"], theirs=theirs, ours=ours))) in page


def test_most_rows_are_ahead_at_equal_error():
    """Those that are not say why on the page: CableDyn's few large elements, and MoorPy, which is the closed form."""
    kept = json.loads((DOCS / "performance.json").read_text(encoding="utf-8"))["rows"]
    behind = {row["peer"].split()[0] for row in kept if row["ratio"] < 1.0 or not row["ours_is_as_accurate"]}
    assert behind <= {"MoorPy", "CableDyn"}
