"""Commands that look before and after a run: list, new, show, validate, plot; help with examples; --json, --quiet, -v.

Runs are on rails (conftest) or none are needed. What is printed is held to the files it speaks of.
"""

from __future__ import annotations

import json
import shlex
import tomllib
from pathlib import Path

import pytest

import scenarios
from scenarios.files import shipped, shipped_path
from subzero.cli import EXAMPLES
from subzero.cli.app import FINE, MISTAKE, app, main

STRANGE = "<b>x</b> $\\\\frac$ [bold]Zürich[/bold] 日本 " + "z" * 300
PLANES = ("stern_plane_port_command_deg", "stern_plane_starboard_command_deg")
WRITTEN = ",".join(("time_s", "propeller_command_rps", "rudder_command_deg", *PLANES))


def said(capsys, *words, code=FINE):
    """Run a command; return what it printed on standard output and error."""
    assert main(words) == code
    return capsys.readouterr()


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


# Help.


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_the_help_of_every_command_has_an_example_that_is_understood(name, capsys):
    shown = said(capsys, name, "--help").out
    for line in EXAMPLES[name]:
        assert line in shown
        words = shlex.split(line.partition(">")[0])
        command, bound, _ = app.parse_args(words[1:], exit_on_error=False, print_error=False)
        assert callable(command)
        assert bound.arguments or name in ("list", "doctor", "warm")


def test_every_command_has_examples():
    assert {name for name in app if not name.startswith("-")} == set(EXAMPLES)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_every_command(shell, capsys):
    script = said(capsys, "completion", shell).out
    assert all(name in script for name in EXAMPLES)
    assert "untethered" in script


# Files.


def test_new_makes_a_file_that_is_valid_and_leaves_one_that_exists(here, capsys):
    reported = said(capsys, "new", "my_trial.toml").out
    assert "subzero compare my_trial.toml" in reported
    assert scenarios.load("my_trial.toml").commands is not None
    before = (here / "my_trial.toml").read_text()
    assert "exists and is left alone" in said(capsys, "new", "my_trial.toml", code=MISTAKE).err
    assert (here / "my_trial.toml").read_text() == before


@pytest.mark.parametrize("kind", ["trials", "vehicles", "cables"])
def test_everything_shipped_can_be_the_beginning_of_a_file_that_is_valid(kind, here, capsys):
    for name in shipped(kind):
        said(capsys, "new", f"{name}.toml", "--like", name)
        reported = said(capsys, "validate", f"{name}.toml").out
        assert reported.startswith(f"{name}.toml is a valid {kind.removesuffix('s')}")


@pytest.mark.parametrize(
    "words, why",
    [
        (["new", "mine"], "must end in .toml"),
        (["new", "no/where.toml"], "No such file or directory"),
        (["new", "mine.toml", "--like", "fig7"], "Did you mean 'fig6'?"),
        (["new", "mine.toml", "--like", "other.toml"], "Copy that file itself"),
        (["show", "umbilicl"], "Did you mean 'umbilical'?"),
        (["validate", "none.toml"], "there is no such file"),
        (["validate", "none.csv"], "there is no such file"),
        (["plot", "none.nc"], "there is no such file"),
    ],
)
def test_what_cannot_be_is_refused_and_leaves_nothing(words, why, here, capsys):
    reported = said(capsys, *words, code=MISTAKE)
    assert why in reported.err
    assert reported.out == ""
    assert list(here.iterdir()) == []


def test_show_tells_every_number_of_a_part_with_its_range_and_source(here, capsys):
    table = tomllib.loads(shipped_path("cables", "table1").read_text(encoding="utf-8"))
    reported = json.loads(said(capsys, "show", "table1", "--json").out)
    shown = {one["name"]: one for one in reported["numbers"]}
    for section, leaves in table.items():
        for key, leaf in leaves.items():
            one = shown.pop(f"{section}.{key}")
            assert (one["values"], one["unit"], [one["low"], one["high"]], one["source"]) == (
                [leaf["value"]], leaf["unit"], leaf["range"], leaf["source"]
            )  # fmt: skip
    assert not shown
    words = said(capsys, "show", "table1").out
    assert "0.0049 kg/m  0.004 … 0.006\n      paper: m, Table 1" in words


def test_show_of_a_trial_has_its_values_and_says_where_the_rest_stands(here, capsys):
    reported = said(capsys, "show", "fig6").out
    assert "heading_deg" in reported
    assert "27 degree  -360 … 360\n      heading, clockwise from north" in reported
    assert "subzero show subzero2" in reported
    assert max(map(len, reported.splitlines())) <= 80


def test_validate_tells_all_problems_with_their_lines(here, capsys):
    text = scenarios.path("fig6").read_text(encoding="utf-8")
    (here / "bad.toml").write_text(
        text.replace("= 30.0 ", "= -30.0 ").replace("depth_m = 1.0", "deth_m = 1.0")
    )
    reported = said(capsys, "validate", "bad.toml", code=MISTAKE).err
    assert "2 problems" in reported
    assert "line 18" in reported or "line 1" in reported
    assert "depth_m" in reported


@pytest.mark.parametrize(
    "text, kind",
    [
        ("time_s,surge_speed_m_s\n0,0.0\n1,0.5\n", "record: 2 samples of surge_speed, to 1 s"),
        ("time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n0,1,0,0,0\n1,1,0,0,0\n",
         "file of commands: 2 rows, to 1 s"),
    ],
)  # fmt: skip
def test_validate_knows_records_and_commands(text, kind, here, capsys):
    (here / "mine.csv").write_text(text)
    assert said(capsys, "validate", "mine.csv").out == f"mine.csv is a valid {kind}\n"


def test_validate_knows_a_sweep(here, capsys):
    (here / "sweep.toml").write_text(
        (scenarios.path("fig6").parents[1] / "sweeps" / "cable_and_current.toml").read_text()
    )
    assert "sweep.toml is a valid sweep: 200 runs" in said(capsys, "validate", "sweep.toml").out


def test_names_with_markup_and_mathematics_are_text(here, capsys):
    text = scenarios.path("fig6").read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith("description"))
    (here / "strange.toml").write_text(text.replace(line, f'description = "{STRANGE}"'), encoding="utf-8")
    for command in ("validate", "show"):
        reported = "".join(said(capsys, command, "strange.toml").out.split())
        assert "<b>x</b>$\\frac$[bold]Zürich[/bold]日本" in reported


# Commands as a run writes them.


def test_the_file_that_a_run_writes_is_a_file_of_commands(here):
    (here / "run.csv").write_text(f"{WRITTEN},depth_m,heading_deg\n0,25,4.8,0,0,1,27\n0.1,25,4.8,1,2,1,27\n")
    text = scenarios.path("fig6").read_text(encoding="utf-8").replace("duration_s = 30.0", "duration_s = 0.2")
    (here / "mine.toml").write_text(text, encoding="utf-8")
    commands = scenarios.load("mine.toml", commands_csv="run.csv").commands
    assert commands.values[:, 0].tolist() == [25.0, 25.0]
    assert commands.values[1, 3] > commands.values[1, 2] > 0.0


def test_two_columns_for_one_command_are_refused(here, capsys):
    header = f"{WRITTEN},rudder_deg"
    (here / "run.csv").write_text(f"{header}\n0,25,4.8,0,0,1\n30,25,4.8,0,0,1\n")
    assert (
        "this column stands twice"
        in said(capsys, "simulate", "fig6", "--commands", "run.csv", code=MISTAKE).err
    )


def test_the_rule_of_the_last_row_is_said_the_same_everywhere():
    rule = "a row of a file holds until the next, the last one for one sampling interval more, at most 1 s"
    root = Path(__file__).parents[2]
    for page in ("docs/trials.md", "scenarios/trials/fig6.toml", "scenarios/samples.py"):
        words = " ".join((root / page).read_text(encoding="utf-8").replace("\n#", "\n").lower().split())
        assert rule in words, page


# How a command speaks.


@pytest.mark.long
def test_json_is_one_object_and_it_is_the_summary(here, rails, capsys):
    reported = said(capsys, "compare", "fig6", "--json")
    summary = json.loads(reported.out)
    on_disk = json.loads((here / "fig6" / "summary.json").read_text(encoding="utf-8"))
    assert {key: summary[key] for key in on_disk} == on_disk
    assert summary["folder"] == "fig6"
    assert set(summary["files"]) == {path.name for path in (here / "fig6").iterdir()}


@pytest.mark.long
def test_quiet_prints_nothing_and_writes_all(here, rails, capsys):
    reported = said(capsys, "simulate", "fig6", "--quiet")
    assert (reported.out, reported.err) == ("", "")
    assert (here / "fig6" / "tethered.nc").exists()


@pytest.mark.long
def test_verbose_says_what_runs_and_how_long_it_took(here, rails, capsys):
    reported = said(capsys, "simulate", "fig6", "-v")
    assert reported.err.startswith("subzero ")
    assert " s in all." in reported.err
    assert "Wrote fig6/" in reported.out


def test_a_mistake_is_told_also_quietly(here, capsys):
    assert "there is no such scenario" in said(capsys, "simulate", "fig66", "--quiet", code=MISTAKE).err


# Figures of a file.


@pytest.mark.long
def test_plot_draws_what_is_asked_for_beside_the_run(here, rails, capsys):
    said(capsys, "simulate", "fig6", "--quiet")
    reported = said(capsys, "plot", "fig6/tethered.nc", "--what", "tension", "heading", "--format", "svg").out
    for name in ("tension", "heading"):
        assert f"tethered_{name}.svg" in reported
        assert (here / "fig6" / f"tethered_{name}.svg").read_text(encoding="utf-8").count("<svg") == 1
    reported = said(capsys, "plot", "fig6/tethered.nc", "--what", "tensoin", code=MISTAKE).err
    assert "Did you mean 'tension'?" in reported


# The scenario is positional everywhere.


@pytest.mark.parametrize("words", [
    ["manoeuvre", "zigzag", "fig66"], ["autopilot", "heading_step", "fig66"], ["challenge", "fig66"],
    ["diagnose", "fig66.toml", "record.csv"], ["simulate", "fig66"], ["compare", "fig66"],
])  # fmt: skip
def test_a_scenario_stands_in_its_place_without_a_name(words, here, capsys):
    reported = said(capsys, *words, code=MISTAKE).err
    assert "there is no such" in reported
    assert "fig66" in reported


def test_two_scenarios_are_refused(here, capsys):
    reported = said(capsys, "diagnose", "fig6", "zigzag", "record.csv", code=MISTAKE).err
    assert "One scenario is flown, and these are several: fig6, zigzag." in reported


def test_a_folder_named_after_the_scenario_does_not_stand_in_its_place(here, capsys):
    """`subzero compare fig6` leaves the folder fig6; the name beside a record is still the scenario."""
    (here / "fig6").mkdir()
    (here / "record.csv").write_text("time_s,surge_speed_m_s\n0,oops\n")
    reported = said(capsys, "diagnose", "fig6", "record.csv", code=MISTAKE).err
    assert "'oops' is not a number" in reported
