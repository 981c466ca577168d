"""Where machine code cannot be kept, a run compiles for itself and says so in one line."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys

import pytest

from subzero.jit import machine_code

NOT_KEPT = "cannot be kept"


def a_file(base):
    base.parent.mkdir()
    base.write_text("mine")


def in_a_file(base):
    base.parent.write_text("mine")


def nowhere(base):
    base.parent.symlink_to("/proc/none/such")


def loop(base):
    base.parent.symlink_to(base.parent)


@pytest.mark.parametrize("make", [a_file, in_a_file, nowhere, loop])
def test_without_a_folder_it_runs_and_says_so_in_one_line(run, base, make):
    make(base)
    for _ in range(2):
        loaded, said = run()
        assert not loaded
        assert NOT_KEPT in said
        assert said.count("\n") == 1
        assert "SUBZERO_CACHE_DIR" in said


def test_without_a_home_it_runs_and_says_so(run, monkeypatch):
    for name in ("SUBZERO_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)

    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(machine_code.Path, "home", homeless)
    loaded, said = run()
    assert not loaded
    assert NOT_KEPT in said
    assert said.count("\n") == 1


def test_a_full_disk_stops_keeping_and_nothing_else(run, base):
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limit[1]))
        loaded, said = run()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, before)
    assert not loaded
    assert os.strerror(errno.EFBIG) in said
    assert said.count("\n") == 1
    assert not [path for path in base.rglob("*") if path.is_file()]
    assert run() == (False, "")
    assert run() == (True, "")


def read_only(monkeypatch):
    """Let nothing be made or changed, as on a read-only image; root may write everywhere else."""

    def refuse(*_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    for place, name in ((machine_code.tempfile, "mkstemp"), (os, "mkdir"), (os, "utime"), (os, "replace")):
        monkeypatch.setattr(place, name, refuse)


def test_a_read_only_cache_is_read_and_nothing_is_said(run, base, monkeypatch):
    run()
    read_only(monkeypatch)
    assert run() == (True, "")


def test_a_read_only_cache_without_the_code_says_so_in_one_line(run, kept, monkeypatch):
    run()
    kept().unlink()
    read_only(monkeypatch)
    loaded, said = run()
    assert not loaded
    assert os.strerror(errno.EROFS) in said
    assert said.count("\n") == 1


def test_a_process_that_can_keep_nothing_runs_and_says_one_line(tmp_path):
    """A whole process, with several functions of two packages, whose cache folder is a file."""
    (tmp_path / "file").touch()
    script = "from vehicle import initial_state; from cable.moving_end.time_loop import *; print(initial_state()[3])"
    environment = os.environ | {"SUBZERO_CACHE_DIR": str(tmp_path / "file")}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment,
                          check=False)  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "1.0\n")
    assert done.stderr.count("\n") == 1
    assert NOT_KEPT in done.stderr
