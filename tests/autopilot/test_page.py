"""The page of the autopilots says what a flight gives.

Verifies: that every section of `python -m benchmarks.autopilot` can be measured; that docs/autopilot_measured.md shows
the factors that are asked for; that the example of docs/autopilot.md runs. Tolerance: the factors of 5 and 3; 3 degrees
for noisy sensors.
"""

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.autopilot import sections
from benchmarks.autopilot.__main__ import SECTIONS, parts_of

GUIDE = Path(__file__).parents[2] / "docs" / "autopilot.md"
PAGE = GUIDE.with_name("autopilot_measured.md")


def cells(flight, pilot, known):
    """Return the numbers of a line of the page's first table."""
    begin = f"| {flight} | {pilot} | {known} |"
    line = next(line for line in PAGE.read_text().splitlines() if line.startswith(begin))
    return [
        float(cell) if cell.strip() not in ("–", "∞") else float("nan")
        for cell in line.strip("|").split("|")[3:]
    ]


@pytest.mark.parametrize("pilot", ["pid", "lqr"])
def test_the_page_shows_the_factors_that_are_asked_for(pilot):
    _, speed_factor, _, _ = cells("fig6", pilot, "model")
    _, formula_factor, _, _ = cells("fig6", pilot, "formula")
    _, _, _, heading_factor = cells("wide_turn", pilot, "model")
    assert min(speed_factor, formula_factor) > 5.0
    assert heading_factor > 3.0


def test_the_example_of_the_page_runs():
    code = GUIDE.read_text().split("```python\n")[1].split("```")[0]
    names: dict = {}
    exec(compile(code, str(GUIDE), "exec"), names)
    assert names["run"].attrs["outcome"] == names["other"].attrs["outcome"] == "completed"
    assert abs(float(names["run"]["heading"][-1] - names["run"]["wanted_heading"][-1])) < 3.0


def test_the_tables_can_be_made():
    text = sections.steady_motion() + sections.gains()
    assert "| 1 | 20 |" in text
    assert "nan" not in text


@pytest.mark.slow
def test_the_margins_can_be_made():
    text = sections.all_margins(speeds=(1.0,), lengths=(0.0, 20.0))
    assert text.count("| 1 | 20 |") == 5
    assert "–" not in text.partition("|---")[2]


def test_flown_margins_of_the_page_are_those_of_the_linear_model_to_a_tenth():
    """44 of 45: on 40 m at 1.4 m/s the propeller is at its limit."""
    page = PAGE.read_text().partition("## Stability margins")[2].partition("\n## ")[0]
    rows = [line.strip("|").split("|") for line in page.splitlines() if line.count("|") == 9][2:]
    pairs = [(float(row[3]), float(row[4])) for row in rows if row[4].strip() != "–"]
    assert (len(rows), len(pairs)) == (45, 44)
    for linear, flown in pairs:
        assert flown == pytest.approx(linear, rel=0.1)


@pytest.mark.long
def test_sections_of_the_page_are_told_apart_and_refused():
    found = parts_of(PAGE.read_text())
    assert list(found) == list(SECTIONS)
    assert subprocess.run(
        [sys.executable, "-m", "benchmarks.autopilot", "margin"], capture_output=True, text=True, cwd=PAGE.parents[1],
        check=False,
    ).stderr.startswith("There is no section 'margin'. Allowed: feed_forward")  # fmt: skip
