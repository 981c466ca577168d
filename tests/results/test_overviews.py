"""What a prompt and a notebook show of a value: a few lines, in which a user's words are text."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
import scenarios
import subzero
from subzero.diagnosis import CAUSE_NAMED, Verdict
from subzero.diagnosis import NamedCause as Cause

STRANGE = "<script>alert(1)</script> $\\frac$ [bold] Zürich \x1b[31m " + "z" * 300
MOST_LINES = 12


def trial():
    return scenarios.load("fig6")


@pytest.fixture(scope="module")
def history():
    return cable.pull_out(lambda t: (1.0, 0.0, 0.0), 2.0)


@pytest.fixture(scope="module")
def comparison():
    return subzero.compare(replace(trial(), duration=2.0, description=STRANGE))


def verdict():
    causes = tuple(
        Cause(id=f"cause_{n}", sentence=STRANGE, probability=0.2, parameters={}) for n in range(20)
    )
    return Verdict(verdict=CAUSE_NAMED, sentence=STRANGE, causes=causes, probabilities={"a": 0.7, "b": 0.3})


def values(history, comparison):
    shipped = map(scenarios.load, scenarios.names())
    return [*shipped, replace(trial(), description=STRANGE), history, comparison, verdict()]


def test_every_overview_has_twelve_lines_at_most_and_none_that_fills_the_screen(history, comparison):
    for value in values(history, comparison):
        lines = repr(value).splitlines()
        assert 2 < len(lines) <= MOST_LINES, value
        assert max(map(len, lines)) <= 140
        assert all(line.isprintable() for line in lines)


def test_in_a_notebook_strange_words_are_text(history, comparison):
    for value in values(history, comparison):
        page = value._repr_html_()
        assert "<script" not in page
        assert "\x1b" not in page
        assert len(re.findall("<tr>", page)) < MOST_LINES
    assert "&lt;script&gt;" in comparison._repr_html_()


def test_a_comparison_shows_the_numbers_of_its_summary(comparison):
    reported = comparison.summary()
    for label in ("tethered", "untethered"):
        assert f"{reported[label]['peak_speed_m_s']:.4g} m/s" in repr(comparison)
    assert re.search(r"cable length at end +0\.4\d+ m +0 m", repr(comparison))


def test_the_dataset_of_a_cable_is_its_history(history):
    run = history.to_dataset()
    assert_allclose(run["tow_force"], history.tow_force)
    last = run["position"].isel(time=-1).dropna("node")
    assert_allclose(last, history.shapes[-1])
    assert_allclose(run["tension"].isel(time=-1).dropna("node"), history.tensions[-1])
    assert float(last["arc_length"][-1]) == pytest.approx(
        history.length[-1], rel=1e-6
    )  # straight, inextensible
    for name, variable in run.variables.items():
        assert variable.attrs["long_name"], name
        assert variable.attrs.get("units") or variable.dtype.kind == "U", name


@pytest.mark.parametrize("scheme", ["lumped", "equation7", "paper"])
def test_every_scheme_gives_a_dataset_that_can_be_written(scheme, tmp_path):
    run = cable.pull_out(lambda t: (1.0, 0.0, 0.0), 1.0, scheme=scheme).to_dataset()
    run.to_netcdf(tmp_path / "cable.nc")
    assert np.isfinite(run["tow_tension"]).all()
