"""``subzero manoeuvre`` and ``subzero autopilot`` deliver files and a table, and refuse in one line.

Verifies: exit codes, files, the indices of summary.json against those of the Python functions. Tolerance: none.
"""

import json
import subprocess
import sys

import pytest

import scenarios
from subzero import autopilot
from subzero.cli.app import FINE, MISTAKE, STOPPED, main

FILES = {
    "manoeuvre.png",
    "report.html",
    "summary.json",
    "tethered.csv",
    "tethered.nc",
    "untethered.csv",
    "untethered.nc",
}


def test_a_manoeuvre_delivers_both_runs_and_their_indices(tmp_path, capsys):
    assert main(["manoeuvre", "zigzag", "--rudder", "12", "--out", str(tmp_path / "z")]) == FINE
    assert {path.name for path in (tmp_path / "z").iterdir()} == FILES
    summary = json.loads((tmp_path / "z" / "summary.json").read_text())
    _, expected = autopilot.manoeuvre("zigzag", size=12.0, tethered=False)
    assert summary["untethered"]["indices"] == expected
    reported = capsys.readouterr().out
    assert "overshoot 1 [degree]" in reported
    assert "tethered" in reported


def test_a_manoeuvre_below_the_sea_bed_warns_and_under_strict_exits_with_3(tmp_path, capsys):
    """A bed half a metre deep below a vehicle that starts at one metre."""
    text = scenarios.path("fig6").read_text(encoding="utf-8").replace("sea_bed_m = 0.0", "sea_bed_m = 0.5")
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    words = ["manoeuvre", "zigzag", "--scenario", str(tmp_path / "mine.toml"), "--out", str(tmp_path / "z")]
    assert main([*words, "--strict"]) == STOPPED
    said = capsys.readouterr()
    assert " ".join(said.out.split()).count("The vehicle is below the sea bed at 0.5 m from 0 s on") == 2
    assert "Warnings under --strict: " in said.err
    assert {path.name for path in (tmp_path / "z").iterdir()} == FILES


@pytest.mark.slow
def test_an_autopilot_delivers_a_step(tmp_path, capsys):
    words = [
        "autopilot",
        "heading_step",
        "--autopilot",
        "lqr",
        "--feed-forward",
        "formula",
        "--out",
        str(tmp_path / "s"),
    ]
    assert main(words) == FINE
    assert {path.name for path in (tmp_path / "s").iterdir()} == FILES
    said = capsys.readouterr().out
    assert "Heading step: autopilot lqr, the cable fed forward by formula" in said
    assert "rise time [s]" in said


@pytest.mark.parametrize(
    "words,reported",
    [
        (["manoeuvre", "zigzagg"], "Did you mean 'zigzag'"),
        (["manoeuvre", "zigzag", "--planes", "5"], "Use --rudder"),
        (["manoeuvre", "vertical_zigzag", "--rudder", "5"], "Use --planes"),
        (["manoeuvre", "zigzag", "--scenario", "fig66"], "fig6"),
        (["autopilot", "depth"], "Did you mean 'depth_step'"),
        (["autopilot", "heading_step", "--feed-forward", "all"], "Allowed: none, formula, model"),
    ],
)
def test_mistakes_are_told_and_write_nothing(words, reported, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(words) == MISTAKE
    assert reported in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words", [["manoeuvre", "--help"], ["autopilot", "--help"], ["autopilot", "x", "--scenario", "fig66"]]
)
def test_help_imports_nothing_heavy(words):
    heavy = ("numba", "xarray", "matplotlib", "scipy", "netCDF4", "control", "vehicle", "cable", "gymnasium")
    code = f"""if True:
        import sys
        from subzero.cli.app import main
        main({words!r})
        print("LOADED", *(name for name in {heavy!r} if name in sys.modules))
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.rstrip().endswith("LOADED"), done.stdout[-200:]


@pytest.mark.parametrize("command", ["rudder_command", "stern_plane_port_command", "propeller_command"])
def test_the_headlines_of_the_figure_are_on_the_sheet(command):
    from subzero.cli.write_flights import picture

    run, _ = autopilot.manoeuvre("crash_stop", tethered=False)
    figure = picture({"untethered": run}, "title", "heading", command)
    assert figure.get_tightbbox().x1 <= figure.get_figwidth()
