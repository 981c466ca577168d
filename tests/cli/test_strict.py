"""Warnings are told alike wherever a result is: dataset, JSON, terminal, figures; --strict makes them exit code 3."""

from __future__ import annotations

import json
import sys

import pytest
import xarray as xr

from subzero.cli.app import FINE, STOPPED, main
from subzero.figures import draw

DOUBTS = [
    {"check": "slack", "message": "Up to 30 % of the cable [in the water] is slack (at 7 s)."},
    {"check": "actuators", "message": "The rudder is commanded to 40° and goes to 20°."},
]
"""Square brackets are no markup of the terminal."""
NOTES = [
    {"check": "slack_shape", "message": "Up to 17 % of the cable is slack: there its shape means nothing."}
]


@pytest.fixture
def doubtful(rails, monkeypatch, make_run):
    """Let tethered runs end with two warnings."""

    def simulate(_trial, *, tethered, progress):
        run = make_run(tethered=tethered)
        return run.assign_attrs(warnings=json.dumps(DOUBTS if tethered else []), notes=json.dumps(NOTES))

    monkeypatch.setattr(sys.modules["subzero.simulation.run"], "simulate", simulate)


@pytest.mark.long
def test_dataset_json_and_terminal_tell_the_same_warnings(doubtful, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    assert main(["compare", "fig6", "--out", str(tmp_path)]) == FINE
    said = capsys.readouterr().out
    assert "Warnings, tethered run:" in said
    assert "Warnings, untethered run:" not in said
    assert all(one["message"] in said for one in DOUBTS)
    rows = [" ".join(row.split()) for row in said.splitlines()]
    assert "warnings 2 0" in rows
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert (summary["tethered"]["warnings"], summary["untethered"]["warnings"]) == (DOUBTS, [])
    with xr.open_dataset(tmp_path / "tethered.nc") as run:
        assert json.loads(run.attrs["warnings"]) == DOUBTS


@pytest.mark.long
@pytest.mark.parametrize("words", [["compare", "fig6"], ["simulate", "fig6"]])
def test_strict_writes_everything_and_exits_with_3(words, doubtful, tmp_path, capsys):
    assert main([*words, "--strict", "--out", str(tmp_path)]) == STOPPED
    assert capsys.readouterr().err.endswith(
        "Warnings under --strict: 2 of the tethered run. All files are written.\n"
    )
    assert {"summary.json", "tethered.nc", "tethered.csv", "fig6.png"} <= {
        path.name for path in tmp_path.iterdir()
    }


@pytest.mark.long
def test_strict_says_nothing_of_a_run_with_notes_only(doubtful, tmp_path, capsys):
    assert main(["simulate", "fig6", "--untethered", "--strict", "--out", str(tmp_path)]) == FINE
    said = capsys.readouterr()
    assert "strict" not in said.err
    assert "Notes, untethered run:" in said.out
    assert NOTES[0]["message"] in " ".join(said.out.split())
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["untethered"]["notes"] == NOTES
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"untethered run: {NOTES[0]['message']}" in page
    assert '<h2 id="warnings">' not in page


def test_every_figure_carries_a_line_about_warnings_and_none_without(make_run):
    plain = make_run()
    doubted = plain.assign_attrs(warnings=json.dumps(DOUBTS))
    for name, figure in draw({"tethered": doubted}).items():
        words = [text.get_text() for text in figure.texts]
        assert "2 warnings (slack, actuators), see summary.json" in words, name
        assert all(text.get_window_extent().x1 <= figure.bbox.x1 for text in figure.texts), name
    both = draw({"tethered": doubted, "untethered": make_run(tethered=False)})["fig6"]
    assert "2 warnings (tethered: slack, actuators), see summary.json" in [
        text.get_text() for text in both.texts
    ]
    for figure in draw({"tethered": plain}).values():
        assert not [text for text in figure.texts if "warning" in text.get_text()]


def test_the_line_below_a_figure_stays_inside_it_however_many_checks_warn(make_run):
    many = [{"check": f"a_rather_long_name_{k}", "message": "."} for k in range(12)]
    figure = draw({"tethered": make_run().assign_attrs(warnings=json.dumps(many))})["fig6"]
    (line,) = [text for text in figure.texts if "warnings" in text.get_text()]
    assert line.get_text().endswith(" …")
    assert line.get_window_extent().x1 <= figure.bbox.x1
