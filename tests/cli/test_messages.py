"""A mistake is answered by one clean message, exit code 2, and nothing on the disk."""

from __future__ import annotations

import os
import re
import sys

import pytest

from subzero.cli.app import MISTAKE, main

MESSAGES = {
    "simulat fig6": 'Unknown command "simulat". Did you mean "simulate"? '
    "Available commands: list, new, show, validate, simulate, compare, plot, explore, ...\nTry 'subzero --help'.",
    "simulate": "subzero simulate needs SCENARIO, as in: subzero simulate fig6\nTry 'subzero simulate --help'.",
    "autopilot": "subzero autopilot needs NAME, as in: subzero autopilot heading_step\n"
    "Try 'subzero autopilot --help'.",
    "simulate fig6 --oot x": "Unknown option: --oot. Did you mean --out?\nTry 'subzero simulate --help'.",
    "simulate fig6 --set x=1": "Unknown option: --set.\nTry 'subzero simulate --help'.",
    "compare fig6 --untethered": "Unknown option: --untethered.\nTry 'subzero compare --help'.",
    "compare fig6 fig5": "Unexpected argument: fig5.\nTry 'subzero compare --help'.",
    "compare fig6 --out": "--out needs a value.\nTry 'subzero compare --help'.",
    "compare fig66": "The scenario cannot be used (1 problem):\n"
    "  fig66: there is no such scenario. Did you mean 'fig6'? Or give the path of a TOML file.",
    "compare fig6 --measured no.csv": "There is no measured record no.csv. Give the path of a CSV file.",
    "compare fig6 --measured here": "The measured record here cannot be read: "
    "this is a folder, not a file. Name a file in it.",
    "simulate fig6 --commands no.csv": "The scenario cannot be used (1 problem):\n"
    "  no.csv: there is no such file. Check the path.",
    "simulate fig6 --motion no.csv": "The scenario cannot be used (1 problem):\n"
    "  no.csv: there is no such file. Check the path.",
    "simulate fig6 --every 0.15": "The scenario cannot be used (1 problem):\n"
    "  --every: found 0.15, but it must be a whole number of steps cable_step = 0.1. Nearest: 0.1 or 0.2.",
    "simulate fig6 --out file": "The output folder file cannot be written: file is a file, not a folder. "
    "Give another one with --out DIR.",
    "simulate fig6 --out file/deep/er": "The output folder file/deep/er cannot be written: file is a file, "
    "not a folder. Give another one with --out DIR.",
}


def shortened(message):
    """Leave out the commands behind the first three: which there are is told by `subzero --help` (test_help)."""
    return re.sub(r"(Available commands: \w+, \w+, \w+), [^.]*\.\n", r"\1, ….\n", message)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working folder with a file and a folder in it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("mine")
    (tmp_path / "here").mkdir()
    return tmp_path


@pytest.mark.parametrize("words", MESSAGES)
def test_a_mistake_gets_one_message_and_exit_code_2(words, here, rails, capsys):
    assert main(words.split()) == MISTAKE
    answer = capsys.readouterr()
    assert shortened(answer.err) == MESSAGES[words] + "\n"
    assert answer.out == ""


@pytest.mark.parametrize("words", MESSAGES)
def test_a_mistake_simulates_nothing_and_writes_nothing(words, here, rails):
    main(words.split())
    assert rails == []
    assert sorted(path.name for path in here.rglob("*")) == ["file", "here"]
    assert (here / "file").read_text() == "mine"


def test_a_folder_that_cannot_be_written_is_told_before_the_run(here, rails, capsys, monkeypatch):
    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.mkdir", refuse)
    assert main(["simulate", "fig6", "--out", "here"]) == MISTAKE
    assert capsys.readouterr().err == (
        "The output folder here cannot be written: Permission denied. Give another one with --out DIR.\n"
    )
    assert rails == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_refused(here, rails, capsys):
    (here / "here").chmod(0o555)
    assert main(["simulate", "fig6", "--out", "here"]) == MISTAKE
    assert "Permission denied" in capsys.readouterr().err


def test_a_bug_of_ours_keeps_its_traceback(here, rails, monkeypatch):
    def broken(*_args, **_kwargs):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(sys.modules["subzero.simulation.run"], "simulate", broken)
    with pytest.raises(ZeroDivisionError):
        main(["simulate", "fig6"])
    assert not (here / "fig6").exists()


def test_an_interrupted_run_leaves_nothing(here, rails, monkeypatch, capsys):
    def interrupted(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules["subzero.simulation.run"], "simulate", interrupted)
    assert main(["simulate", "fig6"]) == 130
    assert capsys.readouterr().err.endswith("Interrupted; nothing was written.\n")
    assert sorted(path.name for path in here.iterdir()) == ["file", "here"]
