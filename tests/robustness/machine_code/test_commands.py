"""Whole commands: compiling is announced when something is compiled; killed, and with a damaged cache, they give the
same numbers.
"""

from __future__ import annotations

import importlib.util
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from subzero.cli import progress
from subzero.jit import machine_code
from subzero.jit.machine_code import OTHERS, home_of

DAMAGED = "damaged"
NOT_KEPT = "cannot be kept"


def test_compiling_is_announced_when_something_is_compiled_and_only_then(run, kept, tiny, capsys):
    run()
    path = kept()

    def announced():
        home_of.cache_clear()
        machine_code._told.clear()
        with progress.progress_bar("Simulating"):
            spec = importlib.util.spec_from_file_location("tiny", tiny)
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            module.scaled(2.0)
            module.scaled(2)
        return capsys.readouterr().err.count("Compiling what is not compiled yet")

    assert announced() == 1  # for an integer
    assert announced() == 0
    for other in path.parent.iterdir():
        other.write_bytes(b"")
    assert announced() == 1  # code is really there, not only its file
    for other in path.parent.iterdir():
        other.unlink()
    assert announced() == 1  # … and not only its folder
    path.parent.rename(path.parent.with_name(f"{OTHERS}-{'0' * 12}"))
    assert announced() == 1  # … nor that of other sources
    assert announced() == 0


COMMAND = "import sys; from subzero.cli.app import main; sys.exit(main(sys.argv[1:]))"


def heed_again():
    """Let a command heed SIGINT though this process was started with it ignored, as jobs in the background are."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def command(*words, here, **environment):
    return subprocess.Popen(
        [sys.executable, "-c", COMMAND, *words], cwd=here, env=os.environ | environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heed_again,
    )  # fmt: skip


def files_of(base):
    return [path for path in Path(base).rglob("*") if path.is_file()]


@pytest.mark.slow
def test_commands_that_are_killed_while_they_compile_and_run_at_once_leave_a_sound_cache(tmp_path, harms):
    """Two commands at once, killed again and again; then two that run to the end; then all files are damaged."""
    cache, rng = tmp_path / "cache", random.Random(5)

    def both(name):
        return [
            command(
                "simulate",
                "fig6",
                "--untethered",
                "--out",
                f"{name}{k}",
                here=tmp_path,
                SUBZERO_CACHE_DIR=str(cache),
            )
            for k in range(2)
        ]

    for k in range(4):
        running = both(f"killed{k}")
        time.sleep(rng.uniform(5.0, 15.0))
        for one in running:
            one.send_signal(rng.choice((signal.SIGKILL, signal.SIGINT)))
        for one in running:
            one.communicate(timeout=60)
    for one in both("whole"):
        said = one.communicate(timeout=600)[1]
        assert said.count("Compiling") <= 1, "once, and a count of functions that may take several lines"
        assert DAMAGED not in said
        assert one.returncode == 0
    csv = (tmp_path / "whole0/untethered.csv").read_bytes()
    for path in files_of(cache):
        path.write_bytes(rng.choice(list(harms.values()))(path.read_bytes(), rng))
    one = command(
        "simulate", "fig6", "--untethered", "--out", "mended", here=tmp_path, SUBZERO_CACHE_DIR=str(cache)
    )
    said = one.communicate(timeout=600)[1]
    assert one.returncode == 0, said
    assert said.count(DAMAGED) == 1
    one = command(
        "simulate", "fig6", "--untethered", "--out", "warm", here=tmp_path, SUBZERO_CACHE_DIR=str(cache)
    )
    assert one.communicate(timeout=600)[1] == ""
    assert (tmp_path / "mended/untethered.csv").read_bytes() == csv
    assert (tmp_path / "warm/untethered.csv").read_bytes() == csv


@pytest.mark.slow
def test_commands_run_without_a_cache_with_the_same_numbers(tmp_path):
    (tmp_path / "file").touch()
    for name, cache in (("kept", tmp_path / "cache"), ("forgotten", tmp_path / "file")):
        one = command(
            "simulate", "fig6", "--untethered", "--out", name, here=tmp_path, SUBZERO_CACHE_DIR=str(cache)
        )
        said = one.communicate(timeout=600)[1]
        assert one.returncode == 0, said
        assert said.count(NOT_KEPT) == (name == "forgotten")
    csv = [(tmp_path / name / "untethered.csv").read_bytes() for name in ("kept", "forgotten")]
    assert csv[0] == csv[1]
