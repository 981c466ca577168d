"""The numbers that are printed and stored are those of the run, checked by hand."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from rich.console import Console

from subzero.cli.progress import ProgressBar
from subzero.results.netcdf_csv import OutputFolder, write_csv, write_summary
from subzero.results.summary import summarise, summary_of
from subzero.results.tables import show


@pytest.fixture
def run(make_run):
    """Three samples whose numbers can be read off: 5 m across, then 12 m down; the pull peaks in between."""
    values = {
        "north": [0.0, 3.0, 3.0],
        "east": [0.0, 4.0, 4.0],
        "depth": [0.0, 0.0, 12.0],
        "heading": [0.0, 90.0, 370.0],
        "surge_speed": [0.0, 2.0, 1.0],
        "cable_force_forward": [0.0, -3.0, -1.0],
        "cable_force_down": [0.0, 4.0, 0.0],
        "cable_moment_yaw": [0.0, 0.0, -2.0],
        "cable_length": [0.0, 5.0, 17.0],
        "energy_propeller_work": [0.0, 50.0, 200.0],
        "energy_residual": [0.0, 1.0, -0.5],
    }
    return make_run(samples=3).assign({name: ("time", np.array(column)) for name, column in values.items()})


def test_a_summary_says_what_happened_and_when(run):
    summary = summarise(run)
    expected = {
        "time_at_end_s": 0.2, "peak_speed_m_s": 2.0, "time_of_peak_speed_s": 0.1, "speed_at_end_m_s": 1.0,
        "heading_at_end_deg": 370.0, "depth_at_end_m": 12.0, "path_length_m": 5.0 + 12.0,
        "cable_length_at_end_m": 17.0, "largest_cable_force_N": 5.0, "time_of_largest_cable_force_s": 0.1,
        "largest_cable_moment_N_m": 2.0, "time_of_largest_cable_moment_s": 0.2,
    }  # fmt: skip
    assert {key: summary[key] for key in expected} == pytest.approx(expected)
    assert summary["energy"]["unexplained_share"] == pytest.approx(0.5 / 200.0)


def test_a_summary_says_how_far_to_trust_the_cable(run, make_run):
    run["newton_iterations"] = ("time", np.array([0, 3, 7]))
    run["energy_cable_loss"] = ("time", np.array([0.0, 10.0, 40.0]))
    expected = {
        "closure_error_m": 1e-15, "largest_courant_number": 0.5, "newton_iterations": 7,
        "smallest_tension_N": float(np.nanmin(run["cable_node_tension"].values)),
        "energy_residual": 0.5 / (200.0 + 40.0),
    }  # fmt: skip
    assert summarise(run)["diagnostics"] == pytest.approx(expected)
    assert summarise(make_run(tethered=False))["diagnostics"] is None


def test_the_table_shows_the_runs_side_by_side(run):
    out = io.StringIO()
    show(summary_of({"tethered": run, "untethered": run.assign(surge_speed=0.5 * run["surge_speed"])}, None),
         Console(file=out, width=100), whole=True)  # fmt: skip
    rows = [" ".join(line.split()) for line in out.getvalue().splitlines()]
    assert "tethered untethered" in rows
    for row in (
        "outcome completed, 0.2 s completed, 0.2 s",
        "warnings 0 0",
        "peak speed [m/s] 2.000 at 0.1 s 1.000 at 0.1 s",
        "speed at the end [m/s] 1.000 0.500",
        "heading at the end [degree] 370.00 370.00",
        "path length [m] 17.00 17.00",
        "largest cable force [N] 5.0000 at 0.1 s 5.0000 at 0.1 s",
        "largest cable moment [N m] 2.0000 at 0.2 s 2.0000 at 0.2 s",
        "work of the propulsion [J] 200.000 200.000",
        "unexplained share 2.5e-03 2.5e-03",
        "closure error [m] 1.0e-15 1.0e-15",
        "largest Courant number 0.50 0.50",
        "Newton iterations 4 4",
    ):
        assert row in rows, rows


def test_what_only_a_numerical_analyst_reads_is_printed_if_asked_for(run):
    out = io.StringIO()
    show(summary_of({"tethered": run}, None), Console(file=out, width=100))
    assert "peak speed" in out.getvalue()
    assert "unexplained share" in out.getvalue()
    assert "Courant" not in out.getvalue()


def test_what_does_not_exist_is_null_in_json_and_empty_in_csv(run, tmp_path):
    run = run.assign(battery_voltage=("time", np.full(3, np.nan)), heading=("time", np.full(3, np.nan)))
    write_summary(summary_of({"tethered": run}, None), OutputFolder(tmp_path, tmp_path))
    write_csv(run, tmp_path / "run.csv")
    assert json.loads((tmp_path / "summary.json").read_text())["tethered"]["heading_at_end_deg"] is None
    header, first, *_ = (tmp_path / "run.csv").read_text().splitlines()
    assert first.split(",")[header.split(",").index("battery_voltage_V")] == ""


def test_a_comparison_tells_its_progress_once_from_0_to_1(rails, make_run, monkeypatch):
    import sys

    def simulate(_trial, *, tethered, progress):
        for fraction in (0.5, 1.0):
            progress(fraction)
        return make_run(tethered=tethered)

    monkeypatch.setattr(sys.modules["subzero.simulation.run"], "simulate", simulate)
    from subzero.simulation.comparison import compare

    reported: list[float] = []
    comparison = compare("fig6", progress=reported.append)
    assert reported == [0.25, 0.5, 0.75, 1.0]
    assert (comparison.tethered.attrs["tethered"], comparison.untethered.attrs["tethered"]) == (1, 0)
    assert comparison.summary()["untethered"]["largest_cable_force_N"] == 0.0
    assert comparison.fits() == {}


@pytest.mark.parametrize(
    "seconds, is_terminal, shown", [(0.5, True, False), (2.0, True, True), (2.0, False, False)]
)
def test_a_bar_is_shown_on_a_terminal_for_what_takes_over_a_second(seconds, is_terminal, shown, monkeypatch):
    now = [0.0]
    monkeypatch.setattr("subzero.cli.progress.monotonic", lambda: now[0])
    out = io.StringIO()
    with ProgressBar("Simulating fig6", Console(file=out, force_terminal=is_terminal)) as progress:
        now[0] = seconds
        progress(0.4)
    assert ("Simulating fig6" in out.getvalue()) is shown
