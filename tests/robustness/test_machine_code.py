"""What was compiled is kept for the next run, or not; a run goes on either way, with the same numbers.

Most tests compile one small function, `tiny.scaled`, several times in this process: each time as a new process would,
with nothing but the files to go by.
"""

from __future__ import annotations

import errno
import gc
import importlib.util
import os
import random
import resource
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from subzero import progress
from subzero.jit import machine_code
from subzero.jit.machine_code import CODE, HALF, KEPT, OTHERS, OUT_OF_USE_S, home_of
from subzero.jit.sources import Tree

TINY = """
from subzero.jit import compiled

@compiled
def scaled(x):
    return 3.0 * x + 0.5
"""
DAMAGED, NOT_KEPT, NOT_TRUSTED = "damaged", "cannot be kept", "is not used"
needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root may give files away")


@pytest.fixture
def tiny(tmp_path):
    """The file of a small function, outside our packages."""
    path = tmp_path / "tiny.py"
    path.write_text(TINY)
    return path


@pytest.fixture
def base(tmp_path, monkeypatch):
    """The folder of all machine code, which is not there yet."""
    base = tmp_path / "cache" / "inner"
    monkeypatch.setenv("SUBZERO_CACHE_DIR", str(base))
    return base


@pytest.fixture
def run(tiny, capsys):
    """Run the function as a new process would; gives whether it was loaded, and what was said."""

    def begin():
        machine_code._tree = Tree()
        home_of.cache_clear()
        machine_code._told.clear()
        machine_code._announcements.clear()
        spec = importlib.util.spec_from_file_location("tiny", tiny)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        capsys.readouterr()
        assert module.scaled(2.0) == 6.5
        return bool(module.scaled.stats.cache_hits), capsys.readouterr().err

    yield begin
    home_of.cache_clear()
    machine_code._told.clear()
    machine_code._announcements.clear()


def kept(base):
    """Return the one file that is kept."""
    (path,) = base.glob(f"{OTHERS}-*/*{CODE}")
    return path


def test_what_was_compiled_once_is_loaded_next_time(run, base):
    assert run() == (False, "")
    assert run() == (True, "")
    assert [path.suffix for path in base.rglob("*") if path.is_file()] == [CODE]


def test_an_edit_of_its_file_compiles_it_anew(run, base, tiny):
    run()
    tiny.write_text(TINY.replace("3.0 * x", "2.0 * x + x"))
    assert run() == (False, "")


def test_an_edit_between_import_and_use_keeps_nothing(tiny, base):
    """What is in memory is then of other sources than those that stand in the file."""
    spec = importlib.util.spec_from_file_location("tiny", tiny)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    tiny.write_text(TINY.replace("0.5", "0.75"))
    assert module.scaled(2.0) == 6.5
    assert not base.exists()


# Damage.


def shorter(data, rng):
    return data[: rng.randrange(len(data))]


def zeroed(data, rng):
    start = rng.randrange(len(data))
    return data[:start] + bytes(len(data) - start)


def flipped(data, rng):
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def longer(data, rng):
    return data + bytes([rng.randrange(256)])


def emptied(data, rng):
    return b""


@pytest.mark.parametrize("harm", [shorter, zeroed, flipped, longer, emptied])
def test_damaged_code_is_never_loaded_but_made_anew_with_one_line(run, base, harm):
    run()
    path = kept(base)
    good, rng = path.read_bytes(), random.Random(harm.__name__)
    path.write_bytes(harm(good, rng))
    loaded, said = run()
    assert not loaded
    assert DAMAGED in said
    assert said.count("\n") == 1
    assert run() == (True, "")
    home = home_of(OTHERS, base.parents[1] / "tiny.py")
    for _ in range(100):
        spoiled = harm(good, rng)
        path.write_bytes(spoiled)
        assert spoiled == good or home.read(path.name) is None


def test_code_of_another_function_is_damaged_code(run, base, tiny):
    """Files that were exchanged, by a repair of the disk for one."""
    run()
    path = kept(base)
    home = home_of(OTHERS, tiny)
    assert home.read(path.name)
    path.rename(path.with_name(f"another{CODE}"))
    assert home.read(f"another{CODE}") is None


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: os.symlink("/dev/zero", path)])
def test_what_is_no_plain_file_is_not_waited_for(run, base, make):
    run()
    path = kept(base)
    path.unlink()
    make(path)
    loaded, _ = run()
    assert not loaded


# Writing.


def test_two_processes_that_compile_the_same_leave_whole_files(tiny, base):
    """Each writes the file while the other does, many times; whatever a reader finds is whole."""
    write = f"""
from pathlib import Path
from subzero.jit.machine_code import OTHERS, home_of
home = home_of(OTHERS, Path({str(tiny)!r}))
for k in range(100):
    home.keep("same.code", bytes([k % 256]) * 300_000)
    found = home.read("same.code")
    assert found and len(set(found)) == 1 and len(found) == 300_000
"""
    both = [
        subprocess.Popen([sys.executable, "-c", write], stderr=subprocess.PIPE, text=True) for _ in range(2)
    ]
    for one in both:
        assert one.communicate(timeout=120) == (None, "")
        assert one.returncode == 0
    assert [path.name for path in base.rglob("*") if path.is_file()] == ["same.code"]


@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # a file closed by nobody but Python
def test_an_interrupt_while_it_is_written_leaves_the_old_file_or_the_new_one(tiny, base):
    home = home_of(OTHERS, tiny)
    old, new = b"old" * 2_000_000, b"new" * 2_000_000

    def stop(*_):
        raise KeyboardInterrupt

    home.keep("one.code", old)
    before, found, rng = signal.signal(signal.SIGALRM, stop), [], random.Random(1)
    try:
        for _ in range(30):
            home.keep("one.code", old)
            try:
                signal.setitimer(signal.ITIMER_REAL, rng.uniform(1e-5, 0.02))
                home.keep("one.code", new)
                signal.setitimer(signal.ITIMER_REAL, 0.0)
            except KeyboardInterrupt:
                found.append(home.read("one.code"))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    gc.collect()  # an interrupt between the opening of a file and its name leaves it to this
    assert len(found) > 10
    assert set(found) <= {old, new}
    home_of.cache_clear()


# Nowhere to write.


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


def test_a_read_only_cache_without_the_code_says_so_in_one_line(run, base, monkeypatch):
    run()
    kept(base).unlink()
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


# Trust.


def test_folders_are_made_for_this_user_alone(run, base):
    before = os.umask(0)
    try:
        run()
    finally:
        os.umask(before)
    for path in (base.parent, base, kept(base).parent):
        assert stat.S_IMODE(path.stat().st_mode) == 0o700
    assert stat.S_IMODE(kept(base).stat().st_mode) == 0o600


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702])
@pytest.mark.parametrize("which", ["base", "folder"])
def test_a_folder_that_others_may_write_is_not_used_and_one_line_says_what_to_do(run, base, mode, which):
    run()
    path = kept(base)
    (base if which == "base" else path.parent).chmod(mode)
    before = path.stat().st_mtime_ns
    loaded, said = run()
    assert not loaded
    assert NOT_TRUSTED in said
    assert "others may write" in said
    assert "SUBZERO_CACHE_DIR" in said
    assert said.count("\n") == 1
    assert path.stat().st_mtime_ns == before
    path.parent.chmod(0o700)
    base.chmod(0o700)
    assert run() == (True, "")


@needs_root
@pytest.mark.parametrize("which", ["base", "folder"])
def test_a_folder_of_somebody_else_is_not_used_even_by_root(run, base, which):
    run()
    os.chown(base if which == "base" else kept(base).parent, 12345, -1)
    loaded, said = run()
    assert not loaded
    assert "belongs to another user (number 12345)" in said
    assert said.count("\n") == 1


@needs_root
def test_a_file_of_somebody_else_is_not_loaded(run, base):
    run()
    os.chown(kept(base), 12345, -1)
    loaded, said = run()
    assert not loaded
    assert said.count("\n") == 1
    assert kept(base).stat().st_uid == 0  # it is one of ours now
    assert run() == (True, "")


def test_a_file_that_others_may_write_is_not_loaded(run, base):
    run()
    kept(base).chmod(0o666)
    assert run()[0] is False
    assert run() == (True, "")


def test_a_folder_that_is_a_link_is_not_used_but_the_one_above_may_be(run, base, tmp_path):
    run()
    folder = kept(base).parent
    elsewhere = tmp_path / "elsewhere"
    folder.rename(elsewhere)
    folder.symlink_to(elsewhere)
    loaded, said = run()
    assert not loaded
    assert NOT_TRUSTED in said
    folder.unlink()
    elsewhere.rename(folder)
    base.rename(elsewhere)
    base.symlink_to(elsewhere)
    assert run() == (True, "")


NOBODY = 65534


def as_nobody(what):
    """Return what a function gives in a child process of a user without rights."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.setgroups([])
            os.setgid(NOBODY)
            os.setuid(NOBODY)
            os.write(write, repr(what()).encode())
            code = 0
        finally:
            os._exit(code)
    os.close(write)
    said = os.read(read, 9999).decode()
    os.close(read)
    assert os.waitpid(child, 0)[1] == 0
    return said


@needs_root
def test_a_cache_of_root_is_read_by_others_and_a_closed_one_is_done_without(run, base, tiny):
    run()
    for folder in (base, *base.parents):  # pytest's own are closed, too
        if folder in (base, base.parent) or folder.name.startswith(("test_", "pytest-", "popen-")):
            folder.chmod(0o755)
    kept(base).parent.chmod(0o755)
    kept(base).chmod(0o644)
    assert as_nobody(run) == repr((True, ""))
    base.chmod(0o700)
    said = as_nobody(run)
    assert said.startswith("(False")
    assert NOT_KEPT in said
    assert said.count("\\n") == 1


# What is out of use.


def aged(folder, days):
    os.utime(folder, (time.time() - days * 86400.0,) * 2)


def old_folder(base, name, days, files=(f"x{CODE}",)):
    folder = base / name
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        (folder / file).touch()
    folder.mkdir(parents=True, exist_ok=True)
    aged(folder, days)
    return folder


def names(base):
    return {path.name for path in base.iterdir() if not path.name.startswith(OTHERS)}


def test_folders_out_of_use_are_removed_when_a_new_one_is_made(run, base):
    month = OUT_OF_USE_S / 86400.0
    for name, days in {"cable-0123456789ab": month + 1, "vehicle-0123456789ab": month - 1}.items():
        old_folder(
            base, name, days, (f"x{CODE}", f"tmp1{HALF}", "cable_1234/former.nbi", "cable_1234/former.1.nbc")
        )
    run()
    assert names(base) == {"vehicle-0123456789ab"}


def test_of_many_folders_the_newest_stay(run, base):
    for k in range(20):
        old_folder(base, f"cable-{k:012x}", 2.0 + k)
        old_folder(base, f"subzero-{k:012x}", 0.01 * k)  # all of today
    run()
    assert len([name for name in names(base) if name.startswith("subzero")]) == 20
    assert {name for name in names(base) if name.startswith("cable")} == {
        f"cable-{k:012x}" for k in range(KEPT - 1)
    }


def test_a_folder_that_is_used_counts_as_new(run, base):
    run()
    aged(kept(base).parent, 400)
    run()
    assert time.time() - kept(base).parent.stat().st_mtime < 3600


@pytest.mark.parametrize(
    "name", ["cable", "cable-0123456789abc", "cable-0123456789AB", "my-0123456789ab", "notes"]
)
def test_what_does_not_look_like_ours_stays(run, base, name):
    old_folder(base, name, 400)
    run()
    assert (base / name / f"x{CODE}").exists()


def test_what_lies_in_our_folder_and_is_not_ours_stays(run, base):
    old_folder(base, "cable-0123456789ab", 400, (f"x{CODE}", "thesis.tex", "sub/photo.jpg"))
    run()
    left = {
        str(path.relative_to(base)) for path in (base / "cable-0123456789ab").rglob("*") if path.is_file()
    }
    assert left == {"cable-0123456789ab/thesis.tex", "cable-0123456789ab/sub/photo.jpg"}


def test_links_are_not_followed_when_it_is_swept(run, base, tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / f"x{CODE}").touch()
    aged(mine, 400)
    base.mkdir(parents=True, mode=0o700)
    (base / "cable-0123456789ab").symlink_to(mine)
    folder = old_folder(base, "vehicle-0123456789ab", 400)
    (folder / "link").symlink_to(mine)
    aged(folder, 400)
    run()
    assert (mine / f"x{CODE}").exists()


@needs_root
def test_folders_of_somebody_else_stay_even_for_root(run, base):
    folder = old_folder(base, "cable-0123456789ab", 400)
    os.chown(folder, 12345, -1)
    run()
    assert (folder / f"x{CODE}").exists()


# The announcement.


def test_compiling_is_announced_when_something_is_compiled_and_only_then(run, base, tiny, capsys):
    run()
    path = kept(base)

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


COMMAND = "import sys; from subzero.cli import main; sys.exit(main(sys.argv[1:]))"


def command(*words, here, **environment):
    return subprocess.Popen([sys.executable, "-c", COMMAND, *words], cwd=here, env=os.environ | environment,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip


def files_of(base):
    return [path for path in Path(base).rglob("*") if path.is_file()]


@pytest.mark.slow
def test_commands_that_are_killed_while_they_compile_and_run_at_once_leave_a_sound_cache(tmp_path):
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
        assert one.communicate(timeout=600)[1].count("\n") <= 1
        assert one.returncode == 0
    csv = (tmp_path / "whole0/untethered.csv").read_bytes()
    for path in files_of(cache):
        path.write_bytes(rng.choice((shorter, zeroed, flipped, emptied))(path.read_bytes(), rng))
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
