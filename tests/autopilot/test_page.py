"""The page of the autopilots says what a flight gives.

Verifies: that every section of `python -m benchmarks.autopilot` can be measured, and that docs/autopilot.md shows the
factors that are asked for; that the example on it runs. Tolerance: the factors of 5 and 3; 3 degrees for noisy sensors.
"""

from pathlib import Path

import pytest

from benchmarks.autopilot import sections

PAGE = Path(__file__).parents[2] / "docs" / "autopilot.md"


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
    code = PAGE.read_text().split("```python\n")[1].split("```")[0]
    names: dict = {}
    exec(compile(code, str(PAGE), "exec"), names)
    assert names["run"].attrs["outcome"] == names["other"].attrs["outcome"] == "completed"
    assert abs(float(names["run"]["heading"][-1] - names["run"]["wanted_heading"][-1])) < 3.0


def test_the_tables_can_be_made():
    text = sections.steady_motion() + sections.gains()
    assert "| 1 | 20 |" in text
    assert "nan" not in text


@pytest.mark.slow
def test_the_margins_can_be_made():
    assert sections.all_margins().count("\n") > 45
