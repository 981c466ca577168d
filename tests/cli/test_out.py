"""Where results go: refused before the run if they cannot go there, never at the cost of something good."""

from __future__ import annotations

import dataclasses
import json
import resource
import sys
import threading

import pytest

from subzero.cli import interrupts
from subzero.cli.app import FINE, INTERRUPTED, MISTAKE, STOPPED, main
from subzero.files.read_file import INCOMPLETE


def simulate(out):
    return main(["simulate", "fig6", "--out", str(out)])


def nowhere(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "gone")
    return tmp_path / "link"


def a_loop(tmp_path):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    return tmp_path / "loop" / "in"


def a_file(tmp_path):
    (tmp_path / "file").write_text("mine")
    return tmp_path / "file"


def in_a_file(tmp_path):
    return a_file(tmp_path) / "deep" / "er"


def taken(tmp_path):
    (tmp_path / "out" / "fig6.png").mkdir(parents=True)
    return tmp_path / "out"


UNUSABLE = {
    "nowhere": (nowhere, "link is a link to something that is not there"),
    "loop": (a_loop, "loop is a link to something that is not there"),
    "file": (a_file, "file is a file, not a folder"),
    "in a file": (in_a_file, "file is a file, not a folder"),
    "taken": (taken, "'fig6.png' in it is a folder, where a file of this name has to go"),
    "no place": (lambda _: "/proc/here", "No such file or directory"),
    "too long": (lambda here: here / ("x" * 300), "File name too long"),
    "no text": (lambda here: here / "\udcff", "is no name in UTF-8, as netCDF needs one"),
}


@pytest.mark.parametrize("what", UNUSABLE)
def test_an_unusable_folder_is_refused_before_the_run(what, tmp_path, rails, capsys):
    make, why = UNUSABLE[what]
    assert simulate(make(tmp_path)) == MISTAKE
    said = capsys.readouterr().err
    assert why in said
    assert said.endswith("Give another one with --out DIR.\n")
    assert said.count("\n") == 1
    assert rails == []


@pytest.mark.long
def test_a_folder_that_cannot_be_known_before_stops_all_files(tmp_path, rails, monkeypatch, capsys):
    monkeypatch.setattr("subzero.results.netcdf_csv.RUN_FILES", ())
    assert simulate(taken(tmp_path)) == MISTAKE
    assert "'fig6.png' in it is a folder" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["fig6.png"]


@pytest.fixture
def stops(monkeypatch, make_run):
    def stop(_trial, *, tethered, progress):
        return make_run(outcome="stopped", samples=31)

    return lambda: monkeypatch.setattr(sys.modules["subzero.simulation.run"], "simulate", stop)


def outcome(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))["tethered"]["outcome"]


@pytest.mark.long
def test_a_run_that_stops_never_replaces_one_that_did_not(tmp_path, rails, stops, capsys):
    assert simulate(tmp_path) == FINE
    good = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    stops()
    capsys.readouterr()
    assert simulate(tmp_path) == STOPPED
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == good
    assert outcome(tmp_path / "stopped") == "stopped"
    said = "".join(capsys.readouterr().out.split())  # a terminal breaks a long path anywhere
    assert "stopped/:attitude.png" in said
    assert "werenotchanged." in said
    assert simulate(tmp_path) == STOPPED  # again, in place of the other failure
    assert {path.name for path in tmp_path.iterdir()} == {*good, "stopped"}


@pytest.mark.long
def test_a_run_that_stops_replaces_one_that_stopped(tmp_path, rails, stops, make_run):
    stops()
    assert simulate(tmp_path) == STOPPED
    assert simulate(tmp_path) == STOPPED
    assert not (tmp_path / "stopped").exists()


@pytest.mark.long
def test_a_full_disk_is_one_message_and_leaves_the_old_result(tmp_path, rails, capsys):
    assert simulate(tmp_path) == FINE
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    capsys.readouterr()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for most in (1_000, 20_000, 60_000, 100_000):
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, hard))
        try:
            code = simulate(tmp_path)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert code == MISTAKE
        assert "cannot be written: " in capsys.readouterr().err
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def killed(folder):
    """Leave what a command leaves that is killed while it replaces files."""
    (folder / ".subzero-1-abc" / "new").mkdir(parents=True)
    (folder / ".subzero-1-abc" / "new" / "tethered.csv").write_text("time_s,depth_m\n0,9\n1,9\n")
    (folder / "tethered.csv").write_text("time_s,depth_m\n0,1\n1,2\n")
    (folder / INCOMPLETE).write_text(json.dumps({"files": ["summary.json", "tethered.csv"]}))


def test_a_result_that_was_being_replaced_is_refused_as_a_record(tmp_path, rails, capsys):
    killed(tmp_path)
    assert main(["compare", "fig6", "--measured", str(tmp_path / "tethered.csv")]) == MISTAKE
    message = capsys.readouterr().err
    assert "a command was killed while it wrote" in message
    assert "Run the command again with --out" in message
    assert rails == []


@pytest.mark.long
def test_files_are_in_doubt_until_a_command_writes_them_anew(tmp_path, rails):
    killed(tmp_path)
    assert main(["simulate", "fig6", "--untethered", "--out", str(tmp_path)]) == FINE
    assert main(["compare", "fig6", "--measured", str(tmp_path / "tethered.csv")]) == MISTAKE
    assert simulate(tmp_path) == FINE
    assert not (tmp_path / INCOMPLETE).exists()


def test_a_living_command_keeps_its_hidden_folder(tmp_path):
    from subzero.results.netcdf_csv import open_output_folder

    with open_output_folder(tmp_path / "one") as first:
        with open_output_folder(tmp_path / "two") as second:
            (second.path / "b").write_text("b")
        (first.path / "a").write_text("a")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "two"]


def test_a_full_disk_is_told_whoever_writes(tmp_path):
    from subzero.errors import UserError
    from subzero.results.netcdf_csv import open_output_folder

    def write():
        with open_output_folder(tmp_path / "out") as output_folder:
            (output_folder.path / "full").symlink_to("/dev/full")
            (output_folder.path / "full").write_text("x" * 100_000)

    with pytest.raises(UserError, match="No space left on device"):
        write()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_an_interrupt_after_the_last_move_is_told_as_it_is(tmp_path, rails, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("subzero.cli.write_results.print_results", interrupted)
    assert simulate(tmp_path) == INTERRUPTED
    assert capsys.readouterr().err.endswith(f"Interrupted; all files were written to {tmp_path}.\n")


@pytest.mark.long
def test_a_command_says_nothing_of_a_former_one_in_the_same_process(tmp_path, rails, monkeypatch, capsys):
    """What an interrupted sweep had kept was told of the next command, whose errors would have passed as well."""
    interrupts.set_exit_message(lambda: "3 of 6 members are kept")
    monkeypatch.setattr(interrupts, "_interrupted", threading.Event())
    interrupts._interrupted.set()

    def broken(*_, **__):
        raise RuntimeError("a bug")

    monkeypatch.setattr("subzero.cli.write_results.print_results", broken)
    with pytest.raises(RuntimeError, match="a bug"):
        simulate(tmp_path)
    interrupts.print_interrupted()
    assert "members" not in capsys.readouterr().err


def test_control_characters_of_a_description_are_shown_escaped(tmp_path):
    import scenarios
    import subzero

    text = scenarios.path("fig6").read_text(encoding="utf-8")
    lines = [r'description = "\u001b[31mred\u0007"' if line.startswith("description") else line
             for line in text.splitlines()]  # fmt: skip
    (tmp_path / "mine.toml").write_text("\n".join(lines), encoding="utf-8")
    trial = scenarios.load(tmp_path / "mine.toml")
    assert trial.description == "\x1b[31mred\x07"
    run = subzero.simulate(dataclasses.replace(trial, duration=0.5), tethered=False)
    assert run.attrs["title"] == r"\x1b[31mred\x07"
